//! A cone with a shaft, in 3D: its profile in the plane of the axis and the place, turned about the
//! axis. The normal turns about the axis, too: its curvature there is n_r / r.

use std::f64::consts::PI;

use super::facets::Facets;
use super::outline::Outline;
use super::solid::{Solid, about_axis};
use super::surface::{Near, Surface};

#[derive(Debug, Clone)]
pub struct Cone {
    /// m
    tip: [f64; 3],
    /// From the tip into the cone, of length 1.
    axis: [f64; 3],
    /// In coordinates (distance from the axis, along the axis from the tip).
    profile: Outline,
    radius: f64,
    /// Height of the cone alone, and with its shaft, m.
    point: f64,
    height: f64,
}

impl Cone {
    /// `angle` at the tip, degrees; `shaft`: length behind the cone, m. `None`: it has no volume.
    pub fn new(tip: [f64; 3], axis: [f64; 3], angle: f64, radius: f64, shaft: f64) -> Option<Self> {
        let height = radius / (0.5 * angle).to_radians().tan();
        let mut corners = vec![[0.0, 0.0], [radius, height]];
        if shaft > 0.0 {
            corners.push([radius, height + shaft]);
        }
        corners.push([0.0, height + shaft]);
        let profile = Outline::mirrored(&corners)?;
        Some(Cone { tip, axis, profile, radius, point: height, height: height + shaft })
    }
}

impl Surface<3> for Cone {
    fn near(&self, x: &[f64; 3]) -> Near<3> {
        let from: [f64; 3] = std::array::from_fn(|i| x[i] - self.tip[i]);
        let along = from.iter().zip(&self.axis).map(|(v, a)| v * a).sum::<f64>();
        let off: [f64; 3] = std::array::from_fn(|i| from[i] - along * self.axis[i]);
        let distance = super::surface::length(&off);
        let a = self.axis;
        let radial = if distance > 0.0 { off.map(|v| v / distance) } else { across(&a) };
        let flat = self.profile.near(&[distance, along]);
        let [n, m] = flat.normal;
        let [[rr, ra], [_, aa]] = flat.curvature;
        let hoop = if distance > 0.0 { n / distance } else { 0.0 };
        let normal = std::array::from_fn(|i| n * radial[i] + m * a[i]);
        let curvature = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let unit = if i == j { 1.0 } else { 0.0 };
                rr * radial[i] * radial[j]
                    + ra * (radial[i] * a[j] + a[i] * radial[j])
                    + aa * a[i] * a[j]
                    + hoop * (unit - radial[i] * radial[j] - a[i] * a[j])
            })
        });
        Near { gap: flat.gap, normal, curvature }
    }

    fn facets(&self, _: &[f64; 3], _: f64) -> Facets<3> {
        let mut profile = vec![[0.0, 0.0], [self.radius, self.point]];
        if self.height > self.point {
            profile.push([self.radius, self.height]);
        }
        profile.push([0.0, self.height]);
        Facets::revolved(&profile, &self.tip, &self.axis)
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let end = |sign: f64| {
            std::array::from_fn(|i| {
                // A disc across the axis reaches r sqrt(1 - a_i^2) along axis i.
                let wide = self.radius * (1.0 - self.axis[i] * self.axis[i]).max(0.0).sqrt();
                let ring = |along: f64| sign * (self.tip[i] + along * self.axis[i]) + wide;
                sign * (sign * self.tip[i]).max(ring(self.point)).max(ring(self.height))
            })
        };
        (end(-1.0), end(1.0))
    }

    /// The cone, whose centroid is at 3/4 of its height, and the cylinder.
    fn solid(&self) -> Option<Solid<3>> {
        let square = self.radius * self.radius;
        let shaft = self.height - self.point;
        let (sharp, round) = (PI * square * self.point / 3.0, PI * square * shaft);
        let volume = sharp + round;
        let (low, high) = (0.75 * self.point, self.point + 0.5 * shaft);
        let middle = (sharp * low + round * high) / volume;
        let about = 0.3 * sharp * square + 0.5 * round * square;
        let across = sharp
            * (3.0 / 80.0 * (4.0 * square + self.point * self.point) + (low - middle).powi(2))
            + round * ((3.0 * square + shaft * shaft) / 12.0 + (high - middle).powi(2));
        let centroid = std::array::from_fn(|i| self.tip[i] + middle * self.axis[i]);
        Some(Solid { volume, centroid, inertia: about_axis(&self.axis, about, across) })
    }
}

/// Some direction across `axis`.
fn across(axis: &[f64; 3]) -> [f64; 3] {
    let least = (0..3).min_by(|&i, &j| axis[i].abs().total_cmp(&axis[j].abs())).unwrap_or(0);
    let mut v: [f64; 3] = std::array::from_fn(|i| -axis[least] * axis[i]);
    v[least] += 1.0;
    let size = super::surface::length(&v);
    v.map(|v| v / size)
}
