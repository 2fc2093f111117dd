//! f_ext: external forces at the points (Lagrangian eq. 24, 25, 29).
//!
//! | deck key | type | file | source |
//! |---|---|---|---|
//! | `point` | [`PointForce`] | `point.rs` | Lagrangian eq. 29: S f_p |
//! | `gravity` | [`Gravity`] | `gravity.rs` | Lagrangian eq. 24: S m g |
//! | `body_force` | [`BodyForce`] | `body_force.rs` | Lagrangian eq. 24: S b V0 |
//! | `pressure` | [`Pressure`] | `pressure.rs` | Given et al. 2024: virtual stress |
//! | `pressure.surface` | [`SurfacePressure`] | `surface_pressure.rs` | formulations.md B.6 (b) |
//! | `traction` | [`Traction`] | `traction.rs` | formulations.md B.6 (b) |
//! | `[water]` | [`Water`] | `water.rs` | formulations.md B.7 |
//! | `manufactured` | [`Manufactured`] | `manufactured.rs` | Lagrangian §7.4 |
//!
//! A new load is one file that implements [`Declaration`] for what the deck says and [`Load`] for the force, and its
//! name in the list `loads!` below.

mod body_force;
mod declaration;
mod gravity;
pub(crate) mod manufactured;
mod point;
mod pressing;
pub(crate) mod pressure;
mod surface_pressure;
mod traction;
mod water;
#[cfg(test)]
#[path = "../../tests/adding/wind.rs"]
mod wind;

pub use body_force::BodyForce;
pub use declaration::{Around, Declaration, expressions};
pub use gravity::{Gravity, total_gravity};
pub use manufactured::{MadeField, Manufactured};
pub use point::{Carriers, Point, PointForce};
pub use pressing::Pressing;
pub use pressure::{Pressure, PressureZone};
pub use surface_pressure::SurfacePressure;
pub use traction::{Traction, TractionOn};

use crate::deck::expression::Expression;
use crate::deck::model::{self, AnalysisType, Body, BodySurface, Water};
use crate::deck::schema::{Key, Section};
use crate::deck::{Deck, Got, Presence, Scope, Table, When};
use crate::error::{Error, Result};
use crate::material::Material;
use crate::parallel::World;
use crate::points::Points;
use crate::surface::Surface;
#[cfg(test)]
use wind::Wind;

declaration::loads! {
    Point, Gravity, BodyForce, Pressing, TractionOn, MadeField,
    // The example of docs/develop/adding-a-load.md.
    #[cfg(test)] Wind,
}

/// The moment at which loads are asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// s of the load: 0 to 1 over the stage it comes with, 1 later.
    pub load_factor: f64,
    /// t, s.
    pub time: f64,
    /// Factor of values that hold neither s nor t: s in quasi-static runs, 1 in dynamics.
    pub ramp: f64,
    /// Share of the load that is left, of whatever form: 1, or what a stage has not yet released.
    pub share: f64,
}

impl Moment {
    /// As a load that is there at certain times sees it.
    pub fn new(kind: AnalysisType, presence: Presence, when: When) -> Self {
        let load_factor = presence.factor(when);
        let ramp = if kind.is_static() { load_factor } else { 1.0 };
        Moment { load_factor, time: when.time, ramp, share: presence.share(when) }
    }

    /// Variables of an expression that holds no place.
    pub fn scope(&self) -> Scope {
        Scope { load_factor: self.load_factor, time: self.time, ..Scope::default() }
    }

    /// Factor of an expression's value: without the ramp where it says itself how it depends on s
    /// or t.
    pub fn factor_of(&self, expression: &Expression) -> f64 {
        let ramp = if expression.depends_on_time() { 1.0 } else { self.ramp };
        ramp * self.share
    }

    /// One ramped value per axis in `scope`.
    pub fn values<const D: usize>(&self, expressions: &[Expression], scope: &Scope) -> [f64; D] {
        std::array::from_fn(|a| {
            let expression = &expressions[a];
            self.factor_of(expression) * expression.value(scope)
        })
    }
}

/// An external load.
pub trait Load<const D: usize> {
    /// Adds the force on each point, N, to `forces`. Error: it has none there. A load that acts on nodes adds nothing.
    fn add_to_points(
        &self,
        _points: &Points<D>,
        _materials: &[Material],
        _at: Moment,
        _forces: &mut [[f64; D]],
    ) -> Result<()> {
        Ok(())
    }

    /// The pressure on the surface, for a load that is one: it acts on the nodes and follows the
    /// motion within a step.
    fn pressure(&self) -> Option<&Pressure> {
        None
    }

    /// The surface that the load acts on, for one that acts on a body's own.
    fn on_surface(&self) -> Option<OnSurface<'_, D>> {
        None
    }

    /// Whether the tangent of the load equals its transposed. Loads that do not follow the motion
    /// within a step have none.
    fn symmetric(&self) -> bool {
        true
    }
}

/// What acts on a body's own surface.
#[derive(Clone, Copy)]
pub enum OnSurface<'a, const D: usize> {
    /// Pa per initial area, one expression of X, Y, Z, s, t per axis.
    Traction {
        /// Where.
        surface: &'a Surface<D>,
        /// Force per area.
        value: &'a [Expression],
    },
    /// Against the current normal.
    Pressure {
        /// Where.
        surface: &'a Surface<D>,
        /// p, Pa.
        pressure: &'a Pressure,
    },
}

/// Points and surfaces that a load names, found at the start of a run.
#[derive(Debug, Clone, Default)]
pub struct Found<const D: usize> {
    /// Who carries a point force that is a function.
    pub carriers: Carriers,
    /// The surface that it acts on, if it acts on one.
    pub surface: Surface<D>,
}

/// What a load may need to begin with.
pub struct Start<'a, const D: usize> {
    /// The ranks.
    pub world: &'a World,
    /// This rank's points.
    pub points: &'a Points<D>,
    /// Points and surfaces that the deck names.
    pub found: Found<D>,
    /// Size of the grid's cells, m.
    pub cell: f64,
}

/// What bodies take of a load with this presence while they come and go, by their index: a body that
/// comes takes what has acted before in proportion to s in quasi-static runs, one that goes takes the
/// share 1 - s. `None`: all of it.
pub fn shares_of_bodies(deck: &Deck, load: Presence, when: When) -> Option<Vec<f64>> {
    let ramps = deck.analysis.kind.is_static() && !load.comes_in(when.stage);
    let share = |body: &model::Body| {
        let comes = ramps && body.presence.comes_in(when.stage);
        body.presence.share(when) * if comes { when.factor } else { 1.0 }
    };
    let all: Vec<f64> = deck.bodies.iter().map(share).collect();
    all.iter().any(|share| *share != 1.0).then_some(all)
}

/// Force on each point, N: what the points hold themselves (`points.point_force`), and the loads.
/// Error: one is not finite.
pub fn on_points<const D: usize>(
    points: &Points<D>,
    materials: &[Material],
    loads: &[Box<dyn Load<D>>],
    deck: &Deck,
    when: When,
) -> Result<Vec<[f64; D]>> {
    let kind = deck.analysis.kind;
    let held = Moment::new(kind, Presence::default(), when);
    let mut forces: Vec<[f64; D]> =
        points.point_force.iter().map(|force| force.map(|f| f * held.ramp)).collect();
    for (load, &presence) in loads.iter().zip(&deck.load_presence) {
        let at = Moment::new(kind, presence, when);
        if at.share == 0.0 {
            continue;
        }
        let Some(shares) = shares_of_bodies(deck, presence, when) else {
            load.add_to_points(points, materials, at, &mut forces)?;
            continue;
        };
        let mut own = vec![[0.0; D]; points.len()];
        load.add_to_points(points, materials, at, &mut own)?;
        for ((force, own), &body) in forces.iter_mut().zip(own).zip(&points.body) {
            for (sum, f) in force.iter_mut().zip(own) {
                *sum += shares[body as usize] * f;
            }
        }
    }
    match forces.iter().position(|force| force.iter().any(|f| !f.is_finite())) {
        None => Ok(forces),
        Some(p) => Err(Error::Input(format!(
            "the load on point {} at {:?} is not finite ({:?} N at s = {}): check the expressions \
             of [[load]]",
            points.id[p], points.position[p], forces[p], when.factor
        ))),
    }
}

/// Variables of an expression at a point.
pub fn scope_of<const D: usize>(
    points: &Points<D>,
    p: usize,
    load_factor: f64,
    time: f64,
) -> Scope {
    let mut scope = Scope { load_factor, time, ..Scope::default() };
    scope.initial[..D].copy_from_slice(&points.position_initial[p]);
    scope.current[..D].copy_from_slice(&points.position[p]);
    scope
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::deck;

    const DECK: &str = r#"
[analysis]
type = "quasi-static"
steps = 2

[method]
basis = "gimp"

[grid]
type = "lattice"
origin = [0.0, 0.0]
size = [4.0, 4.0]
h = 1.0

[material.steel]
model = "hencky"
young = 1e9
poisson = 0.2

[[body]]
material = "steel"
shape = { box = { min = [1, 0], max = [2, 3] } }

[[boundary]]
where = { side = "bottom" }
fix = ["x", "y"]

[[load]]
"#;

    fn read(load: &str) -> crate::error::Result<deck::Deck> {
        deck::read(Path::new("deck.toml"), &format!("{DECK}{load}\n"), &[])
    }

    /// The example of the guide is a file and its name in the list: the deck knows it by that.
    #[test]
    fn a_load_is_a_file_and_a_line() {
        let wind = "wind = { side = 1.0, area = 3.0, speed = \"30*s\", coefficient = 0.8 }";
        let deck = read(wind).expect("a load");
        assert!(deck.loads[0].depends_on_time());
        let keys: Vec<&str> = deck.loads[0].formulas().iter().map(|(key, _)| *key).collect();
        assert_eq!(keys, ["wind.speed"]);
        assert_eq!(deck::explain::unit_of("load.wind.speed"), "m/s");
        let text = deck::resolved(&deck);
        let expected = "wind = { side = 1.0, area = 3.0, density = 1.25, speed = \"30*s\", \
                        exponent = 0.2, coefficient = 0.8 }";
        assert!(text.contains(expected), "{text}");
        assert_eq!(deck::read(Path::new("again"), &text, &[]).expect("again").loads, deck.loads);
        for (load, words) in [
            ("wind = { side = 1.0, area = 3.0, coefficient = 0.8 }", "load.0.wind.speed"),
            ("wind = { side = 1.0, area = -3.0, speed = 1, coefficient = 0.8 }", "wind.area"),
            ("wind = { side = 1.0, aera = 3.0, speed = 1, coefficient = 0.8 }", "\"area\""),
            ("wimd = { side = 1.0 }", "did you mean \"wind\"?"),
        ] {
            let told = read(load).expect_err(load).to_string();
            assert!(told.contains(words), "{told}");
        }
        assert!(deck::json_schema::json_schema().to_string().contains("\"wind\""));
    }
}
