//! Where the time goes: wall seconds per phase, with PETSc's log stages beside them.

use std::time::Instant;

use crate::error::Result;
use crate::output::summary::PhaseSeconds;
use crate::parallel::traffic::{self, Traffic};
use crate::petsc::log::{Phase, Stages};

/// Seconds since the start and per phase.
pub struct Clock {
    start: Instant,
    stages: Option<Stages>,
    seconds: [f64; Phase::ALL.len()],
    setup: f64,
    setup_traffic: Traffic,
    busy: f64,
}

impl Clock {
    /// Starts now. `stages` is `None` where PETSc does not run.
    pub fn new(stages: Option<Stages>) -> Self {
        Clock {
            start: Instant::now(),
            stages,
            seconds: [0.0; Phase::ALL.len()],
            setup: 0.0,
            setup_traffic: Traffic::default(),
            busy: 0.0,
        }
    }

    /// Everything until now was set-up.
    pub fn end_setup(&mut self) {
        self.setup = self.elapsed();
        self.setup_traffic = traffic::so_far();
    }

    /// What this rank has sent since the set-up.
    pub fn traffic(&self) -> Traffic {
        traffic::so_far() - self.setup_traffic
    }

    /// Runs `work` under a phase.
    pub fn time<T>(&mut self, phase: Phase, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let entered = self.stages.as_ref().map(|stages| stages.enter(phase)).transpose()?;
        let (begin, before) = (Instant::now(), traffic::so_far());
        let outcome = work();
        let seconds = begin.elapsed().as_secs_f64();
        self.add(phase, seconds);
        if matches!(phase, Phase::Locate | Phase::Assemble | Phase::Update) {
            self.add_busy(seconds - (traffic::so_far() - before).waited);
        }
        drop(entered);
        outcome
    }

    /// Counts seconds measured elsewhere.
    pub fn add(&mut self, phase: Phase, seconds: f64) {
        self.seconds[phase as usize] += seconds;
    }

    /// Counts seconds of this rank's own work, without what it waited for others, that were not
    /// counted by [`Self::time`].
    pub fn add_busy(&mut self, seconds: f64) {
        self.busy += seconds.max(0.0);
    }

    /// s of this rank's own work on points: locate, assemble, update, without waiting.
    pub fn busy(&self) -> f64 {
        self.busy
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
