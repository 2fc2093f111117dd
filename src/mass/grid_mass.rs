//! The mass at the nodes of one step, consistent with its Ghost share or lumped, and velocities
//! by it: v = M~^-1 Σ m S^T v_p (Ghost eq. 10).

use super::inverse::MassInverse;
use super::matrix;
use super::solver::MassSolver;
use crate::deck::model::Mass;
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::parallel::World;
use crate::system::scatter::BlockMatrix;

use crate::system::step_points::StepPoints;
use crate::system::step_system::Discretisation;
use crate::system::terms::ghost::ghost_matrix;
use crate::transfer::nodal_sums::over_points;

/// Mass of the active nodes of one step.
pub enum GridMass {
    /// Per local node, complete at owned ones, kg.
    Lumped(Vec<f64>),
    Consistent {
        /// M~ = M + gamma_M J in its owners' rows.
        matrix: BlockMatrix<1>,
        /// gamma_M J alone, where there is any.
        ghost: Option<BlockMatrix<1>>,
    },
}

impl GridMass {
    /// Assembles the kind the deck asks for. Collective.
    pub fn assemble<const D: usize>(
        world: &World,
        mesh: &Discretisation<D>,
        step: StepPoints<'_, D>,
        kind: Mass,
    ) -> Result<Self> {
        match kind {
            Mass::Lumped => {
                let [mass] = over_points(world, mesh, |part, [mass]: [&mut [[f64; 1]]; 1]| {
                    matrix::add_lumped(step, part, mass.as_flattened_mut());
                });
                Ok(GridMass::Lumped(mass.into_flattened()))
            }
            Mass::Consistent => {
                let local = (&mesh.numbering.halo, mesh.numbering.len());
                let mut matrix = matrix::consistent(world, step, &mesh.pattern, local)?;
                let ghost = ghost_matrix(world, mesh, |face| face.mass)?;
                if let Some(ghost) = &ghost {
                    for (value, share) in matrix.values.iter_mut().zip(&ghost.values) {
                        *value += share;
                    }
                }
                Ok(GridMass::Consistent { matrix, ghost })
            }
        }
    }

    /// Prepares solves with the held degrees of freedom (local), a consistent mass by `solver`.
    /// Collective.
    pub fn inverse<'a, const D: usize>(
        &'a self,
        world: &'a World,
        grid: &'a Grid<D>,
        mesh: &'a Discretisation<D>,
        held: &'a [bool],
        solver: &'a mut MassSolver,
    ) -> Result<Inverse<'a, D>> {
        let how = match self {
            GridMass::Lumped(mass) => How::Lumped(mass),
            GridMass::Consistent { matrix, .. } => How::Consistent(Box::new(MassInverse::new(
                world,
                grid,
                &mesh.numbering,
                &mesh.pattern,
                matrix,
                held,
                solver,
            )?)),
        };
        Ok(Inverse { world, mesh, held, how })
    }

    /// M u over the owned degrees of freedom, `u` local.
    pub fn multiply<const D: usize>(&self, mesh: &Discretisation<D>, u: &[f64]) -> Vec<f64> {
        let owned = mesh.numbering.owned * D;
        match self {
            GridMass::Lumped(mass) => (0..owned).map(|dof| mass[dof / D] * u[dof]).collect(),
            GridMass::Consistent { matrix, .. } => {
                let mut product = vec![0.0; owned];
                matrix::multiply::<D>(matrix, &mesh.pattern, u, &mut product);
                product
            }
        }
    }

    /// factor M as a matrix in its owners' rows.
    pub fn scaled<const D: usize>(&self, mesh: &Discretisation<D>, factor: f64) -> BlockMatrix<1> {
        let pattern = &mesh.pattern;
        match self {
            GridMass::Consistent { matrix, .. } => {
                BlockMatrix { values: matrix.values.iter().map(|value| factor * value).collect() }
            }
            GridMass::Lumped(mass) => {
                let mut matrix = BlockMatrix::zeros(pattern);
                for row in 0..mesh.numbering.owned {
                    if let Some(entry) = pattern.diagonal(row) {
                        matrix.values[entry] = factor * mass[row];
                    }
                }
                matrix
            }
        }
    }

    /// v M v of what boundaries move by `increment` (zero elsewhere) in a step of `dt`, of this
    /// rank, J.
    pub fn driven_energy<const D: usize>(
        &self,
        mesh: &Discretisation<D>,
        increment: &[f64],
        dt: f64,
    ) -> f64 {
        if increment.iter().all(|&u| u == 0.0) {
            return 0.0;
        }
        let product = self.multiply(mesh, increment);
        product.iter().zip(increment).map(|(mu, u)| mu * u).sum::<f64>() / (dt * dt)
    }

    /// Kinetic energy in the Ghost share, v M_G v / 2, of this rank, J.
    pub fn ghost_energy<const D: usize>(&self, mesh: &Discretisation<D>, velocity: &[f64]) -> f64 {
        match self {
            GridMass::Consistent { ghost: Some(ghost), .. } => {
                let owned = mesh.numbering.owned;
                0.5 * matrix::quadratic_form::<D>(ghost, &mesh.pattern, owned, velocity)
            }
            _ => 0.0,
        }
    }
}

/// A mass that can be divided by.
pub struct Inverse<'a, const D: usize> {
    world: &'a World,
    mesh: &'a Discretisation<D>,
    held: &'a [bool],
    how: How<'a, D>,
}

enum How<'a, const D: usize> {
    Lumped(&'a [f64]),
    Consistent(Box<MassInverse<'a, D>>),
}

impl<const D: usize> Inverse<'_, D> {
    /// M x = `sums`, where held x = `prescribed` (local). `sums` are nodal sums of this rank's
    /// points, sent to their owners here. Returns local values. Collective.
    pub fn solve(&mut self, sums: Vec<[f64; D]>, prescribed: &[f64]) -> Result<Vec<f64>> {
        let sums = self.summed(sums)?;
        self.solve_to_ghosts(&sums, prescribed, None)
    }

    /// Nodal sums of this rank's points with those of the others, at the owned nodes. Collective.
    pub fn summed(&self, mut sums: Vec<[f64; D]>) -> Result<Vec<[f64; D]>> {
        self.mesh.numbering.halo.reverse_add(self.world, sums.as_flattened_mut(), D)?;
        Ok(sums)
    }

    /// [`Self::solve_summed`] with the values at the ghosts. Collective.
    pub fn solve_to_ghosts(
        &mut self,
        sums: &[[f64; D]],
        prescribed: &[f64],
        guess: Option<&[f64]>,
    ) -> Result<Vec<f64>> {
        let mut x = self.solve_summed(sums, prescribed, guess)?;
        self.mesh.numbering.halo.forward(self.world, &mut x, D)?;
        Ok(x)
    }

    /// [`Self::solve_summed`] for two right-hand sides at once. Collective.
    pub fn solve_two(
        &mut self,
        sums: [&[[f64; D]]; 2],
        prescribed: [&[f64]; 2],
    ) -> Result<[Vec<f64>; 2]> {
        let How::Consistent(inverse) = &mut self.how else {
            let [one, two] = [0, 1].map(|k| self.solve_summed(sums[k], prescribed[k], None));
            return Ok([one?, two?]);
        };
        let owned = self.mesh.numbering.owned;
        inverse.solve_two(sums.map(|sums| sums[..owned].as_flattened()), prescribed)
    }

    /// [`Self::solve`] for sums over all ranks at the owned nodes, from a `guess` near x if there
    /// is one. Local values, the ghosts without meaning. Collective.
    pub fn solve_summed(
        &mut self,
        sums: &[[f64; D]],
        prescribed: &[f64],
        guess: Option<&[f64]>,
    ) -> Result<Vec<f64>> {
        let numbering = &self.mesh.numbering;
        let rhs = sums[..numbering.owned].as_flattened();
        match &mut self.how {
            How::Consistent(inverse) => inverse.solve_from(rhs, prescribed, guess),
            How::Lumped(mass) => {
                let mut x = vec![0.0; numbering.len() * D];
                for (dof, value) in rhs.iter().enumerate() {
                    let mass = mass[dof / D];
                    x[dof] = if self.held[dof] {
                        prescribed[dof]
                    } else if mass > 0.0 {
                        value / mass
                    } else {
                        0.0
                    };
                }
                Ok(x)
            }
        }
    }

    /// Iterations of the mass solver so far.
    pub fn iterations(&self) -> usize {
        match &self.how {
            How::Lumped(_) => 0,
            How::Consistent(inverse) => inverse.iterations,
        }
    }
}

/// An active node without mass that forces act on: its acceleration does not exist. Nodes held
/// in a component do not count there. Collective.
pub fn require_mass<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    mesh: &Discretisation<D>,
    mass: &GridMass,
    held: &[bool],
    force: &[[f64; D]],
) -> Result<()> {
    let numbering = &mesh.numbering;
    let mass_of = |node: usize| match mass {
        GridMass::Lumped(mass) => mass[node],
        GridMass::Consistent { matrix, .. } => {
            mesh.pattern.diagonal(node).map_or(0.0, |entry| matrix.values[entry])
        }
    };
    let bad = (0..numbering.owned).find(|&node| {
        let pushed = (0..D).any(|i| force[node][i] != 0.0 && !held[node * D + i]);
        pushed && !(mass_of(node) > f64::MIN_POSITIVE)
    });
    let message = bad.map(|node| {
        format!(
            "the node at {:?} m bears a force but no mass, so that its acceleration is not \
             defined: a point sits exactly on the cell's edge; use method.basis = \"gimp\", \
             [ghost] mass_factor = 0.25, or shift the body by a fraction of a cell",
            grid.node_position(numbering.nodes[node])
        )
    });
    world.refuse(Error::Run, message)
}
