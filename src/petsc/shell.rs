//! A x = b where A is a product and its preconditioner is ours: KSP over a shell matrix and a shell
//! preconditioner, so that methods, monitors, views and logs are PETSc's.

use std::ffi::{CStr, c_void};
use std::ptr::{null, null_mut};

use mpi::topology::SimpleCommunicator;
use mpi::traits::AsRaw;

use super::abort::unless_shared;
use super::check::{code_of, petsc, text_of};
use super::ksp::{self, Ksp, KspOutcome};
use super::object::Object;
use super::vector::DETERMINE;
use super::vector::{LocalValues, LocalValuesMut, Vector, index};
use super::{Matrix, sys};
use crate::error::Result;

/// A symmetric positive definite system A x = b. Slices hold this rank's values. All functions but the name are
/// collective.
pub trait ShellSystem {
    /// y = A x.
    fn multiply(&mut self, x: &[f64], y: &mut [f64]) -> Result<()>;

    /// z = P^-1 r with P near A. Only called while the type of the preconditioner is `shell`.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<()>;

    /// What views call the preconditioner.
    fn preconditioner(&self) -> &'static CStr;

    /// The entries of A, for preconditioners of PETSc's that need them.
    fn entries(&self) -> Result<Matrix>;
}

/// A solver that serves systems of changing size.
pub struct ShellKsp {
    ksp: Ksp,
    /// The user has not put another preconditioner in the place of ours.
    ours: bool,
    space: Option<Space>,
}

/// What belongs to a system of one size.
struct Space {
    product: Object<sys::Mat>,
    b: Vector,
    x: Vector,
    /// Of the user's preconditioner.
    entries: Option<Matrix>,
}

impl ShellKsp {
    /// `ksp` has read its options; those that leave `pc_type` at `shell` get our preconditioner.
    pub fn new(ksp: Ksp) -> Result<Self> {
        let pc = petsc!(KSPGetPC(ksp.raw()) -> null_mut())?;
        let kind = petsc!(PCGetType(pc) -> null())?;
        Ok(ShellKsp { ksp, ours: text_of(kind) == "shell", space: None })
    }

    /// Whether [`ShellSystem::precondition`] will be called.
    pub fn preconditions_by_ours(&self) -> bool {
        self.ours
    }

    /// Drops what belongs to the last system: the next has another matrix. Collective.
    pub fn forget(&mut self, comm: &SimpleCommunicator) -> Result<()> {
        if self.space.take().is_none() {
            return Ok(());
        }
        if self.ours { petsc!(KSPReset(self.ksp.raw())) } else { ksp::forget(self.ksp.raw(), comm) }
    }

    /// Solves A x = `b` from x = 0, left in `x`. Not converging is an outcome. Collective.
    ///
    /// # Errors
    /// What the system's functions return, or PETSc.
    pub fn solve<S: ShellSystem>(
        &mut self,
        comm: &SimpleCommunicator,
        system: &mut S,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<KspOutcome> {
        let raw = self.ksp.raw();
        if self.space.is_none() {
            let entries = if self.ours { None } else { Some(system.entries()?) };
            let space = Space::new(comm, b.len(), entries)?;
            let matrix = space.entries.as_ref().map_or(space.product.0, Matrix::raw);
            petsc!(KSPSetOperators(raw, space.product.0, matrix))?;
            self.space = Some(space);
        }
        let Some(space) = &mut self.space else { return self.ksp.outcome() };
        // The callbacks get this pointer back while `KSPSolve` runs and at no other time.
        let data: *mut c_void = (&raw mut *system).cast();
        petsc!(MatShellSetContext(space.product.0, data))?;
        // SAFETY: PETSc keeps functions of any signature under one type and calls each, by its place
        // among the operations, as what it is.
        let product = unsafe { std::mem::transmute::<Apply, sys::AnyFunction>(multiply::<S>) };
        petsc!(MatShellSetOperation(space.product.0, sys::MATOP_MULT, Some(product)))?;
        if self.ours {
            let pc = petsc!(KSPGetPC(raw) -> null_mut())?;
            petsc!(PCShellSetContext(pc, data))?;
            petsc!(PCShellSetApply(pc, Some(precondition::<S>)))?;
            petsc!(PCShellSetName(pc, system.preconditioner().as_ptr()))?;
        }
        space.b.values_mut()?.copy_from_slice(b);
        petsc!(KSPSolve(raw, space.b.raw(), space.x.raw()))
            .map_err(|error| unless_shared(comm, error))?;
        x.copy_from_slice(&space.x.values()?);
        self.ksp.outcome()
    }
}

impl Space {
    fn new(comm: &SimpleCommunicator, rows: usize, entries: Option<Matrix>) -> Result<Self> {
        let (b, x) = (Vector::new(comm, rows, 1)?, Vector::new(comm, rows, 1)?);
        let mut product = Object(null_mut());
        let (count, all) = (index(rows)?, DETERMINE);
        let nothing = null_mut();
        petsc!(MatCreateShell(comm.as_raw(), count, count, all, all, nothing, &mut product.0))?;
        petsc!(MatSetUp(product.0))?;
        petsc!(MatSetOption(product.0, sys::MAT_SPD, sys::PETSC_TRUE))?;
        Ok(Space { product, b, x, entries })
    }
}

type Apply = unsafe extern "C" fn(sys::Mat, sys::Vec, sys::Vec) -> sys::PetscErrorCode;

// A panic cannot pass the C code below these functions: `extern "C"` turns it into an abort.

unsafe extern "C" fn multiply<S: ShellSystem>(
    shell: sys::Mat,
    x: sys::Vec,
    y: sys::Vec,
) -> sys::PetscErrorCode {
    let mut data: *mut c_void = null_mut();
    code_of(petsc!(MatShellGetContext(shell, (&raw mut data).cast())).and_then(|()| {
        // SAFETY: the system that `solve` borrows, of the type it set this function for; PETSc's
        // vectors live through the call and are distinct, as `MatMult` asks.
        let (system, x, mut y) =
            unsafe { (&mut *data.cast::<S>(), LocalValues::of(x)?, LocalValuesMut::of(y)?) };
        system.multiply(&x, &mut y)
    }))
}

unsafe extern "C" fn precondition<S: ShellSystem>(
    pc: sys::PC,
    r: sys::Vec,
    z: sys::Vec,
) -> sys::PetscErrorCode {
    let mut data: *mut c_void = null_mut();
    code_of(petsc!(PCShellGetContext(pc, (&raw mut data).cast())).and_then(|()| {
        // SAFETY: as in `multiply`.
        let (system, r, mut z) =
            unsafe { (&mut *data.cast::<S>(), LocalValues::of(r)?, LocalValuesMut::of(z)?) };
        system.precondition(&r, &mut z)
    }))
}
