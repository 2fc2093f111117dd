//! Contact of two bodies in an explicit step: impulses at the nodes that their fields share, after all
//! other forces have acted (law: [`crate::contact::nodal`]).
//!
//! Fields of bodies that no contact names together move as one at the nodes they share.

use crate::contact::nodal::{Exchange, Meeting};
use crate::contact::point_state::{self, ContactState};
use crate::error::Result;
use crate::parallel::World;
use crate::points::Points;
use crate::system::model::Model;
use crate::system::shared_nodes::SharedNode;
use crate::system::step_system::Discretisation;
use crate::system::terms::contact::TOUCH;
use crate::system::terms::touching::Met;
use crate::tensor::dense::dot;

/// Passes over the pairs of bodies at a node with more than one.
const PASSES: usize = 50;

/// Slip in a step, of a cell, up to which a node sticks: round-off.
const STILL: f64 = 1e-12;

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

/// Adds the impulses at the `shared` nodes to the nodal acceleration and, as forces, to what has
/// `pushed`; at owned nodes. One [`Met`] for each pair of bodies, this rank's share, and the states of
/// the points. Collective.
pub(super) fn meet<const D: usize>(
    world: &World,
    model: &Model<D>,
    mesh: &Discretisation<D>,
    (points, shared): (&Points<D>, &[SharedNode<D>]),
    at: &AtNodes<'_>,
    acceleration: &mut [f64],
    pushed: &mut [[f64; D]],
) -> Result<(Vec<Met>, Vec<ContactState<D>>)> {
    let pairs = &model.contacts.body_pairs;
    let mut met: Vec<Met> = pairs.iter().map(|pair| Met::of(pair.index)).collect();
    let mut at_nodes = match model.contacts.keeps_state {
        true => vec![0.0; mesh.numbering.len() * (D + OTHERS)],
        false => Vec::new(),
    };
    for shared in shared.iter().filter(|shared| !shared.meetings.is_empty()) {
        let mut here = Here::new(model, at, shared, acceleration);
        let count = shared.meetings.len();
        for pass in 0..if count > 1 { PASSES } else { 1 } {
            for meeting in &shared.meetings {
                here.touch(meeting, pass == 0, &mut met);
            }
        }
        for (class, nodes) in here.classes.iter().zip(&shared.classes) {
            for &(_, node) in nodes {
                let share = at.mass[node] / class.mass;
                for i in 0..D {
                    pushed[node][i] += share * class.impulse[i] / at.dt;
                    acceleration[node * D + i] += class.compliance[i] * class.impulse[i] / at.dt;
                }
                if let (true, Some(state)) = (model.contacts.keeps_state, class.state) {
                    let words = &mut at_nodes[node * (D + OTHERS)..][..D + OTHERS];
                    for (word, j) in words.iter_mut().zip(&class.impulse) {
                        *word = j / (at.dt * class.mass);
                    }
                    words[D..].copy_from_slice(&state);
                }
            }
        }
    }
    let states = match model.contacts.keeps_state {
        true => states_of_points(world, model, mesh, points, at_nodes)?,
        false => Vec::new(),
    };
    Ok((met, states))
}

/// Words of a node behind the components of its force over its mass: gap, way slid times its share of the
/// surface, status, and that share.
const OTHERS: usize = 4;

/// Share of the surface in a cell's side up to which a point is not said to be in contact.
const HARDLY: f64 = 0.01;

/// States of contact of the points around nodes in contact: each point takes the share of its mass in the force at
/// a node. Collective.
fn states_of_points<const D: usize>(
    world: &World,
    model: &Model<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    mut at_nodes: Vec<f64>,
) -> Result<Vec<ContactState<D>>> {
    let width = D + OTHERS;
    mesh.numbering.halo.forward(world, &mut at_nodes, width)?;
    let step = mesh.step_points(points, &model.materials);
    let least = HARDLY * model.grid.cell_size().powi(D as i32 - 1);
    let mut states = Vec::new();
    for point in 0..points.len() {
        let mut one = ContactState { point, force: [0.0; D], gap: 0.0, slid: 0.0, status: 0.0 };
        let (mut slid, mut area) = (0.0, 0.0);
        for (&node, entry) in step.nodes_of(point).iter().zip(step.influences.row(point)) {
            let words = &at_nodes[node as usize * width..][..width];
            let weight = step.influences.weights[entry];
            if words[D + 2] == 0.0 || weight <= 0.0 {
                continue;
            }
            for (force, word) in one.force.iter_mut().zip(words) {
                *force += points.mass[point] * weight * word;
            }
            one.gap = one.gap.min(words[D]);
            one.status = one.status.max(words[D + 2]);
            slid += weight * words[D + 1];
            area += weight * words[D + 3];
        }
        if one.status > 0.0 {
            if area > least {
                one.slid = slid / area;
            } else {
                // A node that one body hardly reaches moves at will: only its force is kept.
                (one.gap, one.status) = (0.0, 0.0);
            }
            states.push(one);
        }
    }
    Ok(states)
}

/// Fields that move as one at a shared node.
struct Class<const D: usize> {
    /// kg
    mass: f64,
    /// At the step's start, m/s.
    start: [f64; D],
    /// At its end, m/s.
    velocity: [f64; D],
    /// 1/kg; zero where one of them is held.
    compliance: [f64; D],
    /// N s
    impulse: [f64; D],
    /// Gap, way slid and status of its contacts, if there are any.
    state: Option<[f64; OTHERS]>,
}

/// A shared node while its classes exchange impulses.
struct Here<'a, const D: usize> {
    model: &'a Model<D>,
    dt: f64,
    /// As in [`SharedNode::classes`].
    classes: Vec<Class<D>>,
}

impl<'a, const D: usize> Here<'a, D> {
    fn new(
        model: &'a Model<D>,
        at: &AtNodes<'_>,
        shared: &SharedNode<D>,
        acceleration: &[f64],
    ) -> Self {
        let class = |nodes: &Vec<(usize, usize)>| {
            let first = nodes[0].1 * D;
            let mass = nodes.iter().map(|(_, node)| at.mass[*node]).sum::<f64>();
            let held = |i: usize| nodes.iter().any(|(_, node)| at.fixed[node * D + i]);
            Class {
                mass,
                start: std::array::from_fn(|i| at.velocity[first + i]),
                velocity: std::array::from_fn(|i| {
                    at.velocity[first + i] + at.dt * acceleration[first + i]
                }),
                compliance: std::array::from_fn(|i| if held(i) { 0.0 } else { 1.0 / mass }),
                impulse: [0.0; D],
                state: None,
            }
        };
        Here { model, dt: at.dt, classes: shared.classes.iter().map(class).collect() }
    }

    /// Lets two bodies exchange their impulse; `counts`: for the first time in the step.
    fn touch(
        &mut self,
        (pair, both, meeting): &(usize, [usize; 2], Meeting<D>),
        counts: bool,
        met: &mut [Met],
    ) {
        let [a, b] = both.map(|class| &self.classes[class]);
        let difference =
            |a: &[f64; D], b: &[f64; D]| -> [f64; D] { std::array::from_fn(|i| b[i] - a[i]) };
        let (start, relative) =
            (difference(&a.start, &b.start), difference(&a.velocity, &b.velocity));
        let compliance = std::array::from_fn(|i| a.compliance[i] + b.compliance[i]);
        let (cell, of) = (self.model.grid.cell_size(), &self.model.contacts.body_pairs[*pair]);
        let reach = (TOUCH * cell, self.dt);
        let Some(exchange) = meeting.exchange(of.friction, &relative, &compliance, reach) else {
            return;
        };
        let Exchange { impulse, after } = &exchange;
        let along = dot(after, &meeting.normal);
        let slip = (0..D).map(|i| (after[i] - along * meeting.normal[i]).powi(2)).sum::<f64>();
        let slip = self.dt * slip.sqrt();
        let status = if slip > STILL * cell { point_state::SLIDES } else { point_state::STICKS };
        for (class, sign) in both.iter().zip([-1.0, 1.0]) {
            let class = &mut self.classes[*class];
            for i in 0..D {
                class.impulse[i] += sign * impulse[i];
                class.velocity[i] += sign * class.compliance[i] * impulse[i];
            }
            let [gap, slid, before, area] = class.state.unwrap_or_default();
            let (slid, area) = match counts {
                true => (slid + meeting.area * slip, area + meeting.area),
                false => (slid, area),
            };
            class.state = Some([gap.min(meeting.gap), slid, before.max(status), area]);
        }
        let met = &mut met[*pair];
        for (force, j) in met.force.iter_mut().zip(impulse) {
            *force += j / self.dt;
        }
        if counts {
            met.area += meeting.area;
            met.slid += meeting.area * slip;
            met.depth = met.depth.max(-meeting.gap);
        }
        let lost = exchange.dissipation(&start, &meeting.normal);
        met.friction += lost[0];
        met.impact += lost[1];
    }
}
