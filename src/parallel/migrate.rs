//! Points to the ranks that own the cells they are in, over any distance, in one exchange.
//! Nothing is dropped: a point outside the grid is an error that names it.

use std::collections::BTreeMap;

use super::{Partition, World, exchange};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::points::Points;
use crate::points::seed::CellByCell;
use crate::points::share::Share;
use crate::points::sort::{fill_gaps, sort_by_cell};

/// Moves the points and leaves each rank's nearly sorted by (cell, id): [`sort_by_cell`]. Returns
/// how many changed rank, over all ranks. Collective. Error, the same on all ranks: a point outside
/// the grid; no point has been moved then.
pub fn migrate<const D: usize>(
    world: &World,
    partition: &Partition<D>,
    grid: &Grid<D>,
    points: &mut Points<D>,
) -> Result<usize> {
    let cells = locate(world, grid, points)?;
    migrate_from(world, partition, grid, points, cells)
}

/// As [`migrate`] for points known to be in these cells. Collective.
pub fn migrate_from<const D: usize>(
    world: &World,
    partition: &Partition<D>,
    grid: &Grid<D>,
    points: &mut Points<D>,
    mut cells: Vec<usize>,
) -> Result<usize> {
    let leaving = leaving(world, partition, grid, &cells);
    let moved = world.sum_usize(leaving.len());
    if moved == 0 {
        sort_by_cell(points, &cells);
        return Ok(0);
    }
    let own = points.len();
    let arrived = exchange(world, packed(points, &leaving))?;
    let words = points.record_words();
    points.reserve(arrived.iter().map(|(_, list)| list.len() / words).sum());
    for (_, list) in arrived {
        list.chunks_exact(words).for_each(|record| points.unpack(record));
    }
    // The sender located the same position with the same arithmetic.
    append_cells(grid, points, &mut cells)?;
    fill_gaps(points, &mut cells, &indices(&leaving), own);
    Ok(moved)
}

/// As [`migrate_from`] for points as they were seeded: those that `seeding` can make are made where
/// they arrive, which is quicker than sending them. Same points in the same order. Collective.
pub fn distribute_seeded<const D: usize>(
    world: &World,
    partition: &Partition<D>,
    grid: &Grid<D>,
    points: &mut Points<D>,
    mut cells: Vec<usize>,
    seeding: &CellByCell<'_, D>,
) -> Result<usize> {
    if world.size() == 1 || !(0..seeding.bodies()).any(|body| seeding.makes(body)) {
        return migrate_from(world, partition, grid, points, cells);
    }
    let leaving = leaving(world, partition, grid, &cells);
    let moved = world.sum_usize(leaving.len());
    let mut sent = leaving.clone();
    sent.retain(|&(p, _)| !seeding.makes(points.body[p] as usize));
    let here = world.rank();
    let own = points.len();
    let mut arrived: BTreeMap<usize, Vec<f64>> =
        exchange(world, packed(points, &sent))?.into_iter().collect();
    let wanted = |cell: usize| partition.owner_of_cell(grid, cell) == here;
    let words = points.record_words();
    for rank in (0..world.size()).filter(|&rank| rank != here) {
        let list = arrived.remove(&rank).unwrap_or_default();
        let mut records = list.chunks_exact(words).peekable();
        for body in 0..seeding.bodies() {
            seeding.append(points, body, Share { rank, ranks: world.size() }, wanted);
            while let Some(record) = records.next_if(|r| Points::<D>::body_of(r) == body) {
                points.unpack(record);
            }
        }
    }
    let made = points.len() - own;
    let located = append_cells(grid, points, &mut cells);
    // A point that lies in another cell than the one it was made for is sent after all.
    let strays = located.is_err() || cells[own..].iter().any(|&cell| !wanted(cell));
    let complete = world.sum_usize(made) == moved;
    if world.any(strays) || !complete {
        points.truncate(own);
        cells.truncate(own);
        return migrate_from(world, partition, grid, points, cells);
    }
    fill_gaps(points, &mut cells, &indices(&leaving), own);
    Ok(moved)
}

fn indices(leaving: &[(usize, usize)]) -> Vec<usize> {
    leaving.iter().map(|&(p, _)| p).collect()
}

/// The cells of the points beyond those that are known.
fn append_cells<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
    cells: &mut Vec<usize>,
) -> Result<()> {
    let known = cells.len();
    for (k, cell) in grid.locate_each(points.position[known..].iter()).enumerate() {
        cells.push(cell.ok_or_else(|| outside(points, known + k))?);
    }
    Ok(())
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
    let words = points.record_words();
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
    let cells = grid
        .locate_each(points.position.iter())
        .enumerate()
        .map(|(p, cell)| cell.ok_or_else(|| outside(points, p)))
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
