//! Contributions to a step's equations.
//!
//! | term | file | source |
//! |---|---|---|
//! | internal force and tangent stiffness of the points | `stress.rs` | Lagrangian eq. 27, 28 |
//! | Ghost stiffness, inertia | `linear.rs` | Ghost eq. 28, §3.3 |

pub mod linear;
pub mod stress;
