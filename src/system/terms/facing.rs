//! Contact of two bodies in implicit steps: a pressure p = -ε g pushes each element of either surface off
//! the other body where its gap g is negative ([`crate::system::facing`]), and friction t resists its way
//! along it ([`crate::contact::law`], with the slip Σ W_a u_a of the step). The nodes of both carriers take
//! the traction p n - t with the weights W = (w, -v), so that the forces on the bodies are opposite:
//!
//! f_a = -A W_a (p n - t), K_ab = A W_a W_b S, S = -d(p n - t)/dx.
//!
//! Elastic slip s is kept with the carrier as F^-1 s: it turns and stretches with the surface on which it
//! lies. n is that of the step's start, and so is the frame in which the slip of a step is found.

use std::sync::Arc;

use crate::contact::Contacts;
use crate::contact::Near;
use crate::contact::law::{Friction, Law, Reached, Response};
use crate::contact::point_state::{ContactState, SLIDES, STICKS};
use crate::contact::surface::length;
use crate::points::Points;
use crate::system::border::Border;
use crate::system::facing::{Couple, DEEPEST};
use crate::system::in_place::InPlace;
use crate::system::model::Model;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockRows;
use crate::system::step_system::Discretisation;
use crate::system::terms::touching::{Met, OfBodies, STILL};
use crate::tensor::dense::{apply, block, dot, inverse};

use super::block::add_block;
use super::contact::{TOUCH, coupling};
use super::term::{At, Correction, Health, Part, Term};

/// The elements that face another body in one step.
pub struct FacingTerm<'a, const D: usize> {
    contacts: Arc<Contacts<D>>,
    couples: &'a [Couple<D>],
    /// Elastic slip at the step's start, and what acts then; `None` where nothing touches.
    starts: Vec<Start<D>>,
    pattern: &'a Pattern,
    /// Supports of the pattern before theirs.
    before: usize,
    /// m
    cell: f64,
    border: Border,
}

/// Of one element.
struct Start<const D: usize> {
    /// First word of its elastic slip in the row of its carrier.
    slot: usize,
    /// Elastic slip, m.
    elastic: [f64; D],
    response: Option<Response<D>>,
}

impl<'a, const D: usize> FacingTerm<'a, D> {
    /// `None` where no two bodies touch each other in implicit steps.
    pub fn new(model: &Model<D>, mesh: &'a Discretisation<D>, points: &Points<D>) -> Option<Self> {
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
        let starts = Vec::with_capacity(couples.len());
        let mut term = FacingTerm { contacts, couples, starts, pattern, before, cell, border };
        for of in couples {
            let slot = model.slip_slot(of.pair, points.body[of.point] as usize, of.element);
            let mut slip = [0.0; D];
            if term.law(of).has_history() {
                let row = &points.slip.of(of.point, points.body[of.point])[slot..];
                let kept = std::array::from_fn(|i| row[i]);
                slip = apply(&block(&points.deformation_gradient[of.point]), &kept);
            }
            // What the step before has left, within what the pressure now allows.
            let response = term.respond(of, of.gap, 0.0, slip);
            let elastic = response.as_ref().map_or([0.0; D], |response| response.elastic_slip);
            term.starts.push(Start { slot, elastic, response });
        }
        Some(term)
    }

    fn nodes(&self, k: usize) -> &'a [u32] {
        self.pattern.supports.list(self.before + k)
    }

    fn law(&self, of: &Couple<D>) -> Law {
        let pair = &self.contacts.body_pairs[of.pair];
        Law { penalty: pair.penalty, friction: pair.friction }
    }

    /// What acts on an element at a gap, which was `gap_before`; `None` where it does not touch.
    fn respond(
        &self,
        of: &Couple<D>,
        gap: f64,
        gap_before: f64,
        slip: [f64; D],
    ) -> Option<Response<D>> {
        let near = Near { gap, normal: of.normal, curvature: [[0.0; D]; D] };
        let touches = gap <= TOUCH * self.cell;
        touches.then(|| self.law(of).respond(&Reached { near, gap_before, slip }))
    }

    /// The way Σ W_a u_a of an element against the other body, m.
    fn way(&self, k: usize, displacement: &[f64]) -> [f64; D] {
        let mut way = [0.0; D];
        for (&node, weight) in self.nodes(k).iter().zip(&self.couples[k].weights) {
            for (sum, u) in way.iter_mut().zip(&displacement[node as usize * D..]) {
                *sum += weight * u;
            }
        }
        way
    }

    fn gap(&self, k: usize, way: &[f64; D]) -> f64 {
        let of = &self.couples[k];
        of.gap + dot(&of.normal, way)
    }

    /// What acts on an element after the nodal increments, and its gap.
    fn at_end(&self, k: usize, displacement: &[f64]) -> (f64, Option<Response<D>>) {
        let (of, way) = (&self.couples[k], self.way(k, displacement));
        let gap = self.gap(k, &way);
        let start = &self.starts[k];
        let slip = std::array::from_fn(|i| start.elastic[i] + way[i]);
        // A gap of round-off is none: what touches at the start sticks from there.
        let gap_before = if start.response.is_some() { of.gap.min(0.0) } else { of.gap };
        (gap, self.respond(of, gap, gap_before, slip))
    }

    /// Adds `share` times the force on one element by W.
    fn add_force(&self, k: usize, response: &Response<D>, share: f64, force: &mut [f64]) {
        let of = &self.couples[k];
        for (&node, weight) in self.nodes(k).iter().zip(&of.weights) {
            for (f, t) in force[node as usize * D..].iter_mut().zip(&response.traction) {
                *f += share * of.area * weight * t;
            }
        }
    }

    /// Adds this rank's shares of the force at the step's start at its local nodes, N.
    pub fn add_force_at_start(&self, force: &mut [f64]) {
        for (k, start) in self.starts.iter().enumerate() {
            if let Some(response) = &start.response {
                self.add_force(k, response, 1.0, force);
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
        let couples = self.border.of(part);
        let mut block = Vec::new();
        for k in couples.iter().cloned().flatten() {
            let (_, Some(response)) = self.at_end(k, at.displacement) else { continue };
            self.add_force(k, &response, -1.0, force);
            let Some(rows) = rows.as_deref_mut() else { continue };
            let of = &self.couples[k];
            block.clear();
            for of_a in &of.weights {
                for line in &response.stiffness {
                    let row = line.map(|s| of.area * of_a * s);
                    block.extend(of.weights.iter().flat_map(|of_b| row.map(|s| s * of_b)));
                }
            }
            add_block(at.pattern, self.before + k, self.nodes(k), &block, rows);
        }
    }

    /// Where the nodal increments bring two bodies deeper into each other than can be told apart from
    /// the sides of a thin body.
    pub fn too_deep(&self, points: &Points<D>, displacement: &[f64]) -> Option<String> {
        let gaps = (0..self.couples.len()).map(|k| (k, self.gap(k, &self.way(k, displacement))));
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

    /// What a step leaves of each pair, this rank's share, and what the points, still those of its start, are
    /// to keep. `shares` of the forces at both ends in those that acted over the step.
    pub fn finish(
        &self,
        model: &Model<D>,
        points: &Points<D>,
        displacement: &[f64],
        shares: [f64; 2],
    ) -> (Vec<Met>, OfBodies<D>) {
        let pairs = self.contacts.body_pairs.iter();
        let mut met: Vec<Met> = pairs.map(|pair| Met::of(pair.index)).collect();
        let mut kept = OfBodies { states: Vec::new(), slips: self.no_slips(model, points) };
        for (k, of) in self.couples.iter().enumerate() {
            let (gap, end) = self.at_end(k, displacement);
            let start = &self.starts[k];
            let traction =
                |of: &Option<Response<D>>| of.as_ref().map_or([0.0; D], |of| of.traction);
            let ends = [traction(&start.response), traction(&end)];
            let (done, law) = (&mut met[of.pair], self.law(of));
            let sign = if of.of_second { 1.0 } else { -1.0 };
            for (i, sum) in done.force.iter_mut().enumerate().take(D) {
                *sum += sign * of.area * (shares[0] * ends[0][i] + shares[1] * ends[1][i]);
            }
            let Some(response) = end else { continue };
            let (held, slid) = (length(&response.elastic_slip), length(&response.sliding));
            let stiffness = law.penalty * of.area;
            done.area += of.area;
            done.slid += of.area * slid;
            done.depth = done.depth.max(-gap);
            done.energy += 0.5 * stiffness * (gap * gap + held * held);
            done.friction += stiffness * held * slid;
            if law.has_history() {
                // All of it: the pressure that the next step begins with may allow more.
                let whole: [f64; D] =
                    std::array::from_fn(|i| response.elastic_slip[i] + response.sliding[i]);
                let (back, _) = inverse::<D>(&block(&points.deformation_gradient[of.point]));
                kept.slips.push((of.point, start.slot, apply(&back, &whole)));
            }
            if self.contacts.keeps_state {
                // Its whole area, as the other half is that of the other body's elements.
                let force = response.traction.map(|t| 2.0 * of.area * t);
                let slides = slid > STILL * (held + gap.abs()) || law.friction == Friction::Smooth;
                let status = if slides { SLIDES } else { STICKS };
                kept.states.push(ContactState {
                    point: of.point,
                    force,
                    gap: gap.min(0.0),
                    slid,
                    status,
                });
            }
        }
        (met, kept)
    }

    /// Without slip: all elements whose slip points keep. Those that face nothing in a step forget theirs.
    fn no_slips(&self, model: &Model<D>, points: &Points<D>) -> Vec<(usize, usize, [f64; D])> {
        let mut none = Vec::new();
        for (index, pair) in self.contacts.body_pairs.iter().enumerate() {
            if pair.friction == Friction::Smooth {
                continue;
            }
            for p in (0..points.len()).filter(|&p| pair.bodies.contains(&(points.body[p] as usize)))
            {
                let body = points.body[p] as usize;
                let carried =
                    model.facing[body].as_ref().map_or(0, |s| s.carried_by(points.id[p]).len());
                none.extend((0..carried).map(|e| (p, model.slip_slot(index, body, e), [0.0; D])));
            }
        }
        none
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

    fn symmetric(&self) -> bool {
        self.contacts.symmetric()
    }

    /// Of either body what the other one exerts.
    fn squared_actions(&self, at: At<'_>) -> f64 {
        let squared = |k: usize| {
            let (_, response) = self.at_end(k, at.displacement);
            let traction = response.map_or([0.0; D], |response| response.traction);
            traction.iter().map(|t| (self.couples[k].area * t).powi(2)).sum::<f64>()
        };
        (0..self.couples.len()).map(squared).sum()
    }

    fn add_penalties(&self, at: At<'_>, stiffness: &mut [f64]) {
        for (k, of) in self.couples.iter().enumerate() {
            if self.at_end(k, at.displacement).1.is_some() {
                let penalty = self.law(of).penalty * of.area;
                for (&node, w) in self.nodes(k).iter().zip(&of.weights) {
                    stiffness[node as usize] += penalty * w * w;
                }
            }
        }
    }

    /// As of rigid surfaces: sliding couples the tangential force to the gap.
    fn correct_surrogate(&self, at: At<'_>, corrections: &mut Vec<Correction<D>>) {
        for (k, of) in self.couples.iter().enumerate() {
            if !self.law(of).has_history() {
                continue;
            }
            let (_, Some(response)) = self.at_end(k, at.displacement) else { continue };
            let coupling = coupling(&response.stiffness, &of.normal);
            for (&a, of_a) in self.nodes(k).iter().zip(&of.weights) {
                for (&b, of_b) in self.nodes(k).iter().zip(&of.weights) {
                    let factor = -of.area * of_a * of_b;
                    corrections.push((a, b, coupling.map(|row| row.map(|c| factor * c))));
                }
            }
        }
    }

    /// A gap carries the round-off of the places.
    fn add_share_sizes(&self, _at: At<'_>, size: &mut [f64]) {
        for (k, of) in self.couples.iter().enumerate() {
            let force = self.law(of).penalty * of.area * dot(&of.place, &of.place).sqrt();
            for (&node, weight) in self.nodes(k).iter().zip(&of.weights) {
                size[node as usize] += weight.abs() * force;
            }
        }
    }
}
