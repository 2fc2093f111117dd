//! f_int = Σ_p ∇S^T T V and K = Σ_p ∇S^T A ∇S V (Lagrangian eq. 20-23, 27, 28), one dense block
//! per group of points that share their nodes.

use crate::basis::{Groups, Influences};
use crate::deck::model::Frame;
use crate::error::Result;
use crate::material::Material;
use crate::mechanics::{self, StepStart};
use crate::points::Points;

use super::{BlockMatrix, Numbering, Pattern};

/// What a step's points look like to the equations: fixed while the step is solved.
#[derive(Clone, Copy)]
pub struct StepPoints<'a, const D: usize> {
    pub points: &'a Points<D>,
    /// One material per body.
    pub materials: &'a [Material],
    pub influences: &'a Influences<D>,
    pub groups: &'a Groups,
    /// Local node index of each entry of `groups.nodes`.
    pub group_nodes: &'a [u32],
}

impl<'a, const D: usize> StepPoints<'a, D> {
    /// Local nodes of a group of points.
    #[inline]
    pub fn nodes_of_group(&self, group: usize) -> &'a [u32] {
        let offsets = &self.groups.node_offsets;
        &self.group_nodes[offsets[group]..offsets[group + 1]]
    }

    /// Local nodes of point `p`, in the order of its influences.
    #[inline]
    pub fn nodes_of(&self, p: usize) -> &'a [u32] {
        self.nodes_of_group(self.groups.group_of_point[p])
    }
}

/// Health of an evaluation on this rank.
#[derive(Debug, Clone, Copy, Default)]
pub struct Health {
    /// Point index with det dF <= 0, if any.
    pub inverted: Option<usize>,
    /// Point index with a stress that is not finite, if any.
    pub not_finite: Option<usize>,
}

impl Health {
    pub fn is_sound(&self) -> bool {
        self.not_finite.is_none()
    }
}

/// Internal force at the local nodes (ghost shares included, not yet sent) and, if `stiffness`
/// is given, the tangent added into it, for the nodal increments `displacement` (local).
pub fn assemble<const D: usize>(
    step: StepPoints<'_, D>,
    frame: Frame,
    numbering: &Numbering,
    pattern: &Pattern,
    displacement: &[f64],
    force: &mut [f64],
    mut stiffness: Option<&mut BlockMatrix<D>>,
) -> Result<Health> {
    let mut health = Health::default();
    let mut work = Workspace::default();
    for group in 0..step.groups.len() {
        let range = step.groups.node_offsets[group]..step.groups.node_offsets[group + 1];
        let nodes = &step.group_nodes[range];
        work.reset(nodes.len(), D, stiffness.is_some());
        work.gather::<D>(nodes, displacement);
        for &p in step.groups.points(group) {
            add_point(step, frame, p, &mut work, &mut health, stiffness.is_some());
        }
        for (a, &node) in nodes.iter().enumerate() {
            for i in 0..D {
                force[node as usize * D + i] += work.force[a * D + i];
            }
        }
        if let Some(matrix) = stiffness.as_deref_mut() {
            matrix.add(numbering, pattern, nodes, &work.block);
        }
    }
    Ok(health)
}

/// Dense arrays of one group, reused from group to group.
#[derive(Default)]
struct Workspace {
    /// (node, component)
    displacement: Vec<f64>,
    force: Vec<f64>,
    /// (a, i, b, k), see [`BlockMatrix::add`].
    block: Vec<f64>,
    /// Gradients in the frame times one, (node, axis).
    gradient: Vec<f64>,
    /// t_ij(b, k) = A_ijkl g_bl V, one row per (i, j).
    flux: Vec<f64>,
}

impl Workspace {
    fn reset(&mut self, nodes: usize, dimension: usize, with_block: bool) {
        let size = nodes * dimension;
        self.displacement.clear();
        self.force.clear();
        self.force.resize(size, 0.0);
        self.gradient.clear();
        self.gradient.resize(size, 0.0);
        if with_block {
            self.block.clear();
            self.block.resize(size * size, 0.0);
            self.flux.clear();
            self.flux.resize(size * dimension * dimension, 0.0);
        }
    }

    fn gather<const D: usize>(&mut self, nodes: &[u32], displacement: &[f64]) {
        for &node in nodes {
            let start = node as usize * D;
            self.displacement.extend_from_slice(&displacement[start..start + D]);
        }
    }
}

/// dF = 1 + Σ_a u_a ⊗ dS_a/dX~ (Lagrangian eq. 7).
#[inline]
pub fn deformation_increment<const D: usize>(
    gradients: &[[f64; D]],
    displacement: impl Fn(usize) -> [f64; D],
) -> [[f64; D]; D] {
    let mut increment = [[0.0; D]; D];
    for (i, row) in increment.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for (a, gradient) in gradients.iter().enumerate() {
        let u = displacement(a);
        for i in 0..D {
            for j in 0..D {
                increment[i][j] += u[i] * gradient[j];
            }
        }
    }
    increment
}

#[inline]
fn add_point<const D: usize>(
    step: StepPoints<'_, D>,
    frame: Frame,
    p: usize,
    work: &mut Workspace,
    health: &mut Health,
    with_block: bool,
) {
    let row = step.influences.offsets[p]..step.influences.offsets[p + 1];
    let gradients = &step.influences.gradients[row];
    let displacement = &work.displacement;
    let increment =
        deformation_increment(gradients, |a| std::array::from_fn(|i| displacement[a * D + i]));
    let points = step.points;
    let start = StepStart {
        material: &step.materials[points.body[p] as usize],
        deformation_gradient: &points.deformation_gradient[p],
        elastic_left_cauchy_green: &points.elastic_left_cauchy_green[p],
        volume_initial: points.volume_initial[p],
    };
    let (contribution, state) = mechanics::contribution(frame, &start, &increment);
    if crate::tensor::dense::determinant(&increment) <= 0.0 {
        health.inverted.get_or_insert(p);
    }
    if !state.kirchhoff_stress.iter().all(|t| t.is_finite()) {
        health.not_finite.get_or_insert(p);
        return;
    }

    let count = gradients.len();
    let width = count * D;
    let map = &contribution.gradient_map;
    for (a, gradient) in gradients.iter().enumerate() {
        let mut mapped = [0.0; D];
        for j in 0..D {
            for i in 0..D {
                mapped[j] += gradient[i] * map[i][j];
            }
        }
        work.gradient[a * D..a * D + D].copy_from_slice(&mapped);
        for i in 0..D {
            let mut sum = 0.0;
            for j in 0..D {
                sum += contribution.stress[i][j] * mapped[j];
            }
            work.force[a * D + i] += sum * contribution.volume;
        }
    }
    if !with_block {
        return;
    }
    for i in 0..D {
        for j in 0..D {
            let target = &mut work.flux[(i * D + j) * width..(i * D + j + 1) * width];
            let tangent =
                contribution.tangent[i][j].map(|row| row.map(|v| v * contribution.volume));
            for b in 0..count {
                for k in 0..D {
                    let mut sum = 0.0;
                    for l in 0..D {
                        sum += tangent[k][l] * work.gradient[b * D + l];
                    }
                    target[b * D + k] = sum;
                }
            }
        }
    }
    for a in 0..count {
        for i in 0..D {
            let target = &mut work.block[(a * D + i) * width..(a * D + i + 1) * width];
            for j in 0..D {
                let factor = work.gradient[a * D + j];
                let source = &work.flux[(i * D + j) * width..(i * D + j + 1) * width];
                for (t, s) in target.iter_mut().zip(source) {
                    *t += factor * s;
                }
            }
        }
    }
}
