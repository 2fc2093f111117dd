//! What Newton's method asks of the equations: residual, tangent, reactions, end of the iteration.

use crate::amg::flow::Flow;
use crate::amg::level::Assembled;
use crate::amg::{self, BlockSmoother, Hierarchy, Levelled, Levels, MatrixKind};
use crate::analysis::convergence::{converges_next, hardly_falls, stalls};
use crate::blocks::BlockProduct;
use crate::error::Result;
use crate::petsc::Ksp;
use crate::petsc::matrix::Matrix;
use crate::petsc::snes::{NewtonProblem, Verdict};
use crate::system::in_place::InPlace;
use std::time::Instant;

use super::{Equilibrium, Tangent};

impl<const D: usize, const N: usize> NewtonProblem for Equilibrium<'_, D, N> {
    /// With the tangent, unless this is likely the step's last evaluation.
    fn residual(&mut self, x: &[f64], f: &mut [f64], matrix: &mut Matrix) -> Result<bool> {
        let matrix = (!self.expects_convergence()).then_some(matrix);
        self.evaluate_at(x, f, matrix)
    }

    fn jacobian(&mut self, _x: &[f64], matrix: &mut Matrix) -> Result<()> {
        if self.tangent == Tangent::Stale {
            let begin = Instant::now();
            self.evaluate(Some(matrix))?;
            self.assembly_seconds += begin.elapsed().as_secs_f64();
        }
        if self.tangent == Tangent::Assembled {
            let (mut main, mut other) = matrix.storage()?;
            let mut rows = InPlace::filled(&self.addresses, &mut main, &mut self.beside)?;
            let scale = self.diagonal_scale;
            self.held.constrain(self.pattern, scale, &mut rows);
            if let Some(other) = &mut other {
                rows.hand_over(other)?;
            }
            self.tangent = Tangent::Constrained;
        }
        matrix.changed()
    }

    /// Moves the columns of prescribed displacements to the right-hand side.
    fn before_solve(&mut self, rhs: &mut [f64]) -> Result<()> {
        let mut prescribed = vec![0.0; self.numbering.len() * N];
        let mut any = false;
        for (dof, value) in rhs.iter().enumerate() {
            if self.held.holds(dof) && *value != 0.0 {
                prescribed[dof] = value / self.diagonal_scale;
                any = true;
            }
        }
        if !self.world.any(any) {
            return Ok(());
        }
        self.numbering.halo.forward(self.world, &mut prescribed, N)?;
        self.held.move_columns(&prescribed, rhs);
        Ok(())
    }

    fn assess(&mut self, iteration: usize, x: &[f64], _f: &[f64]) -> Result<Verdict> {
        if iteration > 0 {
            self.accumulate_reactions(x)?;
        } else {
            self.internal_start.clone_from(&self.internal_owned);
        }
        let error = self.normalised_error();
        self.errors.push(error);
        self.previous_owned.copy_from_slice(x);
        self.internal_previous.copy_from_slice(&self.internal_owned);
        self.external_previous.copy_from_slice(&self.external_owned);
        let last = iteration + 1 >= self.settings.max_evaluations;
        Ok(if !error.is_finite() {
            Verdict::Diverged("the residual is not finite".into())
        } else if iteration > 0 && error <= self.settings.tolerance {
            Verdict::Converged
        } else if iteration > 0 && (hardly_falls(&self.errors) || last) && self.is_round_off()? {
            self.at_round_off = true;
            Verdict::Converged
        } else if self.settings.ends_where_stalled && stalls(&self.errors) {
            self.stalled = true;
            Verdict::Diverged(format!(
                "the iterates come no closer, residual {error:.3e} after {} evaluations",
                iteration + 1
            ))
        } else if last {
            Verdict::Diverged(format!(
                "residual {error:.3e} after {} evaluations, tolerance {:.1e}",
                iteration + 1,
                self.settings.tolerance
            ))
        } else {
            Verdict::Continue
        })
    }

    fn error_over_tolerance(&self) -> f64 {
        self.errors.last().map_or(f64::INFINITY, |error| error / self.settings.tolerance)
    }

    fn prepare_solver(&mut self, solver: &Ksp, matrix: &mut Matrix, earlier: usize) -> Result<()> {
        Levels::prepare(self, solver, matrix, earlier)
    }

    fn record_solve(&mut self, iterations: usize, tolerance: f64) {
        self.levels.record_solve(iterations, tolerance);
    }
}

impl<const D: usize, const N: usize> Levelled for Equilibrium<'_, D, N> {
    fn levels(&mut self) -> &mut Levels {
        &mut self.levels
    }

    fn hierarchy(&mut self, matrix: &mut Matrix) -> Result<Option<Hierarchy>> {
        self.with_rows(matrix, |rows| {
            let (ties, of) = (self.ties(rows)?, self.numbering);
            amg::of_system(self.world, self.grid, of, rows, &ties, (self.unknowns, self.kind()))
        })
    }

    fn flow(&mut self, matrix: &mut Matrix) -> Result<Option<Flow>> {
        if self.kind() != MatrixKind::Flowing {
            return Ok(None);
        }
        self.with_rows(matrix, |rows| {
            if self.ties(rows)?.are_there(self.world) {
                return Ok(None);
            }
            amg::flow::<N>(self.world, self.numbering, rows).map(Some)
        })
    }

    fn follow(
        &mut self,
        matrix: &mut Matrix,
        flow: Option<&Flow>,
        smoother: &mut BlockSmoother,
    ) -> Result<()> {
        self.with_rows(matrix, |rows| {
            let (world, of) = (self.world, self.numbering);
            if let Some(flow) = flow {
                return amg::follow_flow::<N>(world, of, rows, flow, smoother);
            }
            let ties = self.ties(rows)?;
            if self.symmetric() {
                return amg::tie::<N>(world, of, rows, &ties.nodes, smoother);
            }
            let part = amg::surrogate(world, of, rows, &ties)?;
            amg::tie(world, of, &part, &ties.nodes, smoother)
        })
    }

    fn fill(
        &mut self,
        matrix: &mut Matrix,
        exact: &mut BlockProduct<f64>,
        finest: &mut BlockProduct<f32>,
    ) -> Result<()> {
        self.with_rows(matrix, |rows| {
            amg::fill::<_, N>(rows, exact);
            if self.symmetric() {
                exact.round_into(finest);
                return Ok(());
            }
            let ties = self.ties(rows)?;
            if !ties.are_there(self.world) && exact.round_into(finest) {
                return Ok(());
            }
            let part = amg::surrogate(self.world, self.numbering, rows, &ties)?;
            amg::fill::<_, N>(&part, finest);
            Ok(())
        })
    }
}

impl<const D: usize, const N: usize> Equilibrium<'_, D, N> {
    /// Whether the coming iterate will hardly need a tangent.
    fn expects_convergence(&self) -> bool {
        converges_next(&self.errors, self.settings.tolerance)
    }

    /// f_react = f_int(old) + K (x - x_old) - f_ext on the fixed degrees of freedom.
    fn accumulate_reactions(&mut self, x: &[f64]) -> Result<()> {
        let mut change = vec![0.0; self.numbering.len() * N];
        for (c, (new, old)) in change.iter_mut().zip(x.iter().zip(&self.previous_owned)) {
            *c = new - old;
        }
        self.numbering.halo.forward(self.world, &mut change, N)?;
        for (dof, sum) in self.held.reactions::<N>(self.pattern, &change) {
            self.reaction_owned[dof] =
                self.internal_previous[dof] + sum - self.external_previous[dof];
        }
        Ok(())
    }

    /// Acts on the matrix as multigrid reads it.
    fn with_rows<T>(
        &self,
        matrix: &mut Matrix,
        act: impl FnOnce(&Assembled) -> Result<T>,
    ) -> Result<T> {
        let (own, other) = matrix.storage()?;
        act(&Assembled::new(self.numbering, self.pattern, &own, other.as_deref().unwrap_or(&[])))
    }
}
