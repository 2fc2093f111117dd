//! Newton's method: solve K(x) dx = F(x), x -= dx, until the problem's own test is content.
//!
//! PETSc's `SNES` runs the loop, so that its line searches and monitors are at hand under the
//! prefix; residual, matrix and convergence test are the [`NewtonProblem`]'s. After each callback
//! the ranks agree on its result: an error or an inadmissible iterate on one rank stops all.

use std::ffi::c_void;
use std::ptr::{null, null_mut};

use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{AsRaw, Communicator, CommunicatorCollectives};

use super::abort::unless_shared;
use super::check::{agree, c_text, petsc, require_running, text_of};
use super::forcing::{self, Forcing};
use super::ksp::{self, Ranks};
use super::object::owned;
use super::vector::DEFAULT;
use super::vector::{Index, LocalValues, LocalValuesMut, index};
use super::{Ksp, Matrix, Vector, sys};
use crate::error::{Error, Result};

/// The problem's judgement of an iterate.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// Another iteration.
    Continue,
    /// Enough.
    Converged,
    /// Give up; the text says why.
    Diverged(String),
}

/// Equations F(x) = 0. Slices are this rank's values.
///
/// Callbacks run on all ranks in the same order. They may communicate, but then every rank has
/// to reach the same calls, also when it has an error to report: an `Err`, `Ok(false)` or
/// `Diverged` returned by some ranks only takes effect on all of them *after* the callback.
pub trait NewtonProblem {
    /// F(x) into `f`. `Ok(false)`: x is outside the domain of the function; a line search then
    /// shortens the step, otherwise the solve ends unconverged. A problem that assembles both at
    /// once may write into the matrix as well: nobody multiplies with the values of the last
    /// iterate any more.
    fn residual(&mut self, x: &[f64], f: &mut [f64], matrix: &mut Matrix) -> Result<bool>;

    /// Updates the values of the matrix for x.
    fn jacobian(&mut self, x: &[f64], matrix: &mut Matrix) -> Result<()>;

    /// Last change of the right-hand side before each linear solve (prescribed displacements:
    /// the solution dx of K dx = rhs is subtracted from x).
    fn before_solve(&mut self, rhs: &mut [f64]) -> Result<()>;

    /// Judges each accepted iterate (0: the starting point), whose residual `f` was the last to
    /// be evaluated. `Converged` at iteration 0 is taken as `Continue`: at least one solve.
    /// `Converged` counts only if all ranks say so.
    fn assess(&mut self, iteration: usize, x: &[f64], f: &[f64]) -> Result<Verdict>;

    /// Error of the iterate assessed last over the error that is enough: an iterative linear
    /// solver need not reduce it by much more. Infinite: unknown. The same on all ranks.
    fn error_over_tolerance(&self) -> f64 {
        f64::INFINITY
    }

    /// Puts a preconditioner of the problem's own under the `solver` of the next linear solve, for the
    /// values that the matrix has. `earlier`: linear solves of this call before. An error has to be
    /// the same on all ranks.
    fn prepare_solver(
        &mut self,
        _solver: &Ksp,
        _matrix: &mut Matrix,
        _earlier: usize,
    ) -> Result<()> {
        Ok(())
    }

    /// Takes note of a linear solve: its iterations, and the relative tolerance it was given.
    fn record_solve(&mut self, _iterations: usize, _tolerance: f64) {}
}

/// How a nonlinear solve ended.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonOutcome {
    /// Linear solves.
    pub iterations: usize,
    /// Iterations of all linear solves.
    pub linear_iterations_total: usize,
    /// Most iterations of one linear solve.
    pub linear_iterations_max: usize,
    /// Relative tolerance of each linear solve.
    pub linear_tolerances: Vec<f64>,
    /// Whether the problem's test was met.
    pub converged: bool,
    /// It ended because a linear solve failed.
    pub linear_failure: bool,
    /// "converged", the problem's text, or PETSc's word for the end.
    pub reason: String,
}

/// Owner of a PETSc `SNES`; serves any number of solves, each with its own matrix.
pub struct Snes {
    raw: sys::SNES,
    comm: SimpleCommunicator,
    /// Matrix of the last solve.
    matrix: u64,
    /// Tolerances of an iterative linear solver, unless one is fixed.
    forcing: Option<Forcing>,
    /// The linear solver, once more. It is made with the owner: to make it takes all ranks, and in a
    /// solve a rank may have left with an error of its own.
    solver: Ksp,
}

/// What the callbacks see during one solve.
struct Context<'a, P> {
    problem: &'a mut P,
    matrix: &'a mut Matrix,
    comm: &'a SimpleCommunicator,
    forcing: Option<Forcing>,
    solver: &'a Ksp,
    error: Option<Error>,
    /// The last verdict of all ranks was `Verdict::Converged`.
    met: bool,
    /// The reason given with `Verdict::Diverged`.
    diverged: Option<String>,
    /// The last residual was asked for outside its domain.
    outside: bool,
    linear_solves: usize,
    linear_total: usize,
    linear_max: usize,
    linear_tolerances: Vec<f64>,
    linear_failure: Option<String>,
    /// PETSc does not know of it on every rank, and was stopped.
    apart: bool,
}

impl Snes {
    /// Newton's method with full steps (`-<prefix>snes_linesearch_type bt` for backtracking) and
    /// at most `max_solves` linear solves per call of [`Self::solve`]. `prefix` without the dash;
    /// it serves the linear solver too. An iterative one gets the tolerances of [`Forcing`]: fixed
    /// if the user gives `-<prefix>ksp_rtol` or `-<prefix>snes_ksp_ew false`.
    pub fn new(comm: &SimpleCommunicator, prefix: &str, max_solves: usize) -> Result<Self> {
        require_running()?;
        let comm = comm.duplicate();
        let solver = Ksp::from_reference(null_mut(), &comm, prefix);
        let mut snes = Snes { raw: null_mut(), comm, matrix: 0, forcing: None, solver };
        petsc!(SNESCreate(snes.comm.as_raw(), &mut snes.raw))?;
        let prefix = c_text(prefix)?;
        petsc!(SNESSetOptionsPrefix(snes.raw, prefix.as_ptr()))?;
        petsc!(SNESSetType(snes.raw, sys::SNESNEWTONLS.as_ptr().cast()))?;
        let inner = petsc!(SNESGetKSP(snes.raw) -> null_mut())?;
        petsc!(PetscObjectReference(inner.cast()))?;
        snes.solver.take_reference(inner);
        let search = petsc!(SNESGetLineSearch(snes.raw) -> null_mut())?;
        // Every version knows this word; the constant with it has changed its name.
        petsc!(SNESLineSearchSetType(search, c"basic".as_ptr()))?;
        snes.set_max_solves(max_solves)?;
        Ok(snes)
    }

    /// Most linear solves of the next call of [`Self::solve`].
    pub fn set_max_solves(&mut self, max_solves: usize) -> Result<()> {
        let default = DEFAULT as f64;
        // Step tolerance 0: after a failed line search PETSc would call a tiny step converged.
        let (step, solves) = (0.0, index(max_solves)?);
        petsc!(SNESSetTolerances(self.raw, default, default, step, solves, Index::MAX))
    }

    /// Built-in options under the prefix: pairs such as `("pc_type", "lu")`. The user's win.
    /// Call before [`Self::set_from_options`].
    pub fn set_defaults<V: AsRef<str>>(&self, options: &[(&str, V)]) -> Result<()> {
        self.solver.set_defaults(options)
    }

    /// Reads the options under the prefix, those of the linear solver included.
    pub fn set_from_options(&mut self) -> Result<()> {
        forcing::set_default(self.raw)?;
        petsc!(SNESSetFromOptions(self.raw)).map_err(|error| unless_shared(&self.comm, error))?;
        self.forcing = forcing::chosen(self.raw, self.solver.prefix())?;
        Ok(())
    }

    /// The linear solver inside: tolerances, reuse of the preconditioner, description.
    pub fn ksp(&self) -> &Ksp {
        &self.solver
    }

    /// Collective. Iterates from `x` to a solution, left in `x`. Not converging is an outcome;
    /// the error of a callback comes back as it was, the same on all ranks.
    pub fn solve<P: NewtonProblem>(
        &mut self,
        problem: &mut P,
        matrix: &mut Matrix,
        x: &mut Vector,
    ) -> Result<NewtonOutcome> {
        if self.matrix != 0 && self.matrix != matrix.id() {
            self.forget()?;
        }
        self.matrix = matrix.id();
        let raw_matrix = matrix.raw();
        let mut context = Context {
            problem,
            matrix,
            comm: &self.comm,
            forcing: self.forcing.clone(),
            solver: &self.solver,
            error: None,
            met: false,
            diverged: None,
            outside: false,
            linear_solves: 0,
            linear_total: 0,
            linear_max: 0,
            linear_tolerances: Vec::new(),
            linear_failure: None,
            apart: false,
        };
        // The callbacks get this pointer back while `SNESSolve` runs and at no other time.
        let data: *mut c_void = (&raw mut context).cast();
        let mut inner = null_mut();
        petsc!(SNESSetFunction(self.raw, null_mut(), Some(residual::<P>), data))?;
        petsc!(SNESSetJacobian(self.raw, raw_matrix, raw_matrix, Some(jacobian::<P>), data))?;
        petsc!(SNESSetConvergenceTest(self.raw, Some(assess::<P>), data, None))?;
        petsc!(SNESGetKSP(self.raw, &mut inner))?;
        petsc!(KSPSetPreSolve(inner, Some(before_solve::<P>), data))?;
        petsc!(KSPSetPostSolve(inner, Some(after_solve::<P>), data))?;

        let solved = petsc!(SNESSolve(self.raw, null_mut(), x.raw()));
        petsc!(KSPSetPreSolve(inner, None, null_mut()))?;
        petsc!(KSPSetPostSolve(inner, None, null_mut()))?;
        if let Some(error) = context.error.take() {
            // The loop was left in the middle: nothing of its state is of use.
            self.forget()?;
            return Err(error);
        }
        let (mut reason, mut text) = (sys::SNES_DIVERGED_LINEAR_SOLVE, null());
        if context.apart {
            self.forget()?;
        } else {
            solved.map_err(|error| unless_shared(&self.comm, error))?;
            petsc!(SNESGetConvergedReason(self.raw, &mut reason))?;
            petsc!(SNESGetConvergedReasonString(self.raw, &mut text))?;
        }
        // Line searches may end the iteration as converged by measures of their own.
        let by_search = reason > 0 && !context.met;
        let searched = by_search || reason == sys::SNES_DIVERGED_LINE_SEARCH;
        let at_zero = searched && self.residual_is_zero()?;
        let converged =
            (reason > 0 && context.met) || (at_zero && context.judge_again(self.raw)?);
        let linear_failure = !converged && reason == sys::SNES_DIVERGED_LINEAR_SOLVE;
        let reason = match (context.diverged, context.linear_failure) {
            _ if converged => "converged".to_owned(),
            _ if by_search => format!(
                "the line search ended the iteration above the tolerance ({})",
                text_of(text)
            ),
            // Line searches have their own word for it.
            _ if context.outside => "DIVERGED_FUNCTION_DOMAIN".to_owned(),
            (Some(why), _) => why,
            (None, Some(why)) if reason == sys::SNES_DIVERGED_LINEAR_SOLVE => why,
            _ => text_of(text),
        };
        Ok(NewtonOutcome {
            iterations: context.linear_solves,
            linear_iterations_total: context.linear_total,
            linear_iterations_max: context.linear_max,
            linear_tolerances: context.linear_tolerances,
            converged,
            linear_failure,
            reason,
        })
    }

    /// Whether the last residual is zero to the last bit: there is no direction to search along, and
    /// PETSc's line searches take that for a failure.
    fn residual_is_zero(&self) -> Result<bool> {
        let mut f = null_mut();
        petsc!(SNESGetFunction(self.raw, &mut f, null_mut(), null_mut()))?;
        let norm = petsc!(VecNorm(f, sys::NORM_2) -> 0.0)?;
        Ok(norm == 0.0)
    }

    /// Drops the vectors and factors of the last matrix; options and limits stay.
    fn forget(&self) -> Result<()> {
        let mut inner = null_mut();
        petsc!(SNESReset(self.raw))?;
        petsc!(SNESGetKSP(self.raw, &mut inner))?;
        ksp::forget(inner, &self.comm)
    }
}

owned!(Snes);

impl<P: NewtonProblem> Context<'_, P> {
    /// Makes the ranks agree; an error is kept for `solve` and stops PETSc's loop.
    fn agree_on<T>(
        &mut self,
        result: Result<T>,
        then: impl FnOnce(&mut Self, T) -> Result<()>,
    ) -> sys::PetscErrorCode {
        let result = agree(self.comm, result);
        self.go_on(result, then)
    }

    /// The same with a result that is the same on all ranks.
    fn go_on<T>(
        &mut self,
        result: Result<T>,
        then: impl FnOnce(&mut Self, T) -> Result<()>,
    ) -> sys::PetscErrorCode {
        match result.and_then(|value| then(self, value)) {
            Ok(()) => 0,
            Err(error) => {
                self.error.get_or_insert(error);
                sys::PETSC_ERR_USER as sys::PetscErrorCode
            }
        }
    }

    /// Whether the iterate, reached once more by a step of zero, is converged on all ranks.
    fn judge_again(&mut self, snes: sys::SNES) -> Result<bool> {
        let iteration = self.linear_solves;
        let verdict = judge(self, snes, iteration);
        let verdict = agree(self.comm, verdict)?;
        Ok(self.largest(i32::from(verdict != Verdict::Converged)) == 0)
    }

    /// Largest of the ranks' numbers.
    fn largest(&self, mine: i32) -> i32 {
        let mut all = mine;
        self.comm.all_reduce_into(&mine, &mut all, SystemOperation::max());
        all
    }
}

// A panic cannot pass the C code below these functions: `extern "C"` turns it into an abort.

unsafe extern "C" fn residual<P: NewtonProblem>(
    snes: sys::SNES,
    x: sys::Vec,
    f: sys::Vec,
    data: *mut c_void,
) -> sys::PetscErrorCode {
    // SAFETY: `data` is the context that `solve` keeps alive, and no other reference to it exists
    // during the callback.
    let context = unsafe { &mut *data.cast::<Context<P>>() };
    // SAFETY: PETSc's vectors live through the call and are distinct.
    let result = unsafe { LocalValues::of(x) }.and_then(|x| {
        let mut f = unsafe { LocalValuesMut::of(f) }?;
        context.problem.residual(&x, &mut f, context.matrix)
    });
    context.agree_on(result, |context, inside| {
        context.outside = context.largest(i32::from(!inside)) == 1;
        if context.outside { petsc!(SNESSetFunctionDomainError(snes)) } else { Ok(()) }
    })
}

unsafe extern "C" fn jacobian<P: NewtonProblem>(
    _snes: sys::SNES,
    x: sys::Vec,
    _matrix: sys::Mat,
    _preconditioner: sys::Mat,
    data: *mut c_void,
) -> sys::PetscErrorCode {
    // SAFETY: as in `residual`.
    let context = unsafe { &mut *data.cast::<Context<P>>() };
    // SAFETY: PETSc's vector lives through the call.
    let result =
        unsafe { LocalValues::of(x) }.and_then(|x| context.problem.jacobian(&x, context.matrix));
    context.agree_on(result, |_, ()| Ok(()))
}

unsafe extern "C" fn before_solve<P: NewtonProblem>(
    inner: sys::KSP,
    rhs: sys::Vec,
    _solution: sys::Vec,
    data: *mut c_void,
) -> sys::PetscErrorCode {
    // SAFETY: as in `residual`.
    let context = unsafe { &mut *data.cast::<Context<P>>() };
    // SAFETY: PETSc's vector lives through the call, and this hook may change it.
    let result = unsafe { LocalValuesMut::of(rhs) }
        .and_then(|mut rhs| context.problem.before_solve(&mut rhs));
    context.agree_on(result, |context, ()| {
        let earlier = context.linear_solves;
        context.problem.prepare_solver(context.solver, context.matrix, earlier)?;
        let Some(forcing) = &mut context.forcing else { return Ok(()) };
        let (mut norm, default) = (0.0, DEFAULT as f64);
        petsc!(VecNorm(rhs, sys::NORM_2, &mut norm))?;
        let eta = forcing.next(norm, context.problem.error_over_tolerance());
        petsc!(KSPSetTolerances(inner, eta, default, default, DEFAULT))
    })
}

unsafe extern "C" fn after_solve<P: NewtonProblem>(
    inner: sys::KSP,
    _rhs: sys::Vec,
    _solution: sys::Vec,
    data: *mut c_void,
) -> sys::PetscErrorCode {
    // SAFETY: as in `residual`.
    let context = unsafe { &mut *data.cast::<Context<P>>() };
    let outcome = ksp::outcome(inner, context.comm);
    let code = context.go_on(outcome, |context, (outcome, ranks)| {
        let mut tolerance = 0.0;
        petsc!(KSPGetTolerances(inner, &mut tolerance, null_mut(), null_mut(), null_mut()))?;
        context.linear_tolerances.push(tolerance);
        context.problem.record_solve(outcome.iterations, tolerance);
        context.linear_solves += 1;
        context.linear_total += outcome.iterations;
        context.linear_max = context.linear_max.max(outcome.iterations);
        if !outcome.converged {
            context.linear_failure = Some(format!(
                "the linear solver ended with {} after {} iterations",
                outcome.reason, outcome.iterations
            ));
            context.apart = ranks == Ranks::Apart;
        }
        Ok(())
    });
    // Ranks that take the solve for a good one would go on without the others.
    if context.apart { sys::PETSC_ERR_USER as sys::PetscErrorCode } else { code }
}

unsafe extern "C" fn assess<P: NewtonProblem>(
    snes: sys::SNES,
    iteration: sys::PetscInt,
    _x_norm: sys::PetscReal,
    _step_norm: sys::PetscReal,
    _f_norm: sys::PetscReal,
    reason: *mut sys::SNESConvergedReason,
    data: *mut c_void,
) -> sys::PetscErrorCode {
    // SAFETY: as in `residual`.
    let context = unsafe { &mut *data.cast::<Context<P>>() };
    let iteration = iteration.max(0) as usize;
    let result = judge(context, snes, iteration);
    context.agree_on(result, |context, verdict| {
        let (code, text) = match verdict {
            Verdict::Converged if iteration > 0 => (0, None),
            Verdict::Converged | Verdict::Continue => (1, None),
            Verdict::Diverged(text) => (2, Some(text)),
        };
        let word = match context.largest(code) {
            0 => sys::SNES_CONVERGED_FNORM_ABS,
            1 => sys::SNES_CONVERGED_ITERATING,
            _ => {
                let elsewhere = || "the iteration diverged on another rank".to_owned();
                context.diverged = Some(text.unwrap_or_else(elsewhere));
                sys::SNES_DIVERGED_INNER
            }
        };
        context.met = word == sys::SNES_CONVERGED_FNORM_ABS;
        // SAFETY: PETSc passes the place for the answer.
        unsafe { *reason = word };
        Ok(())
    })
}

fn judge<P: NewtonProblem>(
    context: &mut Context<P>,
    snes: sys::SNES,
    iteration: usize,
) -> Result<Verdict> {
    let mut f = null_mut();
    let x = petsc!(SNESGetSolution(snes) -> null_mut())?;
    petsc!(SNESGetFunction(snes, &mut f, null_mut(), null_mut()))?;
    // SAFETY: the solver's vectors live through the convergence test and nobody writes them.
    let (x, f) = unsafe { (LocalValues::of(x)?, LocalValues::of(f)?) };
    context.problem.assess(iteration, &x, &f)
}
