//! z = B^-1 r for a level of multigrid, with B the diagonal of its matrix but for the nodes that a
//! penalty ties: their rows and columns are one block, and it is solved.
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

/// The rows and columns of a level's matrix that belong to tied nodes.
#[derive(Debug, Default)]
pub struct TiedBlock {
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
    tied: Vec<u32>,
    /// `None` without tied nodes on any rank.
    factors: Option<Factors>,
}

struct Factors {
    solver: Ksp,
    right: Vector,
    left: Vector,
}

/// Options of the solver for the block.
const PREFIX: &str = "qs_mg_tied_";
/// Equations of a block up to which one rank has the factors: message by message the others would wait
/// for each other longer than for it.
const ONE_RANK: usize = 50_000;

impl BlockSmoother {
    /// Collective.
    pub fn new(
        comm: &SimpleCommunicator,
        inverse: Vec<f64>,
        block: Option<&TiedBlock>,
    ) -> Result<Self> {
        let factors = block.map(|block| Factors::new(comm, block)).transpose()?;
        let tied = block.map_or_else(Vec::new, dofs);
        Ok(BlockSmoother { comm: comm.duplicate(), inverse, tied, factors })
    }

    /// For new values of the matrix. Collective.
    pub fn renew(&mut self, inverse: Vec<f64>, block: Option<&TiedBlock>) -> Result<()> {
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
        let of_block = self.tied.iter().map(|&dof| r[dof as usize]);
        right.values_mut()?.iter_mut().zip(of_block).for_each(|(to, from)| *to = from);
        solver.solve(right, left)?;
        for (&dof, value) in self.tied.iter().zip(left.values()?.iter()) {
            z[dof as usize] = *value;
        }
        Ok(())
    }

    fn name(&self) -> &'static std::ffi::CStr {
        c"Jacobi, and the block of tied nodes solved"
    }
}

fn dofs(block: &TiedBlock) -> Vec<u32> {
    let size = block.rows.block as u32;
    block.nodes.iter().flat_map(|&node| (0..size).map(move |k| node * size + k)).collect()
}

impl Factors {
    /// Collective.
    fn new(comm: &SimpleCommunicator, block: &TiedBlock) -> Result<Self> {
        let CoarsestRows { block: size, offsets, columns, values } = &block.rows;
        let rows = offsets.len() - 1;
        let mut matrix = Matrix::from_csr(comm, *size, rows, offsets, columns, values)?;
        matrix.set_symmetric(true)?;
        let mut solver = Ksp::new(comm, PREFIX)?;
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
            (&format!("{inner}pc_type"), "cholesky"),
            (&format!("{inner}pc_factor_mat_solver_type"), package),
        ])?;
        solver.set_from_options()?;
        solver.set_operators(&matrix)?;
        let (right, left) = (matrix.vector()?, matrix.vector()?);
        Ok(Factors { solver, right, left })
    }
}
