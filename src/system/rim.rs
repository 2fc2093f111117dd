//! Bodies that hold the centre of a point in a cell at the edge of a lattice.
//!
//! A body that only reaches into such a cell, with the sides of its points' domains, may overlap it by
//! next to nothing, and no cell beyond it says so: its other neighbours may be reached as little, and
//! its outer side has none. A point's centre in the cell means that half of a domain lies there.

use rustc_hash::FxHashMap;

use super::populated::GROUP;
use crate::grid::{Grid, Lattice};
use crate::points::Points;

/// Of the cells of this rank at the lattice's edge.
#[derive(Debug, Default)]
pub struct Rim {
    /// Bits of the bodies by group of bodies and cell. `None` on a mesh: nothing is asked of its cells.
    held: Option<FxHashMap<(usize, usize), u64>>,
}

impl Rim {
    /// Points live on the rank of their cell, so no other rank knows more of it.
    pub fn of<const D: usize>(grid: &Grid<D>, points: &Points<D>) -> Self {
        let Grid::Lattice(lattice) = grid else { return Rim::default() };
        let mut held = FxHashMap::default();
        for (x, &body) in points.position.iter().zip(&points.body) {
            if let Some(cell) = cell_at_edge(lattice, x) {
                let body = body as usize;
                *held.entry((body / GROUP, cell)).or_default() |= 1 << (body % GROUP);
            }
        }
        Rim { held: Some(held) }
    }

    /// The bodies of a group whose points' centres a cell at the edge holds, one bit each; all of them
    /// where nothing is asked.
    pub fn held(&self, group: usize, cell: usize) -> u64 {
        let bits = |held: &FxHashMap<_, _>| held.get(&(group, cell)).copied().unwrap_or(0);
        self.held.as_ref().map_or(u64::MAX, bits)
    }
}

/// The cell that holds `x`, if it lies at the edge.
#[inline]
fn cell_at_edge<const D: usize>(lattice: &Lattice<D>, x: &[f64; D]) -> Option<usize> {
    let index = lattice.cell_of(x)?;
    let outer = (0..D).any(|a| index[a] == 0 || index[a] + 1 == lattice.cells[a]);
    outer.then(|| lattice.cell_at(index))
}
