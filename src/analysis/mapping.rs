//! Sums over points at the nodes, and nodal values at the points (Ghost eq. 6, 8-10).
//!
//! Nodal arrays hold one value (or vector) per local node; what this rank adds to nodes of
//! others is not yet sent. Sums run in the order of the points.

use crate::assembly::internal::StepPoints;
use crate::tensor::Square;
use crate::tensor::dense;

/// Σ_p m S^T v (Ghost eq. 10), kg m/s.
pub fn momentum<const D: usize>(
    step: StepPoints<'_, D>,
    velocity: &[[f64; D]],
    nodes: usize,
) -> Vec<[f64; D]> {
    let mut sums = vec![[0.0; D]; nodes];
    for (p, v) in velocity.iter().enumerate() {
        let carried = v.map(|v| v * step.points.mass[p]);
        let weights = &step.influences.weights[step.influences.row(p)];
        for (&node, weight) in step.nodes_of(p).iter().zip(weights) {
            let sum = &mut sums[node as usize];
            for i in 0..D {
                sum[i] += weight * carried[i];
            }
        }
    }
    sums
}

/// Σ_p S^T f - ∇S^T σ V (Ghost eq. 6), N, with σ V = τ V0. `external` is the force on each
/// point, empty for none. `increments` holds dF since the gradients were computed, empty for
/// none: the gradients are then those of the deformed state, ∇S dF^-1.
pub fn force<const D: usize>(
    step: StepPoints<'_, D>,
    external: &[[f64; D]],
    increments: &[Square<D>],
    nodes: usize,
) -> Vec<[f64; D]> {
    let mut sums = vec![[0.0; D]; nodes];
    let points = step.points;
    for p in 0..points.len() {
        let volume = points.volume_initial[p];
        let stress: Square<D> = dense::block(&points.kirchhoff_stress[p]);
        // Row i of τ V0 dF^-T: what the gradient is multiplied with.
        let mut flux = stress.map(|row| row.map(|s| s * volume));
        if let Some(increment) = increments.get(p) {
            let (inverse, _) = dense::inverse(increment);
            flux = dense::multiply_transposed(&flux, &inverse);
        }
        let own = external.get(p).copied().unwrap_or([0.0; D]);
        let row = step.influences.row(p);
        let (weights, gradients) =
            (&step.influences.weights[row.clone()], &step.influences.gradients[row]);
        for ((&node, weight), gradient) in step.nodes_of(p).iter().zip(weights).zip(gradients) {
            let sum = &mut sums[node as usize];
            for i in 0..D {
                sum[i] += weight * own[i] - dense::dot(&flux[i], gradient);
            }
        }
    }
    sums
}

/// [`momentum`] and [`force`] in one pass, to the last bit the same.
pub fn momentum_and_force<const D: usize>(
    step: StepPoints<'_, D>,
    external: &[[f64; D]],
    nodes: usize,
) -> (Vec<[f64; D]>, Vec<[f64; D]>) {
    let (mut momenta, mut forces) = (vec![[0.0; D]; nodes], vec![[0.0; D]; nodes]);
    let points = step.points;
    for p in 0..points.len() {
        let volume = points.volume_initial[p];
        let stress: Square<D> = dense::block(&points.kirchhoff_stress[p]);
        let flux = stress.map(|row| row.map(|s| s * volume));
        let carried = points.velocity[p].map(|v| v * points.mass[p]);
        let own = external.get(p).copied().unwrap_or([0.0; D]);
        let row = step.influences.row(p);
        let (weights, gradients) =
            (&step.influences.weights[row.clone()], &step.influences.gradients[row]);
        for ((&node, weight), gradient) in step.nodes_of(p).iter().zip(weights).zip(gradients) {
            let (momentum, force) = (&mut momenta[node as usize], &mut forces[node as usize]);
            for i in 0..D {
                momentum[i] += weight * carried[i];
                force[i] += weight * own[i] - dense::dot(&flux[i], gradient);
            }
        }
    }
    (momenta, forces)
}

/// Rates S a and new velocities α (v_p + dt S a) + (1 - α) S v' of the points (Ghost eq. 8);
/// `acceleration` and `velocity` v' hold `D` values per local node.
pub fn push<const D: usize>(
    step: StepPoints<'_, D>,
    acceleration: &[f64],
    velocity: &[f64],
    share: f64,
    dt: f64,
) -> (Vec<[f64; D]>, Vec<[f64; D]>) {
    let count = step.points.len();
    let (mut rates, mut velocities) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let of_nodes = share < 1.0;
    for (p, before) in step.points.velocity.iter().enumerate() {
        let (mut rate, mut carried) = ([0.0; D], [0.0; D]);
        let weights = &step.influences.weights[step.influences.row(p)];
        for (&node, weight) in step.nodes_of(p).iter().zip(weights) {
            let range = node as usize * D..node as usize * D + D;
            let a = &acceleration[range.clone()];
            for i in 0..D {
                rate[i] += weight * a[i];
            }
            if of_nodes {
                let v = &velocity[range];
                for i in 0..D {
                    carried[i] += weight * v[i];
                }
            }
        }
        rates.push(rate);
        velocities.push(std::array::from_fn(|i| {
            let pushed = before[i] + dt * rate[i];
            if of_nodes { share * pushed + (1.0 - share) * carried[i] } else { pushed }
        }));
    }
    (rates, velocities)
}

/// Σ_v S u at each point; `nodal` holds `D` values per local node.
pub fn at_points<const D: usize>(step: StepPoints<'_, D>, nodal: &[f64]) -> Vec<[f64; D]> {
    (0..step.points.len())
        .map(|p| {
            let mut sum = [0.0; D];
            let weights = &step.influences.weights[step.influences.row(p)];
            for (&node, weight) in step.nodes_of(p).iter().zip(weights) {
                let value = &nodal[node as usize * D..node as usize * D + D];
                for i in 0..D {
                    sum[i] += weight * value[i];
                }
            }
            sum
        })
        .collect()
}

/// dF = 1 + Σ_v u ∇S at each point (Lagrangian eq. 7).
pub fn deformation_increments<const D: usize>(
    step: StepPoints<'_, D>,
    displacement: &[f64],
) -> Vec<Square<D>> {
    (0..step.points.len())
        .map(|p| {
            let mut increment = dense::identity();
            let gradients = &step.influences.gradients[step.influences.row(p)];
            for (&node, gradient) in step.nodes_of(p).iter().zip(gradients) {
                let u = &displacement[node as usize * D..node as usize * D + D];
                for i in 0..D {
                    for j in 0..D {
                        increment[i][j] += u[i] * gradient[j];
                    }
                }
            }
            increment
        })
        .collect()
}
