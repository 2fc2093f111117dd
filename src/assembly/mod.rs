//! From points to the distributed system of equations (Ghost Figure 1 b, c).
//!
//! | file | idea |
//! |---|---|
//! | `populated.rs` | which cells hold material, and whose |
//! | `numbering.rs` | equations over active nodes, contiguous by rank |
//! | `node_index.rs` | grid nodes to small indices |
//! | `graph.rs` | which nodes meet |
//! | `pattern.rs` | exact sparsity, and where every contribution goes |
//! | `internal.rs` | internal force and tangent stiffness of the points (Lagrangian eq. 27, 28) |
//! | `places.rs` | where each dense block lies in the rows |
//! | `kernel.rs` | the same sums, tiled for vector registers |
//! | `plain.rs` | the same sums once more, written as the formulas read |
//! | `mass.rs` | consistent, stabilised and lumped mass (Ghost eq. 7, 15, 24) |
//! | `inverse.rs`, `envelope.rs` | M x = b for all components at once |
//! | `iteration.rs` | conjugate gradients on several right-hand sides |
//! | `incomplete.rs`, `elimination.rs` | their preconditioner: Cholesky without fill, and its order |
//! | `border.rs` | what waits for other ranks, and what does not |
//! | `scatter.rs` | dense blocks into the rows of their owners |
//! | `in_place.rs` | those rows in the solver's own memory |
//! | `held.rs` | held degrees of freedom in those rows |
//! | `external.rs` | gravity, body forces, point forces (Lagrangian eq. 29) |
//! | `manufactured.rs` | body forces that make a given field exact (Lagrangian §7.4) |
//! | `conditions.rs` | Dirichlet conditions on the nodes |

pub mod border;
pub mod conditions;
mod elimination;
pub mod envelope;
pub mod external;
pub mod graph;
pub mod held;
pub mod in_place;
mod incomplete;
pub mod internal;
pub mod inverse;
mod iteration;
mod kernel;
pub mod manufactured;
pub mod mass;
pub mod node_index;
pub mod numbering;
pub mod pattern;
pub mod places;
pub mod plain;
pub mod populated;
pub mod scatter;

pub use numbering::Numbering;
pub use pattern::Pattern;
pub use populated::Populated;
pub use scatter::BlockMatrix;
