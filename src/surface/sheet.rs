//! Elements on a line (2D) or plane (3D) through the material, fixed in space.

use super::{Element, norm};
use crate::deck::shape::Shape;

/// Elements per spacing of the points.
const CUTS: f64 = 2.0;
/// Material this near counts as being on the sheet, as a share of the spacing: the surface of a body
/// that lies on it, whatever round-off says.
const NEAR: f64 = 0.05;

/// A line from one place to another, or a parallelogram.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet<const D: usize> {
    corner: [f64; D],
    /// Its edges; the second is not used in 2D.
    edges: [[f64; D]; 2],
    normal: [f64; D],
}

impl<const D: usize> Sheet<D> {
    /// From two ends (2D) or three corners (3D), the first between the others; of some extent.
    pub fn new(corners: &[Vec<f64>]) -> Self {
        let at = |k: usize| -> [f64; D] { std::array::from_fn(|a| corners[k][a]) };
        let corner = at(0);
        let edge = |k: usize| -> [f64; D] {
            let end = at(k.min(corners.len() - 1));
            std::array::from_fn(|a| end[a] - corner[a])
        };
        let edges = [edge(1), edge(2)];
        let mut normal = [0.0; D];
        if D == 2 {
            (normal[0], normal[1]) = (edges[0][1], -edges[0][0]);
        } else {
            let [u, v] = edges;
            for (i, n) in normal.iter_mut().enumerate() {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                *n = u[j] * v[k] - u[k] * v[j];
            }
        }
        let size = norm(&normal);
        Sheet { corner, edges, normal: normal.map(|n| n / size) }
    }

    /// Whether the place on the sheet nearest to `x` lies within its edges.
    pub fn holds(&self, x: &[f64; D]) -> bool {
        let along = self.coordinates(x);
        along[..D - 1].iter().all(|s| (-1e-9..=1.0 + 1e-9).contains(s))
    }

    /// x - corner in the two edges, in the sense of least squares.
    fn coordinates(&self, x: &[f64; D]) -> [f64; 2] {
        let dot = |a: &[f64; D], b: &[f64; D]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let d: [f64; D] = std::array::from_fn(|a| x[a] - self.corner[a]);
        let [u, v] = &self.edges;
        if D == 2 {
            return [dot(&d, u) / dot(u, u), 0.0];
        }
        let (uu, uv, vv, du, dv) = (dot(u, u), dot(u, v), dot(v, v), dot(&d, u), dot(&d, v));
        let determinant = uu * vv - uv * uv;
        [(du * vv - dv * uv) / determinant, (dv * uu - du * uv) / determinant]
    }

    /// Elements where `shape` has material, of points `spacing` apart, m. `beyond`: on the whole line or
    /// plane, for material that may slide onto the sheet.
    pub fn elements(&self, shape: &Shape, spacing: f64, beyond: bool) -> Vec<Element<D>> {
        let Some((low, high)) = shape.bounds() else { return Vec::new() };
        let lengths = [norm(&self.edges[0]), if D == 2 { 1.0 } else { norm(&self.edges[1]) }];
        let counts: [usize; 2] = std::array::from_fn(|k| {
            let cuts = (CUTS * lengths[k] / spacing - 1e-6).ceil().max(1.0);
            if k + 1 >= D { 1 } else { cuts as usize }
        });
        // Numbers of the elements along each edge that the body may reach.
        let mut ranges = [[0i64, counts[0] as i64], [0i64, counts[1] as i64]];
        if beyond {
            let mut reach = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
            for corner in 0..1usize << D {
                let x =
                    std::array::from_fn(|a| if corner >> a & 1 == 0 { low[a] } else { high[a] });
                let at = self.coordinates(&x);
                for k in 0..D - 1 {
                    reach[k] = [reach[k][0].min(at[k]), reach[k][1].max(at[k])];
                }
            }
            for k in 0..D - 1 {
                let number = |s: f64| (s * counts[k] as f64).floor() as i64;
                ranges[k] = [number(reach[k][0]).min(0), number(reach[k][1]).max(0) + 1];
                ranges[k][1] = ranges[k][1].max(counts[k] as i64);
            }
        }
        let mut area = self.normal;
        let share = self.size() / (counts[0] * counts[1]) as f64;
        area.iter_mut().for_each(|a| *a *= share);
        let mut found = Vec::new();
        for j in ranges[1][0]..ranges[1][1] {
            for i in ranges[0][0]..ranges[0][1] {
                let at = [
                    (i as f64 + 0.5) / counts[0] as f64,
                    if D == 2 { 0.0 } else { (j as f64 + 0.5) / counts[1] as f64 },
                ];
                let place: [f64; D] = std::array::from_fn(|a| {
                    self.corner[a] + at[0] * self.edges[0][a] + at[1] * self.edges[1][a]
                });
                let beside = |sign: f64| -> [f64; D] {
                    std::array::from_fn(|a| place[a] + sign * NEAR * spacing * self.normal[a])
                };
                if shape.contains(&beside(1.0)) || shape.contains(&beside(-1.0)) {
                    found.push(Element { place, area });
                }
            }
        }
        found
    }

    /// Length or area, m or m2.
    fn size(&self) -> f64 {
        if D == 2 {
            return norm(&self.edges[0]);
        }
        let dot = |a: usize, b: usize| -> f64 {
            self.edges[a].iter().zip(&self.edges[b]).map(|(a, b)| a * b).sum()
        };
        (dot(0, 0) * dot(1, 1) - dot(0, 1).powi(2)).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::shape::Form;

    #[test]
    fn a_line_has_elements_where_the_body_is() {
        let body = Shape::new(Form::Box { min: vec![1.0, 0.0], max: vec![3.0, 1.0] });
        let area = |ends: [[f64; 2]; 2], beyond: bool| -> f64 {
            let sheet = Sheet::<2>::new(&ends.map(|end| end.to_vec()));
            sheet.elements(&body, 0.1, beyond).iter().map(|e| norm(&e.area)).sum()
        };
        assert!((area([[0.0, 0.0], [2.0, 0.0]], false) - 1.0).abs() < 1e-12);
        assert!((area([[0.0, 0.0], [2.0, 0.0]], true) - 2.0).abs() < 1e-12);
        assert!((area([[0.0, 0.5], [4.0, 0.5]], true) - 2.0).abs() < 1e-12);
        assert_eq!(area([[0.0, 1.5], [4.0, 1.5]], true), 0.0);
    }

    #[test]
    fn a_plane_knows_its_edges() {
        let corners = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
        let sheet = Sheet::<3>::new(&corners.map(|corner| corner.to_vec()));
        assert_eq!(sheet.size(), 2.0);
        assert!(sheet.holds(&[1.5, 0.5, 7.0]) && sheet.holds(&[0.0, 0.0, 1.0]));
        assert!(!sheet.holds(&[0.1, 0.5, 1.0]) && !sheet.holds(&[1.5, 1.1, 1.0]));
        let body = Shape::new(Form::Box { min: vec![-1.0; 3], max: vec![3.0; 3] });
        let found = sheet.elements(&body, 0.2, false);
        let area: f64 = found.iter().map(|e| e.area[2]).sum();
        assert!((area - 2.0).abs() < 1e-12, "{area}");
    }
}
