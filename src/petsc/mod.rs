//! Thin, safe wrappers over the parts of PETSc that the project uses.
//!
//! | file | idea |
//! |---|---|
//! | `sys.rs` | raw bindings, generated |
//! | `check.rs` | return codes to errors; one rank's error becomes every rank's |
//! | `session.rs` | start and end of PETSc, order of the options, abort |
//! | `options.rs` | defaults that the user can override, options nobody read |
//! | `known.rs` | options no solver knows, told before the run |
//! | `vector.rs` | [`Vector`]: distributed vector with borrowed local values |
//! | `matrix.rs` | [`Matrix`]: compressed rows of fixed pattern, fast update of the values |
//! | `blocks.rs` | [`Blocks`]: sparse matrix of small blocks in single precision |
//! | `half.rs` | [`Half`]: the same of a symmetric matrix, one of each two mirrored blocks kept |
//! | `product.rs` | such a matrix in the place of PETSc's own |
//! | `smoother.rs` | multigrid's cycle on such matrices |
//! | `ksp.rs` | [`Ksp`]: linear solver |
//! | `snes.rs` | [`Snes`]: Newton's method over the callbacks of a [`NewtonProblem`] |
//! | `forcing.rs` | [`Forcing`]: how well each linear solve of Newton's method is worth doing |
//! | `log.rs` | [`log::Phase`]: stages seen by `-log_view` |
//!
//! Every constructor and every method that talks to a communicator is collective. Objects that
//! outlive the [`Session`] are not destroyed one by one: PETSc has already ended.

mod blocks;
mod check;
mod forcing;
mod half;
pub mod known;
pub mod ksp;
pub mod log;
pub mod matrix;
pub mod options;
mod product;
pub mod session;
mod smoother;
pub mod snes;
pub mod sys;
pub mod vector;

pub use blocks::Blocks;
pub use check::agree;
pub use forcing::Forcing;
pub use half::Half;
pub use ksp::{Ksp, KspOutcome};
pub use matrix::Matrix;
pub use session::{Session, abort_all, version};
pub use snes::{NewtonOutcome, NewtonProblem, Snes, Verdict};
pub use vector::Vector;
