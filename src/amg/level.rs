//! What one level of multigrid is on one rank: its nodes, and the rows of its matrix in blocks.

use super::rigid::Modes;
use crate::parallel::HaloPlan;
use crate::petsc::Index;
use crate::system::numbering::Numbering;
use crate::system::pattern::Pattern;
use crate::tensor::fused::Block;

/// The nodes of a level: owned ones first, then ghosts, ascending by global number.
#[derive(Debug, Default)]
pub struct Nodes {
    /// Nodes of this rank; those of other ranks follow.
    pub owned: usize,
    /// Global number of each local node; owned ones are consecutive.
    pub global: Vec<Index>,
    /// Owner <-> ghost exchange of nodal values.
    pub halo: HaloPlan,
    /// m; the third coordinate is zero in the plane.
    pub position: Vec<[f64; 3]>,
    /// Between 0 and 1, different for each node, and the same on any number of ranks.
    pub key: Vec<f64>,
    /// What the values of each node are.
    pub modes: Modes,
}

impl Nodes {
    /// Owned nodes and ghosts.
    pub fn local(&self) -> usize {
        self.global.len()
    }

    /// Place of a global number that is known to be here.
    pub fn place(&self, number: Index) -> usize {
        let (own, ghosts) = self.global.split_at(self.owned);
        place(own.first().copied().unwrap_or(0), self.owned, ghosts, number)
    }
}

/// Where a global number stands among `owned` ones from `first` on and the `ghosts` behind them.
#[inline(always)]
pub fn place(first: Index, owned: usize, ghosts: &[Index], number: Index) -> usize {
    let own = number.wrapping_sub(first) as usize;
    if own < owned { own } else { owned + ghosts.partition_point(|&ghost| ghost < number) }
}

/// The owned rows of a square matrix in blocks of `K` degrees of freedom per node.
pub trait Rows<const K: usize> {
    /// Local nodes of the columns of a row, the diagonal among them.
    fn columns(&self, row: usize) -> &[u32];

    /// Shows each column of a row with its block.
    fn visit(&self, row: usize, see: impl FnMut(usize, &Block<K, K>));
}

/// The diagonal of the `owned` rows.
pub fn diagonal<const K: usize>(rows: &impl Rows<K>, owned: usize) -> Vec<f64> {
    let mut diagonal = vec![0.0; owned * K];
    for (row, own) in diagonal.chunks_exact_mut(K).enumerate() {
        rows.visit(row, |column, block| {
            if column == row {
                (0..K).for_each(|k| own[k] = block[k][k]);
            }
        });
    }
    diagonal
}

/// One over each value, zero where that is not positive.
pub fn inverted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    values.into_iter().map(|value| if value > 0.0 { 1.0 / value } else { 0.0 }).collect()
}

/// Rows with values of their own.
#[derive(Debug, Default)]
pub struct BlockCsr<const K: usize> {
    /// Row r is `offsets[r]..offsets[r + 1]`.
    pub offsets: Vec<usize>,
    /// Local nodes of the columns.
    pub columns: Vec<u32>,
    /// A block for each column.
    pub values: Vec<Block<K, K>>,
}

impl<const K: usize> Rows<K> for BlockCsr<K> {
    #[inline(always)]
    fn columns(&self, row: usize) -> &[u32] {
        &self.columns[self.offsets[row]..self.offsets[row + 1]]
    }

    #[inline(always)]
    fn visit(&self, row: usize, mut see: impl FnMut(usize, &Block<K, K>)) {
        let range = self.offsets[row]..self.offsets[row + 1];
        for (&column, block) in self.columns[range.clone()].iter().zip(&self.values[range]) {
            see(column as usize, block);
        }
    }
}

/// The system's rows where the solver keeps them: scalar rows, entries in own columns apart from
/// those in columns of other ranks.
pub struct Assembled<'a> {
    pattern: &'a Pattern,
    owned: usize,
    own: &'a [f64],
    other: &'a [f64],
    /// Blocks of both kinds before each row.
    before: Vec<[usize; 2]>,
}

impl<'a> Assembled<'a> {
    /// `own`, `other`: [`crate::petsc::Matrix::storage`] of the matrix with this pattern.
    pub fn new(
        numbering: &Numbering,
        pattern: &'a Pattern,
        own: &'a [f64],
        other: &'a [f64],
    ) -> Self {
        let owned = numbering.owned;
        let (mut before, mut count) = (Vec::with_capacity(owned + 1), [0; 2]);
        before.push(count);
        for row in pattern.offsets[..=owned].windows(2) {
            let columns = &pattern.columns[row[0]..row[1]];
            let inside = columns.iter().filter(|&&column| (column as usize) < owned).count();
            count = [count[0] + inside, count[1] + columns.len() - inside];
            before.push(count);
        }
        Assembled { pattern, owned, own, other, before }
    }
}

impl<const K: usize> Rows<K> for Assembled<'_> {
    #[inline(always)]
    fn columns(&self, row: usize) -> &[u32] {
        &self.pattern.columns[self.pattern.offsets[row]..self.pattern.offsets[row + 1]]
    }

    #[inline(always)]
    fn visit(&self, row: usize, mut see: impl FnMut(usize, &Block<K, K>)) {
        let (start, end) = (self.before[row], self.before[row + 1]);
        let width = [0, 1].map(|k| (end[k] - start[k]) * K);
        let mut next = [0, 1].map(|k| start[k] * K * K);
        for &column in <Self as Rows<K>>::columns(self, row) {
            let kind = usize::from(column as usize >= self.owned);
            let values = if kind == 0 { self.own } else { self.other };
            let mut block = [[0.0; K]; K];
            for (r, line) in block.iter_mut().enumerate() {
                let from = next[kind] + r * width[kind];
                line.copy_from_slice(&values[from..from + K]);
            }
            next[kind] += K;
            see(column as usize, &block);
        }
    }
}
