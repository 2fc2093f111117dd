//! A = L L^T with all fill: the complete factor of a small mass on one rank.
//!
//! A row is kept from its first entry on, where all its fill stays. It is stored in chunks of eight columns that
//! begin at multiples of eight, with zeros at the diagonal and beyond, so that two rows meet chunk by chunk.

use crate::system::pattern::Pattern;
use crate::system::scatter::BlockMatrix;
#[cfg(target_arch = "x86_64")]
use crate::tensor::fused::has_avx2;
use crate::tensor::fused::multiply_add;

/// Columns of a chunk. Values to be solved for need room up to a multiple of it.
pub const WIDTH: usize = 8;
type Chunk = [f64; WIDTH];

/// Products of the factorisation per stored entry of the matrix, below which it costs less than iterations.
const FEW_PRODUCTS: f64 = 60.0;
/// A pivot below this share of its diagonal entry may be nothing but round-off.
const LEAST_PIVOT: f64 = 1e-12;
/// With all pivots above this share of their diagonal entries one application solves to round-off.
const SOUND_PIVOT: f64 = 1e-3;

/// One factor for each distinct set of nodes to be solved for.
pub struct Complete {
    factors: Vec<Envelope>,
    /// The factor of each component.
    of: Vec<usize>,
}

impl Complete {
    /// `free`: of the components of all nodes, `components` a node; rows and columns of the others are those of the
    /// identity. `None`: it would cost too much, or a pivot is lost.
    pub fn factor(
        matrix: &BlockMatrix<1>,
        pattern: &Pattern,
        (free, components): (&[bool], usize),
    ) -> Option<Self> {
        let rows = free.len() / components;
        let mut masks: Vec<Vec<bool>> = Vec::new();
        let of = (0..components)
            .map(|k| {
                let mask: Vec<bool> = free.iter().skip(k).step_by(components).copied().collect();
                masks.iter().position(|other| *other == mask).unwrap_or_else(|| {
                    masks.push(mask);
                    masks.len() - 1
                })
            })
            .collect();
        let products = masks.len() as f64 * products(pattern, rows);
        if products > FEW_PRODUCTS * pattern.ghost_start as f64 {
            return None;
        }
        let factors = masks.iter().map(|mask| Envelope::factor(matrix, pattern, mask));
        Some(Complete { factors: factors.collect::<Option<_>>()?, of })
    }

    /// Whether one application leaves no more than round-off.
    pub fn is_sound(&self) -> bool {
        self.factors.iter().all(|factor| factor.least_pivot >= SOUND_PIVOT)
    }

    /// x = A^-1 x. Columns belong to the components in turn, again and again. `x`: a row for each node, and room up
    /// to a multiple of [`WIDTH`] rows, where any number may stand.
    pub fn solve<const C: usize>(&self, x: &mut [[f64; C]]) {
        if let [only] = &self.factors[..] {
            return only.solve(x);
        }
        for k in 0..C {
            let mut column: Vec<[f64; 1]> = x.iter().map(|x| [x[k]]).collect();
            self.factors[self.of[k % self.of.len()]].solve(&mut column);
            for (x, [solved]) in x.iter_mut().zip(column) {
                x[k] = solved;
            }
        }
    }
}

/// The sum of the squared lengths of the rows.
fn products(pattern: &Pattern, rows: usize) -> f64 {
    (0..rows).map(|row| (row - first_column(pattern, row) + 1).pow(2) as f64).sum()
}

fn first_column(pattern: &Pattern, row: usize) -> usize {
    pattern.columns[pattern.offsets[row]] as usize
}

/// L of a matrix whose rows all live on one rank.
struct Envelope {
    rows: Vec<Row>,
    chunks: Vec<Chunk>,
    /// The least pivot over its diagonal entry.
    least_pivot: f64,
}

#[derive(Clone, Copy)]
struct Row {
    /// First chunk of columns.
    first: u32,
    /// Where it is stored.
    start: u32,
    /// One over the diagonal.
    inverse: f64,
}

impl Envelope {
    /// `None`: a pivot is lost.
    fn factor(matrix: &BlockMatrix<1>, pattern: &Pattern, free: &[bool]) -> Option<Self> {
        let (mut rows, mut count) = (Vec::with_capacity(free.len()), 0);
        for (row, free) in free.iter().enumerate() {
            let first = if *free { first_column(pattern, row) } else { row } / WIDTH;
            rows.push(Row { first: first as u32, start: count, inverse: 1.0 });
            count += (row / WIDTH - first + 1) as u32;
        }
        let mut factor =
            Envelope { rows, chunks: vec![[0.0; WIDTH]; count as usize], least_pivot: 1.0 };
        for row in (0..free.len()).filter(|&row| free[row]) {
            let Row { first, start, .. } = factor.rows[row];
            let mut diagonal = 0.0;
            for entry in pattern.offsets[row]..pattern.offsets[row + 1] {
                let (column, value) = (pattern.columns[entry] as usize, matrix.values[entry]);
                if column == row {
                    diagonal = value;
                } else if column < row && free[column] {
                    let chunk = start as usize + column / WIDTH - first as usize;
                    factor.chunks[chunk][column % WIDTH] = value;
                }
            }
            let pivot = diagonal - factor.eliminate(row);
            if !(pivot > LEAST_PIVOT * diagonal) {
                return None;
            }
            factor.least_pivot = factor.least_pivot.min(pivot / diagonal);
            factor.rows[row].inverse = 1.0 / pivot.sqrt();
        }
        Some(factor)
    }

    /// Turns a row of A into that of L; returns the sum of its squares.
    fn eliminate(&mut self, row: usize) -> f64 {
        #[cfg(target_arch = "x86_64")]
        if has_avx2() {
            // SAFETY: the processor has just said that it knows the instructions.
            return unsafe { eliminate_avx2(&self.rows, &mut self.chunks, row) };
        }
        eliminate_in::<false>(&self.rows, &mut self.chunks, row)
    }

    fn solve<const C: usize>(&self, x: &mut [[f64; C]]) {
        #[cfg(target_arch = "x86_64")]
        if has_avx2() {
            // SAFETY: as above.
            return unsafe { solve_avx2(&self.rows, &self.chunks, x) };
        }
        solve_in::<C, false>(&self.rows, &self.chunks, x);
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn eliminate_avx2(rows: &[Row], chunks: &mut [Chunk], row: usize) -> f64 {
    eliminate_in::<true>(rows, chunks, row)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn solve_avx2<const C: usize>(rows: &[Row], chunks: &[Chunk], x: &mut [[f64; C]]) {
    solve_in::<C, true>(rows, chunks, x);
}

#[inline(always)]
fn eliminate_in<const FUSED: bool>(rows: &[Row], chunks: &mut [Chunk], row: usize) -> f64 {
    let Row { first, start, .. } = rows[row];
    let (first, last) = (first as usize, row / WIDTH);
    let (done, rest) = chunks.split_at_mut(start as usize);
    let own = &mut rest[..=last - first];
    for chunk in first..=last {
        for column in chunk * WIDTH..row.min((chunk + 1) * WIDTH) {
            let other = rows[column];
            let from = first.max(other.first as usize);
            let begin = other.start as usize + from - other.first as usize;
            let sum = dot::<FUSED>(&own[from - first..=chunk - first], &done[begin..]);
            let value = &mut own[chunk - first][column % WIDTH];
            *value = (*value - sum) * other.inverse;
        }
    }
    dot::<FUSED>(own, own)
}

/// Σ a b over the chunks of `a`.
#[inline(always)]
fn dot<const FUSED: bool>(a: &[Chunk], b: &[Chunk]) -> f64 {
    let mut sums = [0.0; WIDTH];
    for (a, b) in a.iter().zip(b) {
        for k in 0..WIDTH {
            sums[k] = multiply_add::<FUSED>(a[k], b[k], sums[k]);
        }
    }
    let four: [f64; 4] = std::array::from_fn(|k| sums[k] + sums[k + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}

#[inline(always)]
fn solve_in<const C: usize, const FUSED: bool>(rows: &[Row], chunks: &[Chunk], x: &mut [[f64; C]]) {
    let places = |row: usize| {
        let Row { first, start, .. } = rows[row];
        let count = row / WIDTH - first as usize + 1;
        (start as usize..start as usize + count, first as usize..first as usize + count)
    };
    for (row, Row { inverse, .. }) in rows.iter().enumerate() {
        let (stored, columns) = places(row);
        let mut sum = x[row];
        for (chunk, x) in chunks[stored].iter().zip(&x.as_chunks::<WIDTH>().0[columns]) {
            for (l, x) in chunk.iter().zip(x) {
                for k in 0..C {
                    sum[k] = multiply_add::<FUSED>(-l, x[k], sum[k]);
                }
            }
        }
        x[row] = sum.map(|sum| sum * inverse);
    }
    for (row, Row { inverse, .. }) in rows.iter().enumerate().rev() {
        let (stored, columns) = places(row);
        let solved = x[row].map(|x| x * inverse);
        x[row] = solved;
        for (chunk, x) in chunks[stored].iter().zip(&mut x.as_chunks_mut::<WIDTH>().0[columns]) {
            for (l, x) in chunk.iter().zip(x) {
                for k in 0..C {
                    x[k] = multiply_add::<FUSED>(-l, solved[k], x[k]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A symmetric matrix of `rows` rows with its pattern.
    fn system(rows: usize, entry: impl Fn(usize, usize) -> f64) -> (BlockMatrix<1>, Pattern) {
        let mut pattern = Pattern { offsets: vec![0], ..Pattern::default() };
        let mut values = Vec::new();
        for row in 0..rows {
            for column in (0..rows).filter(|&column| entry(row, column) != 0.0) {
                pattern.columns.push(column as u32);
                values.push(entry(row, column));
            }
            pattern.offsets.push(pattern.columns.len());
        }
        pattern.ghost_start = values.len();
        (BlockMatrix { values }, pattern)
    }

    /// Rows that begin early and late, so that fill and chunks of all shapes occur.
    fn ragged(row: usize, column: usize) -> f64 {
        match row.abs_diff(column) {
            0 => 3.0 + 0.1 * row as f64,
            1 => 0.7,
            9 if row.max(column).is_multiple_of(3) => -0.4,
            11 => 0.2,
            _ => 0.0,
        }
    }

    #[test]
    fn components_with_held_nodes_of_their_own_are_solved_for() {
        let rows = 45;
        let (matrix, pattern) = system(rows, ragged);
        for held in [[false; 2], [true; 2], [true, false]] {
            let is_free = |row: usize, k: usize| !(held[k] && row.is_multiple_of(5 + k));
            let free: Vec<bool> = (0..2 * rows).map(|dof| is_free(dof / 2, dof % 2)).collect();
            let factor = Complete::factor(&matrix, &pattern, (&free, 2)).unwrap();
            assert!(factor.is_sound());
            let x = |row: usize, k: usize| ((row * 4 + k) as f64).sin() + 2.0;
            let product = |row: usize, k: usize| -> f64 {
                if !is_free(row, k % 2) {
                    return x(row, k);
                }
                let columns = (0..rows).filter(|&column| is_free(column, k % 2));
                columns.map(|column| ragged(row, column) * x(column, k)).sum()
            };
            let mut solved: Vec<[f64; 4]> =
                (0..rows).map(|row| std::array::from_fn(|k| product(row, k))).collect();
            solved.resize(rows.next_multiple_of(WIDTH), [7.0; 4]);
            factor.solve(&mut solved);
            for row in 0..rows {
                for k in 0..4 {
                    assert!((solved[row][k] - x(row, k)).abs() < 1e-13, "{row} {k}");
                }
            }
        }
    }

    /// Two rows that are equal but for `apart`: the second pivot is about twice as much.
    #[test]
    fn a_pivot_that_is_nearly_lost_is_told() {
        let nearly = |apart: f64| {
            let (matrix, pattern) =
                system(2, move |row, column| if row == column { 1.0 } else { 1.0 - apart });
            let factor = Complete::factor(&matrix, &pattern, (&[true; 2], 1));
            factor.map(|factor| factor.is_sound())
        };
        assert_eq!(nearly(1e-2), Some(true));
        assert_eq!(nearly(1e-5), Some(false));
        assert_eq!(nearly(1e-13), None);
        assert_eq!(nearly(0.0), None);
    }
}
