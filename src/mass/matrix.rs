//! M = Σ_p m S^T S (Ghost eq. 7), its row sums Σ_p m S (eq. 15), and M~ = M + gamma_M J (eq. 24).
//!
//! All are scalar, the same for each component: M ⊗ 1. The entries of M_G sum to zero, so the
//! stabilised matrix has the mass and the momentum of the plain one.

use std::ops::Range;

use crate::error::Result;
use crate::parallel::World;

use crate::system::pattern::Pattern;
use crate::system::scatter::{BlockMatrix, add_support};
use crate::system::terms::stress::StepPoints;

/// Row sums at the local nodes; ghost shares are not yet sent to their owners. kg
pub fn lumped<const D: usize>(step: StepPoints<'_, D>, nodes: usize) -> Vec<f64> {
    let mut mass = vec![0.0; nodes];
    add_lumped(step, 0..step.points.len(), &mut mass);
    mass
}

/// Adds [`lumped`] of some of the points.
pub fn add_lumped<const D: usize>(step: StepPoints<'_, D>, part: Range<usize>, mass: &mut [f64]) {
    for p in part {
        let weights = &step.influences.weights[step.influences.row(p)];
        for (&node, weight) in step.nodes_of(p).iter().zip(weights) {
            mass[node as usize] += weight * step.points.mass[p];
        }
    }
}

/// The consistent matrix in its owners' rows, one dense block per group of points. Collective.
pub fn consistent<const D: usize>(
    world: &World,
    step: StepPoints<'_, D>,
    pattern: &Pattern,
) -> Result<BlockMatrix<1>> {
    let mut matrix = BlockMatrix::zeros(pattern);
    let mut block = Vec::new();
    for group in 0..step.groups.len() {
        let nodes = step.nodes_of_group(group);
        let count = nodes.len();
        block.clear();
        block.resize(count * count, 0.0);
        for &p in step.groups.points(group) {
            let weights = &step.influences.weights[step.influences.row(p)];
            for (row, weight) in block.chunks_exact_mut(count).zip(weights) {
                let factor = step.points.mass[p] * weight;
                for (entry, other) in row.iter_mut().zip(weights) {
                    *entry += factor * other;
                }
            }
        }
        add_support(&mut matrix, pattern, group, &block);
    }
    matrix.reduce(world, pattern);
    Ok(matrix)
}

/// y = (A ⊗ 1) x over the owned rows; `x` holds `D` values per local node.
pub fn multiply<const D: usize>(
    matrix: &BlockMatrix<1>,
    pattern: &Pattern,
    x: &[f64],
    y: &mut [f64],
) {
    multiply_rows::<D>(matrix, pattern, 0..y.len() / D, x, y);
}

/// [`multiply`] for some of the rows; `y` holds all owned ones.
pub fn multiply_rows<const D: usize>(
    matrix: &BlockMatrix<1>,
    pattern: &Pattern,
    rows: Range<usize>,
    x: &[f64],
    y: &mut [f64],
) {
    let (x, _) = x.as_chunks::<D>();
    let (y, _) = y.as_chunks_mut::<D>();
    let ranges = pattern.offsets[rows.start..=rows.end].windows(2);
    for (out, range) in y[rows].iter_mut().zip(ranges) {
        let range = range[0]..range[1];
        let mut sum = [0.0; D];
        for (&column, value) in pattern.columns[range.clone()].iter().zip(&matrix.values[range]) {
            let x = &x[column as usize];
            for k in 0..D {
                sum[k] += value * x[k];
            }
        }
        *out = sum;
    }
}

/// Sum of each owned row.
pub fn row_sums(matrix: &BlockMatrix<1>, pattern: &Pattern, owned: usize) -> Vec<f64> {
    (0..owned)
        .map(|row| matrix.values[pattern.offsets[row]..pattern.offsets[row + 1]].iter().sum())
        .collect()
}

/// x^T (A ⊗ 1) x of this rank's rows; `x` holds `D` values per local node.
pub fn quadratic_form<const D: usize>(
    matrix: &BlockMatrix<1>,
    pattern: &Pattern,
    owned: usize,
    x: &[f64],
) -> f64 {
    let mut product = vec![0.0; owned * D];
    multiply::<D>(matrix, pattern, x, &mut product);
    product.iter().zip(x).map(|(a, b)| a * b).sum()
}
