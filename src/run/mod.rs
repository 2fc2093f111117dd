//! A run from its command line to its exit code.
//!
//! | step | file |
//! |---|---|
//! | the stages of a run, in order | `session.rs` |
//! | command lines that run nothing | `aside.rs` |
//! | a run of one point, without a grid | `element_run.rs` |
//! | deck to points on their ranks | `setup.rs` |
//! | parameters and state of the points' materials | `materials.rs` |
//! | surfaces and the points that carry them | `surfaces.rs` |
//! | stress before the first step | `initial_stress.rs` |
//! | what is checked before anything is written | `start_checks/` |
//! | what the run will do, printed ahead | `plan.rs`, `plan_checks.rs`, `lengths.rs`, `locking.rs`, `thin.rs` |
//! | the process that MPI starts | `process.rs` |

mod aside;
mod element_run;
mod initial_stress;
mod lengths;
mod locking;
mod materials;
pub(crate) mod plan;
mod plan_checks;
pub(crate) mod process;
pub mod session;
pub mod setup;
pub(crate) mod start_checks;
mod surfaces;
mod thin;
