//! f_p = c q(y) A_p n with q(y) = rho v(y)^2 / 2 and v(y) = v_10 (y / 10 m)^a: pressure of wind with
//! a power-law profile (EN 1991-1-4 has its own profile; this one is common in ASCE 7) on a side of
//! a body, carried by its outermost layer of points.

use mpm_par::error::Result;
use mpm_par::loads::{Load, Moment};
use mpm_par::material::Material;
use mpm_par::points::Points;

/// Height that the speed belongs to, m.
const REFERENCE: f64 = 10.0;

/// A point belongs to the layer if its domain ends at the side, to this share of its half length.
const SLACK: f64 = 1e-6;

/// Wind along the axis x on a plane side of a body.
pub struct Wind {
    /// The windward side, m; the body lies beyond it.
    pub side: f64,
    /// m2 (m in 2D)
    pub area: f64,
    /// Initial volume of the points that carry the side, over all ranks, m3.
    pub volume: f64,
    /// rho, kg/m3
    pub density: f64,
    /// v_10, m/s
    pub speed: f64,
    /// a
    pub exponent: f64,
    /// c: positive for pressure, negative for suction.
    pub coefficient: f64,
}

/// Whether point `p` is in the outermost layer at a side across `axis`. It depends on the start alone.
pub fn carries<const D: usize>(axis: usize, side: f64, points: &Points<D>, p: usize) -> bool {
    let (x, half) = (points.position_initial[p][axis], points.half_length_initial[p][axis]);
    x - (1.0 + SLACK) * half <= side
}

impl<const D: usize> Load<D> for Wind {
    fn add_to_points(
        &self,
        points: &Points<D>,
        _materials: &[Material],
        at: Moment,
        forces: &mut [[f64; D]],
    ) -> Result<()> {
        for (p, force) in forces.iter_mut().enumerate() {
            if !carries(0, self.side, points, p) {
                continue;
            }
            let height = points.position_initial[p][1].max(0.0);
            let speed = self.speed * (height / REFERENCE).powf(self.exponent);
            let pressure = self.coefficient * 0.5 * self.density * speed * speed;
            let area = self.area * points.volume_initial[p] / self.volume;
            force[0] += at.ramp * pressure * area;
        }
        Ok(())
    }
}
