//! Is a step's end sound? A step that would turn a point or a domain inside out, carry it out of the grid or leave it
//! without a number is refused as a whole.

use crate::basis;
use crate::basis::domain::DomainStep;
use crate::deck::figure;
use crate::deck::model::{Basis, Boundary, GimpEdge, Place};
use crate::deck::schema::{AXES, SIDES};
use crate::error::Result;
use crate::grid::Grid;
use crate::parallel::World;
use crate::points::Points;
use crate::system::numbering::Numbering;
use crate::tensor::dense;

use super::mapping::Deformation;
use super::refusal::{Cause, Refusal};
use super::update::{Increments, nodal_displacement};

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
