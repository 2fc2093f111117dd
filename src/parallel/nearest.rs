//! The point that is nearest to a place, over all ranks.

use super::World;
use crate::points::Points;

/// Id and distance (m) of the point, of all or of one body, whose initial position is nearest to
/// `place`. Of points equally near (to 1e-9 of a point's half length) the one with the lowest id is
/// taken, so that the answer is the same on any number of ranks. `None` without points. Collective.
pub fn nearest_point<const D: usize>(
    world: &World,
    points: &Points<D>,
    body: Option<usize>,
    place: &[f64],
) -> Option<(u64, f64)> {
    let distance = |p: usize| -> f64 {
        let x = &points.position_initial[p];
        x.iter().zip(place).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt()
    };
    let own: Vec<usize> = (0..points.len())
        .filter(|&p| body.is_none_or(|body| points.body[p] as usize == body))
        .collect();
    let best = world.min(own.iter().map(|&p| distance(p)).fold(f64::INFINITY, f64::min));
    let slack = 1e-9 * own.first().map_or(0.0, |&p| points.half_length_initial[p][0]);
    let near = own.iter().filter(|&&p| distance(p) <= best + slack);
    let id = world.min_u64(near.map(|&p| points.id[p]).min().unwrap_or(u64::MAX));
    (id != u64::MAX).then_some((id, best))
}
