//! Sums over points at the nodes, and nodal values at the points (Ghost eq. 6, 8-10).
//!
//! Nodal arrays hold one value (or vector) per local node; what this rank adds to nodes of
//! others is not yet sent. Sums run in the order of the points.

use std::ops::Range;

use crate::basis::Influences;
use crate::mechanics::{Increment, dilation};
use crate::points::Points;
use crate::system::cell_rows::rows_now;
use crate::system::numbering::Numbering;
use crate::system::step_points::StepPoints;
use crate::tensor::Square;
use crate::tensor::dense;

/// dF - 1 of points.
#[derive(Debug, Clone, Default)]
pub struct Deformation<const D: usize> {
    pub blocks: Vec<Square<D>>,
    /// dF_zz - 1 of rings; empty without axisymmetry.
    pub hoops: Vec<f64>,
    /// Rows g_0 of the points' cells after it, with the hoops', of all entries of the influences; empty without F-bar,
    /// and where no force needs them.
    pub common: Vec<([f64; D], f64)>,
}

/// Σ_p m S^T v (Ghost eq. 10), kg m/s.
pub fn momentum<const D: usize>(
    step: StepPoints<'_, D>,
    velocity: &[[f64; D]],
    nodes: usize,
) -> Vec<[f64; D]> {
    let mut sums = vec![[0.0; D]; nodes];
    add_momentum(step, 0..step.points.len(), velocity, &mut sums);
    sums
}

/// Adds [`momentum`] of some of the points.
pub fn add_momentum<const D: usize>(
    step: StepPoints<'_, D>,
    part: Range<usize>,
    velocity: &[[f64; D]],
    sums: &mut [[f64; D]],
) {
    for p in part {
        let carried = velocity[p].map(|v| v * step.points.mass[p]);
        let weights = &step.influences.weights[step.influences.row(p)];
        for (&node, weight) in step.nodes_of(p).iter().zip(weights) {
            let sum = &mut sums[node as usize];
            for i in 0..D {
                sum[i] += weight * carried[i];
            }
        }
    }
}

/// Σ_p S^T f - ∇S^T σ V (Ghost eq. 6), N, with σ V = τ V0. `external` is the force on each
/// point, empty for none. `increments` holds dF - 1 since the gradients were computed, empty for
/// none: the gradients are then those of the deformed state, ∇S dF^-1. Rings add -τ_zz V0 H / dF_zz
/// along the radius, F-bar adds what its pressure does on the change of volume of the cells
/// ([`crate::mechanics::dilation`]).
pub fn force<const D: usize>(
    step: StepPoints<'_, D>,
    external: &[[f64; D]],
    increments: &Deformation<D>,
    nodes: usize,
) -> Vec<[f64; D]> {
    let mut sums = vec![[0.0; D]; nodes];
    add_force(step, 0..step.points.len(), external, increments, &mut sums);
    sums
}

/// Adds [`force`] of some of the points.
pub fn add_force<const D: usize>(
    step: StepPoints<'_, D>,
    part: Range<usize>,
    external: &[[f64; D]],
    increments: &Deformation<D>,
    sums: &mut [[f64; D]],
) {
    let points = step.points;
    add_hoop_force(step, part.clone(), &increments.hoops, sums);
    add_dilation_force(step, part.clone(), increments, sums);
    for p in part {
        let volume = points.volume_initial[p];
        let stress: Square<D> = dense::block(&points.kirchhoff_stress[p]);
        // Row i of τ V0 dF^-T: what the gradient is multiplied with.
        let mut flux = stress.map(|row| row.map(|s| s * volume));
        if let Some(increment) = increments.blocks.get(p) {
            let (inverse, _) = dense::inverse(&dense::plus_unit(increment));
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
}

/// [`add_momentum`] and [`add_force`] in one pass, to the last bit the same.
pub fn add_momentum_and_force<const D: usize>(
    step: StepPoints<'_, D>,
    part: Range<usize>,
    external: &[[f64; D]],
    momenta: &mut [[f64; D]],
    forces: &mut [[f64; D]],
) {
    let points = step.points;
    add_hoop_force(step, part.clone(), &[], forces);
    add_dilation_force(step, part.clone(), &Deformation::default(), forces);
    for p in part {
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
}

/// -Σ_p H τ_zz V0 / dF_zz along the radius, of rings; `hoops`: dF_zz - 1 since H was computed.
fn add_hoop_force<const D: usize>(
    step: StepPoints<'_, D>,
    part: Range<usize>,
    hoops: &[f64],
    sums: &mut [[f64; D]],
) {
    if step.influences.hoop.is_empty() {
        return;
    }
    let points = step.points;
    for p in part {
        let since = 1.0 + hoops.get(p).copied().unwrap_or(0.0);
        let force = points.kirchhoff_stress[p][(2, 2)] * points.volume_initial[p] / since;
        let rows = &step.influences.hoop[step.influences.row(p)];
        for (&node, row) in step.nodes_of(p).iter().zip(rows) {
            sums[node as usize][0] -= row * force;
        }
    }
}

/// -Σ_p V0 π r of F-bar ([`crate::mechanics::dilation`]).
fn add_dilation_force<const D: usize>(
    step: StepPoints<'_, D>,
    part: Range<usize>,
    increments: &Deformation<D>,
    sums: &mut [[f64; D]],
) {
    let influences = step.influences;
    if influences.centre_gradients.is_empty() {
        return;
    }
    let rings = !influences.hoop.is_empty();
    let directions = if rings { 3 } else { D };
    let still = [[0.0; D]; D];
    for p in part {
        let stress = &step.points.kirchhoff_stress[p];
        let trace: f64 = (0..directions).map(|d| stress[(d, d)]).sum();
        let pressure = trace * step.points.volume_initial[p];
        let hoop = increments.hoops.get(p).copied().unwrap_or(0.0);
        let block = increments.blocks.get(p).unwrap_or(&still);
        let here = dilation::inverse(Increment { block, hoop });
        for (&node, at) in step.nodes_of(p).iter().zip(influences.row(p)) {
            let hoops = match rings {
                true => [influences.hoop[at], influences.centre_hoop[at]],
                false => [0.0; 2],
            };
            let own = dilation::mapped((&influences.gradients[at], hoops[0]), &here);
            let still = (influences.centre_gradients[at], hoops[1]);
            let cells = increments.common.get(at).copied().unwrap_or(still);
            let row = dilation::swelling(&own, &cells, 1.0 / directions as f64);
            for (sum, r) in sums[node as usize].iter_mut().zip(row) {
                *sum -= pressure * r;
            }
        }
    }
}

/// Σ_p S^T f at the local nodes, `D` values each.
pub fn forces_at_nodes<const D: usize>(
    numbering: &Numbering,
    influences: &Influences<D>,
    (points, forces): (&Points<D>, &[[f64; D]]),
) -> Vec<f64> {
    let mut nodal = vec![0.0; numbering.len() * D];
    for (p, force) in forces.iter().enumerate() {
        if force.iter().all(|&f| f == 0.0) {
            continue;
        }
        for entry in influences.offsets[p]..influences.offsets[p + 1] {
            let node = numbering.fields.node(points.body[p] as usize, influences.nodes[entry]);
            let local = numbering.index[node] as usize;
            for (axis, f) in force.iter().enumerate() {
                nodal[local * D + axis] += influences.weights[entry] * f;
            }
        }
    }
    nodal
}

/// Rates S a and velocities of the points.
pub struct Pushed<const D: usize> {
    pub rate: Vec<[f64; D]>,
    pub velocity: Vec<[f64; D]>,
}

impl<const D: usize> Pushed<D> {
    pub fn zeros(points: usize) -> Self {
        Pushed { rate: vec![[0.0; D]; points], velocity: vec![[0.0; D]; points] }
    }

    /// Rates S a and new velocities α (v_p + dt S a) + (1 - α) S v' of some of the points (Ghost
    /// eq. 8), α = `share`; `acceleration` and `velocity` v' hold `D` values per local node.
    pub fn push(
        &mut self,
        step: StepPoints<'_, D>,
        part: Range<usize>,
        [velocity, acceleration]: [&[f64]; 2],
        share: f64,
        dt: f64,
    ) {
        let of_nodes = share < 1.0;
        for p in part {
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
            let before = &step.points.velocity[p];
            self.rate[p] = rate;
            self.velocity[p] = std::array::from_fn(|i| {
                let pushed = before[i] + dt * rate[i];
                if of_nodes { share * pushed + (1.0 - share) * carried[i] } else { pushed }
            });
        }
    }
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

/// By how much the points move: [`at_points`], of rings with the mean that is not weighted by
/// the radius ([`crate::basis::radial`]).
pub fn displacements<const D: usize>(step: StepPoints<'_, D>, nodal: &[f64]) -> Vec<[f64; D]> {
    match step.influences.hoop.is_empty() {
        true => at_points(step, nodal),
        false => displacements_of_rings(step, nodal),
    }
}

/// Σ_v H u / Σ_v H at each ring.
pub(super) fn displacements_of_rings<const D: usize>(
    step: StepPoints<'_, D>,
    nodal: &[f64],
) -> Vec<[f64; D]> {
    let of_point = |p: usize| {
        let (mut sum, mut whole) = ([0.0; D], 0.0);
        let rows = &step.influences.hoop[step.influences.row(p)];
        for (&node, row) in step.nodes_of(p).iter().zip(rows) {
            let value = &nodal[node as usize * D..node as usize * D + D];
            whole += row;
            for i in 0..D {
                sum[i] += row * value[i];
            }
        }
        sum.map(|sum| sum / whole)
    };
    (0..step.points.len()).map(of_point).collect()
}

/// dF_zz - 1 = Σ_v H u_r at each ring; empty without axisymmetry.
pub fn hoop_increments<const D: usize>(step: StepPoints<'_, D>, displacement: &[f64]) -> Vec<f64> {
    if step.influences.hoop.is_empty() {
        return Vec::new();
    }
    let of_point = |p: usize| {
        let rows = &step.influences.hoop[step.influences.row(p)];
        let moved = step.nodes_of(p).iter().map(|&node| displacement[node as usize * D]);
        moved.zip(rows).map(|(u, row)| row * u).sum()
    };
    (0..step.points.len()).map(of_point).collect()
}

/// dF - 1 = Σ_v u ∇S at each point (Lagrangian eq. 7), with the hoop of rings.
pub fn displacement_gradients<const D: usize>(
    step: StepPoints<'_, D>,
    displacement: &[f64],
) -> Deformation<D> {
    let hoops = hoop_increments(step, displacement);
    let blocks = (0..step.points.len())
        .map(|p| {
            let mut increment = [[0.0; D]; D];
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
        .collect();
    Deformation { blocks, hoops, common: Vec::new() }
}

/// det dF_0 - 1 of each point's cells, with the hoop; empty without F-bar. `rows` takes their g_0 of all entries of
/// the influences.
pub fn common_changes<const D: usize>(
    step: StepPoints<'_, D>,
    displacement: &[f64],
    mut rows: Option<&mut Vec<([f64; D], f64)>>,
) -> Vec<f64> {
    let influences = step.influences;
    if influences.centre_gradients.is_empty() {
        return Vec::new();
    }
    let mut of_point = Vec::new();
    let change = |p: usize| {
        let nodes = step.nodes_of(p);
        let nodal = |a: usize| -> [f64; D] {
            let start = nodes[a] as usize * D;
            std::array::from_fn(|i| displacement[start + i])
        };
        let change = rows_now(influences, p, nodal, &mut of_point);
        if let Some(rows) = rows.as_deref_mut() {
            rows.extend_from_slice(&of_point);
        }
        change
    };
    (0..step.points.len()).map(change).collect()
}

#[cfg(test)]
mod tests {
    use crate::system::border::Border;
    use nalgebra::Matrix3;

    use super::*;
    use crate::basis::{self, Groups};
    use crate::deck::model::{Basis, PointVolume};
    use crate::grid::{Grid, Lattice};
    use crate::points::Points;

    /// One pass gives what the formulas give one after the other.
    #[test]
    fn fused_passes_agree_with_the_plain_ones() {
        let lattice = Lattice { origin: [0.0; 2], spacing: [0.5, 0.4], cells: [5, 6] };
        let (grid, nodes) = (Grid::Lattice(lattice), 6 * 7);
        let mut points = Points::<2>::default();
        for k in 0..40 {
            let t = k as f64;
            let x = [1.2 + 0.6 * (1.3 * t).sin(), 1.1 + 0.7 * (0.7 * t).cos()];
            points.push_unstrained(k, 0, x, 0.01 + 0.001 * t, 3.0, [0.06, 0.05]);
            points.velocity[k as usize] = [t.cos(), 0.3 * t];
            points.kirchhoff_stress[k as usize] =
                Matrix3::new(t, 2.0, 0.0, 2.0, t.sin(), 0.0, 0.0, 0.0, 1.0);
        }
        let external: Vec<[f64; 2]> = (0..40).map(|k| [0.1 * k as f64, -1.0]).collect();
        let field = |seed: f64| -> Vec<f64> {
            (0..2 * nodes).map(|i| (seed + 0.37 * i as f64).sin()).collect()
        };
        let (acceleration, velocity) = (field(0.1), field(2.0));
        for basis in [Basis::Mpm, Basis::Gimp] {
            let influences = basis::map_points(&grid, basis, &points).expect("inside");
            let groups = Groups::new(&influences);
            let group_nodes: Vec<u32> = groups.nodes.iter().map(|&node| node as u32).collect();
            let border = Border::new(std::iter::repeat_n(false, groups.len()));
            let step = StepPoints {
                points: &points,
                materials: &[],
                influences: &influences,
                groups: &groups,
                group_nodes: &group_nodes,
                border: &border,
                volume: PointVolume::default(),
            };
            for external in [&external[..], &[]] {
                let (mut momenta, mut forces) = (vec![[0.0; 2]; nodes], vec![[0.0; 2]; nodes]);
                for part in [0..17, 17..40] {
                    add_momentum_and_force(step, part, external, &mut momenta, &mut forces);
                }
                assert_eq!(momenta, momentum(step, &points.velocity, nodes));
                assert_eq!(forces, force(step, external, &Deformation::default(), nodes));
            }
            let (a, v) = (at_points(step, &acceleration), at_points(step, &velocity));
            for share in [1.0, 0.4, 0.0] {
                let mut pushed = Pushed::zeros(points.len());
                for part in [25..40, 0..25] {
                    pushed.push(step, part, [&velocity, &acceleration], share, 0.01);
                }
                assert_eq!(pushed.rate, a);
                for p in 0..points.len() {
                    for i in 0..2 {
                        let flip = points.velocity[p][i] + 0.01 * a[p][i];
                        let mixed = share * flip + (1.0 - share) * v[p][i];
                        assert!(
                            (pushed.velocity[p][i] - mixed).abs() < 1e-15 * (1.0 + mixed.abs())
                        );
                    }
                }
            }
        }
    }
}
