//! Do the conditions hold every connected piece of the material against rigid motion? Found before
//! anything is solved or written: a quasi-static system that a rigid motion solves is singular.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use crate::basis::{self, radial};
use crate::contact::fields::Fields;
use crate::contact::law::Friction;
use crate::contact::start::corners_within;
use crate::deck::model::{Load, Symmetry};
use crate::deck::schema::AXES;
use crate::deck::{Presence, When};
use crate::error::{Error, Result};
use crate::ghost::FaceStencil;
use crate::parallel::{World, exchange};
use crate::points::Points;
use crate::system::conditions::{Conditions, StepSpan};
use crate::system::facing;
use crate::system::numbering::Numbering;
use crate::system::numbering::Touched;
use crate::system::populated::Populated;
use crate::system::rim::Rim;
use crate::system::supports::Support;
use crate::system::terms::contact::TOUCH;
use crate::system::terms::surface;

use super::pieces;
use crate::system::model::Model;
use crate::system::step_system;
use crate::system::unknowns::Unknowns;

/// Share of the largest eigenvalue below which a motion counts as free. The rows are exact but
/// for rounding; a held line of a thousandth of the body's length leaves 1e-6.
const FREE: f64 = 1e-12;

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

/// Where another body holds a piece of the material.
struct Touch<const D: usize> {
    /// A node of the grid that moves the piece there.
    node: usize,
    /// m
    place: [f64; D],
    normal: [f64; D],
    /// Along the surface, too.
    rubs: bool,
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
/// `pulled` axes. The piece is a body, with a point where it is not the whole of it. Every
/// held component of a node is a row of the rigid motions' values there; the motions that all rows
/// of a piece annihilate are free. Each piece is judged by the rank that owns its first node. The
/// cells and nodes are those of [`crate::system::step_system::active`]; `touches`: where other bodies hold it. Collective.
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
    let pieces = pieces::labels(world, grid, populated, &faces, numbering)?;
    let (middle, length) = extent(world, points);
    let motions = D + D * (D - 1) / 2;
    let mut grams: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    for (local, &piece) in pieces.iter().enumerate().take(numbering.owned) {
        let gram = grams.entry(piece).or_insert_with(|| vec![0.0; motions * motions]);
        let x = grid.node_position(numbering.nodes[local]);
        let x: [f64; D] = std::array::from_fn(|a| (x[a] - middle[a]) / length);
        let held = |&c: &usize| conditions.fixed[local * D + c] || springs[c];
        for component in (0..D).filter(held) {
            let row = motions_at(&x, component);
            for (i, a) in row.iter().enumerate() {
                for (j, b) in row.iter().enumerate() {
                    gram[i * motions + j] += a * b;
                }
            }
        }
    }
    let extent = (middle, length);
    add_supports(model, points, (numbering, first.stage), &pieces, extent, &mut grams)?;
    let by_rigids = held_by_contact(model, points, (numbering, first), &pieces, (&middle, length));
    let by_bodies = touches.iter().filter_map(|touch| {
        let x: [f64; D] = std::array::from_fn(|a| (touch.place[a] - middle[a]) / length);
        let rows = match touch.rubs {
            true => (0..D).map(|i| motions_at(&x, i)).collect(),
            false => vec![motions_along(&x, &touch.normal)],
        };
        Some((pieces[numbering.local(touch.node)?], rows))
    });
    for (piece, rows) in by_rigids.into_iter().chain(by_bodies) {
        let gram = grams.entry(piece).or_insert_with(|| vec![0.0; motions * motions]);
        for row in rows {
            for (i, a) in row.iter().enumerate() {
                for (j, b) in row.iter().enumerate() {
                    gram[i * motions + j] += a * b;
                }
            }
        }
    }
    let free = of_all_ranks(world, model, grams)?.into_iter().find_map(|(piece, gram)| {
        if let Some(pulled) = pulled {
            let axis = (0..D).find(|&a| pulled[a] && gram[a * motions + a] == 0.0)?;
            return Some((piece, along_axis(axis)));
        }
        let spectrum = DMatrix::from_vec(motions, motions, gram).symmetric_eigen();
        let largest = spectrum.eigenvalues.max();
        let free = (0..motions).find(|&k| spectrum.eigenvalues[k] <= FREE * largest.max(1e-300))?;
        Some((piece, name(spectrum.eigenvectors.column(free).iter().copied(), D)))
    });
    let first = world.min_u64(free.as_ref().map_or(u64::MAX, |(piece, _)| *piece));
    let motion = free.filter(|(piece, _)| *piece == first).map(|(_, motion)| motion);
    let Some(motion) = world.first_message(motion) else { return Ok(None) };
    let what = name_piece(world, model, points, numbering, &pieces, first)?;
    Ok(Some((what, motion)))
}

/// Adds what surfaces that are held keep of the rigid motions: a row for each direction in which an
/// element is held, to the piece that its carrier belongs to.
fn add_supports<const D: usize>(
    model: &Model<D>,
    points: &Points<D>,
    (numbering, stage): (&Numbering, usize),
    pieces: &[u64],
    (middle, length): ([f64; D], f64),
    grams: &mut BTreeMap<u64, Vec<f64>>,
) -> Result<()> {
    let motions = D + D * (D - 1) / 2;
    let (mut cells, mut nodes) = (Vec::new(), Vec::new());
    for p in surface::carriers(model, points) {
        cells.clear();
        nodes.clear();
        basis::populated_cells(&model.grid, model.deck.method.basis, points, p, None, &mut cells)?;
        cells.iter().for_each(|&cell| model.grid.cell_nodes(cell, &mut nodes));
        let Some(piece) = nodes.iter().find_map(|&n| numbering.local(n).map(|n| pieces[n])) else {
            continue;
        };
        let holds = |support: &&Support<D>| {
            model.deck.boundaries[support.boundary].presence.holds_in(stage)
        };
        for support in model.supports.iter().filter(holds) {
            for own in support.surface.carried_by(points.id[p]) {
                let place = own.element.place;
                if support.within.as_ref().is_some_and(|sheet| !sheet.holds(&place)) {
                    continue;
                }
                let x: [f64; D] = std::array::from_fn(|a| (place[a] - middle[a]) / length);
                let gram = grams.entry(piece).or_insert_with(|| vec![0.0; motions * motions]);
                for direction in support.projection(&own.element) {
                    let mut row = vec![0.0; motions];
                    for (component, share) in direction.iter().enumerate() {
                        let all = motions_at(&x, component);
                        row.iter_mut().zip(all).for_each(|(sum, value)| *sum += share * value);
                    }
                    for (i, a) in row.iter().enumerate() {
                        for (j, b) in row.iter().enumerate() {
                            gram[i * motions + j] += a * b;
                        }
                    }
                }
            }
        }
    }
    Ok(())
}

/// Rows of the rigid motions' values at the corners that touch a rigid surface, along its normal or,
/// with friction, along all axes, each with its piece.
fn held_by_contact<const D: usize>(
    model: &Model<D>,
    points: &Points<D>,
    (numbering, span): (&Numbering, StepSpan),
    pieces: &[u64],
    (middle, length): (&[f64; D], f64),
) -> Vec<(u64, Vec<Vec<f64>>)> {
    let (contacts, basis) = (&model.contacts, model.deck.method.basis);
    let (cell, stage) = (model.grid.cell_size(), span.stage);
    // The points are where they are at the start of the run, and so is what they touch from then on.
    // What comes with a later stage finds them somewhere near.
    let stays = |presence: &Presence| presence.holds_in(stage) && presence.from <= Some(0);
    let comes = |presence: &Presence| presence.holds_in(stage) && presence.from > Some(0);
    let mut touching =
        corners_within(contacts, basis, points, TOUCH * cell, (When::default(), stays));
    touching.extend(corners_within(contacts, basis, points, cell, (span.start(), comes)));
    let held = touching.into_iter().filter_map(|corner| {
        let centre = &points.position[corner.point];
        let near = model.grid.values_towards(&corner.place, centre, 0.0, None)?;
        let nodes = near.nodes.iter().take(near.count);
        let local = nodes.filter_map(|&node| numbering.local(node)).next()?;
        let x: [f64; D] = std::array::from_fn(|a| (corner.place[a] - middle[a]) / length);
        let law = &contacts.pairs[corner.pair].law;
        let rows = if law.symmetric() {
            vec![motions_along(&x, &corner.near.normal)]
        } else {
            (0..D).map(|i| motions_at(&x, i)).collect()
        };
        Some((pieces[local], rows))
    });
    held.collect()
}

/// What each rigid motion moves a place along a direction.
fn motions_along<const D: usize>(x: &[f64; D], direction: &[f64; D]) -> Vec<f64> {
    let rows = (0..D).map(|i| (direction[i], motions_at(x, i)));
    rows.fold(vec![0.0; D + D * (D - 1) / 2], |mut sum, (share, row)| {
        sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += share * value);
        sum
    })
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

/// The sums over all ranks of the pieces whose first node is owned here, ascending.
fn of_all_ranks<const D: usize>(
    world: &World,
    model: &Model<D>,
    grams: BTreeMap<u64, Vec<f64>>,
) -> Result<BTreeMap<u64, Vec<f64>>> {
    let mut outgoing: BTreeMap<usize, Vec<u64>> = BTreeMap::new();
    let motions = D + D * (D - 1) / 2;
    for (piece, gram) in grams {
        let owner = model.partition.owner_of_node(&model.grid, piece as usize);
        let list = outgoing.entry(owner).or_default();
        list.push(piece);
        list.extend(gram.iter().map(|value| value.to_bits()));
    }
    let mut sums: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    for (_, words) in exchange(world, outgoing.into_iter().collect())? {
        for record in words.chunks_exact(1 + motions * motions) {
            let sum = sums.entry(record[0]).or_insert_with(|| vec![0.0; record.len() - 1]);
            for (sum, &word) in sum.iter_mut().zip(&record[1..]) {
                *sum += f64::from_bits(word);
            }
        }
    }
    Ok(sums)
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

/// Middle and largest extent of all points.
fn extent<const D: usize>(world: &World, points: &Points<D>) -> ([f64; D], f64) {
    let end = |axis: usize, sign: f64| {
        let own = points.position.iter().map(|x| sign * x[axis]).fold(f64::MIN, f64::max);
        sign * world.max(own)
    };
    let high: [f64; D] = std::array::from_fn(|a| end(a, 1.0));
    let low: [f64; D] = std::array::from_fn(|a| end(a, -1.0));
    let length = (0..D).map(|a| high[a] - low[a]).fold(0.0, f64::max);
    let middle = std::array::from_fn(|a| 0.5 * (high[a] + low[a]));
    (middle, if length > 0.0 { length } else { 1.0 })
}

/// Component `c` of every rigid motion at `x`: translations, then turns in the planes of axes
/// (0, 1), (1, 2), (2, 0).
fn motions_at<const D: usize>(x: &[f64; D], component: usize) -> Vec<f64> {
    let mut row = vec![0.0; D];
    row[component] = 1.0;
    for turn in 0..D * (D - 1) / 2 {
        let (a, b) = (turn, (turn + 1) % D);
        row.push(match component {
            c if c == a => -x[b],
            c if c == b => x[a],
            _ => 0.0,
        });
    }
    row
}

fn along_axis(axis: usize) -> String {
    format!("move along {}", AXES[axis])
}

/// The motion in words.
fn name(motion: impl Iterator<Item = f64>, dimension: usize) -> String {
    let size: Vec<f64> = motion.map(f64::abs).collect();
    let largest = (0..size.len()).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
    if largest < dimension {
        along_axis(largest)
    } else if dimension == 2 {
        "turn".into()
    } else {
        format!("turn about {}", AXES[(largest - dimension + 2) % 3])
    }
}
