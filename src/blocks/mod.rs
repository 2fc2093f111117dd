//! Sparse matrices of small dense blocks on one rank, and their products: what multigrid and the
//! iterations around it spend their time on. Why they stand beside PETSc's: docs/develop/why-not-petsc.md.
//!
//! | file | idea |
//! |---|---|
//! | `whole.rs` | [`Blocks`]: all blocks of each row |
//! | `half.rs` | [`Half`]: the lower half of a symmetric matrix |
//! | `product.rs` | [`BlockProduct`]: the rows of one rank, columns of other ranks apart |
//! | `stored.rs` | [`Stored`]: values in single or double precision |

mod half;
mod product;
mod stored;
mod whole;

pub use half::Half;
pub use product::{BlockProduct, Row};
pub use stored::Stored;
pub use whole::Blocks;
