//! Phases of a step as log stages, so that `-log_view` lists each with its time and messages.

use super::check::{c_text, petsc, require_running};
use super::sys;
use crate::error::Result;

/// The rows of the time table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Points to cells, basis functions, numbering.
    Locate,
    /// Forces and tangents.
    Assemble,
    /// Linear solves.
    Solve,
    /// Points at the end of a step.
    Update,
    /// Points to other ranks.
    Migrate,
    /// Files.
    Output,
}

impl Phase {
    /// In the order of the report.
    pub const ALL: [Phase; 6] = [
        Phase::Locate,
        Phase::Assemble,
        Phase::Solve,
        Phase::Update,
        Phase::Migrate,
        Phase::Output,
    ];

    /// As the report and `-log_view` have it.
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

/// Stage numbers given by PETSc; none where nobody asked for a log: a stage carries a table of all
/// events, 1.7 MB for the six.
#[derive(Debug, Clone)]
pub struct Stages(Option<[sys::PetscLogStage; Phase::ALL.len()]>);

impl Stages {
    /// Collective; once per session.
    pub fn register() -> Result<Self> {
        require_running()?;
        let logging = petsc!(PetscLogIsActive() -> sys::PETSC_FALSE)?;
        if logging == sys::PETSC_FALSE {
            return Ok(Stages(None));
        }
        let mut stages = [0; Phase::ALL.len()];
        for phase in Phase::ALL {
            let name = c_text(phase.name())?;
            petsc!(PetscLogStageRegister(name.as_ptr(), &mut stages[phase as usize]))?;
        }
        Ok(Stages(Some(stages)))
    }

    /// Counts what follows under `phase` until the guard is dropped; phases may nest.
    pub fn enter(&self, phase: Phase) -> Result<Entered> {
        if let Some(stages) = &self.0 {
            petsc!(PetscLogStagePush(stages[phase as usize]))?;
        }
        Ok(Entered { pushed: self.0.is_some() })
    }
}

/// Leaves the phase when dropped.
#[must_use]
#[derive(Debug)]
pub struct Entered {
    pushed: bool,
}

impl Drop for Entered {
    fn drop(&mut self) {
        if self.pushed && super::check::running() {
            // SAFETY: pops the stage pushed by `enter`.
            unsafe { sys::PetscLogStagePop() };
        }
    }
}
