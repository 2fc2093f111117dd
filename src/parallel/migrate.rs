//! Points to the ranks that own the cells they are in, over any distance, in one exchange.
//! Nothing is dropped: a point outside the grid is an error that names it.

use rustc_hash::FxHashMap;

use super::{Partition, World, exchange};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::points::Points;
use crate::points::sort::sort_by_cell;

/// Moves the points and leaves each rank's nearly sorted by (cell, id): [`sort_by_cell`]. Returns
/// how many changed rank, over all ranks. Collective. Error, the same on all ranks: a point outside
/// the grid; no point has been moved then.
pub fn migrate<const D: usize>(
    world: &World,
    partition: &Partition<D>,
    grid: &Grid<D>,
    points: &mut Points<D>,
) -> Result<usize> {
    let mut cells = locate(world, grid, points)?;
    let here = world.rank();
    let mut stay = Vec::with_capacity(points.len());
    let mut outgoing: FxHashMap<usize, Vec<f64>> = FxHashMap::default();
    // Neighbours in memory mostly share their cell.
    let mut last = None;
    for (p, &cell) in cells.iter().enumerate() {
        let owner = match last {
            Some((known, owner)) if known == cell => owner,
            _ => partition.owner_of_cell(grid, cell),
        };
        last = Some((cell, owner));
        if owner == here {
            stay.push(p);
        } else {
            points.pack(p, outgoing.entry(owner).or_default());
        }
    }
    let moved = world.sum_usize(points.len() - stay.len());
    if moved > 0 {
        if stay.len() < points.len() {
            points.select(&stay);
            cells = stay.iter().map(|&p| cells[p]).collect();
        }
        for (_, words) in exchange(world, outgoing.into_iter().collect())? {
            for record in words.chunks_exact(Points::<D>::record_words()) {
                points.unpack(record);
            }
        }
        for p in cells.len()..points.len() {
            // The sender located the same position with the same arithmetic.
            let cell = grid.locate(&points.position[p]).ok_or_else(|| outside(points, p))?;
            cells.push(cell);
        }
    }
    sort_by_cell(points, &cells);
    Ok(moved)
}

/// The cell of every point. Collective; the error names the first point outside the grid on the
/// lowest rank that has one.
pub fn locate<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    points: &Points<D>,
) -> Result<Vec<usize>> {
    let cells = (0..points.len())
        .map(|p| grid.locate(&points.position[p]).ok_or_else(|| outside(points, p)))
        .collect();
    world.fail_together(cells)
}

fn outside<const D: usize>(points: &Points<D>, p: usize) -> Error {
    let x = &points.position[p];
    let (what, cure) = if x.iter().all(|x| x.is_finite()) {
        ("lies outside the grid", "enlarge the grid, or hold the body inside it")
    } else {
        ("is not finite", "the step before was unstable: take smaller steps")
    };
    Error::Run(format!(
        "point {} of body {}: its position {x:?} {what}; {cure}",
        points.id[p], points.body[p]
    ))
}
