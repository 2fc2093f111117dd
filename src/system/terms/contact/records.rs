//! What contact leaves at the end of a step: forces on the rigid bodies, work, states of the corners, and whether a body went
//! too deep.

use crate::contact::law::{Friction, Response};
use crate::points::Points;
use crate::system::terms::touching::{Corner, Exerted, Finished};
use crate::tensor::dense::dot;

use super::{Candidate, ContactTerm};

impl<const D: usize> ContactTerm<D> {
    /// Where the nodal increments bring a rigid surface more than a cell deep into a body of this rank.
    pub fn too_deep(&self, points: &Points<D>, displacement: &[f64]) -> Option<String> {
        let mut found = (self.cell, None);
        for of in &self.candidates {
            let x = self.position(of, displacement);
            let depth = -self.near_at_end(of, &x).gap;
            if depth > found.0 {
                found = (depth, Some((of, x)));
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
            let mean: [f64; D] =
                std::array::from_fn(|i| of.area * (0.5 * ends[0][i] + 0.5 * ends[1][i]));
            let rigid = self.contacts.pairs[of.pair].rigid;
            done.work += dot(&mean, &self.carried(of, &x));
            // Each force about where the centre is when it acts: with one centre for both the normal
            // forces of a ball that rolls act half a step's way behind it, and speed it up.
            for (end, (place, share)) in [of.place, x].iter().zip(shares).enumerate() {
                let centre = self.contacts.rigids[rigid].torque_centre(&self.poses[end][rigid]);
                let force = ends[end].map(|t| of.area * (share * t));
                if share != 0.0 {
                    done.rigids[rigid].add(&force, place, &centre);
                }
            }
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
