//! Records of a run while it goes on: history, frames, checkpoints, figures of merit.
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

pub(crate) mod checkpointing;
pub(crate) mod clock;
pub(crate) mod contact;
pub(crate) mod context;
pub(crate) mod ledger;
pub(crate) mod probes;
pub(crate) mod reactions;
pub(crate) mod recorder;
pub(crate) mod step;
pub(crate) mod verify;
