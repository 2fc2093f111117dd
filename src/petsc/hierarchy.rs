//! Multigrid's cycle (`-<prefix>pc_type mg`) on levels that the program makes.
//!
//! PETSc runs the cycle, with its smoothers and coarse solver under the usual options
//! (`-<prefix>mg_levels_ksp_type`, `-<prefix>mg_coarse_pc_type`, ...). Smoothers, residuals and
//! transfers multiply by matrices in single precision: they stream from memory, and have less
//! than half the bytes. The iteration outside keeps the exact matrix, so the answer is the same.
//! The levels are symmetric. Under an unsymmetric matrix A they are those of (A + A^T) / 2.

use super::vector::Index;
use std::ptr::{null, null_mut};

use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives};

use super::block_product::{BlockProduct, Shell};
use super::check::{petsc, text_of};
use super::matrix::Matrix;
use super::options::set_default;
use super::sys;
use crate::error::{Error, Result};

/// Levels from the finest to the last but one, and the last.
pub struct Hierarchy {
    /// The matrix A itself. That of the finest level is its symmetric part, rounded.
    pub exact: BlockProduct<f64>,
    pub levels: Vec<Smoothed>,
    pub coarsest: CoarsestRows,
}

/// A level with a smoother.
pub struct Smoothed {
    /// Its matrix A.
    pub product: BlockProduct<f32>,
    /// Largest eigenvalue of D^-1 A.
    pub largest: f64,
    /// P, from the next level to this one.
    pub transfer: BlockProduct<f32>,
}

/// This rank's rows of the last level, compressed: global columns, ascending.
#[derive(Debug, Default)]
pub struct CoarsestRows {
    pub block: usize,
    pub offsets: Vec<Index>,
    pub columns: Vec<Index>,
    pub values: Vec<f64>,
}

/// Chebyshev's smoother takes care of the eigenvalues between these shares of the largest: further
/// down than PETSc's own multigrid goes, as the groups of the finest level are large.
const SMOOTHED: [f64; 2] = [0.06, 1.1];

/// Whether the solver's preconditioner is a cycle on given levels.
pub(crate) fn wanted(ksp: sys::KSP) -> Result<bool> {
    let mut pc = null_mut();
    petsc!(KSPGetPC(ksp, &mut pc))?;
    is_type(pc, sys::PCMG)
}

fn is_type(pc: sys::PC, kind: &[u8]) -> Result<bool> {
    let mut same = sys::PETSC_FALSE;
    petsc!(PetscObjectTypeCompare(pc.cast(), kind.as_ptr().cast(), &mut same))?;
    Ok(same != sys::PETSC_FALSE)
}

/// A hierarchy in use.
pub(crate) struct Installed {
    /// States of the matrix that the levels were made for, and that the products hold.
    made: sys::PetscObjectState,
    filled: sys::PetscObjectState,
    exact: Shell<f64>,
    finest: Shell<f32>,
    /// Iterations per digit of the first solve.
    pace: Option<f64>,
    slow: bool,
}

/// New levels cost about as much as so many iterations (measured: 20 in the plane, 40 in space).
const WORTH: f64 = 25.0;

impl Installed {
    /// Puts the levels under a solver with operators; whatever it had goes. Collective.
    pub fn new(
        ksp: sys::KSP,
        comm: &SimpleCommunicator,
        state: sys::PetscObjectState,
        hierarchy: Hierarchy,
    ) -> Result<Self> {
        let Hierarchy { exact, levels, coarsest } = hierarchy;
        let count = levels.len() as sys::PetscInt;
        let mut pc = null_mut();
        petsc!(KSPGetPC(ksp, &mut pc))?;
        petsc!(PCSetType(pc, sys::PCNONE.as_ptr().cast()))?;
        petsc!(PCSetType(pc, sys::PCMG.as_ptr().cast()))?;
        petsc!(PCMGSetLevels(pc, count + 1, null_mut()))?;
        let mut finest = None;
        for (level, smoothed) in (1..=count).rev().zip(levels) {
            let matrix = put_level(pc, comm, level, smoothed)?;
            finest.get_or_insert(matrix);
        }
        put_coarsest(pc, comm, coarsest)?;
        petsc!(PCSetFromOptions(pc))?;
        let none = || Error::Environment("a hierarchy without levels".into());
        Ok(Installed {
            made: state,
            filled: state,
            exact: Shell::new(comm, exact)?,
            finest: finest.ok_or_else(none)?,
            pace: None,
            slow: false,
        })
    }

    /// Whether the levels shall serve for the matrix of `state`; `kept`: the user's lag says so.
    pub fn serves(&self, state: sys::PetscObjectState, kept: bool) -> bool {
        self.made == state || (kept && !self.slow)
    }

    /// Lets `fill` write the values of `state` into the exact matrix and the finest level's, if
    /// they are not there yet; the finest smoother follows, the other levels stay.
    pub fn follow(
        &mut self,
        ksp: sys::KSP,
        state: sys::PetscObjectState,
        fill: impl FnOnce(&mut BlockProduct<f64>, &mut BlockProduct<f32>) -> Result<()>,
    ) -> Result<()> {
        if self.filled == state {
            return Ok(());
        }
        self.filled = state;
        let finest = &mut self.finest;
        self.exact.change(|exact| finest.change(|rounded| fill(exact, rounded)))?;
        let (mut pc, mut levels, mut smoother) = (null_mut(), 0, null_mut());
        petsc!(KSPGetPC(ksp, &mut pc))?;
        petsc!(PCMGGetLevels(pc, &mut levels))?;
        petsc!(PCMGGetSmoother(pc, levels - 1, &mut smoother))?;
        petsc!(KSPSetUp(smoother))
    }

    /// Makes the solver's iteration multiply by the exact copy. `matrix` is what it stands for.
    pub fn multiply_by_copy(&self, ksp: sys::KSP, matrix: sys::Mat) -> Result<()> {
        petsc!(KSPSetOperators(ksp, self.exact.raw(), matrix))
    }

    /// Takes note of a solve: levels that have become slow are not kept.
    pub fn record_solve(&mut self, iterations: usize, tolerance: f64) {
        let (iterations, digits) = (iterations as f64, -tolerance.log10());
        match self.pace {
            None => self.pace = Some(iterations / digits),
            Some(pace) => self.slow = iterations - pace * digits > WORTH,
        }
    }
}

/// Smoother, residual and transfer of a level; its matrix.
fn put_level(
    pc: sys::PC,
    comm: &SimpleCommunicator,
    level: sys::PetscInt,
    smoothed: Smoothed,
) -> Result<Shell<f32>> {
    let Smoothed { product, largest, transfer } = smoothed;
    let (mut smoother, mut inner) = (null_mut(), null_mut());
    petsc!(PCMGGetSmoother(pc, level, &mut smoother))?;
    petsc!(KSPSetType(smoother, sys::KSPCHEBYSHEV.as_ptr().cast()))?;
    petsc!(KSPGetPC(smoother, &mut inner))?;
    petsc!(PCSetType(inner, sys::PCJACOBI.as_ptr().cast()))?;
    let matrix = Shell::new(comm, product)?;
    petsc!(KSPSetOperators(smoother, matrix.raw(), matrix.raw()))?;
    let [low, high] = SMOOTHED.map(|share| share * largest);
    petsc!(KSPChebyshevSetEigenvalues(smoother, high, low))?;
    petsc!(KSPSetFromOptions(smoother))?;
    // PETSc would find out in the middle of a cycle, and not get out of it without a crash.
    if is_type(inner, sys::PCSOR)? || is_type(inner, sys::PCEISENSTAT)? {
        return Err(Error::Input(
            "SOR and Eisenstat's form of it need the entries of the matrix, and the levels of multigrid (pc_type mg) have \
             only products: use mg_levels_pc_type jacobi, or pc_type gamg"
                .into(),
        ));
    }
    let transfer = Shell::new(comm, transfer)?;
    petsc!(PCMGSetInterpolation(pc, level, transfer.raw()))?;
    petsc!(PCMGSetRestriction(pc, level, transfer.raw()))?;
    Ok(matrix)
}

/// Solved by factors: on the rank that has all of it, else by PETSc's default, a copy for each.
fn put_coarsest(pc: sys::PC, comm: &SimpleCommunicator, rows: CoarsestRows) -> Result<()> {
    let CoarsestRows { block, offsets, columns, values } = rows;
    let count = offsets.len() - 1;
    let matrix = Matrix::from_csr(comm, block, count, &offsets, &columns, &values)?;
    let mut coarse = null_mut();
    petsc!(PCMGGetCoarseSolve(pc, &mut coarse))?;
    petsc!(KSPSetOperators(coarse, matrix.raw(), matrix.raw()))?;
    let mut holders = 0;
    comm.all_reduce_into(&i32::from(count > 0), &mut holders, SystemOperation::sum());
    if holders == 1 && comm.size() > 1 {
        let (mut inner, mut prefix) = (null_mut(), null());
        petsc!(KSPGetPC(coarse, &mut inner))?;
        petsc!(PCSetType(inner, sys::PCBJACOBI.as_ptr().cast()))?;
        petsc!(KSPGetOptionsPrefix(coarse, &mut prefix))?;
        set_default(&format!("{}sub_pc_type", text_of(prefix)), "lu")?;
    }
    Ok(())
}
