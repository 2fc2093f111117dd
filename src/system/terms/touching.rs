//! What a step of contact leaves: forces of the rigid bodies, states of the contacts, energies, and what
//! points keep.

use crate::contact::Contacts;
use crate::contact::law::{Friction, Law, Response};
use crate::contact::point_state::{self, ContactState, write_states};
use crate::contact::surface::length;
use crate::points::{Points, Snapshot};

/// Slip, of the elastic slip and the depth, up to which a corner sticks: round-off.
pub(super) const STILL: f64 = 1e-9;

/// What a rigid body exerts, this rank's share.
#[derive(Debug, Clone, Copy, Default)]
pub struct Exerted {
    /// N
    pub force: [f64; 3],
    /// Sum of the sizes of the forces on the corners, N.
    pub sum_abs: f64,
    /// About [`Rigid::torque_centre`](crate::contact::contacts::Rigid::torque_centre), N m; in 2D along z.
    pub torque: [f64; 3],
}

impl Exerted {
    pub(super) fn add<const D: usize>(
        &mut self,
        force: &[f64; D],
        x: &[f64; D],
        centre: &[f64; D],
    ) {
        for (sum, f) in self.force.iter_mut().zip(force) {
            *sum += f;
        }
        self.sum_abs += force.iter().map(|f| f * f).sum::<f64>().sqrt();
        let (mut arm, mut f) = ([0.0; 3], [0.0; 3]);
        for a in 0..D {
            (arm[a], f[a]) = (x[a] - centre[a], force[a]);
        }
        for (k, torque) in self.torque.iter_mut().enumerate() {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            *torque += arm[i] * f[j] - arm[j] * f[i];
        }
    }
}

/// A contact at the end of a step, this rank's share.
#[derive(Debug, Clone, Copy, Default)]
pub struct Touching {
    /// Index into the deck's contacts.
    pub index: usize,
    /// m2 (m in 2D)
    pub area: f64,
    /// Σ A times the slip of the step, m3 (m2 in 2D).
    pub slid: f64,
    /// Of the deepest corner, m.
    pub depth: f64,
}

impl Touching {
    fn of(index: usize) -> Self {
        Touching { index, ..Touching::default() }
    }
}

/// What a step of contact leaves, this rank's share.
#[derive(Debug)]
pub struct Finished<const D: usize> {
    /// Of each rigid body.
    pub rigids: Vec<Exerted>,
    /// Of each contact.
    pub pairs: Vec<Touching>,
    /// In penalties, J.
    pub energy: f64,
    /// Of friction in the step, J.
    pub dissipation: f64,
    /// Of the rigid bodies on the others in the step, J.
    pub work: f64,
    /// Point, first word, elastic slip in the rigid body's frame.
    slips: Vec<(usize, usize, [f64; D])>,
    /// For the fields `contact_*`, if the deck asks for them.
    states: Option<Vec<ContactState<D>>>,
}

/// What two bodies exchange in a step, this rank's share.
#[derive(Debug, Clone, Default)]
pub struct Met {
    /// Index into the deck's contacts.
    pub index: usize,
    /// On the second body, N.
    pub force: [f64; 3],
    /// m2 (m in 2D)
    pub area: f64,
    /// Σ A times the slip of the step, m3 (m2 in 2D).
    pub slid: f64,
    /// Of the deepest overlap, m.
    pub depth: f64,
    /// Dissipated by friction in the step, J.
    pub friction: f64,
    /// Lost along the normals, where bodies meet, J.
    pub impact: f64,
    /// Energy that the penalties store at the step's end, J.
    pub energy: f64,
}

impl Met {
    /// Nothing so far.
    pub fn of(index: usize) -> Self {
        Met { index, ..Met::default() }
    }
}

/// A corner that touches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub pair: usize,
    pub point: usize,
    /// m2 (m in 2D)
    pub area: f64,
    /// Of its forces that is left.
    pub share: f64,
}

impl<const D: usize> Finished<D> {
    pub(super) fn new(contacts: &Contacts<D>) -> Self {
        Finished {
            rigids: vec![Exerted::default(); contacts.rigids.len()],
            pairs: contacts.pairs.iter().map(|pair| Touching::of(pair.index)).collect(),
            energy: 0.0,
            dissipation: 0.0,
            work: 0.0,
            slips: Vec::new(),
            states: contacts.keeps_state.then(Vec::new),
        }
    }

    /// Adds what a corner that touches holds and loses.
    pub(super) fn add_state(&mut self, of: Corner, law: Law, gap: f64, response: &Response<D>) {
        let slid = length(&response.sliding);
        let held = length(&response.elastic_slip);
        let state = &mut self.pairs[of.pair];
        state.area += of.area;
        state.slid += of.area * slid;
        state.depth = state.depth.max(-gap);
        let stiffness = of.share * law.penalty * of.area;
        self.energy += 0.5 * stiffness * (gap * gap + held * held);
        self.dissipation += stiffness * held * slid;
        if let Some(states) = &mut self.states {
            let force = response.traction.map(|t| of.area * t);
            let slides = slid > STILL * (held + gap.abs()) || law.friction == Friction::Smooth;
            let status = if slides { point_state::SLIDES } else { point_state::STICKS };
            states.push(ContactState { point: of.point, force, gap: gap.min(0.0), slid, status });
        }
    }

    pub(super) fn keep(&mut self, (point, slot): (usize, usize), law: Law, slip: [f64; D]) {
        if law.has_history() {
            self.slips.push((point, slot, slip));
        }
    }
}

/// What a step of contact between bodies leaves to the points.
#[derive(Debug, Default)]
pub struct OfBodies<const D: usize> {
    /// For the fields `contact_*`.
    pub states: Vec<ContactState<D>>,
    /// Point, first word, elastic slip as points keep it; of several for one word the last counts.
    pub slips: Vec<(usize, usize, [f64; D])>,
}

/// Gives the points what a step of contact leaves to them: elastic slip, and what the fields `contact_*`
/// show. What it overwrites is kept in `before`.
pub fn keep<const D: usize>(
    contacts: &Contacts<D>,
    touching: Option<&Finished<D>>,
    of_bodies: OfBodies<D>,
    points: &mut Points<D>,
    before: Option<&mut Snapshot<D>>,
) {
    if points.slip.stride() == 0 {
        return;
    }
    if let Some(before) = before {
        before.slip.copy(&points.slip.values);
    }
    let slips = touching.iter().flat_map(|touching| &touching.slips);
    for (p, slot, slip) in slips.chain(&of_bodies.slips) {
        let body = points.body[*p];
        points.slip.of_mut(*p, body)[*slot..*slot + D].copy_from_slice(slip);
    }
    let of_rigids = touching.and_then(|touching| touching.states.as_ref()).into_iter().flatten();
    write_states(contacts, points, of_rigids.copied().chain(of_bodies.states));
}
