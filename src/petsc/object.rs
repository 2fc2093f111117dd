//! Handles of PETSc objects that are given back when they go out of scope.

use super::check::running;
use super::sys;

/// One reference to a PETSc object; null is none.
pub(crate) struct Object<T: Handle>(pub(crate) T);

pub(crate) trait Handle: Copy {
    fn object(self) -> sys::PetscObject;
}

macro_rules! handles {
    ($($name:ty),*) => {
        $(impl Handle for $name {
            fn object(self) -> sys::PetscObject {
                self.cast()
            }
        })*
    };
}
handles!(sys::Mat, sys::Vec, sys::IS, sys::VecScatter, sys::KSP, sys::SNES);

impl<T: Handle> Drop for Object<T> {
    fn drop(&mut self) {
        give_back(self.0.object());
    }
}

/// The reference that an owner has in its field `raw` goes with it.
macro_rules! owned {
    ($owner:ty) => {
        impl Drop for $owner {
            fn drop(&mut self) {
                $crate::petsc::object::give_back(self.raw.cast());
            }
        }
    };
}
pub(crate) use owned;

/// Gives back one reference, which nobody uses from here on; null is none.
pub(crate) fn give_back(mut object: sys::PetscObject) {
    if !object.is_null() && running() {
        // SAFETY: the reference was the caller's.
        unsafe { sys::PetscObjectDestroy(&mut object) };
    }
}
