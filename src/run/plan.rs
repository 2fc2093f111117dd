//! What a run is going to be: sizes, partition, estimated memory and output.

use crate::basis::Domain;
use crate::deck::fields::{self, FieldRank};
use crate::deck::model::{Basis, Body, BodySource, Format, Symmetry};
use crate::deck::rough;
use crate::output::terminal::report::Plan;
use crate::parallel::World;
use crate::parallel::balance::imbalance;
use crate::points::{Points, coverage};
use crate::system::model::Model;
use crate::system::numbering::Numbering;
use crate::system::populated::Populated;

use super::{lengths, locking, plan_checks, thin};

/// Counts the first step's system from its cells and nodes ([`crate::system::step_system::active`]).
/// Collective.
pub fn of<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    (populated, numbering): &(Populated, Numbering),
) -> Plan {
    let deck = &model.deck;
    let nodes = numbering.total;
    let all_points = world.sum_usize(points.len());
    let mut per_rank = vec![0.0; world.size()];
    per_rank[world.rank()] = points.len() as f64;
    let (time_step, steps) = plan_checks::steps(world, model, points);
    let frames = plan_checks::frames(deck.output.every, steps, deck.analysis.duration);
    let cells = world.sum_usize(populated.owned.len());
    let output = frames
        * (all_points as f64 * bytes_per_point::<D>(deck) + nodes as f64 * BYTES_PER_NODE)
        + steps * BYTES_PER_STEP;
    let mut facts: Vec<(String, String)> = filling(world, model, points);
    facts.extend(time_step.map(|text| ("time step".to_string(), text)));
    let (ratios, mut warnings): (Vec<_>, Vec<_>) =
        plan_checks::weight_ratios(world, model, points).into_iter().unzip();
    facts.extend(ratios.into_iter().flatten());
    warnings.extend(plan_checks::angles(&deck.materials).into_iter().map(Some));
    warnings.push(plan_checks::wrong_floor::<D>(deck));
    warnings.push(plan_checks::upward::<D>(deck));
    warnings.push(lengths::warning(world, model, points));
    warnings.push(plan_checks::unstable_step(world, model, points));
    warnings.push(plan_checks::much_output(output, frames));
    warnings.push(locking::warning(world, model, points));
    warnings.push(thin::warning(world, model, points));
    Plan {
        title: deck.title.clone(),
        facts,
        warnings: warnings.into_iter().flatten().collect(),
        points: all_points,
        cells_populated: cells,
        active_nodes: nodes,
        equations: nodes * D,
        points_per_rank: world.sum_slice(&per_rank).into_iter().map(|n| n as usize).collect(),
        imbalance: imbalance(world, points.len()),
        estimated_memory: Some(
            memory::<D>(deck.method.basis, all_points as f64, nodes as f64) as u64
        ),
        estimated_output: Some(output.min(1e18) as u64),
    }
}

/// Points with their influences, and the matrix three times over (ours, PETSc's two parts and
/// its preconditioner), bytes. The counts may be estimates, too.
pub(crate) fn memory<const D: usize>(basis: Basis, points: f64, nodes: f64) -> f64 {
    let (nodes_each, row) = basis.nodes(D);
    let corners = if basis.domain().has_corners() { 0 } else { 8 * D };
    // What affine transfers and stages carry is left out: few runs have it.
    let affine = D * D + D + D;
    let per_point = 8 * (Points::<D>::base_words() - corners - affine) + nodes_each * (16 + 8 * D);
    let per_node = row * (8 * D * D * 3 + 8);
    points * per_point as f64 + nodes * per_node as f64
}

/// A frame's share of a node and the cell beside it: coordinates, vectors, scalars, connectivity.
const BYTES_PER_NODE: f64 = 200.0;
/// A row of history.csv, residuals.csv and log.txt.
const BYTES_PER_STEP: f64 = 1500.0;

/// A point in a frame: place, identity, body, rank, fields, and the corners of its domain, in each format.
fn bytes_per_point<const D: usize>(deck: &crate::deck::Deck) -> f64 {
    let numbers = |name: &String| match fields::rank(name) {
        Some(FieldRank::Vector) => 3,
        Some(rank) => rank.components(3).len().max(1),
        None => 1,
    };
    let (corners, corner_numbers) = match deck.method.basis.domain() {
        Domain::None => (0, 0),
        _ => (3 << D, 1 << D),
    };
    let own = 7 + deck.output.fields.iter().map(numbers).sum::<usize>();
    let domains = usize::from(corners > 0);
    let more = |format: &Format| match format {
        Format::Xdmf => 0,
        // The fields again, at points and on domains.
        Format::Vtu => own + 2 + domains * (own + corners + corner_numbers + 2),
        Format::VtkHdf => 2 + domains * (corner_numbers + 2),
    };
    let more: usize = deck.output.formats.iter().map(more).sum();
    8.0 * (own + corners + corner_numbers + more) as f64
}

/// Volume of each body's points beside that of its shape, where the two differ or a shape is not
/// filled cell by cell; empty on all ranks but the first. Collective.
fn filling<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
) -> Vec<(String, String)> {
    let mut seeded = vec![0.0; model.deck.bodies.len()];
    for points in [points, &model.waiting] {
        for (volume, &body) in points.volume_initial.iter().zip(&points.body) {
            seeded[body as usize] += volume;
        }
    }
    let rings = model.deck.analysis.symmetry == Symmetry::Axisymmetric;
    let unit = if D == 2 && !rings { "m2" } else { "m3" };
    let row = |(body, seeded): (&Body, f64)| {
        let BodySource::Shape { shape, .. } = &body.source else { return None };
        let exact = match rings {
            true => coverage::volume_of_turn(shape)?,
            false => coverage::volume::<D>(shape)?,
        };
        let off = seeded / exact - 1.0;
        let text = format!(
            "points fill {} {unit}, the shape has {} {unit}{}",
            rough(seeded),
            rough(exact),
            if off.abs() < 1e-3 { String::new() } else { format!(" ({:+.2} %)", 100.0 * off) }
        );
        Some((format!("body {}", body.name), text))
    };
    let seeded = world.sum_slice(&seeded);
    if world.rank() > 0 {
        // The first rank prints it; volumes of shapes take some hundredths of a second.
        return Vec::new();
    }
    // Decks of very many bodies need no line for each.
    model.deck.bodies.iter().zip(seeded).take(LINES).filter_map(row).collect()
}

/// Bodies that a plan lists one by one.
const LINES: usize = 20;
