//! Points to their ranks at the end of a step, and a new partition when the old one has become
//! uneven.

use crate::error::Result;
use crate::parallel::{World, migrate};
use crate::points::Points;

use super::discretise::Model;

/// A new partition must lower max/mean by at least this much to be worth the move.
const GAIN: f64 = 0.95;

/// Migrates the points; where max/mean exceeds the deck's `rebalance_above`, tries a new
/// partition and keeps it if it is clearly better. Collective.
pub fn settle<const D: usize>(
    world: &World,
    model: &mut Model<D>,
    points: &mut Points<D>,
) -> Result<()> {
    migrate(world, &model.partition, &model.grid, points)?;
    let limit = model.deck.parallel.rebalance_above;
    let before = imbalance(world, points.len());
    if world.size() == 1 || limit <= 0.0 || before <= limit {
        return Ok(());
    }
    let candidate = model.partition.rebuild(world, &model.grid, points, None)?;
    let mut load = vec![0.0; world.size()];
    for x in &points.position {
        if let Some(cell) = model.grid.locate(x) {
            load[candidate.owner_of_cell(&model.grid, cell)] += 1.0;
        }
    }
    let load = world.sum_slice(&load);
    let largest = load.iter().copied().fold(0.0, f64::max);
    let after = largest * world.size() as f64 / load.iter().sum::<f64>();
    if after < GAIN * before {
        model.partition = candidate;
        migrate(world, &model.partition, &model.grid, points)?;
    }
    Ok(())
}

/// Largest over mean number of points per rank.
pub fn imbalance(world: &World, points: usize) -> f64 {
    let total = world.sum_usize(points);
    let largest = world.max_usize(points);
    if total == 0 { 1.0 } else { largest as f64 * world.size() as f64 / total as f64 }
}
