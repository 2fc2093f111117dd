//! v_I = Σ_p g_Ip v_p / Σ_p g_Ip at nodes I that hold (almost) no mass or less than none: they move
//! along with the points that reach them, v_p the velocity of a point by its other nodes, and what
//! acts on them is handed to those nodes by the same shares.
//!
//! With a lumped mass a node's velocity is its momentum over its mass. Neither means anything where
//! points reach the node with their gradient alone (points on a line between empty cells), or with
//! weights that cancel or are below zero (a corner of a CPDI domain a little outside the grid, a
//! badly distorted domain). g_Ip = m_p (|S_Ip| + h |dS_Ip/dx|) measures how firmly the point reaches
//! the node, h the size of a cell.
//!
//! The shares of one light node sum to one. So any common velocity stays as it is, and mass,
//! momentum and force of all nodes keep their sums. Velocities and forces use one matrix and its
//! transpose: the work of the one on the other is kept.

use std::ops::Range;

use crate::error::Result;
use crate::parallel::World;
use crate::system::step_points::StepPoints;
use crate::system::step_system::Discretisation;
use crate::transfer::nodal_sums::over_points;

use super::grid_mass::GridMass;

/// Shares of the largest nodal mass, and of g, up to which a node is light. Nodes of true, if tiny,
/// overlaps lie far above both: they belong to the published schemes.
const OF_LARGEST: f64 = 1e-12;
const OF_COUPLING: f64 = 1e-9;
/// Weight of its other nodes that a point needs to carry light ones.
const ENOUGH: f64 = 1e-3;

/// The light nodes of one step.
pub struct LightNodes {
    /// Of local nodes.
    light: Vec<bool>,
    /// Σ_p g_Ip at local light nodes, kg.
    coupling: Vec<f64>,
    /// Points that reach light nodes and have others, ascending, and the weight of the others.
    carriers: Vec<(usize, f64)>,
    /// m
    size: f64,
}

impl LightNodes {
    /// Finds the light nodes, if there are any on any rank, and hands their mass on. Collective.
    pub fn find<const D: usize>(
        world: &World,
        mesh: &Discretisation<D>,
        step: StepPoints<'_, D>,
        size: f64,
        mass: &mut GridMass,
    ) -> Result<Option<Self>> {
        let GridMass::Lumped(mass) = mass else { return Ok(None) };
        let owned = mesh.numbering.owned;
        let extreme = |sign: f64| mass[..owned].iter().map(|m| sign * m).fold(f64::MIN, f64::max);
        let [largest, least] = [extreme(1.0), extreme(-1.0)];
        let extremes = world.max_slice(&[largest, least]);
        let limit = OF_LARGEST * extremes[0];
        if -extremes[1] > limit {
            return Ok(None);
        }
        let halo = &mesh.numbering.halo;
        let suspect = |node: usize| node < owned && mass[node] <= limit;
        let mut marks: Vec<f64> =
            (0..mesh.numbering.len()).map(|node| f64::from(u8::from(suspect(node)))).collect();
        halo.forward(world, &mut marks, 1)?;
        let light: Vec<bool> = marks.iter().map(|mark| *mark > 0.0).collect();
        // Before it is known which are light and who carries them: all points that reach them.
        let carriers = reaching(step, &light).map(|p| (p, 1.0)).collect();
        let mut found = LightNodes { light, coupling: vec![], carriers, size };
        let coupling = found.couplings(world, mesh, step);
        for node in 0..owned {
            let light = suspect(node) && mass[node] <= OF_COUPLING * coupling[node][0];
            marks[node] = f64::from(u8::from(light && coupling[node][0] > 0.0));
        }
        halo.forward(world, &mut marks, 1)?;
        found.light = marks.iter().map(|mark| *mark > 0.0).collect();
        if !world.any(found.light[..owned].contains(&true)) {
            return Ok(None);
        }
        // Of the points that have other nodes to carry them by.
        found.carriers = carriers_of(step, &found.light);
        found.coupling = found.couplings(world, mesh, step).into_flattened();
        halo.forward(world, &mut found.coupling, 1)?;
        for (light, coupling) in found.light.iter_mut().zip(&found.coupling) {
            *light &= *coupling > 0.0;
        }
        // Nodes that nothing carries are light no more.
        found.carriers = carriers_of(step, &found.light);
        let mut sums: Vec<[f64; 1]> = mass.iter().map(|m| [*m]).collect();
        found.hand_on(world, mesh, step, &mut sums, &[])?;
        *mass = sums.into_flattened();
        Ok(Some(found))
    }

    /// Hands the `sums` at the owned light nodes on to the nodes that carry them, but for `held`
    /// components (none where empty), which keep theirs. Collective.
    pub fn hand_on<const D: usize, const B: usize>(
        &self,
        world: &World,
        mesh: &Discretisation<D>,
        step: StepPoints<'_, D>,
        sums: &mut [[f64; B]],
        held: &[bool],
    ) -> Result<()> {
        let owned = mesh.numbering.owned;
        let mut share = vec![[0.0; B]; mesh.numbering.len()];
        for node in (0..owned).filter(|&node| self.light[node]) {
            for i in 0..B {
                if !held.get(node * B + i).copied().unwrap_or(false) {
                    share[node][i] = std::mem::take(&mut sums[node][i]) / self.coupling[node];
                }
            }
        }
        mesh.numbering.halo.forward(world, share.as_flattened_mut(), B)?;
        let [more] = over_points(world, mesh, |part, [more]: [&mut [[f64; B]]; 1]| {
            self.for_each_carrier(part, |p, carrying| {
                let mut taken = [0.0; B];
                for (node, coupling) in self.reach(step, p) {
                    for i in 0..B {
                        taken[i] += coupling * share[node][i];
                    }
                }
                let row = step.influences.row(p);
                for (&node, weight) in step.nodes_of(p).iter().zip(&step.influences.weights[row]) {
                    if !self.light[node as usize] {
                        for i in 0..B {
                            more[node as usize][i] += weight / carrying * taken[i];
                        }
                    }
                }
            });
        });
        for (sum, more) in sums[..owned].iter_mut().zip(&more) {
            for i in 0..B {
                sum[i] += more[i];
            }
        }
        Ok(())
    }

    /// Gives the light nodes their values of `nodal` (local; true at owned nodes), but for `held`
    /// components. Ghosts have values afterwards. Collective.
    pub fn carry<const D: usize>(
        &self,
        world: &World,
        mesh: &Discretisation<D>,
        step: StepPoints<'_, D>,
        nodal: &mut [f64],
        held: &[bool],
    ) -> Result<()> {
        let halo = &mesh.numbering.halo;
        halo.forward(world, nodal, D)?;
        let [sums] = over_points(world, mesh, |part, [sums]: [&mut [[f64; D]]; 1]| {
            self.for_each_carrier(part, |p, carrying| {
                let mut value = [0.0; D];
                let row = step.influences.row(p);
                for (&node, weight) in step.nodes_of(p).iter().zip(&step.influences.weights[row]) {
                    let node = node as usize;
                    if !self.light[node] {
                        for i in 0..D {
                            value[i] += weight / carrying * nodal[node * D + i];
                        }
                    }
                }
                for (node, coupling) in self.reach(step, p) {
                    for i in 0..D {
                        sums[node][i] += coupling * value[i];
                    }
                }
            });
        });
        for node in (0..mesh.numbering.owned).filter(|&node| self.light[node]) {
            for i in 0..D {
                if !held[node * D + i] {
                    nodal[node * D + i] = sums[node][i] / self.coupling[node];
                }
            }
        }
        halo.forward(world, nodal, D)
    }

    /// Σ_p g_Ip over the carriers, at owned light nodes. Collective.
    fn couplings<const D: usize>(
        &self,
        world: &World,
        mesh: &Discretisation<D>,
        step: StepPoints<'_, D>,
    ) -> Vec<[f64; 1]> {
        let [coupling] = over_points(world, mesh, |part, [coupling]: [&mut [[f64; 1]]; 1]| {
            self.for_each_carrier(part, |p, _| {
                self.reach(step, p).for_each(|(node, g)| coupling[node][0] += g);
            });
        });
        coupling
    }

    /// Calls `visit` with the carriers among `part` and the weight of their other nodes.
    fn for_each_carrier(&self, part: Range<usize>, mut visit: impl FnMut(usize, f64)) {
        let start = self.carriers.partition_point(|&(p, _)| p < part.start);
        let carriers = self.carriers[start..].iter().take_while(|&&(p, _)| p < part.end);
        carriers.for_each(|&(p, carrying)| visit(p, carrying));
    }

    /// (local node, g_Ip) of the light nodes of a point.
    fn reach<'a, const D: usize>(
        &'a self,
        step: StepPoints<'a, D>,
        p: usize,
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        let (mass, size) = (step.points.mass[p], self.size);
        let row = step.influences.row(p);
        let weights = step.influences.weights[row.clone()].iter();
        let entries = weights.zip(&step.influences.gradients[row]);
        let all = step.nodes_of(p).iter().zip(entries);
        all.filter(|(node, _)| self.light[**node as usize]).map(
            move |(&node, (weight, gradient))| {
                let slope = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
                (node as usize, mass * (weight.abs() + size * slope))
            },
        )
    }
}

/// Points that reach a marked node, ascending.
fn reaching<'a, const D: usize>(
    step: StepPoints<'a, D>,
    marked: &[bool],
) -> impl Iterator<Item = usize> + 'a {
    let reaches = |group| step.nodes_of_group(group).iter().any(|&node| marked[node as usize]);
    let groups: Vec<bool> = (0..step.groups.len()).map(reaches).collect();
    (0..step.points.len()).filter(move |&p| groups[step.groups.group_of_point[p]])
}

/// Points that reach light nodes and have others, ascending, with the weight of the others.
fn carriers_of<const D: usize>(step: StepPoints<'_, D>, light: &[bool]) -> Vec<(usize, f64)> {
    let carrying = |p: usize| {
        let weights = &step.influences.weights[step.influences.row(p)];
        let nodes = step.nodes_of(p).iter().zip(weights);
        let others = nodes.filter(|(node, _)| !light[**node as usize]);
        (p, others.map(|(_, weight)| weight).sum::<f64>())
    };
    reaching(step, light).map(carrying).filter(|(_, carrying)| *carrying > ENOUGH).collect()
}
