//! A boundary cell is populated and shares a face with an unpopulated cell inside the grid; a
//! boundary face is a face of a boundary cell whose two cells are both populated
//! (Ghost §3.1, §4.2). Found for each body alone, then united.

use rustc_hash::FxHashMap;

use crate::error::Result;
use crate::grid::{FacePair, Grid};
use crate::parallel::{Partition, World, exchange};

/// A face with its bodies, one bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoundaryFace {
    pub pair: FacePair,
    pub bodies: u64,
}

/// What a neighbour rank must know of a cell.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    /// Bodies that populate the cell, one bit each.
    populated: u64,
    /// Bodies for which it is a boundary cell.
    boundary: u64,
}

/// Finds the boundary faces whose lower cell this rank owns, in ascending order.
///
/// `populated` lists the populated cells this rank owns, each with the bits of its bodies, in
/// ascending order. Cells across a partition border are exchanged twice: once to know which
/// neighbours are populated, once to know which of them are boundary cells.
pub fn boundary_faces<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    partition: &Partition<D>,
    populated: &[(usize, u64)],
) -> Result<Vec<BoundaryFace>> {
    let mut cells: FxHashMap<usize, Cell> = populated
        .iter()
        .map(|&(cell, bodies)| (cell, Cell { populated: bodies, boundary: 0 }))
        .collect();
    share_border_cells(world, grid, partition, populated, &mut cells)?;

    let mut neighbours = Vec::new();
    for &(cell, bodies) in populated {
        neighbours.clear();
        grid.face_neighbours(cell, &mut neighbours);
        let everywhere = neighbours
            .iter()
            .fold(u64::MAX, |all, n| all & cells.get(n).map_or(0, |cell| cell.populated));
        cells.get_mut(&cell).expect("own cells were inserted above").boundary =
            bodies & !everywhere;
    }
    share_border_cells(world, grid, partition, populated, &mut cells)?;

    let mut faces = Vec::new();
    for &(cell, bodies) in populated {
        let this = cells[&cell];
        neighbours.clear();
        grid.face_neighbours(cell, &mut neighbours);
        neighbours.sort_unstable();
        for &other_cell in neighbours.iter().filter(|&&n| n > cell) {
            let Some(other) = cells.get(&other_cell) else { continue };
            let united = bodies & other.populated & (this.boundary | other.boundary);
            if united != 0 {
                faces.push(BoundaryFace {
                    pair: FacePair { lower: cell, upper: other_cell },
                    bodies: united,
                });
            }
        }
    }
    Ok(faces)
}

/// Sends the state of each owned populated cell to the owners of its neighbours.
fn share_border_cells<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    partition: &Partition<D>,
    populated: &[(usize, u64)],
    cells: &mut FxHashMap<usize, Cell>,
) -> Result<()> {
    let here = world.rank();
    if world.size() == 1 {
        return Ok(());
    }
    let mut outgoing: FxHashMap<usize, Vec<u64>> = FxHashMap::default();
    let mut neighbours = Vec::new();
    let mut ranks = Vec::new();
    for &(cell, _) in populated {
        neighbours.clear();
        grid.face_neighbours(cell, &mut neighbours);
        ranks.clear();
        ranks.extend(neighbours.iter().map(|&n| partition.owner_of_cell(grid, n)));
        if ranks.iter().all(|&rank| rank == here) {
            continue;
        }
        ranks.sort_unstable();
        ranks.dedup();
        let state = cells[&cell];
        for &rank in ranks.iter().filter(|&&rank| rank != here) {
            outgoing.entry(rank).or_default().extend([
                cell as u64,
                state.populated,
                state.boundary,
            ]);
        }
    }
    for (_, words) in exchange(world, outgoing.into_iter().collect())? {
        for record in words.chunks_exact(3) {
            cells.insert(record[0] as usize, Cell { populated: record[1], boundary: record[2] });
        }
    }
    Ok(())
}
