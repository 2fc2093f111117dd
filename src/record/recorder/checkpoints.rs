//! What the recorder leaves in a checkpoint and takes out of it.

use crate::error::{Error, Result};
use crate::output::restart::run_state::RunState;
use crate::output::summary::{Count, Status};
use crate::parallel::World;
use crate::parallel::balance::{Balance, BalanceReport};
use crate::points::Points;
use crate::record::step::Moment;
use crate::system::model::Model;

use super::closing::Ending;
use super::{Recorder, SinceRow};

/// Puts what balances the ranks into a checkpoint.
fn save_balance(balance: &Balance, state: &mut RunState) {
    let (refused, report) = balance.memory();
    state.set("balance.refused", refused);
    state.set("balance.moved_share", report.moved_share);
    state.set("balance.largest_imbalance", report.largest_imbalance);
    state.set_count("balance.rebalanced", report.rebalanced as u64);
}

/// Takes what balances the ranks out of a checkpoint.
pub fn restore_balance(balance: &mut Balance, state: &RunState) -> Result<()> {
    let report = BalanceReport {
        rebalanced: state.count("balance.rebalanced")? as usize,
        moved_share: state.number("balance.moved_share")?,
        largest_imbalance: state.number("balance.largest_imbalance")?,
    };
    balance.resume((state.number("balance.refused")?, report));
    Ok(())
}

impl Recorder {
    /// What the time loop saved with [`Self::end_step`] before the run was interrupted; `None`
    /// in a run that starts at the beginning.
    pub fn resumed(&self) -> Option<&RunState> {
        self.resumed.as_ref()
    }

    /// The last thing in a step, when points, mesh and partition are what the next step starts
    /// from: writes a checkpoint if one is due, with the loop's own `state`. If a signal asks the
    /// run to stop, says how it ends. Collective.
    pub fn end_step<const D: usize>(
        &mut self,
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        moment: Moment,
        state: RunState,
    ) -> Result<Option<Ending>> {
        self.balance = model.balance.report();
        let (due, signal) = self.checkpointer.due(world, self.steps_completed, moment);
        if due || signal.is_some() {
            self.checkpoint(world, model, points, state)?;
        }
        Ok(signal.filter(|_| moment != Moment::End).map(|signal| Ending {
            status: Status::Stopped,
            on_request: true,
            reason: format!(
                "{} asked the run to stop, after step {}{}; a checkpoint was written: go on with \
                 --restart last",
                signal.name(),
                self.steps_completed,
                self.steps.map_or(String::new(), |steps| format!(" of {steps}"))
            ),
        }))
    }

    /// A run that cannot go on leaves its last good state, if its deck plans checkpoints: with
    /// other settings it may go on from there.
    pub fn keep_last_state<const D: usize>(
        &mut self,
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        state: RunState,
    ) -> Result<()> {
        if self.checkpointer.planned() {
            let written = self.checkpoint(world, model, points, state);
            return self.warn_of_files(written);
        }
        Ok(())
    }

    /// In a run that ends for another reason: that some file could not be written is a second
    /// word, and does not take the place of the first.
    pub fn warn_of_files(&mut self, written: Result<()>) -> Result<()> {
        match written {
            Err(Error::File(text)) => {
                self.log.warn(&text);
                Ok(())
            }
            other => other,
        }
    }

    fn checkpoint<const D: usize>(
        &mut self,
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        mut state: RunState,
    ) -> Result<()> {
        self.save(&mut state);
        save_balance(&model.balance, &mut state);
        // A checkpoint counts on its rows: they are to outlast a power cut if it does.
        self.history.table.sync(world.comm())?;
        self.residuals.table.sync(world.comm())?;
        self.probes.as_ref().map_or(Ok(()), |probes| probes.table.sync(world.comm()))?;
        let step = self.steps_completed;
        let path = self.checkpointer.write(world, step, model, points, &state)?;
        self.log.note(&format!("checkpoint: {}", path.display()));
        Ok(())
    }

    fn save(&self, state: &mut RunState) {
        let (history, residuals) = (self.history.table.mark(), self.residuals.table.mark());
        for (name, value) in [
            ("recorder.steps", self.steps_completed),
            ("recorder.history_rows", history.rows),
            ("recorder.history_step", history.step),
            ("recorder.residual_rows", residuals.rows),
            ("recorder.residual_step", residuals.step),
            ("recorder.newton_total", self.newton.total),
            ("recorder.newton_max", self.newton.max),
            ("recorder.linear_total", self.linear.total),
            ("recorder.linear_max", self.linear.max),
            ("recorder.populated_cells", self.populated_cells),
            ("recorder.newton_since_row", self.since_row.newton),
            ("recorder.linear_since_row", self.since_row.linear),
        ] {
            state.set_count(name, value as u64);
        }
        if let Some(probes) = &self.probes {
            probes.save(state);
        }
        for (index, steps) in self.stages.iter().enumerate().filter(|_| self.staged) {
            state.set_count(&format!("recorder.stage_{index}"), *steps as u64);
        }
        state.set("recorder.last_frame", self.last_frame);
        state.set("recorder.last_row", self.last_row);
        state.set("recorder.moved_since_row", self.since_row.moved);
        state.set("recorder.imbalance", self.imbalance);
        state.set("recorder.seconds", self.seconds);
    }

    pub(super) fn restore(&mut self, state: &RunState) -> Result<()> {
        let count = |name: &str| state.count(name).map(|n| n as usize);
        self.steps_completed = count("recorder.steps")?;
        self.earlier_steps = self.steps_completed;
        self.recorded = self.steps_completed;
        self.newton =
            Count { total: count("recorder.newton_total")?, max: count("recorder.newton_max")? };
        self.linear =
            Count { total: count("recorder.linear_total")?, max: count("recorder.linear_max")? };
        self.populated_cells = count("recorder.populated_cells")?;
        for (index, steps) in self.stages.iter_mut().enumerate() {
            // Stages may have been added.
            *steps = count(&format!("recorder.stage_{index}")).unwrap_or(0);
        }
        self.stage = self.stages.iter().rposition(|&steps| steps > 0).unwrap_or(0);
        self.last_frame = state.number("recorder.last_frame")?;
        // Not known to the first checkpoints of this format, whose steps all have rows.
        self.last_row = state.number("recorder.last_row").unwrap_or(0.0);
        self.since_row = SinceRow {
            newton: count("recorder.newton_since_row").unwrap_or(0),
            linear: count("recorder.linear_since_row").unwrap_or(0),
            moved: state.number("recorder.moved_since_row").unwrap_or(0.0),
        };
        self.imbalance = state.number("recorder.imbalance")?;
        self.earlier_seconds = state.number("recorder.seconds")?;
        self.seconds = self.earlier_seconds;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_balance_goes_through_a_checkpoint() {
        let report = BalanceReport { rebalanced: 3, moved_share: 0.4, largest_imbalance: 2.5 };
        let mut balance = Balance::default();
        balance.resume((1.3, report));
        let mut state = RunState::new();
        save_balance(&balance, &mut state);
        let mut other = Balance::default();
        restore_balance(&mut other, &state).unwrap();
        assert_eq!(other.memory(), (1.3, report));
    }
}
