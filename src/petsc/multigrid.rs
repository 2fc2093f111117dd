//! Multigrid's cycle (`-<prefix>pc_type mg`) under a solver, on levels that are given.
//!
//! PETSc runs the cycle, with its smoothers and coarse solver under the usual options
//! (`-<prefix>mg_levels_ksp_type`, `-<prefix>mg_coarse_pc_type`, ...).

use std::ptr::{null, null_mut};

use mpi::collective::SystemOperation;
use mpi::traits::{Communicator, CommunicatorCollectives};

use super::check::{petsc, text_of};
use super::options::set_default;
use super::product_matrix::{Product, ProductMatrix};
pub use super::smoother::Smoother;
use super::{Ksp, Matrix, sys};
use super::{factors, smoother};
use crate::error::{Error, Result};

/// A level with a smoother.
pub(crate) struct Level<P> {
    pub matrix: ProductMatrix<P>,
    /// From the next level to this one.
    pub transfer: ProductMatrix<P>,
    /// Eigenvalues of D^-1 A, least and largest, between which Chebyshev's smoother acts.
    pub smoothed: [f64; 2],
}

/// Whether the solver's preconditioner is a cycle.
pub(crate) fn is_wanted(solver: &Ksp) -> Result<bool> {
    is_type(preconditioner(solver)?, sys::PCMG)
}

fn preconditioner(solver: &Ksp) -> Result<sys::PC> {
    petsc!(KSPGetPC(solver.raw()) -> null_mut())
}

pub(super) fn is_type(pc: sys::PC, kind: &[u8]) -> Result<bool> {
    let same = petsc!(PetscObjectTypeCompare(pc.cast(), kind.as_ptr().cast()) -> sys::PETSC_FALSE)?;
    Ok(same != sys::PETSC_FALSE)
}

/// Puts `levels`, from the finest to the last but one, and the last, `coarsest`, under a solver with
/// operators; whatever it had goes. The first of `smoothers` goes under Chebyshev's iteration on the
/// finest level, and so on; Jacobi's where there is none. Collective.
pub(crate) fn install<P: Product, S: Smoother>(
    solver: &Ksp,
    levels: &[Level<P>],
    smoothers: Vec<Option<S>>,
    coarsest: &Matrix,
) -> Result<()> {
    let count = levels.len() as sys::PetscInt;
    let pc = preconditioner(solver)?;
    petsc!(PCSetType(pc, sys::PCNONE.as_ptr().cast()))?;
    petsc!(PCSetType(pc, sys::PCMG.as_ptr().cast()))?;
    petsc!(PCMGSetLevels(pc, count + 1, null_mut()))?;
    for ((number, level), smoother) in (1..=count).rev().zip(levels).zip(smoothers) {
        put_level(pc, number, level, smoother)?;
    }
    put_coarsest(solver, pc, coarsest)?;
    petsc!(PCSetFromOptions(pc))
}

/// Smoother, residual and transfer of a level.
fn put_level<P: Product, S: Smoother>(
    pc: sys::PC,
    number: sys::PetscInt,
    level: &Level<P>,
    own: Option<S>,
) -> Result<()> {
    let chebyshev = petsc!(PCMGGetSmoother(pc, number) -> null_mut())?;
    petsc!(KSPSetType(chebyshev, sys::KSPCHEBYSHEV.as_ptr().cast()))?;
    let inner = petsc!(KSPGetPC(chebyshev) -> null_mut())?;
    match own {
        Some(own) => smoother::put(inner, own)?,
        None => petsc!(PCSetType(inner, sys::PCJACOBI.as_ptr().cast()))?,
    }
    let (matrix, transfer) = (level.matrix.raw(), level.transfer.raw());
    petsc!(KSPSetOperators(chebyshev, matrix, matrix))?;
    let [low, high] = level.smoothed;
    petsc!(KSPChebyshevSetEigenvalues(chebyshev, high, low))?;
    petsc!(KSPSetFromOptions(chebyshev))?;
    // PETSc would find out in the middle of a cycle, and not get out of it without a crash.
    if is_type(inner, sys::PCSOR)? || is_type(inner, sys::PCEISENSTAT)? {
        return Err(Error::Input(
            "SOR and Eisenstat's form of it need the entries of the matrix, and the levels of multigrid (pc_type mg) have \
             only products: use mg_levels_pc_type jacobi, or pc_type gamg"
                .into(),
        ));
    }
    petsc!(PCMGSetInterpolation(pc, number, transfer))?;
    petsc!(PCMGSetRestriction(pc, number, transfer))
}

/// Solved by factors: on the rank that has all of it, else by PETSc's default, a copy for each.
fn put_coarsest(solver: &Ksp, pc: sys::PC, matrix: &Matrix) -> Result<()> {
    let coarse = petsc!(PCMGGetCoarseSolve(pc) -> null_mut())?;
    petsc!(KSPSetOperators(coarse, matrix.raw(), matrix.raw()))?;
    let prefix = text_of(petsc!(KSPGetOptionsPrefix(coarse) -> null())?);
    for inner in ["", "sub_", "redundant_"] {
        set_default(&format!("{prefix}{inner}{}", factors::ZERO_PIVOT.0), factors::ZERO_PIVOT.1)?;
    }
    let (comm, mut holders) = (solver.comm(), 0);
    comm.all_reduce_into(&i32::from(matrix.rows_local() > 0), &mut holders, SystemOperation::sum());
    if holders == 1 && comm.size() > 1 {
        let inner = petsc!(KSPGetPC(coarse) -> null_mut())?;
        petsc!(PCSetType(inner, sys::PCBJACOBI.as_ptr().cast()))?;
        set_default(&format!("{prefix}sub_pc_type"), "lu")?;
    }
    Ok(())
}

/// Lets the smoother of the finest level follow the values of its matrix; one of the program's by
/// `renew`.
pub(crate) fn renew_finest_smoother<S: Smoother>(
    solver: &Ksp,
    renew: impl FnOnce(&mut S) -> Result<()>,
) -> Result<()> {
    let (pc, mut levels, mut chebyshev) = (preconditioner(solver)?, 0, null_mut());
    let mut inner = null_mut();
    petsc!(PCMGGetLevels(pc, &mut levels))?;
    petsc!(PCMGGetSmoother(pc, levels - 1, &mut chebyshev))?;
    petsc!(KSPGetPC(chebyshev, &mut inner))?;
    // SAFETY: the shells in this cycle are those of `install`, all of one type.
    unsafe { smoother::with(inner, renew) }?;
    petsc!(KSPSetUp(chebyshev))
}

/// Makes the iteration multiply by `product`, which stands for `matrix`.
pub(crate) fn multiply_by<P: Product>(
    solver: &Ksp,
    product: &ProductMatrix<P>,
    matrix: &Matrix,
) -> Result<()> {
    petsc!(KSPSetOperators(solver.raw(), product.raw(), matrix.raw()))
}

/// Whether the user's lag says that the preconditioner of an earlier matrix shall serve on.
pub(crate) fn is_kept(solver: &Ksp) -> Result<bool> {
    let kept = petsc!(KSPGetReusePreconditioner(solver.raw()) -> sys::PETSC_FALSE)?;
    Ok(kept != sys::PETSC_FALSE)
}
