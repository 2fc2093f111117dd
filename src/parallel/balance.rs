//! Points to their ranks at the end of a step, and a new partition when the old one has become
//! uneven: max/mean > `parallel.rebalance_above`.
//!
//! What is levelled is the number of points, or the measured seconds of work of each rank,
//! spread over its points. Points repeat bit by bit; seconds follow uneven machines and
//! materials. A new partition is taken if it is clearly better; after one that was not, the
//! next attempt waits until the imbalance has grown.

use serde::Serialize;

use crate::deck::model::{Cost, Parallel};
use crate::error::Result;
use crate::grid::Grid;
use crate::parallel::{Partition, World, migrate};
use crate::points::Points;

/// A new partition must lower max/mean by at least this factor to be worth the move.
const GAIN: f64 = 0.95;
/// After a fruitless attempt max/mean must grow by this factor before the next.
const PATIENCE: f64 = 1.05;
/// Share of the newest measurement in a rank's smoothed seconds per point.
const NEWEST: f64 = 0.3;

/// What kept the ranks equally loaded.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct BalanceReport {
    /// New partitions taken.
    pub rebalanced: usize,
    /// Share of the points that changed rank for them, summed over all of them.
    pub moved_share: f64,
    /// Largest imbalance of the run.
    pub largest_imbalance: f64,
}

/// What is remembered from step to step.
#[derive(Debug, Clone, Default)]
pub struct Balance {
    /// Seconds per point on this rank, smoothed; 0 before the first measurement.
    rate: f64,
    /// Phase seconds that were measured already.
    busy_before: f64,
    /// Imbalance at which an attempt was fruitless; 0 after a success.
    refused: f64,
    report: BalanceReport,
}

/// What a step's end did.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Balanced {
    /// Share of the points that changed rank.
    pub moved: f64,
    /// Largest over mean cost of the ranks afterwards.
    pub imbalance: f64,
}

impl Balance {
    pub fn report(&self) -> BalanceReport {
        self.report
    }

    /// What a run that is resumed has to know: [`Self::resume`].
    pub fn memory(&self) -> (f64, BalanceReport) {
        (self.refused, self.report)
    }

    /// Goes on from [`Self::memory`].
    pub fn resume(&mut self, (refused, report): (f64, BalanceReport)) {
        (self.refused, self.report) = (refused, report);
    }

    /// Cost of one point on this rank.
    fn cost_of_point(&self, cost: Cost) -> f64 {
        match cost {
            Cost::Points => 1.0,
            Cost::Time => self.rate,
        }
    }

    /// Takes the step's work, seconds, done for `points` points.
    fn measure(&mut self, busy: f64, points: usize) {
        let seconds = busy - std::mem::replace(&mut self.busy_before, busy);
        if points > 0 && seconds > 0.0 {
            let rate = seconds / points as f64;
            let newest = if self.rate > 0.0 { NEWEST } else { 1.0 };
            self.rate += newest * (rate - self.rate);
        }
    }
}

impl Balance {
    /// Migrates the points; where max/mean exceeds the deck's limit, tries a new partition and keeps
    /// it if it is clearly better. `busy`: seconds of work of this rank so far
    /// (`record::clock::Clock::busy`). Collective.
    pub fn migrate_and_balance<const D: usize>(
        &mut self,
        world: &World,
        settings: &Parallel,
        grid: &Grid<D>,
        partition: &mut Partition<D>,
        points: &mut Points<D>,
        busy: f64,
    ) -> Result<Balanced> {
        self.measure(busy, points.len());
        let all = world.sum_usize(points.len()).max(1) as f64;
        let mut moved = migrate(world, partition, grid, points)?;
        let cost = self.cost_of_point(settings.cost);
        let mut load = points.len() as f64 * cost;
        let before = of_loads(world, load);
        self.report.largest_imbalance = self.report.largest_imbalance.max(before);
        let limit = settings.rebalance_above;
        let due = world.size() > 1 && limit > 0.0 && before > limit;
        if due && before > PATIENCE * self.refused {
            match better_partition(world, settings, grid, partition, points, (before, cost))? {
                Some(better) => {
                    *partition = better;
                    let migrated = migrate(world, partition, grid, points)?;
                    moved += migrated;
                    self.refused = 0.0;
                    self.report.rebalanced += 1;
                    self.report.moved_share += migrated as f64 / all;
                    load = points.len() as f64 * cost;
                }
                None => self.refused = before,
            }
        }
        Ok(Balanced { moved: moved as f64 / all, imbalance: of_loads(world, load) })
    }
}

/// A partition that is clearly more even than `before`, if there is one, with the `cost` of a point
/// on this rank; in finer bricks if the deck leaves their size open and the present ones are too
/// coarse.
fn better_partition<const D: usize>(
    world: &World,
    settings: &Parallel,
    grid: &Grid<D>,
    partition: &Partition<D>,
    points: &Points<D>,
    (before, cost): (f64, f64),
) -> Result<Option<Partition<D>>> {
    let costs = vec![cost; points.len()];
    let attempt = |partition: &Partition<D>| -> Result<(Partition<D>, f64)> {
        let candidate = partition.rebuild(world, grid, points, Some(&costs))?;
        let after = of_candidate(world, grid, points, &candidate, cost);
        Ok((candidate, after))
    };
    let (mut best, mut after) = attempt(partition)?;
    if after > settings.rebalance_above
        && settings.brick.is_none()
        && let Some(finer) = partition.refined(grid)
    {
        let (candidate, finer_after) = attempt(&finer)?;
        if finer_after < GAIN * after {
            (best, after) = (candidate, finer_after);
        }
    }
    Ok((after < GAIN * before).then_some(best))
}

/// Largest over mean if `candidate` were the partition.
fn of_candidate<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    points: &Points<D>,
    candidate: &Partition<D>,
    cost: f64,
) -> f64 {
    let mut load = vec![0.0; world.size()];
    for cell in grid.locate_each(points.position.iter()).flatten() {
        load[candidate.owner_of_cell(grid, cell)] += cost;
    }
    let load = world.sum_slice(&load);
    let largest = load.iter().copied().fold(0.0, f64::max);
    largest * world.size() as f64 / load.iter().sum::<f64>()
}

fn of_loads(world: &World, load: f64) -> f64 {
    crate::parallel::partition::imbalance(world, load)
}

/// Largest over mean number of points per rank.
pub fn imbalance(world: &World, points: usize) -> f64 {
    of_loads(world, points as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_per_point_are_smoothed() {
        let mut balance = Balance::default();
        balance.measure(2.0, 100);
        assert!((balance.rate - 0.02).abs() < 1e-15);
        balance.measure(2.0 + 4.0, 100);
        assert!((balance.rate - (0.7 * 0.02 + 0.3 * 0.04)).abs() < 1e-15);
        let before = balance.rate;
        balance.measure(7.0, 0);
        assert_eq!(balance.rate, before);
        assert_eq!(balance.cost_of_point(Cost::Points), 1.0);
        assert_eq!(balance.cost_of_point(Cost::Time), before);
    }
}
