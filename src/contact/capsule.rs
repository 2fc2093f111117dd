//! All within a radius of a segment.

use std::f64::consts::PI;

use super::facets::{Facets, half_circle};
use super::solid::{Solid, about_axis};
use super::surface::{Near, Surface, around_point};
use crate::tensor::dense::dot;

#[derive(Debug, Clone)]
pub struct Capsule<const D: usize> {
    /// Ends of the segment, m.
    pub from: [f64; D],
    pub to: [f64; D],
    /// m
    pub radius: f64,
}

impl<const D: usize> Surface<D> for Capsule<D> {
    fn near(&self, x: &[f64; D]) -> Near<D> {
        let along: [f64; D] = std::array::from_fn(|i| self.to[i] - self.from[i]);
        let beside: [f64; D] = std::array::from_fn(|i| x[i] - self.from[i]);
        let squared = dot(&along, &along);
        let share = if squared > 0.0 { dot(&beside, &along) / squared } else { 0.0 };
        let nearest = share.clamp(0.0, 1.0);
        let mut near = around_point(&std::array::from_fn(|i| beside[i] - nearest * along[i]), 1.0);
        if share > 0.0 && share < 1.0 && near.gap > 0.0 {
            // A cylinder does not curve along its axis.
            for i in 0..D {
                for j in 0..D {
                    near.curvature[i][j] -= along[i] * along[j] / (squared * near.gap);
                }
            }
        }
        Near { gap: near.gap - self.radius, ..near }
    }

    fn facets(&self, _: &[f64; D], _: f64) -> Facets<D> {
        let along: [f64; D] = std::array::from_fn(|i| self.to[i] - self.from[i]);
        let length = dot(&along, &along).sqrt();
        let mut axis = [0.0; D];
        axis[D - 1] = 1.0;
        if length > 0.0 {
            axis = along.map(|v| v / length);
        }
        let half = half_circle(self.radius);
        let (low, high) = half.split_at(half.len() / 2);
        let high = high.iter().map(|x| [x[0], x[1] + length]);
        let profile: Vec<[f64; 2]> = low.iter().copied().chain(high).collect();
        if D == 2 {
            let other = profile[1..profile.len() - 1].iter().rev().map(|x| [-x[0], x[1]]);
            let place = |[r, z]: [f64; 2]| {
                let beside = [axis[1], -axis[0]];
                std::array::from_fn(|i| self.from[i] + z * axis[i] + r * beside[i % 2])
            };
            let corners = profile.iter().copied().chain(other).map(place).collect();
            return Facets::polygon(corners, true);
        }
        Facets::revolved(&profile, &self.from, &axis)
    }

    fn bounds(&self) -> ([f64; D], [f64; D]) {
        let end = |sign: f64| {
            std::array::from_fn(|i| {
                let (a, b) = (sign * self.from[i], sign * self.to[i]);
                sign * (a.max(b) + self.radius)
            })
        };
        (end(-1.0), end(1.0))
    }

    /// A cylinder (2D: a rectangle) and two halves of a ball, c the distance of their centroids from
    /// their flat sides.
    fn solid(&self) -> Option<Solid<D>> {
        let along: [f64; D] = std::array::from_fn(|i| self.to[i] - self.from[i]);
        let (l, r) = (dot(&along, &along).sqrt(), self.radius);
        let centroid = std::array::from_fn(|i| 0.5 * (self.from[i] + self.to[i]));
        let (square, long) = (r * r, l * l);
        if D == 2 {
            let (middle, ends) = (2.0 * r * l, PI * square);
            let c = 4.0 * r / (3.0 * PI);
            let about =
                middle * (long + 4.0 * square) / 12.0 + ends * (0.5 * square + 0.25 * long + l * c);
            let inertia = about_axis(&[0.0; D], about, about);
            return Some(Solid { volume: middle + ends, centroid, inertia });
        }
        let (middle, ends) = (PI * square * l, 4.0 / 3.0 * PI * square * r);
        let about = 0.5 * middle * square + 0.4 * ends * square;
        let across = middle * (3.0 * square + long) / 12.0
            + ends * (0.4 * square + 0.25 * long + 3.0 / 8.0 * l * r);
        let inertia = about_axis(&along, about, across);
        Some(Solid { volume: middle + ends, centroid, inertia })
    }
}
