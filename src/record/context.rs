//! One context per run: everything that a step reads or changes, in one place.

use crate::error::Result;
use crate::parallel::World;
use crate::petsc::log::Phase;
use crate::points::Points;
use crate::system::model::Model;

use super::clock::Clock;
use super::recorder::Recorder;

/// A run between its set-up and its summary. Functions that need parts of it at the same time take
/// it apart by `let Run { world, model, .. } = run`.
pub struct Run<'a, const D: usize> {
    pub world: &'a World,
    pub model: Model<D>,
    /// This rank's points.
    pub points: Points<D>,
    pub recorder: Recorder,
    pub clock: Clock,
}

impl<const D: usize> Run<'_, D> {
    /// Writes the points as they are at the end of step `step`, at this time (s) or load factor.
    /// Collective.
    pub fn frame(&mut self, step: usize, label: f64) -> Result<()> {
        self.recorder.frame(self.world, step, label, &self.points)
    }

    /// Points to their ranks, and a new partition where the old one has become uneven; the share of
    /// the points that changed rank. Collective.
    pub fn migrate_and_balance(&mut self) -> Result<f64> {
        let Run { world, model, points, clock, .. } = self;
        let busy = clock.busy();
        let balanced = clock.time(Phase::Migrate, || {
            let Model { deck, grid, partition, balance, .. } = model;
            balance.migrate_and_balance(world, &deck.parallel, grid, partition, points, busy)
        })?;
        Ok(balanced.moved)
    }
}
