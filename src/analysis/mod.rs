//! The time loops; each reads like the papers' algorithm.
//!
//! | deck value or step | file | source |
//! |---|---|---|
//! | `quasi-static` | `quasi_static.rs` | Lagrangian §6.3, 6.5; Ghost §2.4 |
//! | `explicit` | `explicit.rs`, `explicit_step.rs`, `explicit_nodes.rs`, `time_step.rs` | Ghost §2.3, 3.5 |
//! | what carries the points | `transport.rs` | Ghost eq. 9 |
//! | `implicit-dynamic` | `implicit_dynamic.rs`, `newmark.rs` | Newmark and HHT over Ghost §2.4, 3.3, 3.4 |
//! | `conditioning` | `conditioning.rs`, `extremes.rs` | Ghost §2.6, 3.5, 5.1.1 |
//! | points to nodes and back | `mapping.rs`, across ranks `nodal_sums.rs` | Ghost eq. 6, 8-10 |
//! | mass of the nodes | `grid_mass.rs` | Ghost eq. 7, 10, 15, 24 |
//! | energies and momenta | `ledger.rs` | Ghost §5.2 |
//! | deck to points on their ranks | `setup.rs` | |
//! | does it fit into the machine? | `room.rs`, `free_memory.rs` | |
//! | formulas without a value, conditions on nothing? | `first_state.rs` | |
//! | rigid motions of every piece held? | `support.rs`, `pieces.rs` | |
//! | locate, map and number: the grid side of a step | `discretise.rs` (`grid/locate.rs`) | Ghost Figure 1 a-c |
//! | assemble and solve, with the papers' bookkeeping | `equilibrium.rs`, `linear_terms.rs` | Lagrangian eq. 26-30, 40 |
//! | Newton's method for a step | `newton.rs`, `convergence.rs` | |
//! | default linear solvers | `solver.rs` | |
//! | update: points at the end of a step | `update.rs` | Lagrangian eq. 31-39 |
//! | back to a step's start where it fails | `snapshot.rs` | |
//! | the mesh between steps | `motion.rs` | Rotation §2 (viii) |
//! | migrate, and a new partition where it pays | `balance.rs` (`parallel/migrate.rs`) | |
//! | what every accepted step ends with | `step_end.rs` | |
//! | cut and grow load steps | `stepping.rs` | |
//! | forces on the boundaries | `reactions.rs` | Rotation Figure 7 |
//! | figures of merit | `verify.rs` | Lagrangian eq. 42 |
//! | a run from command line to results | `driver.rs`, `plan.rs`, `process.rs` | |
//! | rows, frames, summary | `recorder.rs`, `clock.rs` | |
//! | checkpoints and restarts | `checkpointing.rs` | |

pub mod balance;
pub mod checkpointing;
pub mod clock;
pub mod conditioning;
mod convergence;
pub mod discretise;
pub mod driver;
pub mod equilibrium;
pub mod explicit;
mod explicit_nodes;
mod explicit_step;
pub mod extremes;
pub mod first_state;
mod free_memory;
pub mod grid_mass;
pub mod implicit_dynamic;
pub mod ledger;
pub mod linear_terms;
pub mod mapping;
pub mod motion;
pub mod newmark;
pub mod newton;
mod nodal_sums;
pub mod pieces;
pub mod plan;
mod process;
pub mod quasi_static;
pub mod reactions;
pub mod recorder;
mod room;
pub mod setup;
pub mod snapshot;
pub mod solver;
pub mod step_end;
pub mod stepping;
pub mod support;
pub mod time_step;
pub mod transport;
pub mod update;
pub mod verify;
