//! f_I = Σ_c A N_I(X_c) (p n - t): what rigid surfaces exert on the corners of the points' domains
//! (formulations.md B.5; the law: [`crate::contact::law`]), with the tangent of an iterate.
//!
//! A corner moves as the grid's own functions at its place say, x = X_c + Σ N_I(X_c) u_I. It lies in a
//! cell that its point populates, or beside it, where that cell's functions go on: its nodes are among
//! the point's, and the sparsity of the equations holds its blocks. A corner beyond the grid moves with
//! its point.

use std::ops::Range;
use std::sync::Arc;

use crate::basis::Domain;
use crate::contact::corner::DomainCorners;
use crate::contact::free::FreeBody;
use crate::contact::law::{Friction, Law, Reached, Response};
use crate::contact::pose::Pose;
use crate::contact::{Contacts, Near, Pair};
use crate::deck::model::{AnalysisType, Basis};
use crate::grid::Grid;
use crate::grid::bins::REACH;
use crate::points::Points;
use crate::system::conditions::StepSpan;
use crate::system::in_place::InPlace;
use crate::system::model::Model;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockRows;
use crate::system::step_system::Discretisation;
use crate::tensor::Square;
use crate::tensor::dense::dot;

use super::node_gaps::NodeGaps;
use super::term::{At, Correction, Health, Part, Term};
use super::touching::{Corner, Exerted, Finished};

/// Cells within which a corner may come to a surface in an implicit step.
const MARGIN: f64 = 2.0;
/// Cells within which a corner may come to a surface in an explicit step: waves pass at most one cell in it, points
/// far less.
const MARGIN_EXPLICIT: f64 = 0.25;
/// Cells from a surface within which a corner counts as touching it: what rests on a surface without
/// a load is held by it.
pub const TOUCH: f64 = 1e-9;

/// A corner near a rigid surface.
struct Candidate<const D: usize> {
    pair: usize,
    point: usize,
    /// First word of its elastic slip in the row of its point.
    slot: usize,
    /// X_c, m.
    place: [f64; D],
    /// m2 (m in 2D)
    area: f64,
    /// Gap at the step's start, m.
    gap: f64,
    /// What acts at the step's start, with the gap; `None` where it does not touch.
    first: Option<(f64, Response<D>)>,
    /// Elastic slip at the step's start, in the rigid body's frame, m.
    elastic: [f64; D],
    /// Its entries of `nodes` and `weights`.
    entries: Range<usize>,
}

/// The corners near rigid surfaces in one step.
pub struct ContactTerm<const D: usize> {
    contacts: Arc<Contacts<D>>,
    /// m
    cell: f64,
    /// Distance from a surface within which corners are looked at, m.
    margin: f64,
    /// The forces of the step's start act in it.
    explicit: bool,
    /// Of the rigid bodies at the step's start and at its end.
    poses: [Vec<Pose<D>>; 2],
    /// Of each pair's forces that are left at both: 1, and less where it goes.
    shares: Vec<[f64; 2]>,
    /// Those that reach nodes of other ranks come first.
    candidates: Vec<Candidate<D>>,
    reaching: usize,
    /// Local nodes.
    nodes: Vec<u32>,
    weights: Vec<f64>,
}

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
            let nodes = term.node_gaps(model, mesh, of);
            let step = mesh.step_points(points, &model.materials);
            for p in (0..points.len()).filter(|&p| points.body[p] as usize == of.body) {
                let (x, reach) = (&points.position[p], term.reach(&points.half_length[p]));
                let node = step.nodes_of(p).first();
                let far = node.is_some_and(|&node| nodes.beyond(node, x, reach));
                if !far && term.may_touch(of, x, reach) {
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

    /// Of a rigid body at the moments that count for where corners are looked for.
    fn looked_at(&self, rigid: usize) -> impl Iterator<Item = Pose<D>> + Clone {
        let moments = if self.explicit { 1 } else { 2 };
        self.poses.iter().take(moments).map(move |poses| poses[rigid])
    }

    fn node_gaps(&self, model: &Model<D>, mesh: &Discretisation<D>, pair: &Pair) -> NodeGaps<D> {
        let surface = &*self.contacts.rigids[pair.rigid].surface;
        NodeGaps::new(&model.grid, &mesh.numbering, surface, self.looked_at(pair.rigid))
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
                let cell = grid.values_towards(&held, x, REACH, None).map(|values| values.cell);
                cell.and_then(|cell| grid.interpolate_in(cell, place)).map(|at| at.values)
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

    /// Weights of a corner with their local nodes.
    fn entries(&self, of: &Candidate<D>) -> impl Iterator<Item = (usize, f64)> {
        let nodes = self.nodes[of.entries.clone()].iter().map(|&node| node as usize);
        nodes.zip(self.weights[of.entries.clone()].iter().copied())
    }

    /// x, m, for the nodal increments.
    fn position(&self, of: &Candidate<D>, displacement: &[f64]) -> [f64; D] {
        let mut x = of.place;
        for (node, weight) in self.entries(of) {
            for (x, u) in x.iter_mut().zip(&displacement[node * D..]) {
                *x += weight * u;
            }
        }
        x
    }

    fn law(&self, of: &Candidate<D>) -> Law {
        self.contacts.pairs[of.pair].law
    }

    fn touches(&self, near: &Near<D>) -> bool {
        near.gap <= TOUCH * self.cell
    }

    /// Elastic slip of the start and the motion against the surface in the step, in the rigid body's
    /// frame at the end, m.
    fn slip(&self, of: &Candidate<D>, x: &[f64; D]) -> [f64; D] {
        let rigid = self.contacts.pairs[of.pair].rigid;
        let from = self.poses[0][rigid].to_body(&of.place);
        let to = self.poses[1][rigid].to_body(x);
        std::array::from_fn(|i| of.elastic[i] + to[i] - from[i])
    }

    /// The surface below a corner at `x` at the step's end.
    fn near_at_end(&self, of: &Candidate<D>, x: &[f64; D]) -> Near<D> {
        let rigid = self.contacts.pairs[of.pair].rigid;
        self.poses[1][rigid].near(&*self.contacts.rigids[rigid].surface, x)
    }

    /// What acts on a corner at `x` at the step's end, and the gap there; `None` where it does not
    /// touch.
    fn respond(&self, of: &Candidate<D>, x: &[f64; D]) -> Option<(f64, Response<D>)> {
        let rigid = self.contacts.pairs[of.pair].rigid;
        let pose = &self.poses[1][rigid];
        let near = self.near_at_end(of, x);
        if !self.touches(&near) {
            return None;
        }
        let law = self.law(of);
        let slip = if law.has_history() { self.slip(of, x) } else { [0.0; D] };
        // A gap of round-off is none: what touches at the start sticks from there.
        let gap_before = if of.first.is_some() { of.gap.min(0.0) } else { of.gap };
        let reached = Reached { near, gap_before, slip: pose.vector_to_space(&slip) };
        Some((near.gap, law.respond(&reached).scaled(self.shares[of.pair][1])))
    }

    /// Adds this rank's shares of the force at the step's start at its local nodes, N.
    pub fn add_force_at_start(&self, force: &mut [f64]) {
        for of in &self.candidates {
            if let Some((_, response)) = &of.first {
                self.add_force_of(of, response, 1.0, force);
            }
        }
    }

    /// Adds `share` times the force on a corner.
    fn add_force_of(
        &self,
        of: &Candidate<D>,
        response: &Response<D>,
        share: f64,
        force: &mut [f64],
    ) {
        for (node, weight) in self.entries(of) {
            for (f, t) in force[node * D..].iter_mut().zip(&response.traction) {
                *f += share * weight * of.area * t;
            }
        }
    }

    fn of_part(&self, part: Part) -> &[Candidate<D>] {
        match part {
            Part::Reaching => &self.candidates[..self.reaching],
            Part::Inner => &self.candidates[self.reaching..],
        }
    }

    /// Adds N_a N_b `stiffness` A to the rows of a corner's nodes.
    fn add_block<R: BlockRows<D>>(
        &self,
        of: &Candidate<D>,
        stiffness: &Square<D>,
        pattern: &Pattern,
        rows: &mut R,
    ) {
        for (node, of_a) in self.entries(of) {
            let row = pattern.row_of[node] as usize;
            rows.touch(pattern, row);
            let columns = &pattern.columns[pattern.offsets[row]..pattern.offsets[row + 1]];
            let (width, start) = (D * columns.len(), rows.start(pattern, row));
            for (other, of_b) in self.entries(of) {
                let Some(at) = columns.iter().position(|&column| column as usize == other) else {
                    continue;
                };
                let factor = of.area * of_a * of_b;
                for (i, line) in stiffness.iter().enumerate() {
                    let target = rows.values(start + i * width + at * D, D);
                    for (value, k) in target.iter_mut().zip(line) {
                        *value += factor * k;
                    }
                }
            }
        }
    }

    /// Where the nodal increments bring a rigid surface more than a cell deep into a body of this rank.
    pub fn too_deep(&self, points: &Points<D>, displacement: &[f64]) -> Option<String> {
        let mut found = (self.cell, None);
        for of in &self.candidates {
            let x = self.position(of, displacement);
            if let Some((gap, _)) = self.respond(of, &x)
                && -gap > found.0
            {
                found = (-gap, Some((of, x)));
            }
        }
        let (depth, at) = found;
        at.map(|(of, x)| {
            let pair = &self.contacts.pairs[of.pair];
            format!(
                "contact \"{}\" would be {depth:.2e} m deep at {x:?} (point {}), more than a cell",
                pair.name, points.id[of.point]
            )
        })
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
        for of in self.of_part(part) {
            let x = self.position(of, at.displacement);
            let Some((_, response)) = self.respond(of, &x) else { continue };
            self.add_force_of(of, &response, -1.0, force);
            if let Some(rows) = rows.as_deref_mut() {
                self.add_block(of, &response.stiffness, at.pattern, rows);
            }
        }
    }

    /// What the rigid bodies exert at the step's start, this rank's share.
    pub fn exerted_at_start(&self) -> Vec<Exerted> {
        let mut all = vec![Exerted::default(); self.contacts.rigids.len()];
        for of in &self.candidates {
            if let Some((_, response)) = &of.first {
                let rigid = self.contacts.pairs[of.pair].rigid;
                let force = response.traction.map(|t| of.area * t);
                let pose = &self.poses[0][rigid];
                let centre = self.contacts.rigids[rigid].torque_centre(pose);
                all[rigid].add(&force, &of.place, &centre);
            }
        }
        all
    }

    /// Calls `visit` with the rigid body, the place and A times the stiffness of every corner that
    /// touches after the nodal increments `displacement`.
    pub fn each_stiffness(
        &self,
        displacement: &[f64],
        mut visit: impl FnMut(usize, [f64; D], Square<D>),
    ) {
        for of in &self.candidates {
            let x = self.position(of, displacement);
            if let Some((_, response)) = self.respond(of, &x) {
                let stiffness = response.stiffness.map(|row| row.map(|k| of.area * k));
                visit(self.contacts.pairs[of.pair].rigid, x, stiffness);
            }
        }
    }

    /// Where a rigid body is at the step's end.
    pub fn set_end(&mut self, rigid: usize, pose: Pose<D>) {
        self.poses[1][rigid] = pose;
    }

    /// What an implicit step leaves: the state at its end, and the forces and the work of the step.
    /// `shares` of the forces at both ends in those that acted over the step; positions are those of
    /// the nodal increments `displacement`.
    pub fn finish(&self, displacement: &[f64], shares: [f64; 2]) -> Finished<D> {
        let mut done = Finished::new(&self.contacts);
        for of in &self.candidates {
            let x = self.position(of, displacement);
            let last = self.respond(of, &x);
            let of_state = |state: &Option<(f64, Response<D>)>| {
                state.as_ref().map_or([0.0; D], |(_, response)| response.traction)
            };
            let ends = [of_state(&of.first), of_state(&last)];
            let mean = |shares: [f64; 2]| {
                std::array::from_fn(|i| of.area * (shares[0] * ends[0][i] + shares[1] * ends[1][i]))
            };
            let rigid = self.contacts.pairs[of.pair].rigid;
            done.work += dot(&mean([0.5; 2]), &self.carried(of, &x));
            let centre = self.contacts.rigids[rigid].torque_centre(&self.poses[1][rigid]);
            done.rigids[rigid].add(&mean(shares), &x, &centre);
            let mut slip = [0.0; D];
            if let Some((gap, response)) = &last {
                let share = self.shares[of.pair][1];
                done.add_state(self.place(of, share), self.law(of), *gap, response);
                // All of it: the pressure that the next step begins with may allow more.
                let whole = std::array::from_fn(|i| response.elastic_slip[i] + response.sliding[i]);
                slip = self.poses[1][rigid].vector_to_body(&whole);
            }
            done.keep((of.point, of.slot), self.law(of), slip);
        }
        done
    }

    /// What an explicit step leaves, in which the forces of its start act.
    pub fn finish_explicit(&self, displacement: &[f64]) -> Finished<D> {
        let mut done = Finished::new(&self.contacts);
        done.rigids = self.exerted_at_start();
        for of in &self.candidates {
            let (x, law) = (self.position(of, displacement), self.law(of));
            let mut slip = [0.0; D];
            if let Some((gap, response)) = &of.first {
                let force = response.traction.map(|t| of.area * t);
                done.work += dot(&force, &self.carried(of, &x));
                done.add_state(self.place(of, self.shares[of.pair][0]), law, *gap, response);
                slip = self.slip(of, &x);
            } else if matches!(law.friction, Friction::Coulomb { .. }) {
                // The way so far tells the direction of friction if it touches in the next step.
                slip = self.slip(of, &x);
            }
            done.keep((of.point, of.slot), law, slip);
        }
        done
    }

    /// A corner whose contact has `share` of its forces left.
    fn place(&self, of: &Candidate<D>, share: f64) -> Corner {
        Corner { pair: of.pair, point: of.point, area: of.area, share }
    }

    /// The way of the surface below a corner that comes to `x`, m.
    fn carried(&self, of: &Candidate<D>, x: &[f64; D]) -> [f64; D] {
        let rigid = self.contacts.pairs[of.pair].rigid;
        let from = self.poses[0][rigid].to_space(&self.poses[1][rigid].to_body(x));
        std::array::from_fn(|i| x[i] - from[i])
    }
}

impl<const D: usize> Term<D> for &ContactTerm<D> {
    fn symmetric(&self) -> bool {
        self.contacts.symmetric()
    }

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

    fn squared_actions(&self, at: At<'_>) -> f64 {
        let squared = |of: &Candidate<D>| {
            let x = self.position(of, at.displacement);
            let response = self.respond(of, &x);
            let traction = response.map_or([0.0; D], |(_, response)| response.traction);
            traction.iter().map(|t| (of.area * t) * (of.area * t)).sum::<f64>()
        };
        self.candidates.iter().map(squared).sum()
    }

    fn add_penalties(&self, at: At<'_>, stiffness: &mut [f64]) {
        for of in &self.candidates {
            if self.respond(of, &self.position(of, at.displacement)).is_some() {
                let penalty = self.law(of).penalty * of.area;
                self.entries(of).for_each(|(node, w)| stiffness[node] += penalty * w * w);
            }
        }
    }

    /// Sliding couples the tangential force to the gap, μ ε t n: the symmetric part of that has the
    /// eigenvalues ±μ ε / 2, and with them no cycle of multigrid is definite. It is taken away: with
    /// N = n n and T = 1 - N the stiffness S keeps N S N + T S T.
    fn correct_surrogate(&self, at: At<'_>, corrections: &mut Vec<Correction<D>>) {
        for of in &self.candidates {
            let x = self.position(of, at.displacement);
            let Some((_, response)) = self.respond(of, &x) else { continue };
            let n = self.near_at_end(of, &x).normal;
            let coupling = coupling(&response.stiffness, &n);
            for (a, of_a) in self.entries(of) {
                for (b, of_b) in self.entries(of) {
                    let factor = -of.area * of_a * of_b;
                    let block = coupling.map(|row| row.map(|c| factor * c));
                    corrections.push((a as u32, b as u32, block));
                }
            }
        }
    }

    /// A gap carries the round-off of the place.
    fn add_share_sizes(&self, at: At<'_>, size: &mut [f64]) {
        for of in &self.candidates {
            let x = self.position(of, at.displacement);
            let distance = x.iter().map(|x| x * x).sum::<f64>().sqrt();
            let force = self.law(of).penalty * of.area * distance;
            for (node, weight) in self.entries(of) {
                size[node] += weight.abs() * force;
            }
        }
    }
}

/// N S T + T S N of the symmetric part of a stiffness, N = n n and T = 1 - N.
pub(super) fn coupling<const D: usize>(stiffness: &Square<D>, n: &[f64; D]) -> Square<D> {
    let s: Square<D> =
        std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (stiffness[i][j] + stiffness[j][i])));
    let along: [f64; D] = std::array::from_fn(|i| dot(&s[i], n));
    let twice = 2.0 * dot(&along, n);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| n[i] * along[j] + along[i] * n[j] - twice * n[i] * n[j])
    })
}
