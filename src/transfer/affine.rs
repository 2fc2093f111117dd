//! Affine transfers: a point carries its velocity v and a velocity gradient L beside it.
//!
//! | | equation | source |
//! |---|---|---|
//! | points to nodes | m_i v_i = Σ_p m S_i (v + C (x_i - x_p)) | Jiang et al. 2015 |
//! | nodes to points | v = Σ_i S_i v_i', B = Σ_i S_i v_i' (x_i - x_p)^T | Jiang et al. 2015 |
//! | spread | D = Σ_i S_i (x_i - x_p) (x_i - x_p)^T | Jiang et al. 2015 |
//! | `apic` | C = B D^-1 with D of the place the point has moved to | Jiang et al. 2015, 2017 |
//! | `tpic` | C = L = Σ_i v_i' ∇S_i^T | Nakamura et al. 2023 |
//!
//! On a lattice D is diagonal, as S is a product of functions of one axis that give linear fields
//! back: Σ S (x_i - x_p) = 0. A point holds L and the diagonal D of the place that L was taken at,
//! so B = L D.
//!
//! The angular momentum of a point is m (x × v + ε : B^T), ε : B^T = Σ_i S_i (x_i - x_p) × v_i', and
//! its kinetic energy m/2 (v v + L : B). Summed over the points of one node set these are the
//! angular momentum Σ x_i × m_i v_i' of the nodes, and no more than their energy. That the points then
//! move by dt v changes nothing, as v × v = 0.
//!
//! Where a point moves relative to the grid its D changes. `apic` keeps B, and so the angular
//! momentum exactly; it hands a linear field on with the relative change of D in the step. `tpic`
//! keeps L and so hands a linear field on as it is; the angular momentum then goes up and down with D.
//! With gimp domains of one cell (quadratic B-splines) D = h^2/4 everywhere and both hold.
//!
//! With `mpm` D is zero on a face of a cell: B says nothing about L there, and with L the energy
//! L : L D of a point that leaves the face grows by any factor (a turning block of 1 m, h = 0.1 m,
//! dt c / h = 0.15: 11 % in 43 steps). The deck refuses it.
//!
//! A domain that reaches over the grid's edge does not keep all of B: see [`Affine::gather`].
//!
//! The stress is updated last: forces then have no moment about the nodes' places, which are those
//! of B. Updated first, their moment vanishes about x_i + dt v_i. The mass is lumped, as B stands for
//! what Σ S S^T leaves out of Σ S.
//!
//! Sources: C. Jiang, C. Schroeder, A. Selle, J. Teran, A. Stomakhin, "The affine particle-in-cell
//! method", ACM Trans. Graph. 34 (2015) 51; C. Jiang, C. Schroeder, J. Teran, "An angular momentum
//! conserving affine-particle-in-cell method", J. Comput. Phys. 338 (2017) 137-164; K. Nakamura,
//! S. Matsumura, T. Mizutani, "Taylor particle-in-cell transfer and kernel correction for material
//! point method", Comput. Methods Appl. Mech. Engrg. 403 (2023) 115720.

use std::ops::Range;

use crate::basis::{Influences, map_points_with};
use crate::deck::model::{AffineTransfer, Method};
use crate::error::Result;
use crate::grid::Grid;
use crate::points::Points;
use crate::system::step_points::StepPoints;
use crate::tensor::Square;

/// What points take from the grid beside their velocity.
pub struct Affine<const D: usize> {
    /// L, 1/s
    pub velocity_gradient: Vec<Square<D>>,
    /// Diagonal of D, m2
    pub spread: Vec<[f64; D]>,
}

impl<const D: usize> Affine<D> {
    /// L and D of all points from the nodal velocity v', `D` values per local node, m/s. Where the
    /// domain reaches over the grid's edge D is bounded from below: L is then the smaller, and the
    /// nodes get back less than B.
    pub fn gather(
        kind: AffineTransfer,
        grid: &Grid<D>,
        step: StepPoints<'_, D>,
        velocity: &[f64],
    ) -> Self {
        let count = step.points.len();
        let mut taken = Affine {
            velocity_gradient: Vec::with_capacity(count),
            spread: Vec::with_capacity(count),
        };
        for p in 0..count {
            let spread = spread_of(grid, step.influences, step.points, p);
            let row = step.influences.row(p);
            let mut slope = [[0.0; D]; D];
            for (&node, k) in step.nodes_of(p).iter().zip(row) {
                let v = &velocity[node as usize * D..node as usize * D + D];
                let along = match kind {
                    AffineTransfer::Apic => {
                        let arm = arm_of(grid, step.influences, step.points, p, k);
                        let weight = step.influences.weights[k];
                        std::array::from_fn(|j| weight * arm[j] / spread[j])
                    }
                    AffineTransfer::Tpic => step.influences.gradients[k],
                };
                for i in 0..D {
                    for j in 0..D {
                        slope[i][j] += v[i] * along[j];
                    }
                }
            }
            taken.velocity_gradient.push(slope);
            taken.spread.push(spread);
        }
        taken
    }
}

/// Before the first step: L becomes the gradient of the deck's velocity, and the points get their spread.
pub fn begin<const D: usize>(
    method: &Method,
    grid: &Grid<D>,
    points: &mut Points<D>,
) -> Result<()> {
    if !points.affine {
        return Ok(());
    }
    let influences = map_points_with(grid, method.basis, method.gimp_edge, points)?;
    points.spread = (0..points.len()).map(|p| spread_of(grid, &influences, points, p)).collect();
    Ok(())
}

/// C of all points for the functions of this step, 1/s.
pub fn slopes<const D: usize>(
    kind: AffineTransfer,
    grid: &Grid<D>,
    step: StepPoints<'_, D>,
) -> Vec<Square<D>> {
    let points = step.points;
    if kind == AffineTransfer::Tpic {
        return points.velocity_gradient.clone();
    }
    (0..points.len())
        .map(|p| {
            let (then, now) = (&points.spread[p], spread_of(grid, step.influences, points, p));
            points.velocity_gradient[p]
                .map(|row| std::array::from_fn(|j| row[j] * (then[j] / now[j])))
        })
        .collect()
}

/// Adds m S C (x_i - x_p) of some of the points, kg m/s; nothing where `slopes` is empty.
pub fn add_momentum<const D: usize>(
    grid: &Grid<D>,
    step: StepPoints<'_, D>,
    part: Range<usize>,
    slopes: &[Square<D>],
    sums: &mut [[f64; D]],
) {
    if slopes.is_empty() {
        return;
    }
    for p in part {
        let row = step.influences.row(p);
        for (&node, k) in step.nodes_of(p).iter().zip(row) {
            let arm = arm_of(grid, step.influences, step.points, p, k);
            let share = step.points.mass[p] * step.influences.weights[k];
            for (sum, slope) in sums[node as usize].iter_mut().zip(&slopes[p]) {
                *sum += share * slope.iter().zip(&arm).map(|(c, r)| c * r).sum::<f64>();
            }
        }
    }
}

/// L : B / 2 of a point, J/kg.
pub fn kinetic_energy<const D: usize>(points: &Points<D>, p: usize) -> f64 {
    let squares = points.velocity_gradient[p].iter().map(|row| {
        row.iter().zip(&points.spread[p]).map(|(slope, spread)| slope * slope * spread).sum::<f64>()
    });
    0.5 * squares.sum::<f64>()
}

/// ε : B^T of a point, m2/s.
pub fn angular_momentum<const D: usize>(points: &Points<D>, p: usize) -> [f64; 3] {
    let (slope, spread) = (&points.velocity_gradient[p], &points.spread[p]);
    // Velocity along i, arm along j.
    let moment = |i: usize, j: usize| slope[i][j] * spread[j];
    let mut sum = [0.0; 3];
    sum[2] = moment(1, 0) - moment(0, 1);
    if D == 3 {
        sum[0] = moment(2, 1) - moment(1, 2);
        sum[1] = moment(0, 2) - moment(2, 0);
    }
    sum
}

/// x_i - x_p of entry `k` of the influences, m.
fn arm_of<const D: usize>(
    grid: &Grid<D>,
    influences: &Influences<D>,
    points: &Points<D>,
    p: usize,
    k: usize,
) -> [f64; D] {
    let (node, centre) = (grid.node_position(influences.nodes[k]), &points.position[p]);
    std::array::from_fn(|j| node[j] - centre[j])
}

/// Diagonal of D, m2. Within the grid it is at least l h / 2 along an axis, l half the domain's length up
/// to half a cell h (the least is that of a domain about a node). Over the grid's edge the functions
/// of the outer cell go on, D falls to zero with the distance to the edge, and the bound stands in.
fn spread_of<const D: usize>(
    grid: &Grid<D>,
    influences: &Influences<D>,
    points: &Points<D>,
    p: usize,
) -> [f64; D] {
    let mut spread = [0.0; D];
    for k in influences.row(p) {
        let arm = arm_of(grid, influences, points, p, k);
        for (sum, arm) in spread.iter_mut().zip(arm) {
            *sum += influences.weights[k] * arm * arm;
        }
    }
    let cell = match grid {
        Grid::Lattice(lattice) => lattice.spacing,
        Grid::Mesh(_) => [grid.cell_size(); D],
    };
    let least = |j: usize| 0.5 * cell[j] * points.half_length[p][j].min(0.5 * cell[j]);
    std::array::from_fn(|j| spread[j].max(least(j)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::basis::Groups;
    use crate::deck::model::{Basis, GimpEdge, PointVolume};
    use crate::grid::Lattice;
    use crate::system::border::Border;
    use crate::transfer::mapping;

    const KINDS: [AffineTransfer; 2] = [AffineTransfer::Apic, AffineTransfer::Tpic];

    /// A number between -1 and 1.
    fn any(seed: usize) -> f64 {
        (seed as f64 * 12.9898).sin()
    }

    fn cross<const D: usize>(x: &[f64; D], v: &[f64; D], out: &mut [f64; 3], share: f64) {
        for (axis, sum) in out.iter_mut().enumerate() {
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            if i < D && j < D {
                *sum += share * (x[i] * v[j] - x[j] * v[i]);
            }
        }
    }

    /// Angular momentum and energy of points with an affine share.
    fn sums<const D: usize>(points: &Points<D>) -> ([f64; 3], f64) {
        let (mut moment, mut energy) = ([0.0; 3], 0.0);
        for p in 0..points.len() {
            let (mass, v) = (points.mass[p], &points.velocity[p]);
            cross(&points.position[p], v, &mut moment, mass);
            for (sum, m) in moment.iter_mut().zip(angular_momentum(points, p)) {
                *sum += mass * m;
            }
            energy +=
                mass * (0.5 * v.iter().map(|v| v * v).sum::<f64>() + kinetic_energy(points, p));
        }
        (moment, energy)
    }

    /// Points to nodes, and back from any nodal velocity: the angular momentum is the same on both
    /// sides, and energy is lost only.
    fn both_ways<const D: usize>() {
        let lattice = Lattice { origin: [-0.3; D], spacing: [0.5; D], cells: [5; D] };
        let grid = Grid::Lattice(lattice);
        let mut points = Points::<D> { affine: true, ..Points::of_basis(Basis::Gimp) };
        for p in 0..40 {
            let x = std::array::from_fn(|i| 0.9 + 0.8 * any(3 * p + i));
            points.push_unstrained(p as u64, 0, x, 0.01, 900.0 + 5.0 * p as f64, [0.1; D]);
            points.velocity[p] = std::array::from_fn(|i| any(7 * p + i));
            points.velocity_gradient[p] =
                std::array::from_fn(|i| std::array::from_fn(|j| any(11 * p + 3 * i + j)));
        }
        let influences =
            map_points_with(&grid, Basis::Gimp, GimpEdge::Continued, &points).expect("inside");
        points.spread =
            (0..points.len()).map(|p| spread_of(&grid, &influences, &points, p)).collect();
        let groups = Groups::new(&influences);
        let group_nodes: Vec<u32> = groups.nodes.iter().map(|&node| node as u32).collect();
        let border = Border::new(std::iter::repeat_n(false, groups.len()));
        let with = |points: &Points<D>, go: &mut dyn FnMut(StepPoints<'_, D>)| {
            go(StepPoints {
                points,
                materials: &[],
                influences: &influences,
                groups: &groups,
                group_nodes: &group_nodes,
                border: &border,
                volume: PointVolume::default(),
            });
        };
        let nodes = grid.node_count();
        for kind in KINDS {
            let (before, energy) = sums(&points);
            let mut mass = vec![0.0; nodes];
            let mut momenta = vec![[0.0; D]; nodes];
            with(&points, &mut |step| {
                momenta = mapping::momentum(step, &step.points.velocity, nodes);
                let slopes = slopes(kind, &grid, step);
                add_momentum(&grid, step, 0..step.points.len(), &slopes, &mut momenta);
                for p in 0..step.points.len() {
                    for k in influences.row(p) {
                        mass[influences.nodes[k]] += influences.weights[k] * step.points.mass[p];
                    }
                }
            });
            let (mut on_nodes, mut kinetic) = ([0.0; 3], 0.0);
            for node in (0..nodes).filter(|&node| mass[node] > 0.0) {
                cross(&grid.node_position(node), &momenta[node], &mut on_nodes, 1.0);
                kinetic += 0.5 * momenta[node].iter().map(|m| m * m).sum::<f64>() / mass[node];
            }
            for (a, b) in before.iter().zip(on_nodes) {
                assert!((a - b).abs() < 1e-12 * energy, "{kind:?} to nodes: {a} {b}");
            }
            assert!(kinetic <= energy, "{kind:?}: {kinetic} {energy}");

            let nodal: Vec<f64> = (0..nodes * D).map(|i| any(5 * i + 1)).collect();
            let (mut wanted, mut available) = ([0.0; 3], 0.0);
            for node in 0..nodes {
                let v = std::array::from_fn(|i| nodal[node * D + i]);
                cross(&grid.node_position(node), &v, &mut wanted, mass[node]);
                available += 0.5 * mass[node] * v.iter().map(|v| v * v).sum::<f64>();
            }
            let mut after = points.clone();
            with(&points, &mut |step| {
                after.velocity = mapping::at_points(step, &nodal);
                after.velocity_gradient =
                    Affine::gather(kind, &grid, step, &nodal).velocity_gradient;
            });
            let (moment, energy) = sums(&after);
            if kind == AffineTransfer::Apic {
                for (a, b) in moment.iter().zip(wanted) {
                    assert!((a - b).abs() < 1e-12 * available, "to points: {a} {b}");
                }
                assert!(energy <= available, "{energy} {available}");
            }
            // A linear field is given back by both.
            let slope: Square<D> =
                std::array::from_fn(|i| std::array::from_fn(|j| any(2 + 3 * i + j)));
            let linear: Vec<f64> = (0..nodes)
                .flat_map(|node| crate::tensor::dense::apply(&slope, &grid.node_position(node)))
                .collect();
            with(&points, &mut |step| {
                for found in Affine::gather(kind, &grid, step, &linear).velocity_gradient {
                    for (a, b) in found.as_flattened().iter().zip(slope.as_flattened()) {
                        assert!((a - b).abs() < 1e-13, "{kind:?}: {a} {b}");
                    }
                }
            });
        }
    }

    #[test]
    fn momenta_go_both_ways_in_the_plane() {
        both_ways::<2>();
    }

    #[test]
    fn momenta_go_both_ways_in_space() {
        both_ways::<3>();
    }
}
