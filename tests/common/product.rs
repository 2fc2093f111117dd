//! An assembled matrix times a vector.

use mpm_par::system::pattern::Pattern;
use mpm_par::system::scatter::BlockMatrix;

/// K x of one rank; `x` holds `D` values per local node.
pub fn product<const D: usize>(pattern: &Pattern, matrix: &BlockMatrix<D>, x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    for node in 0..x.len() / D {
        let row = pattern.row_of[node] as usize;
        let range = pattern.offsets[row]..pattern.offsets[row + 1];
        for i in 0..D {
            for (position, &column) in pattern.columns[range.clone()].iter().enumerate() {
                for k in 0..D {
                    let entry = D * D * range.start + (i * range.len() + position) * D + k;
                    out[node * D + i] += matrix.values[entry] * x[column as usize * D + k];
                }
            }
        }
    }
    out
}
