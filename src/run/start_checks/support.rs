//! Do the conditions hold every connected piece of the material against rigid motion? Found before
//! anything is solved or written: a quasi-static system that a rigid motion solves is singular.

use crate::basis::{self, radial};
use crate::contact::fields::Fields;
use crate::contact::law::Friction;
use crate::deck::Presence;
use crate::deck::model::{Load, Symmetry};
use crate::error::{Error, Result};
use crate::ghost::FaceStencil;
use crate::parallel::World;
use crate::points::Points;
use crate::system::conditions::{Conditions, StepSpan};
use crate::system::facing;
use crate::system::model::Model;
use crate::system::numbering::{Numbering, Touched};
use crate::system::populated::Populated;
use crate::system::rim::Rim;
use crate::system::step_system;
use crate::system::terms::contact::TOUCH;
use crate::system::unknowns::Unknowns;

use super::holders::{Pieces, Touch};
use super::pieces;
use super::rigid_motions::{Extent, Restraints};

/// An error where a rigid motion solves the first step's equations. Collective.
pub fn require<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    active: &(Populated, Numbering),
    first: StepSpan,
) -> Result<()> {
    let found = match model.facing.is_empty() {
        true => loose(world, model, points, active, first, (None, &[]))?,
        false => loose_on_others(world, model, points, first)?,
    };
    let touched = match (model.contacts.is_empty(), model.facing.is_empty()) {
        (true, true) => "",
        (false, true) => ", nor a rigid body that it touches",
        (_, false) => ", nor a body that it touches",
    };
    match found {
        None => Ok(()),
        Some((what, motion)) => Err(Error::Input(format!(
            "{what} can {motion} freely: no boundary holds the nodes around it against this{touched}, \
             so that the quasi-static system is singular; check the places and components of \
             [[boundary]]"
        ))),
    }
}

/// [`loose`] where bodies touch each other: of each field alone, while the others stay where they are and hold it along
/// their surfaces' normals or, with friction, along all axes. What is free so is free with the others moving, too.
/// Collective.
fn loose_on_others<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    first: StepSpan,
) -> Result<Option<(String, String)>> {
    let (contacts, method) = (&model.contacts, &model.deck.method);
    let basis = basis::of_deck(method.basis, method.gimp_edge);
    let mut influences = world.fail_together(basis.map_points(&model.grid, points))?;
    if contacts.rings {
        let turned = radial::make_rings(&model.grid, &*basis, points, &mut influences);
        world.fail_together(turned)?;
    }
    let near = facing::find(world, model, points, &influences)?;
    for field in 0..contacts.fields.count() {
        let own = |p: usize| contacts.fields.of_body(points.body[p] as usize) == field;
        let there: Vec<usize> = (0..points.len()).filter(|&p| own(p)).collect();
        if world.sum_usize(there.len()) == 0 {
            continue;
        }
        let touches = near.iter().filter_map(|couple| {
            let pair = &contacts.body_pairs[couple.pair];
            let meets = couple.gap <= TOUCH * model.grid.cell_size() && own(couple.point);
            let in_field = |node: &&usize| contacts.fields.of_node(**node) == field;
            let node = couple.nodes.iter().find(in_field)?;
            (meets && pair.presence.holds_in(first.stage)).then(|| Touch {
                node: contacts.fields.place(*node),
                place: couple.place,
                normal: couple.normal,
                rubs: pair.friction != Friction::Smooth,
            })
        });
        let touches: Vec<Touch<D>> = touches.collect();
        let mut alone = points.clone();
        alone.select(&there);
        let active = step_system::active(world, model, &alone)?;
        let found = loose(world, model, &alone, &active, first, (None, &touches))?;
        if found.is_some() {
            return Ok(found);
        }
    }
    Ok(None)
}

/// [`require`] of the later stages, with the bodies where they are at the start: what goes may be
/// what others hang on. Collective.
pub fn require_later<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
) -> Result<()> {
    let deck = &model.deck;
    for (stage, of_deck) in deck.stages.iter().enumerate().skip(1) {
        let changes =
            |presence: &Presence| presence.comes_in(stage) || presence.until == Some(stage);
        let bodies = deck.bodies.iter().map(|body| &body.presence);
        let boundaries = deck.boundaries.iter().map(|boundary| &boundary.presence);
        let pairs = model.contacts.pairs.iter().map(|pair| &pair.presence);
        if !bodies.chain(boundaries).chain(pairs).any(changes) {
            continue;
        }
        let mut there = points.clone();
        there.append(&model.waiting);
        let holds = |body: u32| deck.bodies[body as usize].presence.holds_in(stage);
        let kept: Vec<usize> = (0..there.len()).filter(|&p| holds(there.body[p])).collect();
        there.select(&kept);
        let active = step_system::active(world, model, &there)?;
        let span = StepSpan {
            stage,
            factor_start: 0.0,
            factor_end: 1.0,
            time_start: stage as f64,
            time_end: stage as f64 + 1.0,
        };
        require(world, model, &there, &active, span).map_err(|error| match error {
            Error::Input(text) => {
                let name = &of_deck.name;
                Error::Input(format!("in stage \"{name}\", without what has gone by then: {text}"))
            }
            other => other,
        })?;
    }
    Ok(())
}

/// In dynamics: a warning of a body that falls, as nothing holds it where gravity pulls. Collective.
pub fn falls<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    active: &(Populated, Numbering),
    first: StepSpan,
) -> Result<Option<String>> {
    let mut pulled = [false; D];
    if !model.contacts.is_empty() || !model.contacts.body_pairs.is_empty() {
        // It falls onto something.
        return Ok(None);
    }
    for load in &model.deck.loads {
        if let Load::Gravity(gravity) = load {
            pulled
                .iter_mut()
                .zip(&gravity.0)
                .for_each(|(pulled, g)| *pulled |= g.as_constant() != Some(0.0));
        }
    }
    if !pulled.contains(&true) {
        return Ok(None);
    }
    let loose = loose(world, model, points, active, first, (Some(pulled), &[]))?;
    Ok(loose.map(|(what, motion)| {
        format!(
            "{what} can {motion} freely under gravity: no boundary holds the nodes around it at the \
             start; if it is not to fall, check the places and components of [[boundary]]"
        )
    }))
}

/// A piece of the material and a rigid motion that nothing resists, in words: any, or one of the
/// `pulled` axes. The piece is a body, with a point where it is not the whole of it. The cells and nodes are those of
/// [`crate::system::step_system::active`]; `touches`: where other bodies hold it. Collective.
fn loose<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    (populated, numbering): &(Populated, Numbering),
    first: StepSpan,
    (pulled, touches): (Option<[bool; D]>, &[Touch<D>]),
) -> Result<Option<(String, String)>> {
    let (deck, grid, partition) = (&model.deck, &model.grid, &model.partition);
    let faces = ties(world, model, populated)?;
    let with_ties;
    let numbering = if grid.element().is_simplex() {
        let nodes = numbering.nodes.iter().chain(faces.iter().flat_map(|face| &face.nodes));
        let nodes = Touched::assign(world, grid, partition, nodes.copied().collect())?;
        with_ties = Numbering::build(world, nodes.owned, &nodes.foreign)?;
        &with_ties
    } else {
        numbering
    };
    let conditions = Conditions::evaluate(
        world,
        grid,
        deck.method.basis,
        numbering,
        points,
        (&deck.boundaries, Unknowns::<D>::displacements()),
        first,
    )?;
    // Water that holds a body along an axis mostly rights it, too.
    // A body of revolution is held along the radius, and against turns, by its own hoops.
    let hoops = deck.analysis.symmetry == Symmetry::Axisymmetric;
    let springs: [bool; D] = std::array::from_fn(|axis| {
        (hoops && axis == 0) || deck.loads.iter().any(|load| load.may_hold(axis))
    });
    let labels = pieces::labels(world, grid, populated, &faces, numbering)?;
    let extent = Extent::of(world, points);
    let mut held = Restraints::nowhere();
    for (local, &piece) in labels.iter().enumerate().take(numbering.owned) {
        held.enter(piece);
        let x = grid.node_position(numbering.nodes[local]);
        for axis in (0..D).filter(|&axis| conditions.fixed[local * D + axis] || springs[axis]) {
            held.add(piece, &extent.component(&x, axis));
        }
    }
    let pieces = Pieces { model, points, numbering, labels: &labels, extent: &extent };
    pieces.by_supports(first.stage, &mut held)?;
    pieces.by_terms(&mut held)?;
    pieces.by_rigid_bodies(first, &mut held);
    pieces.by_bodies(touches, &mut held);
    let Some((piece, motion)) = held.free(world, model, pulled)? else { return Ok(None) };
    let what = name_piece(world, model, points, numbering, &labels, piece)?;
    Ok(Some((what, motion)))
}

/// Ghost faces that hold cells together which share no node: only among simplices.
fn ties<const D: usize>(
    world: &World,
    model: &Model<D>,
    populated: &Populated,
) -> Result<Vec<FaceStencil>> {
    if !model.grid.element().is_simplex() {
        return Ok(Vec::new());
    }
    let rim = Rim::default();
    step_system::find_faces(world, model, (populated, &rim), &Fields::default())
        .map(|(faces, _)| faces)
}

/// The body of a piece, and its first point if it is not the whole body. Collective.
fn name_piece<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    numbering: &Numbering,
    pieces: &[u64],
    piece: u64,
) -> Result<String> {
    let (mut cells, mut nodes) = (Vec::new(), Vec::new());
    let mut within = |p: usize| -> Result<bool> {
        cells.clear();
        nodes.clear();
        let basis = model.deck.method.basis;
        basis::populated_cells(&model.grid, basis, points, p, None, &mut cells)?;
        cells.iter().take(1).for_each(|&cell| model.grid.cell_nodes(cell, &mut nodes));
        Ok(nodes.iter().any(|&n| numbering.local(n).is_some_and(|local| pieces[local] == piece)))
    };
    let inside: Result<Vec<bool>> = (0..points.len()).map(&mut within).collect();
    let inside = world.fail_together(inside)?;
    let own = (0..points.len()).filter(|&p| inside[p]).min_by_key(|&p| points.id[p]);
    let first = world.min_u64(own.map_or(u64::MAX, |p| points.id[p]));
    let own = own.filter(|&p| points.id[p] == first);
    let body = world.min_u64(own.map_or(u64::MAX, |p| u64::from(points.body[p]))) as usize;
    let rest = (0..points.len()).any(|p| points.body[p] as usize == body && !inside[p]);
    let whole = !world.any(rest);
    let name = own.map(|p| {
        let name = &model.deck.bodies[body].name;
        if whole {
            return format!("body \"{name}\"");
        }
        format!(
            "a piece of body \"{name}\" that shares no grid node with the rest, the one with point \
             {first} at {:?} m,",
            points.position[p]
        )
    });
    Ok(world.first_message(name).unwrap_or_default())
}
