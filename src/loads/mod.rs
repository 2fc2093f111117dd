//! External forces.
//!
//! | load | file | source |
//! |---|---|---|
//! | gravity, body forces, point forces | `point_forces.rs` | Lagrangian eq. 29 |
//! | body forces that make a given field exact | `manufactured.rs` | Lagrangian §7.4 |

pub mod manufactured;
pub mod point_forces;
