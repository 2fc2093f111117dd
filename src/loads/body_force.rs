//! f_p = b(X, x, s, t) V0 (Lagrangian eq. 24): a force per initial volume.

use super::declaration::{Around, Declaration, all_of, expressions};
use super::{Load, Moment, Start, scope_of};
use crate::deck::expression::Expression;
use crate::deck::model::Body;
use crate::deck::schema::{Key, Kind, Need, key};
use crate::deck::{Got, Table, toml_text};
use crate::error::Result;
use crate::material::Material;
use crate::points::Points;

/// N/m3 of initial volume, one expression of X, Y, Z, x, y, z, s, t per axis. x, y, z are those of
/// the step's start: the force does not follow the motion within a step.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyForce(pub Vec<Expression>);

impl Declaration for BodyForce {
    const KEY: Key = {
        let kind = Kind::Expressions("X Y Z x y z s t");
        key("body_force", kind, Need::Optional("-"), "Force per initial volume.").unit("N/m3")
    };

    fn read(table: &Table<'_>, around: &Around<'_>) -> Got<Self> {
        expressions(table, "body_force", around.dimension).map(BodyForce)
    }

    fn written(&self, _bodies: &[Body]) -> String {
        toml_text::expressions(&self.0)
    }

    fn formulas(&self) -> Vec<(&'static str, &Expression)> {
        all_of("body_force", &self.0)
    }

    fn make<const D: usize>(&self, _start: Start<'_, D>) -> Result<Box<dyn Load<D>>> {
        Ok(Box::new(self.clone()))
    }
}

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
