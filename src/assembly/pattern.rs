//! The node graph: which pairs of nodes meet in a contribution. Rows of owned nodes are final;
//! rows of nodes owned elsewhere are collected and sent to their owner in a fixed order.

use rustc_hash::FxHashMap;

use crate::error::Result;
use crate::parallel::{World, exchange};

use super::numbering::{Numbering, Touched};

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
    let owned_count = owned.len();
    let first: FxHashMap<usize, u32> = owned
        .iter()
        .copied()
        .chain(foreign.iter().map(|&(_, node)| node))
        .enumerate()
        .map(|(i, node)| (node, i as u32))
        .collect();
    let mut rows = node_graph(first.len(), &first, supports);

    // Rows of foreign nodes travel to their owners as: node, count, columns...
    let mut outgoing: Vec<(usize, Vec<u64>)> = Vec::new();
    for (i, &(owner, node)) in foreign.iter().enumerate() {
        if outgoing.last().is_none_or(|(rank, _)| *rank != owner) {
            outgoing.push((owner, Vec::new()));
        }
        let words = &mut outgoing.last_mut().expect("pushed above").1;
        let row = &rows[owned_count + i];
        words.push(node as u64);
        words.push(row.len() as u64);
        words.extend(row.iter().map(|&column| column as u64));
    }
    let incoming = exchange(world, outgoing)?;
    let mut foreign_columns: Vec<usize> = Vec::new();
    for (_, words) in &incoming {
        for_each_row(words, |node, columns| {
            rows[first[&node] as usize].extend(columns.iter().map(|&c| c as usize));
        });
    }
    for row in rows.iter_mut().take(owned_count) {
        row.sort_unstable();
        row.dedup();
        foreign_columns.extend(row.iter().filter(|column| !first.contains_key(column)));
    }
    foreign_columns.sort_unstable();
    foreign_columns.dedup();
    let mut ghosts = foreign;
    ghosts.extend(foreign_columns.into_iter().map(|node| (owner_of(node), node)));
    ghosts.sort_unstable();
    let numbering = Numbering::build(world, owned, &ghosts)?;

    let touched_count = rows.len();
    let mut row_of = vec![u32::MAX; numbering.len()];
    let mut order: Vec<usize> = vec![0; touched_count];
    let mut next = 0;
    for (local, &node) in numbering.nodes.iter().enumerate() {
        if let Some(&i) = first.get(&node) {
            row_of[local] = next as u32;
            order[next] = i as usize;
            next += 1;
        }
    }
    let mut offsets = Vec::with_capacity(touched_count + 1);
    offsets.push(0);
    let mut columns: Vec<u32> = Vec::with_capacity(rows.iter().map(Vec::len).sum());
    for &i in &order {
        let start = columns.len();
        columns.extend(rows[i].iter().map(|node| numbering.index[node]));
        columns[start..].sort_unstable_by_key(|&column| numbering.global[column as usize]);
        offsets.push(columns.len());
    }
    let ghost_start = offsets[numbering.owned];
    let mut pattern =
        Pattern { offsets, columns, row_of, ghost_start, sends: Vec::new(), receives: Vec::new() };
    pattern.plan_exchange(world, &numbering, &ghosts)?;
    Ok((numbering, pattern))
}

impl Pattern {
    /// Position of column `local` in the row `row`, if the pair is in the pattern.
    pub fn find(&self, numbering: &Numbering, row: usize, local: usize) -> Option<usize> {
        let range = self.offsets[row]..self.offsets[row + 1];
        let key = numbering.global[local];
        self.columns[range.clone()]
            .binary_search_by_key(&key, |&column| numbering.global[column as usize])
            .ok()
            .map(|position| range.start + position)
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
                    let key = pair[1] as i32;
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

/// Sorted columns (global nodes) of each touched node.
fn node_graph<'a>(
    count: usize,
    first: &FxHashMap<usize, u32>,
    supports: impl Iterator<Item = &'a [usize]> + Clone,
) -> Vec<Vec<usize>> {
    let mut rows: Vec<Vec<usize>> = vec![Vec::new(); count];
    for support in supports {
        for node in support {
            let row = &mut rows[first[node] as usize];
            row.extend_from_slice(support);
            // Keeps the duplicates of many overlapping supports from piling up.
            if row.len() > 512 {
                row.sort_unstable();
                row.dedup();
            }
        }
    }
    for row in &mut rows {
        row.sort_unstable();
        row.dedup();
        row.shrink_to_fit();
    }
    rows
}

fn for_each_row(words: &[u64], mut visit: impl FnMut(usize, &[u64])) {
    let mut rest = words;
    while let [node, count, tail @ ..] = rest {
        let (columns, next) = tail.split_at(*count as usize);
        visit(*node as usize, columns);
        rest = next;
    }
}
