//! Nodes in plastic flow that is not associated, and the block of the matrix that couples them.
//!
//! Such flow takes away most of the stiffness of one direction of strain: layers of one cell shear nearly freely, and
//! errors along them are smooth for neither the diagonal nor coarse nodes that move as rigid bodies. Iterations grow with the
//! cells as a layer gets longer in cells. The flowing nodes are therefore solved together in the smoother of the finest level,
//! as those that penalties tie, while they are few.
//!
//! They are told by the matrix alone: associated flow, elasticity and Ghost stiffness leave it symmetric. F-bar makes it
//! unsymmetric in cells that are filled in part; their nodes join the block.

use crate::error::Result;
use crate::parallel::World;

use super::block_smoother::{BlockSmoother, Cause};
use super::level::{BlockCsr, Nodes, Rows, diagonal, inverted};
use super::tied::block_of;

/// A node flows where |A_i - S_i| exceeds this share of |A_ii|: its row, that of the symmetric part S, and its own
/// block, in the norm of Frobenius. Iterations hardly depend on it between 0.002 and 0.1 (docs/evidence/unsymmetric.md).
const SKEW: f64 = 0.05;
/// The block is solved up to this share of all nodes, ...
const FEW: f64 = 0.1;
/// ... and up to so many equations, in the plane and in space: to factor it costs less than the solve saves.
const MOST: [usize; 2] = [50_000, 15_000];
/// Levels do not serve on where the share of flowing nodes has changed by more.
const CHANGED: f64 = 0.05;

/// Nodes of the finest level that flow.
#[derive(Debug, Clone, Default)]
pub struct Flow {
    /// Owned nodes.
    nodes: Vec<bool>,
    /// Of all ranks.
    count: usize,
    /// Their share of all nodes.
    pub share: f64,
}

impl Flow {
    /// By the `rows` of a matrix, and its `symmetric` part in the order of their blocks. Collective.
    pub fn of<const K: usize>(
        world: &World,
        nodes: &Nodes,
        rows: &impl Rows<K>,
        symmetric: &BlockCsr<K>,
    ) -> Self {
        let mut flows = vec![false; nodes.owned];
        for (row, flows) in flows.iter_mut().enumerate() {
            let (mut skew, mut own) = (0.0, 0.0);
            let mut parts = symmetric.values[symmetric.offsets[row]..].iter();
            rows.visit(row, |column, block| {
                let Some(part) = parts.next() else { return };
                let pairs = block.iter().flatten().zip(part.iter().flatten());
                skew += pairs.map(|(a, s)| (a - s) * (a - s)).sum::<f64>();
                if column == row {
                    own = block.iter().flatten().map(|a| a * a).sum();
                }
            });
            *flows = skew > SKEW * SKEW * own;
        }
        let count = world.sum_usize(flows.iter().filter(|&&flows| flows).count());
        let all = world.sum_usize(nodes.owned).max(1);
        Flow { nodes: flows, count, share: count as f64 / all as f64 }
    }

    /// Whether levels that were made at the share `then` are of another state of the soil.
    pub fn has_changed(&self, then: f64) -> bool {
        (self.share - then).abs() > CHANGED
    }

    /// A smoother with the block of these nodes, if they are few. Collective.
    pub fn smoother<const K: usize>(
        &self,
        world: &World,
        nodes: &Nodes,
        rows: &impl Rows<K>,
    ) -> Result<BlockSmoother> {
        let inverse = inverted(diagonal(rows, nodes.owned));
        let few = self.share <= FEW && self.count * K <= MOST[usize::from(K > 2)];
        let block = match few {
            true => block_of(world, nodes, rows, &self.nodes, Cause::Flow)?,
            false => None,
        };
        BlockSmoother::new(world.comm(), inverse, block.as_ref())
    }
}
