//! P = L L^T ~ M on the sparsity of M (Cholesky without fill): the preconditioner of the mass.
//!
//! The mass is well conditioned but for cut cells, whose few small values the factor takes up.
//! Couplings to nodes of other ranks are left out. It serves lattices and meshes alike.

use super::{BlockMatrix, Pattern};

/// A row whose pivot would fall below this share of its diagonal entry stands alone instead.
const LEAST_PIVOT: f64 = 1e-3;

/// The factor of one rank's rows.
pub struct Incomplete {
    /// Below the diagonal, row r is `starts[r]..starts[r + 1]` of `columns` and `values`.
    starts: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<f64>,
    /// One over the diagonal of L; zero in rows without mass.
    inverse_diagonal: Vec<f64>,
}

impl Incomplete {
    /// `diagonal`: of the owned rows of `matrix`, not negative; rows where it is zero are left
    /// out.
    pub fn factor(matrix: &BlockMatrix<1>, pattern: &Pattern, diagonal: &[f64]) -> Self {
        let rows = diagonal.len();
        let entries = pattern.ghost_start / 2;
        let mut factor = Incomplete {
            starts: Vec::with_capacity(rows + 1),
            columns: Vec::with_capacity(entries),
            values: Vec::with_capacity(entries),
            inverse_diagonal: Vec::with_capacity(rows),
        };
        factor.starts.push(0);
        // The row being made, spread out over all columns.
        let mut spread = vec![0.0; rows];
        for row in 0..rows {
            let begin = factor.columns.len();
            if diagonal[row] > 0.0 {
                for entry in pattern.offsets[row]..pattern.offsets[row + 1] {
                    let column = pattern.columns[entry];
                    if (column as usize) < row && diagonal[column as usize] > 0.0 {
                        factor.columns.push(column);
                        factor.values.push(matrix.values[entry]);
                    }
                }
            }
            let pivot = diagonal[row] - factor.eliminate(begin, &mut spread);
            let sound = pivot > LEAST_PIVOT * diagonal[row];
            if !sound {
                factor.columns.truncate(begin);
                factor.values.truncate(begin);
            }
            let pivot = if sound { pivot } else { diagonal[row] };
            factor.inverse_diagonal.push(if pivot > 0.0 { 1.0 / pivot.sqrt() } else { 0.0 });
            factor.starts.push(factor.columns.len() as u32);
        }
        factor
    }

    /// Turns the entries from `begin` on, those of the newest row of M, into that row of L;
    /// returns the sum of their squares. `spread` is zero before and after.
    fn eliminate(&mut self, begin: usize, spread: &mut [f64]) -> f64 {
        let mut squares = 0.0;
        for at in begin..self.columns.len() {
            let column = self.columns[at] as usize;
            let range = self.starts[column] as usize..self.starts[column + 1] as usize;
            let mut value = self.values[at];
            for (&other, l) in self.columns[range.clone()].iter().zip(&self.values[range]) {
                value -= spread[other as usize] * l;
            }
            value *= self.inverse_diagonal[column];
            self.values[at] = value;
            spread[column] = value;
            squares += value * value;
        }
        for &column in &self.columns[begin..] {
            spread[column as usize] = 0.0;
        }
        squares
    }

    /// z = P^-1 r where `free`, else zero, for `C` right-hand sides side by side; returns r·z of
    /// each over this rank's rows.
    pub fn apply<const C: usize>(
        &self,
        r: &[[f64; C]],
        free: &[[bool; C]],
        z: &mut [[f64; C]],
    ) -> [f64; C] {
        let row_of = |row: usize| self.starts[row] as usize..self.starts[row + 1] as usize;
        for (row, right) in r.iter().enumerate() {
            let mut sum = *right;
            for (&column, l) in self.columns[row_of(row)].iter().zip(&self.values[row_of(row)]) {
                let solved = &z[column as usize];
                for k in 0..C {
                    sum[k] -= l * solved[k];
                }
            }
            let weight = self.inverse_diagonal[row];
            z[row] = sum.map(|sum| sum * weight);
        }
        let mut products = [0.0; C];
        for (row, (right, free)) in r.iter().zip(free).enumerate().rev() {
            let weight = self.inverse_diagonal[row];
            let solved = z[row].map(|z| z * weight);
            for (&column, l) in self.columns[row_of(row)].iter().zip(&self.values[row_of(row)]) {
                let target = &mut z[column as usize];
                for k in 0..C {
                    target[k] -= l * solved[k];
                }
            }
            // Later rows have taken this value already: it can be masked.
            for k in 0..C {
                z[row][k] = if free[k] { solved[k] } else { 0.0 };
                products[k] += right[k] * z[row][k];
            }
        }
        products
    }
}

#[cfg(test)]
mod tests {
    use super::Incomplete;
    use crate::assembly::{BlockMatrix, Pattern};

    /// A pattern of one rank with the given entries (row, column, value), each row ascending.
    fn system(rows: usize, entry: impl Fn(usize, usize) -> f64) -> (BlockMatrix<1>, Pattern) {
        let mut pattern = Pattern { offsets: vec![0], ..Pattern::default() };
        let mut values = Vec::new();
        for row in 0..rows {
            for column in 0..rows {
                let value = entry(row, column);
                if value != 0.0 {
                    pattern.columns.push(column as u32);
                    values.push(value);
                }
            }
            pattern.offsets.push(pattern.columns.len());
        }
        pattern.ghost_start = values.len();
        (BlockMatrix { values }, pattern)
    }

    fn solved(rows: usize, entry: impl Fn(usize, usize) -> f64) -> Vec<[f64; 2]> {
        let (matrix, pattern) = system(rows, &entry);
        let diagonal: Vec<f64> = (0..rows).map(|row| entry(row, row)).collect();
        let factor = Incomplete::factor(&matrix, &pattern, &diagonal);
        let x = field(rows);
        let b: Vec<[f64; 2]> = (0..rows)
            .map(|row| {
                let of = |k: usize| (0..rows).map(|j| entry(row, j) * x[j][k]).sum();
                [of(0), of(1)]
            })
            .collect();
        let mut z = vec![[0.0; 2]; rows];
        let products = factor.apply(&b, &vec![[true; 2]; rows], &mut z);
        for k in 0..2 {
            let dot: f64 = b.iter().zip(&z).map(|(b, z)| b[k] * z[k]).sum();
            assert!((dot - products[k]).abs() < 1e-12 * dot.abs());
        }
        z
    }

    fn field(rows: usize) -> Vec<[f64; 2]> {
        (0..rows).map(|i| [1.0 + i as f64, (i as f64).cos()]).collect()
    }

    #[test]
    fn a_band_without_fill_is_inverted() {
        let band = |row: usize, column: usize| match row.abs_diff(column) {
            0 => 1.0 + 0.1 * row as f64,
            1 => 0.4,
            2 => 0.1,
            _ => 0.0,
        };
        for (z, x) in solved(9, band).iter().zip(field(9)) {
            assert!((z[0] - x[0]).abs() < 1e-13 && (z[1] - x[1]).abs() < 1e-13);
        }
    }

    #[test]
    fn rows_without_mass_and_rows_without_pivot_stand_alone() {
        // Row 1 is empty; rows 2 and 3 are linearly dependent.
        let entry = |row: usize, column: usize| match (row.min(column), row.max(column)) {
            (1, _) | (_, 1) => 0.0,
            (2, 3) => 2.0,
            (i, j) if i == j => 2.0,
            _ => 0.0,
        };
        let z = solved(4, entry);
        let x = field(4);
        assert_eq!(z[1], [0.0; 2]);
        assert!((z[0][0] - x[0][0]).abs() < 1e-15);
        for k in 0..2 {
            assert!((z[3][k] - (x[2][k] + x[3][k])).abs() < 1e-14);
        }
    }
}
