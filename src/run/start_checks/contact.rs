//! Does a body overlap a rigid body before the first step? The penalty would push it out at once.

use crate::contact::start::corners_within;
use crate::error::{Error, Result};
use crate::parallel::World;
use crate::points::Points;
use crate::system::model::Model;

/// Cells of overlap that are round-off of bodies meant to touch.
const TOUCHING: f64 = 1e-6;

/// An error that names the deepest overlap. Collective.
pub fn require_apart<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
) -> Result<()> {
    let contacts = &model.contacts;
    if contacts.is_empty() {
        return Ok(());
    }
    let deck = &model.deck;
    let touching = TOUCHING * model.grid.cell_size();
    let corners = corners_within(contacts, deck.method.basis, points, -touching);
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
            "body \"{body}\" overlaps the rigid body \"{rigid}\" by {depth:.3e} m at the start, at \
             {:?} m (the domain of point {id}); move one of them by as much along {:?}",
            corner.place, corner.near.normal
        );
        (id, deck.places.say(&format!("contact.{}.between", pair.index), &why))
    });
    world.lowest_message(message).map_or(Ok(()), |message| Err(Error::Input(message)))
}
