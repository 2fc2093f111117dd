//! M = Σ_p m S^T S (Ghost eq. 7), its row sums Σ_p m S (eq. 15), and M~ = M + gamma_M J (eq. 24).
//!
//! All are scalar, the same for each component: M ⊗ 1. The entries of M_G sum to zero, so the
//! stabilised matrix has the mass and the momentum of the plain one.
//!
//! A point may fly alone: no other point reaches any of its nodes. Its part of M has rank one, and Ghost does not
//! help, as it leaves motions alone that are linear over the cells. The row sums on the diagonal take the place of
//! this part, and the nodes move as the point does.

use std::ops::Range;

use crate::error::Result;
use crate::parallel::World;

use crate::parallel::HaloPlan;
use crate::system::pattern::Pattern;
use crate::system::scatter::{BlockMatrix, add_support};
use crate::system::step_points::StepPoints;

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

/// Groups of one point whose nodes no other group reaches, in order; `nodes`: local ones, with their `halo`.
/// Collective.
fn alone<const D: usize>(
    world: &World,
    step: StepPoints<'_, D>,
    halo: &HaloPlan,
    nodes: usize,
) -> Result<Vec<usize>> {
    let groups = step.groups.len();
    let single = |group: &usize| step.groups.points(*group).len() == 1;
    if !world.any((0..groups).any(|group| single(&group))) {
        return Ok(Vec::new());
    }
    let mut reached = vec![0.0; nodes];
    for group in 0..groups {
        for &node in step.nodes_of_group(group) {
            reached[node as usize] += 1.0;
        }
    }
    halo.reverse_add(world, &mut reached, 1)?;
    halo.forward(world, &mut reached, 1)?;
    let free = |group: &usize| {
        step.nodes_of_group(*group).iter().all(|&node| reached[node as usize] == 1.0)
    };
    Ok((0..groups).filter(|group| single(group) && free(group)).collect())
}

/// The consistent matrix in its owners' rows, one dense block per group of points. `nodes`: local ones, with
/// their `halo`. Collective.
pub fn consistent<const D: usize>(
    world: &World,
    step: StepPoints<'_, D>,
    pattern: &Pattern,
    (halo, nodes): (&HaloPlan, usize),
) -> Result<BlockMatrix<1>> {
    let alone = alone(world, step, halo, nodes)?;
    let mut alone = alone.iter().peekable();
    let mut matrix = BlockMatrix::zeros(pattern);
    let mut block = Vec::new();
    for group in 0..step.groups.len() {
        let nodes = step.nodes_of_group(group);
        let count = nodes.len();
        block.clear();
        block.resize(count * count, 0.0);
        if alone.next_if_eq(&&group).is_some() {
            let p = step.groups.points(group)[0];
            let weights = &step.influences.weights[step.influences.row(p)];
            for (entry, weight) in block.iter_mut().step_by(count + 1).zip(weights) {
                *entry = step.points.mass[p] * weight;
            }
            add_support(&mut matrix, pattern, group, &block);
            continue;
        }
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
