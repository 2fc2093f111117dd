//! y = A x for a symmetric A of small square blocks of which only the lower ones and the diagonal
//! are kept, in single or in double precision; see [`super::Blocks`] for the whole.
//!
//! One pass serves both halves, y_i += A_ij x_j and y_j += A_ij^T x_i for j < i. Blocks are stored
//! by rows: then the second is a sum of rows, and the first one product per lane, added up once at
//! the end of the row of blocks.

use super::stored::{AHEAD, BEYOND, Stored, fetch};
use crate::tensor::fused::{self, multiply_add};

/// A square symmetric matrix, all its columns those of its rows.
#[derive(Debug, Clone)]
pub struct Half<T> {
    shape: Shape,
    /// First lower block of each block row, and the end.
    offsets: Vec<u32>,
    /// Block column of each lower block.
    columns: Vec<u32>,
    /// The lower blocks of a row and then its diagonal one (zero where there is none), each by
    /// rows; then one value that is loaded and never used.
    values: Vec<T>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    Two,
    Three,
}

/// Calls a method for the blocks' size.
macro_rules! by_shape {
    ($half:expr, $method:ident[$($flag:tt),*]($($argument:expr),*)) => {
        match $half.shape {
            Shape::Two => $half.$method::<2, $($flag),*>($($argument),*),
            Shape::Three => $half.$method::<3, $($flag),*>($($argument),*),
        }
    };
}

impl<T: Stored> Half<T> {
    /// No rows yet, of `size` unknowns: a multiple of 3 or of 2. `blocks`: about how many lower and
    /// diagonal ones there will be.
    pub fn growing(size: usize, blocks: usize) -> Option<Self> {
        let (shape, kept) = match size {
            0 => return None,
            _ if size.is_multiple_of(3) => (Shape::Three, 3),
            _ if size.is_multiple_of(2) => (Shape::Two, 2),
            _ => return None,
        };
        Some(Half {
            shape,
            offsets: vec![0],
            columns: Vec::with_capacity(blocks * (size / kept).pow(2)),
            values: Vec::with_capacity(blocks * size * size + BEYOND),
        })
    }

    /// Takes the rows away, but not the room for them.
    pub fn clear(&mut self) {
        self.offsets.truncate(1);
        self.columns.clear();
        self.values.clear();
    }

    /// Appends a row of `K` x `K` blocks, each with its column; those right of the diagonal are
    /// left out: of each pair of mirrored entries the lower one counts.
    pub fn push<const K: usize>(&mut self, row: &[(usize, fused::Block<K, K>)]) {
        match self.shape {
            Shape::Two => self.push_in::<K, 2, 4>(row),
            Shape::Three => self.push_in::<K, 3, 9>(row),
        }
    }

    /// In kernel blocks of `N` x `N`, `NN` values.
    #[inline(always)]
    fn push_in<const K: usize, const N: usize, const NN: usize>(
        &mut self,
        row: &[(usize, fused::Block<K, K>)],
    ) {
        self.values.truncate(self.blocks() * NN);
        let part = K / N;
        for first in 0..part {
            let own = self.offsets.len() - 1;
            let mut diagonal = [T::default(); NN];
            for (column, block) in row {
                for left in 0..part {
                    let column = column * part + left;
                    if column > own {
                        continue;
                    }
                    let mut values = [T::default(); NN];
                    for r in 0..N {
                        for c in 0..N {
                            let (i, j) = if column == own { (r.max(c), r.min(c)) } else { (r, c) };
                            values[r * N + c] = T::rounded(block[first * N + i][left * N + j]);
                        }
                    }
                    if column == own {
                        diagonal = values;
                    } else {
                        self.columns.push(column as u32);
                        self.values.extend_from_slice(&values);
                    }
                }
            }
            self.values.extend_from_slice(&diagonal);
            self.offsets.push(self.columns.len() as u32);
        }
        self.values.extend([T::default(); BEYOND]);
    }

    /// The diagonal entries.
    pub fn diagonal(&self) -> Vec<f64> {
        let size = match self.shape {
            Shape::Two => 2,
            Shape::Three => 3,
        };
        let ends = self.offsets.iter().skip(1).enumerate();
        ends.flat_map(|(row, &end)| {
            let first = (end as usize + row) * size * size;
            (0..size).map(move |k| self.values[first + k * (size + 1)].into())
        })
        .collect()
    }

    /// Lower and diagonal ones.
    fn blocks(&self) -> usize {
        self.columns.len() + self.offsets.len() - 1
    }

    /// y = A x.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
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
        by_shape!(self, plain[false, false](x, y));
    }

    #[inline(always)]
    fn plain<const N: usize, const ADD: bool, const FUSED: bool>(&self, x: &[f64], y: &mut [f64]) {
        let (x, y) = (x.as_chunks::<N>().0, y.as_chunks_mut::<N>().0);
        for (row, range) in self.offsets.windows(2).enumerate() {
            let blocks = range[0] as usize..range[1] as usize;
            let mut values = self.values[(blocks.start + row) * N * N..].chunks_exact(N * N);
            let own = &x[row];
            let mut sums = if ADD { y[row] } else { [0.0; N] };
            for (&column, block) in self.columns[blocks].iter().zip(&mut values) {
                fetch(block.as_ptr(), AHEAD);
                let (x, y) = (&x[column as usize], &mut y[column as usize]);
                for r in 0..N {
                    for c in 0..N {
                        let value: f64 = block[r * N + c].into();
                        sums[r] = multiply_add::<FUSED>(value, x[c], sums[r]);
                        y[c] = multiply_add::<FUSED>(value, own[r], y[c]);
                    }
                }
            }
            for block in values.take(1) {
                for r in 0..N {
                    for c in 0..N {
                        sums[r] = multiply_add::<FUSED>(block[r * N + c].into(), own[c], sums[r]);
                    }
                }
            }
            y[row] = sums;
        }
    }
}

impl Half<f64> {
    /// The same in single precision, in the place of what `target` held.
    pub fn round_into(&self, target: &mut Half<f32>) {
        target.shape = self.shape;
        target.offsets.clone_from(&self.offsets);
        target.columns.clone_from(&self.columns);
        target.values.clear();
        target.values.extend(self.values.iter().map(|&value| value as f32));
    }
}

/// With AVX2 and fused multiply-add: a square of 2, or a row of a square of 3, in one vector.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{AHEAD, BEYOND, Half, Shape, Stored, fetch};
    use crate::blocks::stored::load;
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx2,fma")]
    pub fn run<T: Stored, const ADD: bool>(half: &Half<T>, x: &[f64], y: &mut [f64]) {
        match half.shape {
            Shape::Two => twos::<T, ADD>(half, x, y),
            Shape::Three => threes::<T, ADD>(half, x, y),
        }
    }

    #[target_feature(enable = "avx2,fma")]
    fn twos<T: Stored, const ADD: bool>(half: &Half<T>, x: &[f64], y: &mut [f64]) {
        let rows = half.offsets.len() - 1;
        let (x, y) = (&x[..2 * rows], &mut y[..2 * rows]);
        let values = half.values.as_chunks::<4>().0;
        for (row, range) in half.offsets.windows(2).enumerate() {
            let blocks = range[0] as usize..range[1] as usize;
            let (first, columns) = (blocks.start + row, &half.columns[blocks]);
            let values = &values[first..=first + columns.len()];
            fetch(columns.as_ptr(), AHEAD / 4);
            // SAFETY: two values in each row of x.
            let own = unsafe { _mm_loadu_pd(x.as_ptr().add(2 * row)) };
            // x_0, x_0, x_1, x_1
            let own = _mm256_permute_pd::<0b1100>(_mm256_set_m128d(own, own));
            let block = |values: &[T; 4]| {
                // SAFETY: four values are there.
                unsafe { load(values.as_ptr()) }
            };
            let transposed = |block: __m256d| {
                let terms = _mm256_mul_pd(block, own);
                _mm_add_pd(_mm256_castpd256_pd128(terms), _mm256_extractf128_pd::<1>(terms))
            };
            let mut term = |column: u32, values: &[T; 4], sum: __m256d| {
                let (block, at) = (block(values), 2 * column as usize);
                // SAFETY: lower blocks have a column below their row, and x and y reach to the end
                // of the rows.
                let x = unsafe {
                    let y = y.as_mut_ptr().add(at);
                    _mm_storeu_pd(y, _mm_add_pd(transposed(block), _mm_loadu_pd(y)));
                    _mm_loadu_pd(x.as_ptr().add(at))
                };
                _mm256_fmadd_pd(block, _mm256_set_m128d(x, x), sum)
            };
            let mut sums = [_mm256_setzero_pd(); 2];
            let (pairs, last_column) = columns.as_chunks::<2>();
            let (pairs_values, last_values) = values.as_chunks::<2>();
            for (columns, values) in pairs.iter().zip(pairs_values) {
                fetch(values.as_ptr(), AHEAD);
                sums[0] = term(columns[0], &values[0], sums[0]);
                sums[1] = term(columns[1], &values[1], sums[1]);
            }
            let diagonal = if let ([column], [.., pair]) = (last_column, pairs_values) {
                fetch(pair.as_ptr(), AHEAD);
                sums[0] = term(*column, &pair[0], sums[0]);
                &pair[1..]
            } else {
                last_values
            };
            let sum = _mm256_add_pd(sums[0], sums[1]);
            let (low, high) = (_mm256_castpd256_pd128(sum), _mm256_extractf128_pd::<1>(sum));
            let mut sum = _mm_hadd_pd(low, high);
            for values in diagonal {
                sum = _mm_add_pd(sum, transposed(block(values)));
            }
            // SAFETY: two values in each row of y.
            unsafe {
                let y = y.as_mut_ptr().add(2 * row);
                _mm_storeu_pd(y, if ADD { _mm_add_pd(sum, _mm_loadu_pd(y)) } else { sum });
            }
        }
    }

    #[target_feature(enable = "avx2,fma")]
    fn threes<T: Stored, const ADD: bool>(half: &Half<T>, x: &[f64], y: &mut [f64]) {
        let rows = half.offsets.len() - 1;
        let (x, y) = (&x[..3 * rows], &mut y[..3 * rows]);
        let zero = _mm256_setzero_pd();
        for (row, range) in half.offsets.windows(2).enumerate() {
            let blocks = range[0] as usize..range[1] as usize;
            let (first, columns) = (blocks.start + row, &half.columns[blocks]);
            let values = &half.values[9 * first..9 * (first + columns.len() + 1) + BEYOND];
            fetch(columns.as_ptr(), AHEAD / 9);
            let own = [0, 1, 2].map(|c| _mm256_set1_pd(x[3 * row + c]));
            let block = |k: usize| {
                let values = values.as_ptr().wrapping_add(9 * k);
                // SAFETY: ten values are there, of every lower block and the diagonal one.
                unsafe { [0, 3, 6].map(|at| load(values.add(at))) }
            };
            let transposed = |rows: [__m256d; 3]| {
                let sum = _mm256_fmadd_pd(rows[1], own[1], _mm256_mul_pd(rows[0], own[0]));
                _mm256_fmadd_pd(rows[2], own[2], sum)
            };
            let mut term = |k: usize, sums: &mut [__m256d; 3]| {
                // SAFETY: lower blocks have a column below their row, so x reaches one value
                // further than it, and y to its end.
                unsafe {
                    fetch(values.as_ptr().wrapping_add(9 * k), AHEAD);
                    let at = 3 * *columns.get_unchecked(k) as usize;
                    let x = _mm256_loadu_pd(x.as_ptr().add(at));
                    let rows = block(k);
                    for (sum, row) in sums.iter_mut().zip(rows) {
                        *sum = _mm256_fmadd_pd(row, x, *sum);
                    }
                    add_three::<true>(y.as_mut_ptr().add(at), transposed(rows));
                }
            };
            let (count, mut sums) = (columns.len(), [[zero; 3]; 2]);
            for k in (1..count).step_by(2) {
                term(k - 1, &mut sums[0]);
                term(k, &mut sums[1]);
            }
            if count % 2 == 1 {
                term(count - 1, &mut sums[0]);
            }
            // The fourth lane of all of these belongs to another row.
            let sum =
                |r: usize| _mm256_blend_pd::<0b1000>(_mm256_add_pd(sums[0][r], sums[1][r]), zero);
            let (a, b) = (_mm256_hadd_pd(sum(0), sum(1)), _mm256_hadd_pd(sum(2), zero));
            let (low, high) =
                (_mm256_permute2f128_pd::<0x20>(a, b), _mm256_permute2f128_pd::<0x31>(a, b));
            let sum = _mm256_add_pd(transposed(block(count)), _mm256_add_pd(low, high));
            // SAFETY: three values in each row of y.
            unsafe { add_three::<ADD>(y.as_mut_ptr().add(3 * row), sum) };
        }
    }

    /// y += a, or y = a, of the first three lanes: in two and one, as four would overlap with the
    /// next three, and a load that waits for parts of two stores takes longer than all else here.
    ///
    /// # Safety
    /// There are three values at `y`.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn add_three<const ADD: bool>(y: *mut f64, terms: __m256d) {
        let (mut two, mut one) = (_mm256_castpd256_pd128(terms), _mm256_extractf128_pd::<1>(terms));
        // SAFETY: the caller's.
        unsafe {
            if ADD {
                two = _mm_add_pd(two, _mm_loadu_pd(y));
                one = _mm_add_sd(one, _mm_load_sd(y.add(2)));
            }
            _mm_storeu_pd(y, two);
            _mm_store_sd(y.add(2), one);
        }
    }
}
