//! Phases of a step as log stages, so that `-log_view` lists each with its time and messages.

use super::check::{c_text, petsc, require_running};
use super::sys;
use crate::error::Result;

/// The rows of the time table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    Locate,
    Assemble,
    Solve,
    Update,
    Migrate,
    Output,
}

impl Phase {
    pub const ALL: [Phase; 6] = [
        Phase::Locate,
        Phase::Assemble,
        Phase::Solve,
        Phase::Update,
        Phase::Migrate,
        Phase::Output,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Phase::Locate => "locate",
            Phase::Assemble => "assemble",
            Phase::Solve => "solve",
            Phase::Update => "update",
            Phase::Migrate => "migrate",
            Phase::Output => "output",
        }
    }
}

/// Stage numbers given by PETSc.
#[derive(Debug, Clone)]
pub struct Stages([sys::PetscLogStage; Phase::ALL.len()]);

impl Stages {
    /// Collective; once per session.
    pub fn register() -> Result<Self> {
        require_running()?;
        let mut stages = [0; Phase::ALL.len()];
        for phase in Phase::ALL {
            let name = c_text(phase.name())?;
            petsc!(PetscLogStageRegister(name.as_ptr(), &mut stages[phase as usize]))?;
        }
        Ok(Stages(stages))
    }

    /// Counts what follows under `phase` until the guard is dropped; phases may nest.
    pub fn enter(&self, phase: Phase) -> Result<Entered> {
        petsc!(PetscLogStagePush(self.0[phase as usize]))?;
        Ok(Entered(()))
    }
}

/// Leaves the phase when dropped.
#[must_use]
#[derive(Debug)]
pub struct Entered(());

impl Drop for Entered {
    fn drop(&mut self) {
        if super::check::running() {
            // SAFETY: pops the stage pushed by `enter`.
            unsafe { sys::PetscLogStagePop() };
        }
    }
}
