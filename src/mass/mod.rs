//! The mass of the nodes and its solve.
//!
//! | file | idea |
//! |---|---|
//! | `matrix.rs` | consistent, stabilised and lumped mass (Ghost eq. 7, 15, 24) |
//! | `grid_mass.rs` | which of them a step uses (Ghost eq. 10) |
//! | `light_nodes.rs` | nodes with hardly any mass, or less, move along with the points |
//! | `inverse.rs` | M x = b for all components at once |
//! | `solver.rs`, `system.rs` | PETSc's KSP for it; the product and the preconditioner that it calls |
//! | `incomplete.rs`, `elimination.rs` | that preconditioner: Cholesky without fill, and its order |

pub mod elimination;
pub mod grid_mass;
pub mod incomplete;
pub mod inverse;
pub mod light_nodes;
pub mod matrix;
pub mod solver;
pub mod system;
