//! z = B^-1 r for a level of multigrid, with B the diagonal of its matrix but for the nodes that a
//! penalty ties, or that flow (`flow.rs`): their rows and columns are one block, and it is solved.
//!
//! A penalty f times as stiff as the material leaves motions along and beside its surface that are as
//! soft as the material. Jacobi's smoother divides by f and hardly reduces them: iterations would grow with the
//! root of f. They all live on the nodes that the penalty stiffens, a layer about the surface.

use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;

use crate::error::Result;
use crate::petsc::multigrid::Smoother;
use crate::petsc::{Ksp, Matrix, Vector, factors};

use super::cycle::CoarsestRows;

/// Why nodes are solved together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Penalties tie them; the block is symmetric.
    Ties,
    /// They flow; the block is unsymmetric.
    Flow,
}

/// The rows and columns of a level's matrix that belong to some of its nodes.
#[derive(Debug)]
pub struct NodeBlock {
    /// Why these.
    pub cause: Cause,
    /// Owned nodes, ascending.
    pub nodes: Vec<u32>,
    /// This rank's rows of the block, with columns by its own numbers.
    pub rows: CoarsestRows,
}

/// B of one level on one rank.
pub struct BlockSmoother {
    comm: SimpleCommunicator,
    /// One over the diagonal, zero where that is not positive.
    inverse: Vec<f64>,
    /// Owned degrees of freedom in the block.
    block: Vec<u32>,
    /// `None` without such nodes on any rank.
    factors: Option<Factors>,
}

struct Factors {
    solver: Ksp,
    right: Vector,
    left: Vector,
}

impl Cause {
    /// Options of the solver for the block, and the factors that it has unless they say otherwise.
    fn solver(self) -> (&'static str, &'static str) {
        match self {
            Cause::Ties => ("qs_mg_tied_", "cholesky"),
            Cause::Flow => ("qs_mg_flow_", "lu"),
        }
    }
}

/// Equations of a block up to which one rank has the factors: message by message the others would wait
/// for each other longer than for it.
const ONE_RANK: usize = 50_000;

impl BlockSmoother {
    /// Collective.
    pub fn new(
        comm: &SimpleCommunicator,
        inverse: Vec<f64>,
        block: Option<&NodeBlock>,
    ) -> Result<Self> {
        let factors = block.map(|block| Factors::new(comm, block)).transpose()?;
        let block = block.map_or_else(Vec::new, dofs);
        Ok(BlockSmoother { comm: comm.duplicate(), inverse, block, factors })
    }

    /// For new values of the matrix. Collective.
    pub fn renew(&mut self, inverse: Vec<f64>, block: Option<&NodeBlock>) -> Result<()> {
        *self = Self::new(&self.comm, inverse, block)?;
        Ok(())
    }
}

impl Smoother for BlockSmoother {
    fn apply(&mut self, r: &[f64], z: &mut [f64]) -> Result<()> {
        for (z, (r, inverse)) in z.iter_mut().zip(r.iter().zip(&self.inverse)) {
            *z = r * inverse;
        }
        let Some(Factors { solver, right, left }) = &mut self.factors else { return Ok(()) };
        let of_block = self.block.iter().map(|&dof| r[dof as usize]);
        right.values_mut()?.iter_mut().zip(of_block).for_each(|(to, from)| *to = from);
        solver.solve(right, left)?;
        for (&dof, value) in self.block.iter().zip(left.values()?.iter()) {
            z[dof as usize] = *value;
        }
        Ok(())
    }

    fn name(&self) -> &'static std::ffi::CStr {
        c"Jacobi, and the block of tied or flowing nodes solved"
    }
}

fn dofs(block: &NodeBlock) -> Vec<u32> {
    let size = block.rows.block as u32;
    block.nodes.iter().flat_map(|&node| (0..size).map(move |k| node * size + k)).collect()
}

impl Factors {
    /// Collective.
    fn new(comm: &SimpleCommunicator, block: &NodeBlock) -> Result<Self> {
        let CoarsestRows { block: size, offsets, columns, values } = &block.rows;
        let rows = offsets.len() - 1;
        let mut matrix = Matrix::from_csr(comm, *size, rows, offsets, columns, values)?;
        matrix.set_symmetric(block.cause == Cause::Ties)?;
        let (prefix, factorisation) = block.cause.solver();
        let mut solver = Ksp::new(comm, prefix)?;
        let package = factors::package();
        let few = matrix.rows_all()? <= ONE_RANK || package == factors::OWN;
        let inner = if comm.size() > 1 && few {
            solver.set_defaults(&[
                ("pc_type", "telescope"),
                ("pc_telescope_reduction_factor", &comm.size().to_string()),
            ])?;
            "telescope_"
        } else {
            ""
        };
        solver.set_defaults(&[
            ("ksp_type", "preonly"),
            (&format!("{inner}ksp_type"), "preonly"),
            (&format!("{inner}pc_type"), factorisation),
            (&format!("{inner}pc_factor_mat_solver_type"), package),
            (&format!("{inner}{}", factors::ZERO_PIVOT.0), factors::ZERO_PIVOT.1),
        ])?;
        solver.set_from_options()?;
        solver.set_operators(&matrix)?;
        let (right, left) = (matrix.vector()?, matrix.vector()?);
        Ok(Factors { solver, right, left })
    }
}
