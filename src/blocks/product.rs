//! y = A x and y = A^T x by the rows of one rank in blocks, with the columns of other ranks apart.

use super::{Blocks, Half, Stored};
use crate::petsc::{Index, Product};
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
    /// If blocks of this size have no kernel: 2x3 and multiples of 2 and of 3 have.
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
}

impl<T: Stored> Product for BlockProduct<T> {
    fn size(&self) -> [usize; 2] {
        self.size
    }

    fn ghosts(&self) -> (&[Index], usize) {
        (&self.ghosts, self.wide)
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

    fn multiply_ghosts_add(&self, ghosts: &[f64], y: &mut [f64]) {
        self.other.multiply_add(ghosts, y);
    }

    fn multiply_ghosts_transposed(&self, x: &[f64], ghosts: &mut [f64]) {
        self.other.multiply_transposed(x, ghosts);
    }

    fn diagonal(&self) -> Vec<f64> {
        match &self.own {
            Own::Whole(blocks) => blocks.diagonal(self.size[0]),
            Own::Symmetric(half) => half.diagonal(),
        }
    }
}

impl BlockProduct<f64> {
    /// In single precision, in the place of what `target` held, if that is symmetric where this is. Whether it is.
    pub fn round_into(&self, target: &mut BlockProduct<f32>) -> bool {
        match (&self.own, &mut target.own) {
            (Own::Symmetric(own), Own::Symmetric(target)) => own.round_into(target),
            (Own::Whole(own), Own::Whole(target)) => *target = own.rounded(),
            _ => return false,
        }
        target.other = self.other.rounded();
        true
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
