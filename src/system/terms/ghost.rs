//! K_G u with K_G = Σ γ_K J_G ⊗ 1 over the boundary faces (Ghost eq. 27, 28): the force of the Ghost
//! faces in the residual, and their stiffness in the tangent.

use crate::error::Result;
use crate::ghost::FaceStencil;
use crate::parallel::World;
use crate::system::pattern::Pattern;
use crate::system::scatter::{BlockMatrix, add_support};
use crate::system::step_system::Discretisation;

use super::scalar::{add_row_product, add_sizes};
use super::term::{At, Term};

/// K_G, constant over a step, and which of its rows are not zero.
pub struct Ghost {
    matrix: BlockMatrix<1>,
    reaches: Vec<bool>,
}

impl Ghost {
    /// The faces' stiffness; `None` if there is none on any rank. Collective.
    pub fn new<const D: usize>(world: &World, mesh: &Discretisation<D>) -> Result<Option<Self>> {
        let matrix = ghost_matrix(world, mesh, |face| face.stiffness)?;
        Ok(matrix.map(|matrix| {
            let rows = mesh.pattern.offsets.windows(2).take(mesh.numbering.owned);
            let reaches = |row: &[usize]| matrix.values[row[0]..row[1]].iter().any(|&v| v != 0.0);
            Ghost { reaches: rows.map(reaches).collect(), matrix }
        }))
    }
}

impl<const D: usize> Term<D> for Ghost {
    fn add_force(&self, at: At<'_>, force: &mut [f64]) {
        for row in (0..force.len() / D).filter(|&row| self.reaches[row]) {
            add_row_product::<D>(&self.matrix, at.pattern, at.displacement, row, force);
        }
    }

    fn first_in_rows(&self) -> Option<(&BlockMatrix<1>, &[bool])> {
        Some((&self.matrix, &self.reaches))
    }

    /// u K_G u / 2.
    fn energy(&self, at: At<'_>) -> f64 {
        let mut force = vec![0.0; self.reaches.len() * D];
        Term::<D>::add_force(self, at, &mut force);
        0.5 * force.iter().zip(at.displacement).map(|(f, u)| f * u).sum::<f64>()
    }

    fn add_sizes(&self, pattern: &Pattern, moved: &[f64], size: &mut [f64]) {
        add_sizes(&self.matrix, pattern, moved, size);
    }
}

/// The faces' share of a scalar matrix, `weight(face) * J_G`; `None` if it vanishes everywhere.
/// Collective.
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
        add_support(&mut matrix, &mesh.pattern, support, &block);
    }
    matrix.reduce(world, &mesh.pattern);
    Ok(Some(matrix))
}
