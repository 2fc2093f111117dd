//! Linear solver: A x = b by whatever the options under the prefix say.

use std::ptr::{null, null_mut};

use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{AsRaw, Communicator, CommunicatorCollectives};

use super::abort::unless_shared;
use super::check::{agree, c_text, petsc, require_running, text_of};
use super::object::owned;
use super::{Matrix, Vector, sys};
use crate::error::{Error, Result};

/// Owner of a PETSc `KSP`.
pub struct Ksp {
    raw: sys::KSP,
    comm: SimpleCommunicator,
    prefix: String,
    /// Matrix the solver was last given.
    matrix: u64,
}

/// How a linear solve ended.
#[derive(Debug, Clone, PartialEq)]
pub struct KspOutcome {
    /// Of the method.
    pub iterations: usize,
    /// Whether the tolerance was reached.
    pub converged: bool,
    /// PETSc's word for the end, for example `CONVERGED_RTOL`.
    pub reason: String,
    /// In the norm of the method (preconditioned for most); zero for a direct solver.
    pub residual_norm: f64,
}

impl KspOutcome {
    /// An error of the run unless the solve converged; `what` names the system.
    pub fn require(self, what: &str) -> Result<Self> {
        if self.converged {
            return Ok(self);
        }
        Err(Error::Run(format!(
            "the linear solver for {what} ended with {} after {} iterations (residual norm {:.3e})",
            self.reason, self.iterations, self.residual_norm
        )))
    }
}

impl Ksp {
    /// `prefix` without the dash: options `-<prefix>ksp_type`, `-<prefix>pc_type`, ...
    pub fn new(comm: &SimpleCommunicator, prefix: &str) -> Result<Self> {
        require_running()?;
        let mut ksp = Self::from_reference(null_mut(), comm, prefix);
        petsc!(KSPCreate(ksp.comm.as_raw(), &mut ksp.raw))?;
        let prefix = c_text(prefix)?;
        petsc!(KSPSetOptionsPrefix(ksp.raw, prefix.as_ptr()))?;
        Ok(ksp)
    }

    /// Takes over one reference to a live `KSP`.
    pub(crate) fn from_reference(raw: sys::KSP, comm: &SimpleCommunicator, prefix: &str) -> Self {
        Ksp { raw, comm: comm.duplicate(), prefix: prefix.into(), matrix: 0 }
    }

    /// Takes over one reference in place of none.
    pub(crate) fn take_reference(&mut self, raw: sys::KSP) {
        debug_assert!(self.raw.is_null(), "a solver is taken over once");
        self.raw = raw;
    }

    /// Built-in options under the prefix: pairs such as `("ksp_type", "cg")`. The user's win.
    /// Call before [`Self::set_from_options`].
    pub fn set_defaults<V: AsRef<str>>(&self, options: &[(&str, V)]) -> Result<()> {
        for (name, value) in options {
            super::options::set_default(&format!("{}{name}", self.prefix), value.as_ref())?;
        }
        Ok(())
    }

    /// Reads the options under the prefix. Values set by methods before this can be overridden
    /// by the user, values set after it cannot.
    pub fn set_from_options(&mut self) -> Result<()> {
        petsc!(KSPSetFromOptions(self.raw)).map_err(|error| unless_shared(&self.comm, error))
    }

    /// The matrix of the next solves. After a change of its values call this again, unless
    /// the old preconditioner is to serve on. Another matrix may have another size and pattern.
    pub fn set_operators(&mut self, matrix: &Matrix) -> Result<()> {
        if self.matrix != 0 && self.matrix != matrix.id() {
            forget(self.raw, &self.comm)?;
        }
        self.matrix = matrix.id();
        petsc!(KSPSetOperators(self.raw, matrix.raw(), matrix.raw()))
    }

    /// Keep what [`Self::extreme_singular_values`] needs. Call before the solve.
    pub fn set_compute_singular_values(&mut self) -> Result<()> {
        petsc!(KSPSetComputeSingularValues(self.raw, sys::PETSC_TRUE))
    }

    /// Estimates of the smallest and largest singular value of the preconditioned matrix, from
    /// the last solve (Lanczos' or Arnoldi's method; of CG and GMRES only).
    pub fn extreme_singular_values(&self) -> Result<(f64, f64)> {
        let (mut largest, mut smallest) = (0.0, 0.0);
        petsc!(KSPComputeExtremeSingularValues(self.raw, &mut largest, &mut smallest))?;
        Ok((smallest, largest))
    }

    /// Solves A x = b. Not converging is an outcome, the same on all ranks, not an error: see
    /// [`KspOutcome::require`].
    pub fn solve(&mut self, b: &Vector, x: &mut Vector) -> Result<KspOutcome> {
        petsc!(KSPSolve(self.raw, b.raw(), x.raw()))
            .map_err(|error| unless_shared(&self.comm, error))?;
        self.outcome()
    }

    /// How the last solve ended, the same on all ranks. Collective.
    pub(crate) fn outcome(&self) -> Result<KspOutcome> {
        outcome(self.raw, &self.comm).map(|(outcome, _)| outcome)
    }

    pub(crate) fn comm(&self) -> &SimpleCommunicator {
        &self.comm
    }

    pub(crate) fn prefix(&self) -> &str {
        &self.prefix
    }

    pub(crate) fn raw(&self) -> sys::KSP {
        self.raw
    }

    /// Method and preconditioner in use, for the report: for example "cg + mg".
    pub fn describe(&self) -> Result<String> {
        describe(self.raw)
    }
}

owned!(Ksp);

/// Drops all that belongs to the old matrix, so that one of another size can follow. A reset is
/// not enough: GAMG would keep its levels. The preconditioner is made anew from its options.
pub(crate) fn forget(ksp: sys::KSP, comm: &SimpleCommunicator) -> Result<()> {
    petsc!(KSPReset(ksp))?;
    let pc = petsc!(KSPGetPC(ksp) -> null_mut())?;
    let kind = petsc!(PCGetType(pc) -> null())?;
    if kind.is_null() {
        return Ok(());
    }
    let kind = c_text(&text_of(kind))?;
    petsc!(PCSetType(pc, sys::PCNONE.as_ptr().cast()))?;
    petsc!(PCSetType(pc, kind.as_ptr()))?;
    petsc!(PCSetFromOptions(pc)).map_err(|error| unless_shared(comm, error))
}

/// How the ranks came to an [`outcome`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ranks {
    Agreed,
    /// PETSc knows of the failure on some of them only.
    Apart,
}

/// The end of the last solve of a live `KSP`: it failed on all ranks if it did on one. PETSc leaves
/// that to the iteration's sums, and a direct solver has none: where the factors are one rank's
/// (telescope, block Jacobi), the others take what comes for the solution. Collective.
pub(crate) fn outcome(ksp: sys::KSP, comm: &SimpleCommunicator) -> Result<(KspOutcome, Ranks)> {
    let mine = reason_of(ksp);
    // An error is lower than any of PETSc's reasons; the negative ones are failures.
    let reason = *mine.as_ref().unwrap_or(&-i32::MAX);
    let (ends, mut lowest) = ([reason, -reason], [0; 2]);
    comm.all_reduce_into(&ends[..], &mut lowest[..], SystemOperation::min());
    let [low, high] = [lowest[0], -lowest[1]];
    if low > 0 {
        return Ok((outcome_here(ksp)?, Ranks::Agreed));
    }
    agree(comm, mine)?;
    let (mut outcome, cause) = agree(comm, failure_here(ksp))?;
    let iterations = outcome.iterations;
    comm.all_reduce_into(&iterations, &mut outcome.iterations, SystemOperation::min());
    // The words of a rank that knows the cause, else of any on which it failed.
    for speaks in [!outcome.converged && cause, !outcome.converged] {
        let words = if speaks { Err(Error::Run(outcome.reason.clone())) } else { Ok(()) };
        if let Err(words) = agree(comm, words) {
            outcome.reason = words.to_string();
            break;
        }
    }
    outcome.converged = false;
    Ok((outcome, if low == high { Ranks::Agreed } else { Ranks::Apart }))
}

fn reason_of(ksp: sys::KSP) -> Result<sys::KSPConvergedReason> {
    petsc!(KSPGetConvergedReason(ksp) -> 0)
}

/// As this rank sees it.
fn outcome_here(ksp: sys::KSP) -> Result<KspOutcome> {
    let reason = reason_of(ksp)?;
    let text = petsc!(KSPGetConvergedReasonString(ksp) -> null())?;
    let iterations = petsc!(KSPGetIterationNumber(ksp) -> 0)?;
    let norm = petsc!(KSPGetResidualNorm(ksp) -> 0.0)?;
    Ok(KspOutcome {
        iterations: iterations.max(0) as usize,
        converged: reason > 0,
        reason: text_of(text),
        residual_norm: norm,
    })
}

/// The same with the preconditioner's cause, and whether this rank has one.
fn failure_here(ksp: sys::KSP) -> Result<(KspOutcome, bool)> {
    let mut outcome = outcome_here(ksp)?;
    if reason_of(ksp)? != sys::KSP_DIVERGED_PC_FAILED {
        return Ok((outcome, false));
    }
    let pc = petsc!(KSPGetPC(ksp) -> null_mut())?;
    let cause = pc_failure(pc)?;
    outcome.reason = format!("{} ({})", outcome.reason, name_of(cause));
    Ok((outcome, cause != sys::PC_SUBPC_ERROR))
}

fn name_of(reason: sys::PCFailedReason) -> &'static str {
    match reason {
        sys::PC_FACTOR_STRUCT_ZEROPIVOT => "the matrix is structurally singular",
        sys::PC_FACTOR_NUMERIC_ZEROPIVOT => "zero pivot: the matrix is singular",
        sys::PC_FACTOR_OUTMEMORY => "the factorisation ran out of memory",
        sys::PC_FACTOR_OTHER => "the factorisation failed",
        sys::PC_SUBPC_ERROR => "an inner solver failed",
        _ => "the preconditioner could not be set up",
    }
}

/// Why a preconditioner failed on this rank; of solvers inside solvers the innermost.
fn pc_failure(pc: sys::PC) -> Result<sys::PCFailedReason> {
    let reason = petsc!(PCGetFailedReason(pc) -> sys::PC_NOERROR)?;
    if reason != sys::PC_SUBPC_ERROR {
        return Ok(reason);
    }
    for inner in solvers_inside(pc)? {
        let pc = petsc!(KSPGetPC(inner) -> null_mut())?;
        let cause = pc_failure(pc)?;
        if cause != sys::PC_NOERROR {
            return Ok(cause);
        }
    }
    Ok(reason)
}

/// This rank's solvers that a preconditioner of a common kind works with.
fn solvers_inside(pc: sys::PC) -> Result<Vec<sys::KSP>> {
    let mut one = null_mut();
    let (mut count, mut several) = (0, null_mut());
    let kind = petsc!(PCGetType(pc) -> null())?;
    match text_of(kind).as_str() {
        "telescope" => petsc!(PCTelescopeGetKSP(pc, &mut one))?,
        "redundant" => petsc!(PCRedundantGetKSP(pc, &mut one))?,
        "ksp" => petsc!(PCKSPGetKSP(pc, &mut one))?,
        "mg" | "gamg" => petsc!(PCMGGetCoarseSolve(pc, &mut one))?,
        "bjacobi" => petsc!(PCBJacobiGetSubKSP(pc, &mut count, null_mut(), &mut several))?,
        "asm" => petsc!(PCASMGetSubKSP(pc, &mut count, null_mut(), &mut several))?,
        _ => {}
    }
    if several.is_null() {
        return Ok(if one.is_null() { Vec::new() } else { vec![one] });
    }
    // SAFETY: PETSc returned an array of `count` solvers that lives as long as `pc`.
    Ok(unsafe { std::slice::from_raw_parts(several, count.max(0) as usize) }.to_vec())
}

pub(crate) fn describe(ksp: sys::KSP) -> Result<String> {
    let method = petsc!(KSPGetType(ksp) -> null())?;
    let pc = petsc!(KSPGetPC(ksp) -> null_mut())?;
    let pc_type = petsc!(PCGetType(pc) -> null())?;
    let mut text = format!("{} + {}", text_of(method), text_of(pc_type));
    let solver = petsc!(PCFactorGetMatSolverType(pc) -> null())?;
    if !solver.is_null() {
        text = format!("{text} ({})", text_of(solver));
    }
    Ok(text)
}
