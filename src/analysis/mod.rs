//! The time loops; each reads like the papers' algorithm.
//!
//! | deck value or step | file | source |
//! |---|---|---|
//! | `quasi-static` | `quasi_static.rs` | Lagrangian §6.3, 6.5; Ghost §2.4 |
//! | grid side of a step: map, number | `discretise.rs` | Ghost Figure 1 a-c |
//! | Newton iterations with the papers' bookkeeping | `equilibrium.rs` | Lagrangian eq. 26-30, 40 |
//! | points at the end of a step | `update.rs` | Lagrangian eq. 31-39 |
//! | figures of merit | `verify.rs` | Lagrangian eq. 42 |

pub mod discretise;
pub mod equilibrium;
pub mod update;
