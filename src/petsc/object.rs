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
handles!(sys::Mat, sys::Vec, sys::IS, sys::VecScatter);

impl<T: Handle> Drop for Object<T> {
    fn drop(&mut self) {
        let mut object = self.0.object();
        if !object.is_null() && running() {
            // SAFETY: this reference is ours.
            unsafe { sys::PetscObjectDestroy(&mut object) };
        }
    }
}
