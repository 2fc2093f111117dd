//! The largest eigenvalue of D^-1 A, with A's diagonal D, by Lanczos' method.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::blocks::BlockProduct;
use crate::error::Result;
use crate::parallel::World;
use crate::petsc::multigrid::Smoother;

use super::block_smoother::BlockSmoother;
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
    let mut v = noise::<K>(nodes);
    v.iter_mut().zip(&root).filter(|(_, root)| **root <= 0.0).for_each(|(v, _)| *v = 0.0);
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
    Ok(largest_of(&diagonal, &beside))
}

/// Of B^-1 A, with what a smoother has for B: Lanczos' method in the product of B. `None` where B turns
/// out not to be positive definite: it smooths nothing then. Collective.
pub fn largest_smoothed<const K: usize>(
    world: &World,
    nodes: &Nodes,
    product: &BlockProduct<f32>,
    smoother: &mut BlockSmoother,
) -> Result<Option<f64>> {
    let owned = nodes.owned * K;
    let dot = |a: &[f64], b: &[f64]| world.sum(a.iter().zip(b).map(|(a, b)| a * b).sum());
    // Of a vector v with |v|_B = 1: v itself behind B^-1, and B v.
    let (mut v, mut of_b, mut before) = (vec![0.0; owned], noise::<K>(nodes), vec![0.0; owned]);
    smoother.apply(&of_b, &mut v)?;
    // NaN and what is negative.
    let size = |square: f64| if square >= 0.0 { Some(square.sqrt()) } else { None };
    let Some(mut beta) = size(dot(&of_b, &v)) else { return Ok(None) };
    let (mut x, mut w) = (vec![0.0; nodes.local() * K], vec![0.0; owned]);
    let (mut diagonal, mut beside) = (Vec::new(), Vec::new());
    let smallest = beta * 1e-12;
    while diagonal.len() < STEPS && beta > smallest {
        v.iter_mut().for_each(|v| *v /= beta);
        of_b.iter_mut().for_each(|v| *v /= beta);
        x[..owned].copy_from_slice(&v);
        nodes.halo.forward(world, &mut x, K)?;
        product.multiply_local(&x, &mut w);
        w.iter_mut().zip(&before).for_each(|(w, before)| *w -= beta * before);
        let alpha = dot(&w, &v);
        w.iter_mut().zip(&of_b).for_each(|(w, v)| *w -= alpha * v);
        diagonal.push(alpha);
        std::mem::swap(&mut before, &mut of_b);
        std::mem::swap(&mut of_b, &mut w);
        smoother.apply(&of_b, &mut v)?;
        let Some(next) = size(dot(&of_b, &v)) else { return Ok(None) };
        beta = next;
        beside.push(beta);
    }
    Ok(Some(largest_of(&diagonal, &beside)).filter(|largest| *largest > 0.0))
}

/// For all eigenvectors to take part; that of a node does not depend on its rank.
fn noise<const K: usize>(nodes: &Nodes) -> Vec<f64> {
    (0..nodes.owned * K)
        .map(|row| (nodes.key[row / K] * (row % K + 1) as f64 * 9973.0).fract() - 0.5)
        .collect()
}

/// Largest eigenvalue of the tridiagonal matrix; 0 if that is empty.
fn largest_of(diagonal: &[f64], beside: &[f64]) -> f64 {
    let size = diagonal.len();
    let tridiagonal = DMatrix::from_fn(size, size, |i, j| match i.abs_diff(j) {
        0 => diagonal[i],
        1 => beside[i.min(j)],
        _ => 0.0,
    });
    if size == 0 { 0.0 } else { SymmetricEigen::new(tridiagonal).eigenvalues.max() }
}
