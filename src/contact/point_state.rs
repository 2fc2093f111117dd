//! The state of contact of a point, for the fields `contact_*`: numbers behind its elastic slip.

use super::Contacts;
use crate::deck::Deck;
use crate::points::Points;

/// Begin of the names of all of these fields.
pub const PREFIX: &str = "contact_";
pub const FORCE: [&str; 3] = ["contact_force.x", "contact_force.y", "contact_force.z"];
pub const GAP: &str = "contact_gap";
pub const SLIP: &str = "contact_slip";
pub const STATUS: &str = "contact_status";

/// Words behind the components of the force.
const OTHERS: [&str; 3] = [GAP, SLIP, STATUS];

/// Values of [`STATUS`]; without contact it is zero.
pub const STICKS: f64 = 1.0;
pub const SLIDES: f64 = 2.0;

/// The state of contact of one corner or node of a point at the end of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactState<const D: usize> {
    pub point: usize,
    /// On the point's body, N.
    pub force: [f64; D],
    /// m
    pub gap: f64,
    /// Way that it has slid in the step, m.
    pub slid: f64,
    pub status: f64,
}

/// Whether the deck asks for any of these fields.
pub fn is_wanted(deck: &Deck) -> bool {
    let probed = deck.probes.iter().flat_map(|probe| &probe.fields);
    let verified = deck.verify.iter().map(|verify| &verify.field);
    let mut all = deck.output.fields.iter().chain(probed).chain(verified);
    all.any(|name| name.starts_with(PREFIX))
}

/// Names of the words of a point.
pub fn names(dimension: usize) -> impl Iterator<Item = String> {
    FORCE[..dimension].iter().chain(&OTHERS).map(|name| name.to_string())
}

/// Writes the states to the points of bodies in contact; forces of one point add up, of
/// gaps the smallest counts, and slip goes on from step to step.
pub fn write_states<const D: usize>(
    contacts: &Contacts<D>,
    points: &mut Points<D>,
    states: impl Iterator<Item = ContactState<D>>,
) {
    if !contacts.keeps_state {
        return;
    }
    let words = D + OTHERS.len();
    let first = |names: &Vec<String>| names.iter().position(|name| name == FORCE[0]);
    let first: Vec<Option<usize>> = points.slip.names().iter().map(first).collect();
    for p in 0..points.len() {
        let body = points.body[p];
        if let Some(own) = first[body as usize] {
            let row = points.slip.of_mut(p, body);
            row[own..own + D + 1].fill(0.0);
            row[own + words - 1] = 0.0;
        }
    }
    let mut slid = vec![0.0f64; points.len()];
    for state in states {
        let body = points.body[state.point];
        let Some(own) = first[body as usize] else { continue };
        let row = &mut points.slip.of_mut(state.point, body)[own..own + words];
        for (sum, force) in row.iter_mut().zip(&state.force) {
            *sum += force;
        }
        row[D] = row[D].min(state.gap);
        let before = slid[state.point];
        slid[state.point] = before.max(state.slid);
        row[D + 1] += slid[state.point] - before;
        row[D + 2] = row[D + 2].max(state.status);
    }
}
