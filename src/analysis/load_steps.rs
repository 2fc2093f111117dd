//! Load steps in exact fractions: halved when one fails, grown back when they succeed.

use crate::deck::model::OnFailure;
use crate::error::{Error, Result};
use crate::output::restart::run_state::RunState;
use crate::record::step::Moment;
use crate::system::conditions::StepSpan;

/// The position in the analysis, counted in ticks so that halving and doubling are exact.
#[derive(Debug, Clone)]
pub struct Stepping {
    steps: usize,
    /// s over the whole analysis; 0 without time.
    duration: f64,
    ticks_per_step: u64,
    position: u64,
    size: u64,
    policy: OnFailure,
    /// Halvings so far.
    pub cuts: usize,
}

impl Stepping {
    /// `smallest` is the smallest allowed step as a fraction of the nominal one.
    pub fn new(steps: usize, duration: f64, policy: OnFailure, smallest: f64) -> Self {
        let halvings = (1.0 / smallest).log2().floor().clamp(0.0, 40.0) as u32;
        let ticks_per_step = 1u64 << halvings;
        Stepping {
            steps,
            duration,
            ticks_per_step,
            position: 0,
            size: ticks_per_step,
            policy,
            cuts: 0,
        }
    }

    /// Puts the position into a checkpoint.
    pub fn save(&self, state: &mut RunState) {
        state.set_count("stepping.ticks_per_step", self.ticks_per_step);
        state.set_count("stepping.position", self.position);
        state.set_count("stepping.size", self.size);
        state.set_count("stepping.cuts", self.cuts as u64);
    }

    /// Takes the position out of a checkpoint. Error: it was counted in other ticks.
    pub fn restore(&mut self, state: &RunState) -> Result<()> {
        if state.count("stepping.ticks_per_step")? != self.ticks_per_step {
            return Err(Error::File("the checkpoint has another analysis.smallest_step".into()));
        }
        self.position = state.count("stepping.position")?;
        self.size = state.count("stepping.size")?;
        self.cuts = state.count("stepping.cuts")? as usize;
        Ok(())
    }

    /// The next step, `None` when the analysis is complete.
    pub fn next_span(&self) -> Option<StepSpan> {
        let total = self.total();
        if self.position >= total {
            return None;
        }
        let factor = |ticks: u64| ticks as f64 / total as f64;
        let (start, end) = (factor(self.position), factor(self.position + self.size));
        Some(StepSpan {
            factor_start: start,
            factor_end: end,
            time_start: start * self.duration,
            time_end: end * self.duration,
        })
    }

    /// The nominal step, counted from 1, that the next span belongs to.
    pub fn step_number(&self) -> usize {
        (self.position / self.ticks_per_step) as usize + 1
    }

    /// Moves on after a success.
    pub fn accept(&mut self) -> Moment {
        self.position += self.size;
        let doubled = 2 * self.size;
        if doubled <= self.ticks_per_step && self.position.is_multiple_of(doubled) {
            self.size = doubled;
        }
        if self.position >= self.total() {
            Moment::End
        } else if self.position.is_multiple_of(self.ticks_per_step) {
            Moment::Step
        } else {
            Moment::PartOfStep
        }
    }

    /// Answers a failure: true if a smaller step may be tried.
    pub fn refuse(&mut self) -> bool {
        if self.policy == OnFailure::Stop || self.size == 1 {
            return false;
        }
        self.size /= 2;
        self.cuts += 1;
        true
    }

    /// Nominal steps finished.
    pub fn completed(&self) -> usize {
        (self.position / self.ticks_per_step) as usize
    }

    fn total(&self) -> u64 {
        self.steps as u64 * self.ticks_per_step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stepping() -> Stepping {
        Stepping::new(4, 8.0, OnFailure::Cut, 1.0 / 8.0)
    }

    #[test]
    fn equal_steps_reach_the_end() {
        let mut stepping = stepping();
        let (mut ends, mut moments) = (Vec::new(), Vec::new());
        while let Some(span) = stepping.next_span() {
            ends.push((span.factor_end, span.time_end));
            moments.push(stepping.accept());
        }
        assert_eq!(ends, [(0.25, 2.0), (0.5, 4.0), (0.75, 6.0), (1.0, 8.0)]);
        assert_eq!(moments, [Moment::Step, Moment::Step, Moment::Step, Moment::End]);
        assert_eq!(stepping.completed(), 4);
    }

    #[test]
    fn a_cut_step_grows_back_and_meets_the_nominal_ends() {
        let mut stepping = stepping();
        assert!(stepping.refuse() && stepping.refuse());
        let mut ends = Vec::new();
        while let Some(span) = stepping.next_span() {
            ends.push(span.factor_end * 16.0);
            stepping.accept();
        }
        // Quarter, quarter, half; then whole steps again.
        assert_eq!(ends, [1.0, 2.0, 4.0, 8.0, 12.0, 16.0]);
        assert_eq!(stepping.cuts, 2);
    }

    #[test]
    fn a_restored_position_goes_on_in_the_same_steps() {
        let mut stepping = stepping();
        stepping.accept();
        assert!(stepping.refuse() && stepping.refuse());
        stepping.accept();
        let mut state = RunState::new();
        stepping.save(&mut state);
        let mut other = self::stepping();
        other.restore(&state).unwrap();
        assert_eq!((other.cuts, other.completed(), other.step_number()), (2, 1, 2));
        while let Some(span) = stepping.next_span() {
            assert_eq!(other.next_span(), Some(span));
            assert_eq!(other.accept(), stepping.accept());
        }
        assert_eq!(other.next_span(), None);
        let mut coarse = Stepping::new(4, 8.0, OnFailure::Cut, 0.5);
        assert_eq!(coarse.restore(&state).unwrap_err().exit_code(), 3);
    }

    #[test]
    fn the_smallest_step_is_the_last_resort() {
        let mut stepping = stepping();
        assert_eq!((0..10).take_while(|_| stepping.refuse()).count(), 3);
        let mut stop = Stepping::new(4, 0.0, OnFailure::Stop, 1.0 / 8.0);
        assert!(!stop.refuse());
    }
}
