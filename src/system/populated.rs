//! The populated cells: strictly overlapped by a point's domain, or holding the point.

use rustc_hash::FxHashMap;

use crate::basis::{self, Influences};
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
    /// Finds the cells of this rank's points and unites them at their owners. `known`: the points'
    /// influences, if they have been found. Collective.
    pub fn find<const D: usize>(
        world: &World,
        grid: &Grid<D>,
        partition: &Partition<D>,
        basis: Basis,
        points: &Points<D>,
        known: Option<&Influences<D>>,
    ) -> Result<Self> {
        let mut met: Vec<(usize, u64)> = Vec::with_capacity(points.len());
        let mut cells = Vec::new();
        let mut scan = || -> Result<()> {
            for p in 0..points.len() {
                cells.clear();
                let near = met.last().map(|&(cell, _)| cell);
                match known.and_then(|influences| influences.cells.of(p)) {
                    Some(known) => cells.extend_from_slice(known),
                    None => basis::populated_cells(grid, basis, points, p, near, &mut cells)?,
                }
                let body = 1 << points.body[p];
                for &cell in &cells {
                    match met.last_mut() {
                        Some((last, bodies)) if *last == cell => *bodies |= body,
                        _ => met.push((cell, body)),
                    }
                }
            }
            Ok(())
        };
        let scanned = scan();
        world.fail_together(scanned)?;
        let met = united(met);
        let reached: Vec<usize> = met.iter().map(|&(cell, _)| cell).collect();

        let here = world.rank();
        let mut outgoing: FxHashMap<usize, Vec<u64>> = FxHashMap::default();
        let mut owned: Vec<(usize, u64)> = Vec::with_capacity(met.len());
        for &(cell, bodies) in &met {
            let owner = partition.owner_of_cell(grid, cell);
            if owner == here {
                owned.push((cell, bodies));
            } else {
                outgoing.entry(owner).or_default().extend([cell as u64, bodies]);
            }
        }
        let alone = owned.len();
        for (_, words) in exchange(world, outgoing.into_iter().collect())? {
            owned.extend(words.chunks_exact(2).map(|record| (record[0] as usize, record[1])));
        }
        if owned.len() > alone {
            owned = united(owned);
        }
        Ok(Populated { reached, owned })
    }
}

/// Entries ascending by cell, those of one cell joined: by a table where the cells lie close
/// together, by sorting where they do not.
fn united(mut entries: Vec<(usize, u64)>) -> Vec<(usize, u64)> {
    let cells = || entries.iter().map(|&(cell, _)| cell);
    let (Some(low), Some(high)) = (cells().min(), cells().max()) else { return entries };
    if (high - low) / 16 > entries.len() {
        entries.sort_unstable();
        entries.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            if same {
                kept.1 |= next.1;
            }
            same
        });
        return entries;
    }
    let mut bodies_of = vec![0u64; high - low + 1];
    for (cell, bodies) in entries {
        bodies_of[cell - low] |= bodies;
    }
    let marked = bodies_of.into_iter().enumerate().filter(|(_, bodies)| *bodies != 0);
    marked.map(|(at, bodies)| (low + at, bodies)).collect()
}

#[cfg(test)]
mod tests {
    use super::united;

    #[test]
    fn table_and_sorting_agree() {
        for spread in [1, 1 << 40] {
            let entries = [(7 * spread, 1), (3 * spread, 2), (7 * spread, 4), (3 * spread, 2)];
            assert_eq!(united(entries.to_vec()), [(3 * spread, 2), (7 * spread, 5)]);
        }
        assert!(united(Vec::new()).is_empty());
    }
}
