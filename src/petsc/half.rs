//! y = A x for a symmetric A of small square blocks of which only the lower ones and the diagonal
//! are kept, their values rounded to single precision; see [`super::Blocks`] for the whole.
//!
//! One pass serves both halves, y_i += A_ij x_j and y_j += A_ij^T x_i for j < i. Blocks are stored
//! by rows: then the second is a sum of rows, and the first one product per lane, added up once at
//! the end of the row of blocks.

use super::blocks::{Blocks, fetch, multiply_add, pattern_of};

/// A square symmetric matrix, all its columns those of its rows.
#[derive(Debug, Clone)]
pub struct Half {
    shape: Shape,
    /// First lower block of each block row, and the end.
    offsets: Vec<u32>,
    /// Block column of each lower block.
    columns: Vec<u32>,
    /// Rows without a diagonal block, ascending.
    bare: Vec<u32>,
    /// The lower blocks of a row and then its diagonal one (zero where there is none), each by
    /// rows; then one value that is loaded and never used.
    values: Vec<f32>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    Two,
    Three,
}

/// Loaded in fours, the last row of the last block of 3x3 reads one value beyond it.
const BEYOND: usize = 1;

/// Bytes of values between what is used and what is asked for.
const AHEAD: usize = 8192;

/// Calls a method for the blocks' size.
macro_rules! by_shape {
    ($half:expr, $method:ident[$($flag:tt),*]($($argument:expr),*)) => {
        match $half.shape {
            Shape::Two => $half.$method::<2, $($flag),*>($($argument),*),
            Shape::Three => $half.$method::<3, $($flag),*>($($argument),*),
        }
    };
}

impl Half {
    /// The pattern of compressed rows as in [`super::Blocks::of_pattern`], in square blocks of 2
    /// or 3, with values zero; `None` where it is not made of whole blocks or not its own
    /// transpose.
    pub fn of_pattern(size: usize, offsets: &[i32], columns: &[i32]) -> Option<Self> {
        let shape = match size {
            2 => Shape::Two,
            3 => Shape::Three,
            _ => return None,
        };
        let whole = pattern_of([size; 2], offsets, columns)?;
        let count = offsets.len().saturating_sub(1) / size;
        let (mut starts, mut lower) = (Vec::with_capacity(count + 1), Vec::new());
        starts.push(0);
        // Blocks right of the diagonal, each the next one of its row when its mirror image comes.
        let mut right: Vec<&[u32]> = vec![&[]; count];
        let mut diagonal = vec![false; count];
        for (k, range) in whole.offsets.windows(2).enumerate() {
            let row = whole.row(k);
            starts.resize(row + 1, lower.len() as u32);
            let columns = &whole.columns[range[0] as usize..range[1] as usize];
            let (left, rest) = columns.split_at(columns.partition_point(|&j| (j as usize) < row));
            for &column in left {
                let (&mirror, others) = right[column as usize].split_first()?;
                if mirror as usize != row {
                    return None;
                }
                right[column as usize] = others;
            }
            let on = rest.first().is_some_and(|&j| j as usize == row);
            right[row] = &rest[usize::from(on)..];
            lower.extend_from_slice(left);
            diagonal[row] = on;
        }
        starts.resize(count + 1, lower.len() as u32);
        if right.iter().any(|rest| !rest.is_empty()) {
            return None;
        }
        let values = vec![0.0; (lower.len() + count) * size * size + BEYOND];
        let bare = (0..count as u32).filter(|&row| !diagonal[row as usize]).collect();
        Some(Half { shape, offsets: starts, columns: lower, bare, values })
    }

    /// Rounds the `values` of the compressed rows of [`Self::of_pattern`], the same `offsets`. Of
    /// each pair of entries mirrored at the diagonal it takes the lower one.
    pub fn fill(&mut self, offsets: &[i32], values: &[f64]) {
        by_shape!(self, fill_of[](offsets, values));
    }

    fn fill_of<const N: usize>(&mut self, offsets: &[i32], values: &[f64]) {
        let mut bare = self.bare.iter().peekable();
        for (row, range) in self.offsets.windows(2).enumerate() {
            let lower = (range[1] - range[0]) as usize;
            let first = (range[0] as usize + row) * N * N;
            let target = &mut self.values[first..first + (lower + 1) * N * N];
            let without = bare.next_if(|&&bare| bare as usize == row).is_some();
            let count = lower + usize::from(!without);
            let source: [&[[f64; N]]; N] = std::array::from_fn(|r| {
                let start = offsets[row * N + r] as usize;
                values[start..start + count * N].as_chunks().0
            });
            for (k, block) in target.chunks_exact_mut(N * N).take(count).enumerate() {
                for r in 0..N {
                    // The upper halves are jumped over, which the processor does not foresee.
                    fetch(&source[r][k], AHEAD);
                    for c in 0..N {
                        block[r * N + c] = source[r][k][c] as f32;
                    }
                }
            }
            let diagonal = &mut target[lower * N * N..];
            for r in 0..N {
                for c in 0..r {
                    diagonal[c * N + r] = diagonal[r * N + c];
                }
            }
        }
    }

    /// y = A x.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        self.run::<false>(x, y);
    }

    /// y += A x.
    pub fn multiply_add(&self, x: &[f64], y: &mut [f64]) {
        self.run::<true>(x, y);
    }

    /// y = A^T x, the same.
    pub fn multiply_transposed(&self, x: &[f64], y: &mut [f64]) {
        self.multiply(x, y);
    }

    /// y = A x or y += A x, in the fastest form that the processor knows.
    fn run<const ADD: bool>(&self, x: &[f64], y: &mut [f64]) {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the processor has just said that it knows the instructions.
            return unsafe { avx2::run::<ADD>(self, x, y) };
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
                        let value = f64::from(block[r * N + c]);
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

/// A matrix in single precision: where it is known to be symmetric, half of it.
pub(super) enum Copied {
    Full(Blocks),
    Half(Half),
}

impl Copied {
    /// As [`Blocks::of_pattern`].
    pub fn of_pattern(
        size: [usize; 2],
        offsets: &[i32],
        columns: &[i32],
        symmetric: bool,
    ) -> Option<Self> {
        let half = (symmetric && size[0] == size[1])
            .then(|| Half::of_pattern(size[0], offsets, columns))
            .flatten();
        let full = || Blocks::of_pattern(size, offsets, columns).map(Copied::Full);
        half.map(Copied::Half).or_else(full)
    }

    pub fn fill(&mut self, offsets: &[i32], values: &[f64]) {
        match self {
            Copied::Full(blocks) => blocks.fill(offsets, values),
            Copied::Half(half) => half.fill(offsets, values),
        }
    }

    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        match self {
            Copied::Full(blocks) => blocks.multiply(x, y),
            Copied::Half(half) => half.multiply(x, y),
        }
    }

    pub fn multiply_add(&self, x: &[f64], y: &mut [f64]) {
        match self {
            Copied::Full(blocks) => blocks.multiply_add(x, y),
            Copied::Half(half) => half.multiply_add(x, y),
        }
    }

    pub fn multiply_transposed(&self, x: &[f64], y: &mut [f64]) {
        match self {
            Copied::Full(blocks) => blocks.multiply_transposed(x, y),
            Copied::Half(half) => half.multiply_transposed(x, y),
        }
    }
}

/// With AVX2 and fused multiply-add: a square of 2, or a row of a square of 3, in one vector.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{AHEAD, BEYOND, Half, Shape, fetch};
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx2,fma")]
    pub fn run<const ADD: bool>(half: &Half, x: &[f64], y: &mut [f64]) {
        match half.shape {
            Shape::Two => twos::<ADD>(half, x, y),
            Shape::Three => threes::<ADD>(half, x, y),
        }
    }

    #[target_feature(enable = "avx2,fma")]
    fn twos<const ADD: bool>(half: &Half, x: &[f64], y: &mut [f64]) {
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
            let block = |values: &[f32; 4]| {
                // SAFETY: four values are there.
                _mm256_cvtps_pd(unsafe { _mm_loadu_ps(values.as_ptr()) })
            };
            let transposed = |block: __m256d| {
                let terms = _mm256_mul_pd(block, own);
                _mm_add_pd(_mm256_castpd256_pd128(terms), _mm256_extractf128_pd::<1>(terms))
            };
            let mut term = |column: u32, values: &[f32; 4], sum: __m256d| {
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
    fn threes<const ADD: bool>(half: &Half, x: &[f64], y: &mut [f64]) {
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
                unsafe { [0, 3, 6].map(|at| _mm256_cvtps_pd(_mm_loadu_ps(values.add(at)))) }
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
