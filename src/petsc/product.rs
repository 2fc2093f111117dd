//! y = A x, y += A x and y = A^T x for PETSc, by a copy of A in blocks and single precision.

use std::ffi::c_void;
use std::ptr::{null, null_mut};

use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{AsRaw, CommunicatorCollectives};

use super::blocks::block_of;
use super::check::{check, keep, petsc, running};
use super::half::Copied;
use super::sys;
use super::vector::{Values, ValuesMut, index};
use crate::error::Result;

/// One reference to a PETSc shell matrix over a [`Product`].
pub(super) struct Shell(sys::Mat);

impl Shell {
    /// `None` where the matrix is not made of blocks, on any rank. Collective.
    pub(super) fn of(matrix: sys::Mat, comm: &SimpleCommunicator) -> Result<Option<Self>> {
        let Some(product) = Product::of(matrix, comm)? else { return Ok(None) };
        let (mut rows, mut columns) = (0, 0);
        petsc!(MatGetLocalSize(matrix, &mut rows, &mut columns))?;
        let mut shell = Shell(null_mut());
        let data = Box::into_raw(Box::new(product)).cast::<c_void>();
        let all = sys::PETSC_DETERMINE;
        petsc!(MatCreateShell(comm.as_raw(), rows, columns, all, all, data, &mut shell.0))?;
        petsc!(MatShellSetContextDestroy(shell.0, Some(destroy)))?;
        let (once, twice) = (operation(multiply), operation(transposed));
        petsc!(MatShellSetOperation(shell.0, sys::MATOP_MULT, Some(once)))?;
        petsc!(MatShellSetOperation(shell.0, sys::MATOP_MULT_TRANSPOSE, Some(twice)))?;
        // SAFETY: as in `operation`.
        let sum = unsafe { std::mem::transmute::<Sum, unsafe extern "C" fn()>(multiply_add) };
        petsc!(MatShellSetOperation(shell.0, sys::MATOP_MULT_ADD, Some(sum)))?;
        Ok(Some(shell))
    }

    pub(super) fn raw(&self) -> sys::Mat {
        self.0
    }
}

/// The matrix that a shell of ours stands for.
pub(super) fn exact(shell: sys::Mat) -> Result<sys::Mat> {
    with_product(shell, |product| Ok(product.matrix.0))
}

pub(super) fn is_type(object: sys::PetscObject, kind: &[u8]) -> Result<bool> {
    let mut same = sys::PETSC_FALSE;
    petsc!(PetscObjectTypeCompare(object, kind.as_ptr().cast(), &mut same))?;
    Ok(same != sys::PETSC_FALSE)
}

type Apply = unsafe extern "C" fn(sys::Mat, sys::Vec, sys::Vec) -> sys::PetscErrorCode;
type Sum = unsafe extern "C" fn(sys::Mat, sys::Vec, sys::Vec, sys::Vec) -> sys::PetscErrorCode;

fn operation(function: Apply) -> unsafe extern "C" fn() {
    // SAFETY: PETSc keeps functions of any signature as `void (*)(void)` and calls this one, by
    // its place among the operations, as what it is.
    unsafe { std::mem::transmute::<Apply, unsafe extern "C" fn()>(function) }
}

impl Drop for Shell {
    fn drop(&mut self) {
        if !self.0.is_null() && running() {
            // SAFETY: this reference is ours; solvers hold their own.
            unsafe { sys::MatDestroy(&mut self.0) };
        }
    }
}

/// What the shell multiplies by: a matrix in single precision, renewed when its values change.
struct Product {
    matrix: Object<sys::Mat>,
    /// Of the matrix when it was copied.
    state: sys::PetscObjectState,
    own: Part,
    halo: Option<Halo>,
}

/// A sequential matrix in compressed rows, part of the matrix, and its copy.
struct Part {
    source: sys::Mat,
    blocks: Copied,
}

/// What other ranks' unknowns contribute.
struct Halo {
    part: Part,
    scatter: Object<sys::VecScatter>,
    ghosts: Object<sys::Vec>,
}

impl Product {
    fn of(matrix: sys::Mat, comm: &SimpleCommunicator) -> Result<Option<Self>> {
        let (mut own, mut other, mut map) = (matrix, null_mut(), null());
        if is_type(matrix.cast(), sys::MATMPIAIJ)? {
            petsc!(MatMPIAIJGetSeqAIJ(matrix, &mut own, &mut other, &mut map))?;
        }
        let (mut tall, mut wide) = (0, 0);
        petsc!(MatGetBlockSizes(matrix, &mut tall, &mut wide))?;
        // Blocks of 6 are four of 3.
        let size = [tall, wide].map(|size| if size % 3 == 0 { 3 } else { size.max(0) as usize });
        let own = Part::of(own, size, is_symmetric(matrix)?)?;
        let halo = if other.is_null() { None } else { Some(ghost_blocks(other, map, size)?) };
        let mine = own.is_some() && !matches!(halo, Some(None));
        let mut everywhere = false;
        comm.all_reduce_into(&mine, &mut everywhere, SystemOperation::logical_and());
        let (true, Some(own)) = (everywhere, own) else { return Ok(None) };
        let halo = halo.flatten().map(|(part, blocks)| Halo::of(matrix, part, size[1], &blocks));
        petsc!(PetscObjectReference(matrix.cast()))?;
        let matrix = Object(matrix);
        let mut product = Product { matrix, state: -1, own, halo: halo.transpose()? };
        product.renew()?;
        Ok(Some(product))
    }

    /// Copies the values if they have changed.
    fn renew(&mut self) -> Result<()> {
        let mut state = 0;
        petsc!(PetscObjectStateGet(self.matrix.0.cast(), &mut state))?;
        if state != self.state {
            self.own.renew()?;
            if let Some(halo) = &mut self.halo {
                halo.part.renew()?;
            }
            self.state = state;
        }
        Ok(())
    }

    /// y = A x, or y += A x; the ghosts' values travel while the own part is multiplied.
    fn multiply(&mut self, x: sys::Vec, y: sys::Vec, add: bool) -> Result<()> {
        self.renew()?;
        let (insert, forward) = (sys::INSERT_VALUES, sys::SCATTER_FORWARD);
        if let Some(halo) = &self.halo {
            petsc!(VecScatterBegin(halo.scatter.0, x, halo.ghosts.0, insert, forward))?;
        }
        {
            // SAFETY: PETSc's vectors live through the call and are distinct, as `MatMult` asks.
            let (x, mut y) = unsafe { (Values::of(x)?, ValuesMut::of(y)?) };
            if add {
                self.own.blocks.multiply_add(&x, &mut y);
            } else {
                self.own.blocks.multiply(&x, &mut y);
            }
        }
        if let Some(halo) = &self.halo {
            petsc!(VecScatterEnd(halo.scatter.0, x, halo.ghosts.0, insert, forward))?;
            // SAFETY: as above; the ghosts are this object's.
            let (ghosts, mut y) = unsafe { (Values::of(halo.ghosts.0)?, ValuesMut::of(y)?) };
            halo.part.blocks.multiply_add(&ghosts, &mut y);
        }
        Ok(())
    }
}

impl Product {
    /// y = A^T x.
    fn multiply_transposed(&mut self, x: sys::Vec, y: sys::Vec) -> Result<()> {
        self.renew()?;
        {
            // SAFETY: as in `multiply`.
            let (x, mut y) = unsafe { (Values::of(x)?, ValuesMut::of(y)?) };
            self.own.blocks.multiply_transposed(&x, &mut y);
        }
        if let Some(halo) = &self.halo {
            {
                // SAFETY: as in `multiply`.
                let (x, mut ghosts) = unsafe { (Values::of(x)?, ValuesMut::of(halo.ghosts.0)?) };
                halo.part.blocks.multiply_transposed(&x, &mut ghosts);
            }
            let (add, back) = (sys::ADD_VALUES, sys::SCATTER_REVERSE);
            petsc!(VecScatterBegin(halo.scatter.0, halo.ghosts.0, y, add, back))?;
            petsc!(VecScatterEnd(halo.scatter.0, halo.ghosts.0, y, add, back))?;
        }
        Ok(())
    }
}

impl Part {
    fn of(source: sys::Mat, size: [usize; 2], symmetric: bool) -> Result<Option<Self>> {
        let rows = Rows::of(source)?;
        let (offsets, columns) = rows.pattern();
        let blocks = Copied::of_pattern(size, offsets, columns, symmetric);
        Ok(blocks.map(|blocks| Part { source, blocks }))
    }

    fn renew(&mut self) -> Result<()> {
        let rows = Rows::of(self.source)?;
        let (offsets, columns) = rows.pattern();
        let mut values = null();
        petsc!(MatSeqAIJGetArrayRead(self.source, &mut values))?;
        if !columns.is_empty() {
            // SAFETY: as many values as columns, read only until the restore below.
            let values = unsafe { std::slice::from_raw_parts(values, columns.len()) };
            self.blocks.fill(offsets, values);
        }
        petsc!(MatSeqAIJRestoreArrayRead(self.source, &mut values))
    }
}

/// Whether A = A^T has been told to PETSc, of a coarse level by PETSc.
fn is_symmetric(matrix: sys::Mat) -> Result<bool> {
    let (mut known, mut symmetric) = (sys::PETSC_FALSE, sys::PETSC_FALSE);
    petsc!(MatIsSymmetricKnown(matrix, &mut known, &mut symmetric))?;
    Ok(known != sys::PETSC_FALSE && symmetric != sys::PETSC_FALSE)
}

/// The part of other ranks' unknowns and which global blocks those are; `None` where they do not
/// come in whole blocks.
fn ghost_blocks(
    other: sys::Mat,
    map: *const sys::PetscInt,
    size: [usize; 2],
) -> Result<Option<(Part, Vec<sys::PetscInt>)>> {
    let (mut rows, mut count) = (0, 0);
    petsc!(MatGetLocalSize(other, &mut rows, &mut count))?;
    let map = if count == 0 {
        &[][..]
    } else {
        // SAFETY: PETSc's list of the global column of each of the `count` columns.
        unsafe { std::slice::from_raw_parts(map, count as usize) }
    };
    let wide = size[1].max(1);
    let blocks: Option<Vec<_>> =
        map.chunks(wide).map(|run| block_of(run, wide).map(|k| k as sys::PetscInt)).collect();
    let Some(blocks) = blocks else { return Ok(None) };
    Ok(Part::of(other, size, false)?.map(|part| (part, blocks)))
}

impl Halo {
    fn of(matrix: sys::Mat, part: Part, size: usize, blocks: &[sys::PetscInt]) -> Result<Self> {
        let (mut wanted, mut own) = (Object(null_mut()), Object(null_mut()));
        let (mut ghosts, mut scatter) = (Object(null_mut()), Object(null_mut()));
        // SAFETY: a constant of a running MPI.
        let alone = unsafe { mpi::ffi::RSMPI_COMM_SELF };
        let (size, count) = (index(size)?, index(blocks.len())?);
        let copy = sys::PETSC_COPY_VALUES;
        petsc!(ISCreateBlock(alone, size, count, blocks.as_ptr(), copy, &mut wanted.0))?;
        petsc!(MatCreateVecs(matrix, &mut own.0, null_mut()))?;
        petsc!(MatCreateVecs(part.source, &mut ghosts.0, null_mut()))?;
        petsc!(VecScatterCreate(own.0, wanted.0, ghosts.0, null_mut(), &mut scatter.0))?;
        let _: (Object<sys::IS>, Object<sys::Vec>) = (wanted, own);
        Ok(Halo { part, scatter, ghosts })
    }
}

/// The pattern of a sequential matrix in compressed rows, borrowed.
struct Rows {
    source: sys::Mat,
    count: sys::PetscInt,
    offsets: *const sys::PetscInt,
    columns: *const sys::PetscInt,
}

impl Rows {
    fn of(source: sys::Mat) -> Result<Self> {
        let mut rows = Rows { source, count: 0, offsets: null(), columns: null() };
        rows.pass(sys::MatGetRowIJ).map(|()| rows)
    }

    /// The functions that lend and take back have the same arguments.
    fn pass(&mut self, function: GetRows) -> Result<()> {
        let (no, mut done) = (sys::PETSC_FALSE, sys::PETSC_FALSE);
        let (count, offsets, columns) = (&mut self.count, &mut self.offsets, &mut self.columns);
        // SAFETY: a live matrix, and places for the answers.
        let code = unsafe { function(self.source, 0, no, no, count, offsets, columns, &mut done) };
        check(code, "MatGetRowIJ")
    }

    /// Offsets of the rows, and columns.
    fn pattern(&self) -> (&[sys::PetscInt], &[sys::PetscInt]) {
        if self.offsets.is_null() {
            return (&[], &[]);
        }
        // SAFETY: PETSc lends `count + 1` offsets, and as many columns as the last of them says.
        unsafe {
            let offsets = std::slice::from_raw_parts(self.offsets, self.count as usize + 1);
            let entries = offsets[self.count as usize] as usize;
            if entries == 0 || self.columns.is_null() {
                return (offsets, &[]);
            }
            (offsets, std::slice::from_raw_parts(self.columns, entries))
        }
    }
}

type GetRows = unsafe extern "C" fn(
    sys::Mat,
    sys::PetscInt,
    sys::PetscBool,
    sys::PetscBool,
    *mut sys::PetscInt,
    *mut *const sys::PetscInt,
    *mut *const sys::PetscInt,
    *mut sys::PetscBool,
) -> sys::PetscErrorCode;

impl Drop for Rows {
    fn drop(&mut self) {
        // An error here would be the matrix's end, which its users will meet.
        let _ = self.pass(sys::MatRestoreRowIJ);
    }
}

/// One reference to a PETSc object.
struct Object<T: Handle>(T);

trait Handle: Copy {
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

// A panic cannot pass the C code below these functions: `extern "C"` turns it into an abort.

unsafe extern "C" fn multiply(shell: sys::Mat, x: sys::Vec, y: sys::Vec) -> sys::PetscErrorCode {
    code(with_product(shell, |product| product.multiply(x, y, false)))
}

/// z = y + A x, where z may be y.
unsafe extern "C" fn multiply_add(
    shell: sys::Mat,
    x: sys::Vec,
    y: sys::Vec,
    z: sys::Vec,
) -> sys::PetscErrorCode {
    code(with_product(shell, |product| {
        if y != z {
            petsc!(VecCopy(y, z))?;
        }
        product.multiply(x, z, true)
    }))
}

unsafe extern "C" fn transposed(shell: sys::Mat, x: sys::Vec, y: sys::Vec) -> sys::PetscErrorCode {
    code(with_product(shell, |product| product.multiply_transposed(x, y)))
}

/// Acts on the context of a shell of ours.
fn with_product<T>(shell: sys::Mat, act: impl FnOnce(&mut Product) -> Result<T>) -> Result<T> {
    let mut data: *mut c_void = null_mut();
    petsc!(MatShellGetContext(shell, (&raw mut data).cast()))?;
    // SAFETY: the box that `Shell::of` gave up lives as long as the shell, and PETSc multiplies by
    // one matrix at a time.
    act(unsafe { &mut *data.cast::<Product>() })
}

fn code(outcome: Result<()>) -> sys::PetscErrorCode {
    outcome.map_or_else(|error| keep(&error), |()| 0)
}

unsafe extern "C" fn destroy(data: *mut c_void) -> sys::PetscErrorCode {
    // SAFETY: the box that `Shell::of` gave up, and PETSc calls this once.
    drop(unsafe { Box::from_raw(data.cast::<Product>()) });
    0
}
