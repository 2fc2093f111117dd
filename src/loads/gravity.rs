//! f_p = m_p g (Lagrangian eq. 24): gravity on the constant mass of the points.

use super::declaration::{Around, Declaration, all_of, expressions};
use super::{Declared, Load, Moment, Start, scope_of};
use crate::deck::expression::{Expression, Variable};
use crate::deck::model::Body;
use crate::deck::schema::{Key, Kind, Need, key};
use crate::deck::{Got, Table, toml_text};
use crate::error::Result;
use crate::material::Material;
use crate::points::Points;

/// m/s2, one expression of X, Y, Z, s, t per axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Gravity(pub Vec<Expression>);

impl Declaration for Gravity {
    const KEY: Key =
        key("gravity", Kind::Expressions("X Y Z s t"), Need::Optional("-"), "Acceleration.")
            .unit("m/s2");

    fn read(table: &Table<'_>, around: &Around<'_>) -> Got<Self> {
        let gravity = expressions(table, "gravity", around.dimension)?;
        let acts = gravity.iter().any(|g| g.as_constant() != Some(0.0));
        let Some(bodies) = around.bodies.filter(|_| acts) else { return Ok(Gravity(gravity)) };
        if bodies.iter().all(|body| body.density == 0.0) {
            return Err(table.problem("gravity", "acts on nothing: every body has density 0"));
        }
        let given = around.root.given_in_each("body", "density");
        if let Some(light) = given.iter().position(|given| !given) {
            let name = &bodies[light].name;
            let what = format!("body \"{name}\" has no density, and others have one");
            let help = "give it a density; density = 0.0 says that it is to be weightless";
            return Err(table.problem_with_help("gravity", what, help));
        }
        Ok(Gravity(gravity))
    }

    fn written(&self, _bodies: &[Body]) -> String {
        toml_text::expressions(&self.0)
    }

    fn formulas(&self) -> Vec<(&'static str, &Expression)> {
        all_of("gravity", &self.0)
    }

    fn make<const D: usize>(&self, _start: Start<'_, D>) -> Result<Box<dyn Load<D>>> {
        Ok(Box::new(self.clone()))
    }
}

/// All gravity among the `loads` of a deck at a place (its initial coordinates, m), m/s2.
pub fn total_gravity<const D: usize>(loads: &[Declared], at: Moment, place: &[f64; D]) -> [f64; D] {
    let mut scope = at.scope();
    scope.initial[..D].copy_from_slice(place);
    let mut total = [0.0; D];
    for load in loads {
        if let Declared::Gravity(Gravity(gravity)) = load {
            let values: [f64; D] = at.values(gravity, &scope);
            total.iter_mut().zip(values).for_each(|(total, value)| *total += value);
        }
    }
    total
}

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
