//! f_p = m_p g (Lagrangian eq. 24): gravity on the constant mass of the points.

use super::{Load, Moment, scope_of};
use crate::deck::expression::{Expression, Variable};
use crate::error::Result;
use crate::material::Material;
use crate::points::Points;

/// m/s2, one expression of X, Y, Z, s, t per axis.
pub struct Gravity(pub Vec<Expression>);

impl<const D: usize> Load<D> for Gravity {
    fn add_to_points(
        &self,
        points: &Points<D>,
        _materials: &[Material],
        at: Moment,
        forces: &mut [[f64; D]],
    ) -> Result<()> {
        const PLACE: [Variable; 3] = [Variable::InitialX, Variable::InitialY, Variable::InitialZ];
        let uniform = !self.0.iter().any(|g| PLACE.iter().any(|v| g.depends_on(*v)));
        let everywhere: [f64; D] = at.values(&self.0, &at.scope());
        for (p, (force, mass)) in forces.iter_mut().zip(&points.mass).enumerate() {
            let gravity = match uniform {
                true => everywhere,
                false => at.values(&self.0, &scope_of(points, p, at.load_factor, at.time)),
            };
            for (f, g) in force.iter_mut().zip(gravity) {
                *f += g * mass;
            }
        }
        Ok(())
    }
}
