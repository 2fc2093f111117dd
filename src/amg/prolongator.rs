//! P = (I - omega D^-1 A) T: motions of the coarse nodes, smoothed once, so that their energy is low
//! (Vanek, Mandel and Brezina 1996), with omega = 1.5 / lambda_max(D^-1 A).

use crate::error::Result;
use crate::parallel::{World, exchange};
use crate::petsc::Index;
use crate::tensor::fused::{self, Block, add_product};

use super::aggregate::{Aggregates, Group};
use super::level::{Nodes, Rows};
use super::rigid::{self, Modes};
use super::strength::Strong;

/// Rows of the transfer from the coarse level: of the owned nodes, then of their ghosts.
pub struct Prolongator<const K: usize, const C: usize> {
    pub offsets: Vec<usize>,
    /// Global numbers of coarse nodes.
    pub columns: Vec<Index>,
    pub values: Vec<Block<K, C>>,
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

/// What P is made of.
pub struct Parts<'a> {
    pub nodes: &'a Nodes,
    pub strong: &'a Strong,
    pub aggregates: &'a Aggregates,
    pub lengths: Lengths,
    /// One over the diagonal of the owned rows.
    pub inverse: &'a [f64],
    /// omega
    pub damping: f64,
}

impl Parts<'_> {
    /// What the motion of a group's coarse node does to a node; `free`: see [`free`].
    #[inline(always)]
    fn motion<const K: usize, const C: usize>(
        &self,
        node: usize,
        group: &Group,
        free: &[f64],
    ) -> Block<K, C> {
        let offset = offset(self.nodes.position[node], group.root);
        let ratio = self.lengths.fine / self.lengths.coarse;
        let mut motion = match self.nodes.modes {
            Modes::RigidMotions => rigid::carried(offset, self.lengths.coarse, ratio),
            Modes::Constants => rigid::constant(),
        };
        for (line, free) in motion.iter_mut().zip(&free[node * K..]) {
            line.iter_mut().for_each(|value| *value *= free);
        }
        motion
    }
}

impl<const K: usize, const C: usize> Prolongator<K, C> {
    /// Collective.
    pub fn smoothed(world: &World, rows: &impl Rows<K>, parts: &Parts) -> Result<Self> {
        let free = free(world, parts.nodes, rows)?;
        let mut prolongator =
            Prolongator { offsets: vec![0], columns: Vec::new(), values: Vec::new() };
        prolongator.smooth(rows, parts, &free);
        prolongator.fetch_ghosts(world, parts.nodes)?;
        Ok(prolongator)
    }

    /// The owned rows.
    fn smooth(&mut self, rows: &impl Rows<K>, parts: &Parts, free: &[f64]) {
        #[cfg(target_arch = "x86_64")]
        if fused::has_avx2() {
            // SAFETY: the processor has just said that it knows the instructions.
            return unsafe { self.smooth_avx2(rows, parts, free) };
        }
        self.smooth_in::<false>(rows, parts, free);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn smooth_avx2(&mut self, rows: &impl Rows<K>, parts: &Parts, free: &[f64]) {
        self.smooth_in::<true>(rows, parts, free);
    }

    #[inline(always)]
    fn smooth_in<const FUSED: bool>(&mut self, rows: &impl Rows<K>, parts: &Parts, free: &[f64]) {
        for row in 0..parts.nodes.owned {
            let begin = self.columns.len();
            let Some(group) = parts.aggregates.group[row] else {
                self.offsets.push(begin);
                continue;
            };
            self.columns.push(group.number);
            self.values.push([[0.0; C]; K]);
            let mut couplings = parts.strong.of_node(row).iter().peekable();
            rows.visit(row, |column, block| {
                let strong = couplings.next_if(|(node, _)| *node as usize == column).is_some();
                // A weak neighbour counts as a member of this node's group: the rigid-body modes
                // stay, and the rows short.
                let other = parts.aggregates.group[column].filter(|_| strong).unwrap_or(group);
                let known = self.columns[begin..].iter().position(|&c| c == other.number);
                let place = begin + known.unwrap_or(self.columns.len() - begin);
                if known.is_none() {
                    self.columns.push(other.number);
                    self.values.push([[0.0; C]; K]);
                }
                let motion = parts.motion::<K, C>(column, &other, free);
                add_product::<K, K, C, FUSED>(&mut self.values[place], block, &motion);
            });
            for values in &mut self.values[begin..] {
                for (r, line) in values.iter_mut().enumerate() {
                    let factor = -parts.damping * parts.inverse[row * K + r] * free[row * K + r];
                    line.iter_mut().for_each(|value| *value *= factor);
                }
            }
            let own = parts.motion::<K, C>(row, &group, free);
            for (value, own) in self.values[begin].iter_mut().flatten().zip(own.iter().flatten()) {
                *value += own;
            }
            self.offsets.push(self.columns.len());
        }
    }

    /// Appends the rows of the ghosts.
    fn fetch_ghosts(&mut self, world: &World, nodes: &Nodes) -> Result<()> {
        let outgoing = nodes.halo.copies().map(|(rank, locals)| {
            let mut words = Vec::new();
            for &local in locals {
                let (columns, values) = self.row(local as usize);
                words.push(columns.len() as f64);
                words.extend(columns.iter().map(|&column| column as f64));
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
                self.columns.extend(columns.iter().map(|&column| column as Index));
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
    pub fn row(&self, node: usize) -> (&[Index], &[Block<K, C>]) {
        let range = self.offsets[node]..self.offsets[node + 1];
        (&self.columns[range.clone()], &self.values[range])
    }
}

/// 1 for a degree of freedom that is coupled to others, 0 for one that is held: it does not take
/// part in motions. Of all local nodes. Collective.
fn free<const K: usize>(world: &World, nodes: &Nodes, rows: &impl Rows<K>) -> Result<Vec<f64>> {
    let mut free = vec![0.0; nodes.local() * K];
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
