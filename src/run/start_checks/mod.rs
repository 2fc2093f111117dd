//! What is checked before a run writes anything.
//!
//! | question | file |
//! |---|---|
//! | does every formula have a value, does every condition meet something? | `formulas.rs` |
//! | does one boundary hold what another moves? | `contest.rs` |
//! | does something hold every rigid motion of every piece? | `support.rs`, `pieces.rs` |
//! | does the problem fit into the machine? | `memory.rs`, `free_memory.rs` |

pub mod contact;
mod contest;
pub mod formulas;
pub mod free_memory;
pub mod memory;
pub mod pieces;
pub mod support;
