//! y = A x for a sparse A of square blocks, its values rounded to single precision: 4 bytes an
//! entry and 4 a block, where compressed rows take 12 an entry. Sums are in double precision.
//! For multigrid's smoothers, which have to be fixed and symmetric, not exact.

/// The rows of one rank, or the part of them that multiplies other ranks' unknowns.
#[derive(Debug, Clone)]
pub struct Blocks {
    /// Rows and columns of a block: 2 or 3.
    size: usize,
    /// Block rows with entries, where some have none.
    rows: Option<Vec<u32>>,
    /// First block of each row of `rows`, and the end.
    offsets: Vec<u32>,
    /// Block column of each block.
    columns: Vec<u32>,
    /// Blocks of 2 by rows, blocks of 3 by columns; then one value that is loaded and never used.
    values: Vec<f32>,
}

/// Loaded in fours, the last column of the last block reads one value beyond it.
const BEYOND: usize = 1;

impl Blocks {
    /// The pattern of compressed rows (`offsets` of each scalar row, ascending `columns`) in blocks
    /// of `size`, with values zero; `None` where it is not made of whole blocks.
    pub fn of_pattern(size: usize, offsets: &[i32], columns: &[i32]) -> Option<Self> {
        let count = offsets.len().saturating_sub(1);
        if !(2..=3).contains(&size) || !count.is_multiple_of(size) {
            return None;
        }
        let row = |r: usize| columns.get(offsets[r] as usize..offsets[r + 1] as usize);
        let mut rows = Vec::new();
        let (mut starts, mut blocks) = (vec![0], Vec::new());
        for first in (0..count).step_by(size) {
            let pattern = row(first)?;
            for run in pattern.chunks(size) {
                let start = run[0];
                let whole = run.len() == size
                    && start >= 0
                    && (start as usize).is_multiple_of(size)
                    && run.iter().zip(start..).all(|(&column, expected)| column == expected);
                if !whole {
                    return None;
                }
                blocks.push(start as u32 / size as u32);
            }
            if (1..size).any(|k| row(first + k) != Some(pattern)) {
                return None;
            }
            if !pattern.is_empty() {
                rows.push((first / size) as u32);
                starts.push(u32::try_from(blocks.len()).ok()?);
            }
        }
        let values = vec![0.0; blocks.len() * size * size + BEYOND];
        let rows = (rows.len() < count / size).then_some(rows);
        Some(Blocks { size, rows, offsets: starts, columns: blocks, values })
    }

    /// Rounds the `values` of the compressed rows of [`Self::of_pattern`], the same `offsets`.
    pub fn fill(&mut self, offsets: &[i32], values: &[f64]) {
        match self.size {
            2 => self.fill_of::<2>(offsets, values),
            _ => self.fill_of::<3>(offsets, values),
        }
    }

    fn fill_of<const B: usize>(&mut self, offsets: &[i32], values: &[f64]) {
        for (k, range) in self.offsets.windows(2).enumerate() {
            let row = self.rows.as_ref().map_or(k, |rows| rows[k] as usize);
            let (first, end) = (range[0] as usize * B * B, range[1] as usize * B * B);
            let width = (end - first) / B;
            for r in 0..B {
                let start = offsets[row * B + r] as usize;
                let source = values[start..start + width].chunks_exact(B);
                let target = self.values[first..end].chunks_exact_mut(B * B);
                for (target, source) in target.zip(source) {
                    for (c, &value) in source.iter().enumerate() {
                        target[place::<B>(r, c)] = value as f32;
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
        self.run_plain::<ADD>(x, y);
    }

    /// y = A x in the form without special instructions, which the other is tested against.
    #[doc(hidden)]
    pub fn multiply_plain(&self, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        self.run_plain::<true>(x, y);
    }

    fn run_plain<const ADD: bool>(&self, x: &[f64], y: &mut [f64]) {
        match self.size {
            2 => self.plain_of::<2, ADD>(x, y),
            _ => self.plain_of::<3, ADD>(x, y),
        }
    }

    fn plain_of<const B: usize, const ADD: bool>(&self, x: &[f64], y: &mut [f64]) {
        let (x, y) = (x.as_chunks::<B>().0, y.as_chunks_mut::<B>().0);
        for (k, range) in self.offsets.windows(2).enumerate() {
            let blocks = range[0] as usize..range[1] as usize;
            let values = self.values[blocks.start * B * B..].chunks_exact(B * B);
            let mut sums = [0.0; B];
            for (&column, block) in self.columns[blocks].iter().zip(values) {
                let x = &x[column as usize];
                for r in 0..B {
                    for c in 0..B {
                        sums[r] += f64::from(block[place::<B>(r, c)]) * x[c];
                    }
                }
            }
            store::<B, ADD>(&mut y[self.row(k)], sums);
        }
    }

    /// The block row behind the k-th stored one.
    #[inline(always)]
    fn row(&self, k: usize) -> usize {
        self.rows.as_ref().map_or(k, |rows| rows[k] as usize)
    }
}

/// Where a block keeps its entry (r, c).
#[inline(always)]
fn place<const B: usize>(r: usize, c: usize) -> usize {
    if B == 2 { r * B + c } else { c * B + r }
}

#[inline(always)]
fn store<const B: usize, const ADD: bool>(target: &mut [f64; B], sums: [f64; B]) {
    for (target, sum) in target.iter_mut().zip(sums) {
        *target = if ADD { *target + sum } else { sum };
    }
}

/// With AVX2 and fused multiply-add: a block of 2, or a column of a block of 3, in one vector.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{BEYOND, Blocks, store};
    use std::arch::x86_64::*;

    /// Bytes of values between what is used and what is asked for: the rows are too short for the
    /// processor to foresee the next ones.
    const AHEAD: usize = 8192;

    #[target_feature(enable = "avx2,fma")]
    pub fn run<const ADD: bool>(blocks: &Blocks, x: &[f64], y: &mut [f64]) {
        match blocks.size {
            2 => twos::<ADD>(blocks, x, y),
            _ => threes::<ADD>(blocks, x, y),
        }
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
            fetch(columns, AHEAD / 4);
            let (columns, last_column) = columns.as_chunks::<2>();
            let (values, last) = values.as_chunks::<2>();
            let mut sums = [_mm256_setzero_pd(); 2];
            for (columns, values) in columns.iter().zip(values) {
                fetch(values, AHEAD);
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
            fetch(columns, AHEAD / 9);
            let mut sums = [_mm256_setzero_pd(); 3];
            for (&column, block) in columns.iter().zip(values.windows(9 + BEYOND).step_by(9)) {
                fetch(block, AHEAD);
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

    /// Asks for what lies `ahead` bytes further on.
    #[inline(always)]
    fn fetch<T>(here: &[T], ahead: usize) {
        // SAFETY: a hint that reads nothing, whatever the address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(here.as_ptr().cast::<i8>().wrapping_add(ahead)) };
    }
}
