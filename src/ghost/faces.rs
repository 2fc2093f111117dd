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

/// The cells of this rank, in their order, and those of others that are known.
struct Cells {
    first: usize,
    /// Place in `own` of the cells from `first` on; empty where they lie far apart.
    table: Vec<u32>,
    numbers: Vec<usize>,
    own: Vec<Cell>,
    others: FxHashMap<usize, Cell>,
}

impl Cells {
    fn new(populated: &[(usize, u64)]) -> Self {
        let first = populated.first().map_or(0, |own| own.0);
        let range = populated.last().map_or(0, |own| own.0 + 1 - first);
        let mut table = Vec::new();
        if range / 16 <= populated.len() {
            table.resize(range, u32::MAX);
            for (at, (cell, _)) in populated.iter().enumerate() {
                table[cell - first] = at as u32;
            }
        }
        let own = populated.iter().map(|own| Cell { populated: own.1, boundary: 0 }).collect();
        let numbers = populated.iter().map(|own| own.0).collect();
        Cells { first, table, numbers, own, others: FxHashMap::default() }
    }

    #[inline]
    fn get(&self, cell: usize) -> Option<&Cell> {
        let own = if self.table.is_empty() {
            self.numbers.binary_search(&cell).ok()
        } else {
            let place = self.table.get(cell.wrapping_sub(self.first));
            place.filter(|&&at| at != u32::MAX).map(|&at| at as usize)
        };
        own.map(|at| &self.own[at]).or_else(|| self.others.get(&cell))
    }
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
    let mut cells = Cells::new(populated);
    share_border_cells(world, grid, partition, populated, &mut cells)?;

    let mut neighbours = Vec::new();
    for (at, &(cell, bodies)) in populated.iter().enumerate() {
        neighbours.clear();
        grid.face_neighbours(cell, &mut neighbours);
        let everywhere = neighbours
            .iter()
            .fold(u64::MAX, |all, &n| all & cells.get(n).map_or(0, |cell| cell.populated));
        cells.own[at].boundary = bodies & !everywhere;
    }
    share_border_cells(world, grid, partition, populated, &mut cells)?;

    let mut faces = Vec::new();
    for (at, &(cell, bodies)) in populated.iter().enumerate() {
        let this = cells.own[at];
        neighbours.clear();
        grid.face_neighbours(cell, &mut neighbours);
        neighbours.sort_unstable();
        for &other_cell in neighbours.iter().filter(|&&n| n > cell) {
            let Some(other) = cells.get(other_cell) else { continue };
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
    cells: &mut Cells,
) -> Result<()> {
    let here = world.rank();
    if world.size() == 1 {
        return Ok(());
    }
    let mut outgoing: FxHashMap<usize, Vec<u64>> = FxHashMap::default();
    let mut neighbours = Vec::new();
    let mut ranks = Vec::new();
    for (at, &(cell, _)) in populated.iter().enumerate() {
        neighbours.clear();
        grid.face_neighbours(cell, &mut neighbours);
        ranks.clear();
        ranks.extend(neighbours.iter().map(|&n| partition.owner_of_cell(grid, n)));
        if ranks.iter().all(|&rank| rank == here) {
            continue;
        }
        ranks.sort_unstable();
        ranks.dedup();
        let state = cells.own[at];
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
            let state = Cell { populated: record[1], boundary: record[2] };
            cells.others.insert(record[0] as usize, state);
        }
    }
    Ok(())
}
