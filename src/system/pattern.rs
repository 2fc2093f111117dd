//! The node graph: which pairs of nodes meet in a contribution. Rows of owned nodes are final;
//! rows of nodes owned elsewhere are collected and sent to their owner in a fixed order.

use crate::error::Result;
use crate::parallel::{World, exchange};
use crate::petsc::Index;

use super::border::Border;
use super::graph::{Lists, neighbours};
use super::node_index::NodeIndex;
use super::numbering::{Numbering, Touched};
use super::support_columns::SupportColumns;

/// Exact sparsity of one rank's rows, in blocks of one node.
#[derive(Debug, Default)]
pub struct Pattern {
    /// Row r of the owned nodes is `offsets[r]..offsets[r + 1]`; rows beyond `numbering.owned`
    /// belong to ghosts this rank contributes to, in local order.
    pub offsets: Vec<usize>,
    /// Local node indices, ascending by equation number within a row.
    pub columns: Vec<u32>,
    /// Local index -> row, `u32::MAX` for ghosts that are columns only.
    pub row_of: Vec<u32>,
    /// First entry of the ghost rows.
    pub ghost_start: usize,
    /// (rank, range of entries beyond `ghost_start`) in ascending rank order.
    pub sends: Vec<(usize, std::ops::Range<usize>)>,
    /// (rank, owned entry of each received entry), in the sender's order.
    pub receives: Vec<(usize, Vec<u32>)>,
    /// Local nodes of each support, in the order they were given.
    pub supports: Lists,
    /// Where the block of each support lies.
    pub support_columns: SupportColumns,
}

/// Numbers the active nodes and builds their graph. `supports` are the node lists (global
/// numbers) whose members all meet: one per group of points, one per Ghost face. `owner_of`
/// gives the rank of any node. Collective.
pub fn build<'a>(
    world: &World,
    touched: Touched,
    owner_of: impl Fn(usize) -> usize,
    supports: impl Iterator<Item = &'a [usize]> + Clone,
) -> Result<(Numbering, Pattern)> {
    let Touched { owned, foreign } = touched;
    // First order of the nodes: owned, then those touched here but owned elsewhere.
    let nodes: Vec<usize> =
        owned.iter().copied().chain(foreign.iter().map(|&(_, node)| node)).collect();
    let first = NodeIndex::new(nodes.iter().copied());
    let mut lists = index_supports(&first, supports);
    let holders = lists.transposed(nodes.len());
    let rows = neighbours(&lists, &holders);

    let mut extra = columns_of_others(world, &nodes, &first, &foreign, &rows, owned.len())?;
    let mut ghosts = foreign.clone();
    ghosts.extend(
        extra
            .iter()
            .filter(|(_, column)| first.get(*column).is_none())
            .map(|&(_, c)| (owner_of(c), c)),
    );
    ghosts.sort_unstable();
    ghosts.dedup();
    let owned_count = owned.len();
    let numbering = Numbering::build(world, owned, &ghosts)?;

    // From the first order to the final one, in which unseen columns lie between the foreign.
    let mut local: Vec<u32> = (0..owned_count as u32).collect();
    local.extend(foreign.iter().map(|&(_, node)| numbering.index[node]));
    for item in &mut lists.items {
        *item = local[*item as usize];
    }
    extra.sort_unstable();
    let mut row_of = vec![u32::MAX; numbering.len()];
    let mut final_rows = Lists::with_capacity(nodes.len(), rows.items.len() + extra.len());
    let mut extra = extra.into_iter().peekable();
    for (i, &this) in local.iter().enumerate() {
        row_of[this as usize] = i as u32;
        let start = final_rows.items.len();
        final_rows.items.extend(rows.list(i).iter().map(|&column| local[column as usize]));
        // Owned nodes ascend already; ghosts and what others added can be out of place.
        let mut ascends = final_rows.items[start..].iter().all(|&c| (c as usize) < owned_count);
        while let Some((_, column)) = extra.next_if(|&(row, _)| row == i) {
            final_rows.items.push(numbering.index[column]);
            ascends = false;
        }
        if !ascends {
            let row = &mut final_rows.items[start..];
            row.sort_unstable_by_key(|&column| numbering.global[column as usize]);
            drop_repeats(&mut final_rows.items, start);
        }
        final_rows.close();
    }
    let touched = local.iter().enumerate().map(|(i, &this)| (this, i, holders.list(i)));
    let support_columns = SupportColumns::find(&lists, touched, &final_rows, &numbering.global);
    let support_columns = world.fail_together(support_columns)?;
    let ghost_start = final_rows.offsets[numbering.owned];
    let mut pattern = Pattern {
        offsets: final_rows.offsets,
        columns: final_rows.items,
        row_of,
        ghost_start,
        sends: Vec::new(),
        receives: Vec::new(),
        supports: lists,
        support_columns,
    };
    pattern.plan_exchange(world, &numbering, &ghosts)?;
    Ok((numbering, pattern))
}

/// The supports in the first order of the nodes.
fn index_supports<'a>(
    first: &NodeIndex,
    supports: impl Iterator<Item = &'a [usize]> + Clone,
) -> Lists {
    let (count, items) =
        supports.clone().fold((0, 0), |(count, items), list| (count + 1, items + list.len()));
    let mut lists = Lists::with_capacity(count, items);
    for support in supports {
        lists.items.extend(support.iter().map(|&node| first[node]));
        lists.close();
    }
    lists
}

/// Rows of foreign nodes travel to their owners as: node, count, columns...; returns what
/// arrived for the owned rows, pairs (row, column's node). Collective.
fn columns_of_others(
    world: &World,
    nodes: &[usize],
    first: &NodeIndex,
    foreign: &[(usize, usize)],
    rows: &Lists,
    owned: usize,
) -> Result<Vec<(usize, usize)>> {
    let mut outgoing: Vec<(usize, Vec<u64>)> = Vec::new();
    for (i, &(owner, node)) in foreign.iter().enumerate() {
        if outgoing.last().is_none_or(|(rank, _)| *rank != owner) {
            outgoing.push((owner, Vec::new()));
        }
        let words = &mut outgoing.last_mut().expect("pushed above").1;
        let row = rows.list(owned + i);
        words.push(node as u64);
        words.push(row.len() as u64);
        words.extend(row.iter().map(|&column| nodes[column as usize] as u64));
    }
    let mut extra = Vec::new();
    for (_, words) in &exchange(world, outgoing)? {
        for_each_row(words, |node, columns| {
            let row = first[node] as usize;
            extra.extend(columns.iter().map(|&column| (row, column as usize)));
        });
    }
    Ok(extra)
}

/// Drops repeats in the sorted tail of `items`.
fn drop_repeats(items: &mut Vec<u32>, start: usize) {
    let mut kept = start;
    for k in start..items.len() {
        if k == start || items[k] != items[kept - 1] {
            items[kept] = items[k];
            kept += 1;
        }
    }
    items.truncate(kept);
}

impl Pattern {
    /// The first `owned` rows, those with columns of other ranks' nodes apart.
    pub fn border(&self, owned: usize) -> Border {
        let reaches = |row: &[usize]| {
            self.columns[row[0]..row[1]].iter().any(|&column| column as usize >= owned)
        };
        Border::new(self.offsets.windows(2).take(owned).map(reaches))
    }

    /// Position of the diagonal of an owned row, if it is in the pattern.
    pub fn diagonal(&self, row: usize) -> Option<usize> {
        let range = self.offsets[row]..self.offsets[row + 1];
        let own = |&column: &u32| column as usize == row;
        self.columns[range.clone()].iter().position(own).map(|position| range.start + position)
    }

    /// Tells each owner, entry by entry, which of its entries the ghost rows add to.
    fn plan_exchange(
        &mut self,
        world: &World,
        numbering: &Numbering,
        ghosts: &[(usize, usize)],
    ) -> Result<()> {
        let mut outgoing: Vec<(usize, Vec<u64>)> = Vec::new();
        for (g, &(owner, _)) in ghosts.iter().enumerate() {
            let local = numbering.owned + g;
            let row = self.row_of[local];
            if row == u32::MAX {
                continue;
            }
            let range = self.offsets[row as usize]..self.offsets[row as usize + 1];
            // The owner never hears of a list without entries, and would take what is sent for
            // it for the next message.
            if range.is_empty() {
                continue;
            }
            let shifted = range.start - self.ghost_start..range.end - self.ghost_start;
            if self.sends.last().is_none_or(|(rank, _)| *rank != owner) {
                self.sends.push((owner, shifted.clone()));
                outgoing.push((owner, Vec::new()));
            }
            self.sends.last_mut().expect("pushed above").1.end = shifted.end;
            let words = &mut outgoing.last_mut().expect("pushed above").1;
            for &column in &self.columns[range] {
                words.push(numbering.global[local] as u64);
                words.push(numbering.global[column as usize] as u64);
            }
        }
        for (rank, words) in exchange(world, outgoing)? {
            let positions = words
                .chunks_exact(2)
                .map(|pair| {
                    let row = pair[0] as usize - numbering.offset;
                    let range = self.offsets[row]..self.offsets[row + 1];
                    let key = pair[1] as Index;
                    let position = self.columns[range.clone()]
                        .binary_search_by_key(&key, |&c| numbering.global[c as usize])
                        .expect("the owner's row holds every column that was announced");
                    (range.start + position) as u32
                })
                .collect();
            self.receives.push((rank, positions));
        }
        Ok(())
    }
}

fn for_each_row(words: &[u64], mut visit: impl FnMut(usize, &[u64])) {
    let mut rest = words;
    while let [node, count, tail @ ..] = rest {
        let (columns, next) = tail.split_at(*count as usize);
        visit(*node as usize, columns);
        rest = next;
    }
}
