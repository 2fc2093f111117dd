//! y = A x and y = A^T x by the rows of one rank in blocks, with the columns of other ranks apart:
//! values to keep, and the PETSc matrix that multiplies with them.

use std::ffi::c_void;
use std::marker::PhantomData;
use std::ptr::null_mut;

use mpi::topology::SimpleCommunicator;
use mpi::traits::AsRaw;

use super::check::{keep, petsc};
use super::object::Object;
use super::sys;
use super::vector::DETERMINE;
use super::vector::{Index, LocalValues, LocalValuesMut, index};
use crate::blocks::{Blocks, Half, Stored};
use crate::error::{Error, Result};
use crate::tensor::fused::Block;

/// The rows of one rank, their values kept as `T`.
#[derive(Debug, Clone)]
pub struct BlockProduct<T> {
    own: Own<T>,
    other: Blocks<T>,
    /// Global block column of each column of `other`.
    ghosts: Vec<Index>,
    /// Scalar rows, and columns of this rank.
    size: [usize; 2],
    /// Columns in a block.
    wide: usize,
}

/// What multiplies this rank's unknowns.
#[derive(Debug, Clone)]
enum Own<T> {
    Whole(Blocks<T>),
    Symmetric(Half<T>),
}

/// Blocks of one row, each with its column: below the number of own ones one of this rank, from
/// there on one of the ghosts.
pub type Row<const R: usize, const C: usize> = Vec<(usize, Block<R, C>)>;

impl<T: Stored> BlockProduct<T> {
    /// `rows` block rows of `R` x `C` blocks; `row` appends those of one to the list it is given.
    /// `blocks`: how many there are in all.
    ///
    /// # Panics
    /// If blocks of this size have no kernel: 2x2, 2x3 and multiples of 3 have.
    pub fn collect<const R: usize, const C: usize>(
        rows: usize,
        own_columns: usize,
        ghosts: Vec<Index>,
        blocks: usize,
        row: impl FnMut(usize, &mut Row<R, C>),
    ) -> Self {
        let new = |blocks| Blocks::growing([R, C], blocks).expect("blocks with a kernel");
        let (mut own, mut other) = (new(blocks), new(0));
        each_row(rows, own_columns, row, |inside, outside| {
            own.push(inside);
            other.push(outside);
        });
        BlockProduct {
            own: Own::Whole(own.finish()),
            other: other.finish(),
            ghosts,
            size: [rows * R, own_columns * C],
            wide: C,
        }
    }

    /// A symmetric matrix of `rows` block rows with `K` unknowns each: room for the `blocks` of
    /// [`Self::fill`].
    ///
    /// # Panics
    /// As [`Self::collect`].
    pub fn symmetric<const K: usize>(rows: usize, ghosts: Vec<Index>, blocks: usize) -> Self {
        let own = Half::growing(K, (blocks + rows) / 2).expect("blocks with a kernel");
        let other = Blocks::growing([K, K], 0).expect("blocks with a kernel").finish();
        let size = [rows * K; 2];
        BlockProduct { own: Own::Symmetric(own), other, ghosts, size, wide: K }
    }

    /// The same for a square matrix that need not be symmetric: all of its blocks are kept.
    ///
    /// # Panics
    /// As [`Self::collect`].
    pub fn unsymmetric<const K: usize>(rows: usize, ghosts: Vec<Index>, blocks: usize) -> Self {
        let new = |blocks| Blocks::growing([K, K], blocks).expect("blocks with a kernel").finish();
        let size = [rows * K; 2];
        BlockProduct { own: Own::Whole(new(blocks)), other: new(0), ghosts, size, wide: K }
    }

    /// The values of a square matrix, as in [`Self::collect`]; again when they have changed.
    pub fn fill<const K: usize>(&mut self, row: impl FnMut(usize, &mut Row<K, K>)) {
        let rows = self.size[0] / K;
        let empty = || Blocks::growing([K, K], 0).expect("blocks with a kernel").finish();
        let mut other = std::mem::replace(&mut self.other, empty()).regrow();
        match &mut self.own {
            Own::Symmetric(half) => {
                half.clear();
                each_row(rows, rows, row, |inside, outside| {
                    half.push(inside);
                    other.push(outside);
                });
            }
            Own::Whole(blocks) => {
                let mut own = std::mem::replace(blocks, empty()).regrow();
                each_row(rows, rows, row, |inside, outside| {
                    own.push(inside);
                    other.push(outside);
                });
                *blocks = own.finish();
            }
        }
        self.other = other.finish();
    }

    /// Diagonal entries of a square matrix.
    pub fn diagonal(&self) -> Vec<f64> {
        match &self.own {
            Own::Whole(blocks) => blocks.diagonal(self.size[0]),
            Own::Symmetric(half) => half.diagonal(),
        }
    }

    /// Scalar rows.
    pub fn rows(&self) -> usize {
        self.size[0]
    }

    /// y = A x with the ghosts' values behind the own ones in `x`.
    pub fn multiply_local(&self, x: &[f64], y: &mut [f64]) {
        let (own, ghosts) = x.split_at(self.size[1]);
        self.multiply_own(own, y);
        if !self.ghosts.is_empty() {
            self.other.multiply_add(ghosts, y);
        }
    }

    fn multiply_own(&self, x: &[f64], y: &mut [f64]) {
        match &self.own {
            Own::Whole(blocks) => blocks.multiply(x, y),
            Own::Symmetric(half) => half.multiply(x, y),
        }
    }

    fn multiply_own_add(&self, x: &[f64], y: &mut [f64]) {
        match &self.own {
            Own::Whole(blocks) => blocks.multiply_add(x, y),
            Own::Symmetric(half) => half.multiply_add(x, y),
        }
    }

    fn multiply_own_transposed(&self, x: &[f64], y: &mut [f64]) {
        match &self.own {
            Own::Whole(blocks) => blocks.multiply_transposed(x, y),
            Own::Symmetric(half) => half.multiply(x, y),
        }
    }
}

impl BlockProduct<f64> {
    /// A symmetric matrix in single precision, in the place of what `target` held.
    pub fn round_into(&self, target: &mut BlockProduct<f32>) {
        if let (Own::Symmetric(own), Own::Symmetric(target)) = (&self.own, &mut target.own) {
            own.round_into(target);
        }
        target.other = self.other.rounded();
    }
}

/// Shows each row that `row` gives as its blocks in own columns and those in columns of other ranks.
#[inline(always)]
fn each_row<const R: usize, const C: usize>(
    rows: usize,
    own_columns: usize,
    mut row: impl FnMut(usize, &mut Row<R, C>),
    mut take: impl FnMut(&Row<R, C>, &Row<R, C>),
) {
    let (mut inside, mut outside) = (Vec::new(), Vec::new());
    for k in 0..rows {
        inside.clear();
        outside.clear();
        row(k, &mut inside);
        inside.retain(|&(column, block)| {
            let here = column < own_columns;
            if !here {
                outside.push((column - own_columns, block));
            }
            here
        });
        take(&inside, &outside);
    }
}

/// One reference to a PETSc shell matrix over a [`BlockProduct`].
pub(crate) struct Shell<T>(Object<sys::Mat>, PhantomData<T>);

/// What the shell multiplies by.
struct Context<T> {
    product: BlockProduct<T>,
    ghosts: Option<Ghosts>,
}

/// Values of other ranks.
struct Ghosts {
    scatter: Object<sys::VecScatter>,
    values: Object<sys::Vec>,
}

impl<T: Stored> Shell<T> {
    /// Collective.
    pub(crate) fn new(comm: &SimpleCommunicator, product: BlockProduct<T>) -> Result<Self> {
        let [rows, columns] = [index(product.size[0])?, index(product.size[1])?];
        let mut shell = Object(null_mut());
        let data = Box::new(Context { product, ghosts: None });
        let data = Box::into_raw(data);
        let all = DETERMINE;
        petsc!(MatCreateShell(
            comm.as_raw(),
            rows,
            columns,
            all,
            all,
            data.cast::<c_void>(),
            &mut shell.0
        ))?;
        petsc!(MatShellSetContextDestroy(shell.0, Some(destroy::<T>)))?;
        // SAFETY: PETSc keeps functions of any signature under one type and calls each, by its place
        // among the operations, as what it is.
        let (once, add, twice, diagonal) = unsafe {
            (
                std::mem::transmute::<Apply, sys::AnyFunction>(multiply::<T>),
                std::mem::transmute::<Sum, sys::AnyFunction>(multiply_add::<T>),
                std::mem::transmute::<Apply, sys::AnyFunction>(transposed::<T>),
                std::mem::transmute::<Get, sys::AnyFunction>(get_diagonal::<T>),
            )
        };
        petsc!(MatShellSetOperation(shell.0, sys::MATOP_MULT, Some(once)))?;
        petsc!(MatShellSetOperation(shell.0, sys::MATOP_MULT_ADD, Some(add)))?;
        petsc!(MatShellSetOperation(shell.0, sys::MATOP_MULT_TRANSPOSE, Some(twice)))?;
        petsc!(MatShellSetOperation(shell.0, sys::MATOP_GET_DIAGONAL, Some(diagonal)))?;
        petsc!(MatSetUp(shell.0))?;
        let mut parallel = 1;
        // SAFETY: a live communicator, and a place for the answer.
        unsafe { mpi::ffi::MPI_Comm_size(comm.as_raw(), &mut parallel) };
        if parallel > 1 {
            // SAFETY: the box above; nobody multiplies yet.
            let context = unsafe { &mut *data };
            context.ghosts = Some(Ghosts::new(shell.0, &context.product)?);
        }
        Ok(Shell(shell, PhantomData))
    }

    pub(crate) fn raw(&self) -> sys::Mat {
        self.0.0
    }

    /// Gives the values a new content.
    pub(crate) fn change(
        &mut self,
        act: impl FnOnce(&mut BlockProduct<T>) -> Result<()>,
    ) -> Result<()> {
        let mut data: *mut c_void = null_mut();
        petsc!(MatShellGetContext(self.raw(), (&raw mut data).cast()))?;
        // SAFETY: the box that `new` gave up lives as long as the shell, and PETSc is not
        // multiplying while this runs.
        act(unsafe { &mut (*data.cast::<Context<T>>()).product })?;
        // The way to tell users of the matrix.
        petsc!(MatAssemblyBegin(self.raw(), sys::MAT_FINAL_ASSEMBLY))?;
        petsc!(MatAssemblyEnd(self.raw(), sys::MAT_FINAL_ASSEMBLY))
    }
}

impl Ghosts {
    fn new<T>(shell: sys::Mat, product: &BlockProduct<T>) -> Result<Self> {
        let (mut wanted, mut own) = (Object(null_mut()), Object(null_mut()));
        let (mut values, mut scatter) = (Object(null_mut()), Object(null_mut()));
        // SAFETY: a constant of a running MPI.
        let alone = unsafe { mpi::ffi::RSMPI_COMM_SELF };
        let (wide, count) = (index(product.wide)?, index(product.ghosts.len())?);
        let all = index(product.ghosts.len() * product.wide)?;
        let (list, copy) = (product.ghosts.as_ptr(), sys::PETSC_COPY_VALUES);
        petsc!(ISCreateBlock(alone, wide, count, list, copy, &mut wanted.0))?;
        petsc!(MatCreateVecs(shell, &mut own.0, null_mut()))?;
        petsc!(VecCreateSeq(alone, all, &mut values.0))?;
        petsc!(VecScatterCreate(own.0, wanted.0, values.0, null_mut(), &mut scatter.0))?;
        let _: (Object<sys::IS>, Object<sys::Vec>) = (wanted, own);
        Ok(Ghosts { scatter, values })
    }
}

impl<T: Stored> Context<T> {
    /// y = A x, or y += A x; the ghosts' values travel while the own part is multiplied.
    fn multiply(&self, x: sys::Vec, y: sys::Vec, add: bool) -> Result<()> {
        let (insert, forward) = (sys::INSERT_VALUES, sys::SCATTER_FORWARD);
        if let Some(ghosts) = &self.ghosts {
            petsc!(VecScatterBegin(ghosts.scatter.0, x, ghosts.values.0, insert, forward))?;
        }
        {
            // SAFETY: PETSc's vectors live through the call and are distinct, as `MatMult` asks.
            let (x, mut y) = unsafe { (LocalValues::of(x)?, LocalValuesMut::of(y)?) };
            if add {
                self.product.multiply_own_add(&x, &mut y);
            } else {
                self.product.multiply_own(&x, &mut y);
            }
        }
        if let Some(ghosts) = &self.ghosts {
            petsc!(VecScatterEnd(ghosts.scatter.0, x, ghosts.values.0, insert, forward))?;
            // SAFETY: as above; the ghosts are this object's.
            let (values, mut y) =
                unsafe { (LocalValues::of(ghosts.values.0)?, LocalValuesMut::of(y)?) };
            self.product.other.multiply_add(&values, &mut y);
        }
        Ok(())
    }

    /// y = A^T x.
    fn multiply_transposed(&self, x: sys::Vec, y: sys::Vec) -> Result<()> {
        let (add, back) = (sys::ADD_VALUES, sys::SCATTER_REVERSE);
        {
            // SAFETY: as in `multiply`.
            let (x, mut y) = unsafe { (LocalValues::of(x)?, LocalValuesMut::of(y)?) };
            self.product.multiply_own_transposed(&x, &mut y);
            if let Some(ghosts) = &self.ghosts {
                // SAFETY: as in `multiply`.
                let mut values = unsafe { LocalValuesMut::of(ghosts.values.0)? };
                self.product.other.multiply_transposed(&x, &mut values);
            }
        }
        if let Some(ghosts) = &self.ghosts {
            petsc!(VecScatterBegin(ghosts.scatter.0, ghosts.values.0, y, add, back))?;
            petsc!(VecScatterEnd(ghosts.scatter.0, ghosts.values.0, y, add, back))?;
        }
        Ok(())
    }
}

type Apply = unsafe extern "C" fn(sys::Mat, sys::Vec, sys::Vec) -> sys::PetscErrorCode;
type Sum = unsafe extern "C" fn(sys::Mat, sys::Vec, sys::Vec, sys::Vec) -> sys::PetscErrorCode;
type Get = unsafe extern "C" fn(sys::Mat, sys::Vec) -> sys::PetscErrorCode;

// A panic cannot pass the C code below these functions: `extern "C"` turns it into an abort.

unsafe extern "C" fn multiply<T: Stored>(
    shell: sys::Mat,
    x: sys::Vec,
    y: sys::Vec,
) -> sys::PetscErrorCode {
    with_context::<T>(shell, |context| context.multiply(x, y, false))
}

/// z = y + A x, where z may be y.
unsafe extern "C" fn multiply_add<T: Stored>(
    shell: sys::Mat,
    x: sys::Vec,
    y: sys::Vec,
    z: sys::Vec,
) -> sys::PetscErrorCode {
    with_context::<T>(shell, |context| {
        if y != z {
            petsc!(VecCopy(y, z))?;
        }
        context.multiply(x, z, true)
    })
}

unsafe extern "C" fn transposed<T: Stored>(
    shell: sys::Mat,
    x: sys::Vec,
    y: sys::Vec,
) -> sys::PetscErrorCode {
    with_context::<T>(shell, |context| context.multiply_transposed(x, y))
}

unsafe extern "C" fn get_diagonal<T: Stored>(
    shell: sys::Mat,
    diagonal: sys::Vec,
) -> sys::PetscErrorCode {
    with_context::<T>(shell, |context| {
        // SAFETY: PETSc's vector lives through the call.
        let mut values = unsafe { LocalValuesMut::of(diagonal)? };
        let entries = context.product.diagonal();
        if values.len() != entries.len() {
            return Err(Error::Environment("this matrix has no diagonal".into()));
        }
        values.copy_from_slice(&entries);
        Ok(())
    })
}

/// Acts on the context of a shell of ours.
fn with_context<T>(
    shell: sys::Mat,
    act: impl FnOnce(&Context<T>) -> Result<()>,
) -> sys::PetscErrorCode {
    let mut data: *mut c_void = null_mut();
    let outcome = petsc!(MatShellGetContext(shell, (&raw mut data).cast())).and_then(|()| {
        // SAFETY: the box that `Shell::new` gave up lives as long as the shell.
        act(unsafe { &*data.cast::<Context<T>>() })
    });
    outcome.map_or_else(|error| keep(&error), |()| 0)
}

unsafe extern "C" fn destroy<T>(data: sys::Destroyed) -> sys::PetscErrorCode {
    // SAFETY: the box that `Shell::new` gave up, and PETSc calls this once.
    drop(unsafe { Box::from_raw(sys::destroyed(data).cast::<Context<T>>()) });
    0
}
