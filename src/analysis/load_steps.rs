//! Load steps in exact fractions, stage by stage: halved when one fails, grown back when they succeed.

use crate::deck::Stage;
use crate::deck::model::OnFailure;
use crate::error::{Error, Result};
use crate::output::restart::run_state::RunState;
use crate::record::step::Moment;
use crate::system::conditions::StepSpan;

/// The position in the analysis, counted in ticks so that halving and doubling are exact.
#[derive(Debug, Clone)]
pub struct Stepping {
    parts: Vec<Part>,
    ticks_per_step: u64,
    position: u64,
    size: u64,
    policy: OnFailure,
    /// Halvings so far.
    pub cuts: usize,
}

/// A stage: its equal steps and its time, s.
#[derive(Debug, Clone, Copy)]
struct Part {
    steps: usize,
    duration: f64,
}

impl Stepping {
    /// `smallest` is the smallest allowed step as a fraction of the nominal one. Without time the
    /// load factor serves as the time of formulas: a stage then lasts 1 s.
    pub fn new(stages: &[Stage], with_time: bool, policy: OnFailure, smallest: f64) -> Self {
        let duration = |stage: &Stage| stage.duration.filter(|_| with_time).unwrap_or(1.0);
        let part =
            |stage: &Stage| Part { steps: stage.steps.unwrap_or(1), duration: duration(stage) };
        let parts = stages.iter().map(part).collect();
        let halvings = (1.0 / smallest).log2().floor().clamp(0.0, 40.0) as u32;
        let ticks_per_step = 1u64 << halvings;
        Stepping { parts, ticks_per_step, position: 0, size: ticks_per_step, policy, cuts: 0 }
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
        let (mut first, mut begin) = (0, 0.0);
        for (stage, part) in self.parts.iter().enumerate() {
            let ticks = part.steps as u64 * self.ticks_per_step;
            if self.position >= first + ticks {
                first += ticks;
                begin += part.duration;
                continue;
            }
            let factor = |position: u64| (position - first) as f64 / ticks as f64;
            let (start, end) = (factor(self.position), factor(self.position + self.size));
            return Some(StepSpan {
                stage,
                factor_start: start,
                factor_end: end,
                time_start: begin + start * part.duration,
                time_end: begin + end * part.duration,
            });
        }
        None
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

    /// Nominal steps of all stages.
    pub fn steps(&self) -> usize {
        self.parts.iter().map(|part| part.steps).sum()
    }

    fn total(&self) -> u64 {
        self.steps() as u64 * self.ticks_per_step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage(steps: usize, duration: f64) -> Stage {
        let name = String::new();
        Stage { name, steps: Some(steps), duration: Some(duration), reset_displacement: false }
    }

    fn stepping() -> Stepping {
        Stepping::new(&[stage(4, 8.0)], true, OnFailure::Cut, 1.0 / 8.0)
    }

    #[test]
    fn s_runs_from_zero_to_one_in_each_stage() {
        let stages = [stage(2, 8.0), stage(1, 2.0)];
        let mut stepping = Stepping::new(&stages, true, OnFailure::Cut, 1.0 / 8.0);
        assert_eq!(stepping.steps(), 3);
        let mut ends = Vec::new();
        stepping.accept();
        assert!(stepping.refuse());
        while let Some(span) = stepping.next_span() {
            ends.push((span.stage, span.factor_start, span.factor_end, span.time_end));
            stepping.accept();
        }
        assert_eq!(ends, [(0, 0.5, 0.75, 6.0), (0, 0.75, 1.0, 8.0), (1, 0.0, 1.0, 10.0)]);
        let mut still = Stepping::new(&stages, false, OnFailure::Cut, 1.0);
        for _ in 0..2 {
            still.accept();
        }
        let span = still.next_span().expect("a step");
        assert_eq!((span.time_start, span.time_end), (1.0, 2.0));
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
        let mut coarse = Stepping::new(&[stage(4, 8.0)], true, OnFailure::Cut, 0.5);
        assert_eq!(coarse.restore(&state).unwrap_err().exit_code(), 3);
    }

    #[test]
    fn the_smallest_step_is_the_last_resort() {
        let mut stepping = stepping();
        assert_eq!((0..10).take_while(|_| stepping.refuse()).count(), 3);
        let mut stop = Stepping::new(&[stage(4, 0.0)], true, OnFailure::Stop, 1.0 / 8.0);
        assert!(!stop.refuse());
    }
}
