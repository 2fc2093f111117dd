//! The populated cells: strictly overlapped by a point's domain, or holding the point.

use rustc_hash::FxHashMap;

use crate::basis;
use crate::deck::model::Basis;
use crate::error::Result;
use crate::grid::Grid;
use crate::parallel::{Partition, World, exchange};
use crate::points::Points;

/// Populated cells as one rank sees them.
#[derive(Debug, Clone, Default)]
pub struct Populated {
    /// Cells reached by this rank's points, ascending; they may belong to other ranks.
    pub reached: Vec<usize>,
    /// Populated cells this rank owns, ascending, each with one bit per body.
    pub owned: Vec<(usize, u64)>,
}

impl Populated {
    /// Finds the cells of this rank's points and unites them at their owners. Collective.
    pub fn find<const D: usize>(
        world: &World,
        grid: &Grid<D>,
        partition: &Partition<D>,
        basis: Basis,
        points: &Points<D>,
    ) -> Result<Self> {
        let mut bodies_of: FxHashMap<usize, u64> = FxHashMap::default();
        let mut cells = Vec::new();
        let mut scan = || -> Result<()> {
            for p in 0..points.len() {
                cells.clear();
                basis::populated_cells(grid, basis, points, p, &mut cells)?;
                for &cell in &cells {
                    *bodies_of.entry(cell).or_default() |= 1 << points.body[p];
                }
            }
            Ok(())
        };
        let scanned = scan();
        world.fail_together(scanned)?;

        let mut reached: Vec<usize> = bodies_of.keys().copied().collect();
        reached.sort_unstable();

        let here = world.rank();
        let mut outgoing: FxHashMap<usize, Vec<u64>> = FxHashMap::default();
        let mut owned: FxHashMap<usize, u64> = FxHashMap::default();
        for &cell in &reached {
            let owner = partition.owner_of_cell(grid, cell);
            if owner == here {
                *owned.entry(cell).or_default() |= bodies_of[&cell];
            } else {
                outgoing.entry(owner).or_default().extend([cell as u64, bodies_of[&cell]]);
            }
        }
        for (_, words) in exchange(world, outgoing.into_iter().collect())? {
            for record in words.chunks_exact(2) {
                *owned.entry(record[0] as usize).or_default() |= record[1];
            }
        }
        let mut owned: Vec<(usize, u64)> = owned.into_iter().collect();
        owned.sort_unstable();
        Ok(Populated { reached, owned })
    }
}
