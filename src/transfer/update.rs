//! Grid to points at the end of a step (Ghost Figure 1 e, f; Lagrangian eq. 16, 31): deformation,
//! stress, position, domain. A step that would leave an unsound point is refused as a whole.

use nalgebra::Matrix3;

use crate::basis;
use crate::basis::domain::DomainStep;
use crate::deck::figure;
use crate::deck::model::{Basis, Boundary, GimpEdge, Place, Symmetry};
use crate::deck::schema::{AXES, SIDES};
use crate::error::Result;
use crate::grid::Grid;
use crate::material::{Material, local};
use crate::mechanics::{self, BATCH, Increment, StepStart, StressState, dilation, ring};
use crate::parallel::World;
use crate::points::Points;
use crate::system::model::Model;
use crate::system::numbering::Numbering;
use crate::system::terms::stress::{StepPoints, displacement_gradient};
use crate::tensor::dense;

use super::mapping::{self, Deformation};
use super::refusal::{Cause, Refusal};
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
    /// Where the corners of `cpdi2` domains go, m; empty until [`require_sound_domains`] has found it.
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

/// How a refusal says that no boundary keeps points from leaving through a side.
pub const NOT_HELD: &str = "no boundary holds that side";

/// Refuses increments with a NaN, an inverted point or a point outside the grid (as it is after the step). The
/// text about a point outside names the one of the `boundaries` that holds that side. Collective.
pub fn require_sound<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    boundaries: &[Boundary],
    points: &Points<D>,
    increments: &Increments<D>,
) -> std::result::Result<(), Refusal> {
    let moved = |p: usize| -> [f64; D] {
        let x = points.position[p];
        std::array::from_fn(|a| x[a] + increments.displacement[p][a])
    };
    let Increments { deformation, averaged, .. } = increments;
    // Neighbours in the list are mostly neighbours in space.
    let mut near = None;
    let sound = |p: usize| {
        let moved = moved(p);
        if !moved.iter().all(|m| m.is_finite()) || !is_sound(p, deformation, averaged) {
            return false;
        }
        near = grid.locate_near(&moved, near);
        near.is_some()
    };
    require(world, points, sound, |p| {
        let moved = moved(p);
        if moved.iter().any(|m| !m.is_finite()) {
            return IncrementFault::NotFinite;
        }
        let leaves =
            || format!("{}: it would move to {moved:?} m", way_out(grid, boundaries, &moved));
        fault_of(p, deformation, averaged).unwrap_or_else(|| IncrementFault::Leaves(leaves()))
    })
}

/// Through which side of the grid a place outside lies, and what is known of that side.
fn way_out<const D: usize>(grid: &Grid<D>, boundaries: &[Boundary], place: &[f64; D]) -> String {
    let (low, high) = grid.bounds();
    let beyond = |axis: usize| (place[axis] - high[axis]).max(low[axis] - place[axis]);
    let axis = (0..D).max_by(|&a, &b| beyond(a).total_cmp(&beyond(b))).unwrap_or(0);
    if beyond(axis) <= 0.0 {
        return "through its surface, between its outermost points".to_string();
    }
    let upper = place[axis] > high[axis];
    let (side, name) = (SIDES[2 * axis + usize::from(upper)], AXES[axis]);
    let end = if upper { high[axis] } else { low[axis] };
    let holds = |boundary: &&Boundary| {
        let there = match &boundary.place {
            Place::Side { axis: a, upper: u } => (*a, *u) == (axis, upper),
            Place::Box { min, max } => min[axis] <= end && end <= max[axis],
            Place::Tag(_) => matches!(grid, Grid::Mesh(_)),
            Place::CellsOf { .. } | Place::Surface(_) => false,
        };
        let moves = boundary.displacement.iter().any(|(component, _)| *component == axis);
        there && (moves || boundary.fix.contains(&axis) || boundary.rotation.is_some())
    };
    let known = match boundaries.iter().find(holds) {
        Some(boundary) => format!(
            "though boundary \"{}\" prescribes {name} there: the step is too large, or unstable",
            boundary.name
        ),
        None => format!(
            "as {NOT_HELD}; a [[boundary]] with where = {{ side = \"{side}\" }} and fix = [\"{name}\"] \
             makes it a wall, a larger grid gives room"
        ),
    };
    format!("through its {side} side ({name} = {} m), {known}", figure(end))
}

/// [`require_sound`] of dF - 1 alone. Collective.
pub fn require_sound_deformation<const D: usize>(
    world: &World,
    points: &Points<D>,
    deformation: &Deformation<D>,
    averaged: &Deformation<D>,
) -> std::result::Result<(), Refusal> {
    let sound = |p: usize| is_sound(p, deformation, averaged);
    // What is not sound and has no other fault is not finite.
    let fault = |p: usize| fault_of(p, deformation, averaged).unwrap_or(IncrementFault::NotFinite);
    require(world, points, sound, fault)
}

/// What is wrong with the increment of a point.
enum IncrementFault {
    NotFinite,
    /// det dF
    Inverted(f64),
    /// det dF_0 is not positive.
    Centre,
    /// To where, m.
    Leaves(String),
}

/// Whether [`fault_of`] finds nothing. Nearly every point passes, so that this test takes few operations.
#[inline(always)]
fn is_sound<const D: usize>(
    p: usize,
    deformation: &Deformation<D>,
    averaged: &Deformation<D>,
) -> bool {
    if !deformation.hoops.is_empty() || !averaged.blocks.is_empty() {
        return fault_of(p, deformation, averaged).is_none();
    }
    let section = dense::determinant(&dense::plus_unit(&deformation.blocks[p]));
    section > 0.0 && section < f64::INFINITY
}

#[inline(never)]
fn fault_of<const D: usize>(
    p: usize,
    deformation: &Deformation<D>,
    averaged: &Deformation<D>,
) -> Option<IncrementFault> {
    let hoop = 1.0 + deformation.hoops.get(p).copied().unwrap_or(0.0);
    let section = dense::determinant(&dense::plus_unit(&deformation.blocks[p]));
    if !(section * hoop).is_finite() {
        return Some(IncrementFault::NotFinite);
    }
    if section <= 0.0 || hoop <= 0.0 {
        return Some(IncrementFault::Inverted(section * hoop));
    }
    let finite = |h: &[[f64; D]; D]| h.as_flattened().iter().all(|v| v.is_finite());
    let unsound = averaged.blocks.get(p).is_some_and(|h| !finite(h))
        || averaged.hoops.get(p).is_some_and(|h| !h.is_finite());
    unsound.then_some(IncrementFault::Centre)
}

/// Refuses the first point of the lowest rank that is not `sound`, with its fault. Collective.
fn require<const D: usize>(
    world: &World,
    points: &Points<D>,
    mut sound: impl FnMut(usize) -> bool,
    fault: impl Fn(usize) -> IncrementFault,
) -> std::result::Result<(), Refusal> {
    let found = (0..points.len()).find(|&p| !sound(p)).map(|p| (p, fault(p)));
    let inverted = matches!(found, Some((_, IncrementFault::Inverted(_) | IncrementFault::Centre)));
    let not_finite = matches!(found, Some((_, IncrementFault::NotFinite)));
    let message = found.map(|(p, fault)| {
        let what = match fault {
            IncrementFault::NotFinite => "has a displacement that is not finite".to_string(),
            IncrementFault::Inverted(determinant) => {
                format!("is turned inside out (det dF = {determinant:.3e})")
            }
            IncrementFault::Centre => {
                "is in cells that are turned inside out on the mean (det dF_0 <= 0)".to_string()
            }
            IncrementFault::Leaves(way) => format!("leaves the grid {way}"),
        };
        format!("point {} at {:?} {what}", points.id[p], points.position[p])
    });
    let Some(what) = world.first_message(message) else { return Ok(()) };
    let cause = match (world.any(inverted), world.any(not_finite)) {
        (true, _) => Cause::Inverted,
        (_, true) => Cause::NotFinite,
        _ => Cause::Leaves,
    };
    Err(Refusal { cause, what })
}

/// The first point of this rank whose state is not a number, if any.
pub fn not_finite<const D: usize>(points: &Points<D>) -> Option<String> {
    let p = (0..points.len()).find(|&p| {
        let sound = points.velocity[p].iter().chain(&points.kirchhoff_stress[p]);
        !sound.chain(&points.position[p]).all(|value| value.is_finite())
    })?;
    Some(format!(
        "point {} at {:?} m has velocity {:?} m/s, which with its stress is not finite",
        points.id[p], points.position[p], points.velocity[p]
    ))
}

/// Refuses a step that would turn a CPDI domain over or carry it out of the second of the `grids`, that
/// of the next step; otherwise notes in `increments` where the corners of `cpdi2` go. `displacement`:
/// local nodes, m. Collective.
pub fn require_sound_domains<const D: usize>(
    world: &World,
    grids: [&Grid<D>; 2],
    basis: Basis,
    numbering: &Numbering,
    displacement: &[f64],
    points: &Points<D>,
    increments: &mut Increments<D>,
) -> std::result::Result<(), Refusal> {
    let functions = basis::of_deck::<D>(basis, GimpEdge::Continued);
    if !functions.domains_deform() {
        return Ok(());
    }
    let body = |p: usize| points.body[p] as usize;
    let nodal = |p, node| nodal_displacement(numbering, displacement, (body(p), node));
    let Increments { deformation, displacement: moved, corners, .. } = increments;
    let rings = !deformation.hoops.is_empty();
    let step = DomainStep { grids, increments: &deformation.blocks, moved, nodal: &nodal, rings };
    let mut hint = None;
    let mut check = |p: usize| -> Result<()> {
        corners.extend(functions.check_domain(&step, points, p, &mut hint)?);
        Ok(())
    };
    let reason = (0..points.len()).find_map(|p| check(p).err());
    match world.first_message(reason.map(|error| error.to_string())) {
        Some(what) => Err(Refusal { cause: Cause::Domain, what }),
        None => Ok(()),
    }
}

/// At a node of the grid in the field of a body, m; zero where no equation lives.
fn nodal_displacement<const D: usize>(
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
/// [`require_sound_domains`] has passed. Returns how many domains had grown far beyond the stretch.
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
