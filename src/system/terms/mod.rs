//! Contributions to a step's equations. A new one that a table of the deck switches on is a file that implements
//! [`Declaration`] for what the deck says and [`Term`] for the step, and its name in the list
//! `terms!` below. `analysis/equilibrium/motion.rs` puts all terms of a step in their order.
//!
//! | term | file | source |
//! |---|---|---|
//! | what each of them says of itself | `term.rs` | |
//! | what the deck asks of those that it switches on | `declaration.rs` | |
//! | springs below points | `foundation.rs` | Winkler |
//! | internal force and tangent stiffness of the points | `stress.rs` | Lagrangian eq. 27, 28 |
//! | stress and tangent of one point | `point_response.rs` | Lagrangian eq. 16-23 |
//! | pressures by virtual stress | `pressure.rs` | Given et al. 2024 |
//! | tractions, pressures and supports on surfaces | `surface.rs` | formulations.md B.6 |
//! | what a point's own stress transmits over an area | `own_traction.rs` | Nitsche's method |
//! | both of these as external forces that follow the motion | `following.rs` | |
//! | their dense blocks | `block.rs` | |
//! | rigid surfaces | `contact/` | formulations.md B.5 |
//! | two bodies in contact, in implicit steps | `facing.rs` | |
//! | Ghost stiffness | `ghost.rs` | Ghost eq. 27, 28 |
//! | inertia of implicit dynamics | `inertia.rs` | Ghost §3.3 |
//! | products of the last two | `scalar.rs` | |

pub mod block;
pub mod contact;
pub mod declaration;
pub mod facing;
pub(crate) mod following;
mod foundation;
pub mod ghost;
pub(crate) mod inertia;
mod own_traction;
pub(crate) mod point_response;
pub mod pressure;
mod scalar;
pub mod stress;
pub mod surface;
pub mod term;
pub mod touching;

pub use foundation::Foundation;
pub use term::Term;

use crate::deck::model::Body;
use crate::deck::schema::{Key, Kind, Section};
use crate::deck::{Got, Table};
use crate::error::Result;
use crate::loads::Around;
use crate::points::Points;
use declaration::{Context, Declaration};

declaration::terms! { Foundation }
