//! Grid to points at the end of a step (Ghost Figure 1 e, f; Lagrangian eq. 16, 31): deformation,
//! stress, position, domain.

use nalgebra::Matrix3;

use crate::basis;
use crate::basis::domain::DomainStep;
use crate::deck::model::Symmetry;
use crate::error::Result;
use crate::material::{Material, local};
use crate::mechanics::{
    self, BATCH, Increment, StepStart, StressState, dilation, displacement_gradient, ring,
};
use crate::points::Points;
use crate::system::model::Model;
use crate::system::numbering::Numbering;
use crate::system::step_points::StepPoints;

use super::mapping::{self, Deformation};
use crate::points::Snapshot;
use crate::points::former::Former;

/// Increments at each point of this rank, computed but not yet applied.
pub struct Increments<const D: usize> {
    /// dF - 1
    pub deformation: Deformation<D>,
    /// dF_bar - 1, what stress and b_e follow; empty without F-bar, where dF does it.
    pub averaged: Deformation<D>,
    /// m
    pub displacement: Vec<[f64; D]>,
    /// Where the corners of `cpdi2` domains go, m; empty until [`require_sound_domains`](super::soundness::require_sound_domains) has found it.
    pub corners: Vec<[[f64; D]; 8]>,
}

impl<const D: usize> Increments<D> {
    /// Of dF - 1 and dF_bar - 1 the one that stress and b_e follow.
    pub fn straining(&self) -> &Deformation<D> {
        straining(&self.deformation, &self.averaged)
    }
}

/// Of dF - 1 and dF_bar - 1, which is empty without F-bar, the one that stress and b_e follow.
pub fn straining<'a, const D: usize>(
    deformation: &'a Deformation<D>,
    averaged: &'a Deformation<D>,
) -> &'a Deformation<D> {
    if averaged.blocks.is_empty() { deformation } else { averaged }
}

/// Energies of this rank's points, J (J/m in plane strain).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PointEnergies {
    /// Stored elastically.
    pub strain: f64,
    /// Dissipated since the start.
    pub plastic: f64,
    /// Of the motion.
    pub kinetic: f64,
}

/// Maps nodal increments (local nodes) to the points.
pub fn increments<const D: usize>(step: StepPoints<'_, D>, displacement: &[f64]) -> Increments<D> {
    let count = step.points.len();
    let mut made = Increments {
        deformation: Deformation { blocks: Vec::with_capacity(count), ..Deformation::default() },
        averaged: Deformation::default(),
        displacement: Vec::with_capacity(count),
        corners: Vec::new(),
    };
    for p in 0..count {
        let row = step.influences.row(p);
        let nodes = step.nodes_of(p);
        let nodal = |a: usize| -> [f64; D] {
            let start = nodes[a] as usize * D;
            std::array::from_fn(|i| displacement[start + i])
        };
        made.deformation
            .blocks
            .push(displacement_gradient(&step.influences.gradients[row.clone()], nodal));
        let mut moved = [0.0; D];
        for (a, weight) in step.influences.weights[row].iter().enumerate() {
            for (m, u) in moved.iter_mut().zip(nodal(a)) {
                *m += weight * u;
            }
        }
        made.displacement.push(moved);
    }
    if !step.influences.hoop.is_empty() {
        made.deformation.hoops = mapping::hoop_increments(step, displacement);
        made.displacement = mapping::displacements_of_rings(step, displacement);
    }
    let common = mapping::common_changes(step, displacement, None);
    made.averaged = averaged(&common, &made.deformation);
    made
}

/// dF_bar - 1 at each point, from det dF_0 - 1 of its cells ([`mapping::common_changes`]); empty without F-bar.
pub fn averaged<const D: usize>(common: &[f64], deformation: &Deformation<D>) -> Deformation<D> {
    let mut made = Deformation::default();
    for ((own, &common), p) in deformation.blocks.iter().zip(common).zip(0..) {
        let Some(&hoop) = deformation.hoops.get(p) else {
            made.blocks.push(dilation::within(own, common));
            continue;
        };
        let (block, hoop) = ring::averaged(Increment { block: own, hoop }, common);
        made.blocks.push(block);
        made.hoops.push(hoop);
    }
    made
}

/// At a node of the grid in the field of a body, m; zero where no equation lives.
pub(super) fn nodal_displacement<const D: usize>(
    numbering: &Numbering,
    displacement: &[f64],
    (body, node): (usize, usize),
) -> [f64; D] {
    match numbering.local_of(body, node) {
        Some(local) => std::array::from_fn(|i| displacement[local * D + i]),
        None => [0.0; D],
    }
}

/// Applies the increments: F, b_e, stress, history, domains, positions. What they overwrite is kept
/// where a snapshot `before` is given, here and below.
pub fn apply<const D: usize>(
    model: &Model<D>,
    numbering: &Numbering,
    displacement: &[f64],
    increments: &Increments<D>,
    points: &mut Points<D>,
    mut before: Option<&mut Snapshot<D>>,
) -> Result<()> {
    stretch(&increments.deformation, points, before.as_deref_mut());
    respond(&model.materials, increments.straining(), points, before.as_deref_mut());
    follow(model, numbering, displacement, increments, points, before.as_deref_mut())?;
    move_points(&increments.displacement, points, before);
    Ok(())
}

/// F of the increments dF - 1 alone: what [`follow`] reads.
pub fn stretch<const D: usize>(
    increments: &Deformation<D>,
    points: &mut Points<D>,
    before: Option<&mut Snapshot<D>>,
) {
    let after = |old: &Matrix3<f64>, increment: &[[f64; D]; D]| {
        // The rows and columns beyond D are those of the identity.
        let mut gradient = *old;
        for j in 0..3 {
            for i in 0..D {
                gradient[(i, j)] =
                    old[(i, j)] + (0..D).map(|k| increment[i][k] * old[(k, j)]).sum::<f64>();
            }
        }
        gradient
    };
    overwrite(
        &mut points.deformation_gradient,
        before.map(|before| &mut before.deformation_gradient),
        &increments.blocks,
        after,
    );
    for (gradient, hoop) in points.deformation_gradient.iter_mut().zip(&increments.hoops) {
        gradient[(2, 2)] += hoop * gradient[(2, 2)];
    }
}

/// Each value of an array from the old one and what it meets in `with`.
fn overwrite<T: Copy, W>(
    values: &mut Vec<T>,
    former: Option<&mut Former<T>>,
    with: &[W],
    after: impl Fn(&T, &W) -> T,
) {
    match former {
        Some(former) => {
            former.set_aside(values);
            for ((value, old), with) in values.iter_mut().zip(former.values()).zip(with) {
                *value = after(old, with);
            }
        }
        None => {
            for (value, with) in values.iter_mut().zip(with) {
                *value = after(value, with);
            }
        }
    }
}

/// b_e, stress and history of the increments dF - 1 (Lagrangian eq. 16); returns the energies of the
/// new state, all but the kinetic one.
pub fn respond<const D: usize>(
    materials: &[Material],
    increments: &Deformation<D>,
    points: &mut Points<D>,
    mut before: Option<&mut Snapshot<D>>,
) -> PointEnergies {
    if let Some(before) = &mut before {
        before.elastic_excess.set_aside(&mut points.elastic_excess);
        before.kirchhoff_stress.set_aside(&mut points.kirchhoff_stress);
        before.plastic_strain.set_aside(&mut points.plastic_strain);
        before.dissipation.set_aside(&mut points.dissipation);
        before.state.set_aside(&mut points.state.values);
    }
    let before = before.as_deref();
    let mut sum = PointEnergies::default();
    let mut states = [StressState::default(); BATCH];
    for (batch, blocks) in increments.blocks.chunks(BATCH).enumerate() {
        let first = batch * BATCH;
        let hoops = increments.hoops.get(first..first + blocks.len()).unwrap_or_default();
        let elastic = match before {
            Some(before) => before.elastic_excess.values(),
            None => &points.elastic_excess,
        };
        let start = |k: usize| StepStart {
            material: local(materials, points, first + k),
            state: match before {
                Some(before) if points.state.stride() > 0 => {
                    let former = before.state.values();
                    points.state.of_former(former, first + k, points.body[first + k])
                }
                _ => points.state.of(first + k, points.body[first + k]),
            },
            deformation_gradient: &points.deformation_gradient[first + k],
            elastic_excess: &elastic[first + k],
            volume_initial: points.volume_initial[first + k],
        };
        mechanics::stresses(start, blocks, hoops, &mut states);
        for (p, state) in (first..first + blocks.len()).zip(&states) {
            let (strain, lost) = match before {
                Some(before) => (before.plastic_strain.values()[p], before.dissipation.values()[p]),
                None => (points.plastic_strain[p], points.dissipation[p]),
            };
            points.elastic_excess[p] = state.elastic_excess;
            points.kirchhoff_stress[p] = state.kirchhoff_stress;
            points.plastic_strain[p] = strain + state.plastic_increment;
            points.dissipation[p] = lost + state.dissipation;
            points.state.set(p, &state.state);
            sum.strain += state.stored_energy * points.volume_initial[p];
            sum.plastic += points.dissipation[p] * points.volume_initial[p];
        }
    }
    sum
}

/// Lets the domains follow the deformation (Lagrangian eq. 32-39); the positions are still
/// those of the step's start. `displacement` is the one that made the increments, which
/// [`require_sound_domains`](super::soundness::require_sound_domains) has passed. Returns how many domains had grown far beyond the stretch.
pub fn follow<const D: usize>(
    model: &Model<D>,
    numbering: &Numbering,
    displacement: &[f64],
    increments: &Increments<D>,
    points: &mut Points<D>,
    before: Option<&mut Snapshot<D>>,
) -> Result<usize> {
    let method = &model.deck.method;
    let carried = !increments.corners.is_empty();
    if let Some(before) = before {
        before.half_length.copy(&points.half_length);
        if carried {
            before.corners.set_aside(&mut points.corners);
        }
    }
    if carried {
        points.corners.copy_from_slice(&increments.corners);
    }
    let Increments { deformation, displacement: moved, .. } = increments;
    // With a single field it is no matter whose node it is.
    let bodies = if numbering.fields.is_single() { Vec::new() } else { points.body.clone() };
    let body = |p: usize| bodies.get(p).map_or(0, |body| *body as usize);
    let step = DomainStep {
        grids: [&model.grid; 2],
        increments: &deformation.blocks,
        moved,
        nodal: &|p, node| nodal_displacement(numbering, displacement, (body(p), node)),
        rings: model.deck.analysis.symmetry == Symmetry::Axisymmetric,
    };
    basis::of_deck(method.basis, method.gimp_edge).update_domains(
        method.domain_update,
        &step,
        points,
    )
}

/// Lagrangian eq. 31, Ghost eq. 9, 14.
pub fn move_points<const D: usize>(
    displacement: &[[f64; D]],
    points: &mut Points<D>,
    before: Option<&mut Snapshot<D>>,
) {
    let former = before.map(|before| &mut before.position);
    overwrite(&mut points.position, former, displacement, |x, moved| {
        std::array::from_fn(|i| x[i] + moved[i])
    });
}

/// Energies of this rank's points at their present state.
pub fn energies<const D: usize>(points: &Points<D>, materials: &[Material]) -> PointEnergies {
    let mut sum = PointEnergies::default();
    for p in 0..points.len() {
        let energy = local(materials, points, p).energy(points.elastic_strain(p));
        sum.strain += energy * points.volume_initial[p];
        sum.plastic += points.dissipation[p] * points.volume_initial[p];
        let speed: f64 = points.velocity[p].iter().map(|v| v * v).sum();
        sum.kinetic += 0.5 * points.mass[p] * speed;
    }
    sum
}
