//! Which bodies would lock: those whose volume can hardly change, elastically or where they flow.
//!
//! Each point is one condition on the volume, and a cell with several points has more of them than
//! its nodes have freedom: stiffness and pressures come out too large (docs/theory/theory.md,
//! F-bar). Explicit runs are not warned: their points stiffen as well, but the time step shows what
//! they cost.

use crate::deck::model::{AnalysisType, Locking};
use crate::material::{Material, local};
use crate::parallel::World;
use crate::points::Points;
use crate::system::model::Model;

/// (lambda + 2 mu) / E of a Poisson's ratio of 0.45: (1 - nu) / ((1 + nu) (1 - 2 nu)), less its
/// round-off.
const STIFF: f64 = 0.55 / (1.45 * 0.1) * (1.0 - 1e-9);
/// Share of a plastic strain that its change of volume may have to count as none.
const ISOCHORIC: f64 = 1e-9;

/// Why a material locks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cause {
    Elastic,
    Plastic,
}

/// A warning that names the bodies and the key. Collective.
pub fn warning<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
) -> Option<String> {
    let deck = &model.deck;
    let implicit =
        deck.analysis.kind.is_static() || deck.analysis.kind == AnalysisType::ImplicitDynamic;
    if !implicit || deck.method.locking != Locking::None {
        return None;
    }
    let varies = |body: usize| deck.materials[deck.bodies[body].material].varies();
    let bodies = deck.bodies.len();
    let (mut elastic, mut plastic) = (vec![0.0; bodies], vec![0.0; bodies]);
    let mut note = |body: usize, material: &Material| match cause(material) {
        Some(Cause::Elastic) => elastic[body] = 1.0,
        Some(Cause::Plastic) => plastic[body] = 1.0,
        None => {}
    };
    for (body, material) in model.materials.iter().enumerate().filter(|(body, _)| !varies(*body)) {
        note(body, material);
    }
    for p in 0..points.len() {
        let body = points.body[p] as usize;
        if varies(body) {
            note(body, &local(&model.materials, points, p).model());
        }
    }
    let [elastic, plastic] = [elastic, plastic].map(|marks| named(model, &world.sum_slice(&marks)));
    let mut reasons = Vec::new();
    reasons.extend(elastic.map(|names| format!("a Poisson's ratio of 0.45 or more ({names})")));
    reasons.extend(plastic.map(|names| format!("plastic flow at constant volume ({names})")));
    (!reasons.is_empty()).then(|| {
        format!(
            "{} can make points lock: too stiff, and pressures that jump from point to point; \
             [method] locking = \"f-bar\" avoids it",
            reasons.join(" and ")
        )
    })
}

fn named<const D: usize>(model: &Model<D>, marks: &[f64]) -> Option<String> {
    let names = model.deck.bodies.iter().zip(marks).filter(|(_, mark)| **mark > 0.0);
    let mut names = names.map(|(body, _)| format!("\"{}\"", body.name));
    let first = names.next()?;
    let others = names.count();
    Some(match others {
        0 => format!("body {first}"),
        _ => format!("body {first} and {others} more"),
    })
}

fn cause(material: &Material) -> Option<Cause> {
    if material.wave_modulus(|| [0.0; 3]) >= STIFF * material.stiffness() {
        return Some(Cause::Elastic);
    }
    // A shear far beyond yield, under pressure for what has friction: does it flow, and with which
    // change of volume?
    let shear = material.strength().map_or(1.0, |strength| 10.0 * strength / material.stiffness());
    let trial = [0.9 * shear, -0.1 * shear, -1.1 * shear];
    let response = material.respond(trial, &material.initial_state([0.0; 3]));
    let flow: [f64; 3] = std::array::from_fn(|a| trial[a] - response.elastic_strain[a]);
    let size = flow.iter().map(|f| f * f).sum::<f64>().sqrt();
    let volume: f64 = flow.iter().sum();
    (size > 0.1 * shear && volume.abs() <= ISOCHORIC * size).then_some(Cause::Plastic)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Hencky, law};

    #[test]
    fn poisson_ratios_from_0_45_lock() {
        for (poisson, locks) in [(0.3, false), (0.449, false), (0.45, true), (0.4999, true)] {
            for young in [1.0, 2.1e11] {
                let material = Material::Hencky(Hencky::new(young, poisson));
                assert_eq!(cause(&material) == Some(Cause::Elastic), locks, "{poisson}");
            }
        }
    }

    #[test]
    fn flow_at_constant_volume_locks() {
        let made = |model: &str, given: &[(&str, f64)]| law(model, given).1;
        let elastic = [("young", 1e7), ("poisson", 0.3)];
        let sand = |dilation| {
            let soil = [("friction", 30.0), ("dilation", dilation), ("cohesion", 1e4)];
            made("mohr-coulomb", &[&elastic[..], &soil].concat())
        };
        let metal = made("von-mises", &[&elastic[..], &[("yield", 2e4)]].concat());
        let clay = made("tresca", &[&elastic[..], &[("shear_strength", 1e4)]].concat());
        let plastic = Some(Cause::Plastic);
        let found = [metal, clay, sand(0.0), sand(10.0)].map(|material| cause(&material));
        assert_eq!(found, [plastic, plastic, plastic, None]);
    }
}
