//! Axisymmetry: the hoop direction beside the two of the section (x = r, y the axis, z the hoop).
//!
//! With the hoop rows s_a of the nodes, dF_zz - 1 = Σ s_a u_ar. The third principal axis of the trial
//! strain is the hoop, so that L_zz = d(dF_zz) / dF_zz joins the formula of `tangent.rs` as one more
//! direction: f_a0 += T_zz s_a V and, with A_ijkl of that formula,
//! K_aibk += (g_aj A_ijzz s_b δ_k0 + s_a δ_i0 A_zzkl g_bl + s_a s_b δ_i0 δ_k0 A_zzzz) V. Gradients g and
//! rows s are those of the frame.
//!
//! F-bar acts on all three directions: dF_bar = (det dF_0 / det dF)^(1/3) dF, both determinants with
//! their hoop.

use super::tangent;
use super::update;
use super::{
    Contribution, Dilation, Expansion, Increment, Placement, StepStart, StressState, dilation,
};
use crate::deck::model::Frame;
use crate::tensor::dense::{self, Square};

/// What the hoop direction adds to a point's [`Contribution`].
#[derive(Debug, Clone, Copy)]
pub struct Hoop<const D: usize> {
    /// s of the frame over s of the step's start: 1, 1/dF_zz or F_zz.
    pub map: f64,
    /// T_zz, Pa
    pub stress: f64,
    /// A_ijzz, Pa: what a hoop strain does to the section.
    pub from: Square<D>,
    /// A_zzkl, Pa
    pub onto: Square<D>,
    /// A_zzzz, Pa
    pub own: f64,
    /// With F-bar what it adds.
    pub dilation: Option<Dilation<D>>,
}

/// dF_bar - 1 of a ring, the hoop's last, from dF - 1 and det dF_0 - 1 with its hoop. Not a number where a
/// determinant is not positive.
#[inline]
pub fn averaged<const D: usize>(own: Increment<'_, D>, common: f64) -> (Square<D>, f64) {
    let growth = dilation::growth(dilation::volume_change(own), common, 3);
    (dilation::grown(own.block, growth), own.hoop + growth * (1.0 + own.hoop))
}

/// Stress and tangent of a ring in `frame`; with F-bar where det dF_0 - 1 of the cells is given, with its
/// hoop. Limits as in [`super::stress`].
#[inline]
pub fn ring_contribution<const D: usize>(
    frame: Frame,
    start: &StepStart,
    increment: Increment<'_, D>,
    common: Option<f64>,
) -> (Contribution<D>, Hoop<D>, StressState) {
    let ring = Ring::new(frame, start, increment, common);
    let (contribution, mut hoop) = ring.contribution();
    hoop.dilation = common.map(|_| {
        let back = (&ring.placement.back, ring.back);
        let sums = tangent::sums(&ring.update.response, 3);
        let moduli = sums.expansion(&ring.update, back, ring.placement.scale);
        Dilation::new(moduli, 1.0 / 3.0, increment)
    });
    (contribution, hoop, ring.update.state(&start.material))
}

/// [`super::shared_contribution`] of a ring; `common`: det dF_0 - 1 with the hoop.
#[inline]
pub fn shared_ring_contribution<const D: usize>(
    frame: Frame,
    start: &StepStart,
    increment: Increment<'_, D>,
    common: f64,
) -> (Contribution<D>, Hoop<D>, Expansion<D>, StressState) {
    let mut ring = Ring::new(frame, start, increment, Some(common));
    let state = ring.update.state(&start.material);
    let response = &mut ring.update.response;
    let sums = tangent::sums(response, 3).take_from(response, 3);
    let back = (&ring.placement.back, ring.back);
    let share = sums.expansion(&ring.update, back, ring.placement.scale);
    let (contribution, hoop) = ring.contribution();
    (contribution, hoop, share, state)
}

/// A ring's material after the step, and how the frame lies to the current state.
struct Ring<const D: usize> {
    update: update::Update,
    placement: Placement<D>,
    /// s of the frame over s of the step's start
    map: f64,
    /// dy/dx along the hoop
    back: f64,
}

impl<const D: usize> Ring<D> {
    /// With F-bar where det dF_0 - 1 is given.
    #[inline(always)]
    fn new(
        frame: Frame,
        start: &StepStart,
        increment: Increment<'_, D>,
        common: Option<f64>,
    ) -> Self {
        let bar = common.map(|common| averaged(increment, common));
        let straining =
            bar.as_ref().map_or(increment, |(block, hoop)| Increment { block, hoop: *hoop });
        let update = update::update(start, straining);
        let growth = 1.0 + increment.hoop;
        let placement = Placement::new(frame, start, &dense::plus_unit(increment.block), growth);
        let start_zz = start.deformation_gradient[(2, 2)];
        let (map, back) = match frame {
            Frame::Previous => (1.0, 1.0 / growth),
            Frame::Updated => (1.0 / growth, 1.0),
            Frame::Total => (start_zz, 1.0 / (start_zz * growth)),
        };
        Ring { update, placement, map, back }
    }

    #[inline(always)]
    fn contribution(&self) -> (Contribution<D>, Hoop<D>) {
        let Ring { update, placement, map, back } = self;
        let scale = placement.scale * back;
        let stress = update.response.stress[2];
        let (from, onto) = tangent::coupling(update, &placement.back, scale);
        let own = scale * back * (update.response.tangent[2][2] - stress);
        let hoop = Hoop { map: *map, stress: scale * stress, from, onto, own, dilation: None };
        (placement.contribution(update), hoop)
    }
}
