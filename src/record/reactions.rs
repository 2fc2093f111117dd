//! What the boundaries bear: force, sum of nodal magnitudes (Rotation Figure 7) and torque, per
//! named boundary.

use crate::deck::model::Boundary;
use crate::grid::Grid;
use crate::output::tables::history::Reaction;
use crate::parallel::World;
use crate::system::conditions::Conditions;
use crate::system::numbering::Numbering;

/// Sums what each boundary supplies over the degrees of freedom it holds; `supplied`: f_int - f_ext
/// of the owned ones, N. The torque is about the boundary's centre of rotation, else about the
/// origin. Collective.
pub fn reactions<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    numbering: &Numbering,
    boundaries: &[Boundary],
    conditions: &Conditions,
    supplied: &[f64],
) -> Vec<Reaction> {
    boundaries
        .iter()
        .zip(&conditions.members)
        .map(|(boundary, members)| {
            let centre = boundary
                .rotation
                .as_ref()
                .map_or([0.0; 2], |rotation| [rotation.centre[0], rotation.centre[1]]);
            let mut sums = [0.0; 5];
            let mut at = 0;
            while at < members.len() {
                let node = members[at] as usize / D;
                let mut force = [0.0; 3];
                while at < members.len() && members[at] as usize / D == node {
                    let dof = members[at] as usize;
                    force[dof % D] = supplied[dof];
                    at += 1;
                }
                let x = grid.node_position(numbering.nodes[node]);
                for (sum, f) in sums.iter_mut().zip(force) {
                    *sum += f;
                }
                sums[3] += force.iter().map(|f| f * f).sum::<f64>().sqrt();
                sums[4] += (x[0] - centre[0]) * force[1] - (x[1] - centre[1]) * force[0];
            }
            let sums = world.sum_slice(&sums);
            Reaction { force: [sums[0], sums[1], sums[2]], sum_abs: sums[3], torque: sums[4] }
        })
        .collect()
}

/// The nodal force that boundaries supply where they hold, N; zero elsewhere.
pub fn at_held(conditions: &Conditions, supplied: &[f64]) -> Vec<f64> {
    supplied
        .iter()
        .zip(&conditions.fixed)
        .map(|(force, fixed)| if *fixed { *force } else { 0.0 })
        .collect()
}
