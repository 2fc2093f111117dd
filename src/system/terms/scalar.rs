//! Terms J ⊗ 1 u: linear in the displacement and the same in every direction.

use crate::system::pattern::Pattern;
use crate::system::scatter::BlockMatrix;

/// size += |J| |u| with the norms `moved` of local nodes.
pub(super) fn add_sizes(
    scalar: &BlockMatrix<1>,
    pattern: &Pattern,
    moved: &[f64],
    size: &mut [f64],
) {
    for (row, size) in size.iter_mut().enumerate() {
        let entries = pattern.offsets[row]..pattern.offsets[row + 1];
        *size += entries
            .map(|entry| scalar.values[entry].abs() * moved[pattern.columns[entry] as usize])
            .sum::<f64>();
    }
}

/// force += (J ⊗ 1) u in one row.
#[inline]
pub(super) fn add_row_product<const D: usize>(
    scalar: &BlockMatrix<1>,
    pattern: &Pattern,
    displacement: &[f64],
    row: usize,
    force: &mut [f64],
) {
    for entry in pattern.offsets[row]..pattern.offsets[row + 1] {
        let (value, column) = (scalar.values[entry], pattern.columns[entry] as usize);
        for i in 0..D {
            force[row * D + i] += value * displacement[column * D + i];
        }
    }
}
