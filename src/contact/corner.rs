//! Corners of the points' domains, and what each bears of the surface: half (3D: a quarter) of the
//! domain's sides, as they are seen along the normal. A point of `mpm` bears a side of its volume.
//!
//! Boxes along the axes make stairs of a surface that tilts. So the corners of a `gimp` domain are those
//! of its first box moved by F, no further from the point along an axis than twice the domain reaches.

use std::f64::consts::TAU;

use crate::basis::Domain;
use crate::basis::cpdi1;
use crate::deck::model::Basis;
use crate::grid::lattice::CORNER_SIGNS;
use crate::points::Points;

/// The corners of a point's domain at the step's start.
#[derive(Debug, Clone, Copy)]
pub struct DomainCorners<const D: usize> {
    /// m; the first `count` count.
    pub positions: [[f64; D]; 8],
    pub count: usize,
    /// Mean edges, m.
    pub edges: [[f64; D]; D],
    /// Radius of the point, m, where the domains are sections of rings.
    radius: Option<f64>,
}

impl<const D: usize> DomainCorners<D> {
    pub fn of(basis: Basis, rings: bool, points: &Points<D>, p: usize) -> Self {
        let radius = rings.then(|| points.position[p][0]);
        let x = points.position[p];
        let positions = match basis.domain() {
            Domain::None => {
                let size = if rings { points.section(p) } else { points.volume(p) };
                let side = size.abs().powf(1.0 / D as f64);
                let edges = std::array::from_fn(|i| {
                    std::array::from_fn(|j| if i == j { side } else { 0.0 })
                });
                let mut positions = [[0.0; D]; 8];
                positions[0] = x;
                return DomainCorners { positions, count: 1, edges, radius };
            }
            Domain::Box => tilted(points, p),
            Domain::Parallelepiped => cpdi1::corner_positions(points, p),
            Domain::Corners => points.corners[p],
        };
        // Corner 0 is the lowest one; its neighbours are 1, 3 and, in 3D, 4.
        let mut edges = [[0.0; D]; D];
        let count = 1 << D;
        for (edge, axis) in edges.iter_mut().zip(0..) {
            for (corner, place) in positions.iter().enumerate().take(count) {
                let sign = CORNER_SIGNS[corner][axis];
                for (e, v) in edge.iter_mut().zip(place) {
                    *e += 2.0 * sign * v / count as f64;
                }
            }
        }
        DomainCorners { positions, count, edges, radius }
    }

    /// Largest distance of a corner from the point, m.
    pub fn reach(&self, x: &[f64; D]) -> f64 {
        let squared = |corner: &[f64; D]| -> f64 {
            corner.iter().zip(x).map(|(c, x)| (c - x) * (c - x)).sum()
        };
        self.positions[..self.count].iter().map(squared).fold(0.0, f64::max).sqrt()
    }

    /// What a corner bears of a surface with this normal, m2 (m in plane strain).
    pub fn area(&self, corner: usize, normal: &[f64; D]) -> f64 {
        let e = &self.edges;
        let seen: f64 = match D {
            // |edge x n|
            2 => e.iter().map(|e| (e[0] * normal[1] - e[1] * normal[0]).abs()).sum(),
            _ => (0..3)
                .map(|k| {
                    let (a, b) = (&e[k], &e[(k + 1) % 3]);
                    let cross = |i: usize| {
                        let (j, l) = ((i + 1) % 3, (i + 2) % 3);
                        a[j] * b[l] - a[l] * b[j]
                    };
                    (0..3).map(|i| cross(i) * normal[i]).sum::<f64>().abs()
                })
                .sum(),
        };
        let flat = if self.count == 1 { seen } else { seen / (1 << (D - 1)) as f64 };
        // 2 pi times the mean radius under the linear share of the corner: a third of the way to it.
        let around = |middle: f64| TAU * (2.0 * middle + self.positions[corner][0]) / 3.0;
        flat * self.radius.map_or(1.0, around)
    }
}

/// x + F d for the half diagonals d of the first box.
fn tilted<const D: usize>(points: &Points<D>, p: usize) -> [[f64; D]; 8] {
    let (x, gradient) = (&points.position[p], &points.deformation_gradient[p]);
    let (first, now) = (&points.half_length_initial[p], &points.half_length[p]);
    let mut corners = [[0.0; D]; 8];
    for (corner, sign) in corners.iter_mut().zip(&CORNER_SIGNS).take(1 << D) {
        let arm: [f64; D] =
            std::array::from_fn(|i| (0..D).map(|j| gradient[(i, j)] * sign[j] * first[j]).sum());
        let too_far = (0..D).map(|i| arm[i].abs() / (2.0 * now[i])).fold(1.0, f64::max);
        *corner = std::array::from_fn(|i| x[i] + arm[i] / too_far);
    }
    corners
}

/// No corner of a domain of `gimp` is further from its point, m.
pub fn farthest<const D: usize>(points: &Points<D>, p: usize) -> f64 {
    let (gradient, first) = (&points.deformation_gradient[p], &points.half_length_initial[p]);
    let along = |i: usize| (0..D).map(|j| gradient[(i, j)].abs() * first[j]).sum::<f64>();
    (0..D).map(|i| along(i) * along(i)).sum::<f64>().sqrt()
}
