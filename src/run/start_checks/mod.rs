//! What is checked before a run writes anything.
//!
//! | question | file |
//! |---|---|
//! | does every formula have a value, does every condition meet something? | `formulas.rs`, of loads `loads.rs` |
//! | which point is to blame? | `faulty.rs` |
//! | does one boundary hold what another moves? | `contest.rs` |
//! | does a term of the deck act on something? | `terms.rs` |
//! | does something hold every rigid motion of every piece? | `support.rs`; what holds, `holders.rs`; which motions are left, `rigid_motions.rs`; pieces, `pieces.rs` |
//! | does the problem fit into the machine? | `memory.rs`, `free_memory.rs` |

mod contest;
mod faulty;
pub(crate) mod formulas;
pub(crate) mod free_memory;
mod holders;
mod loads;
pub(crate) mod memory;
pub(crate) mod pieces;
mod rigid_motions;
pub(crate) mod support;
mod terms;
