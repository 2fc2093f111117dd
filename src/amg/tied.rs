//! Nodes that penalties tie to a surface: the block of the matrix that couples them, and what makes the
//! matrix's symmetric part definite there.

use crate::error::{Error, Result};
use crate::parallel::{World, exchange};
use crate::petsc::Index;
use crate::system::terms::term::Correction;
use crate::tensor::fused::Block;

use super::block_smoother::{Cause, NodeBlock};
use super::cycle::CoarsestRows;
use super::level::{BlockCsr, Nodes, Rows};

/// What penalties do to a system.
#[derive(Debug, Clone, Default)]
pub struct Ties<const K: usize> {
    /// Owned nodes that they stiffen; empty for none.
    pub nodes: Vec<bool>,
    /// To be added to the symmetric part of an unsymmetric matrix before levels are made of it: two
    /// local nodes and a block. Each rank has shares.
    pub corrections: Vec<Correction<K>>,
}

impl<const K: usize> Ties<K> {
    /// Whether a node of any rank is tied. Collective.
    pub fn are_there(&self, world: &World) -> bool {
        world.sum_usize(usize::from(self.nodes.contains(&true))) > 0
    }

    /// Adds the corrections of all ranks to the `rows` of the symmetric part. Collective. Error, the
    /// same on all ranks: a correction has no place among the entries.
    pub fn correct(&self, world: &World, nodes: &Nodes, rows: &mut BlockCsr<K>) -> Result<()> {
        let mut owners = vec![usize::MAX; nodes.local()];
        for (rank, ghosts) in nodes.halo.ghosts() {
            owners[ghosts].fill(rank);
        }
        let mut outgoing: Vec<(usize, Vec<f64>)> =
            nodes.halo.ghosts().map(|(rank, _)| (rank, Vec::new())).collect();
        let mut whole = true;
        for (row, column, block) in &self.corrections {
            if (*row as usize) < nodes.owned {
                whole &= add(rows, *row as usize, |c| c == *column, block);
                continue;
            }
            let owner = owners[*row as usize];
            if let Some((_, words)) = outgoing.iter_mut().find(|(rank, _)| *rank == owner) {
                words.extend([row, column].map(|&node| nodes.global[node as usize] as f64));
                words.extend(block.iter().flatten());
            }
        }
        for (_, words) in exchange(world, outgoing)? {
            for entry in words.chunks_exact(2 + K * K) {
                let block = std::array::from_fn(|r| std::array::from_fn(|c| entry[2 + r * K + c]));
                let column = entry[1] as Index;
                let is = |c: u32| nodes.global[c as usize] == column;
                whole &= add(rows, nodes.place(entry[0] as Index), is, &block);
            }
        }
        let text = "a correction has no place among the matrix's entries";
        world.fail_together(if whole { Ok(()) } else { Err(Error::Environment(text.into())) })
    }
}

/// False if the row has no such column.
fn add<const K: usize>(
    rows: &mut BlockCsr<K>,
    row: usize,
    is: impl Fn(u32) -> bool,
    block: &Block<K, K>,
) -> bool {
    let range = rows.offsets[row]..rows.offsets[row + 1];
    let Some(place) = rows.columns[range.clone()].iter().position(|&column| is(column)) else {
        return false;
    };
    let target = rows.values[range.start + place].iter_mut().flatten();
    target.zip(block.iter().flatten()).for_each(|(sum, value)| *sum += value);
    true
}

/// The block of the `chosen` nodes of `rows`, owned ones; `None` where no rank has any. Collective.
pub fn block_of<const K: usize>(
    world: &World,
    nodes: &Nodes,
    rows: &impl Rows<K>,
    chosen: &[bool],
    cause: Cause,
) -> Result<Option<NodeBlock>> {
    let of_rank: Vec<u32> = chosen
        .iter()
        .enumerate()
        .filter(|(_, chosen)| **chosen)
        .map(|(node, _)| node as u32)
        .collect();
    if !world.any(!of_rank.is_empty()) {
        return Ok(None);
    }
    let first = world.exclusive_sum(of_rank.len());
    const NONE: f64 = -1.0;
    let mut number = vec![NONE; nodes.local()];
    for (k, &node) in of_rank.iter().enumerate() {
        number[node as usize] = (first + k) as f64;
    }
    nodes.halo.forward(world, &mut number, 1)?;
    let mut block = CoarsestRows { block: K, offsets: vec![0], ..CoarsestRows::default() };
    let mut entries = Vec::new();
    for &node in &of_rank {
        entries.clear();
        rows.visit(node as usize, |column, values| {
            if number[column] != NONE {
                entries.push((number[column] as Index, *values));
            }
        });
        entries.sort_unstable_by_key(|(number, _)| *number);
        for r in 0..K {
            for (number, values) in &entries {
                block.columns.extend((0..K as Index).map(|c| number * K as Index + c));
                block.values.extend_from_slice(&values[r]);
            }
            block.offsets.push(block.columns.len() as Index);
        }
    }
    Ok(Some(NodeBlock { cause, nodes: of_rank, rows: block }))
}
