//! The point that is nearest to a place, over all ranks.

use super::World;
use crate::deck::rough;
use crate::grid::Grid;
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

/// Id of the nearest point, at most the diagonal of a cell and half that of the point's domain away.
/// `body`: index and name of the one that it must belong to. Error, the same on all ranks: there is
/// none, in words. Collective.
pub fn require_near<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    points: &Points<D>,
    body: Option<(usize, &str)>,
    place: &[f64],
) -> Result<u64, String> {
    let nearest = nearest_point(world, points, body.map(|(index, _)| index), place);
    let Some((id, distance)) = nearest else { return Err("there are no points".to_string()) };
    let of_body = body.map_or(String::new(), |(_, name)| format!(" of body \"{name}\""));
    let far = points.id.iter().position(|own| *own == id).and_then(|p| {
        let half = points.half_length_initial[p].iter().copied().fold(0.0, f64::max);
        let reach = (D as f64).sqrt() * (grid.cell_size() + half);
        (distance > reach).then(|| {
            format!(
                "{place:?} m is {} m away from the nearest point{of_body}, which is at {:?} m; \
                 expected a place within a cell of it ({} m)",
                rough(distance),
                points.position_initial[p],
                rough(reach)
            )
        })
    });
    world.first_message(far).map_or(Ok(id), Err)
}
