//! What is checked before a run writes anything.
//!
//! | question | file |
//! |---|---|
//! | does every formula have a value, does every condition meet something? | `formulas.rs`, of loads `loads.rs` |
//! | which point is to blame? | `faulty.rs` |
//! | does one boundary hold what another moves? | `contest.rs` |
//! | does something hold every rigid motion of every piece? | `support.rs`, `pieces.rs` |
//! | does the problem fit into the machine? | `memory.rs`, `free_memory.rs` |

mod contest;
mod faulty;
pub(crate) mod formulas;
pub(crate) mod free_memory;
mod loads;
pub(crate) mod memory;
pub(crate) mod pieces;
pub(crate) mod support;
