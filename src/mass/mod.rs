//! The mass of the nodes and its solve.
//!
//! | file | idea |
//! |---|---|
//! | `matrix.rs` | consistent, stabilised and lumped mass (Ghost eq. 7, 15, 24) |
//! | `grid_mass.rs` | which of them a step uses (Ghost eq. 10) |
//! | `light_nodes.rs` | nodes with hardly any mass, or less, move along with the points |
//! | `inverse.rs` | M x = b for all components at once |
//! | `solver.rs`, `system.rs` | PETSc's KSP for it; the product and the preconditioner that it calls |
//! | `envelope.rs` | that preconditioner where the mass is small, on one rank: Cholesky with all fill |
//! | `incomplete.rs`, `elimination.rs` | elsewhere: Cholesky without fill, and its order |

pub(crate) mod elimination;
pub(crate) mod envelope;
pub(crate) mod grid_mass;
pub(crate) mod incomplete;
pub(crate) mod inverse;
pub(crate) mod light_nodes;
pub(crate) mod matrix;
pub(crate) mod solver;
pub(crate) mod system;
