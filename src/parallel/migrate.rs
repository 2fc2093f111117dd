//! Points to the ranks that own the cells they are in, over any distance, in one exchange.
//! Nothing is dropped: a point outside the grid is an error that names it.

use std::collections::BTreeMap;

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
    let leaving = leaving(world, partition, grid, &cells);
    let moved = world.sum_usize(leaving.len());
    let mut kept: Vec<usize> = Vec::new();
    if moved > 0 {
        let mut gone = leaving.iter().map(|&(p, _)| p).peekable();
        kept = (0..points.len()).filter(|p| gone.next_if_eq(p).is_none()).collect();
        let arrived = exchange(world, packed(points, &leaving))?;
        let words = Points::<D>::record_words();
        points.reserve(arrived.iter().map(|(_, list)| list.len() / words).sum());
        for (_, list) in arrived {
            list.chunks_exact(words).for_each(|record| points.unpack(record));
        }
        for p in cells.len()..points.len() {
            // The sender located the same position with the same arithmetic.
            let cell = grid.locate(&points.position[p]).ok_or_else(|| outside(points, p))?;
            cells.push(cell);
            kept.push(p);
        }
    }
    sort_by_cell(points, &cells, (moved > 0).then_some(kept));
    Ok(moved)
}

/// The points in cells of other ranks, ascending, with those ranks.
fn leaving<const D: usize>(
    world: &World,
    partition: &Partition<D>,
    grid: &Grid<D>,
    cells: &[usize],
) -> Vec<(usize, usize)> {
    let mut leaving = Vec::new();
    if world.size() == 1 {
        return leaving;
    }
    let here = world.rank();
    // Neighbours in memory mostly share their cell.
    let mut last = None;
    for (p, &cell) in cells.iter().enumerate() {
        let owner = match last {
            Some((known, owner)) if known == cell => owner,
            _ => partition.owner_of_cell(grid, cell),
        };
        last = Some((cell, owner));
        if owner != here {
            leaving.push((p, owner));
        }
    }
    leaving
}

/// The records of these points, a list for each rank.
fn packed<const D: usize>(
    points: &Points<D>,
    leaving: &[(usize, usize)],
) -> Vec<(usize, Vec<f64>)> {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    leaving.iter().for_each(|&(_, rank)| *counts.entry(rank).or_default() += 1);
    let words = Points::<D>::record_words();
    let mut lists: BTreeMap<usize, Vec<f64>> =
        counts.into_iter().map(|(rank, count)| (rank, Vec::with_capacity(count * words))).collect();
    for &(p, rank) in leaving {
        if let Some(list) = lists.get_mut(&rank) {
            points.pack(p, list);
        }
    }
    lists.into_iter().collect()
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
