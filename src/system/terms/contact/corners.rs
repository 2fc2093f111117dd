//! The corners of the points' domains that may touch a rigid surface in a step, and the nodes that move them.

use std::ops::Range;
use std::sync::Arc;

use crate::basis::Domain;
use crate::contact::Pair;
use crate::contact::corner::{self, DomainCorners};
use crate::contact::free::FreeBody;
use crate::contact::law::Reached;
use crate::contact::pose::Pose;
use crate::deck::model::{AnalysisType, Basis};
use crate::grid::Grid;
use crate::grid::bins::REACH;
use crate::points::Points;
use crate::system::conditions::StepSpan;
use crate::system::model::Model;
use crate::system::step_system::Discretisation;

use super::far::Far;
use super::{Candidate, ContactTerm};

/// Cells within which a corner may come to a surface in an implicit step.
const MARGIN: f64 = 2.0;
/// Cells within which a corner may come to a surface in an explicit step: waves pass at most one cell in it, points
/// far less.
const MARGIN_EXPLICIT: f64 = 0.25;
/// Of a length.
const ROUND_OFF: f64 = 1.0 + 1e-12;

impl<const D: usize> ContactTerm<D> {
    /// `None` where the deck has no contact. `free`: the rigid bodies that move freely, at the step's
    /// start; empty for none.
    pub fn new(
        model: &Model<D>,
        mesh: &Discretisation<D>,
        points: &Points<D>,
        span: StepSpan,
        free: &[Option<FreeBody<D>>],
    ) -> Option<Self> {
        let contacts = &model.contacts;
        if contacts.is_empty() {
            return None;
        }
        let [start, end] = [span.start(), span.end()];
        let explicit = model.deck.analysis.kind == AnalysisType::Explicit;
        let cells = if explicit { MARGIN_EXPLICIT } else { MARGIN };
        let mut term = ContactTerm {
            margin: cells * model.grid.cell_size(),
            explicit,
            contacts: Arc::clone(contacts),
            cell: model.grid.cell_size(),
            poses: [contacts.poses(start), contacts.poses(end)],
            shares: contacts
                .pairs
                .iter()
                .map(|pair| [start, end].map(|when| pair.presence.share(when)))
                .collect(),
            candidates: Vec::new(),
            reaching: 0,
            nodes: Vec::new(),
            weights: Vec::new(),
        };
        for (rigid, body) in free.iter().enumerate() {
            let Some(body) = body else { continue };
            if !contacts.rigids[rigid].presence.is_in(span.stage) {
                continue;
            }
            let mut on = body.clone();
            on.advance(&[0.0; D], &[0.0; 3], &[0.0; D], span.time_end - span.time_start);
            (term.poses[0][rigid], term.poses[1][rigid]) = (body.pose, on.pose);
        }
        for (pair, of) in contacts.pairs.iter().enumerate() {
            if !of.presence.is_in(span.stage) {
                continue;
            }
            let surface = &*contacts.rigids[of.rigid].surface;
            let mut far = Far::new(surface, term.looked_at(of.rigid).collect(), term.cell);
            for p in (0..points.len()).filter(|&p| points.body[p] as usize == of.body) {
                let x = &points.position[p];
                if far.beyond(x, term.reach(&points.half_length[p])) {
                    continue;
                }
                let basis = model.deck.method.basis;
                if term.may_touch(of, x, term.narrow_reach(basis, points, p)) {
                    term.add_corners(model, mesh, points, (pair, of), p);
                }
            }
        }
        let owned = mesh.numbering.owned;
        let nodes = &term.nodes;
        let reaches = |candidate: &Candidate<D>| {
            nodes[candidate.entries.clone()].iter().any(|&node| node as usize >= owned)
        };
        term.reaching = term.candidates.iter().filter(|of| reaches(of)).count();
        if term.reaching > 0 {
            term.candidates.sort_by_cached_key(|candidate| !reaches(candidate));
        }
        Some(term)
    }

    /// Of the surface from the point within which a domain may come to it in the step, m.
    fn reach(&self, half: &[f64; D]) -> f64 {
        // A domain that turns or shears reaches further than its half lengths.
        2.0 * half.iter().sum::<f64>() + self.margin
    }

    /// [`Self::reach`], and less where it is known how far the corners of the domain are.
    fn narrow_reach(&self, basis: Basis, points: &Points<D>, p: usize) -> f64 {
        match (self.explicit, basis.domain()) {
            (true, Domain::Box) => ROUND_OFF * corner::farthest(points, p) + self.margin,
            _ => self.reach(&points.half_length[p]),
        }
    }

    /// Of a rigid body at the moments that count for where corners are looked for.
    fn looked_at(&self, rigid: usize) -> impl Iterator<Item = Pose<D>> + Clone {
        let moments = if self.explicit { 1 } else { 2 };
        self.poses.iter().take(moments).map(move |poses| poses[rigid])
    }

    /// Whether the domain of a point may come to the surface in the step.
    fn may_touch(&self, pair: &Pair, x: &[f64; D], reach: f64) -> bool {
        let surface = &self.contacts.rigids[pair.rigid].surface;
        let (low, high) = surface.bounds();
        self.looked_at(pair.rigid).any(|pose| {
            let place = pose.to_body(x);
            let inside = |a: usize| place[a] >= low[a] - reach && place[a] <= high[a] + reach;
            (0..D).all(inside) && surface.near(&place).gap <= reach
        })
    }

    fn add_corners(
        &mut self,
        model: &Model<D>,
        mesh: &Discretisation<D>,
        points: &Points<D>,
        (pair, of): (usize, &Pair),
        p: usize,
    ) {
        let basis = model.deck.method.basis;
        let corners = DomainCorners::of(basis, self.contacts.rings, points, p);
        let first = self.contacts.slot_of(pair, corners.count);
        let contacts = Arc::clone(&self.contacts);
        let surface = &*contacts.rigids[of.rigid].surface;
        for (corner, place) in corners.positions.iter().take(corners.count).enumerate() {
            let near = self.poses[0][of.rigid].near(surface, place);
            if self.explicit && near.gap > self.margin {
                continue;
            }
            let entries = self.interpolate(&model.grid, basis, mesh, points, p, place);
            let slot = first + corner * D;
            let pose = &self.poses[0][of.rigid];
            let mut slip = [0.0; D];
            if of.law.has_history() {
                let row = points.slip.of(p, points.body[p]);
                slip = std::array::from_fn(|i| row[slot + i]);
            }
            // The slip that the step before has left, within what the pressure now allows.
            let reached = Reached { near, gap_before: 0.0, slip: pose.vector_to_space(&slip) };
            let share = self.shares[pair][0];
            let first =
                self.touches(&near).then(|| (near.gap, of.law.respond(&reached).scaled(share)));
            let elastic = first
                .as_ref()
                .map_or([0.0; D], |(_, first)| pose.vector_to_body(&first.elastic_slip));
            self.candidates.push(Candidate {
                pair,
                point: p,
                slot,
                place: *place,
                area: corners.area(corner, &near.normal),
                gap: near.gap,
                first,
                elastic,
                entries,
            });
        }
    }

    /// Nodes that move a corner, and their weights.
    fn interpolate(
        &mut self,
        grid: &Grid<D>,
        basis: Basis,
        mesh: &Discretisation<D>,
        points: &Points<D>,
        p: usize,
        place: &[f64; D],
    ) -> Range<usize> {
        let start = self.nodes.len();
        let x = &points.position[p];
        let values = match basis.domain() {
            Domain::None => None,
            Domain::Box => {
                // A tilted corner may leave the cells of its point: their functions go on beyond them.
                let half = &points.half_length[p];
                let held: [f64; D] =
                    std::array::from_fn(|a| place[a].clamp(x[a] - half[a], x[a] + half[a]));
                grid.values_continued(place, &held, x, REACH)
            }
            _ => grid.values_towards(place, x, REACH, None),
        };
        let group = mesh.groups.group_of_point[p];
        let nodes = mesh.groups.node_offsets[group]..mesh.groups.node_offsets[group + 1];
        let nodes = &mesh.group_nodes[nodes];
        if let Some(values) = values {
            for (&node, &weight) in values.nodes.iter().zip(&values.weights).take(values.count) {
                // A node that is none of the point's has no weight but for round-off.
                let local = mesh.numbering.local_of(points.body[p] as usize, node);
                if let Some(local) = local.map(|local| local as u32)
                    && nodes.contains(&local)
                {
                    self.nodes.push(local);
                    self.weights.push(weight);
                }
            }
        } else {
            self.nodes.extend_from_slice(nodes);
            self.weights.extend_from_slice(&mesh.influences.weights[mesh.influences.row(p)]);
        }
        start..self.nodes.len()
    }
}
