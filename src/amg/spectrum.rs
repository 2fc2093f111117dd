//! The largest eigenvalue of D^-1 A, with A's diagonal D, by Lanczos' method.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::blocks::BlockProduct;
use crate::error::Result;
use crate::parallel::World;

use super::level::Nodes;

/// Products with A. The estimate is a few per cent low, which its users allow for.
const STEPS: usize = 10;

/// `inverse`: one over the diagonal, zero where that is not positive. Zero for an empty matrix.
/// Collective.
pub fn largest<const K: usize>(
    world: &World,
    nodes: &Nodes,
    product: &BlockProduct<f32>,
    inverse: &[f64],
) -> Result<f64> {
    let owned = nodes.owned * K;
    let root: Vec<f64> = inverse.iter().map(|value| value.sqrt()).collect();
    // Noise, for all eigenvectors to take part; that of a node does not depend on its rank.
    let mut v: Vec<f64> = (0..owned)
        .map(|row| {
            let noise = (nodes.key[row / K] * (row % K + 1) as f64 * 9973.0).fract() - 0.5;
            if root[row] > 0.0 { noise } else { 0.0 }
        })
        .collect();
    let dot = |a: &[f64], b: &[f64]| world.sum(a.iter().zip(b).map(|(a, b)| a * b).sum());
    let mut beta = dot(&v, &v).sqrt();
    let (mut before, mut x) = (vec![0.0; owned], vec![0.0; nodes.local() * K]);
    let mut w = vec![0.0; owned];
    let (mut diagonal, mut beside) = (Vec::new(), Vec::new());
    let smallest = beta * 1e-12;
    while diagonal.len() < STEPS && beta > smallest {
        v.iter_mut().for_each(|v| *v /= beta);
        for (x, (v, root)) in x.iter_mut().zip(v.iter().zip(&root)) {
            *x = v * root;
        }
        nodes.halo.forward(world, &mut x, K)?;
        product.multiply_local(&x, &mut w);
        for (row, w) in w.iter_mut().enumerate() {
            *w = *w * root[row] - beta * before[row];
        }
        let alpha = dot(&w, &v);
        for (w, v) in w.iter_mut().zip(&v) {
            *w -= alpha * v;
        }
        diagonal.push(alpha);
        std::mem::swap(&mut before, &mut v);
        std::mem::swap(&mut v, &mut w);
        beta = dot(&v, &v).sqrt();
        beside.push(beta);
    }
    let size = diagonal.len();
    let tridiagonal = DMatrix::from_fn(size, size, |i, j| match i.abs_diff(j) {
        0 => diagonal[i],
        1 => beside[i.min(j)],
        _ => 0.0,
    });
    if size == 0 {
        return Ok(0.0);
    }
    Ok(SymmetricEigen::new(tridiagonal).eigenvalues.max())
}
