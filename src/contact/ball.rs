//! g = |x - c| - r: a ball (2D: a disc).

use std::f64::consts::PI;

use super::facets::{Facets, half_circle};
use super::solid::{Solid, about_axis};
use super::surface::{Near, Surface, around_point};

#[derive(Debug, Clone)]
pub struct Ball<const D: usize> {
    /// m
    pub centre: [f64; D],
    /// m
    pub radius: f64,
}

impl<const D: usize> Surface<D> for Ball<D> {
    fn near(&self, x: &[f64; D]) -> Near<D> {
        let near = around_point(&std::array::from_fn(|i| x[i] - self.centre[i]), 1.0);
        Near { gap: near.gap - self.radius, ..near }
    }

    fn facets(&self, _: &[f64; D], _: f64) -> Facets<D> {
        let half = half_circle(self.radius);
        if D == 2 {
            let other = half[1..half.len() - 1].iter().rev().map(|x| [-x[0], x[1]]);
            let place = |x: [f64; 2]| std::array::from_fn(|i| self.centre[i] + x[i % 2]);
            let corners = half.iter().copied().chain(other).map(place).collect();
            return Facets::polygon(corners, true);
        }
        let axis = std::array::from_fn(|i| if i == D - 1 { 1.0 } else { 0.0 });
        Facets::revolved(&half, &self.centre, &axis)
    }

    fn bounds(&self) -> ([f64; D], [f64; D]) {
        (self.centre.map(|c| c - self.radius), self.centre.map(|c| c + self.radius))
    }

    fn solid(&self) -> Option<Solid<D>> {
        let r = self.radius;
        // Shares of r^2 in the inertia about an axis.
        let (volume, share) = match D {
            2 => (PI * r * r, 0.5),
            _ => (4.0 / 3.0 * PI * r * r * r, 0.4),
        };
        let about = share * volume * r * r;
        Some(Solid { volume, centroid: self.centre, inertia: about_axis(&[0.0; D], about, about) })
    }
}
