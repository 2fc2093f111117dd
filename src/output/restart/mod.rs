//! Checkpoints and what keeps them safe.
//!
//! | idea | file |
//! |---|---|
//! | `checkpoint-*.h5` | `checkpoint.rs` |
//! | named numbers that a time loop needs to go on | `run_state.rs` |
//! | proof that a file is whole and unchanged | `seal.rs` |
//! | one run at a time in a directory | `run_lock.rs` |

pub(crate) mod checkpoint;
pub(crate) mod run_lock;
pub(crate) mod run_state;
pub mod seal;
