//! S_ip = (1/2^D) sum_c S_i(x_c), dS_ip = (1/2^D) sum_c sum_j sgn_cj (H^-1)_j S_i(x_c) over the
//! corners x_c = x_p + H sgn_c of a parallelogram or parallelepiped with half edges
//! H = F H_0 (Rotation §2 (iii), (iv), (vii); Sadeghirad et al. 2011).
//!
//! The gradient is the mean over the domain of the (bi- or tri)linear interpolation of the
//! corner values: d/dxi_j of corner c's function has the mean sgn_cj / 2^D, and d/dx = H^-T d/dxi
//! because H is constant. In 2D, with s = 2 H_1 and t = 2 H_2, this is Rotation's formula.

use crate::deck::model::GimpEdge;
use crate::error::{Error, Result};
use crate::grid::element::{determinant, inverse};
use crate::grid::lattice::CORNER_SIGNS;
use crate::points::Points;
use crate::tensor::dense;

use super::corner::{Cornered, Corners, for_each_place};
use super::declaration::{Declaration, Domain};
use super::domain::DomainStep;

/// Parallelograms or parallelepipeds that follow F.
pub struct Cpdi1;

impl Declaration for Cpdi1 {
    const WORD: &'static str = "cpdi1";
    const DOC: &'static str = "parallelogram domains that follow F: large rotations, extension";
    const DOMAIN: Domain = Domain::Parallelepiped;
    const NODES: [(usize, usize); 2] = [(8, 20), (30, 90)];

    fn of_deck(_edge: GimpEdge) -> Self {
        Cpdi1
    }
}

impl<const D: usize> Cornered<D> for Cpdi1 {
    fn places(points: &Points<D>, p: usize) -> [[f64; D]; 8] {
        corner_positions(points, p)
    }

    fn shares(points: &Points<D>, p: usize) -> Result<Corners<D>> {
        let edges = half_edges(points, p);
        let inverse = inverse(&edges).filter(|_| determinant(&edges) > 0.0).ok_or_else(|| {
            Error::Run(format!(
                "the CPDI domain of point {} at {:?} m is flat or inverted: half edges (columns) \
                 {edges:?} m; try smaller steps",
                points.id[p], points.position[p]
            ))
        })?;
        let share = 1.0 / f64::from(1u32 << D);
        let mut out = Corners {
            positions: positions(&points.position[p], &edges),
            weights: [0.0; 8],
            gradients: [[0.0; D]; 8],
        };
        for (corner, sign) in CORNER_SIGNS.iter().enumerate().take(1 << D) {
            out.weights[corner] = share;
            out.gradients[corner] = std::array::from_fn(|i| {
                share * inverse.iter().zip(sign).map(|(row, s)| s * row[i]).sum::<f64>()
            });
        }
        Ok(out)
    }

    fn check(
        step: &DomainStep<'_, D>,
        points: &Points<D>,
        p: usize,
        hint: &mut Option<usize>,
    ) -> Result<Option<[[f64; D]; 8]>> {
        let increment = dense::plus_unit(&step.increments[p]);
        let before = half_edges(points, p);
        let edges: [[f64; D]; D] = std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..D).map(|k| increment[i][k] * before[k][j]).sum())
        });
        let centre = std::array::from_fn(|a| points.position[p][a] + step.moved[p][a]);
        let moved = positions(&centre, &edges);
        for_each_place(step.grids[1], points, p, &moved, hint, |_, _| ())?;
        Ok(None)
    }
}

/// H_0, m: column j is the half edge j of the domain before any deformation. It is read from
/// the corners the point was seeded with, which `cpdi1` never moves (a sub-cell of a mesh gives
/// an oblique one); without any, it is the diagonal of the half lengths.
///
/// A sub-cell that is no parallelepiped is replaced by the one with the mean edges and the
/// point's volume.
pub fn half_edges_initial<const D: usize>(points: &Points<D>, p: usize) -> [[f64; D]; D] {
    let corners = &points.corners[p];
    let mut edges = [[0.0; D]; D];
    for (x, sign) in corners.iter().zip(&CORNER_SIGNS).take(1 << D) {
        for (row, x) in edges.iter_mut().zip(x) {
            for (entry, sign) in row.iter_mut().zip(sign) {
                *entry += sign * x / f64::from(1u32 << D);
            }
        }
    }
    let volume = f64::from(1u32 << D) * determinant(&edges);
    if volume > 0.0 {
        let ratio = points.volume_initial[p] / volume;
        if (ratio - 1.0).abs() > 1e-12 && ratio > 0.0 {
            let scale = ratio.powf(1.0 / D as f64);
            edges = edges.map(|row| row.map(|e| scale * e));
        }
        return edges;
    }
    let half = &points.half_length_initial[p];
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { half[i] } else { 0.0 }))
}

/// H = F H_0, m.
pub fn half_edges<const D: usize>(points: &Points<D>, p: usize) -> [[f64; D]; D] {
    let initial = half_edges_initial(points, p);
    let gradient = &points.deformation_gradient[p];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..D).map(|k| gradient[(i, k)] * initial[k][j]).sum())
    })
}

/// Corners of the domain as it is now, m.
pub fn corner_positions<const D: usize>(points: &Points<D>, p: usize) -> [[f64; D]; 8] {
    positions(&points.position[p], &half_edges(points, p))
}

fn positions<const D: usize>(centre: &[f64; D], edges: &[[f64; D]; D]) -> [[f64; D]; 8] {
    let mut corners = [[0.0; D]; 8];
    for (corner, sign) in corners.iter_mut().zip(&CORNER_SIGNS).take(1 << D) {
        *corner = std::array::from_fn(|i| {
            centre[i] + edges[i].iter().zip(sign).map(|(e, s)| e * s).sum::<f64>()
        });
    }
    corners
}
