//! Terms of a step's equations that are linear in its displacement and the same in every direction:
//! the Ghost stiffness K_G u (Ghost eq. 28) and the inertia of implicit dynamics.

use crate::error::Result;
use crate::ghost::FaceStencil;
use crate::mass::matrix;
use crate::parallel::World;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockMatrix;
use crate::system::scatter::{self, BlockRows};

use crate::system::step_system::Discretisation;

/// Inertia that moves with the increments u: the equations become
/// share (f_int(u) + K_G u) + matrix u = f_ext.
#[derive(Debug)]
pub struct Inertia {
    /// 1 + alpha of the HHT method, 1 for Newmark's.
    pub share: f64,
    /// M~ / (beta dt^2) in its owners' rows, kg/s2.
    pub matrix: BlockMatrix<1>,
}

/// K_G and which of its rows are not zero.
pub struct GhostTerm {
    pub matrix: BlockMatrix<1>,
    pub reaches: Vec<bool>,
}

/// The faces' share of a scalar matrix, `weight(face) * J_G`; `None` if it vanishes everywhere.
pub fn ghost_matrix<const D: usize>(
    world: &World,
    mesh: &Discretisation<D>,
    weight: impl Fn(&FaceStencil) -> f64,
) -> Result<Option<BlockMatrix<1>>> {
    if !world.any(mesh.faces.iter().any(|face| weight(face) != 0.0)) {
        return Ok(None);
    }
    let mut matrix = BlockMatrix::zeros(&mesh.pattern);
    // Supports of the faces follow those of the groups.
    for (support, face) in (mesh.groups.len()..).zip(&mesh.faces) {
        let factor = weight(face);
        let block: Vec<f64> = face.matrix.iter().map(|value| factor * value).collect();
        matrix::add_support(&mut matrix, &mesh.pattern, support, &block);
    }
    matrix.reduce(world, &mesh.pattern);
    Ok(Some(matrix))
}

impl GhostTerm {
    /// The faces' stiffness; `None` if there is none on any rank. Collective.
    pub fn new<const D: usize>(world: &World, mesh: &Discretisation<D>) -> Result<Option<Self>> {
        let matrix = ghost_matrix(world, mesh, |face| face.stiffness)?;
        Ok(matrix.map(|matrix| {
            let rows = mesh.pattern.offsets.windows(2).take(mesh.numbering.owned);
            let reaches = |row: &[usize]| matrix.values[row[0]..row[1]].iter().any(|&v| v != 0.0);
            GhostTerm { reaches: rows.map(reaches).collect(), matrix }
        }))
    }

    /// force += K_G u over the owned rows.
    pub fn add_product<const D: usize>(
        &self,
        pattern: &Pattern,
        displacement: &[f64],
        force: &mut [f64],
    ) {
        for row in (0..force.len() / D).filter(|&row| self.reaches[row]) {
            add_row_product::<D>(&self.matrix, pattern, displacement, row, force);
        }
    }
}

impl GhostTerm {
    /// size += |K_G| |u| over the owned nodes, N: what [`crate::analysis::round_off`] asks for.
    pub fn add_size(&self, pattern: &Pattern, moved: &[f64], size: &mut [f64]) {
        add_size(&self.matrix, pattern, moved, size);
    }
}

impl Inertia {
    /// size = share size + |matrix| |u| over the owned nodes, N.
    pub fn add_size(&self, pattern: &Pattern, moved: &[f64], size: &mut [f64]) {
        size.iter_mut().for_each(|value| *value *= self.share);
        add_size(&self.matrix, pattern, moved, size);
    }

    /// force = share force + matrix u over the owned rows.
    pub fn add_force<const D: usize>(
        &self,
        pattern: &Pattern,
        displacement: &[f64],
        force: &mut [f64],
    ) {
        force.iter_mut().for_each(|value| *value *= self.share);
        for row in 0..force.len() / D {
            add_row_product::<D>(&self.matrix, pattern, displacement, row, force);
        }
    }

    /// K = share K + matrix.
    pub fn join<const D: usize, R: BlockRows<D>>(
        &self,
        pattern: &Pattern,
        owned: usize,
        rows: &mut R,
    ) {
        for row in 0..owned {
            let blocks = pattern.offsets[row + 1] - pattern.offsets[row];
            let values = rows.values(rows.start(pattern, row), D * D * blocks);
            values.iter_mut().for_each(|value| *value *= self.share);
            scatter::add_scalar_row(&self.matrix, pattern, row, rows);
        }
    }
}

/// size += |J| |u| with the norms `moved` of local nodes.
fn add_size(scalar: &BlockMatrix<1>, pattern: &Pattern, moved: &[f64], size: &mut [f64]) {
    for (row, size) in size.iter_mut().enumerate() {
        let entries = pattern.offsets[row]..pattern.offsets[row + 1];
        *size += entries
            .map(|entry| scalar.values[entry].abs() * moved[pattern.columns[entry] as usize])
            .sum::<f64>();
    }
}

/// force += (J ⊗ 1) u in one row.
#[inline]
fn add_row_product<const D: usize>(
    scalar: &BlockMatrix<1>,
    pattern: &Pattern,
    displacement: &[f64],
    row: usize,
    force: &mut [f64],
) {
    for entry in pattern.offsets[row]..pattern.offsets[row + 1] {
        let (value, column) = (scalar.values[entry], pattern.columns[entry] as usize);
        for i in 0..D {
            force[row * D + i] += value * displacement[column * D + i];
        }
    }
}
