//! From the deck's materials to those of bodies and points: parameters where they vary in space,
//! state at the start, and what a body's stiffness is on the average.

use crate::deck::{Deck, Scope, model};
use crate::error::{Error, Result};
use crate::loads::scope_of;
use crate::material::{Material, local};
use crate::parallel::World;
use crate::points::{Named, Points};

use super::initial_stress;

/// One material per body. Where parameters vary, those of the points take their place.
pub fn of_bodies(deck: &Deck) -> Vec<Material> {
    let somewhere = Scope::default();
    deck.bodies.iter().map(|body| deck.materials[body.material].at(&somewhere)).collect()
}

/// Whether [`equip`] gives the points the stress of the deck.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stresses {
    Initial,
    /// They have brought theirs.
    Kept,
}

/// Gives the points their own parameters, the initial stress of the deck if they have none yet, and
/// the state of a point under its stress. Error, the same on
/// all ranks: parameters or stresses that are no good at a point, by key and place. Collective.
pub fn equip<const D: usize>(
    world: &World,
    deck: &Deck,
    materials: &[Material],
    points: &mut Points<D>,
    stresses: Stresses,
) -> Result<()> {
    set_parameters(world, deck, points)?;
    if stresses == Stresses::Initial {
        initial_stress::set(world, deck, materials, points)?;
    }
    points.state = Named::zeros(state_names(deck, materials), points.len());
    let mut fault: Option<(u64, String)> = None;
    for p in 0..points.len() {
        let state = local(materials, points, p).model().initial_state(points.elastic_strain(p));
        if state.iter().any(|word| !word.is_finite())
            && fault.as_ref().is_none_or(|(id, _)| points.id[p] < *id)
        {
            let body = &deck.bodies[points.body[p] as usize];
            let material = &deck.materials[body.material];
            let why = format!(
                "at point {} of body \"{}\" the initial stress is no compression that ocr could be \
                 a ratio to: give preconsolidation in its place",
                points.id[p], body.name
            );
            let key = format!("material.{}.ocr", material.name);
            fault = Some((points.id[p], deck.origins.message(&key, &why)));
        }
        points.state.set(p, &state);
    }
    world.refuse_lowest(fault)?;
    match stresses {
        Stresses::Initial => initial_stress::require_elastic(world, deck, materials, points),
        Stresses::Kept => Ok(()),
    }
}

/// Gives the points their own parameters and keeps the state that a checkpoint held, in the order
/// that these materials have. Errors as [`equip`], and a state variable that it did not hold.
/// Collective.
pub fn equip_restored<const D: usize>(
    world: &World,
    deck: &Deck,
    materials: &[Material],
    points: &mut Points<D>,
) -> Result<()> {
    let stored = std::mem::take(&mut points.state);
    equip(world, deck, materials, points, Stresses::Kept)?;
    let mut missing = None;
    for p in 0..points.len() {
        let body = points.body[p];
        let names = points.state.names()[body as usize].clone();
        for (k, name) in names.iter().enumerate() {
            match stored.get(p, body, name) {
                Some(value) => points.state.of_mut(p, body)[k] = value,
                None => missing = Some((body, name.clone())),
            }
        }
    }
    let message = missing.map(|(body, name)| {
        let body = &deck.bodies[body as usize].name;
        format!("the checkpoint holds no `{name}` for body \"{body}\": it cannot be continued")
    });
    world.refuse(Error::File, message)
}

/// Names of the state variables of each body. Where a body's parameters vary in space its points carry all state
/// variables of the model, as a parameter may be zero at one point and not at the next.
fn state_names(deck: &Deck, materials: &[Material]) -> Vec<Vec<String>> {
    let of_body = |(body, material): (&model::Body, &Material)| {
        let given = &deck.materials[body.material];
        let carried = if given.varies() { given.model.state } else { material.state() };
        carried.iter().map(|variable| variable.name.to_string()).collect()
    };
    deck.bodies.iter().zip(materials).map(of_body).collect()
}

fn set_parameters<const D: usize>(
    world: &World,
    deck: &Deck,
    points: &mut Points<D>,
) -> Result<()> {
    let of_body = |body: usize| &deck.materials[deck.bodies[body].material];
    let names = (0..deck.bodies.len()).map(|body| {
        let material = of_body(body);
        let keys = material.model.parameters.iter().map(|known| known.key.to_string());
        if material.varies() { keys.collect() } else { Vec::new() }
    });
    points.parameters = Named::zeros(names.collect(), points.len());
    if points.parameters.stride() == 0 {
        return Ok(());
    }
    let mut fault: Option<(u64, String)> = None;
    for p in 0..points.len() {
        let body = points.body[p];
        let material = of_body(body as usize);
        if !material.varies() {
            continue;
        }
        let values = material.values(&scope_of(points, p, 0.0, 0.0));
        if let Some((key, why)) = misfit(material, &values)
            && fault.as_ref().is_none_or(|(id, _)| points.id[p] < *id)
        {
            let key = format!("material.{}.{key}", material.name);
            let place = format!(
                "at point {} of body \"{}\", X = {:?} m",
                points.id[p], deck.bodies[body as usize].name, points.position_initial[p]
            );
            fault = Some((points.id[p], deck.origins.message(&key, &format!("{place}: {why}"))));
        }
        points.parameters.of_mut(p, body).copy_from_slice(&values);
    }
    world.refuse_lowest(fault)
}

/// The first parameter that is no good with the others, and why.
fn misfit(material: &model::Material, values: &[f64]) -> Option<(&'static str, String)> {
    let known = material.model.parameters.iter().zip(&material.parameters).zip(values);
    for ((parameter, given), &value) in known {
        let range = parameter.range.describe();
        if given.is_some() && !(value.is_finite() && parameter.range.contains(value)) {
            let why = format!("expected a number {range} ({}), found {value}", parameter.unit);
            return Some((parameter.key, why));
        }
    }
    (material.model.check)(values).err().map(|misfit| (misfit.key, misfit.why))
}

/// What follows from the materials of all points.
pub struct Overview {
    /// Mean stiffness scale of each body, weighted by the initial volume, Pa: what Ghost stiffness
    /// and penalties are factors of.
    pub stiffness: Vec<f64>,
    /// Whether the tangent of every point is symmetric in every state.
    pub symmetric: bool,
}

impl Overview {
    /// Collective.
    pub fn of<const D: usize>(
        world: &World,
        deck: &Deck,
        materials: &[Material],
        points: &Points<D>,
    ) -> Self {
        let varies = |body: usize| deck.materials[deck.bodies[body].material].varies();
        let bodies = 0..deck.bodies.len();
        let mut stiffness: Vec<f64> = materials.iter().map(Material::stiffness).collect();
        let mut symmetric = bodies.clone().all(|body| varies(body) || materials[body].symmetric());
        if bodies.clone().any(varies) {
            let mut sums = vec![0.0; 2 * materials.len()];
            for p in 0..points.len() {
                let body = points.body[p] as usize;
                if varies(body) {
                    let model = local(materials, points, p).model();
                    sums[2 * body] += model.stiffness() * points.volume_initial[p];
                    sums[2 * body + 1] += points.volume_initial[p];
                    symmetric &= model.symmetric();
                }
            }
            let sums = world.sum_slice(&sums);
            for body in bodies.filter(|&body| varies(body)) {
                stiffness[body] = sums[2 * body] / sums[2 * body + 1];
            }
        }
        Overview { stiffness, symmetric: !world.any(!symmetric) }
    }
}
