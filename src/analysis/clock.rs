//! Where the time goes: wall seconds per phase, with PETSc's log stages beside them.

use std::time::Instant;

use crate::error::Result;
use crate::output::summary::PhaseSeconds;
use crate::petsc::log::{Phase, Stages};

/// Seconds since the start and per phase.
pub struct Clock {
    start: Instant,
    stages: Option<Stages>,
    seconds: [f64; Phase::ALL.len()],
    setup: f64,
}

impl Clock {
    /// Starts now. `stages` is `None` where PETSc does not run.
    pub fn new(stages: Option<Stages>) -> Self {
        Clock { start: Instant::now(), stages, seconds: [0.0; Phase::ALL.len()], setup: 0.0 }
    }

    /// Everything until now was set-up.
    pub fn end_setup(&mut self) {
        self.setup = self.elapsed();
    }

    /// Runs `work` under a phase.
    pub fn time<T>(&mut self, phase: Phase, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let entered = self.stages.as_ref().map(|stages| stages.enter(phase)).transpose()?;
        let begin = Instant::now();
        let outcome = work();
        self.add(phase, begin.elapsed().as_secs_f64());
        drop(entered);
        outcome
    }

    /// Counts seconds measured elsewhere.
    pub fn add(&mut self, phase: Phase, seconds: f64) {
        self.seconds[phase as usize] += seconds;
    }

    /// s since the start
    pub fn elapsed(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    pub fn phases(&self) -> PhaseSeconds {
        let of = |phase: Phase| self.seconds[phase as usize];
        PhaseSeconds {
            total: self.elapsed(),
            setup: self.setup,
            locate: of(Phase::Locate),
            assemble: of(Phase::Assemble),
            solve: of(Phase::Solve),
            update: of(Phase::Update),
            migrate: of(Phase::Migrate),
            output: of(Phase::Output),
        }
    }
}
