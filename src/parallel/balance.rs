//! Points to their ranks at the end of a step, and a new partition when the old one has become
//! uneven: max/mean > `parallel.rebalance_above`.
//!
//! What is levelled is the number of points, or the measured seconds of work of each rank,
//! spread over its points. Points repeat bit by bit; seconds follow uneven machines and
//! materials. A new partition is taken if it is clearly better; after one that was not, the
//! next attempt waits until the imbalance has grown.

use crate::deck::model::Cost;
use crate::error::Result;
use crate::output::restart::run_state::RunState;
use crate::output::summary::{BalanceReport, Communication};
use crate::parallel::traffic::Traffic;
use crate::parallel::{Partition, World, migrate};
use crate::points::Points;

use crate::system::step_system::Model;

/// A new partition must lower max/mean by at least this factor to be worth the move.
const GAIN: f64 = 0.95;
/// After a fruitless attempt max/mean must grow by this factor before the next.
const PATIENCE: f64 = 1.05;
/// Share of the newest measurement in a rank's smoothed seconds per point.
const NEWEST: f64 = 0.3;

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
pub struct Settled {
    /// Share of the points that changed rank.
    pub moved: f64,
    /// Largest over mean cost of the ranks afterwards.
    pub imbalance: f64,
}

impl Balance {
    pub fn report(&self) -> BalanceReport {
        self.report
    }

    pub fn save(&self, state: &mut RunState) {
        state.set("balance.refused", self.refused);
        state.set("balance.moved_share", self.report.moved_share);
        state.set("balance.largest_imbalance", self.report.largest_imbalance);
        state.set_count("balance.rebalanced", self.report.rebalanced as u64);
    }

    pub fn restore(&mut self, state: &RunState) -> Result<()> {
        self.refused = state.number("balance.refused")?;
        self.report = BalanceReport {
            rebalanced: state.count("balance.rebalanced")? as usize,
            moved_share: state.number("balance.moved_share")?,
            largest_imbalance: state.number("balance.largest_imbalance")?,
        };
        Ok(())
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

/// Migrates the points; where max/mean exceeds the deck's limit, tries a new partition and keeps
/// it if it is clearly better. `busy`: seconds of work of this rank so far
/// ([`crate::record::clock::Clock::busy`]). Collective.
pub fn settle<const D: usize>(
    world: &World,
    model: &mut Model<D>,
    points: &mut Points<D>,
    busy: f64,
) -> Result<Settled> {
    let cost = model.deck.parallel.cost;
    model.balance.measure(busy, points.len());
    let all = world.sum_usize(points.len()).max(1) as f64;
    let mut moved = migrate(world, &model.partition, &model.grid, points)?;
    let mut load = points.len() as f64 * model.balance.cost_of_point(cost);
    let before = of_loads(world, load);
    let report = &mut model.balance.report;
    report.largest_imbalance = report.largest_imbalance.max(before);
    let limit = model.deck.parallel.rebalance_above;
    let due = world.size() > 1 && limit > 0.0 && before > limit;
    if due && before > PATIENCE * model.balance.refused {
        match better_partition(world, model, points, before)? {
            Some(partition) => {
                model.partition = partition;
                let migrated = migrate(world, &model.partition, &model.grid, points)?;
                moved += migrated;
                model.balance.refused = 0.0;
                model.balance.report.rebalanced += 1;
                model.balance.report.moved_share += migrated as f64 / all;
                load = points.len() as f64 * model.balance.cost_of_point(cost);
            }
            None => model.balance.refused = before,
        }
    }
    Ok(Settled { moved: moved as f64 / all, imbalance: of_loads(world, load) })
}

/// A partition that is clearly more even than `before`, if there is one; in finer bricks if the
/// deck leaves their size open and the present ones are too coarse.
fn better_partition<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    before: f64,
) -> Result<Option<Partition<D>>> {
    let cost = model.balance.cost_of_point(model.deck.parallel.cost);
    let costs = vec![cost; points.len()];
    let attempt = |partition: &Partition<D>| -> Result<(Partition<D>, f64)> {
        let candidate = partition.rebuild(world, &model.grid, points, Some(&costs))?;
        let after = of_candidate(world, model, points, &candidate, cost);
        Ok((candidate, after))
    };
    let (mut best, mut after) = attempt(&model.partition)?;
    if after > model.deck.parallel.rebalance_above
        && model.deck.parallel.brick.is_none()
        && let Some(finer) = model.partition.refined(&model.grid)
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
    model: &Model<D>,
    points: &Points<D>,
    candidate: &Partition<D>,
    cost: f64,
) -> f64 {
    let mut load = vec![0.0; world.size()];
    for cell in model.grid.locate_each(points.position.iter()).flatten() {
        load[candidate.owner_of_cell(&model.grid, cell)] += cost;
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

/// What the ranks sent in `steps` steps, and what each holds of the whole. Collective.
pub fn communication<const D: usize>(
    world: &World,
    model: &Model<D>,
    traffic: Traffic,
    steps: usize,
) -> Communication {
    let per_step = 1.0 / steps.max(1) as f64;
    let own = [traffic.messages as f64 * per_step, traffic.bytes as f64 * per_step];
    let (largest, sum) = (world.max_slice(&own), world.sum_slice(&own));
    let mean = |k: usize| sum[k] / world.size() as f64;
    Communication {
        messages_max: largest[0],
        messages_mean: mean(0),
        bytes_max: largest[1],
        bytes_mean: mean(1),
        reductions: traffic.reductions as f64 * per_step,
        replicated_bytes: model.partition.replicated_bytes(),
    }
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

    #[test]
    fn the_state_goes_through_a_checkpoint() {
        let report = BalanceReport { rebalanced: 3, moved_share: 0.4, largest_imbalance: 2.5 };
        let balance = Balance { refused: 1.3, report, ..Balance::default() };
        let mut state = RunState::new();
        balance.save(&mut state);
        let mut other = Balance::default();
        other.restore(&state).unwrap();
        assert_eq!((other.refused, other.report), (1.3, report));
    }
}
