//! Whose factors solve the systems of direct solvers: those of MUMPS, which a PETSc need not have,
//! else PETSc's own, which live on one rank.

use std::ptr::null_mut;

use super::check::petsc;
use super::sys;

/// Only zero is a zero pivot. PETSc's own factors take one below 2.2e-14 for zero, in whatever units the matrix is.
pub const ZERO_PIVOT: (&str, &str) = ("pc_factor_zeropivot", "0");

/// PETSc's name for MUMPS.
pub const MUMPS: &str = "mumps";
/// PETSc's name for its own factors.
pub const OWN: &str = "petsc";

/// [`MUMPS`] or [`OWN`]; call while PETSc runs.
pub fn package() -> &'static str {
    let (mut package, mut kind) = (sys::PETSC_FALSE, sys::PETSC_FALSE);
    // Before the first matrix PETSc does not know of MUMPS yet.
    let ready = petsc!(MatInitializePackage());
    let found = petsc!(MatSolverTypeGet(
        c"mumps".as_ptr(),
        sys::MATSEQAIJ.as_ptr().cast(),
        sys::MAT_FACTOR_LU,
        &mut package,
        &mut kind,
        null_mut()
    ));
    // A question that fails leaves MUMPS: the solver then says what is wrong with it.
    if ready.is_ok() && found.is_ok() && kind == sys::PETSC_FALSE { OWN } else { MUMPS }
}

/// What a user should know of it: nothing where MUMPS is there.
pub fn note() -> Option<String> {
    (package() == OWN).then(|| {
        "note: this PETSc is built without MUMPS: direct solves take PETSc's own factors, on one rank, \
         and more time"
            .to_string()
    })
}
