//! Surfaces as segments (2D) or triangles (3D), to be looked at.

use std::f64::consts::TAU;

/// Pieces of a whole turn.
const AROUND: usize = 48;

/// Corners, m, and the facets between them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Facets<const D: usize> {
    pub corners: Vec<[f64; D]>,
    pub facets: Vec<[usize; D]>,
}

impl<const D: usize> Facets<D> {
    /// 2D: the polygon of these corners, which is open unless `closed`.
    pub fn polygon(corners: Vec<[f64; D]>, closed: bool) -> Self {
        let count = corners.len();
        let last = if closed { count } else { count - 1 };
        let facets = (0..last).map(|k| std::array::from_fn(|a| (k + a) % count)).collect();
        Facets { corners, facets }
    }

    /// 3D: the profile of places (distance from the axis, along it from `origin`) turned about `axis`,
    /// of length one.
    pub fn revolved(profile: &[[f64; 2]], origin: &[f64; D], axis: &[f64; D]) -> Self {
        let least = (0..D).min_by(|&i, &j| axis[i].abs().total_cmp(&axis[j].abs())).unwrap_or(0);
        let mut first: [f64; D] = std::array::from_fn(|i| -axis[least] * axis[i]);
        first[least] += 1.0;
        let size = super::surface::length(&first);
        first.iter_mut().for_each(|v| *v /= size);
        let second: [f64; D] = std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % D, (i + 2) % D);
            axis[j] * first[k] - axis[k] * first[j]
        });
        let mut made = Facets::default();
        for [r, z] in profile {
            for k in 0..AROUND {
                let (sin, cos) = (TAU * k as f64 / AROUND as f64).sin_cos();
                made.corners.push(std::array::from_fn(|i| {
                    origin[i] + z * axis[i] + r * (cos * first[i] + sin * second[i])
                }));
            }
        }
        for ring in 0..profile.len() - 1 {
            for k in 0..AROUND {
                let at = |up: usize, on: usize| (ring + up) * AROUND + (k + on) % AROUND;
                let square = [at(0, 0), at(0, 1), at(1, 1), at(1, 0)];
                made.facets.push(std::array::from_fn(|a| square[a % 4]));
                made.facets.push(std::array::from_fn(|a| square[(a + 2) % 4]));
            }
        }
        made
    }

    /// Appends others.
    pub fn add(&mut self, other: Facets<D>) {
        let first = self.corners.len();
        self.corners.extend(other.corners);
        self.facets.extend(other.facets.into_iter().map(|facet| facet.map(|k| first + k)));
    }
}

/// Half a circle from -90 to 90 degrees: places (distance from the axis, along it), `radius` about 0.
pub fn half_circle(radius: f64) -> Vec<[f64; 2]> {
    let angle = |k: usize| 0.5 * TAU * k as f64 / (AROUND / 2) as f64;
    (0..=AROUND / 2).map(|k| [radius * angle(k).sin(), -radius * angle(k).cos()]).collect()
}
