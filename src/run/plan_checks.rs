//! Warnings that the plan prints: ratios without a unit that show a slip of units, and sizes that a run
//! will hardly finish with.

use std::ops::RangeInclusive;

use crate::analysis::time_steps::{TimeSteps, stability_limit};
use crate::deck::model::{AnalysisType, Every, Material, Place};
use crate::deck::schema::{AXES, SIDES};
use crate::deck::{Deck, Presence, When, rough};
use crate::loads::{Moment, total_gravity};
use crate::parallel::World;
use crate::points::Points;
use crate::system::conditions::StepSpan;
use crate::system::model::Model;

/// rho g H / E and rho g H / strength of ordinary problems lie between these. A column of rubber
/// that its weight halves has the largest, a metre of steel the smallest; a slip of a unit is a
/// factor of a thousand or a million.
const OVER_YOUNG: [f64; 2] = [1e-9, 10.0];
const OVER_STRENGTH: [f64; 2] = [1e-6, 50.0];
const OVER_COHESION: [f64; 2] = [1e-6, 5e3];
/// kg/m3: the densities of soils, rocks and metals in t/m3, at an acceleration (m/s2) that tells that
/// the deck is in SI units.
const FOAMS: RangeInclusive<f64> = 0.5..=25.0;
pub const EARTH: RangeInclusive<f64> = 5.0..=15.0;
/// kg/m3: from cork to heavy metals. With [`EARTH`] they tell that the deck is in SI units, in which no solid
/// is so soft that rho g H / E passes 1.
pub const SOLIDS: RangeInclusive<f64> = 200.0..=25e3;
const SOFTEST: f64 = 1.0;
/// Degrees: an angle of friction below is probably meant in radians.
const RADIANS: f64 = 1.2;
/// Result files beyond this are worth a second thought, bytes.
const MUCH_OUTPUT: f64 = 1e11;

/// A row of the plan, and what to warn of.
pub type Row = (Option<(String, String)>, Option<String>);

/// Sum of all gravity, m/s2, as it is at the end of a quasi-static run, and at the start of a dynamic one.
pub fn gravity<const D: usize>(deck: &Deck) -> [f64; D] {
    let when = When { factor: 1.0, ..When::default() };
    let at = Moment::new(deck.analysis.kind, Presence::default(), when);
    total_gravity(&deck.loads, at, &[0.0; D])
}

/// In space: a warning of a weight along x or z that nothing bears but side "bottom", which is the lowest
/// y. Whoever calls z the vertical means another side.
pub fn wrong_floor<const D: usize>(deck: &Deck) -> Option<String> {
    let gravity = gravity::<D>(deck);
    let axis = (0..D).find(|&axis| gravity[axis] != 0.0)?;
    let alone = (0..D).all(|other| other == axis || gravity[other] == 0.0);
    if D != 3 || axis == 1 || !alone || !deck.contacts.is_empty() || !deck.terms.is_empty() {
        return None;
    }
    let upper = gravity[axis] > 0.0;
    let mut bottom_bears = false;
    for boundary in &deck.boundaries {
        match boundary.place {
            Place::Side { axis: of, upper: end } if (of, end) == (axis, upper) => return None,
            Place::Side { axis: 1, upper: false } => bottom_bears |= boundary.may_hold(axis),
            Place::Side { .. } if !boundary.may_hold(axis) => {}
            _ => return None,
        }
    }
    let (name, side) = (AXES[axis], SIDES[2 * axis + usize::from(upper)]);
    let end = if upper { "highest" } else { "lowest" };
    bottom_bears.then(|| {
        format!(
            "the weight acts along {name}, and side \"bottom\", the lowest y, alone bears it; the {end} {name} \
             is side \"{side}\""
        )
    })
}

/// A warning of a weight away from the one side that bears it: gravity without its sign.
pub fn upward<const D: usize>(deck: &Deck) -> Option<String> {
    let gravity = gravity::<D>(deck);
    let axis = (0..D).find(|&axis| gravity[axis] != 0.0)?;
    if gravity[axis] < 0.0 || !deck.contacts.is_empty() || !deck.terms.is_empty() {
        return None;
    }
    let mut bears = false;
    for boundary in deck.boundaries.iter().filter(|boundary| boundary.may_hold(axis)) {
        match boundary.place {
            Place::Side { axis: of, upper: false } if of == axis => bears = true,
            Place::Side { axis: of, .. } if of != axis => {}
            _ => return None,
        }
    }
    let (name, side) = (AXES[axis], SIDES[2 * axis]);
    let alone = (0..D).all(|other| other == axis || gravity[other] == 0.0);
    (bears && alone).then(|| {
        format!(
            "the weight acts towards +{name}, away from side \"{side}\", which bears it: weight that acts \
             downwards has a negative component, as in gravity = [0, -9.81]"
        )
    })
}

/// Weight of each body over its stiffness and strength, where gravity acts. Collective.
pub fn weight_ratios<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
) -> Vec<Row> {
    let gravity = gravity::<D>(&model.deck);
    let size = gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
    if size == 0.0 {
        return Vec::new();
    }
    let along = extents(world, model, points, gravity.map(|g| g / size));
    let mut rows = Vec::new();
    for (index, body) in model.deck.bodies.iter().enumerate() {
        let height = along[index][1] - along[index][0];
        let weight = body.density * size * height;
        let young = model.stiffness[index];
        // A body that is not there yet has no height.
        if weight == 0.0 || young == 0.0 || !weight.is_finite() {
            continue;
        }
        let of_young = weight / young;
        let varies = model.deck.materials[body.material].varies();
        let strength = if varies { None } else { model.materials[index].strength() };
        let mut text = format!("rho g H / E = {} with H = {} m", rough(of_young), rough(height));
        if let Some(strength) = strength {
            text.push_str(&format!(", rho g H / strength = {}", rough(weight / strength)));
        }
        let is_si = EARTH.contains(&size) && SOLIDS.contains(&body.density);
        let range = if is_si { [OVER_YOUNG[0], SOFTEST] } else { OVER_YOUNG };
        let mut warning = unusual("rho g H / E", of_young, range);
        if let Some(strength) = strength {
            let ratio = weight / strength;
            warning = warning.or(unusual("rho g H / strength", ratio, OVER_STRENGTH));
        }
        let cohesion = constant(&model.deck.materials[body.material], "cohesion");
        if let Some(cohesion) = cohesion.filter(|&c| c > 0.0) {
            let ratio = weight / cohesion;
            text.push_str(&format!(", rho g H / cohesion = {}", rough(ratio)));
            warning = warning.or(unusual("rho g H / cohesion", ratio, OVER_COHESION));
        }
        let gas = FOAMS.contains(&body.density) && EARTH.contains(&size) && of_young < 1e-3;
        warning = warning.or_else(|| {
            gas.then(|| {
                let density = rough(body.density);
                format!("density = {density} kg/m3 is that of foam, while soil has 1500 to 2200")
            })
        });
        let warning = warning.map(|what| {
            format!(
                "body \"{}\": {what}; check the units of density (kg/m3), gravity (m/s2), \
                 young, strength and cohesion (Pa), and lengths (m)",
                body.name
            )
        });
        rows.push((Some((format!("body {}", body.name), text)), warning));
    }
    rows
}

/// The value of a material's parameter, if it has it and it is a number.
fn constant(material: &Material, key: &str) -> Option<f64> {
    let place = material.model.parameters.iter().position(|known| known.key == key)?;
    material.parameters[place].as_ref()?.as_constant()
}

/// Warnings of angles that look like radians.
pub fn angles(materials: &[Material]) -> Vec<String> {
    let of_material = |material: &Material| {
        let friction = constant(material, "friction").filter(|&f| 0.0 < f && f < RADIANS)?;
        Some(format!(
            "material \"{}\": friction = {} is taken in degrees; as radians it would be {} degrees",
            material.name,
            rough(friction),
            rough(friction.to_degrees())
        ))
    };
    materials.iter().filter_map(of_material).collect()
}

fn unusual(what: &str, value: f64, [low, high]: [f64; 2]) -> Option<String> {
    (value < low || value > high)
        .then(|| format!("{what} = {} is far from usual values ({low:e} to {high})", rough(value)))
}

/// From where to where each body reaches along a direction, m. Collective.
pub fn extents<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    direction: [f64; D],
) -> Vec<[f64; 2]> {
    let bodies = model.deck.bodies.len();
    let (mut low, mut high) = (vec![f64::INFINITY; bodies], vec![f64::NEG_INFINITY; bodies]);
    for p in 0..points.len() {
        let (x, half) = (&points.position[p], &points.half_length[p]);
        let along: f64 = (0..D).map(|a| x[a] * direction[a]).sum();
        let reach: f64 = (0..D).map(|a| (half[a] * direction[a]).abs()).sum();
        let body = points.body[p] as usize;
        low[body] = low[body].min(along - reach);
        high[body] = high[body].max(along + reach);
    }
    (0..bodies).map(|body| [world.min(low[body]), world.max(high[body])]).collect()
}

/// The time step and the number of steps. Collective.
pub fn steps<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
) -> (Option<String>, f64) {
    let analysis = &model.deck.analysis;
    if let Some(steps) = analysis.steps {
        let text = analysis
            .duration
            .map(|duration| format!("{} s, {steps} steps", rough(duration / steps as f64)));
        return (text, steps as f64);
    }
    let times = TimeSteps::new(&model.deck);
    let limit = stability_limit(world, model, points).0;
    let Some(StepSpan { time_start, time_end, .. }) = times.next(limit) else {
        return (None, 0.0);
    };
    let dt = time_end - time_start;
    let steps = analysis.duration.unwrap_or(1.0) / dt;
    let text = format!(
        "{} s at the start (cfl = {} of a limit of {} s), about {} steps",
        rough(dt),
        analysis.cfl.unwrap_or(1.0),
        rough(limit),
        rough(steps.round())
    );
    (Some(text), steps)
}

/// A warning of an explicit time step beyond the stability limit of full cells. Collective.
pub fn unstable_step<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
) -> Option<String> {
    let analysis = &model.deck.analysis;
    if analysis.kind != AnalysisType::Explicit {
        return None;
    }
    let limit = stability_limit(world, model, points).0;
    let dt = match (analysis.steps, analysis.duration) {
        (Some(steps), Some(duration)) => duration / steps as f64,
        _ => analysis.cfl? * limit,
    };
    (dt > limit).then(|| {
        format!(
            "the time step {} s is above the stability limit of full cells, {} s; take more \
             analysis.steps, or analysis.cfl = 0.5 in their place",
            rough(dt),
            rough(limit)
        )
    })
}

/// Frames that a run of so many steps writes, the first state among them.
pub fn frames(every: Every, steps: f64, duration: Option<f64>) -> f64 {
    match every {
        Every::Steps(every) => 1.0 + (steps / every.max(1) as f64).ceil(),
        Every::Seconds(seconds) => 1.0 + (duration.unwrap_or(1.0) / seconds).ceil().min(steps),
    }
}

/// A warning of absurd sizes.
pub fn much_output(bytes: f64, frames: f64) -> Option<String> {
    (bytes > MUCH_OUTPUT).then(|| {
        format!(
            "{} frames will fill about {}; choose a longer interval (output.every, or \
             output.every = {{ seconds = ... }}), fewer output.fields or a larger cell",
            rough(frames),
            crate::output::terminal::report::bytes(bytes.min(1e18) as u64)
        )
    })
}
