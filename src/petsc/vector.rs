//! Distributed vector: contiguous rows per rank, local values borrowed as slices.

use std::ops::{Deref, DerefMut};
use std::ptr::null_mut;

use mpi::topology::SimpleCommunicator;
use mpi::traits::AsRaw;

use super::check::{petsc, require_running};
use super::object::owned;
use super::sys;
use crate::error::{Error, Result};

/// Owner of a PETSc `Vec`.
#[derive(Debug)]
pub struct Vector {
    raw: sys::Vec,
    local: usize,
}

impl Vector {
    /// Zero vector with `local_len` values on this rank (may be 0), a multiple of `block_size`.
    pub fn new(comm: &SimpleCommunicator, local_len: usize, block_size: usize) -> Result<Self> {
        require_running()?;
        let (n, block) = (index(local_len)?, index(block_size)?);
        let mut vector = Vector { raw: null_mut(), local: local_len };
        petsc!(VecCreate(comm.as_raw(), &mut vector.raw))?;
        petsc!(VecSetBlockSize(vector.raw, block))?;
        petsc!(VecSetSizes(vector.raw, n, DETERMINE))?;
        petsc!(VecSetType(vector.raw, sys::VECSTANDARD.as_ptr().cast()))?;
        petsc!(VecSet(vector.raw, 0.0))?;
        Ok(vector)
    }

    /// Takes over a new PETSc vector with `local` values and zeroes it.
    pub(crate) fn own(raw: sys::Vec, local: usize) -> Result<Self> {
        let mut vector = Vector { raw, local };
        vector.set(0.0)?;
        Ok(vector)
    }

    /// Zero vector of the same layout.
    pub fn duplicate(&self) -> Result<Self> {
        let mut raw = null_mut();
        petsc!(VecDuplicate(self.raw, &mut raw))?;
        Self::own(raw, self.local)
    }

    pub(crate) fn raw(&self) -> sys::Vec {
        self.raw
    }

    /// Values on this rank.
    pub fn local_len(&self) -> usize {
        self.local
    }

    /// Global row of this rank's first value.
    pub fn first_row(&self) -> Result<usize> {
        let (mut low, mut high) = (0, 0);
        petsc!(VecGetOwnershipRange(self.raw, &mut low, &mut high))?;
        Ok(low as usize)
    }

    /// This rank's values, to read. Local.
    pub fn values(&self) -> Result<LocalValues<'_>> {
        LocalValues::borrow(self)
    }

    /// This rank's values, to read and write. Local.
    pub fn values_mut(&mut self) -> Result<LocalValuesMut<'_>> {
        LocalValuesMut::borrow(self)
    }

    /// Sets all values.
    pub fn set(&mut self, value: f64) -> Result<()> {
        petsc!(VecSet(self.raw, value))
    }

    /// self = other.
    pub fn copy_from(&mut self, other: &Vector) -> Result<()> {
        petsc!(VecCopy(other.raw, self.raw))
    }

    /// self += a x.
    pub fn axpy(&mut self, a: f64, x: &Vector) -> Result<()> {
        petsc!(VecAXPY(self.raw, a, x.raw))
    }

    /// Euclidean norm.
    pub fn norm(&self) -> Result<f64> {
        petsc!(VecNorm(self.raw, sys::NORM_2) -> 0.0)
    }

    /// Largest magnitude.
    pub fn norm_max(&self) -> Result<f64> {
        petsc!(VecNorm(self.raw, sys::NORM_INFINITY) -> 0.0)
    }

    /// Scalar product. Collective.
    pub fn dot(&self, other: &Vector) -> Result<f64> {
        petsc!(VecDot(self.raw, other.raw) -> 0.0)
    }
}

owned!(Vector);

/// Local values of a vector, read only.
pub struct LocalValues<'v> {
    raw: sys::Vec,
    pointer: *const f64,
    slice: &'v [f64],
}

impl<'v> LocalValues<'v> {
    fn borrow(vector: &'v Vector) -> Result<Self> {
        // SAFETY: the guard cannot outlive the borrow of the vector.
        unsafe { Self::of(vector.raw) }
    }

    /// # Safety
    /// `raw` stays alive, and nobody writes its values, while the guard lives.
    pub(crate) unsafe fn of(raw: sys::Vec) -> Result<Self> {
        let count = petsc!(VecGetLocalSize(raw) -> 0)?;
        let pointer = petsc!(VecGetArrayRead(raw) -> std::ptr::null())?;
        let slice = if pointer.is_null() {
            &[][..]
        } else {
            // SAFETY: PETSc returned `count` values that stay in place until the restore.
            unsafe { std::slice::from_raw_parts(pointer, count as usize) }
        };
        Ok(LocalValues { raw, pointer, slice })
    }
}

impl Deref for LocalValues<'_> {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        self.slice
    }
}

impl Drop for LocalValues<'_> {
    fn drop(&mut self) {
        // SAFETY: returns what `of` took.
        unsafe { sys::VecRestoreArrayRead(self.raw, &mut self.pointer) };
    }
}

/// Local values of a vector, to read and write.
pub struct LocalValuesMut<'v> {
    raw: sys::Vec,
    pointer: *mut f64,
    slice: &'v mut [f64],
}

impl<'v> LocalValuesMut<'v> {
    fn borrow(vector: &'v mut Vector) -> Result<Self> {
        // SAFETY: the guard cannot outlive the exclusive borrow of the vector.
        unsafe { Self::of(vector.raw) }
    }

    /// # Safety
    /// `raw` stays alive, and nobody else touches its values, while the guard lives.
    pub(crate) unsafe fn of(raw: sys::Vec) -> Result<Self> {
        let count = petsc!(VecGetLocalSize(raw) -> 0)?;
        let pointer = petsc!(VecGetArray(raw) -> null_mut())?;
        let slice = if pointer.is_null() {
            &mut [][..]
        } else {
            // SAFETY: PETSc returned `count` values, ours alone until the restore.
            unsafe { std::slice::from_raw_parts_mut(pointer, count as usize) }
        };
        Ok(LocalValuesMut { raw, pointer, slice })
    }
}

impl Deref for LocalValuesMut<'_> {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        self.slice
    }
}

impl DerefMut for LocalValuesMut<'_> {
    fn deref_mut(&mut self) -> &mut [f64] {
        self.slice
    }
}

impl Drop for LocalValuesMut<'_> {
    fn drop(&mut self) {
        // SAFETY: returns what `of` took; this also makes PETSc note that the values changed.
        unsafe { sys::VecRestoreArray(self.raw, &mut self.pointer) };
    }
}

/// PETSc's integer: numbers of rows and columns over all ranks. 32 bits wide, or 64.
pub type Index = sys::PetscInt;

/// "PETSc decides", in sizes and in limits; bindgen knows them as 32-bit numbers.
#[allow(clippy::unnecessary_cast, reason = "where the index has 64 bits it is one")]
pub(crate) const DETERMINE: Index = sys::PETSC_DETERMINE as Index;
#[allow(clippy::unnecessary_cast, reason = "as above")]
pub(crate) const DEFAULT: Index = sys::PETSC_DEFAULT as Index;

/// A size or number as PETSc's integer.
pub(crate) fn index(value: usize) -> Result<sys::PetscInt> {
    sys::PetscInt::try_from(value).map_err(|_| {
        Error::Environment(format!(
            "{value} does not fit the integers of this PETSc (limit {}); use more ranks, or a PETSc \
             built with 64-bit indices",
            sys::PetscInt::MAX
        ))
    })
}
