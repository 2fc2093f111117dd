//! The signed distance from a closed polygon, whose nearest part is an edge or a corner.
//!
//! A place that is nearest to a corner lies between the normals of the edges that meet there, outside
//! where the corner points outwards and inside where it points inwards: the sum of both normals tells
//! the side.

use super::facets::Facets;
use super::solid::{Solid, about_axis};
use super::surface::{Near, Surface, around_point};

/// Corners in order, counter-clockwise, m.
#[derive(Debug, Clone)]
pub struct Outline {
    corners: Vec<[f64; 2]>,
    /// Outward normal of the edge that begins at each corner.
    normals: Vec<[f64; 2]>,
}

impl Outline {
    /// Of three or more corners in either sense of rotation. `None`: it has no area, or a corner
    /// twice in a row.
    pub fn new(corners: &[[f64; 2]]) -> Option<Self> {
        let mut corners = corners.to_vec();
        let count = corners.len();
        let area: f64 = (0..count)
            .map(|k| {
                let (a, b) = (corners[k], corners[(k + 1) % count]);
                0.5 * (a[0] * b[1] - a[1] * b[0])
            })
            .sum();
        let repeated = (0..count).any(|k| corners[k] == corners[(k + 1) % count]);
        if count < 3 || area == 0.0 || !area.is_finite() || repeated {
            return None;
        }
        if area < 0.0 {
            corners.reverse();
        }
        let normals = (0..count)
            .map(|k| {
                let (a, b) = (corners[k], corners[(k + 1) % count]);
                let length = (b[0] - a[0]).hypot(b[1] - a[1]);
                [(b[1] - a[1]) / length, (a[0] - b[0]) / length]
            })
            .collect();
        Some(Outline { corners, normals })
    }

    /// The profile of a body of revolution about x = 0, with its mirror image: the edge on the axis
    /// is no surface. As it is where it has none, or several.
    pub fn mirrored(corners: &[[f64; 2]]) -> Option<Self> {
        let count = corners.len();
        let on_axis = |k: usize| corners[k % count][0] == 0.0 && corners[(k + 1) % count][0] == 0.0;
        let mut axis = (0..count).filter(|&k| on_axis(k));
        let (Some(last), None) = (axis.next(), axis.next()) else { return Self::new(corners) };
        let half: Vec<[f64; 2]> = (1..=count).map(|k| corners[(last + k) % count]).collect();
        let other = half[1..count - 1].iter().rev().map(|x| [-x[0], x[1]]);
        let whole: Vec<[f64; 2]> = half.iter().copied().chain(other).collect();
        Self::new(&whole)
    }

    /// The signed distance at a place.
    pub fn near(&self, x: &[f64; 2]) -> Near<2> {
        let count = self.corners.len();
        let mut best = f64::INFINITY;
        let mut near = Near { gap: best, normal: [0.0, 1.0], curvature: [[0.0; 2]; 2] };
        for k in 0..count {
            let (a, b) = (self.corners[k], self.corners[(k + 1) % count]);
            let (along, from) = ([b[0] - a[0], b[1] - a[1]], [x[0] - a[0], x[1] - a[1]]);
            let squared = along[0] * along[0] + along[1] * along[1];
            let share = (from[0] * along[0] + from[1] * along[1]) / squared;
            let normal = self.normals[k];
            if (0.0..=1.0).contains(&share) {
                let gap = from[0] * normal[0] + from[1] * normal[1];
                if gap.abs() <= best {
                    best = gap.abs();
                    near = Near { gap, normal, curvature: [[0.0; 2]; 2] };
                }
            }
            let distance = from[0].hypot(from[1]);
            if distance < best {
                best = distance;
                let before = self.normals[(k + count - 1) % count];
                let out = from[0] * (normal[0] + before[0]) + from[1] * (normal[1] + before[1]);
                near = around_point(&from, if out >= 0.0 { 1.0 } else { -1.0 });
            }
        }
        near
    }
}

impl Surface<2> for Outline {
    fn near(&self, x: &[f64; 2]) -> Near<2> {
        Outline::near(self, x)
    }

    fn facets(&self, _: &[f64; 2], _: f64) -> Facets<2> {
        Facets::polygon(self.corners.clone(), true)
    }

    fn bounds(&self) -> ([f64; 2], [f64; 2]) {
        let end = |axis: usize, sign: f64| {
            let along = self.corners.iter().map(|x| sign * x[axis]);
            sign * along.fold(f64::NEG_INFINITY, f64::max)
        };
        ([end(0, -1.0), end(1, -1.0)], [end(0, 1.0), end(1, 1.0)])
    }

    /// Sums over the triangles between the origin of a corner and the edges.
    fn solid(&self) -> Option<Solid<2>> {
        let origin = self.corners[0];
        let count = self.corners.len();
        let (mut volume, mut first, mut second) = (0.0, [0.0; 2], 0.0);
        for k in 0..count {
            let from = |k: usize| -> [f64; 2] {
                std::array::from_fn(|i| self.corners[k % count][i] - origin[i])
            };
            let (a, b) = (from(k), from(k + 1));
            let twice = a[0] * b[1] - a[1] * b[0];
            volume += 0.5 * twice;
            for i in 0..2 {
                first[i] += twice * (a[i] + b[i]) / 6.0;
                second += twice * (a[i] * a[i] + a[i] * b[i] + b[i] * b[i]) / 12.0;
            }
        }
        let middle = first.map(|v| v / volume);
        let about = second - volume * (middle[0] * middle[0] + middle[1] * middle[1]);
        let centroid = [origin[0] + middle[0], origin[1] + middle[1]];
        Some(Solid { volume, centroid, inertia: about_axis(&[0.0; 2], about, about) })
    }
}
