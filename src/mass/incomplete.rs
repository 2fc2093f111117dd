//! P = L L^T ~ M on the sparsity of M (Cholesky without fill): the preconditioner of the mass.
//!
//! The mass is well conditioned but for cut cells, whose few small values the factor takes up.
//! It serves lattices and meshes alike. One factor spans all ranks (after Hysom and Pothen, SIAM
//! J. Sci. Comput. 22 (2001) 2194): each rank eliminates its inner nodes first, which meet no node
//! of another rank, all ranks at once; then the nodes on the border, rank after rank in an order
//! that keeps the chains of ranks that wait for each other short. So no coupling is left out, and
//! the iterations hardly depend on the number of ranks.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::error::Result;
use crate::parallel::World;
use crate::parallel::exchange::{receive_list, send_lists};

use super::elimination::Order;
use crate::system::numbering::Numbering;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockMatrix;

/// A row whose pivot would fall below this share of its diagonal entry stands alone instead.
const LEAST_PIVOT: f64 = 1e-3;

/// The factor of one rank's rows.
pub struct Incomplete {
    here: u32,
    /// Owned nodes in the order of elimination.
    order: Vec<u32>,
    /// The first so many of them are inner nodes.
    inner: usize,
    /// Below the diagonal, the row of local node n is `rows[n]` of `columns` (local nodes, in the
    /// order of elimination) and `values`. Ghosts have what the elimination needs of their rows.
    rows: Vec<[u32; 2]>,
    columns: Vec<u32>,
    values: Vec<f64>,
    /// One over the diagonal of L, per local node; zero in rows without mass.
    inverse_diagonal: Vec<f64>,
}

/// What a rank sends of a row of L: first its diagonal, then the entries beyond the inner nodes.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct FactorEntry {
    /// Of the column; [`FactorEntry::ROW`] where a row begins.
    node: u64,
    /// Entry of L; one over its diagonal where a row begins.
    value: f64,
}

impl FactorEntry {
    const ROW: u64 = u64::MAX;
}

/// Ranks take their turns on the border in the order of their reversed bits: neighbours mostly
/// have neighbouring numbers, and so half of all ranks wait for nobody.
fn border_order(rank: usize) -> u32 {
    (rank as u32).reverse_bits()
}

impl Incomplete {
    /// `diagonal`: of the owned rows of `matrix`, not negative; rows where it is zero are left
    /// out. Collective.
    pub fn factor(
        world: &World,
        order: Order,
        matrix: &BlockMatrix<1>,
        numbering: &Numbering,
        pattern: &Pattern,
        diagonal: &[f64],
    ) -> Self {
        let mut factor = Incomplete::plan(border_order(world.rank()), order, numbering, pattern);
        let position = factor.position(numbering);
        let mut spread = vec![0.0; numbering.len()];
        let (inner, all) = (factor.inner, factor.order.len());
        factor.make(0..inner, matrix, pattern, diagonal, &position, &mut spread);
        factor.receive_ghost_rows(world, numbering);
        factor.make(inner..all, matrix, pattern, diagonal, &position, &mut spread);
        factor.send_copied_rows(world, numbering, &position);
        factor
    }

    /// The rows of `part` of the order. `spread`, a row spread out over all columns, is zero
    /// before and after.
    fn make(
        &mut self,
        part: Range<usize>,
        matrix: &BlockMatrix<1>,
        pattern: &Pattern,
        diagonal: &[f64],
        position: &[u32],
        spread: &mut [f64],
    ) {
        let mut earlier = Vec::new();
        for at in part {
            let row = self.order[at] as usize;
            let begin = self.columns.len();
            if diagonal[row] > 0.0 {
                let entries = pattern.offsets[row]..pattern.offsets[row + 1];
                earlier.clear();
                earlier.extend(entries.filter(|&entry| {
                    let column = pattern.columns[entry] as usize;
                    position[column] < position[row] && self.inverse_diagonal[column] > 0.0
                }));
                let place = |entry: &usize| position[pattern.columns[*entry] as usize];
                if !earlier.is_sorted_by_key(place) {
                    earlier.sort_unstable_by_key(place);
                }
                self.columns.extend(earlier.iter().map(|&entry| pattern.columns[entry]));
                self.values.extend(earlier.iter().map(|&entry| matrix.values[entry]));
            }
            let pivot = diagonal[row] - self.eliminate(begin, spread);
            let sound = pivot > LEAST_PIVOT * diagonal[row];
            if !sound {
                self.columns.truncate(begin);
                self.values.truncate(begin);
            }
            let pivot = if sound { pivot } else { diagonal[row] };
            self.inverse_diagonal[row] = if pivot > 0.0 { 1.0 / pivot.sqrt() } else { 0.0 };
            self.rows[row] = [begin as u32, self.columns.len() as u32];
        }
    }

    /// The `order` of elimination, without any entry.
    fn plan(here: u32, order: Order, numbering: &Numbering, pattern: &Pattern) -> Self {
        let entries = pattern.ghost_start / 2;
        Incomplete {
            here,
            order: order.nodes,
            inner: order.inner,
            rows: vec![[0; 2]; numbering.len()],
            columns: Vec::with_capacity(entries),
            values: Vec::with_capacity(entries),
            inverse_diagonal: vec![0.0; numbering.len()],
        }
    }

    /// Where each local node stands in the elimination; those of later ranks never come.
    fn position(&self, numbering: &Numbering) -> Vec<u32> {
        let mut position = vec![u32::MAX; numbering.len()];
        let mut earlier: Vec<(usize, Range<usize>)> =
            numbering.halo.ghosts().filter(|(rank, _)| border_order(*rank) < self.here).collect();
        earlier.sort_unstable_by_key(|(rank, _)| border_order(*rank));
        let ghosts = earlier.into_iter().flat_map(|(_, ghosts)| ghosts.map(|ghost| ghost as u32));
        let (inner, border) = self.order.split_at(self.inner);
        let sequence = inner.iter().copied().chain(ghosts).chain(border.iter().copied());
        for (place, node) in sequence.enumerate() {
            position[node as usize] = place as u32;
        }
        position
    }

    /// Turns the entries from `begin` on, those of the newest row of M, into that row of L;
    /// returns the sum of their squares. `spread` is zero before and after.
    fn eliminate(&mut self, begin: usize, spread: &mut [f64]) -> f64 {
        let mut squares = 0.0;
        for at in begin..self.columns.len() {
            let column = self.columns[at] as usize;
            let range = self.row(column);
            let mut value = self.values[at];
            for (&other, l) in self.columns[range.clone()].iter().zip(&self.values[range]) {
                value -= spread[other as usize] * l;
            }
            value *= self.inverse_diagonal[column];
            self.values[at] = value;
            spread[column] = value;
            squares += value * value;
        }
        for &column in &self.columns[begin..] {
            spread[column as usize] = 0.0;
        }
        squares
    }

    /// Waits for the rows of ghosts that come before the border of this rank.
    fn receive_ghost_rows(&mut self, world: &World, numbering: &Numbering) {
        for (rank, ghosts) in
            numbering.halo.ghosts().filter(|(rank, _)| border_order(*rank) < self.here)
        {
            let mut entries = receive_list::<FactorEntry>(world, rank).into_iter().peekable();
            for ghost in ghosts {
                let Some(start) = entries.next() else { break };
                self.inverse_diagonal[ghost] = start.value;
                let begin = self.columns.len() as u32;
                while let Some(entry) = entries.next_if(|entry| entry.node != FactorEntry::ROW) {
                    if let Some(column) = numbering.local(entry.node as usize) {
                        self.columns.push(column as u32);
                        self.values.push(entry.value);
                    }
                }
                self.rows[ghost] = [begin, self.columns.len() as u32];
            }
        }
    }

    /// Sends the rows of copied nodes to the ranks whose border comes later.
    fn send_copied_rows(&self, world: &World, numbering: &Numbering, position: &[u32]) {
        let mut lists = Vec::new();
        for (rank, copied) in
            numbering.halo.copies().filter(|(rank, _)| border_order(*rank) > self.here)
        {
            let mut entries = Vec::new();
            for &node in copied {
                entries.push(FactorEntry {
                    node: FactorEntry::ROW,
                    value: self.inverse_diagonal[node as usize],
                });
                for entry in self.row(node as usize) {
                    let column = self.columns[entry] as usize;
                    // Inner nodes meet no node of the other rank.
                    if position[column] as usize >= self.inner {
                        let node = numbering.key(column) as u64;
                        entries.push(FactorEntry { node, value: self.values[entry] });
                    }
                }
            }
            lists.push((rank, entries));
        }
        send_lists(world, &lists);
    }

    #[inline]
    fn row(&self, node: usize) -> Range<usize> {
        let [begin, end] = self.rows[node];
        begin as usize..end as usize
    }

    /// z = P^-1 r where `free`, else zero, for `C` right-hand sides side by side. `z` is local, its
    /// ghosts are left undefined. Collective over neighbours.
    pub fn apply<const C: usize>(
        &self,
        world: &World,
        numbering: &Numbering,
        r: &[[f64; C]],
        free: &[[bool; C]],
        z: &mut [[f64; C]],
    ) -> Result<()> {
        let (inner, border) = self.order.split_at(self.inner);
        let owned = self.order.len();
        let before = |rank: usize| border_order(rank) < self.here;
        let after = |rank: usize| border_order(rank) > self.here;
        let nobody = |_: usize| false;
        let halo = &numbering.halo;
        self.forward(inner, r, z);
        halo.forward_among(world, z.as_flattened_mut(), C, before, nobody)?;
        self.forward(border, r, z);
        halo.forward_among(world, z.as_flattened_mut(), C, nobody, after)?;
        // From here on the ghosts collect what their owners are to add.
        z[owned..].fill([0.0; C]);
        halo.reverse_add_among(world, z.as_flattened_mut(), C, after, nobody)?;
        self.backward(border, free, z);
        halo.reverse_add_among(world, z.as_flattened_mut(), C, nobody, before)?;
        self.backward(inner, free, z);
        Ok(())
    }

    /// L z = r in the rows `nodes`.
    fn forward<const C: usize>(&self, nodes: &[u32], r: &[[f64; C]], z: &mut [[f64; C]]) {
        for &node in nodes {
            let node = node as usize;
            let mut sum = r[node];
            let row = self.row(node);
            for (&column, l) in self.columns[row.clone()].iter().zip(&self.values[row]) {
                let solved = &z[column as usize];
                for k in 0..C {
                    sum[k] -= l * solved[k];
                }
            }
            let weight = self.inverse_diagonal[node];
            z[node] = sum.map(|sum| sum * weight);
        }
    }

    /// L^T z = z in the rows `nodes`, last first.
    fn backward<const C: usize>(&self, nodes: &[u32], free: &[[bool; C]], z: &mut [[f64; C]]) {
        for &node in nodes.iter().rev() {
            let node = node as usize;
            let weight = self.inverse_diagonal[node];
            let solved = z[node].map(|z| z * weight);
            let row = self.row(node);
            for (&column, l) in self.columns[row.clone()].iter().zip(&self.values[row]) {
                let target = &mut z[column as usize];
                for k in 0..C {
                    target[k] -= l * solved[k];
                }
            }
            // The rows that need this value have taken it: it can be masked.
            for k in 0..C {
                z[node][k] = if free[node][k] { solved[k] } else { 0.0 };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Incomplete, Order};
    use crate::parallel::HaloPlan;
    use crate::system::node_index::NodeIndex;
    use crate::system::numbering::Numbering;
    use crate::system::pattern::Pattern;
    use crate::system::scatter::BlockMatrix;

    /// A pattern of one rank with the given entries (row, column, value), each row ascending.
    fn system(rows: usize, entry: impl Fn(usize, usize) -> f64) -> (BlockMatrix<1>, Pattern) {
        let mut pattern = Pattern { offsets: vec![0], ..Pattern::default() };
        let mut values = Vec::new();
        for row in 0..rows {
            for column in 0..rows {
                let value = entry(row, column);
                if value != 0.0 {
                    pattern.columns.push(column as u32);
                    values.push(value);
                }
            }
            pattern.offsets.push(pattern.columns.len());
        }
        pattern.ghost_start = values.len();
        (BlockMatrix { values }, pattern)
    }

    fn solved(rows: usize, entry: impl Fn(usize, usize) -> f64) -> Vec<[f64; 2]> {
        let (matrix, pattern) = system(rows, &entry);
        let diagonal: Vec<f64> = (0..rows).map(|row| entry(row, row)).collect();
        let numbering = Numbering {
            fields: Default::default(),
            keys: Vec::new(),
            owned: rows,
            offset: 0,
            total: rows,
            nodes: (0..rows).collect(),
            global: (0..rows as crate::petsc::Index).collect(),
            index: NodeIndex::new(0..rows),
            halo: HaloPlan::default(),
        };
        let order = Order { nodes: (0..rows as u32).collect(), inner: rows };
        let mut factor = Incomplete::plan(0, order, &numbering, &pattern);
        assert_eq!((factor.inner, factor.order.len()), (rows, rows));
        let position = factor.position(&numbering);
        let mut spread = vec![0.0; rows];
        factor.make(0..rows, &matrix, &pattern, &diagonal, &position, &mut spread);
        assert_eq!(spread, vec![0.0; rows]);
        let x = field(rows);
        let b: Vec<[f64; 2]> = (0..rows)
            .map(|row| {
                let of = |k: usize| (0..rows).map(|j| entry(row, j) * x[j][k]).sum();
                [of(0), of(1)]
            })
            .collect();
        let mut z = vec![[0.0; 2]; rows];
        factor.forward(&factor.order, &b, &mut z);
        factor.backward(&factor.order, &vec![[true; 2]; rows], &mut z);
        z
    }

    fn field(rows: usize) -> Vec<[f64; 2]> {
        (0..rows).map(|i| [1.0 + i as f64, (i as f64).cos()]).collect()
    }

    #[test]
    fn a_band_without_fill_is_inverted() {
        let band = |row: usize, column: usize| match row.abs_diff(column) {
            0 => 1.0 + 0.1 * row as f64,
            1 => 0.4,
            2 => 0.1,
            _ => 0.0,
        };
        for (z, x) in solved(9, band).iter().zip(field(9)) {
            assert!((z[0] - x[0]).abs() < 1e-13 && (z[1] - x[1]).abs() < 1e-13);
        }
    }

    #[test]
    fn rows_without_mass_and_rows_without_pivot_stand_alone() {
        // Row 1 is empty; rows 2 and 3 are linearly dependent.
        let entry = |row: usize, column: usize| match (row.min(column), row.max(column)) {
            (1, _) | (_, 1) => 0.0,
            (2, 3) => 2.0,
            (i, j) if i == j => 2.0,
            _ => 0.0,
        };
        let z = solved(4, entry);
        let x = field(4);
        assert_eq!(z[1], [0.0; 2]);
        assert!((z[0][0] - x[0][0]).abs() < 1e-15);
        for k in 0..2 {
            assert!((z[3][k] - (x[2][k] + x[3][k])).abs() < 1e-14);
        }
    }
}
