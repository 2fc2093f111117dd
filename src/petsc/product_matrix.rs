//! [`ProductMatrix`]: a matrix for PETSc that is known by its products.

use std::ffi::c_void;
use std::marker::PhantomData;
use std::ptr::null_mut;

use mpi::topology::SimpleCommunicator;
use mpi::traits::AsRaw;

use super::check::{code_of, petsc};
use super::object::Object;
use super::sys;
use super::vector::DETERMINE;
use super::vector::{Index, LocalValues, LocalValuesMut, index};
use crate::error::{Error, Result};

/// What multiplies by this rank's rows of a matrix A. Slices are this rank's values.
pub trait Product {
    /// Scalar rows, and columns of this rank.
    fn size(&self) -> [usize; 2];

    /// Global block columns of other ranks that the rows have entries in, and the columns of a block.
    fn ghosts(&self) -> (&[Index], usize);

    /// y = A x by the columns of this rank.
    fn multiply_own(&self, x: &[f64], y: &mut [f64]);

    /// y += A x by the columns of this rank.
    fn multiply_own_add(&self, x: &[f64], y: &mut [f64]);

    /// y = A^T x for the columns of this rank.
    fn multiply_own_transposed(&self, x: &[f64], y: &mut [f64]);

    /// y += A x by the columns of other ranks.
    fn multiply_ghosts_add(&self, ghosts: &[f64], y: &mut [f64]);

    /// ghosts = A^T x for the columns of other ranks.
    fn multiply_ghosts_transposed(&self, x: &[f64], ghosts: &mut [f64]);

    /// Diagonal entries of a square matrix.
    fn diagonal(&self) -> Vec<f64>;
}

/// One reference to a PETSc shell matrix over a [`Product`].
pub(crate) struct ProductMatrix<P>(Object<sys::Mat>, PhantomData<P>);

/// What the shell multiplies by.
struct Context<P> {
    product: P,
    ghosts: Option<Ghosts>,
}

/// Values of other ranks.
struct Ghosts {
    scatter: Object<sys::VecScatter>,
    values: Object<sys::Vec>,
}

impl<P: Product> ProductMatrix<P> {
    /// Collective.
    pub fn new(comm: &SimpleCommunicator, product: P) -> Result<Self> {
        let [rows, columns] = [index(product.size()[0])?, index(product.size()[1])?];
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
        petsc!(MatShellSetContextDestroy(shell.0, Some(destroy::<P>)))?;
        // SAFETY: PETSc keeps functions of any signature under one type and calls each, by its place
        // among the operations, as what it is.
        let (once, add, twice, diagonal) = unsafe {
            (
                std::mem::transmute::<Apply, sys::AnyFunction>(multiply::<P>),
                std::mem::transmute::<Sum, sys::AnyFunction>(multiply_add::<P>),
                std::mem::transmute::<Apply, sys::AnyFunction>(transposed::<P>),
                std::mem::transmute::<Get, sys::AnyFunction>(get_diagonal::<P>),
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
        Ok(ProductMatrix(shell, PhantomData))
    }

    pub(crate) fn raw(&self) -> sys::Mat {
        self.0.0
    }

    /// Gives the values a new content.
    pub fn change(&mut self, act: impl FnOnce(&mut P) -> Result<()>) -> Result<()> {
        let mut data: *mut c_void = null_mut();
        petsc!(MatShellGetContext(self.raw(), (&raw mut data).cast()))?;
        // SAFETY: the box that `new` gave up lives as long as the shell, and PETSc is not
        // multiplying while this runs.
        act(unsafe { &mut (*data.cast::<Context<P>>()).product })?;
        // Users of the matrix see the change by this.
        petsc!(MatAssemblyBegin(self.raw(), sys::MAT_FINAL_ASSEMBLY))?;
        petsc!(MatAssemblyEnd(self.raw(), sys::MAT_FINAL_ASSEMBLY))
    }
}

impl Ghosts {
    fn new<P: Product>(shell: sys::Mat, product: &P) -> Result<Self> {
        let (mut wanted, mut own) = (Object(null_mut()), Object(null_mut()));
        let (mut values, mut scatter) = (Object(null_mut()), Object(null_mut()));
        // SAFETY: a constant of a running MPI.
        let alone = unsafe { mpi::ffi::RSMPI_COMM_SELF };
        let (columns, wide) = product.ghosts();
        let (list, copy) = (columns.as_ptr(), sys::PETSC_COPY_VALUES);
        let (count, all) = (index(columns.len())?, index(columns.len() * wide)?);
        let wide = index(wide)?;
        petsc!(ISCreateBlock(alone, wide, count, list, copy, &mut wanted.0))?;
        petsc!(MatCreateVecs(shell, &mut own.0, null_mut()))?;
        petsc!(VecCreateSeq(alone, all, &mut values.0))?;
        petsc!(VecScatterCreate(own.0, wanted.0, values.0, null_mut(), &mut scatter.0))?;
        let _: (Object<sys::IS>, Object<sys::Vec>) = (wanted, own);
        Ok(Ghosts { scatter, values })
    }
}

impl<P: Product> Context<P> {
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
            self.product.multiply_ghosts_add(&values, &mut y);
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
                self.product.multiply_ghosts_transposed(&x, &mut values);
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

unsafe extern "C" fn multiply<P: Product>(
    shell: sys::Mat,
    x: sys::Vec,
    y: sys::Vec,
) -> sys::PetscErrorCode {
    with_context::<P>(shell, |context| context.multiply(x, y, false))
}

/// z = y + A x, where z may be y.
unsafe extern "C" fn multiply_add<P: Product>(
    shell: sys::Mat,
    x: sys::Vec,
    y: sys::Vec,
    z: sys::Vec,
) -> sys::PetscErrorCode {
    with_context::<P>(shell, |context| {
        if y != z {
            petsc!(VecCopy(y, z))?;
        }
        context.multiply(x, z, true)
    })
}

unsafe extern "C" fn transposed<P: Product>(
    shell: sys::Mat,
    x: sys::Vec,
    y: sys::Vec,
) -> sys::PetscErrorCode {
    with_context::<P>(shell, |context| context.multiply_transposed(x, y))
}

unsafe extern "C" fn get_diagonal<P: Product>(
    shell: sys::Mat,
    diagonal: sys::Vec,
) -> sys::PetscErrorCode {
    with_context::<P>(shell, |context| {
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
fn with_context<P>(
    shell: sys::Mat,
    act: impl FnOnce(&Context<P>) -> Result<()>,
) -> sys::PetscErrorCode {
    let mut data: *mut c_void = null_mut();
    code_of(petsc!(MatShellGetContext(shell, (&raw mut data).cast())).and_then(|()| {
        // SAFETY: the box that `ProductMatrix::new` gave up lives as long as the shell.
        act(unsafe { &*data.cast::<Context<P>>() })
    }))
}

unsafe extern "C" fn destroy<P>(data: sys::Destroyed) -> sys::PetscErrorCode {
    // SAFETY: the box that `ProductMatrix::new` gave up, and PETSc calls this once.
    drop(unsafe { Box::from_raw(sys::destroyed(data).cast::<Context<P>>()) });
    0
}
