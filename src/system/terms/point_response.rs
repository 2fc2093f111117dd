//! Stress, tangent and volume of one point for an increment of its deformation (Lagrangian eq. 16-23), in the forms that
//! the sums of `stress.rs` and the plain ones beside them take.

use crate::deck::model::{Frame, PointVolume};
use crate::material::local;
use crate::mechanics::{
    self, Contribution, Dilation, Expansion, Hoop, Increment, StepStart, StressState,
};
use crate::points::Points;
use crate::system::step_points::StepPoints;
use crate::tensor::dense;

use super::term::Health;

/// Stress and tangent of a point; `None`, and a note in `health`, if the stress is not finite.
#[inline(always)]
pub(crate) fn respond<const D: usize>(
    step: StepPoints<'_, D>,
    frame: Frame,
    p: usize,
    increment: &[[f64; D]; D],
    health: &mut Health,
) -> Option<Contribution<D>> {
    let (contribution, state) = mechanics::contribution(frame, &start(step, p), increment);
    sound(p, increment.into(), &state, health).then_some(contribution)
}

/// [`respond`] of a ring, with F-bar where det dF_0 - 1 is given.
pub(crate) fn respond_ring<const D: usize>(
    step: StepPoints<'_, D>,
    frame: Frame,
    p: usize,
    increment: Increment<'_, D>,
    common: Option<f64>,
    health: &mut Health,
) -> Option<(Contribution<D>, Hoop<D>)> {
    let (contribution, hoop, state) =
        mechanics::ring_contribution(frame, &start(step, p), increment, common);
    sound(p, increment, &state, health).then_some((contribution, hoop))
}

/// [`respond_ring`] for the assembly, with F-bar in two parts where det dF_0 - 1 is given.
#[inline(always)]
pub(super) fn respond_ring_shared<const D: usize>(
    step: StepPoints<'_, D>,
    frame: Frame,
    p: usize,
    increment: Increment<'_, D>,
    common: Option<f64>,
    health: &mut Health,
) -> Option<(Contribution<D>, Hoop<D>, Option<Expansion<D>>)> {
    let Some(common) = common else {
        let (contribution, hoop) = respond_ring(step, frame, p, increment, None, health)?;
        return Some((contribution, hoop, None));
    };
    let (contribution, hoop, share, state) =
        mechanics::shared_ring_contribution(frame, &start(step, p), increment, common);
    sound(p, increment, &state, health).then_some((contribution, hoop, Some(share)))
}

/// [`respond`] with F-bar, in two parts, to dF - 1 and det dF_0 - 1 of its cells.
#[inline(always)]
pub(super) fn respond_shared<const D: usize>(
    step: StepPoints<'_, D>,
    frame: Frame,
    p: usize,
    increment: &[[f64; D]; D],
    common: f64,
    health: &mut Health,
) -> Option<(Contribution<D>, Expansion<D>)> {
    let (contribution, share, state) =
        mechanics::shared_contribution(frame, &start(step, p), increment, common);
    sound(p, increment.into(), &state, health).then_some((contribution, share))
}

/// [`respond`] with F-bar as the formulas read, to dF - 1 and det dF_0 - 1 of its cells.
pub(crate) fn respond_averaged<const D: usize>(
    step: StepPoints<'_, D>,
    frame: Frame,
    p: usize,
    increment: &[[f64; D]; D],
    common: f64,
    health: &mut Health,
) -> Option<(Contribution<D>, Dilation<D>)> {
    let (contribution, dilation, state) =
        mechanics::averaged_contribution(frame, &start(step, p), increment, common);
    sound(p, increment.into(), &state, health).then_some((contribution, dilation))
}

#[inline(always)]
fn start<const D: usize>(step: StepPoints<'_, D>, p: usize) -> StepStart<'_> {
    let points = step.points;
    StepStart {
        material: local(step.materials, points, p),
        state: points.state.of(p, points.body[p]),
        deformation_gradient: &points.deformation_gradient[p],
        elastic_excess: &points.elastic_excess[p],
        volume_initial: start_volume(step, p),
    }
}

/// Notes in `health` what is wrong with a point; false if its stress is not finite.
#[inline(always)]
fn sound<const D: usize>(
    p: usize,
    increment: Increment<'_, D>,
    state: &StressState,
    health: &mut Health,
) -> bool {
    let inverted = dense::determinant(&dense::plus_unit(increment.block)) <= 0.0;
    if inverted || increment.hoop <= -1.0 {
        health.inverted.get_or_insert(p);
    }
    let finite = state.kirchhoff_stress.iter().all(|t| t.is_finite());
    if !finite {
        health.not_finite.get_or_insert(p);
    }
    finite
}

/// The initial volume that forces of point `p` are integrated over, m3.
#[inline(always)]
pub(crate) fn start_volume<const D: usize>(step: StepPoints<'_, D>, p: usize) -> f64 {
    match step.volume {
        PointVolume::Deformation => step.points.volume_initial[p],
        PointVolume::Domain => domain_volume(step.points, p),
    }
}

/// V_d / det F, with V_d the volume of the domain at the step's start, m3.
#[cold]
fn domain_volume<const D: usize>(points: &Points<D>, p: usize) -> f64 {
    let (now, start) = (&points.half_length[p], &points.half_length_initial[p]);
    let ratio: f64 = now.iter().zip(start).map(|(now, start)| now / start).product();
    // A ring's hoop is no side of its domain.
    let gradient = &points.deformation_gradient[p];
    let hoop = if D == 2 { gradient[(2, 2)] } else { 1.0 };
    points.volume_initial[p] * ratio * hoop / gradient.determinant()
}
