//! The algorithms, in the order and notation of the papers.
//!
//! | deck value or step | file | source |
//! |---|---|---|
//! | the time loop | `time_loop.rs` | |
//! | `quasi-static` | `implicit.rs` | Lagrangian §6.3, 6.5; Ghost §2.4 |
//! | `explicit` | `explicit.rs`, `explicit_step.rs`, `explicit_nodes.rs` | Ghost §2.3, 3.5 |
//! | `implicit-dynamic` | `implicit.rs`, `inertial.rs`, `newmark.rs` | Newmark and HHT over Ghost §2.4, 3.3, 3.4 |
//! | `strength-reduction` | `strength_reduction.rs` | Griffiths, Lane 1999 |
//! | `conditioning` | `conditioning.rs`, `extremes.rs` | Ghost §2.6, 3.5, 5.1.1 |
//! | `element-test` | `element_test.rs` | one point, no grid |
//! | contact in explicit steps | `explicit_contact.rs`, `explicit_bodies.rs` | formulations.md B.5 |
//! | rigid bodies that move freely | `free_bodies.rs`; in implicit steps `free_motion.rs` | Broyden 1965 |
//! | what comes and goes with a stage | `stage_changes.rs`, `release.rs` | |
//! | damping of dynamics | `damping.rs` | Cundall 1987 |
//! | do initial stresses carry what acts at the start? | `initial_balance.rs` | |
//! | load steps, cut and grown again | `load_steps.rs` | |
//! | time steps and their stability limit | `time_steps.rs` | Ghost §3.5 |
//! | Newton's method for a step | `newton.rs`, `convergence.rs` | Lagrangian eq. 26-30, 40 |
//! | the equations that it solves | `equilibrium/` | Lagrangian eq. 26-30 |
//! | default linear solvers | `solver.rs` | |
//! | the user's options for them, tried on a small system | `rehearsal.rs` | |
//! | a step that ends a run, in words | `failure.rs` | |

pub(crate) mod conditioning;
pub(crate) mod convergence;
mod damping;
pub(crate) mod element_test;
pub mod equilibrium;
pub(crate) mod explicit;
mod explicit_bodies;
pub(crate) mod explicit_contact;
mod explicit_nodes;
pub(crate) mod explicit_step;
mod external;
pub(crate) mod extremes;
pub(crate) mod failure;
mod free_bodies;
mod free_motion;
pub(crate) mod implicit;
mod inertial;
pub(crate) mod initial_balance;
pub(crate) mod load_steps;
pub(crate) mod newmark;
pub mod newton;
mod rehearsal;
mod release;
pub(crate) mod round_off;
pub mod solver;
mod stage_changes;
pub(crate) mod strength_reduction;
pub(crate) mod time_loop;
pub(crate) mod time_steps;
