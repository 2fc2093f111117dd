//! Whether initial stresses carry the loads that act at the start.
//!
//! At the start F = 1 whatever the stress is. f_int - f_ext at the free nodes is therefore what the deck's stresses
//! and loads leave unbalanced. The first step would turn it into a displacement that no load of the deck explains.

use crate::deck::{Deck, rough};
use crate::error::Result;
use crate::parallel::World;
use crate::points::Points;
use crate::system::conditions::StepSpan;
use crate::system::model::Model;
use crate::system::step_system::{Coupling, Discretisation};

use super::external::Loads;
use super::release::{released, releases};

/// Up to this share of the forces out of balance nothing is said; either is a sum of sizes over the nodes. A unit
/// weight of 18e3 and a density of 1800 under 9.81 differ by 2 %.
const TOLD: f64 = 0.03;
/// The first node is named whose force comes as near to the largest as round-off allows.
const EQUAL: f64 = 1e-6;

/// A warning of initial stresses that are not in balance with what acts at the start. Collective.
pub(crate) fn warning<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
) -> Result<Option<String>> {
    let deck = &model.deck;
    if !judged(deck) || releases(model, 0) {
        return Ok(None);
    }
    let span = StepSpan::first_of(&deck.stages, 0);
    let (mesh, conditions) =
        Discretisation::with_conditions(world, model, points, Coupling::Matrix, span)?;
    let loads = Loads::of_step(world, model, points, &mesh, span)?;
    let external = &loads.external_start;
    let (excess, _) = released(world, model, &mesh, points, external, span)?;

    let size = |force: &[f64]| force.iter().map(|f| f * f).sum::<f64>().sqrt();
    let (mut unheld, mut sums, mut largest) = (Vec::new(), [0.0; 3], 0.0f64);
    for (node, (excess, external)) in
        excess.chunks_exact(D).zip(external.chunks_exact(D)).enumerate()
    {
        let fixed = &conditions.fixed[node * D..(node + 1) * D];
        let free: [f64; D] = std::array::from_fn(|i| if fixed[i] { 0.0 } else { excess[i] });
        let internal: [f64; D] = std::array::from_fn(|i| excess[i] + external[i]);
        let free = size(&free);
        sums[0] += free;
        sums[1] += size(external);
        sums[2] += size(&internal);
        largest = largest.max(free);
        unheld.push(free);
    }
    let sums = world.sum_slice(&sums);
    let (out, acting) = (sums[0], sums[1].max(sums[2]));
    if !(out > TOLD * acting) {
        return Ok(None);
    }
    let largest = world.max(largest);
    let place = unheld.iter().position(|&free| free >= largest * (1.0 - EQUAL)).map(|node| {
        let node = mesh.numbering.nodes[node];
        (node as u64, format!("{:?}", model.grid.node_position(node)))
    });
    let place = world.lowest_message(place).unwrap_or_default();
    Ok(Some(format!(
        "the initial stresses are out of balance with the loads at the start: by {} N of {} N in all, most \
         at {place} m. The first step moves the bodies until they balance. Compare unit_weight with \
         density and gravity, surcharge with what lies or acts above, and what holds the sides; under a \
         sloping surface K0 never balances ([[stage]] reset_displacement sets displacements back \
         after a first stage)",
        rough(out),
        rough(acting),
    )))
}

/// Whether the start can be in balance: supports by penalty, contacts and declared terms bear
/// nothing before they have given way.
fn judged(deck: &Deck) -> bool {
    deck.bodies.iter().any(|body| body.initial_stress.is_some() && body.presence.holds_in(0))
        && deck.boundaries.iter().all(|boundary| boundary.support().is_none())
        && deck.contacts.is_empty()
        && deck.terms.is_empty()
}
