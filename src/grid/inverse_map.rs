//! xi with x(xi) = x: the reference coordinates of a place in a cell.

use super::element::inverse;
use super::lattice::CELL_CORNERS;
use crate::deck::model::Element;

/// The reference coordinates xi with x(xi) = `x`: direct for simplices, Newton otherwise.
/// `None` where the iteration leaves the neighbourhood of the cell or meets a singular J;
/// the answer may lie outside the reference cell. Error of xi: a few round-offs.
pub fn inverse_map<const D: usize>(
    element: Element,
    nodes: &[[f64; D]],
    x: &[f64; D],
) -> Option<[f64; D]> {
    inverse_map_from(element, nodes, x, element.reference_centre())
}

/// [`inverse_map`] that starts from reference coordinates near the ones looked for.
pub fn inverse_map_from<const D: usize>(
    element: Element,
    nodes: &[[f64; D]],
    x: &[f64; D],
    mut xi: [f64; D],
) -> Option<[f64; D]> {
    const STEPS: usize = 30;
    let map = Monomials::new(element, nodes);
    for _ in 0..STEPS {
        let (at, jacobian) = map.at(&xi);
        let inverse = inverse(&jacobian)?;
        let mut step = 0.0f64;
        for (xi, row) in xi.iter_mut().zip(&inverse) {
            let delta: f64 = (0..D).map(|k| row[k] * (x[k] - at[k])).sum();
            *xi += delta;
            step = step.max(delta.abs());
        }
        // The error left behind is of the order of step^2, and only products of coordinates make
        // it. A second pass removes the round-off of a long first one.
        if step < 1e-9 || (step < 1e-3 && map.curvature(&inverse) * step * step < 1e-17) {
            return Some(xi);
        }
        if !(xi.iter().all(|xi| xi.abs() < 8.0)) {
            return None;
        }
    }
    None
}

/// x(xi) = sum_k c_k m_k(xi) of one cell, m_k the product of the coordinates whose bits are set in
/// k: few operations per place, where the sums over nodes take many.
struct Monomials<const D: usize> {
    /// c_k, m; those of products are zero in a simplex.
    c: [[f64; D]; 8],
}

impl<const D: usize> Monomials<D> {
    #[inline]
    fn new(element: Element, nodes: &[[f64; D]]) -> Self {
        let mut c = [[0.0; D]; 8];
        if element.is_simplex() {
            c[0] = nodes[0];
            for axis in 0..D {
                c[1 << axis] = std::array::from_fn(|i| nodes[axis + 1][i] - nodes[0][i]);
            }
            return Monomials { c };
        }
        for (node, corner) in nodes.iter().zip(&CELL_CORNERS).take(1 << D) {
            c[(0..D).map(|axis| corner[axis] << axis).sum::<usize>()] = *node;
        }
        // Of each pair along an axis the mean and half the difference.
        for axis in 0..D {
            for low in (0..1 << D).filter(|k| k >> axis & 1 == 0) {
                let (a, b) = (c[low], c[low | 1 << axis]);
                c[low] = std::array::from_fn(|i| 0.5 * (a[i] + b[i]));
                c[low | 1 << axis] = std::array::from_fn(|i| 0.5 * (b[i] - a[i]));
            }
        }
        Monomials { c }
    }

    /// How much J^-1 J changes per unit of xi near the cell, from above.
    #[inline]
    fn curvature(&self, inverse: &[[f64; D]; D]) -> f64 {
        let mut sum = 0.0;
        for c in [3, 5, 6, 7].iter().take(if D == 2 { 1 } else { 4 }).map(|&k: &usize| &self.c[k]) {
            let change = |row: &[f64; D]| row.iter().zip(c).map(|(r, c)| r * c).sum::<f64>().abs();
            sum += inverse.iter().map(change).fold(0.0, f64::max);
        }
        // The third coordinate scales the product of all three.
        if D == 2 { sum } else { 8.0 * sum }
    }

    /// x and J_ij = dx_i/dxi_j at `xi`.
    #[inline]
    fn at(&self, xi: &[f64; D]) -> ([f64; D], [[f64; D]; D]) {
        let c = &self.c;
        let (mut x, mut j) = ([0.0; D], [[0.0; D]; D]);
        for i in 0..D {
            // Along the first axis, in the plane of the first two, and beyond it.
            let line = |k: usize| c[k][i] + c[k + 1][i] * xi[0];
            let plane = |k: usize| line(k) + line(k + 2) * xi[1];
            x[i] = plane(0);
            j[i][0] = c[1][i] + c[3][i] * xi[1];
            j[i][1] = line(2);
            if D == 3 {
                x[i] += plane(4) * xi[2];
                j[i][0] += (c[5][i] + c[7][i] * xi[1]) * xi[2];
                j[i][1] += line(6) * xi[2];
                j[i][2] = plane(4);
            }
        }
        (x, j)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::element::{gradients, position};
    use proptest::prelude::*;

    fn distorted_quad() -> Vec<[f64; 2]> {
        vec![[0.1, -0.2], [2.0, 0.3], [1.7, 1.9], [-0.3, 1.2]]
    }

    fn distorted_hex() -> Vec<[f64; 3]> {
        (0..8)
            .map(|a| {
                let r = Element::Hex8.reference_node::<3>(a);
                let wobble = [0.17, -0.11, 0.05, 0.2, -0.15, 0.08, 0.1, -0.2][a];
                [r[0] + wobble, 0.7 * r[1] - wobble + 0.3 * r[0], 1.3 * r[2] + 0.5 * wobble]
            })
            .collect()
    }

    fn check<const D: usize>(element: Element, nodes: &[[f64; D]], xi: [f64; D]) {
        let x = position(element, nodes, &xi);
        let found = inverse_map(element, nodes, &x).unwrap();
        for a in 0..D {
            assert!((found[a] - xi[a]).abs() < 1e-12, "{element:?} {xi:?} {found:?}");
        }
        // Partition of unity and linear reproduction of the gradients.
        let n = element.shape(&xi);
        assert!((n.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        let (dn, _) = gradients(element, nodes, &xi).unwrap();
        for i in 0..D {
            for j in 0..D {
                let d: f64 = nodes.iter().zip(&dn).map(|(x, dn)| x[i] * dn[j]).sum();
                assert!((d - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
    }

    proptest! {
        #[test]
        fn inverse_map_undoes_the_map_inside_and_near_the_cell(a in -1.3..1.3f64, b in -1.3..1.3f64, c in -1.3..1.3f64) {
            check(Element::Quad4, &distorted_quad(), [a, b]);
            check(Element::Hex8, &distorted_hex(), [a, b, c]);
            check(Element::Tri3, &distorted_quad()[..3], [a, b]);
            let hex = distorted_hex();
            check(Element::Tet4, &[hex[0], hex[1], hex[3], hex[4]], [a, b, c]);
        }
    }
}
