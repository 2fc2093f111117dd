//! The point that a message is about, alike on any number of ranks.

use crate::parallel::World;
use crate::points::Points;

/// The text of `say` about the point with the lowest id that has a fault, on all ranks. Collective.
pub fn of_first_point<const D: usize, F>(
    world: &World,
    points: &Points<D>,
    fault: impl Fn(usize) -> Option<F>,
    say: impl Fn(usize, F) -> String,
) -> Option<String> {
    let faulty = (0..points.len()).filter_map(|p| Some((points.id[p], p, fault(p)?)));
    let own = faulty.min_by_key(|(id, ..)| *id);
    world.lowest_message(own.map(|(id, p, fault)| (id, say(p, fault))))
}

/// Its number and where it is.
pub fn place<const D: usize>(points: &Points<D>, p: usize) -> String {
    format!("point {} at {:?} m", points.id[p], points.position[p])
}
