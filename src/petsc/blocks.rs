//! y = A x for a sparse A of small blocks, its values rounded to single precision: 4 bytes an
//! entry and 4 a block, where compressed rows take 12 an entry. Sums are in double precision.
//! For multigrid's cycle, which has to be fixed and symmetric, not exact.

/// The rows of one rank, or the part of them that multiplies other ranks' unknowns.
#[derive(Debug, Clone)]
pub struct Blocks {
    shape: Shape,
    /// Block rows with entries, where some have none.
    rows: Option<Vec<u32>>,
    /// First block of each row of `rows`, and the end.
    offsets: Vec<u32>,
    /// Block column of each block.
    columns: Vec<u32>,
    /// Squares of 2 by rows, others by columns; then one value that is loaded and never used.
    values: Vec<f32>,
}

/// Rows and columns of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    Two,
    Three,
    /// 2 rows, 3 columns: from rigid-body modes of the plane to displacements.
    TwoByThree,
}

/// Loaded in fours, the last column of the last block reads one value beyond it.
const BEYOND: usize = 1;

/// Bytes of values between what is used and what is asked for: the rows are too short for the
/// processor to foresee the next ones.
const AHEAD: usize = 8192;

impl Shape {
    fn of(size: [usize; 2]) -> Option<Self> {
        match size {
            [2, 2] => Some(Shape::Two),
            [3, 3] => Some(Shape::Three),
            [2, 3] => Some(Shape::TwoByThree),
            _ => None,
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

impl Blocks {
    /// The pattern of compressed rows (`offsets` of each scalar row, ascending `columns`) in blocks
    /// of `size` rows and columns, 2x2, 3x3 or 2x3, with values zero; `None` where it is not made
    /// of whole blocks.
    pub fn of_pattern(size: [usize; 2], offsets: &[i32], columns: &[i32]) -> Option<Self> {
        let shape = Shape::of(size)?;
        let Pattern { rows, offsets, columns } = pattern_of(size, offsets, columns)?;
        let values = vec![0.0; columns.len() * size[0] * size[1] + BEYOND];
        Some(Blocks { shape, rows, offsets, columns, values })
    }

    /// Rounds the `values` of the compressed rows of [`Self::of_pattern`], the same `offsets`.
    pub fn fill(&mut self, offsets: &[i32], values: &[f64]) {
        by_shape!(self, fill_of[](offsets, values));
    }

    fn fill_of<const R: usize, const C: usize>(&mut self, offsets: &[i32], values: &[f64]) {
        for (k, range) in self.offsets.windows(2).enumerate() {
            let row = self.rows.as_ref().map_or(k, |rows| rows[k] as usize);
            let (first, end) = (range[0] as usize * R * C, range[1] as usize * R * C);
            let width = (end - first) / R;
            for r in 0..R {
                let start = offsets[row * R + r] as usize;
                let source = values[start..start + width].chunks_exact(C);
                let target = self.values[first..end].chunks_exact_mut(R * C);
                for (target, source) in target.zip(source) {
                    for (c, &value) in source.iter().enumerate() {
                        target[place::<R, C>(r, c)] = value as f32;
                    }
                }
            }
        }
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
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the processor has just said that it knows the instructions.
            return unsafe { avx2::run::<ADD>(self, x, y) };
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
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
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

/// Which blocks there are, as in [`Blocks`].
pub(super) struct Pattern {
    pub rows: Option<Vec<u32>>,
    pub offsets: Vec<u32>,
    pub columns: Vec<u32>,
}

impl Pattern {
    /// The block row behind the k-th one with entries.
    pub fn row(&self, k: usize) -> usize {
        self.rows.as_ref().map_or(k, |rows| rows[k] as usize)
    }
}

/// Compressed rows as blocks of `size` rows and columns; `None` where they are not.
pub(super) fn pattern_of(size: [usize; 2], offsets: &[i32], columns: &[i32]) -> Option<Pattern> {
    let [tall, wide] = size;
    let count = offsets.len().saturating_sub(1);
    if !count.is_multiple_of(tall) {
        return None;
    }
    let row = |r: usize| columns.get(offsets[r] as usize..offsets[r + 1] as usize);
    let mut rows = Vec::new();
    let (mut starts, mut blocks) = (vec![0], Vec::new());
    for first in (0..count).step_by(tall) {
        let pattern = row(first)?;
        for run in pattern.chunks(wide) {
            blocks.push(block_of(run, wide)? as u32);
        }
        if (1..tall).any(|k| row(first + k) != Some(pattern)) {
            return None;
        }
        if !pattern.is_empty() {
            rows.push((first / tall) as u32);
            starts.push(u32::try_from(blocks.len()).ok()?);
        }
    }
    let rows = (rows.len() < count / tall).then_some(rows);
    Some(Pattern { rows, offsets: starts, columns: blocks })
}

/// The block that `columns` are: `wide` in a row, from a multiple of it.
pub fn block_of(columns: &[i32], wide: usize) -> Option<usize> {
    let start = usize::try_from(*columns.first()?).ok()?;
    let whole = columns.len() == wide
        && start.is_multiple_of(wide)
        && columns.iter().zip(start..).all(|(&column, expected)| column as usize == expected);
    whole.then_some(start / wide)
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

/// a b + c, rounded once where the instruction set can.
#[inline(always)]
pub(super) fn multiply_add<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// Asks for what lies `ahead` bytes further on.
#[inline(always)]
pub(super) fn fetch<T>(here: *const T, ahead: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a hint that reads nothing, whatever the address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(here.cast::<i8>().wrapping_add(ahead)) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (here, ahead);
}

/// With AVX2 and fused multiply-add: a square of 2, or a column of a square of 3, in one vector.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{AHEAD, BEYOND, Blocks, Shape, fetch, store};
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx2,fma")]
    pub fn run<const ADD: bool>(blocks: &Blocks, x: &[f64], y: &mut [f64]) {
        match blocks.shape {
            Shape::Two => twos::<ADD>(blocks, x, y),
            Shape::Three => threes::<ADD>(blocks, x, y),
            Shape::TwoByThree => blocks.plain::<2, 3, ADD, true>(x, y),
        }
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn transposed(blocks: &Blocks, x: &[f64], y: &mut [f64]) {
        by_shape!(blocks, transposed[true](x, y));
    }

    #[target_feature(enable = "avx2,fma")]
    fn twos<const ADD: bool>(blocks: &Blocks, x: &[f64], y: &mut [f64]) {
        let (x, y) = (x.as_chunks::<2>().0, y.as_chunks_mut::<2>().0);
        let values = blocks.values.as_chunks::<4>().0;
        let term = |column: u32, block: &[f32; 4], sum: __m256d| {
            let x = &x[column as usize];
            // SAFETY: four values are there, and two.
            let (block, x) = unsafe { (_mm_loadu_ps(block.as_ptr()), _mm_loadu_pd(x.as_ptr())) };
            _mm256_fmadd_pd(_mm256_cvtps_pd(block), _mm256_set_m128d(x, x), sum)
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

    #[target_feature(enable = "avx2,fma")]
    fn threes<const ADD: bool>(blocks: &Blocks, x: &[f64], y: &mut [f64]) {
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
                    let column = unsafe { _mm_loadu_ps(block.as_ptr().add(3 * c)) };
                    let column = _mm256_cvtps_pd(column);
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
