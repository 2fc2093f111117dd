//! Which linear solver a system gets by default: direct while it is small, multigrid beyond.
//! The user's PETSc options with the prefix `-qs_` win over all of it.

use crate::assembly::{Numbering, Pattern};
use crate::error::Result;
use crate::grid::Grid;
use crate::parallel::World;
use crate::petsc::matrix::Matrix;
use crate::petsc::snes::Snes;

/// Equations above which multigrid beats the direct solver: fill grows much faster in 3D.
const DIRECT_BELOW: [usize; 2] = [150_000, 20_000];

/// Newton's method with defaults for a system of this size.
pub fn newton<const D: usize>(
    world: &World,
    equations: usize,
    max_evaluations: usize,
) -> Result<Snes> {
    let mut snes = Snes::new(world.comm(), "qs_", max_evaluations.saturating_sub(1).max(1))?;
    if equations <= DIRECT_BELOW[usize::from(D == 3)] {
        snes.set_defaults(&[
            ("ksp_type", "preonly"),
            ("pc_type", "lu"),
            ("pc_factor_mat_solver_type", "mumps"),
        ])?;
    } else {
        snes.set_defaults(&[
            ("ksp_type", "cg"),
            ("ksp_rtol", "1e-8"),
            ("pc_type", "gamg"),
            ("pc_gamg_threshold", "0.02"),
            ("mg_levels_ksp_type", "chebyshev"),
            ("mg_levels_pc_type", "jacobi"),
        ])?;
    }
    snes.set_from_options()?;
    Ok(snes)
}

/// The system's matrix with the given values, block size and near-null space. Collective.
pub fn matrix<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    numbering: &Numbering,
    pattern: &Pattern,
    values: &[f64],
) -> Result<Matrix> {
    let rows = numbering.owned * D;
    let mut offsets = Vec::with_capacity(rows + 1);
    let mut columns = Vec::with_capacity(values.len());
    offsets.push(0);
    for row in 0..numbering.owned {
        let nodes = &pattern.columns[pattern.offsets[row]..pattern.offsets[row + 1]];
        for _ in 0..D {
            for &node in nodes {
                let first = numbering.global[node as usize] * D as i32;
                columns.extend((0..D as i32).map(|k| first + k));
            }
            offsets.push(columns.len() as i32);
        }
    }
    let mut matrix = Matrix::from_csr(world.comm(), D, rows, &offsets, &columns, values)?;
    matrix.set_symmetric(true)?;
    let coordinates: Vec<f64> = numbering.nodes[..numbering.owned]
        .iter()
        .flat_map(|&node| grid.node_position(node))
        .collect();
    matrix.set_rigid_body_near_null_space(&coordinates)?;
    Ok(matrix)
}
