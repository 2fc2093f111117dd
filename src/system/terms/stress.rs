//! f_int = Σ_p ∇S^T T V and K = Σ_p ∇S^T A ∇S V (Lagrangian eq. 20-23, 27, 28), one dense block
//! per group of points that share their nodes. With axisymmetry the hoop joins: [`crate::mechanics::ring`].

use std::ops::Range;

use crate::deck::model::Frame;
use crate::material::local;
use crate::mechanics::{Contribution, Expansion, Increment, displacement_gradient, hoop_increment};
use crate::tensor::fused::{self, multiply_add};

use crate::system::cell_rows::CellRows;
use crate::system::in_place::InPlace;
use crate::system::kernel::Batch;
use crate::system::numbering::Numbering;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockRows;
use crate::system::step_points::StepPoints;

use super::point_response::{respond, respond_ring_shared, respond_shared};
use super::term::{At, Health, Part, Term};

/// The stress of the points as a term of the equations.
pub struct Stress<'a, const D: usize> {
    /// The points.
    pub step: StepPoints<'a, D>,
    /// The configuration that stresses and gradients refer to.
    pub frame: Frame,
    /// The equations are taken as symmetric.
    pub symmetric: bool,
    /// The tangents of all materials are symmetric.
    pub associated: bool,
}

impl<const D: usize> Term<D> for Stress<'_, D> {
    fn symmetric(&self) -> bool {
        self.symmetric
    }

    fn flows_unassociated(&self) -> bool {
        !self.associated
    }

    fn add_shares(
        &self,
        part: Part,
        at: At<'_>,
        force: &mut [f64],
        rows: Option<&mut InPlace<'_, D>>,
    ) -> Health {
        let which = self.step.border.of(part);
        assemble_groups(self.step, which, self.frame, at.pattern, at.displacement, force, rows)
    }

    /// A point's share at a node a is |∇S_a| V M (|b_e - 1| + Σ_b |u_b| |∇S_b|), M its modulus of
    /// pressure waves: a stress carries the round-off of the strain it was made from, and that the
    /// one of the displacements it is the difference of.
    fn add_share_sizes(&self, at: At<'_>, size: &mut [f64]) {
        let step = self.step;
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let moved: Vec<f64> = at.displacement.chunks_exact(D).map(norm).collect();
        for p in 0..step.points.len() {
            let points = step.points;
            let modulus =
                local(step.materials, points, p).model().wave_modulus(|| points.elastic_strain(p));
            let gradients = &step.influences.gradients[step.influences.row(p)];
            let around = step.nodes_of(p);
            let strain: f64 = around
                .iter()
                .zip(gradients)
                .map(|(&node, gradient)| moved[node as usize] * norm(gradient))
                .sum();
            let hoops = step.influences.hoop.get(step.influences.row(p)).unwrap_or_default();
            let turned: f64 =
                around.iter().zip(hoops).map(|(&node, hoop)| moved[node as usize] * hoop).sum();
            let strain = strain + turned + points.elastic_excess[p].norm();
            let force = modulus * strain * points.volume(p).abs();
            let cells = step.influences.centre_gradients.get(step.influences.row(p));
            for rows in [Some(gradients), cells].into_iter().flatten() {
                for (&node, gradient) in around.iter().zip(rows) {
                    size[node as usize] += force * norm(gradient);
                }
            }
            for (&node, hoop) in around.iter().zip(hoops) {
                size[node as usize] += force * hoop;
            }
        }
    }
}

/// Internal force at the local nodes (ghost shares included, not yet sent) and, if `stiffness`
/// is given, the tangent added into it, for the nodal increments `displacement` (local).
///
/// `step.groups` are the first supports of `pattern`, in its order. Sums are rounded as the
/// processor's instruction set allows, in the same order on every call.
pub fn assemble<const D: usize, R: BlockRows<D>>(
    step: StepPoints<'_, D>,
    frame: Frame,
    numbering: &Numbering,
    pattern: &Pattern,
    displacement: &[f64],
    force: &mut [f64],
    mut stiffness: Option<&mut R>,
) -> Health {
    debug_assert!(numbering.len() * D <= force.len());
    let mut health = Health::default();
    for part in [&step.border.reaching, &step.border.inner] {
        let rows = stiffness.as_deref_mut();
        health = health.and(assemble_groups(step, part, frame, pattern, displacement, force, rows));
    }
    health
}

/// [`assemble`] of some groups.
pub fn assemble_groups<const D: usize, R: BlockRows<D>>(
    step: StepPoints<'_, D>,
    which: &[Range<usize>],
    frame: Frame,
    pattern: &Pattern,
    displacement: &[f64],
    force: &mut [f64],
    stiffness: Option<&mut R>,
) -> Health {
    let task = Task { step, which, frame, pattern, displacement };
    // Two forms, so that F-bar costs the others nothing.
    let cells = !step.influences.centre_gradients.is_empty();
    #[cfg(target_arch = "x86_64")]
    if fused::has_avx2() {
        // SAFETY: the processor has just said that it knows the instructions.
        return unsafe {
            match cells {
                true => assemble_avx2::<D, true, R>(&task, force, stiffness),
                false => assemble_avx2::<D, false, R>(&task, force, stiffness),
            }
        };
    }
    match cells {
        true => task.assemble::<false, true, R>(force, stiffness),
        false => task.assemble::<false, false, R>(force, stiffness),
    }
}

/// [`Task::assemble`] compiled for AVX2 with fused multiply-add.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn assemble_avx2<const D: usize, const CELLS: bool, R: BlockRows<D>>(
    task: &Task<'_, D>,
    force: &mut [f64],
    stiffness: Option<&mut R>,
) -> Health {
    task.assemble::<true, CELLS, R>(force, stiffness)
}

/// What an evaluation reads.
struct Task<'a, const D: usize> {
    step: StepPoints<'a, D>,
    /// Groups.
    which: &'a [Range<usize>],
    frame: Frame,
    pattern: &'a Pattern,
    displacement: &'a [f64],
}

/// One group's arrays, reused from group to group.
struct Workspace<const D: usize> {
    displacement: Vec<[f64; D]>,
    force: Vec<[f64; D]>,
    gradients: Vec<[f64; D]>,
    /// Of rings: hoop rows in the frame.
    hoop: Vec<f64>,
    /// With F-bar
    cells: CellRows<D>,
    /// Address and width of each node's scalar rows.
    rows: Vec<(usize, usize)>,
    batch: Batch,
}

impl<const D: usize> Task<'_, D> {
    /// With F-bar where `CELLS`. Inlined into each form so that it is compiled for that form's instructions.
    #[inline(always)]
    fn assemble<const FUSED: bool, const CELLS: bool, R: BlockRows<D>>(
        &self,
        force: &mut [f64],
        mut stiffness: Option<&mut R>,
    ) -> Health {
        let mut health = Health::default();
        let mut work = Workspace {
            displacement: Vec::new(),
            force: Vec::new(),
            gradients: Vec::new(),
            hoop: Vec::new(),
            cells: CellRows::default(),
            rows: Vec::new(),
            batch: Batch::default(),
        };
        let groups = self.step.groups;
        for group in self.which.iter().cloned().flatten() {
            let range = groups.node_offsets[group]..groups.node_offsets[group + 1];
            let nodes = &self.step.group_nodes[range];
            work.displacement.clear();
            work.displacement.extend(nodes.iter().map(|&node| {
                let start = node as usize * D;
                std::array::from_fn(|i| self.displacement[start + i])
            }));
            work.force.clear();
            work.force.resize(nodes.len(), [0.0; D]);
            let rings = !self.step.influences.hoop.is_empty();
            work.batch.start::<D>(nodes.len(), rings, CELLS);
            work.cells.start();
            if let Some(matrix) = stiffness.as_deref_mut() {
                self.find_rows(nodes, matrix, &mut work.rows);
            }
            for &p in groups.points(group) {
                if CELLS {
                    self.enter_cells::<FUSED>(p, &mut work, stiffness.is_some());
                }
                self.add_point::<FUSED, CELLS>(p, &mut work, &mut health, stiffness.is_some());
                if work.batch.is_full() {
                    self.flush::<FUSED, R>(group, &mut work, stiffness.as_deref_mut());
                }
            }
            if CELLS {
                self.leave_cells::<FUSED>(&mut work, stiffness.is_some());
                for number in 0..work.cells.several.len() {
                    let Some(matrix) = stiffness.as_deref_mut() else { break };
                    if work.batch.is_full() {
                        self.flush::<FUSED, R>(group, &mut work, Some(matrix));
                    }
                    work.batch.push_cell::<D>(&work.cells.several[number]);
                }
            }
            self.flush::<FUSED, R>(group, &mut work, stiffness.as_deref_mut());
            for (&node, sum) in nodes.iter().zip(&work.force) {
                for i in 0..D {
                    force[node as usize * D + i] += sum[i];
                }
            }
        }
        health
    }

    #[inline(always)]
    fn find_rows<R: BlockRows<D>>(
        &self,
        nodes: &[u32],
        matrix: &mut R,
        rows: &mut Vec<(usize, usize)>,
    ) {
        let pattern = self.pattern;
        rows.clear();
        for &node in nodes {
            let row = pattern.row_of[node as usize] as usize;
            matrix.touch(pattern, row);
            let width = pattern.offsets[row + 1] - pattern.offsets[row];
            rows.push((matrix.start(pattern, row), D * width));
        }
    }

    #[inline(always)]
    fn flush<const FUSED: bool, R: BlockRows<D>>(
        &self,
        group: usize,
        work: &mut Workspace<D>,
        stiffness: Option<&mut R>,
    ) {
        let Some(matrix) = stiffness else { return };
        if !work.batch.is_empty() {
            work.batch.flush::<D, FUSED, R>(
                self.pattern.support_columns.of(group),
                &work.rows,
                matrix,
            );
        }
    }

    #[inline(always)]
    fn add_point<const FUSED: bool, const CELLS: bool>(
        &self,
        p: usize,
        work: &mut Workspace<D>,
        health: &mut Health,
        with_block: bool,
    ) {
        let step = self.step;
        let row = step.influences.row(p);
        let gradients = &step.influences.gradients[row.clone()];
        let increment = displacement_gradient(gradients, |a| work.displacement[a]);
        if !step.influences.hoop.is_empty() {
            return self.add_ring::<FUSED, CELLS>(p, &increment, work, health, with_block);
        }
        if CELLS {
            let common = work.cells.volume_change;
            let made = respond_shared(step, self.frame, p, &increment, common, health);
            let Some((contribution, share)) = made else { return };
            self.spread::<FUSED>(gradients, &contribution, work, with_block);
            work.hoop.clear();
            return self.hand_over::<FUSED>(&share, contribution.volume, work, with_block);
        }
        let Some(contribution) = respond(step, self.frame, p, &increment, health) else { return };
        self.spread::<FUSED>(gradients, &contribution, work, with_block);
    }

    /// [`Self::add_point`] with axisymmetry; `increment` is that of the section.
    fn add_ring<const FUSED: bool, const CELLS: bool>(
        &self,
        p: usize,
        increment: &[[f64; D]; D],
        work: &mut Workspace<D>,
        health: &mut Health,
        with_block: bool,
    ) {
        let (step, influences) = (self.step, self.step.influences);
        let row = influences.row(p);
        let gradients = &influences.gradients[row.clone()];
        let rows = &influences.hoop[row.clone()];
        let hoop = hoop_increment(rows, |a| work.displacement[a]);
        let increment = Increment { block: increment, hoop };
        let common = CELLS.then_some(work.cells.volume_change);
        let made = respond_ring_shared(step, self.frame, p, increment, common, health);
        let Some((contribution, hoop, share)) = made else { return };
        self.spread::<FUSED>(gradients, &contribution, work, with_block);
        let volume = contribution.volume;
        work.hoop.clear();
        work.hoop.extend(rows.iter().map(|row| row * hoop.map));
        for (row, force) in work.hoop.iter().zip(&mut work.force) {
            force[0] = multiply_add::<FUSED>(hoop.stress * volume, *row, force[0]);
        }
        if with_block {
            work.batch.push_hoop::<D, FUSED>(&work.hoop, &work.gradients, &hoop, volume);
        }
        if let Some(share) = &share {
            self.hand_over::<FUSED>(share, volume, work, with_block);
        }
    }

    /// With F-bar: sums for the cells of point `p`, after those of other cells have gone where they belong.
    #[inline(always)]
    fn enter_cells<const FUSED: bool>(&self, p: usize, work: &mut Workspace<D>, with_block: bool) {
        let influences = self.step.influences;
        let row = influences.row(p);
        if !work.cells.has(influences, &row) {
            self.leave_cells::<FUSED>(work, with_block);
            work.cells.enter(influences, p, &work.displacement);
        }
    }

    /// Adds what the last points have handed to their cells to the force and, with the block, to the tangent.
    #[inline(always)]
    fn leave_cells<const FUSED: bool>(&self, work: &mut Workspace<D>, with_block: bool) {
        if !work.cells.is_open() {
            return;
        }
        let pressure = work.cells.trace;
        for (row, force) in work.cells.expansion.iter().zip(&mut work.force) {
            for (sum, e) in force.iter_mut().zip(row) {
                *sum = multiply_add::<FUSED>(pressure, *e, *sum);
            }
        }
        if with_block {
            work.batch.push_cells::<D, FUSED>(&work.cells);
        }
        work.cells.leave();
    }

    /// Hands a point's part of F-bar to its cells.
    #[inline(always)]
    fn hand_over<const FUSED: bool>(
        &self,
        share: &Expansion<D>,
        volume: f64,
        work: &mut Workspace<D>,
        with_block: bool,
    ) {
        work.cells.add::<FUSED>((&work.gradients, &work.hoop), share, volume, with_block);
        if with_block {
            work.batch.push_share::<D, FUSED>(&work.cells.expansion, share, volume);
        }
    }

    /// Force and, with the block, the tangent A of a point.
    #[inline(always)]
    fn spread<const FUSED: bool>(
        &self,
        gradients: &[[f64; D]],
        contribution: &Contribution<D>,
        work: &mut Workspace<D>,
        with_block: bool,
    ) {
        let map = &contribution.gradient_map;
        let stress = contribution.stress.map(|row| row.map(|s| s * contribution.volume));
        work.gradients.clear();
        for (gradient, force) in gradients.iter().zip(&mut work.force) {
            let mut mapped = [0.0; D];
            for j in 0..D {
                for i in 0..D {
                    mapped[j] = multiply_add::<FUSED>(gradient[i], map[i][j], mapped[j]);
                }
            }
            for i in 0..D {
                for j in 0..D {
                    force[i] = multiply_add::<FUSED>(stress[i][j], mapped[j], force[i]);
                }
            }
            work.gradients.push(mapped);
        }
        if with_block {
            work.batch.push::<D, FUSED>(&work.gradients, contribution);
        }
    }
}
