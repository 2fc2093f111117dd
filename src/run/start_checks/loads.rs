//! Loads that have no value at the ends of the first step: where on the points or surfaces, and which
//! formula is to blame.

use crate::deck::explain;
use crate::deck::schema::AXES;
use crate::deck::{Presence, Scope, When};
use crate::error::{Error, Result};
use crate::loads::pressure::PressureAt;
use crate::loads::{Moment, OnSurface, Pressure, scope_of};
use crate::parallel::World;
use crate::points::Points;
use crate::system::conditions::StepSpan;
use crate::system::model::Model;

use super::faulty::{of_first_point, place};

/// Load factor and time, s, of a moment of the first step.
type End = (f64, f64);

/// Error: a load without a value, with its key, its line, and a place. Collective.
pub fn check<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    span: StepSpan,
) -> Result<()> {
    let ends = [(span.factor_start, span.time_start), (span.factor_end, span.time_end)];
    for (index, load) in model.loads.iter().enumerate() {
        let message = match (load.on_surface(), load.pressure()) {
            (Some(on), _) => on_surface(model, on, ends),
            (None, Some(pressure)) => by_pressure(world, model, points, pressure, ends),
            // Points may hold a force themselves: its formula is asked for at once.
            (None, None) => {
                on_points(world, model, points, index, ends).or_else(|| at_once(model, index, ends))
            }
        };
        if let Some((key, why)) = message {
            let key = format!("load.{index}.{key}");
            return Err(Error::Input(model.deck.origins.message(&key, &why)));
        }
    }
    Ok(())
}

/// A key below `load.INDEX` and what is wrong with it.
type Fault = (String, String);

fn moment<const D: usize>(model: &Model<D>, (s, t): End) -> Moment {
    let when = When { stage: 0, factor: s, time: t };
    Moment::new(model.deck.analysis.kind, Presence::default(), when)
}

/// `, s = 0` with the time beside it where the analysis has one.
fn when<const D: usize>(model: &Model<D>, (s, t): End) -> String {
    let timed = model.deck.analysis.kind.has_time();
    if timed { format!(", s = {s}, t = {t} s") } else { format!(", s = {s}") }
}

/// The first formula of a load without a value in `scope`, as the start of a sentence.
fn formula_at_fault<const D: usize>(
    model: &Model<D>,
    index: usize,
    scope: &Scope,
    asked: impl Fn(&crate::deck::Expression) -> bool,
) -> Option<Fault> {
    let formulas = model.deck.loads[index].formulas();
    let place = formulas.iter().position(|(_, f)| asked(f) && !f.value(scope).is_finite())?;
    let (key, formula) = formulas[place];
    let first = formulas.iter().position(|(other, _)| *other == key)?;
    // One of a vector's.
    let several = formulas.iter().filter(|(other, _)| *other == key).count() > 1;
    let axis = if several { format!("{} ", AXES[place - first]) } else { String::new() };
    let unit = explain::unit_of(&format!("load.{key}"));
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    Some((key.into(), format!("{axis}is {}{unit}", formula.value(scope))))
}

/// A formula of s and t alone.
fn at_once<const D: usize>(model: &Model<D>, index: usize, ends: [End; 2]) -> Option<Fault> {
    ends.into_iter().find_map(|end| {
        let scope = moment(model, end).scope();
        let (key, what) = formula_at_fault(model, index, &scope, |f| !f.depends_on_place())?;
        Some((key, format!("{what}{}: the expression is not finite there", when(model, end))))
    })
}

/// The force on the points. Collective.
fn on_points<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    index: usize,
    ends: [End; 2],
) -> Option<Fault> {
    let whole = || model.deck.loads[index].key().to_string();
    for end in ends {
        let mut forces = vec![[0.0; D]; points.len()];
        let made = model.loads[index].add_to_points(
            points,
            &model.materials,
            moment(model, end),
            &mut forces,
        );
        if let Some(why) = world.first_message(made.err().map(|why| why.to_string())) {
            return Some((whole(), why));
        }
        let fault = |p: usize| (!forces[p].iter().all(|f| f.is_finite())).then_some(());
        // A key and a text travel as one.
        let told = of_first_point(world, points, fault, |p, ()| {
            let (place, when) = (place(points, p), when(model, end));
            let scope = scope_of(points, p, end.0, end.1);
            let (key, why) = match formula_at_fault(model, index, &scope, |_| true) {
                Some((key, what)) => {
                    (key, format!("{what} at {place}{when}: the expression is not finite there"))
                }
                None => (
                    whole(),
                    format!("the force is {:?} N at {place}{when}: not finite", forces[p]),
                ),
            };
            format!("{key}\n{why}")
        });
        if let Some((key, why)) = told.as_deref().and_then(|told| told.split_once('\n')) {
            return Some((key.into(), why.into()));
        }
    }
    None
}

/// The pressure on the surface of all bodies, asked for at all points. Collective.
fn by_pressure<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    pressure: &Pressure,
    ends: [End; 2],
) -> Option<Fault> {
    let fault = |p: usize| {
        ends.into_iter().find_map(|end| {
            let mut found = PressureAt::<D>::default();
            let (x, reach) = (&points.position[p], &points.half_length[p]);
            pressure.add_at(x, reach, (moment(model, end), 1.0), &mut found);
            (!found.is_finite()).then_some((found.value, end.0))
        })
    };
    let why = of_first_point(world, points, fault, |p, (value, s)| {
        format!(
            "is {value} Pa at {}, s = {s}: the expression or a derivative of it is not finite there",
            place(points, p)
        )
    });
    why.map(|why| ("pressure.value".into(), why))
}

/// What acts on a body's own surface; every rank knows all of it.
fn on_surface<const D: usize>(
    model: &Model<D>,
    on: OnSurface<'_, D>,
    ends: [End; 2],
) -> Option<Fault> {
    ends.into_iter().find_map(|end| {
        let at = moment(model, end);
        let (key, value, place) = match on {
            OnSurface::Traction { surface, value } => {
                surface.elements().iter().find_map(|own| {
                    let place = own.element.place;
                    let mut scope = at.scope();
                    scope.initial[..D].copy_from_slice(&place);
                    let values: [f64; D] = at.values(value, &scope);
                    let wrong = values.into_iter().find(|v| !v.is_finite())?;
                    Some(("traction.value", wrong, place))
                })?
            }
            OnSurface::Pressure { surface, pressure } => {
                surface.elements().iter().find_map(|own| {
                    let (place, mut found) = (own.element.place, PressureAt::<D>::default());
                    pressure.add_at(&place, &[0.0; D], (at, 1.0), &mut found);
                    (!found.is_finite()).then_some(("pressure.value", found.value, place))
                })?
            }
        };
        let why = format!(
            "is {value} Pa at {place:?} m on the surface, s = {}: the expression or a derivative of \
             it is not finite there",
            end.0
        );
        Some((key.into(), why))
    })
}
