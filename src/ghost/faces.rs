//! A boundary cell is populated and shares a face with an unpopulated cell inside the grid; a
//! boundary face is a face of a boundary cell whose two cells are both populated
//! (Ghost §3.1, §4.2). Found for each body alone, then united.
//!
//! A cell of a lattice at the edge of the grid is a boundary cell, too, if the body reaches into it and
//! no point has its centre there. The paper's bodies fill the cells at the edge; one that comes to
//! overlap them by 1e-6 of a cell would leave nodes on the edge with as little stiffness, and no
//! unpopulated cell beside them.
//!
//! The penalty bounds the condition only if a path of such faces leads from every cell to a well
//! filled one (E. Burman, "Ghost penalty", Comptes Rendus Mathematique 348 (2010) 1217-1220).
//! Points leave triangles and tetrahedra empty between populated ones far more often than the paper's
//! quadrilaterals, and a cell behind such a gap would hang on by nodes alone. So an empty simplex
//! between two populated cells is a *bridge*: its faces to them are boundary faces, too. Two faces
//! hold all nodes of a simplex, so this adds no equation, and a linear field still has no jump.
//! Where two or more empty simplices lie between them the cells are tied directly
//! ([`super::ties`]). Quadrilaterals and hexahedra stay with the paper's rule.

use rustc_hash::FxHashMap;

use crate::error::Result;
use crate::grid::{FacePair, Grid};
use crate::parallel::{Partition, World, exchange};

use super::cells::{BoundaryFace, KnownCells};
use super::ties::ties;

/// Finds the boundary faces and ties whose lower cell this rank owns, in ascending order.
///
/// `populated` lists the populated cells this rank owns, each with the bits of its bodies, in
/// ascending order. `held`: the bodies, one bit each, that have the centre of a point in a cell of this
/// rank at the edge of a lattice. Cells across a partition border are exchanged twice: once to know which
/// neighbours are populated, once to know which of them are boundary cells or bridges.
pub fn boundary_faces<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    partition: &Partition<D>,
    populated: &[(usize, u64)],
    held: impl Fn(usize) -> u64,
) -> Result<Vec<BoundaryFace>> {
    let mut cells = KnownCells::new(populated);
    let mut owned: Vec<usize> = populated.iter().map(|&(cell, _)| cell).collect();
    share_border_cells(world, grid, partition, &owned, &mut cells)?;

    let mut neighbours = Vec::new();
    for (at, &(cell, bodies)) in populated.iter().enumerate() {
        neighbours.clear();
        grid.face_neighbours(cell, &mut neighbours);
        let everywhere = neighbours
            .iter()
            .fold(u64::MAX, |all, &n| all & cells.get(n).map_or(0, |cell| cell.populated));
        cells.own[at].boundary = bodies & !everywhere;
        if neighbours.len() < 2 * D {
            cells.own[at].boundary |= bodies & !held(cell);
        }
    }
    if grid.element().is_simplex() {
        for (cell, bodies) in bridges(world, grid, partition, &cells) {
            cells.entry(cell).bridge = bodies;
            owned.push(cell);
        }
        owned.sort_unstable();
        owned.dedup();
    }
    share_border_cells(world, grid, partition, &owned, &mut cells)?;

    let mut faces = Vec::new();
    for &cell in &owned {
        let Some(&this) = cells.get(cell) else { continue };
        neighbours.clear();
        grid.face_neighbours(cell, &mut neighbours);
        neighbours.sort_unstable();
        for &other_cell in neighbours.iter().filter(|&&n| n > cell) {
            let Some(other) = cells.get(other_cell) else { continue };
            // One of the two is a boundary cell, hence populated.
            let united = (this.populated | this.bridge)
                & (other.populated | other.bridge)
                & (this.boundary | other.boundary);
            if united != 0 {
                faces.push(BoundaryFace {
                    pair: FacePair { lower: cell, upper: other_cell },
                    bodies: united,
                });
            }
        }
    }
    if grid.element().is_simplex() {
        let boundary: Vec<(usize, u64)> = populated
            .iter()
            .zip(&cells.own)
            .filter(|(_, state)| state.boundary != 0)
            .map(|(&(cell, _), state)| (cell, state.boundary))
            .collect();
        faces.extend(ties(world, grid, partition, &mut cells, &boundary)?);
        faces.sort_unstable_by_key(|face| (face.pair.lower, face.pair.upper));
    }
    Ok(faces)
}

/// The cells of this rank that are empty of a body but have two neighbours populated by it,
/// ascending, with the bits of those bodies. `cells` holds all populated cells beside own ones.
fn bridges<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    partition: &Partition<D>,
    cells: &KnownCells,
) -> Vec<(usize, u64)> {
    let here = world.rank();
    let mut candidates = Vec::new();
    for &cell in cells.numbers.iter().chain(cells.others.keys()) {
        grid.face_neighbours(cell, &mut candidates);
    }
    candidates.sort_unstable();
    candidates.dedup();
    let mut neighbours = Vec::new();
    candidates.retain(|&cell| partition.owner_of_cell(grid, cell) == here);
    let populated = |cell: &usize| cells.get(*cell).map_or(0, |cell| cell.populated);
    let bridge = |cell: usize| {
        neighbours.clear();
        grid.face_neighbours(cell, &mut neighbours);
        let (mut once, mut twice) = (0, 0);
        for bodies in neighbours.iter().map(populated) {
            twice |= once & bodies;
            once |= bodies;
        }
        (cell, twice & !populated(&cell))
    };
    candidates.into_iter().map(bridge).filter(|&(_, bodies)| bodies != 0).collect()
}

/// Sends the state of the cells in `owned` to the owners of their neighbours.
fn share_border_cells<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    partition: &Partition<D>,
    owned: &[usize],
    cells: &mut KnownCells,
) -> Result<()> {
    let here = world.rank();
    if world.size() == 1 {
        return Ok(());
    }
    let mut outgoing: FxHashMap<usize, Vec<u64>> = FxHashMap::default();
    let mut neighbours = Vec::new();
    let mut ranks = Vec::new();
    for &cell in owned {
        neighbours.clear();
        grid.face_neighbours(cell, &mut neighbours);
        ranks.clear();
        ranks.extend(neighbours.iter().map(|&n| partition.owner_of_cell(grid, n)));
        if ranks.iter().all(|&rank| rank == here) {
            continue;
        }
        ranks.sort_unstable();
        ranks.dedup();
        let state = cells.get(cell).copied().unwrap_or_default();
        for &rank in ranks.iter().filter(|&&rank| rank != here) {
            outgoing.entry(rank).or_default().extend(state.record(cell as u64));
        }
    }
    for (_, words) in exchange(world, outgoing.into_iter().collect())? {
        cells.insert_records(&words);
    }
    Ok(())
}
