//! The mass as PETSc's KSP sees it: M ⊗ 1 over all components of all right-hand sides, a product and
//! a preconditioner of the program's. One sweep over the scalar matrix serves `C` columns.

use std::ffi::CStr;
use std::ops::Range;

use crate::error::Result;
use crate::parallel::World;
use crate::petsc::{Index, Matrix, ShellSystem};
use crate::system::border::Border;
use crate::system::numbering::Numbering;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockMatrix;

use super::envelope::{self, Complete};
use super::incomplete::Incomplete;
use super::matrix;

/// The matrix and what its products need.
#[derive(Clone, Copy)]
pub struct Product<'a> {
    pub world: &'a World,
    pub numbering: &'a Numbering,
    pub pattern: &'a Pattern,
    pub matrix: &'a BlockMatrix<1>,
    /// The owned rows by whether they have columns of other ranks.
    pub rows: &'a Border,
}

impl Product<'_> {
    /// y = M x; `x` has local values, and its ghosts come while inner rows are multiplied.
    /// Collective.
    pub fn multiply<const C: usize>(&self, x: &mut [[f64; C]], y: &mut [[f64; C]]) {
        let y = y.as_flattened_mut();
        let mut rows = |runs: &[Range<usize>], x: &[f64]| {
            for run in runs {
                matrix::multiply_rows::<C>(self.matrix, self.pattern, run.clone(), x, y);
            }
        };
        let flat = x.as_flattened_mut();
        self.numbering.halo.forward_while(self.world, [flat], C, |[x]| rows(&self.rows.inner, x));
        rows(&self.rows.reaching, x.as_flattened());
    }
}

/// The program's preconditioners.
pub enum Factor {
    /// Of a small matrix on one rank: its inverse.
    Complete(Complete),
    Incomplete(Incomplete),
}

/// The mass matrix for `C` columns. Some values are held at zero: their rows are those of the identity.
pub struct System<'a, const C: usize> {
    product: Product<'a>,
    /// `None`: PETSc's preconditioner is used.
    factor: Option<&'a Factor>,
    /// Of owned nodes: to be solved for.
    free: &'a [[bool; C]],
    /// Values at local nodes, filled up to whole chunks of a complete factor.
    local: Vec<[f64; C]>,
}

impl<'a, const C: usize> System<'a, C> {
    pub fn new(product: Product<'a>, factor: Option<&'a Factor>, free: &'a [[bool; C]]) -> Self {
        let room = product.numbering.len().next_multiple_of(envelope::WIDTH);
        System { product, factor, free, local: vec![[0.0; C]; room] }
    }
}

impl<const C: usize> ShellSystem for System<'_, C> {
    fn multiply(&mut self, x: &[f64], y: &mut [f64]) -> Result<()> {
        let (x, y) = (x.as_chunks::<C>().0, y.as_chunks_mut::<C>().0);
        self.local[..x.len()].copy_from_slice(x);
        self.product.multiply(&mut self.local[..self.product.numbering.len()], y);
        for ((y, x), free) in y.iter_mut().zip(x).zip(self.free) {
            for k in 0..C {
                y[k] = if free[k] { y[k] } else { x[k] };
            }
        }
        Ok(())
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<()> {
        let (r, z) = (r.as_chunks::<C>().0, z.as_chunks_mut::<C>().0);
        let Product { world, numbering, .. } = self.product;
        match self.factor {
            None => self.local[..r.len()].copy_from_slice(r),
            Some(Factor::Complete(factor)) => {
                self.local[..r.len()].copy_from_slice(r);
                factor.solve(&mut self.local);
            }
            Some(Factor::Incomplete(factor)) => {
                let local = &mut self.local[..numbering.len()];
                factor.apply(world, numbering, r, self.free, local)?;
            }
        }
        z.copy_from_slice(&self.local[..z.len()]);
        Ok(())
    }

    fn preconditioner(&self) -> &'static CStr {
        match self.factor {
            Some(Factor::Complete(_)) => c"complete factor",
            _ => c"incomplete factor over all ranks",
        }
    }

    fn entries(&self) -> Result<Matrix> {
        let Product { world, numbering, pattern, matrix, .. } = self.product;
        let mut free = vec![[0.0; C]; numbering.len()];
        for (marks, free) in free.iter_mut().zip(self.free) {
            *marks = free.map(|free| f64::from(u8::from(free)));
        }
        numbering.halo.forward(world, free.as_flattened_mut(), C)?;
        let (mut offsets, mut columns, mut values) = (vec![0 as Index], Vec::new(), Vec::new());
        for row in 0..numbering.owned {
            for k in 0..C {
                for entry in pattern.offsets[row]..pattern.offsets[row + 1] {
                    let column = pattern.columns[entry] as usize;
                    columns.push(numbering.global[column] * C as Index + k as Index);
                    values.push(if free[row][k] > 0.0 && free[column][k] > 0.0 {
                        matrix.values[entry]
                    } else {
                        f64::from(u8::from(column == row))
                    });
                }
                offsets.push(columns.len() as Index);
            }
        }
        let rows = numbering.owned * C;
        let mut entries = Matrix::from_csr(world.comm(), C, rows, &offsets, &columns, &values)?;
        entries.set_spd(true)?;
        Ok(entries)
    }
}
