//! b = -Div P(F(X)): the body force per initial volume that makes a given displacement field
//! exact (method of manufactured solutions, Lagrangian §7.4).
//!
//! The field's first and second derivatives come from automatic differentiation; dP/dF is the
//! material's own consistent tangent in the total frame, so any elastic model serves:
//! Div P_i = (dP_iJ / dF_kL) u_k,LJ.

use nalgebra::Matrix3;

use super::declaration::{Around, Declaration, all_of, expressions};
use super::{Load, Moment, Start, scope_of};
use crate::deck::expression::{Expression, Jet, Smooth};
use crate::deck::model::{Body, Frame};
use crate::deck::schema::{Key, Kind, Need, key};
use crate::deck::{Got, Scope, Table, toml_text};
use crate::error::{Error, Result};
use crate::material::{LocalMaterial, Material, local};
use crate::mechanics::{self, StepStart};
use crate::points::Points;

/// A displacement field as the deck has it: m, one expression of X, Y, Z, s per axis.
#[derive(Debug, Clone, PartialEq)]
pub struct MadeField(pub Vec<Expression>);

impl Declaration for MadeField {
    const KEY: Key = {
        let doc = "The body force that makes this displacement field exact.";
        key("manufactured", Kind::Expressions("X Y Z s"), Need::Optional("-"), doc).unit("m")
    };

    fn read(table: &Table<'_>, around: &Around<'_>) -> Got<Self> {
        let field = expressions(table, "manufactured", around.dimension)?;
        match field.iter().find_map(|component| component.smooth().err()) {
            Some(why) => Err(table.problem("manufactured", why)),
            None => Ok(MadeField(field)),
        }
    }

    fn written(&self, _bodies: &[Body]) -> String {
        toml_text::expressions(&self.0)
    }

    fn formulas(&self) -> Vec<(&'static str, &Expression)> {
        all_of("manufactured", &self.0)
    }

    fn make<const D: usize>(&self, _start: Start<'_, D>) -> Result<Box<dyn Load<D>>> {
        Ok(Box::new(Manufactured::new(&self.0)?))
    }
}

/// A displacement field of X and s (or t) with its derivatives.
#[derive(Debug, Clone)]
pub struct Manufactured {
    field: Vec<Smooth>,
}

impl Manufactured {
    /// From one expression per axis. Error: a function without derivative.
    pub fn new(field: &[Expression]) -> Result<Self> {
        let wrong = |what: String| Error::Input(format!("load.manufactured: {what}"));
        let field = field.iter().map(|component| component.smooth().map_err(wrong));
        Ok(Manufactured { field: field.collect::<Result<_>>()? })
    }

    /// The displacement, m, and the Kirchhoff stress, Pa, of the solution at a place.
    pub fn solution<const D: usize>(
        &self,
        material: LocalMaterial<'_>,
        scope: &Scope,
    ) -> ([f64; D], Matrix3<f64>) {
        let jets: [Jet; D] = self.jets(scope);
        let gradient = displacement_gradient(&jets);
        let state = from_rest(material, |start| mechanics::stress(start, &gradient));
        (jets.map(|jet| jet.value), state.kirchhoff_stress)
    }

    fn jets<const D: usize>(&self, scope: &Scope) -> [Jet; D] {
        std::array::from_fn(|k| self.field[k].jet(scope))
    }

    /// Force per initial volume, N/m3, at the place and load factor in `scope`. Error: the field
    /// makes the material yield there (the force would depend on the path), or turns it over.
    pub fn force<const D: usize>(
        &self,
        material: LocalMaterial<'_>,
        scope: &Scope,
    ) -> Result<[f64; D]> {
        let jets: [Jet; D] = self.jets(scope);
        let gradient = displacement_gradient(&jets);
        let (contribution, state) =
            from_rest(material, |start| mechanics::contribution(Frame::Total, start, &gradient));
        if state.plastic_increment > 0.0 || !state.stored_energy.is_finite() {
            return Err(Error::Input(format!(
                "at X = {:?}, s = {} the manufactured field {}; a manufactured solution must stay \
                 elastic and invertible",
                &scope.initial[..D],
                scope.load_factor,
                if state.plastic_increment > 0.0 {
                    "makes the material yield"
                } else {
                    "is singular"
                },
            )));
        }
        let mut force = [0.0; D];
        for k in 0..D {
            for l in 0..D {
                for j in 0..D {
                    let curvature = jets[k].second_along(l, j);
                    for (i, f) in force.iter_mut().enumerate() {
                        *f -= contribution.tangent[i][j][k][l] * curvature;
                    }
                }
            }
        }
        Ok(force)
    }
}

impl<const D: usize> Load<D> for Manufactured {
    fn add_to_points(
        &self,
        points: &Points<D>,
        materials: &[Material],
        at: Moment,
        forces: &mut [[f64; D]],
    ) -> Result<()> {
        for (p, force) in forces.iter_mut().enumerate() {
            let scope = scope_of(points, p, at.load_factor, at.time);
            let made: [f64; D] = self.force(local(materials, points, p), &scope)?;
            for (f, b) in force.iter_mut().zip(made) {
                *f += at.share * b * points.volume_initial[p];
            }
        }
        Ok(())
    }
}

/// F - 1 = du/dX.
/// What a step of a unit volume without strain comes to.
fn from_rest<R>(material: LocalMaterial<'_>, step: impl FnOnce(&StepStart<'_>) -> R) -> R {
    step(&StepStart {
        material,
        state: &material.model().initial_state([0.0; 3]),
        deformation_gradient: &Matrix3::identity(),
        elastic_excess: &Matrix3::zeros(),
        volume_initial: 1.0,
    })
}

fn displacement_gradient<const D: usize>(jets: &[Jet; D]) -> [[f64; D]; D] {
    std::array::from_fn(|k| std::array::from_fn(|l| jets[k].first[l]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Hencky;

    fn first_piola(
        material: LocalMaterial<'_>,
        field: &[Expression],
        scope: &Scope,
    ) -> [[f64; 2]; 2] {
        let made = Manufactured::new(field).expect("smooth");
        let gradient = displacement_gradient::<2>(&made.jets(scope));
        let (unit, none) = (Matrix3::identity(), Matrix3::zeros());
        let start = StepStart {
            material,
            state: &[],
            deformation_gradient: &unit,
            elastic_excess: &none,
            volume_initial: 1.0,
        };
        mechanics::contribution(Frame::Total, &start, &gradient).0.stress
    }

    #[test]
    fn force_is_minus_the_divergence_of_the_stress() {
        let material = Material::Hencky(Hencky::new(1000.0, 0.3));
        let material = LocalMaterial::uniform(&material);
        let field = [
            Expression::parse("0.1*s*sin(2*X)*cos(Y)").expect("valid"),
            Expression::parse("0.2*s*X*Y*Y").expect("valid"),
        ];
        let made = Manufactured::new(&field).expect("smooth");
        let at =
            |x: f64, y: f64| Scope { initial: [x, y, 0.0], load_factor: 0.7, ..Scope::default() };
        let step = 1e-5;
        for (x, y) in [(0.3, 0.2), (-0.4, 0.9), (0.0, 0.0)] {
            let force: [f64; 2] = made.force(material, &at(x, y)).expect("elastic");
            let stress = |x, y| first_piola(material, &field, &at(x, y));
            for i in 0..2 {
                let divergence = (stress(x + step, y)[i][0] - stress(x - step, y)[i][0]
                    + stress(x, y + step)[i][1]
                    - stress(x, y - step)[i][1])
                    / (2.0 * step);
                assert!((force[i] + divergence).abs() < 1e-5, "{} {}", force[i], divergence);
            }
        }
    }
}
