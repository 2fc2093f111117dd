//! Dense blocks of groups and faces, added into the rows of their owners.

use crate::parallel::{World, exchange_known};

use super::kernel::add_runs;
use super::numbering::Numbering;
use super::pattern::Pattern;

/// Block-sparse values on a [`Pattern`]: `B x B` blocks, the scalar rows of an owned block row
/// lying one after the other, so that the owned part is a compressed-row matrix as it stands.
#[derive(Debug, Clone)]
pub struct BlockMatrix<const B: usize> {
    /// Owned rows: row r starts at `B * B * offsets[r]`; its scalar row i holds B values per
    /// column. Ghost rows follow with the same layout.
    pub values: Vec<f64>,
}

/// Rows of a [`Pattern`], wherever they are stored: a block row is B scalar rows one after the
/// other, each of B values per column.
pub trait BlockRows<const B: usize> {
    /// Address of the first value of a block row.
    fn start(&self, pattern: &Pattern, row: usize) -> usize;

    /// `length` values of one row from address `start` on.
    fn values(&mut self, start: usize, length: usize) -> &mut [f64];

    /// To be called before anything is added to a row.
    fn touch(&mut self, _pattern: &Pattern, _row: usize) {}

    /// The rows that belong to other ranks, one after the other.
    fn ghosts(&self, pattern: &Pattern) -> &[f64];
}

impl<const B: usize> BlockRows<B> for BlockMatrix<B> {
    #[inline(always)]
    fn start(&self, pattern: &Pattern, row: usize) -> usize {
        B * B * pattern.offsets[row]
    }

    #[inline(always)]
    fn values(&mut self, start: usize, length: usize) -> &mut [f64] {
        &mut self.values[start..start + length]
    }

    fn ghosts(&self, pattern: &Pattern) -> &[f64] {
        &self.values[B * B * pattern.ghost_start..]
    }
}

impl<const B: usize> BlockMatrix<B> {
    /// A matrix of this pattern, all zero.
    pub fn zeros(pattern: &Pattern) -> Self {
        BlockMatrix { values: vec![0.0; pattern.columns.len() * B * B] }
    }

    /// Adds the dense matrix `block` over `nodes` (local indices): entry (a, i, b, k) at `((a * B + i) * nodes.len() + b) * B + k`.
    #[inline]
    pub fn add(&mut self, numbering: &Numbering, pattern: &Pattern, nodes: &[u32], block: &[f64]) {
        let count = nodes.len();
        for (a, &row_node) in nodes.iter().enumerate() {
            let row = pattern.row_of[row_node as usize] as usize;
            let range = pattern.offsets[row]..pattern.offsets[row + 1];
            let width = range.len();
            let start = B * B * range.start;
            let columns = &pattern.columns[range];
            let (mut position, mut last) = (0, -1);
            for (b, &column) in nodes.iter().enumerate() {
                let key = numbering.global[column as usize];
                // Nodes ascend within each owner's share: a merge, restarted where owners change.
                if key < last {
                    position = 0;
                }
                last = key;
                while numbering.global[columns[position] as usize] < key {
                    position += 1;
                }
                for i in 0..B {
                    let target = start + (i * width + position) * B;
                    let source = ((a * B + i) * count + b) * B;
                    for k in 0..B {
                        self.values[target + k] += block[source + k];
                    }
                }
            }
        }
    }

    /// [`reduce_while`] of this matrix. Collective over neighbours.
    pub fn reduce(&mut self, world: &World, pattern: &Pattern) {
        reduce_while(world, pattern, self, |_| ());
    }
}

/// Adds a dense matrix over the nodes of a support of the pattern, row by row.
pub fn add_support(matrix: &mut BlockMatrix<1>, pattern: &Pattern, support: usize, block: &[f64]) {
    let nodes = pattern.supports.list(support);
    let place = pattern.support_columns.of(support);
    let width = nodes.len() / place.run;
    let rows = block.chunks_exact(nodes.len()).zip(place.positions.chunks_exact(width));
    for (&node, (source, positions)) in nodes.iter().zip(rows) {
        let row = pattern.row_of[node as usize] as usize;
        let target = &mut matrix.values[pattern.offsets[row]..pattern.offsets[row + 1]];
        match place.run {
            3 => add_runs::<1, 3>(target, source, positions),
            2 => add_runs::<1, 2>(target, source, positions),
            _ => add_runs::<1, 1>(target, source, positions),
        }
    }
}

/// Adds J ⊗ 1 to the owned rows.
pub fn add_scalar<const B: usize>(
    scalar: &BlockMatrix<1>,
    pattern: &Pattern,
    matrix: &mut BlockMatrix<B>,
) {
    let owned = pattern.offsets.partition_point(|&start| start < pattern.ghost_start);
    for row in 0..owned {
        add_scalar_row(scalar, pattern, row, matrix);
    }
}

/// Adds J ⊗ 1 to one row.
pub fn add_scalar_row<const B: usize, R: BlockRows<B>>(
    scalar: &BlockMatrix<1>,
    pattern: &Pattern,
    row: usize,
    rows: &mut R,
) {
    let range = pattern.offsets[row]..pattern.offsets[row + 1];
    let width = range.len() * B;
    let values = rows.values(rows.start(pattern, row), B * width);
    for i in 0..B {
        let line = &mut values[i * width..(i + 1) * width];
        for (block, add) in line.chunks_exact_mut(B).zip(&scalar.values[range.clone()]) {
            block[i] += add;
        }
    }
}

/// Sends the ghost rows to their owners, who add them in ascending rank order, while `work` adds to
/// the owned ones. Collective over neighbours.
pub fn reduce_while<const B: usize, R: BlockRows<B>, T>(
    world: &World,
    pattern: &Pattern,
    rows: &mut R,
    work: impl FnOnce(&mut R) -> T,
) -> T {
    let ghosts = rows.ghosts(pattern);
    let outgoing: Vec<(usize, Vec<f64>)> = pattern
        .sends
        .iter()
        .map(|(rank, range)| (*rank, ghosts[B * B * range.start..B * B * range.end].to_vec()))
        .collect();
    let mut incoming: Vec<Vec<f64>> =
        pattern.receives.iter().map(|(_, at)| vec![0.0; at.len() * B * B]).collect();
    let slots = pattern.receives.iter().zip(&mut incoming);
    let slots = slots.map(|((rank, _), words)| (*rank, &mut words[..])).collect();
    let done = exchange_known(world, &outgoing, slots, || work(rows));
    for ((_, positions), words) in pattern.receives.iter().zip(&incoming) {
        add_received(pattern, rows, positions, words);
    }
    done
}

/// Entries arrive in the sender's layout: row by row, each row as B scalar rows.
fn add_received<const B: usize, R: BlockRows<B>>(
    pattern: &Pattern,
    rows: &mut R,
    positions: &[u32],
    words: &[f64],
) {
    let mut entry = 0;
    while entry < positions.len() {
        // Entries of one row are consecutive and ascend within the owner's row.
        let row = row_of_entry(pattern, positions[entry] as usize);
        let range = pattern.offsets[row]..pattern.offsets[row + 1];
        let mut end = entry + 1;
        while end < positions.len()
            && positions[end] > positions[end - 1]
            && range.contains(&(positions[end] as usize))
        {
            end += 1;
        }
        let (width, sent) = (range.len(), end - entry);
        let values = rows.values(rows.start(pattern, row), B * B * width);
        for i in 0..B {
            for (j, &position) in positions[entry..end].iter().enumerate() {
                let target = (i * width + position as usize - range.start) * B;
                let source = B * B * entry + (i * sent + j) * B;
                for k in 0..B {
                    values[target + k] += words[source + k];
                }
            }
        }
        entry = end;
    }
}

fn row_of_entry(pattern: &Pattern, entry: usize) -> usize {
    pattern.offsets.partition_point(|&offset| offset <= entry) - 1
}
