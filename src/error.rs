//! The one error type, sorted by who has to act; `exit_code` is the command line's contract.

/// What ended a run. The text is complete: what is wrong, where, and what would be right.
#[derive(Debug, Clone, thiserror::Error)]
pub enum Error {
    /// The calculation failed: not converged, an inverted point, a point that left the grid.
    #[error("{0}")]
    Run(String),
    /// The deck, a file it names, or the command line is wrong.
    #[error("{0}")]
    Input(String),
    /// A restart or result file cannot be read or written.
    #[error("{0}")]
    File(String),
    /// MPI, PETSc, HDF5 or METIS refused to work.
    #[error("{0}")]
    Environment(String),
}

impl Error {
    /// Process exit code: 1 run, 2 input, 3 file, 4 environment.
    pub fn exit_code(&self) -> i32 {
        match self {
            Error::Run(_) => 1,
            Error::Input(_) => 2,
            Error::File(_) => 3,
            Error::Environment(_) => 4,
        }
    }
}

/// The outcome of what can fail in a run.
pub type Result<T> = std::result::Result<T, Error>;
