//! f_p = c q(y) A_p n with q(y) = rho v(y)^2 / 2 and v(y) = v_10 (y / 10 m)^a: pressure of wind with
//! a power-law profile (EN 1991-1-4 has its own profile; this one is common in ASCE 7) on a side of
//! a body, carried by its outermost layer of points.

use mpm_par::deck::model::BodySide;
use mpm_par::error::Result;
use mpm_par::loads::traction::carries;
use mpm_par::loads::{Load, Moment};
use mpm_par::material::Material;
use mpm_par::points::Points;

/// Height that the speed belongs to, m.
const REFERENCE: f64 = 10.0;

/// Wind on a side of a body.
pub struct Wind {
    pub side: BodySide,
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

impl<const D: usize> Load<D> for Wind {
    fn add_to_points(
        &self,
        points: &Points<D>,
        _materials: &[Material],
        at: Moment,
        forces: &mut [[f64; D]],
    ) -> Result<()> {
        // A pressure pushes into the body.
        let sign = if self.side.upper { -1.0 } else { 1.0 };
        for (p, force) in forces.iter_mut().enumerate() {
            if !carries(&self.side, points, p) {
                continue;
            }
            let height = points.position_initial[p][1].max(0.0);
            let speed = self.speed * (height / REFERENCE).powf(self.exponent);
            let pressure = self.coefficient * 0.5 * self.density * speed * speed;
            let area = self.side.area * points.volume_initial[p] / self.volume;
            force[self.side.axis] += sign * at.ramp * pressure * area;
        }
        Ok(())
    }
}
