//! The error of an iterate, |f_ext - f_int + f_react| / |f_ext + f_react| (Lagrangian eq. 40), and
//! whether what is left of it is round-off.

use crate::analysis::round_off;
use crate::error::Result;

use super::Equilibrium;

/// Cells that a node may move in a step for the residual to be judged by the size of its terms.
const FARTHEST: f64 = 1e3;

impl<const D: usize, const N: usize> Equilibrium<'_, D, N> {
    /// Lagrangian eq. 40; 1 where a residual stands against no action at all, 0 where there is
    /// neither.
    pub(super) fn normalised_error(&mut self) -> f64 {
        let (mut residual, mut actions) = (0.0, 0.0);
        for dof in self.counted() {
            let action = self.external_owned[dof] + self.reaction_owned[dof];
            residual += (action - self.internal_owned[dof]).powi(2);
            actions += action * action;
        }
        actions += self.terms.iter().map(|term| term.squared_actions(self.at())).sum::<f64>();
        let sums = self.world.sum_slice(&[residual, actions]);
        (self.residual_norm, self.actions_norm) = (sums[0].sqrt(), sums[1].sqrt());
        match (self.residual_norm, self.actions_norm) {
            (0.0, 0.0) => 0.0,
            (residual, 0.0) if residual.is_finite() => 1.0,
            (residual, actions) => residual / actions,
        }
    }

    /// Whether the residual is at the round-off of the terms it is the sum of, everywhere: no better
    /// solver or smaller step would bring it down ([`round_off`]). Collective.
    pub(super) fn is_round_off(&self) -> Result<bool> {
        // Sizes take a pass over the points. A residual far above those of strains and moves of a
        // whole cell in the stiffest place needs none.
        let (cell, count) = (self.grid.cell_size(), (self.numbering.total * N) as f64);
        let largest = self.diagonal_largest * cell * count.sqrt() + self.actions_norm;
        let moves = self.world.max(self.displacement.iter().fold(0.0, |m, u| u.abs().max(m)));
        // The iterate of a singular system may be of any size, and its terms with it.
        if moves > FARTHEST * cell {
            return Ok(false);
        }
        if !round_off::explains(largest * (1.0 + moves / cell), self.residual_norm) {
            return Ok(false);
        }
        let (numbering, pattern) = (self.numbering, self.pattern);
        let mut size = vec![0.0; numbering.len()];
        for term in &self.terms {
            term.add_share_sizes(self.at(), &mut size);
        }
        numbering.halo.reverse_add(self.world, &mut size, 1)?;
        size.truncate(numbering.owned);
        let norm = |u: &[f64]| u.iter().map(|u| u * u).sum::<f64>().sqrt();
        let moved: Vec<f64> = self.displacement.chunks_exact(N).map(norm).collect();
        for term in &self.terms {
            term.add_sizes(pattern, &moved, &mut size);
        }
        let explained = self.counted().all(|dof| {
            let action = self.external_owned[dof] + self.reaction_owned[dof];
            let size = size[dof / N] + self.external_owned[dof].abs() + action.abs();
            round_off::explains(size, action - self.internal_owned[dof])
        });
        Ok(!self.world.any(!explained))
    }

    /// Owned degrees of freedom but those left out, which carry no equation.
    fn counted(&self) -> impl Iterator<Item = usize> {
        let mut next_fixed = self.held.fixed().peekable();
        (0..self.external_owned.len()).filter(move |&dof| {
            let fixed = next_fixed.next_if_eq(&dof).is_some();
            fixed || !self.held.holds(dof)
        })
    }
}
