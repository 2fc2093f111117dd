//! What a run tells about itself while it goes on.
//!
//! | idea | file | source |
//! |---|---|---|
//! | world, model, points, recorder and clock of a run | `context.rs` | |
//! | a finished step | `step.rs` | |
//! | rows, frames, summary | `recorder/` | |
//! | energies and momenta | `ledger.rs` | Ghost §5.2 |
//! | forces on the boundaries | `reactions.rs` | Rotation Figure 7 |
//! | forces and states of contacts | `contact.rs` | formulations.md B.5 |
//! | figures of merit | `verify.rs` | Lagrangian eq. 42 |
//! | watched points | `probes.rs` | |
//! | wall time by phase | `clock.rs` | |
//! | checkpoints and restarts | `checkpointing.rs` | |

pub mod checkpointing;
pub mod clock;
pub mod contact;
pub mod context;
pub mod ledger;
pub mod probes;
pub mod reactions;
pub mod recorder;
pub mod step;
pub mod verify;
