//! Does a body overlap a rigid body that comes? The penalty would push it out at once.

use super::model::Model;
use crate::contact::start::corners_within;
use crate::deck::{Presence, When};
use crate::error::Result;
use crate::parallel::World;
use crate::points::Points;

/// Cells of overlap that are round-off of bodies meant to touch.
const TOUCHING: f64 = 1e-6;
/// Cells of overlap with what comes to bodies that have moved by then.
const MOVED: f64 = 0.01;

/// An error that names the deepest overlap with what comes with a stage, at its start. Collective.
pub fn require_apart<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    start: When,
) -> Result<()> {
    let contacts = &model.contacts;
    let deck = &model.deck;
    let comes = |presence: &Presence| presence.comes_in(start.stage);
    if !contacts.pairs.iter().any(|pair| comes(&pair.presence)) {
        return Ok(());
    }
    let slack = if start.stage == 0 { TOUCHING } else { MOVED };
    let margin = -slack * model.grid.cell_size();
    let corners = corners_within(contacts, deck.method.basis, points, margin, (start, comes));
    let moment = match start.stage {
        0 => String::from("at the start"),
        stage => format!("as stage \"{}\" begins", deck.stages[stage].name),
    };
    // Of corners equally deep up to round-off the first point is named, on any number of ranks.
    let depth = world.max(corners.iter().map(|corner| -corner.near.gap).fold(0.0, f64::max));
    if depth == 0.0 {
        return Ok(());
    }
    let deepest = corners
        .iter()
        .filter(|corner| -corner.near.gap >= depth * (1.0 - 1e-9))
        .min_by_key(|corner| points.id[corner.point]);
    let message = deepest.map(|corner| {
        let pair = &contacts.pairs[corner.pair];
        let (body, rigid) = (&deck.bodies[pair.body].name, &contacts.rigids[pair.rigid].name);
        let id = points.id[corner.point];
        let why = format!(
            "body \"{body}\" overlaps the rigid body \"{rigid}\" by {depth:.3e} m {moment}, at \
             {:?} m (the domain of point {id}); move one of them by as much along {:?}",
            corner.place, corner.near.normal
        );
        (id, deck.origins.message(&format!("contact.{}.between", pair.index), &why))
    });
    world.refuse_lowest(message)
}
