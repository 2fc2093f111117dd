//! Multigrid's cycle on matrices in single precision.
//!
//! Chebyshev's method, the residual of a level and the transfer between levels only multiply by
//! matrices that stream from memory: in [`super::Blocks`] they have less than half the bytes. The
//! iteration outside keeps the exact matrix, so the answer is the same; the preconditioner stays
//! fixed and symmetric. `-<prefix>mg_levels_single false` leaves PETSc's matrices in place.

use std::ptr::{null, null_mut};

use mpi::topology::SimpleCommunicator;

use super::check::petsc;
use super::product::{Shell, exact, is_type};
use super::sys;
use crate::error::Result;

/// Gives the levels of a GAMG preconditioner their matrices in single precision, where they are
/// smoothed by Chebyshev's method with Jacobi's; sets the solver up if that is due. Any other
/// solver is left alone. `kept`: the hierarchy is not going to be renewed, and what would only serve
/// for that is given back. Collective; `ksp` has its operators.
pub(super) fn compact(ksp: sys::KSP, comm: &SimpleCommunicator, kept: bool) -> Result<()> {
    let (mut pc, mut levels) = (null_mut(), 0);
    petsc!(KSPGetPC(ksp, &mut pc))?;
    if !is_type(pc.cast(), sys::PCGAMG)? || !wanted(ksp)? {
        return Ok(());
    }
    restore_transfers(ksp, pc)?;
    petsc!(KSPSetUp(ksp))?;
    petsc!(PCMGGetLevels(pc, &mut levels))?;
    if kept {
        forget_products(pc, levels)?;
    }
    for level in 1..levels {
        let mut smoother = null_mut();
        petsc!(PCMGGetSmoother(pc, level, &mut smoother))?;
        let Some(matrix) = replaceable(smoother)? else { continue };
        let Some(shell) = Shell::of(matrix, comm)? else { continue };
        petsc!(KSPSetOperators(smoother, shell.raw(), matrix))?;
        petsc!(PCMGSetResidual(pc, level, Some(sys::PCMGResidualDefault), shell.raw()))?;
        let mut transfer = null_mut();
        petsc!(PCMGGetInterpolation(pc, level, &mut transfer))?;
        if !is_compressed(transfer)? {
            continue;
        }
        if let Some(shell) = Shell::of(transfer, comm)? {
            petsc!(PCMGSetInterpolation(pc, level, shell.raw()))?;
            petsc!(PCMGSetRestriction(pc, level, shell.raw()))?;
        }
    }
    Ok(())
}

/// Frees what the coarse operators were multiplied out with; the next hierarchy, if there is one
/// after all, is made from nothing.
fn forget_products(pc: sys::PC, levels: sys::PetscInt) -> Result<()> {
    petsc!(PCGAMGSetReuseInterpolation(pc, sys::PETSC_FALSE))?;
    for level in 0..levels - 1 {
        let (mut smoother, mut matrix) = (null_mut(), null_mut());
        petsc!(PCMGGetSmoother(pc, level, &mut smoother))?;
        petsc!(KSPGetOperators(smoother, null_mut(), &mut matrix))?;
        petsc!(MatProductClear(matrix))?;
    }
    Ok(())
}

/// Puts the exact transfer matrices back where another hierarchy is about to be made of them.
fn restore_transfers(ksp: sys::KSP, pc: sys::PC) -> Result<()> {
    let (mut reused, mut levels) = (sys::PETSC_FALSE, 0);
    petsc!(KSPGetReusePreconditioner(ksp, &mut reused))?;
    petsc!(PCMGGetLevels(pc, &mut levels))?;
    if reused != sys::PETSC_FALSE {
        return Ok(());
    }
    for level in 1..levels {
        let mut transfer = null_mut();
        petsc!(PCMGGetInterpolation(pc, level, &mut transfer))?;
        if !transfer.is_null() && is_type(transfer.cast(), sys::MATSHELL)? {
            let exact = exact(transfer)?;
            petsc!(PCMGSetInterpolation(pc, level, exact))?;
            petsc!(PCMGSetRestriction(pc, level, exact))?;
        }
    }
    Ok(())
}

/// Levels that have such a matrix.
pub(super) fn count(ksp: sys::KSP) -> Result<usize> {
    let (mut pc, mut levels, mut count) = (null_mut(), 0, 0);
    petsc!(KSPGetPC(ksp, &mut pc))?;
    if !is_type(pc.cast(), sys::PCGAMG)? {
        return Ok(0);
    }
    petsc!(PCMGGetLevels(pc, &mut levels))?;
    for level in 1..levels {
        let (mut smoother, mut matrix) = (null_mut(), null_mut());
        petsc!(PCMGGetSmoother(pc, level, &mut smoother))?;
        petsc!(KSPGetOperators(smoother, &mut matrix, null_mut()))?;
        count += usize::from(is_type(matrix.cast(), sys::MATSHELL)?);
    }
    Ok(count)
}

fn wanted(ksp: sys::KSP) -> Result<bool> {
    let name = c"-mg_levels_single".as_ptr();
    let (mut prefix, mut value) = (null(), sys::PETSC_TRUE);
    petsc!(KSPGetOptionsPrefix(ksp, &mut prefix))?;
    petsc!(PetscOptionsGetBool(null_mut(), prefix, name, &mut value, null_mut()))?;
    Ok(value != sys::PETSC_FALSE)
}

/// The matrix of a level that is smoothed with products alone and with known eigenvalues (an
/// estimate would be made anew for another matrix).
fn replaceable(smoother: sys::KSP) -> Result<Option<sys::Mat>> {
    let (mut pc, mut estimator) = (null_mut(), null_mut());
    let (mut matrix, mut other) = (null_mut(), null_mut());
    petsc!(KSPGetPC(smoother, &mut pc))?;
    if !is_type(smoother.cast(), sys::KSPCHEBYSHEV)? || !is_type(pc.cast(), sys::PCJACOBI)? {
        return Ok(None);
    }
    petsc!(KSPChebyshevEstEigGetKSP(smoother, &mut estimator))?;
    petsc!(KSPGetOperators(smoother, &mut matrix, &mut other))?;
    let kept = estimator.is_null() && matrix == other;
    Ok((kept && is_compressed(matrix)?).then_some(matrix))
}

fn is_compressed(matrix: sys::Mat) -> Result<bool> {
    Ok(is_type(matrix.cast(), sys::MATSEQAIJ)? || is_type(matrix.cast(), sys::MATMPIAIJ)?)
}
