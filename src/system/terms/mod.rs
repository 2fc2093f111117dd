//! Contributions to a step's equations. A new one is a file that implements [`Term`] and a line
//! where `analysis/equilibrium/mod.rs` lists the terms of a step.
//!
//! | term | file | source |
//! |---|---|---|
//! | what each of them says of itself | `term.rs` | |
//! | internal force and tangent stiffness of the points | `stress.rs` | Lagrangian eq. 27, 28 |
//! | pressures by virtual stress | `pressure.rs` | Given et al. 2024 |
//! | tractions, pressures and supports on surfaces | `surface.rs` | formulations.md B.6 |
//! | what a point's own stress transmits over an area | `own_traction.rs` | Nitsche's method |
//! | both of these as external forces that follow the motion | `following.rs` | |
//! | their dense blocks | `block.rs` | |
//! | rigid surfaces | `contact.rs` | formulations.md B.5 |
//! | which points are far from these | `node_gaps.rs` | |
//! | two bodies in contact, in implicit steps | `facing.rs` | |
//! | Ghost stiffness | `ghost.rs` | Ghost eq. 27, 28 |
//! | inertia of implicit dynamics | `inertia.rs` | Ghost §3.3 |
//! | products of the last two | `scalar.rs` | |

pub mod block;
pub mod contact;
pub mod facing;
pub(crate) mod following;
pub mod ghost;
pub(crate) mod inertia;
mod node_gaps;
mod own_traction;
pub mod pressure;
mod scalar;
pub mod stress;
pub mod surface;
pub mod term;
pub mod touching;

pub use term::Term;
