//! The populated cells: strictly overlapped by a point's domain, or holding the point.

use rustc_hash::FxHashMap;

use crate::basis::Influences;
use crate::basis::contract::Basis;
use crate::contact::fields::Fields;
use crate::error::Result;
use crate::grid::Grid;
use crate::parallel::{Partition, World, exchange};
use crate::points::Points;

/// Populated cells as one rank sees them.
#[derive(Debug, Clone, Default)]
pub struct Populated {
    /// Cells reached by this rank's points, ascending; they may belong to other ranks.
    pub reached: Vec<usize>,
    /// Populated cells this rank owns, ascending, each with one bit for each of the first
    /// [`GROUP`] bodies.
    pub owned: Vec<(usize, u64)>,
    /// The next [`GROUP`] bodies, and so on: their cells owned here, with a bit for each body of
    /// the group. As many groups on every rank.
    pub further: Vec<Vec<(usize, u64)>>,
}

/// Bodies that have a bit of their own in one word.
pub const GROUP: usize = u64::BITS as usize;

impl Populated {
    /// Finds the cells of this rank's points and unites them at their owners. `bodies`: how many
    /// there are in all. `known`: the points' influences, if they have been found. Collective.
    pub fn find<const D: usize>(
        world: &World,
        grid: &Grid<D>,
        partition: &Partition<D>,
        (basis, bodies): (&dyn Basis<D>, usize),
        points: &Points<D>,
        known: Option<&Influences<D>>,
    ) -> Result<Self> {
        // Entries are numbered by cell and, within a cell, by group of bodies.
        let groups = bodies.div_ceil(GROUP).max(1);
        let mut met: Vec<(usize, u64)> = Vec::with_capacity(points.len());
        let mut cells = Vec::new();
        let mut scan = || -> Result<()> {
            for p in 0..points.len() {
                cells.clear();
                let near = met.last().map(|&(entry, _)| entry / groups);
                match known.and_then(|influences| influences.cells.of(p)) {
                    Some(known) => cells.extend_from_slice(known),
                    None => basis.populated_cells(grid, points, p, near, &mut cells)?,
                }
                let (group, bit) =
                    (points.body[p] as usize / GROUP, points.body[p] as usize % GROUP);
                let body = 1 << bit;
                for entry in cells.iter().map(|&cell| cell * groups + group) {
                    match met.last_mut() {
                        Some((last, bodies)) if *last == entry => *bodies |= body,
                        _ => met.push((entry, body)),
                    }
                }
            }
            Ok(())
        };
        let scanned = scan();
        world.fail_together(scanned)?;
        let met = united(met);
        let mut reached: Vec<usize> = met.iter().map(|&(entry, _)| entry / groups).collect();
        reached.dedup();

        let here = world.rank();
        let mut outgoing: FxHashMap<usize, Vec<u64>> = FxHashMap::default();
        let mut owned: Vec<(usize, u64)> = Vec::with_capacity(met.len());
        for &(entry, bodies) in &met {
            let owner = partition.owner_of_cell(grid, entry / groups);
            if owner == here {
                owned.push((entry, bodies));
            } else {
                outgoing.entry(owner).or_default().extend([entry as u64, bodies]);
            }
        }
        let alone = owned.len();
        for (_, words) in exchange(world, outgoing.into_iter().collect())? {
            owned.extend(words.chunks_exact(2).map(|record| (record[0] as usize, record[1])));
        }
        if owned.len() > alone {
            owned = united(owned);
        }
        let (owned, further) = by_group(owned, groups);
        Ok(Populated { reached, owned, further })
    }
}

impl Populated {
    /// The cells owned here as the bodies of one field populate them.
    pub fn of_field(&self, fields: &Fields, field: usize) -> Self {
        let of_group = |(group, cells): (usize, &CellBodies)| -> CellBodies {
            let own = (0..GROUP).filter(|bit| fields.of_body(group * GROUP + bit) == field);
            let mask = own.fold(0, |mask, bit| mask | 1 << bit);
            let masked = cells.iter().map(|&(cell, bits)| (cell, bits & mask));
            // The first group lists the cells of all others, too.
            masked.filter(|&(_, bits)| group == 0 || bits != 0).collect()
        };
        let owned = of_group((0, &self.owned));
        let further: Vec<_> =
            self.further.iter().enumerate().map(|(k, c)| of_group((k + 1, c))).collect();
        let owned = match further.is_empty() {
            true => owned.into_iter().filter(|&(_, bits)| bits != 0).collect(),
            false => owned,
        };
        Populated { reached: Vec::new(), owned, further }
    }

    /// (cell, field) of the cells owned here, ascending: a cell once for each field of its bodies.
    pub fn in_fields(&self, fields: &Fields) -> Vec<(usize, usize)> {
        if fields.is_single() {
            return self.owned.iter().map(|&(cell, _)| (cell, 0)).collect();
        }
        let mut found = Vec::new();
        for (group, cells) in std::iter::once(&self.owned).chain(&self.further).enumerate() {
            for &(cell, bits) in cells {
                let bodies = (0..GROUP).filter(|bit| bits >> bit & 1 == 1);
                found.extend(bodies.map(|bit| (cell, fields.of_body(group * GROUP + bit))));
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    }
}

/// Cells, ascending, each with the bits of its bodies.
type CellBodies = Vec<(usize, u64)>;

/// Entries `cell * groups + group`, ascending, as cells with the bits of the first group, and those
/// of each other group.
fn by_group(entries: CellBodies, groups: usize) -> (CellBodies, Vec<CellBodies>) {
    if groups == 1 {
        return (entries, Vec::new());
    }
    let mut all = CellBodies::new();
    let mut further = vec![Vec::new(); groups - 1];
    for (entry, bodies) in entries {
        let (cell, group) = (entry / groups, entry % groups);
        if all.last().is_none_or(|&(last, _)| last != cell) {
            all.push((cell, if group == 0 { bodies } else { 0 }));
        }
        if group > 0 {
            further[group - 1].push((cell, bodies));
        }
    }
    (all, further)
}

/// Entries ascending, those of one number joined: by a table where the numbers lie close together, by sorting where they do not.
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
    use super::{by_group, united};

    #[test]
    fn table_and_sorting_agree() {
        for spread in [1, 1 << 40] {
            let entries = [(7 * spread, 1), (3 * spread, 2), (7 * spread, 4), (3 * spread, 2)];
            assert_eq!(united(entries.to_vec()), [(3 * spread, 2), (7 * spread, 5)]);
        }
        assert!(united(Vec::new()).is_empty());
    }

    #[test]
    fn groups_of_bodies_keep_their_own_cells() {
        // Cell 4 with both groups, cell 5 with the second alone, cell 9 with the first.
        let (all, further) = by_group(vec![(8, 1), (9, 2), (11, 4), (18, 1 << 63)], 2);
        assert_eq!(all, [(4, 1), (5, 0), (9, 1 << 63)]);
        assert_eq!(further, [[(4, 2), (5, 4)]]);
    }
}
