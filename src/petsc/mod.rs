//! Thin, safe wrappers over the parts of PETSc that the project uses.
//!
//! | file | idea |
//! |---|---|
//! | `sys.rs` | raw bindings, generated |
//! | `check.rs` | return codes to errors; one rank's error becomes every rank's |
//! | `session.rs` | start and end of PETSc, order of the options |
//! | `abort.rs` | the end of all ranks at once |
//! | `options.rs` | defaults that the user can override, options nobody read |
//! | `files.rs` | files that options name, tried before PETSc does |
//! | `known.rs` | options that no solver knows, refused before the run |
//! | `vector.rs` | [`Vector`]: distributed vector with borrowed local values |
//! | `matrix.rs` | [`Matrix`]: compressed rows of fixed pattern, fast update of the values |
//! | `product_matrix.rs` | [`Product`]: a matrix that is known by its products |
//! | `multigrid.rs` | the cycle under a solver, on levels that are given |
//! | `smoother.rs` | [`Smoother`](multigrid::Smoother): a preconditioner of the program's in that cycle |
//! | `blas.rs` | the kernel that OpenBLAS runs |
//! | `factors.rs` | whose factors direct solvers take: MUMPS's, or PETSc's own |
//! | `object.rs` | handles given back when they go out of scope |
//! | `ksp.rs` | [`Ksp`]: linear solver |
//! | `shell.rs` | [`ShellKsp`]: the same where the matrix is a product of the program's |
//! | `snes.rs` | [`Snes`]: Newton's method over the callbacks of a [`NewtonProblem`] |
//! | `forcing.rs` | [`Forcing`]: how well each linear solve of Newton's method is worth doing |
//! | `log.rs` | [`log::Phase`]: stages seen by `-log_view` |
//!
//! Every constructor and every method that talks to a communicator is collective. Objects that
//! outlive the [`Session`] are not destroyed one by one: PETSc has already ended.

pub(crate) mod abort;
pub(crate) mod blas;
pub(crate) mod check;
pub(crate) mod factors;
pub(crate) mod files;
mod forcing;
pub(crate) mod known;
pub(crate) mod ksp;
pub mod log;
pub(crate) mod matrix;
pub(crate) mod multigrid;
mod object;
pub mod options;
pub(crate) mod product_matrix;
pub(crate) mod session;
mod shell;
mod smoother;
pub mod snes;
pub(crate) mod sys;
pub(crate) mod vector;

pub use abort::install_panic_hook;
pub use check::agree;
pub use forcing::Forcing;
pub use ksp::{Ksp, KspOutcome};
pub use matrix::Matrix;
pub use product_matrix::Product;
pub use session::{Session, version};
pub use shell::{ShellKsp, ShellSystem};
pub use snes::{NewtonOutcome, NewtonProblem, Snes, Verdict};
pub use vector::{Index, Vector};
