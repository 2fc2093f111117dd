//! A preconditioner of the program's under a smoother of multigrid: PETSc owns it and calls it.

use std::ffi::c_void;
use std::ptr::null_mut;

use super::check::{code_of, petsc};
use super::multigrid::is_type;
use super::sys;
use super::vector::{LocalValues, LocalValuesMut};
use crate::error::Result;

/// z = B^-1 r. Slices are this rank's values.
pub trait Smoother {
    /// Collective.
    fn apply(&mut self, r: &[f64], z: &mut [f64]) -> Result<()>;

    /// Of a few words, for `-ksp_view`.
    fn name(&self) -> &'static std::ffi::CStr;
}

/// Puts a smoother into a preconditioner of any type, which owns it from here on.
pub(super) fn put<S: Smoother>(pc: sys::PC, smoother: S) -> Result<()> {
    let name = smoother.name();
    petsc!(PCSetType(pc, sys::PCSHELL.as_ptr().cast()))?;
    let data = Box::into_raw(Box::new(smoother));
    petsc!(PCShellSetContext(pc, data.cast::<c_void>()))?;
    petsc!(PCShellSetDestroy(pc, Some(destroy::<S>)))?;
    petsc!(PCShellSetApply(pc, Some(apply::<S>)))?;
    petsc!(PCShellSetName(pc, name.as_ptr()))
}

/// Acts on the smoother that a preconditioner owns; `None` where the user has put another in its place.
///
/// # Safety
/// A shell in `pc` was made by [`put`] with this type.
pub(super) unsafe fn with<S: Smoother>(
    pc: sys::PC,
    act: impl FnOnce(&mut S) -> Result<()>,
) -> Result<Option<()>> {
    if !is_type(pc, sys::PCSHELL)? {
        return Ok(None);
    }
    let mut data: *mut c_void = null_mut();
    petsc!(PCShellGetContext(pc, (&raw mut data).cast()))?;
    // SAFETY: the box that `put` gave up lives as long as the preconditioner, and nobody else acts on it
    // while this runs.
    act(unsafe { &mut *data.cast::<S>() }).map(Some)
}

// A panic cannot pass the C code below these functions: `extern "C"` turns it into an abort.

unsafe extern "C" fn apply<S: Smoother>(
    pc: sys::PC,
    r: sys::Vec,
    z: sys::Vec,
) -> sys::PetscErrorCode {
    // SAFETY: `put` set this function together with the context.
    let outcome = unsafe {
        with::<S>(pc, |smoother| {
            // SAFETY: PETSc's vectors live through the call and are distinct.
            let (r, mut z) = (LocalValues::of(r)?, LocalValuesMut::of(z)?);
            smoother.apply(&r, &mut z)
        })
    };
    code_of(outcome.map(drop))
}

unsafe extern "C" fn destroy<S>(pc: sys::PC) -> sys::PetscErrorCode {
    let mut data: *mut c_void = null_mut();
    let found = petsc!(PCShellGetContext(pc, (&raw mut data).cast()));
    if found.is_ok() && !data.is_null() {
        // SAFETY: the box that `put` gave up, and PETSc calls this once.
        drop(unsafe { Box::from_raw(data.cast::<S>()) });
    }
    code_of(found)
}
