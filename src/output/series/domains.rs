//! The sub-domain of each point as a polygon or brick, so that it can be seen.
//!
//! | basis | corners |
//! |---|---|
//! | `mpm` | none: a point |
//! | `gimp` | x -/+ l_p along each axis |
//! | `cpdi1` | the parallelogram that [`crate::basis::cpdi1::corner_positions`] works with |
//! | `cpdi2` | the corners that the point carries |

use super::frame::Topology;
use super::point_field::append_vector;
use crate::basis;
use crate::basis::Domain;
use crate::deck::model::{Basis, GimpEdge};
use crate::points::Points;

/// The shape of one sub-domain in space of `dimension`; `None` for a basis without domains.
pub fn topology(basis: Basis, dimension: usize) -> Option<Topology> {
    match (basis.domain(), dimension) {
        (Domain::None, _) => None,
        (_, 2) => Some(Topology::Quadrilateral),
        _ => Some(Topology::Hexahedron),
    }
}

/// The 2^D corners of point `p`'s domain, counter-clockwise, hex8 order in 3D; the point itself
/// repeated for `mpm`.
pub fn corners<const D: usize>(points: &Points<D>, basis: Basis, p: usize) -> [[f64; D]; 8] {
    let basis = basis::of_deck(basis, GimpEdge::Continued);
    basis.corners(points, p).unwrap_or([points.position[p]; 8])
}

/// Three columns per corner, 2^D corners per point.
pub fn corner_rows<const D: usize>(points: &Points<D>, basis: Basis) -> Vec<f64> {
    let mut rows = Vec::with_capacity(points.len() * (3 << D));
    for p in 0..points.len() {
        for corner in corners(points, basis, p).iter().take(1 << D) {
            append_vector(corner, &mut rows);
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    #[test]
    fn cpdi1_carries_the_rectangle_with_f_and_gimp_does_not() {
        let mut points = Points::<2>::default();
        points.push_unstrained(0, 0, [1.0, 1.0], 0.08, 1.0, [0.2, 0.1]);
        // a quarter turn
        points.deformation_gradient[0] = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let flat = |points: &Points<2>, basis| corner_rows(points, basis);
        let expected = [1.1, 0.8, 0.0, 1.1, 1.2, 0.0, 0.9, 1.2, 0.0, 0.9, 0.8, 0.0];
        for (value, expected) in flat(&points, Basis::Cpdi1).iter().zip(expected) {
            approx::assert_relative_eq!(*value, expected, epsilon = 1e-15);
        }
        let expected = [0.8, 0.9, 0.0, 1.2, 0.9, 0.0, 1.2, 1.1, 0.0, 0.8, 1.1, 0.0];
        for (value, expected) in flat(&points, Basis::Gimp).iter().zip(expected) {
            approx::assert_relative_eq!(*value, expected, epsilon = 1e-15);
        }
        assert_eq!(
            flat(&points, Basis::Cpdi2),
            flat(&points, Basis::Gimp),
            "an unmoved CPDI2 domain"
        );
        // a sub-cell of a mesh: an oblique domain, turned likewise
        points.corners[0][..4].copy_from_slice(&[[0.9, 0.8], [1.3, 0.8], [1.1, 1.2], [0.7, 1.2]]);
        points.volume_initial[0] = 0.16;
        let expected = [1.2, 0.9, 0.0, 1.2, 1.3, 0.0, 0.8, 1.1, 0.0, 0.8, 0.7, 0.0];
        for (value, expected) in flat(&points, Basis::Cpdi1).iter().zip(expected) {
            approx::assert_relative_eq!(*value, expected, epsilon = 1e-15);
        }
        assert_eq!(topology(Basis::Mpm, 2), None);
        assert_eq!(topology(Basis::Cpdi2, 3), Some(Topology::Hexahedron));
    }
}
