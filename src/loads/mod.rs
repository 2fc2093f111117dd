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
//! | `[water]` | [`Water`](model::Water) | `water.rs` | formulations.md B.7 |
//! | `manufactured` | [`Manufactured`] | `manufactured.rs` | Lagrangian §7.4 |
//!
//! A new load is one file that implements [`Load`] and one line of [`of_deck`].

mod body_force;
mod gravity;
pub(crate) mod manufactured;
mod point;
pub(crate) mod pressure;
mod surface_pressure;
mod traction;
mod water;

pub use body_force::BodyForce;
pub use gravity::Gravity;
pub use manufactured::Manufactured;
pub use point::{Carriers, PointForce};
pub use pressure::Pressure;
pub use surface_pressure::SurfacePressure;
pub use traction::Traction;

use crate::deck::expression::Expression;
use crate::deck::model::{self, AnalysisType};
use crate::deck::{Deck, Presence, Scope, When};
use crate::error::{Error, Result};
use crate::material::Material;
use crate::points::Points;
use crate::surface::Surface;

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
    /// Adds the force on each point, N, to `forces`. Error: it has none there.
    fn add_to_points(
        &self,
        points: &Points<D>,
        materials: &[Material],
        at: Moment,
        forces: &mut [[f64; D]],
    ) -> Result<()>;

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

/// What the start of a run tells of a load.
#[derive(Debug, Clone, Default)]
pub struct Found<const D: usize> {
    /// Who carries a point force that is a function.
    pub carriers: Carriers,
    /// The surface that it acts on, if it acts on one.
    pub surface: Surface<D>,
}

/// What the deck asks for, in its order, with what was `found` of each;
/// `cell`: size of the grid's cells, m.
/// Error: a formula cannot serve.
pub fn of_deck<const D: usize>(
    loads: &[model::Load],
    found: Vec<Found<D>>,
    cell: f64,
) -> Result<Vec<Box<dyn Load<D>>>> {
    let made = loads.iter().zip(found).map(|(load, found)| -> Result<Box<dyn Load<D>>> {
        Ok(match load {
            model::Load::Point { force, .. } => Box::new(PointForce::new(force, &found.carriers)),
            model::Load::Gravity(gravity) => Box::new(Gravity(gravity.clone())),
            model::Load::BodyForce(force) => Box::new(BodyForce(force.clone())),
            model::Load::Traction { value, .. } => {
                Box::new(Traction { surface: found.surface, value: value.clone() })
            }
            model::Load::SurfacePressure { value, .. } => Box::new(SurfacePressure {
                surface: found.surface,
                pressure: Pressure::new(value, None, cell)?,
            }),
            model::Load::Pressure { value, zone } => {
                Box::new(Pressure::new(value, zone.as_ref(), cell)?)
            }
            model::Load::Manufactured(field) => Box::new(Manufactured::new(field)?),
            model::Load::Water(water) => Box::new(*water),
        })
    });
    made.collect()
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
