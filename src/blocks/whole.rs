//! y = A x for a sparse A of small blocks with one column index each, the values in single or in
//! double precision: 4 or 8 bytes an entry and 4 a block, where compressed rows take 12 an entry. Sums
//! are in double precision. Of a symmetric matrix [`super::Half`] takes half of that.

use super::stored::{AHEAD, BEYOND, Stored, fetch};
use crate::tensor::fused::{self, multiply_add};

/// The rows of one rank, or the part of them that multiplies other ranks' unknowns.
#[derive(Debug, Clone)]
pub struct Blocks<T> {
    shape: Shape,
    /// Block rows with entries, where some have none.
    rows: Option<Vec<u32>>,
    /// First block of each row of `rows`, and the end.
    offsets: Vec<u32>,
    /// Block column of each block.
    columns: Vec<u32>,
    /// Squares of 2 by rows, others by columns; then one value that is loaded and never used.
    values: Vec<T>,
}

/// Rows and columns of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    Two,
    Three,
    /// 2 rows, 3 columns: from rigid-body modes of the plane to displacements.
    TwoByThree,
}

impl Shape {
    /// Values of a block.
    fn values(self) -> usize {
        match self {
            Shape::Two => 4,
            Shape::Three => 9,
            Shape::TwoByThree => 6,
        }
    }
}

/// Calls a method for the blocks' rows and columns.
macro_rules! by_shape {
    ($blocks:expr, $method:ident[$($flag:tt),*]($($argument:expr),*)) => {
        match $blocks.shape {
            Shape::Two => $blocks.$method::<2, 2, $($flag),*>($($argument),*),
            Shape::Three => $blocks.$method::<3, 3, $($flag),*>($($argument),*),
            Shape::TwoByThree => $blocks.$method::<2, 3, $($flag),*>($($argument),*),
        }
    };
}

impl<T: Stored> Blocks<T> {
    /// No rows yet, in blocks of `size`: 2x3, multiples of 3, which are kept as 3x3, or multiples of 2, as 2x2.
    /// `blocks`: about how many there will be.
    pub fn growing(size: [usize; 2], blocks: usize) -> Option<Growing<T>> {
        let shape = match size {
            [0, _] | [_, 0] => return None,
            [2, 3] => Shape::TwoByThree,
            [r, c] if r % 3 == 0 && c % 3 == 0 => Shape::Three,
            [r, c] if r % 2 == 0 && c % 2 == 0 => Shape::Two,
            _ => return None,
        };
        let blocks = Blocks {
            shape,
            rows: None,
            offsets: vec![0],
            columns: Vec::with_capacity(blocks * size[0] * size[1] / shape.values()),
            values: Vec::with_capacity(blocks * size[0] * size[1] + BEYOND),
        };
        Some(Growing { blocks, filled: Vec::new(), count: 0 })
    }

    /// The same room for other rows, [`Growing::push`]ed anew.
    pub fn regrow(self) -> Growing<T> {
        let mut blocks = self;
        blocks.rows = None;
        blocks.offsets.truncate(1);
        blocks.columns.clear();
        blocks.values.clear();
        Growing { blocks, filled: Vec::new(), count: 0 }
    }

    /// The diagonal entries of a square matrix, zero where there is no block.
    pub fn diagonal(&self, rows: usize) -> Vec<f64> {
        let size = match self.shape {
            Shape::Two | Shape::TwoByThree => 2,
            Shape::Three => 3,
        };
        let mut diagonal = vec![0.0; rows];
        for (k, range) in self.offsets.windows(2).enumerate() {
            let (row, blocks) = (self.row(k), range[0] as usize..range[1] as usize);
            let Some(at) = self.columns[blocks.clone()].iter().position(|&c| c as usize == row)
            else {
                continue;
            };
            let first = (blocks.start + at) * self.shape.values();
            for (i, entry) in diagonal[row * size..].iter_mut().take(size).enumerate() {
                *entry = self.values[first + i * (size + 1)].into();
            }
        }
        diagonal
    }

    /// y = A x. Rows without entries are set to zero.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        if self.rows.is_some() {
            y.fill(0.0);
        }
        self.run::<false>(x, y);
    }

    /// y += A x.
    pub fn multiply_add(&self, x: &[f64], y: &mut [f64]) {
        self.run::<true>(x, y);
    }

    /// y = A x or y += A x, in the fastest form that the processor knows.
    fn run<const ADD: bool>(&self, x: &[f64], y: &mut [f64]) {
        #[cfg(target_arch = "x86_64")]
        if fused::has_avx2() {
            // SAFETY: the processor has just said that it knows the instructions.
            return unsafe { avx2::run::<T, ADD>(self, x, y) };
        }
        by_shape!(self, plain[ADD, false](x, y));
    }

    /// y = A x in the form without special instructions, which the other is tested against.
    #[doc(hidden)]
    pub fn multiply_plain(&self, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        by_shape!(self, plain[true, false](x, y));
    }

    #[inline(always)]
    fn plain<const R: usize, const C: usize, const ADD: bool, const FUSED: bool>(
        &self,
        x: &[f64],
        y: &mut [f64],
    ) {
        let (x, y) = (x.as_chunks::<C>().0, y.as_chunks_mut::<R>().0);
        for (k, range) in self.offsets.windows(2).enumerate() {
            let blocks = range[0] as usize..range[1] as usize;
            let values = self.values[blocks.start * R * C..].chunks_exact(R * C);
            let mut sums = [0.0; R];
            for (&column, block) in self.columns[blocks].iter().zip(values) {
                fetch(block.as_ptr(), AHEAD);
                let x = &x[column as usize];
                for c in 0..C {
                    for (r, sum) in sums.iter_mut().enumerate() {
                        let value = block[place::<R, C>(r, c)].into();
                        *sum = multiply_add::<FUSED>(value, x[c], *sum);
                    }
                }
            }
            store::<R, ADD>(&mut y[self.row(k)], sums);
        }
    }

    /// y = A^T x.
    pub fn multiply_transposed(&self, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        #[cfg(target_arch = "x86_64")]
        if fused::has_avx2() {
            // SAFETY: the processor has just said that it knows the instructions.
            return unsafe { avx2::transposed(self, x, y) };
        }
        by_shape!(self, transposed[false](x, y));
    }

    #[inline(always)]
    fn transposed<const R: usize, const C: usize, const FUSED: bool>(
        &self,
        x: &[f64],
        y: &mut [f64],
    ) {
        let (x, y) = (x.as_chunks::<R>().0, y.as_chunks_mut::<C>().0);
        for (k, range) in self.offsets.windows(2).enumerate() {
            let blocks = range[0] as usize..range[1] as usize;
            let values = self.values[blocks.start * R * C..].chunks_exact(R * C);
            let x = &x[self.row(k)];
            for (&column, block) in self.columns[blocks].iter().zip(values) {
                fetch(block.as_ptr(), AHEAD);
                let y = &mut y[column as usize];
                for (c, y) in y.iter_mut().enumerate() {
                    for (r, &x) in x.iter().enumerate() {
                        *y = multiply_add::<FUSED>(block[place::<R, C>(r, c)].into(), x, *y);
                    }
                }
            }
        }
    }

    /// The block row behind the k-th stored one.
    #[inline(always)]
    fn row(&self, k: usize) -> usize {
        self.rows.as_ref().map_or(k, |rows| rows[k] as usize)
    }
}

impl Blocks<f64> {
    /// The same in single precision.
    pub fn rounded(&self) -> Blocks<f32> {
        Blocks {
            shape: self.shape,
            rows: self.rows.clone(),
            offsets: self.offsets.clone(),
            columns: self.columns.clone(),
            values: self.values.iter().map(|&value| value as f32).collect(),
        }
    }
}

/// [`Blocks`] that are given row by row.
pub struct Growing<T> {
    blocks: Blocks<T>,
    filled: Vec<u32>,
    count: u32,
}

impl<T: Stored> Growing<T> {
    /// Appends a row of `R` x `C` blocks, each with its column.
    pub fn push<const R: usize, const C: usize>(&mut self, row: &[(usize, fused::Block<R, C>)]) {
        match self.blocks.shape {
            Shape::Two => self.push_in::<R, C, 2, 2, 4>(row),
            Shape::Three => self.push_in::<R, C, 3, 3, 9>(row),
            Shape::TwoByThree => self.push_in::<R, C, 2, 3, 6>(row),
        }
    }

    /// In kernel blocks of `H` x `W`, `N` values.
    #[inline(always)]
    fn push_in<const R: usize, const C: usize, const H: usize, const W: usize, const N: usize>(
        &mut self,
        row: &[(usize, fused::Block<R, C>)],
    ) {
        for first in (0..R).step_by(H) {
            for (column, block) in row {
                for left in (0..C).step_by(W) {
                    self.blocks.columns.push((column * (C / W) + left / W) as u32);
                    let mut values = [T::default(); N];
                    for r in 0..H {
                        for c in 0..W {
                            values[place::<H, W>(r, c)] = T::rounded(block[first + r][left + c]);
                        }
                    }
                    self.blocks.values.extend_from_slice(&values);
                }
            }
            if !row.is_empty() {
                self.filled.push(self.count);
                self.blocks.offsets.push(self.blocks.columns.len() as u32);
            }
            self.count += 1;
        }
    }

    pub fn finish(self) -> Blocks<T> {
        let Growing { mut blocks, filled, count } = self;
        blocks.values.extend([T::default(); BEYOND]);
        blocks.rows = (filled.len() < count as usize).then_some(filled);
        blocks
    }
}

/// Where a block keeps its entry (r, c).
#[inline(always)]
fn place<const R: usize, const C: usize>(r: usize, c: usize) -> usize {
    if R == 2 && C == 2 { r * C + c } else { c * R + r }
}

#[inline(always)]
fn store<const R: usize, const ADD: bool>(target: &mut [f64; R], sums: [f64; R]) {
    for (target, sum) in target.iter_mut().zip(sums) {
        *target = if ADD { *target + sum } else { sum };
    }
}

/// With AVX2 and fused multiply-add: a square of 2, or a column of a square of 3, in one vector.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{AHEAD, BEYOND, Blocks, Shape, Stored, fetch, store};
    use crate::blocks::stored::load;
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx2,fma")]
    pub fn run<T: Stored, const ADD: bool>(blocks: &Blocks<T>, x: &[f64], y: &mut [f64]) {
        match blocks.shape {
            Shape::Two => twos::<T, ADD>(blocks, x, y),
            Shape::Three => threes::<T, ADD>(blocks, x, y),
            Shape::TwoByThree => twos_by_three::<T, ADD>(blocks, x, y),
        }
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn transposed<T: Stored>(blocks: &Blocks<T>, x: &[f64], y: &mut [f64]) {
        by_shape!(blocks, transposed[true](x, y));
    }

    #[target_feature(enable = "avx2,fma")]
    fn twos<T: Stored, const ADD: bool>(blocks: &Blocks<T>, x: &[f64], y: &mut [f64]) {
        let (x, y) = (x.as_chunks::<2>().0, y.as_chunks_mut::<2>().0);
        let values = blocks.values.as_chunks::<4>().0;
        let term = |column: u32, block: &[T; 4], sum: __m256d| {
            let x = &x[column as usize];
            // SAFETY: four values are there, and two.
            let (block, x) = unsafe { (load(block.as_ptr()), _mm_loadu_pd(x.as_ptr())) };
            _mm256_fmadd_pd(block, _mm256_set_m128d(x, x), sum)
        };
        for (k, range) in blocks.offsets.windows(2).enumerate() {
            let row = range[0] as usize..range[1] as usize;
            let (columns, values) = (&blocks.columns[row.clone()], &values[row]);
            fetch(columns.as_ptr(), AHEAD / 4);
            let (columns, last_column) = columns.as_chunks::<2>();
            let (values, last) = values.as_chunks::<2>();
            let mut sums = [_mm256_setzero_pd(); 2];
            for (columns, values) in columns.iter().zip(values) {
                fetch(values.as_ptr(), AHEAD);
                sums[0] = term(columns[0], &values[0], sums[0]);
                sums[1] = term(columns[1], &values[1], sums[1]);
            }
            for (&column, value) in last_column.iter().zip(last) {
                sums[0] = term(column, value, sums[0]);
            }
            let sum = _mm256_add_pd(sums[0], sums[1]);
            let (low, high) = (_mm256_castpd256_pd128(sum), _mm256_extractf128_pd::<1>(sum));
            let mut sums = [0.0; 2];
            // SAFETY: two values fit.
            unsafe { _mm_storeu_pd(sums.as_mut_ptr(), _mm_hadd_pd(low, high)) };
            store::<2, ADD>(&mut y[blocks.row(k)], sums);
        }
    }

    /// A block is two columns in one vector, and the third.
    #[target_feature(enable = "avx2,fma")]
    fn twos_by_three<T: Stored, const ADD: bool>(blocks: &Blocks<T>, x: &[f64], y: &mut [f64]) {
        let (x, y) = (x.as_chunks::<3>().0, y.as_chunks_mut::<2>().0);
        for (k, range) in blocks.offsets.windows(2).enumerate() {
            let row = range[0] as usize..range[1] as usize;
            let values = &blocks.values[6 * row.start..6 * row.end + BEYOND];
            let columns = &blocks.columns[row];
            let (mut sums, mut last) = (_mm256_setzero_pd(), _mm256_setzero_pd());
            for (&column, block) in columns.iter().zip(values.windows(6 + BEYOND).step_by(6)) {
                fetch(block.as_ptr(), AHEAD);
                let x = &x[column as usize];
                // SAFETY: seven values are there. Of the second vector the first column is used,
                // and dropped, once more: then it ends with the block.
                let (first, third) = unsafe { (load(block.as_ptr()), load(block.as_ptr().add(2))) };
                let pair = _mm256_set_pd(x[1], x[1], x[0], x[0]);
                sums = _mm256_fmadd_pd(first, pair, sums);
                last = _mm256_fmadd_pd(third, _mm256_set1_pd(x[2]), last);
            }
            let sum = _mm256_add_pd(sums, _mm256_permute2f128_pd::<0x01>(sums, sums));
            let sum = _mm_add_pd(_mm256_castpd256_pd128(sum), _mm256_extractf128_pd::<1>(last));
            let mut sums = [0.0; 2];
            // SAFETY: two values fit.
            unsafe { _mm_storeu_pd(sums.as_mut_ptr(), sum) };
            store::<2, ADD>(&mut y[blocks.row(k)], sums);
        }
    }

    #[target_feature(enable = "avx2,fma")]
    fn threes<T: Stored, const ADD: bool>(blocks: &Blocks<T>, x: &[f64], y: &mut [f64]) {
        let (x, y) = (x.as_chunks::<3>().0, y.as_chunks_mut::<3>().0);
        for (k, range) in blocks.offsets.windows(2).enumerate() {
            let row = range[0] as usize..range[1] as usize;
            let values = &blocks.values[row.start * 9..row.end * 9 + BEYOND];
            let columns = &blocks.columns[row];
            fetch(columns.as_ptr(), AHEAD / 9);
            let mut sums = [_mm256_setzero_pd(); 3];
            for (&column, block) in columns.iter().zip(values.windows(9 + BEYOND).step_by(9)) {
                fetch(block.as_ptr(), AHEAD);
                let x = &x[column as usize];
                for c in 0..3 {
                    // SAFETY: ten values are there. The fourth lane belongs to the next column and
                    // is dropped below.
                    let column = unsafe { load(block.as_ptr().add(3 * c)) };
                    sums[c] = _mm256_fmadd_pd(column, _mm256_set1_pd(x[c]), sums[c]);
                }
            }
            let sum = _mm256_add_pd(_mm256_add_pd(sums[0], sums[1]), sums[2]);
            let mut sums = [0.0; 4];
            // SAFETY: four values fit.
            unsafe { _mm256_storeu_pd(sums.as_mut_ptr(), sum) };
            store::<3, ADD>(&mut y[blocks.row(k)], [sums[0], sums[1], sums[2]]);
        }
    }
}
