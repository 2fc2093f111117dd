//! P = (I - omega D^-1 A) T: motions of the coarse nodes, smoothed once, so that their energy is low
//! (Vanek, Mandel and Brezina 1996), with omega = 4 / (3 lambda_max(D^-1 A)).

use crate::error::Result;
use crate::parallel::{World, exchange};

use super::aggregate::{Aggregates, Group};
use super::level::{Nodes, Rows};
use super::rigid;
use super::strength::Strong;

/// Rows of the transfer from the coarse level: of the owned nodes, then of their ghosts.
pub struct Prolongator<const K: usize, const C: usize> {
    pub offsets: Vec<usize>,
    /// Global numbers of coarse nodes.
    pub columns: Vec<i32>,
    pub values: Vec<[[f64; C]; K]>,
}

/// Rotations count in one over these lengths (m): of the nodes of this level, and of the next.
#[derive(Debug, Clone, Copy)]
pub struct Lengths {
    pub fine: f64,
    pub coarse: f64,
}

impl Lengths {
    /// The next level's: the largest distance of a node from its root. Collective.
    pub fn measured(world: &World, nodes: &Nodes, aggregates: &Aggregates, fine: f64) -> Self {
        let distance = |node: usize| {
            let root = aggregates.group[node].map_or(nodes.position[node], |group| group.root);
            offset(nodes.position[node], root).iter().map(|d| d * d).sum::<f64>().sqrt()
        };
        let coarse = world.max((0..nodes.owned).map(distance).fold(0.0, f64::max));
        Lengths { fine, coarse: if coarse > 0.0 { coarse } else { 1.0 } }
    }
}

fn offset(position: [f64; 3], root: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| position[k] - root[k])
}

impl<const K: usize, const C: usize> Prolongator<K, C> {
    /// `inverse`: one over the diagonal of the owned rows; `damping`: omega. Collective.
    pub fn smoothed(
        world: &World,
        nodes: &Nodes,
        rows: &impl Rows<K>,
        strong: &Strong,
        aggregates: &Aggregates,
        lengths: Lengths,
        inverse: &[f64],
        damping: f64,
    ) -> Result<Self> {
        let free = free(world, nodes, rows)?;
        let motion = |node: usize, group: &Group| -> [[f64; C]; K] {
            let offset = offset(nodes.position[node], group.root);
            let ratio = lengths.fine / lengths.coarse;
            let mut motion = rigid::carried(offset, lengths.coarse, ratio);
            for (line, free) in motion.iter_mut().zip(&free[node * K..]) {
                line.iter_mut().for_each(|value| *value *= free);
            }
            motion
        };
        let own: Vec<Option<[[f64; C]; K]>> = (0..nodes.len())
            .map(|node| aggregates.group[node].as_ref().map(|group| motion(node, group)))
            .collect();
        let mut prolongator =
            Prolongator { offsets: vec![0], columns: Vec::new(), values: Vec::new() };
        for row in 0..nodes.owned {
            let begin = prolongator.columns.len();
            let Some(group) = &aggregates.group[row] else {
                prolongator.offsets.push(begin);
                continue;
            };
            prolongator.columns.push(group.number);
            prolongator.values.push([[0.0; C]; K]);
            let mut couplings = strong.of_node(row).iter().map(|&(node, _)| node as usize).peekable();
            rows.visit(row, |column, block| {
                let is_strong = couplings.next_if_eq(&column).is_some();
                let other = aggregates.group[column].as_ref().zip(own[column].as_ref());
                // A weak neighbour counts as a member of this node's group: the rigid-body modes
                // stay, and the rows short.
                let moved = match other {
                    Some((other, moved)) if is_strong || other.number == group.number => {
                        (other.number, *moved)
                    }
                    _ => (group.number, motion(column, group)),
                };
                let known = prolongator.columns[begin..].iter().position(|&c| c == moved.0);
                let place = begin + known.unwrap_or_else(|| {
                    prolongator.columns.push(moved.0);
                    prolongator.values.push([[0.0; C]; K]);
                    prolongator.columns.len() - begin - 1
                });
                add_product(&mut prolongator.values[place], block, &moved.1);
            });
            for (k, values) in prolongator.values[begin..].iter_mut().enumerate() {
                for (r, line) in values.iter_mut().enumerate() {
                    let factor = -damping * inverse[row * K + r] * free[row * K + r];
                    line.iter_mut().for_each(|value| *value *= factor);
                }
                if let (0, Some(own)) = (k, &own[row]) {
                    for (value, own) in values.iter_mut().flatten().zip(own.iter().flatten()) {
                        *value += own;
                    }
                }
            }
            prolongator.offsets.push(prolongator.columns.len());
        }
        prolongator.fetch_ghosts(world, nodes)?;
        Ok(prolongator)
    }

    /// Appends the rows of the ghosts.
    fn fetch_ghosts(&mut self, world: &World, nodes: &Nodes) -> Result<()> {
        let outgoing = nodes.halo.copies().map(|(rank, locals)| {
            let mut words = Vec::new();
            for &local in locals {
                let (columns, values) = self.row(local as usize);
                words.push(columns.len() as f64);
                words.extend(columns.iter().map(|&column| f64::from(column)));
                words.extend(values.iter().flatten().flatten());
            }
            (rank, words)
        });
        // In ascending order of the ranks, as the ghosts are.
        for (_, words) in exchange(world, outgoing.collect())? {
            let mut rest = &words[..];
            while let [count, tail @ ..] = rest {
                let (columns, tail) = tail.split_at(*count as usize);
                let (values, tail) = tail.split_at(columns.len() * K * C);
                self.columns.extend(columns.iter().map(|&column| column as i32));
                let blocks = values.chunks_exact(K * C);
                self.values.extend(blocks.map(|block| {
                    std::array::from_fn(|r| std::array::from_fn(|c| block[r * C + c]))
                }));
                self.offsets.push(self.columns.len());
                rest = tail;
            }
        }
        Ok(())
    }

    /// Columns and blocks of a local node.
    #[inline(always)]
    pub fn row(&self, node: usize) -> (&[i32], &[[[f64; C]; K]]) {
        let range = self.offsets[node]..self.offsets[node + 1];
        (&self.columns[range.clone()], &self.values[range])
    }
}

/// sum += a b.
#[inline(always)]
pub fn add_product<const K: usize, const M: usize, const C: usize>(
    sum: &mut [[f64; C]; K],
    a: &[[f64; M]; K],
    b: &[[f64; C]; M],
) {
    for (sum, a) in sum.iter_mut().zip(a) {
        for (&a, b) in a.iter().zip(b) {
            for (sum, b) in sum.iter_mut().zip(b) {
                *sum += a * b;
            }
        }
    }
}

/// 1 for a degree of freedom that is coupled to others, 0 for one that is held: it does not take
/// part in motions. Of all local nodes. Collective.
fn free<const K: usize>(world: &World, nodes: &Nodes, rows: &impl Rows<K>) -> Result<Vec<f64>> {
    let mut free = vec![0.0; nodes.len() * K];
    for row in 0..nodes.owned {
        rows.visit(row, |column, block| {
            for (r, line) in block.iter().enumerate() {
                let coupled = (0..K).any(|c| line[c] != 0.0 && (column != row || c != r));
                if coupled {
                    free[row * K + r] = 1.0;
                }
            }
        });
    }
    nodes.halo.forward(world, &mut free, K)?;
    Ok(free)
}
