//! Why a step has no end: data, the same on every rank. `analysis/failure.rs` has the words.

use crate::error::Error;

/// What a smaller step may mend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Newton's method found no solution.
    NotConverged,
    /// A point's increment is not a number.
    NotFinite,
    /// A point would be turned inside out.
    Inverted,
    /// A point would leave the grid.
    Leaves,
    /// The domain of a point would turn over or leave the grid.
    Domain,
    /// A cell of a moving mesh would turn over.
    Cell,
    /// A rigid surface would reach a cell deep into a body.
    Penetration,
}

/// A step that cannot be applied.
#[derive(Debug)]
pub struct Refusal {
    pub cause: Cause,
    /// Where, and by how much.
    pub what: String,
}

/// Why a step has no end.
#[derive(Debug)]
pub enum Halt {
    /// Its equations have no solution or its increments cannot be applied.
    Refused(Refusal),
    /// Energy has grown without work: the step is solved, its row shows what happened.
    Unstable {
        gain: String,
        remedy: String,
    },
    Failed(Error),
}

impl From<Error> for Halt {
    fn from(error: Error) -> Self {
        Halt::Failed(error)
    }
}

impl From<Refusal> for Halt {
    fn from(refusal: Refusal) -> Self {
        Halt::Refused(refusal)
    }
}
