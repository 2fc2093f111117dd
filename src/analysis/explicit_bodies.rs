//! Contact of two bodies in an explicit step: impulses at the nodes that their fields share, after all
//! other forces have acted (law: [`crate::contact::nodal`]).
//!
//! Fields of bodies that no contact names together leave the step with one velocity at the nodes they
//! share, so that they do not slip on each other.

use crate::contact::nodal::Exchange;
use crate::error::Result;
use crate::parallel::World;
use crate::points::Points;
use crate::record::contact::Met;
use crate::system::model::Model;
use crate::system::shared_nodes::{self, SharedNode};
use crate::system::step_system::Discretisation;
use crate::system::terms::contact::TOUCH;
use crate::tensor::dense::dot;

/// Passes over the pairs of fields at a node with more than two of them.
const PASSES: usize = 50;

/// What the step knows at its nodes.
pub(super) struct AtNodes<'a> {
    /// Of local nodes, kg.
    pub mass: &'a [f64],
    /// Held degrees of freedom.
    pub fixed: &'a [bool],
    /// At the step's start, m/s.
    pub velocity: &'a [f64],
    pub dt: f64,
}

/// Adds the impulses to the nodal acceleration and, as forces, to what has `pushed`; at owned nodes. One
/// [`Met`] for each pair of bodies, this rank's share. Collective.
pub(super) fn meet<const D: usize>(
    world: &World,
    model: &Model<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    at: &AtNodes<'_>,
    acceleration: &mut [f64],
    pushed: &mut [[f64; D]],
) -> Result<Vec<Met>> {
    let pairs = &model.contacts.body_pairs;
    let mut met: Vec<Met> = pairs.iter().map(|pair| Met::of(pair.index)).collect();
    for shared in shared_nodes::find(world, model, mesh, points, at.mass)? {
        let mut here = Here::new(model, at, &shared, acceleration);
        let unions = shared.fields.len() * (shared.fields.len() - 1) / 2;
        for _ in 0..if unions > 1 { PASSES } else { 1 } {
            here.exchange(&shared, &mut met);
        }
        for (one, (_, node)) in here.fields.iter().zip(&shared.fields) {
            for i in 0..D {
                pushed[*node][i] += one.impulse[i] / at.dt;
                acceleration[node * D + i] += one.compliance[i] * one.impulse[i] / at.dt;
            }
        }
    }
    Ok(met)
}

/// A field at a shared node.
struct Field<const D: usize> {
    /// At the step's start, m/s.
    start: [f64; D],
    /// At the step's end, m/s.
    velocity: [f64; D],
    /// 1/kg; zero where it is held.
    compliance: [f64; D],
    /// N s
    impulse: [f64; D],
}

/// A shared node while its fields exchange impulses.
struct Here<'a, const D: usize> {
    model: &'a Model<D>,
    dt: f64,
    /// As in [`SharedNode::fields`].
    fields: Vec<Field<D>>,
}

impl<'a, const D: usize> Here<'a, D> {
    fn new(
        model: &'a Model<D>,
        at: &AtNodes<'_>,
        shared: &SharedNode<D>,
        acceleration: &[f64],
    ) -> Self {
        let field = |&(_, node): &(usize, usize)| {
            let dof = |i: usize| node * D + i;
            Field {
                start: std::array::from_fn(|i| at.velocity[dof(i)]),
                velocity: std::array::from_fn(|i| {
                    at.velocity[dof(i)] + at.dt * acceleration[dof(i)]
                }),
                compliance: std::array::from_fn(|i| match at.fixed[dof(i)] {
                    true => 0.0,
                    false => 1.0 / at.mass[node],
                }),
                impulse: [0.0; D],
            }
        };
        Here { model, dt: at.dt, fields: shared.fields.iter().map(field).collect() }
    }

    /// Lets each two fields exchange their impulse once.
    fn exchange(&mut self, shared: &SharedNode<D>, met: &mut [Met]) {
        let contacts = &self.model.contacts;
        for a in 0..shared.fields.len() {
            for b in a + 1..shared.fields.len() {
                let both = [shared.fields[a].0, shared.fields[b].0];
                let named = contacts.body_pairs.iter().position(|pair| {
                    let own = pair.bodies.map(|body| contacts.fields.of_body(body));
                    own == both || own == [both[1], both[0]]
                });
                match named {
                    None => self.join(a, b),
                    Some(pair) => self.touch(shared, pair, [a, b], met),
                }
            }
        }
    }

    /// v_b - v_a, m/s, and what it gains per impulse, 1/kg.
    fn between(&self, a: usize, b: usize) -> ([f64; D], [f64; D]) {
        let (a, b) = (&self.fields[a], &self.fields[b]);
        let relative = std::array::from_fn(|i| b.velocity[i] - a.velocity[i]);
        (relative, std::array::from_fn(|i| a.compliance[i] + b.compliance[i]))
    }

    fn push(&mut self, a: usize, b: usize, impulse: &[f64; D]) {
        for (index, sign) in [(a, -1.0), (b, 1.0)] {
            let field = &mut self.fields[index];
            for i in 0..D {
                field.impulse[i] += sign * impulse[i];
                field.velocity[i] += sign * field.compliance[i] * impulse[i];
            }
        }
    }

    /// One velocity for both.
    fn join(&mut self, a: usize, b: usize) {
        let (relative, compliance) = self.between(a, b);
        let impulse = std::array::from_fn(|i| match compliance[i] {
            0.0 => 0.0,
            w => -relative[i] / w,
        });
        self.push(a, b, &impulse);
    }

    /// The law of a pair of bodies, in the fields `a` and `b`.
    fn touch(&mut self, shared: &SharedNode<D>, pair: usize, [a, b]: [usize; 2], met: &mut [Met]) {
        let Some((_, meeting)) = shared.meetings.iter().find(|(own, _)| *own == pair) else {
            return;
        };
        let contacts = &self.model.contacts;
        let of = &contacts.body_pairs[pair];
        let swapped = contacts.fields.of_body(of.bodies[0]) != shared.fields[a].0;
        let (first, second) = if swapped { (b, a) } else { (a, b) };
        let (relative, compliance) = self.between(first, second);
        let reach = (TOUCH * self.model.grid.cell_size(), self.dt);
        let Some(exchange) = meeting.exchange(of.friction, &relative, &compliance, reach) else {
            return;
        };
        self.push(first, second, &exchange.impulse);
        let Exchange { impulse, after } = &exchange;
        let [one, two] = [first, second].map(|k| self.fields[k].start);
        let start = std::array::from_fn(|i| two[i] - one[i]);
        let lost = exchange.dissipation(&start, &meeting.normal);
        let along = dot(after, &meeting.normal);
        let slip = (0..D).map(|i| (after[i] - along * meeting.normal[i]).powi(2)).sum::<f64>();
        let met = &mut met[pair];
        for (force, j) in met.force.iter_mut().zip(impulse) {
            *force += j / self.dt;
        }
        // Once for a node that is passed over many times.
        if met.last != Some(shared.fields[a].1) {
            met.last = Some(shared.fields[a].1);
            met.area += meeting.area;
            met.slid += meeting.area * self.dt * slip.sqrt();
            met.depth = met.depth.max(-meeting.gap);
        }
        met.friction += lost[0];
        met.impact += lost[1];
    }
}
