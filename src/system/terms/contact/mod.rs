//! f_I = Σ_c A N_I(X_c) (p n - t): what rigid surfaces exert on the corners of the points' domains
//! (formulations.md B.5; the law: [`crate::contact::law`]), with the tangent of an iterate.
//!
//! A corner moves as the grid's own functions at its place say, x = X_c + Σ N_I(X_c) u_I. It lies in a
//! cell that its point populates, or beside it, where that cell's functions go on: its nodes are among
//! the point's, and the sparsity of the equations holds its blocks. A corner beyond the grid moves with
//! its point.
//!
//! | file | idea |
//! |---|---|
//! | `mod.rs` | forces and tangent at an iterate |
//! | `corners.rs` | which corners may touch in a step, and what moves them |
//! | `far.rs` | which points are far from a surface |
//! | `records.rs` | what a step leaves |

mod corners;
mod far;
mod records;

use std::ops::Range;
use std::sync::Arc;

use crate::contact::law::{Law, Reached, Response};
use crate::contact::pose::Pose;
use crate::contact::{Contacts, Near};
use crate::system::in_place::InPlace;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockRows;
use crate::tensor::Square;
use crate::tensor::dense::dot;

use super::term::{At, Correction, Health, Part, Term};

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
