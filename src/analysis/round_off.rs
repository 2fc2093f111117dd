//! The round-off of a step's equations, degree of freedom by degree of freedom.
//!
//! A residual is the difference of forces that were added up from many terms. Rounding leaves in it
//! a few times machine epsilon of the *sizes* of the terms, however small their sum: below that no
//! iterate is better than another. The size of a point's share at a node a is
//! |∇S_a| V M (|b_e - 1| + Σ_b |u_b| |∇S_b|), M its modulus of pressure waves: a stress carries the
//! round-off of the strain it was made from, and that the one of the displacements it is the
//! difference of. Every term has the unit of a force, and no scale is given from outside.

use crate::material::local;
use crate::system::terms::stress::StepPoints;

/// Roundings that an entry of the residual may have met, in units of the size of its terms: the
/// chain from displacements to stress has about ten, the sum over points and the share of the
/// linear solver as many again.
const ROUNDINGS: f64 = 32.0;

/// Whether a residual is nothing but the round-off of terms of this size.
#[inline]
pub fn explains(size: f64, residual: f64) -> bool {
    residual.abs() <= ROUNDINGS * f64::EPSILON * size
}

/// Sizes of the internal force's terms per local node, N; this rank's points only. `displacement`:
/// local degrees of freedom.
pub fn sizes<const D: usize>(
    step: StepPoints<'_, D>,
    displacement: &[f64],
    nodes: usize,
) -> Vec<f64> {
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let moved: Vec<f64> = displacement.chunks_exact(D).map(norm).collect();
    let mut sizes = vec![0.0; nodes];
    for p in 0..step.points.len() {
        let points = step.points;
        let modulus =
            local(step.materials, points, p).model().wave_modulus(|| points.elastic_strain(p));
        let gradients = &step.influences.gradients[step.influences.row(p)];
        let around = step.nodes_of(p);
        let strain: f64 = around
            .iter()
            .zip(gradients)
            .map(|(&node, gradient)| moved[node as usize] * norm(gradient))
            .sum();
        let strain = strain + points.elastic_excess[p].norm();
        let force = modulus * strain * points.volume(p).abs();
        for (&node, gradient) in around.iter().zip(gradients) {
            sizes[node as usize] += force * norm(gradient);
        }
    }
    sizes
}
