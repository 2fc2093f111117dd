//! Contact of two bodies in implicit steps: a pressure p = -ε g pushes each element of either surface off
//! the other body where its gap g is negative ([`crate::system::facing`]). The nodes of both carriers take
//! it with the weights W = (w, -v), so that the forces on the bodies are opposite:
//!
//! f_a = -p A W_a n, K_ab = ε A W_a W_b n n.

use std::sync::Arc;

use crate::contact::Contacts;
use crate::contact::told::{SLIDES, Told};
use crate::points::Points;
use crate::system::border::Border;
use crate::system::facing::{Couple, DEEPEST};
use crate::system::in_place::InPlace;
use crate::system::model::Model;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockRows;
use crate::system::step_system::Discretisation;
use crate::system::terms::touching::Met;
use crate::tensor::dense::dot;

use super::block::add_block;
use super::contact::TOUCH;
use super::term::{At, Health, Part, Term};

/// The elements that face another body in one step.
pub struct FacingTerm<'a, const D: usize> {
    contacts: Arc<Contacts<D>>,
    couples: &'a [Couple<D>],
    pattern: &'a Pattern,
    /// Supports of the pattern before theirs.
    before: usize,
    /// m
    cell: f64,
    border: Border,
}

impl<'a, const D: usize> FacingTerm<'a, D> {
    /// `None` where no two bodies touch each other in implicit steps.
    pub fn new(model: &Model<D>, mesh: &'a Discretisation<D>) -> Option<Self> {
        if model.facing.is_empty() {
            return None;
        }
        let (couples, pattern) = (&mesh.facing[..], &mesh.pattern);
        let before = mesh.groups.len() + mesh.faces.len();
        let border = Border::new((0..couples.len()).map(|k| {
            let nodes = pattern.supports.list(before + k);
            nodes.iter().any(|&node| node as usize >= mesh.numbering.owned)
        }));
        let (contacts, cell) = (Arc::clone(&model.contacts), model.grid.cell_size());
        Some(FacingTerm { contacts, couples, pattern, before, cell, border })
    }

    fn nodes(&self, k: usize) -> &'a [u32] {
        self.pattern.supports.list(self.before + k)
    }

    fn gap(&self, k: usize, displacement: &[f64]) -> f64 {
        let of = &self.couples[k];
        let moved = self.nodes(k).iter().zip(&of.weights).map(|(&node, weight)| {
            let first = node as usize * D;
            let along: f64 = (0..D).map(|i| of.normal[i] * displacement[first + i]).sum();
            weight * along
        });
        of.gap + moved.sum::<f64>()
    }

    /// ε A, N/m.
    fn stiffness(&self, k: usize) -> f64 {
        let of = &self.couples[k];
        self.contacts.body_pairs[of.pair].penalty * of.area
    }

    /// p A at a gap, N; `None` where nothing touches.
    fn push(&self, k: usize, gap: f64) -> Option<f64> {
        (gap <= TOUCH * self.cell).then(|| -self.stiffness(k) * gap)
    }

    /// Adds W n times `push` = p A of one element.
    fn add_push(&self, k: usize, push: f64, force: &mut [f64]) {
        let of = &self.couples[k];
        for (&node, weight) in self.nodes(k).iter().zip(&of.weights) {
            for i in 0..D {
                force[node as usize * D + i] += push * weight * of.normal[i];
            }
        }
    }

    /// Adds this rank's shares of the force at the step's start at its local nodes, N.
    pub fn add_force_at_start(&self, force: &mut [f64]) {
        for (k, of) in self.couples.iter().enumerate() {
            if let Some(push) = self.push(k, of.gap) {
                self.add_push(k, push, force);
            }
        }
    }

    /// Adds this rank's shares of the negative force at an iterate, and its tangent where there are
    /// `rows`.
    pub fn add<R: BlockRows<D>>(
        &self,
        part: Part,
        at: At<'_>,
        force: &mut [f64],
        mut rows: Option<&mut R>,
    ) {
        let couples = match part {
            Part::Reaching => &self.border.reaching,
            Part::Inner => &self.border.inner,
        };
        let mut block = Vec::new();
        for k in couples.iter().cloned().flatten() {
            let Some(push) = self.push(k, self.gap(k, at.displacement)) else { continue };
            self.add_push(k, -push, force);
            let Some(rows) = rows.as_deref_mut() else { continue };
            let (of, stiffness) = (&self.couples[k], self.stiffness(k));
            block.clear();
            for of_a in &of.weights {
                for n in &of.normal {
                    let row = stiffness * of_a * n;
                    let entries =
                        of.weights.iter().flat_map(|of_b| of.normal.map(|m| row * of_b * m));
                    block.extend(entries);
                }
            }
            add_block(at.pattern, self.before + k, self.nodes(k), &block, rows);
        }
    }

    /// Where the nodal increments bring two bodies deeper into each other than can be told apart from
    /// the sides of a thin body.
    pub fn too_deep(&self, points: &Points<D>, displacement: &[f64]) -> Option<String> {
        let gaps = (0..self.couples.len()).map(|k| (k, self.gap(k, displacement)));
        let (k, gap) = gaps.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let of = &self.couples[k];
        (gap < -DEEPEST * self.cell).then(|| {
            format!(
                "the bodies of a contact would be {:.2e} m deep in each other at {:?} (point {}), more \
                 than half a cell",
                -gap, of.place, points.id[of.point]
            )
        })
    }

    /// What a step leaves of each pair, this rank's share, and what the points are told. `shares` of the
    /// forces at both ends in those that acted over the step.
    pub fn finish(&self, displacement: &[f64], shares: [f64; 2]) -> (Vec<Met>, Vec<Told<D>>) {
        let pairs = self.contacts.body_pairs.iter();
        let mut met: Vec<Met> = pairs.map(|pair| Met::of(pair.index)).collect();
        let mut told = Vec::new();
        for (k, of) in self.couples.iter().enumerate() {
            let gap = self.gap(k, displacement);
            let (start, end) = (self.push(k, of.gap), self.push(k, gap));
            let done = &mut met[of.pair];
            let sign = if of.of_second { 1.0 } else { -1.0 };
            let mean = shares[0] * start.unwrap_or(0.0) + shares[1] * end.unwrap_or(0.0);
            for (sum, n) in done.force.iter_mut().zip(&of.normal) {
                *sum += sign * mean * n;
            }
            let Some(push) = end else { continue };
            done.area += of.area;
            done.depth = done.depth.max(-gap);
            done.energy -= 0.5 * push * gap;
            if self.contacts.tells {
                // Its whole area, as the other half is that of the other body's elements.
                let force = of.normal.map(|n| 2.0 * push * n);
                let gap = gap.min(0.0);
                told.push(Told { point: of.point, force, gap, slid: 0.0, status: SLIDES });
            }
        }
        (met, told)
    }
}

impl<const D: usize> Term<D> for &FacingTerm<'_, D> {
    fn add_shares(
        &self,
        part: Part,
        at: At<'_>,
        force: &mut [f64],
        rows: Option<&mut InPlace<'_, D>>,
    ) -> Health {
        self.add(part, at, force, rows);
        Health::default()
    }

    /// Of either body what the other one exerts.
    fn squared_actions(&self, at: At<'_>) -> f64 {
        let pushes =
            (0..self.couples.len()).filter_map(|k| self.push(k, self.gap(k, at.displacement)));
        pushes.map(|push| push * push).sum()
    }

    fn add_penalties(&self, at: At<'_>, stiffness: &mut [f64]) {
        for (k, of) in self.couples.iter().enumerate() {
            if self.push(k, self.gap(k, at.displacement)).is_some() {
                let penalty = self.stiffness(k);
                for (&node, w) in self.nodes(k).iter().zip(&of.weights) {
                    stiffness[node as usize] += penalty * w * w;
                }
            }
        }
    }

    /// A gap carries the round-off of the places.
    fn add_share_sizes(&self, _at: At<'_>, size: &mut [f64]) {
        for (k, of) in self.couples.iter().enumerate() {
            let force = self.stiffness(k) * dot(&of.place, &of.place).sqrt();
            for (&node, weight) in self.nodes(k).iter().zip(&of.weights) {
                size[node as usize] += weight.abs() * force;
            }
        }
    }
}
