//! f_ext of an implicit step at both of its ends (Lagrangian eq. 29).

use crate::error::Result;
use crate::loads::point_forces::map_forces;
use crate::parallel::World;
use crate::points::Points;
use crate::system::conditions::StepSpan;
use crate::system::model::Model;
use crate::system::step_system::Discretisation;

/// External forces of a step, N.
pub(super) struct Loads<const D: usize> {
    /// On the points at the start.
    pub points_start: Vec<[f64; D]>,
    /// Of the owned degrees of freedom, here and below.
    pub external_start: Vec<f64>,
    pub external_end: Vec<f64>,
}

impl<const D: usize> Loads<D> {
    /// Collective.
    pub fn of_step(
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        mesh: &Discretisation<D>,
        span: StepSpan,
    ) -> Result<Self> {
        let points_start = model.point_forces(world, points, span.factor_start, span.time_start)?;
        let points_end = model.point_forces(world, points, span.factor_end, span.time_end)?;
        Ok(Loads {
            external_start: owned_forces(world, mesh, &points_start)?,
            external_end: owned_forces(world, mesh, &points_end)?,
            points_start,
        })
    }
}

/// Nodal external force of the owned degrees of freedom. Collective.
fn owned_forces<const D: usize>(
    world: &World,
    mesh: &Discretisation<D>,
    forces: &[[f64; D]],
) -> Result<Vec<f64>> {
    let numbering = &mesh.numbering;
    let mut nodal = map_forces(numbering, &mesh.influences, forces);
    numbering.halo.reverse_add(world, &mut nodal, D)?;
    nodal.truncate(numbering.owned * D);
    Ok(nodal)
}
