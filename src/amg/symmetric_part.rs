//! S = (A + A^T) / 2: the symmetric matrix that stands for an unsymmetric one where levels are made.
//!
//! Transposed entries come from rows of this rank and of others; their owners send the latter block by block. Where A is symmetric, S is A to the last bit.

use crate::error::{Error, Result};
use crate::parallel::{HaloPlan, World, exchange};
use crate::petsc::Index;
use crate::tensor::fused::Block;

use super::level::{BlockCsr, Rows};

/// The symmetric part of the `owned` rows: `global` numbers of the local nodes, `halo` of those
/// beyond the owned ones. The pattern is symmetric, and own columns ascend within a row. Collective.
/// Error, the same on all ranks: the pattern is not symmetric.
pub fn symmetric_part<const K: usize>(
    world: &World,
    owned: usize,
    global: &[Index],
    halo: &HaloPlan,
    rows: &impl Rows<K>,
) -> Result<BlockCsr<K>> {
    let mut sums = BlockCsr { offsets: vec![0], ..BlockCsr::default() };
    for row in 0..owned {
        sums.columns.extend_from_slice(rows.columns(row));
        sums.offsets.push(sums.columns.len());
    }
    sums.values = vec![[[0.0; K]; K]; sums.columns.len()];

    let owners = owners(owned, global.len(), halo);
    let mut outgoing: Vec<(usize, Vec<f64>)> =
        halo.ghosts().map(|(rank, _)| (rank, Vec::new())).collect();
    let mut whole = true;
    // Rows come in their order, and so do the transposed entries of each row.
    let mut next = sums.offsets.clone();
    for row in 0..owned {
        let mut own = sums.offsets[row];
        rows.visit(row, |column, block| {
            add_half(&mut sums.values[own], block, false);
            own += 1;
            if column >= owned {
                let words = &mut outgoing[owners[column - owned] as usize].1;
                words.extend([global[column], global[row]].map(|number| number as f64));
                words.extend(block.iter().flatten());
                return;
            }
            let rest = &sums.columns[next[column]..sums.offsets[column + 1]];
            let Some(skipped) = rest.iter().position(|&c| c as usize == row) else {
                whole = false;
                return;
            };
            next[column] += skipped + 1;
            add_half(&mut sums.values[next[column] - 1], block, true);
        });
    }
    let first = global.first().copied().unwrap_or(0);
    for (_, words) in exchange(world, outgoing)? {
        for entry in words.chunks_exact(2 + K * K) {
            let row = (entry[0] as Index - first) as usize;
            let column = entry[1] as Index;
            let Some(range) = sums.offsets.get(row..row + 2) else {
                whole = false;
                continue;
            };
            let columns = &sums.columns[range[0]..range[1]];
            let Some(place) = columns.iter().position(|&c| global[c as usize] == column) else {
                whole = false;
                continue;
            };
            let block = std::array::from_fn(|r| std::array::from_fn(|c| entry[2 + r * K + c]));
            add_half(&mut sums.values[range[0] + place], &block, true);
        }
    }
    let text = "an entry of the matrix has no place for its transposed one";
    world.fail_together(if whole { Ok(sums) } else { Err(Error::Environment(text.into())) })
}

/// Which of the halo's ranks owns each ghost.
fn owners(owned: usize, local: usize, halo: &HaloPlan) -> Vec<u32> {
    let mut owners = vec![0; local - owned];
    for (place, (_, ghosts)) in halo.ghosts().enumerate() {
        owners[ghosts.start - owned..ghosts.end - owned].fill(place as u32);
    }
    owners
}

#[inline(always)]
fn add_half<const K: usize>(sum: &mut Block<K, K>, block: &Block<K, K>, transposed: bool) {
    for r in 0..K {
        for c in 0..K {
            sum[r][c] += 0.5 * if transposed { block[c][r] } else { block[r][c] };
        }
    }
}
