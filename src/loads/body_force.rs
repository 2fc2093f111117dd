//! f_p = b(X, x, s, t) V0 (Lagrangian eq. 24): a force per initial volume.

use super::{Load, Moment, scope_of};
use crate::deck::expression::Expression;
use crate::error::Result;
use crate::material::Material;
use crate::points::Points;

/// N/m3 of initial volume, one expression of X, Y, Z, x, y, z, s, t per axis. x, y, z are those of
/// the step's start: the force does not follow the motion within a step.
pub struct BodyForce(pub Vec<Expression>);

impl<const D: usize> Load<D> for BodyForce {
    fn add_to_points(
        &self,
        points: &Points<D>,
        _materials: &[Material],
        at: Moment,
        forces: &mut [[f64; D]],
    ) -> Result<()> {
        for (p, force) in forces.iter_mut().enumerate() {
            let scope = scope_of(points, p, at.load_factor, at.time);
            let density: [f64; D] = at.values(&self.0, &scope);
            for (f, b) in force.iter_mut().zip(density) {
                *f += b * points.volume_initial[p];
            }
        }
        Ok(())
    }
}
