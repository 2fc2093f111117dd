//! What a run is going to be: sizes, partition, estimated memory and output.

use crate::deck::model::{Basis, Every};
use crate::output::terminal::report::Plan;
use crate::parallel::World;
use crate::points::Points;
use crate::system::numbering::Numbering;
use crate::system::populated::Populated;

use crate::parallel::balance::imbalance;
use crate::system::step_system::Model;

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
    let frames = match (deck.output.every, deck.analysis.steps, deck.analysis.duration) {
        (Every::Steps(every), Some(steps), _) => 1 + steps / every.max(1),
        (Every::Seconds(seconds), _, Some(duration)) => 1 + (duration / seconds) as usize,
        _ => 1,
    };
    Plan {
        title: deck.title.clone(),
        facts: Vec::new(),
        points: all_points,
        cells_populated: world.sum_usize(populated.owned.len()),
        active_nodes: nodes,
        equations: nodes * D,
        points_per_rank: world.sum_slice(&per_rank).into_iter().map(|n| n as usize).collect(),
        imbalance: imbalance(world, points.len()),
        cut_faces: None,
        estimated_memory: Some(
            memory::<D>(deck.method.basis, all_points as f64, nodes as f64) as u64
        ),
        estimated_output: Some((frames * all_points * output_bytes_per_point(deck)) as u64),
    }
}

/// Points with their influences, and the matrix three times over (ours, PETSc's two parts and
/// its preconditioner), bytes. The counts may be estimates, too.
pub(crate) fn memory<const D: usize>(basis: Basis, points: f64, nodes: f64) -> f64 {
    let (nodes_each, row) = match (basis, D) {
        (Basis::Mpm, 2) => (4, 9),
        (Basis::Mpm, _) => (8, 27),
        (Basis::Gimp, 2) => (6, 20),
        (Basis::Gimp, _) => (15, 70),
        (_, 2) => (8, 20),
        _ => (30, 90),
    };
    let corners = if matches!(basis, Basis::Mpm | Basis::Gimp) { 8 * D } else { 0 };
    let per_point = 8 * (Points::<D>::record_words() - corners) + nodes_each * (16 + 8 * D);
    let per_node = row * (8 * D * D * 3 + 8);
    points * per_point as f64 + nodes * per_node as f64
}

/// Three numbers a field on the average, beside position and identity.
fn output_bytes_per_point(deck: &crate::deck::Deck) -> usize {
    8 * (3 * deck.output.fields.len() + 6)
}
