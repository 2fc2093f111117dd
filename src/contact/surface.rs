//! g(x), n = ∇g and ∇n of the signed distance g from a closed surface.

use std::fmt::Debug;

use super::facets::Facets;
use super::solid::Solid;
use crate::tensor::Square;

/// Distance of a place from a surface, with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Near<const D: usize> {
    /// g, m: the distance from the surface, negative inside the rigid body.
    pub gap: f64,
    /// n = ∇g, the outward normal at the closest point of the surface.
    pub normal: [f64; D],
    /// ∇n, 1/m.
    pub curvature: Square<D>,
}

impl<const D: usize> Near<D> {
    /// The closest point of the surface to `x`, m.
    pub fn closest(&self, x: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|i| x[i] - self.gap * self.normal[i])
    }
}

/// The surface of a rigid body where the deck puts it.
///
/// Where two parts of the surface are equally near, either may be the answer, but always the same one.
pub trait Surface<const D: usize>: Debug + Send + Sync {
    fn near(&self, x: &[f64; D]) -> Near<D>;

    /// Lower and upper corner of a box around it, m; infinite where it has no end.
    fn bounds(&self) -> ([f64; D], [f64; D]);

    /// What there is to see; of a surface without end as much as crosses a ball of the given radius
    /// around `middle`.
    fn facets(&self, middle: &[f64; D], radius: f64) -> Facets<D>;

    /// What it encloses; `None` where it has no end, or no volume is known.
    fn solid(&self) -> Option<Solid<D>> {
        None
    }
}

/// |v|
pub fn length<const D: usize>(v: &[f64; D]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// The distance from the centre `x - from` of a sphere of zero radius, with the curvature of the
/// spheres around it; `sign` -1 where the rigid body is outside of it. Along the last axis at the
/// centre itself.
pub fn around_point<const D: usize>(from: &[f64; D], sign: f64) -> Near<D> {
    let distance = length(from);
    let mut normal = [0.0; D];
    normal[D - 1] = sign;
    let mut curvature = [[0.0; D]; D];
    if distance > 0.0 {
        normal = from.map(|v| sign * v / distance);
        for i in 0..D {
            for j in 0..D {
                let unit = if i == j { 1.0 } else { 0.0 };
                curvature[i][j] = sign * (unit - normal[i] * normal[j]) / distance;
            }
        }
    }
    Near { gap: sign * distance, normal, curvature }
}
