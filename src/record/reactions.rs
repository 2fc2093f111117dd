//! What the boundaries bear: force, sum of nodal magnitudes (Rotation Figure 7) and torque, per
//! named boundary.

use crate::deck::When;
use crate::deck::model::Boundary;
use crate::grid::Grid;
use crate::output::tables::history::Reaction;
use crate::parallel::World;
use crate::points::Points;
use crate::system::conditions::{Conditions, StepSpan};
use crate::system::model::Model;
use crate::system::step_system::Discretisation;
use crate::system::terms::surface::{Borne, SurfaceTerm};

/// Sums what each boundary supplies over the degrees of freedom that follow it
/// ([`Conditions::members`]); `supplied`: f_int - f_ext of the owned ones, N. The torque is about the
/// boundary's centre of rotation, else about the origin. The material held is the share of the
/// points' volume that their basis gives to the nodes held. Collective.
pub fn reactions<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    boundaries: &[Boundary],
    conditions: &Conditions,
    supplied: &[f64],
) -> Vec<Reaction> {
    let held = held_volumes(mesh, points, conditions);
    boundaries
        .iter()
        .zip(conditions.members.iter().zip(held))
        .map(|(boundary, (members, held))| {
            let centre = boundary
                .rotation
                .as_ref()
                .map_or([0.0; 2], |rotation| [rotation.centre[0], rotation.centre[1]]);
            let mut sums = [0.0; 6];
            sums[5] = held;
            let mut at = 0;
            while at < members.len() {
                let node = members[at] as usize / D;
                let mut force = [0.0; 3];
                while at < members.len() && members[at] as usize / D == node {
                    let dof = members[at] as usize;
                    force[dof % D] = supplied[dof];
                    at += 1;
                }
                let x = grid.node_position(mesh.numbering.nodes[node]);
                for (sum, f) in sums.iter_mut().zip(force) {
                    *sum += f;
                }
                sums[3] += force.iter().map(|f| f * f).sum::<f64>().sqrt();
                sums[4] += (x[0] - centre[0]) * force[1] - (x[1] - centre[1]) * force[0];
            }
            let sums = world.sum_slice(&sums);
            Reaction {
                force: [sums[0], sums[1], sums[2]],
                sum_abs: sums[3],
                torque: sums[4],
                held: sums[5],
            }
        })
        .collect()
}

/// What the supports bear at the start of a step, this rank's share; empty without any.
pub fn supports_at_start<const D: usize>(
    model: &Model<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    span: StepSpan,
) -> Vec<Borne> {
    let still = match model.supports.is_empty() {
        true => Vec::new(),
        false => vec![0.0; mesh.numbering.len() * D],
    };
    supports(model, mesh, points, span.start(), &still)
}

/// What they bear after the nodal increments `displacement` (local nodes, m) of a step whose points
/// have not been updated; at the moment `when`.
pub fn supports<const D: usize>(
    model: &Model<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    when: When,
    displacement: &[f64],
) -> Vec<Borne> {
    if model.supports.is_empty() {
        return Vec::new();
    }
    let step = mesh.step_points(points, &model.materials);
    let count = model.deck.boundaries.len();
    let term = SurfaceTerm::new(model, step, &mesh.carriers, when);
    term.map_or(Vec::new(), |term| term.borne(step, displacement, count))
}

/// Adds what supports bear over all ranks to the reactions of the deck's boundaries. Collective.
pub fn with_supports(
    world: &World,
    borne: &[Borne],
    mut reactions: Vec<Reaction>,
) -> Vec<Reaction> {
    if borne.is_empty() {
        return reactions;
    }
    let of_one = |b: &Borne| [b.force[0], b.force[1], b.force[2], b.sum_abs, b.torque, b.held];
    let sums = world.sum_slice(&borne.iter().flat_map(of_one).collect::<Vec<_>>());
    for (reaction, sums) in reactions.iter_mut().zip(sums.chunks_exact(6)) {
        reaction.force.iter_mut().zip(sums).for_each(|(force, sum)| *force += sum);
        reaction.sum_abs += sums[3];
        reaction.torque += sums[4];
        reaction.held += sums[5];
    }
    reactions
}

/// Σ_p V_p Σ_v S_vp over the nodes v that each boundary holds, this rank's points, m3.
fn held_volumes<const D: usize>(
    mesh: &Discretisation<D>,
    points: &Points<D>,
    conditions: &Conditions,
) -> Vec<f64> {
    let mut sums = vec![0.0; conditions.held_nodes.len()];
    let mut weights = vec![0.0; sums.len()];
    let groups = &mesh.groups;
    for group in 0..groups.len() {
        let nodes = &mesh.group_nodes[groups.node_offsets[group]..groups.node_offsets[group + 1]];
        let held = |node: u32| conditions.fixed[node as usize * D..][..D].contains(&true);
        if !nodes.iter().any(|&node| held(node)) {
            continue;
        }
        for &p in groups.points(group) {
            weights.fill(0.0);
            let shares = &mesh.influences.weights[mesh.influences.row(p)];
            for (node, share) in nodes.iter().zip(shares).filter(|(node, _)| held(**node)) {
                for (weight, nodes) in weights.iter_mut().zip(&conditions.held_nodes) {
                    if nodes.binary_search(node).is_ok() {
                        *weight += share;
                    }
                }
            }
            let volume = points.volume(p);
            sums.iter_mut().zip(&weights).for_each(|(sum, weight)| *sum += weight * volume);
        }
    }
    sums
}

/// The nodal force that boundaries supply where they hold, N; zero elsewhere.
pub fn at_held(conditions: &Conditions, supplied: &[f64]) -> Vec<f64> {
    supplied
        .iter()
        .zip(&conditions.fixed)
        .map(|(force, fixed)| if *fixed { *force } else { 0.0 })
        .collect()
}
