//! A = L L^T within the envelope of a small symmetric positive definite matrix: each row is
//! stored from its first entry to the diagonal, where all fill stays.

use crate::system::pattern::Pattern;
use crate::system::scatter::BlockMatrix;

/// The factor of a matrix whose rows all live on one rank.
#[derive(Debug, Clone)]
pub struct Envelope {
    /// First column of each row.
    first: Vec<u32>,
    /// Row r is `starts[r]..starts[r + 1]` of `values`, its last entry the diagonal.
    starts: Vec<usize>,
    values: Vec<f64>,
}

/// Operations of a factorisation: the sum of the squared lengths of the rows.
pub fn cost(pattern: &Pattern, rows: usize) -> f64 {
    (0..rows).map(|row| (row - first_column(pattern, row) + 1).pow(2) as f64).sum()
}

fn first_column(pattern: &Pattern, row: usize) -> usize {
    pattern.columns[pattern.offsets[row]] as usize
}

impl Envelope {
    /// Factors the matrix with the rows and columns of the nodes that are not `free` replaced
    /// by the identity. Error: the row whose pivot is not positive.
    pub fn factor(
        matrix: &BlockMatrix<1>,
        pattern: &Pattern,
        free: &[bool],
    ) -> Result<Self, usize> {
        let rows = free.len();
        let mut first = Vec::with_capacity(rows);
        let mut starts = Vec::with_capacity(rows + 1);
        starts.push(0);
        for row in 0..rows {
            let start = if free[row] { first_column(pattern, row) } else { row };
            first.push(start as u32);
            starts.push(starts[row] + row - start + 1);
        }
        let mut values = vec![0.0; starts[rows]];
        for row in 0..rows {
            let offset = starts[row + 1] - row - 1;
            if !free[row] {
                values[offset + row] = 1.0;
                continue;
            }
            for entry in pattern.offsets[row]..pattern.offsets[row + 1] {
                let column = pattern.columns[entry] as usize;
                if column <= row && free[column] {
                    values[offset + column] = matrix.values[entry];
                }
            }
        }
        let mut factor = Envelope { first, starts, values };
        for row in 0..rows {
            factor.eliminate(row)?;
        }
        Ok(factor)
    }

    fn eliminate(&mut self, row: usize) -> Result<(), usize> {
        let (done, rest) = self.values.split_at_mut(self.starts[row]);
        let begin = self.first[row] as usize;
        let entries = &mut rest[..row - begin + 1];
        for column in begin..row {
            let other_begin = self.first[column] as usize;
            let other = &done[self.starts[column]..self.starts[column + 1]];
            let from = begin.max(other_begin);
            let product: f64 = entries[from - begin..column - begin]
                .iter()
                .zip(&other[from - other_begin..])
                .map(|(a, b)| a * b)
                .sum();
            let pivot = other[column - other_begin];
            entries[column - begin] = (entries[column - begin] - product) / pivot;
        }
        let (below, diagonal) = entries.split_at_mut(row - begin);
        let pivot = diagonal[0] - below.iter().map(|a| a * a).sum::<f64>();
        if pivot > 0.0 && pivot.is_finite() {
            diagonal[0] = pivot.sqrt();
            Ok(())
        } else {
            Err(row)
        }
    }

    /// Replaces component `k` of `x`, `width` values per node, by that of A^-1 x.
    pub fn solve(&self, x: &mut [f64], width: usize, k: usize) {
        let rows = self.first.len();
        for row in 0..rows {
            let begin = self.first[row] as usize;
            let entries = &self.values[self.starts[row]..self.starts[row + 1]];
            let mut sum = x[row * width + k];
            for (column, value) in (begin..row).zip(entries) {
                sum -= value * x[column * width + k];
            }
            x[row * width + k] = sum / entries[row - begin];
        }
        for row in (0..rows).rev() {
            let begin = self.first[row] as usize;
            let entries = &self.values[self.starts[row]..self.starts[row + 1]];
            let value = x[row * width + k] / entries[row - begin];
            x[row * width + k] = value;
            for (column, entry) in (begin..row).zip(entries) {
                x[column * width + k] -= entry * value;
            }
        }
    }
}
