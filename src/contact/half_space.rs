//! g = (x - p) · n: everything on one side of a plane (2D: a line).

use super::facets::Facets;
use super::surface::{Near, Surface};
use crate::tensor::dense::dot;

#[derive(Debug, Clone)]
pub struct HalfSpace<const D: usize> {
    /// On the surface, m.
    pub point: [f64; D],
    /// Out of the rigid body, of length 1.
    pub normal: [f64; D],
}

impl<const D: usize> Surface<D> for HalfSpace<D> {
    fn near(&self, x: &[f64; D]) -> Near<D> {
        let from = std::array::from_fn(|i| x[i] - self.point[i]);
        Near { gap: dot(&from, &self.normal), normal: self.normal, curvature: [[0.0; D]; D] }
    }

    fn facets(&self, middle: &[f64; D], radius: f64) -> Facets<D> {
        let closest = self.near(middle).closest(middle);
        let n = self.normal;
        if D == 2 {
            let along: [f64; D] = std::array::from_fn(|i| if i == 0 { -n[1] } else { n[0] });
            let end = |sign: f64| std::array::from_fn(|i| closest[i] + sign * radius * along[i]);
            return Facets::polygon(vec![end(-1.0), end(1.0)], false);
        }
        Facets::revolved(&[[0.0, 0.0], [radius, 0.0]], &closest, &n)
    }

    fn bounds(&self) -> ([f64; D], [f64; D]) {
        ([f64::NEG_INFINITY; D], [f64::INFINITY; D])
    }
}
