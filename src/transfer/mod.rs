//! Between points and nodes.
//!
//! | idea | file | source |
//! |---|---|---|
//! | sums over points at the nodes, and back | `mapping.rs` | Ghost eq. 6, 8-10 |
//! | affine transfers (APIC, TPIC) | `affine.rs` | Jiang et al. 2015, 2017 |
//! | nodal sums across ranks | `nodal_sums.rs` | |
//! | points at the end of a step | `update.rs` | Lagrangian eq. 31-39 |
//! | is the end of a step sound? | `soundness.rs` | |
//! | why a step cannot be applied | `refusal.rs` | |
//! | what carries the points | `transport.rs` | Ghost eq. 9 |
//! | the mesh between steps | `mesh_motion.rs` | Rotation §2 (viii) |

pub(crate) mod affine;
pub(crate) mod mapping;
pub(crate) mod mesh_motion;
pub(crate) mod nodal_sums;
pub(crate) mod refusal;
pub(crate) mod soundness;
pub(crate) mod transport;
pub mod update;
