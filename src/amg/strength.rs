//! Which nodes move together: j is strongly coupled to i where |A_ij|^2 > theta^2 |A_ii| |A_jj|,
//! in the norm of Frobenius (Vanek, Mandel and Brezina, Computing 56 (1996) 179).

use crate::error::Result;
use crate::parallel::World;
use crate::tensor::fused::Block;

use super::level::{Nodes, Rows};

/// Strong couplings of the owned nodes.
pub struct Strong {
    offsets: Vec<usize>,
    /// Local nodes, without the node itself, and |A_ij|^2 / (|A_ii| |A_jj|).
    couplings: Vec<(u32, f32)>,
}

impl Strong {
    /// Collective.
    pub fn of<const K: usize>(
        world: &World,
        nodes: &Nodes,
        rows: &impl Rows<K>,
        threshold: f64,
    ) -> Result<Self> {
        let square = |block: &Block<K, K>| -> f64 { block.iter().flatten().map(|v| v * v).sum() };
        let mut scale = vec![0.0; nodes.local()];
        for row in 0..nodes.owned {
            rows.visit(row, |column, block| {
                if column == row {
                    let norm = square(block).sqrt();
                    scale[row] = if norm > 0.0 { 1.0 / norm } else { 0.0 };
                }
            });
        }
        nodes.halo.forward(world, &mut scale, 1)?;
        let least = threshold * threshold;
        let mut strong = Strong { offsets: vec![0], couplings: Vec::new() };
        for row in 0..nodes.owned {
            rows.visit(row, |column, block| {
                let share = square(block) * scale[row] * scale[column];
                if share > least && column != row {
                    strong.couplings.push((column as u32, share as f32));
                }
            });
            strong.offsets.push(strong.couplings.len());
        }
        Ok(strong)
    }

    /// Couplings of an owned node.
    #[inline]
    pub fn of_node(&self, node: usize) -> &[(u32, f32)] {
        &self.couplings[self.offsets[node]..self.offsets[node + 1]]
    }
}
