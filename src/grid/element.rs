//! x(xi) = sum_a N_a(xi) x_a: shape functions, derivatives, faces and Jacobians of the cells.
//!
//! | element | reference cell | nodes |
//! |---|---|---|
//! | `tri3` | xi, eta >= 0, xi + eta <= 1 | origin, then along each axis |
//! | `quad4` | [-1, 1]^2 | counter-clockwise from (-, -) |
//! | `tet4` | xi, eta, zeta >= 0, sum <= 1 | origin, then along each axis |
//! | `hex8` | [-1, 1]^3 | `quad4` below, then above |
//!
//! This is Gmsh's order, and a lattice cell's. Arrays of eight are filled up to the element's
//! node count and zero beyond.

pub use crate::deck::model::Element;

use super::lattice::{CELL_CORNERS, CORNER_SIGNS};

const TRI_FACES: [&[usize]; 3] = [&[0, 1], &[1, 2], &[2, 0]];
const QUAD_FACES: [&[usize]; 4] = [&[0, 1], &[1, 2], &[2, 3], &[3, 0]];
const TET_FACES: [&[usize]; 4] = [&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]];
const HEX_FACES: [&[usize]; 6] =
    [&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];

impl Element {
    /// Space dimension.
    pub fn dimension(self) -> usize {
        match self {
            Element::Tri3 | Element::Quad4 => 2,
            Element::Tet4 | Element::Hex8 => 3,
        }
    }

    /// Nodes of the element.
    pub fn node_count(self) -> usize {
        match self {
            Element::Tri3 => 3,
            Element::Quad4 | Element::Tet4 => 4,
            Element::Hex8 => 8,
        }
    }

    /// Whether it is a triangle or a tetrahedron.
    pub fn is_simplex(self) -> bool {
        matches!(self, Element::Tri3 | Element::Tet4)
    }

    /// Local nodes of each face, outward (edges counter-clockwise in 2D).
    pub fn faces(self) -> &'static [&'static [usize]] {
        match self {
            Element::Tri3 => &TRI_FACES,
            Element::Quad4 => &QUAD_FACES,
            Element::Tet4 => &TET_FACES,
            Element::Hex8 => &HEX_FACES,
        }
    }

    /// Reference coordinates of a local node.
    pub fn reference_node<const D: usize>(self, node: usize) -> [f64; D] {
        if self.is_simplex() {
            std::array::from_fn(|a| if a + 1 == node { 1.0 } else { 0.0 })
        } else {
            std::array::from_fn(|a| CORNER_SIGNS[node][a])
        }
    }

    /// Measure of the reference cell.
    pub fn reference_measure(self) -> f64 {
        match self {
            Element::Tri3 => 0.5,
            Element::Quad4 => 4.0,
            Element::Tet4 => 1.0 / 6.0,
            Element::Hex8 => 8.0,
        }
    }

    /// Its middle in reference coordinates.
    pub fn reference_centre<const D: usize>(self) -> [f64; D] {
        [if self.is_simplex() { 1.0 / (D as f64 + 1.0) } else { 0.0 }; D]
    }

    /// How far `xi` is outside the reference cell, as a fraction of the cell's extent: the
    /// length of the excess over all faces. Zero on a face; inside, minus the distance to the
    /// nearest one.
    pub fn outside<const D: usize>(self, xi: &[f64; D]) -> f64 {
        let excess = |axis: usize| {
            if self.is_simplex() { -xi[axis] } else { 0.5 * (xi[axis].abs() - 1.0) }
        };
        let oblique =
            if self.is_simplex() { xi.iter().sum::<f64>() - 1.0 } else { f64::NEG_INFINITY };
        let (mut worst, mut squares) = (oblique, oblique.max(0.0).powi(2));
        for axis in 0..D {
            worst = worst.max(excess(axis));
            squares += excess(axis).max(0.0).powi(2);
        }
        if worst > 0.0 { squares.sqrt() } else { worst }
    }

    /// The face that `xi` is furthest beyond (inside: the nearest one), an index of
    /// [`Self::faces`].
    pub fn face_towards<const D: usize>(self, xi: &[f64; D]) -> usize {
        // Per dimension: the face where coordinate `axis` of a simplex is zero; the lower and
        // upper face along `axis` of a box.
        const ZERO: [[usize; 3]; 2] = [[2, 0, 0], [3, 1, 0]];
        const ENDS: [[[usize; 2]; 3]; 2] = [[[3, 1], [0, 2], [0, 0]], [[5, 3], [2, 4], [0, 1]]];
        let (mut worst, mut towards) = (f64::NEG_INFINITY, 0);
        let mut consider = |excess: f64, face: usize| {
            if excess > worst {
                (worst, towards) = (excess, face);
            }
        };
        if self.is_simplex() {
            consider(xi.iter().sum::<f64>() - 1.0, D - 1);
        }
        for axis in 0..D {
            if self.is_simplex() {
                consider(-xi[axis], ZERO[D - 2][axis]);
            } else {
                let [lower, upper] = ENDS[D - 2][axis];
                consider(-1.0 - xi[axis], lower);
                consider(xi[axis] - 1.0, upper);
            }
        }
        towards
    }

    /// N_a(xi).
    pub fn shape<const D: usize>(self, xi: &[f64; D]) -> [f64; 8] {
        let mut n = [0.0; 8];
        if self.is_simplex() {
            n[0] = 1.0 - xi.iter().sum::<f64>();
            n[1..=D].copy_from_slice(xi);
        } else {
            for (n, corner) in n.iter_mut().zip(&CELL_CORNERS).take(1 << D) {
                *n = (0..D).map(|a| half(corner[a], xi[a])).product();
            }
        }
        n
    }

    /// dN_a/dxi_j.
    pub fn shape_gradients<const D: usize>(self, xi: &[f64; D]) -> [[f64; D]; 8] {
        let mut dn = [[0.0; D]; 8];
        if self.is_simplex() {
            dn[0] = [-1.0; D];
            for axis in 0..D {
                dn[axis + 1][axis] = 1.0;
            }
        } else {
            for (dn, corner) in dn.iter_mut().zip(&CELL_CORNERS).take(1 << D) {
                *dn = std::array::from_fn(|j| {
                    let others = (0..D).filter(|&a| a != j).map(|a| half(corner[a], xi[a]));
                    (corner[j] as f64 - 0.5) * others.product::<f64>()
                });
            }
        }
        dn
    }
}

/// (1 -/+ xi)/2, one at the lower or upper end.
fn half(upper: usize, xi: f64) -> f64 {
    0.5 * if upper == 1 { 1.0 + xi } else { 1.0 - xi }
}

/// x(xi), m, of the cell with the given node positions.
pub fn position<const D: usize>(element: Element, nodes: &[[f64; D]], xi: &[f64; D]) -> [f64; D] {
    let n = element.shape(xi);
    let mut x = [0.0; D];
    for (n, node) in n.iter().zip(nodes) {
        for (x, node) in x.iter_mut().zip(node) {
            *x += n * node;
        }
    }
    x
}

/// J_ij = dx_i/dxi_j, from derivatives of the shape functions.
pub fn jacobian<const D: usize>(nodes: &[[f64; D]], dn: &[[f64; D]; 8]) -> [[f64; D]; D] {
    let mut j = [[0.0; D]; D];
    for (node, dn) in nodes.iter().zip(dn) {
        for (row, x) in j.iter_mut().zip(node) {
            for (entry, d) in row.iter_mut().zip(dn) {
                *entry += x * d;
            }
        }
    }
    j
}

/// dN_a/dx_i = dN_a/dxi_j (J^-1)_ji and det J at `xi`; `None` where J is singular.
pub fn gradients<const D: usize>(
    element: Element,
    nodes: &[[f64; D]],
    xi: &[f64; D],
) -> Option<([[f64; D]; 8], f64)> {
    let dn = element.shape_gradients(xi);
    let j = jacobian(nodes, &dn);
    let inverse = inverse(&j)?;
    let mut out = [[0.0; D]; 8];
    for (out, dn) in out.iter_mut().zip(&dn).take(nodes.len()) {
        for (i, out) in out.iter_mut().enumerate() {
            *out = (0..D).map(|k| dn[k] * inverse[k][i]).sum();
        }
    }
    Some((out, determinant(&j)))
}

/// Determinant of a 2 x 2 or 3 x 3 matrix, rows first.
pub(crate) fn determinant<const D: usize>(m: &[[f64; D]; D]) -> f64 {
    if D == 2 {
        m[0][0] * m[1][1] - m[0][1] * m[1][0]
    } else {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
            - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    }
}

/// Inverse of a 2 x 2 or 3 x 3 matrix; `None` if the determinant is zero or not finite.
pub(crate) fn inverse<const D: usize>(m: &[[f64; D]; D]) -> Option<[[f64; D]; D]> {
    let det = determinant(m);
    if det == 0.0 || !det.is_finite() {
        return None;
    }
    let mut out = [[0.0; D]; D];
    for (i, row) in out.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            // Cyclic cofactor of entry (j, i): the sign is built in.
            let cofactor = if D == 2 {
                let sign = if i == j { 1.0 } else { -1.0 };
                sign * m[1 - j][1 - i]
            } else {
                let (r, s, c, d) = ((j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3);
                m[r][c] * m[s][d] - m[r][d] * m[s][c]
            };
            *entry = cofactor / det;
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_are_named_by_the_side_they_are_on() {
        fn each<const D: usize>(element: Element) {
            let inside = element.reference_centre::<D>();
            for (face, nodes) in element.faces().iter().enumerate() {
                let middle: [f64; D] = std::array::from_fn(|a| {
                    let sum = nodes.iter().map(|&n| element.reference_node::<D>(n)[a]).sum::<f64>();
                    sum / nodes.len() as f64
                });
                for reach in [0.9, 1.0, 2.5] {
                    let xi: [f64; D] =
                        std::array::from_fn(|a| inside[a] + reach * (middle[a] - inside[a]));
                    assert_eq!(element.face_towards(&xi), face, "{element:?} {xi:?}");
                }
            }
        }
        each::<2>(Element::Tri3);
        each::<2>(Element::Quad4);
        each::<3>(Element::Tet4);
        each::<3>(Element::Hex8);
    }

    #[test]
    fn shape_gradients_are_the_derivatives_of_the_shapes() {
        let h = 1e-6;
        let xi = [0.21, 0.34, -0.47];
        for element in [Element::Tet4, Element::Hex8] {
            let exact = element.shape_gradients(&xi);
            for axis in 0..3 {
                let (mut up, mut down) = (xi, xi);
                up[axis] += h;
                down[axis] -= h;
                let (up, down) = (element.shape(&up), element.shape(&down));
                for a in 0..element.node_count() {
                    assert!(((up[a] - down[a]) / (2.0 * h) - exact[a][axis]).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn nodes_carry_one_and_faces_point_outward() {
        fn nodes<const D: usize>(element: Element) {
            for a in 0..element.node_count() {
                let n = element.shape(&element.reference_node::<D>(a));
                for (b, n) in n.iter().enumerate() {
                    assert_eq!(*n, f64::from(u8::from(a == b)));
                }
            }
        }
        nodes::<2>(Element::Tri3);
        nodes::<2>(Element::Quad4);
        nodes::<3>(Element::Tet4);
        nodes::<3>(Element::Hex8);
        for element in [Element::Tet4, Element::Hex8] {
            for face in element.faces() {
                let p: Vec<[f64; 3]> = face.iter().map(|&a| element.reference_node(a)).collect();
                let c = element.reference_centre::<3>();
                let [u, v, w] = [p[1], p[2], c].map(|q| std::array::from_fn(|i| q[i] - p[0][i]));
                // The centre lies below the face's plane.
                assert!(determinant::<3>(&[u, v, w]) < 0.0, "{element:?} {face:?}");
            }
        }
    }

    #[test]
    fn outside_is_a_fraction_of_the_extent() {
        assert_eq!(Element::Quad4.outside(&[1.5, 0.0]), 0.25);
        assert_eq!(Element::Hex8.outside(&[0.0, 0.0, -1.0]), 0.0);
        assert_eq!(Element::Tri3.outside(&[0.25, -0.125]), 0.125);
        assert_eq!(Element::Tet4.outside(&[0.25, 0.25, 0.25]), -0.25);
        assert_eq!(Element::Tri3.outside(&[1.0, 0.25]), 0.25);
        assert_eq!(Element::Quad4.outside(&[1.6, -1.8]), 0.5);
    }
}
