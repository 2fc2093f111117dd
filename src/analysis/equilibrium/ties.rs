//! Penalties as multigrid sees them: the nodes that they stiffen, and corrections where the symmetric part of their
//! tangent is indefinite.

use crate::amg::level::{Assembled, Rows};
use crate::amg::tied::Ties;
use crate::error::Result;

use super::Equilibrium;

/// Share of a node's own stiffness, all components, from which on a penalty ties it.
const TIED: f64 = 0.1;

impl<const D: usize, const N: usize> Equilibrium<'_, D, N> {
    /// Of the last evaluation, whose tangent the matrix's `rows` hold. Collective.
    pub(super) fn ties(&self, rows: &Assembled) -> Result<Ties<N>> {
        let (world, of) = (self.world, self.numbering);
        let mut stiffness = vec![0.0; of.len()];
        self.terms.iter().for_each(|term| term.add_penalties(self.at(), &mut stiffness));
        if let Some(following) = &self.following {
            following.loads.add_penalties(&mut stiffness);
        }
        let mut ties = Ties::default();
        if !world.any(stiffness.iter().any(|&k| k > 0.0)) {
            return Ok(ties);
        }
        of.halo.reverse_add(world, &mut stiffness, 1)?;
        ties.nodes = vec![false; of.owned];
        for (row, tied) in ties.nodes.iter_mut().enumerate() {
            Rows::<N>::visit(rows, row, |column, block| {
                if column == row {
                    let all: f64 = (0..N).map(|i| block[i][i]).sum();
                    *tied = stiffness[row] > TIED * all;
                }
            });
        }
        if self.symmetric() {
            return Ok(ties);
        }
        self.terms.iter().for_each(|term| term.correct_surrogate(self.at(), &mut ties.corrections));
        // Held rows and columns are those of the identity.
        for (a, b, block) in &mut ties.corrections {
            let held = |node: u32, i: usize| self.held.holds(node as usize * N + i);
            for (i, line) in block.iter_mut().enumerate() {
                for (j, value) in line.iter_mut().enumerate() {
                    if held(*a, i) || held(*b, j) {
                        *value = 0.0;
                    }
                }
            }
        }
        Ok(ties)
    }
}
