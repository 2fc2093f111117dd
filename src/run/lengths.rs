//! Lengths that are probably not in metres.
//!
//! In statics without weight nothing tells 10 m from 10 mm: a body of any size obeys the same equations.
//! Two things tell. Density and gravity may be those of solids on the Earth in SI units, and then the
//! largest landslides reach some kilometres. And in dynamics something should move within the duration.

use crate::deck::model::AnalysisType;
use crate::deck::rough;
use crate::parallel::World;
use crate::points::Points;
use crate::system::model::Model;

use super::plan_checks::{EARTH, SOLIDS, extents, gravity};
use crate::analysis::time_steps::stability_limit;

/// m
const LONGEST: f64 = 5e3;
/// A run in which waves cross less of the smallest body, and every body moves by less of its length.
const LITTLE: f64 = 0.1;

/// A warning of one body. Collective.
pub fn warning<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
) -> Option<String> {
    let deck = &model.deck;
    let pull = gravity::<D>(deck).iter().map(|g| g * g).sum::<f64>().sqrt();
    let mut lengths = vec![0.0f64; deck.bodies.len()];
    for axis in 0..D {
        let along = std::array::from_fn(|a| if a == axis { 1.0 } else { 0.0 });
        for (length, [low, high]) in lengths.iter_mut().zip(extents(world, model, points, along)) {
            // A body that is not there yet has none.
            if low <= high {
                *length = length.max(high - low);
            }
        }
    }
    let here = || deck.bodies.iter().zip(&lengths).filter(|(_, length)| **length > 0.0);
    let long = here().find(|(body, length)| {
        EARTH.contains(&pull) && SOLIDS.contains(&body.density) && **length > LONGEST
    });
    if let Some((body, length)) = long {
        return Some(format!(
            "body \"{}\" is {} m long, while its density and gravity are those of SI units: is it in mm? \
             Lengths are in m",
            body.name,
            rough(*length)
        ));
    }
    let duration =
        deck.analysis.duration.filter(|_| deck.analysis.kind == AnalysisType::Explicit)?;
    // What is driven moves by itself.
    if !deck.rigids.is_empty() {
        return None;
    }
    let (body, &shortest) = here().min_by(|a, b| a.1.total_cmp(b.1))?;
    let mass = world.sum(points.mass.iter().sum());
    let energy = stability_limit(world, model, points).1;
    let square = |v: &[f64; D]| v.iter().map(|v| v * v).sum::<f64>();
    let fastest = world.max(points.velocity.iter().map(square).fold(0.0, f64::max)).sqrt();
    let crossed = duration * (energy / mass).sqrt() / shortest;
    let moved = (fastest * duration + 0.5 * pull * duration * duration) / shortest;
    // Without a stiffness there are no waves.
    (0.0 < crossed && crossed < LITTLE && moved < LITTLE).then(|| {
        format!(
            "within {} s a wave crosses {} of body \"{}\", {} m long, and its weight and velocity move it by {} of \
             that: hardly anything will happen; check the units of lengths (m), duration (s), young (Pa) \
             and density (kg/m3)",
            rough(duration),
            rough(crossed),
            body.name,
            rough(shortest),
            rough(moved)
        )
    })
}
