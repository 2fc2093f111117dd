//! The rigid bodies of a deck, and which bodies touch them.

use super::ball::Ball;
use super::capsule::Capsule;
use super::cone::Cone;
use super::cuboid::Cuboid;
use super::fields::Fields;
use super::free::FreeBody;
use super::half_space::HalfSpace;
use super::law::{Friction, Law};
use super::motion::{Motion, When};
use super::outline::Outline;
use super::point_state;
use super::pose::Pose;
use super::surface::{Surface, length};
use super::triangles::Triangles;
use crate::basis::Domain;
use crate::deck::model::{self, AnalysisType, Basis, Partner, RigidShape, Symmetry};
use crate::deck::stage::begin_of;
use crate::deck::{self, Deck, Presence};
use crate::error::{Error, Result};

/// A rigid body.
#[derive(Debug)]
pub struct Rigid<const D: usize> {
    pub name: String,
    pub surface: Box<dyn Surface<D>>,
    pub motion: Motion,
    /// As it begins, if it moves freely.
    pub free: Option<FreeBody<D>>,
    pub presence: Presence,
    /// t when it comes, s.
    pub since: f64,
}

impl<const D: usize> Rigid<D> {
    /// What its torque is about, m: the centre of mass, that of its rotation, or the origin.
    pub fn torque_centre(&self, pose: &Pose<D>) -> [f64; D] {
        if self.free.is_none() && self.motion.0.rotation.is_none() {
            return [0.0; D];
        }
        std::array::from_fn(|a| pose.centre[a] + pose.shift[a])
    }
}

/// A body on a rigid surface.
#[derive(Debug, Clone)]
pub struct Pair {
    pub name: String,
    /// Index into the deck's contacts.
    pub index: usize,
    /// Index into [`Contacts::rigids`].
    pub rigid: usize,
    /// Index into the deck's bodies.
    pub body: usize,
    pub law: Law,
    /// Of the rigid body and the contact together.
    pub presence: Presence,
}

/// Two bodies that touch.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyPair {
    /// Index into the deck's contacts.
    pub index: usize,
    /// Indices into the deck's bodies.
    pub bodies: [usize; 2],
    /// ε of implicit steps, Pa/m.
    pub penalty: f64,
    pub friction: Friction,
    pub presence: Presence,
}

/// All of a deck.
#[derive(Debug, Default)]
pub struct Contacts<const D: usize> {
    pub rigids: Vec<Rigid<D>>,
    pub pairs: Vec<Pair>,
    pub body_pairs: Vec<BodyPair>,
    /// Which bodies move in a velocity field of their own.
    pub fields: Fields,
    /// Points are sections of rings: axisymmetry.
    pub rings: bool,
    /// Points keep what the fields `contact_*` show.
    pub keeps_state: bool,
}

impl<const D: usize> Contacts<D> {
    /// `stiffness`: mean stiffness of each body, Pa; `cell`: size of the grid's cells, m; `nodes`: how
    /// many the grid has.
    pub fn of_deck(deck: &Deck, stiffness: &[f64], (cell, nodes): (f64, usize)) -> Result<Self> {
        let made = |(index, one)| rigid(deck, index, one);
        let rigids = deck.rigids.iter().enumerate().map(made).collect::<Result<_>>()?;
        let (mut pairs, mut body_pairs) = (Vec::new(), Vec::new());
        for (index, contact) in deck.contacts.iter().enumerate() {
            let (friction, presence) = (friction(contact), contact.presence);
            match contact.partner {
                Partner::Rigid(rigid) => pairs.push(Pair {
                    name: contact.name.clone(),
                    index,
                    rigid,
                    body: contact.body,
                    law: Law {
                        penalty: contact.penalty * stiffness[contact.body] / cell,
                        friction,
                    },
                    presence: deck.rigids[rigid].presence.together(&presence).unwrap_or(presence),
                }),
                Partner::Body(other) => {
                    let bodies = [contact.body, other];
                    // The softer one says how deep a pressure goes.
                    let softer = stiffness[contact.body].min(stiffness[other]);
                    let penalty = contact.penalty * softer / cell;
                    body_pairs.push(BodyPair { index, bodies, penalty, friction, presence });
                }
            }
        }
        let fields = match deck.analysis.kind {
            AnalysisType::Explicit => {
                let touching = body_pairs.iter().flat_map(|pair| pair.bodies);
                Fields::of_bodies(deck.bodies.len(), touching, nodes)
            }
            _ => joined_fields(deck, &body_pairs, nodes)?,
        };
        let rings = deck.analysis.symmetry == Symmetry::Axisymmetric;
        Ok(Contacts {
            rigids,
            pairs,
            body_pairs,
            fields,
            rings,
            keeps_state: point_state::is_wanted(deck),
        })
    }

    /// Whether no body touches a rigid one.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Whether the tangents of all equal their transposed.
    pub fn symmetric(&self) -> bool {
        self.pairs.iter().all(|pair| pair.law.symmetric())
            && self.body_pairs.iter().all(|pair| pair.friction == Friction::Smooth)
    }

    /// Largest penalty on a body, Pa/m; 0 where it touches nothing.
    pub fn stiffest(&self, body: usize) -> f64 {
        let pairs = self.pairs.iter().filter(|pair| pair.body == body);
        pairs.map(|pair| pair.law.penalty).fold(0.0, f64::max)
    }

    /// First word of a contact's elastic slip in the row of a point with so many corners.
    pub fn slot_of(&self, pair: usize, corners: usize) -> usize {
        self.with_slip(&self.pairs[..pair], self.pairs[pair].body) * corners * D
    }

    /// Where the elastic slip of an `element` begins among the words of the point that carries it, in contact of
    /// `body` with another one. A point has so many `corners` and carries at most so many elements (`carried`).
    pub fn slot_of_element(
        &self,
        (pair, body, element): (usize, usize, usize),
        (corners, carried): (usize, usize),
    ) -> usize {
        let before = self.with_slip(&self.pairs, body) * corners;
        let earlier = rubbing(&self.body_pairs[..pair], body).count();
        (before + earlier * carried + element) * D
    }

    /// How many of some `pairs` with rigid bodies make the points of a body keep elastic slip.
    fn with_slip(&self, pairs: &[Pair], body: usize) -> usize {
        pairs.iter().filter(|pair| pair.body == body && pair.law.has_history()).count()
    }

    /// Names of the words that the points of each body carry: elastic slip, of contacts with rigid bodies by
    /// corners and of those with other bodies by elements, of which they carry at most so many (`carried`, 0 in
    /// explicit runs), and the state of contact for the fields `contact_*`.
    pub fn slip_names(&self, deck: &Deck, carried: &[usize]) -> Vec<Vec<String>> {
        let corners = corners_of(deck.method.basis, D);
        let words = |name: String, count: usize| {
            (0..count * D).map(move |k| format!("{name}.{}.{}", k / D, k % D))
        };
        let of_body = |body: usize| {
            let pairs = self.pairs.iter().enumerate();
            let slips = pairs.filter(|(_, pair)| pair.body == body && pair.law.has_history());
            let slips = slips.flat_map(|(pair, _)| words(pair.to_string(), corners));
            let elements = rubbing(&self.body_pairs, body)
                .flat_map(|pair| words(format!("body.{}", pair.index), carried[body]));
            let touching = self.pairs.iter().any(|pair| pair.body == body)
                || self.body_pairs.iter().any(|pair| pair.bodies.contains(&body));
            let state = (self.keeps_state && touching).then(|| point_state::names(D));
            slips.chain(elements).chain(state.into_iter().flatten()).collect()
        };
        (0..deck.bodies.len()).map(of_body).collect()
    }

    /// Where the rigid bodies are; those that have not come yet where they will have gone.
    pub fn poses(&self, when: deck::When) -> Vec<Pose<D>> {
        let pose = |rigid: &Rigid<D>| {
            let load_factor = rigid.presence.factor(when);
            rigid.motion.pose(When { load_factor, time: when.time, since: rigid.since })
        };
        self.rigids.iter().map(pose).collect()
    }
}

/// The pairs, among some, in which a body rubs on another one.
fn rubbing(pairs: &[BodyPair], body: usize) -> impl Iterator<Item = &BodyPair> {
    let rubs =
        move |pair: &&BodyPair| pair.bodies.contains(&body) && pair.friction != Friction::Smooth;
    pairs.iter().filter(rubs)
}

/// Corners of a point's domain that touch rigid bodies.
pub fn corners_of(basis: Basis, dimension: usize) -> usize {
    if basis.domain() == Domain::None { 1 } else { 1 << dimension }
}

/// Fields of implicit runs: bodies that no contact names together move in one field. Error: two bodies
/// that touch each other would so share one.
fn joined_fields(deck: &Deck, pairs: &[BodyPair], nodes: usize) -> Result<Fields> {
    let touch = |a: usize, b: usize| {
        pairs.iter().any(|pair| pair.bodies == [a, b] || pair.bodies == [b, a])
    };
    let mut fields: Vec<usize> = (0..deck.bodies.len()).collect();
    for a in 0..fields.len() {
        for b in (0..a).filter(|&b| !touch(a, b)) {
            let (joined, into) = (fields[a].max(fields[b]), fields[a].min(fields[b]));
            fields.iter_mut().filter(|field| **field == joined).for_each(|field| *field = into);
        }
    }
    let shared = pairs.iter().find(|pair| fields[pair.bodies[0]] == fields[pair.bodies[1]]);
    let Some(pair) = shared else { return Ok(Fields::of_classes(&fields, nodes)) };
    let [one, two] = pair.bodies;
    let between =
        (0..fields.len()).find(|&c| c != one && c != two && !(touch(one, c) && touch(two, c)));
    let name = |body: usize| deck.bodies[body].name.as_str();
    let why = format!(
        "\"{}\" and \"{}\" touch each other, but bodies that no contact names together move as one in \
         implicit runs, and so these two would by way of \"{}\": name it in contacts with one of them or both",
        name(one),
        name(two),
        between.map_or("others", name),
    );
    Err(Error::Input(deck.origins.message(&format!("contact.{}.between", pair.index), &why)))
}

fn friction(contact: &model::Contact) -> Friction {
    let most = contact.max_shear.unwrap_or(f64::INFINITY);
    match contact.friction {
        model::Friction::Rough => match contact.max_shear {
            None => Friction::Rough,
            Some(most) => Friction::Coulomb { coefficient: 0.0, adhesion: most, most },
        },
        model::Friction::Coulomb(coefficient) => {
            let adhesion = contact.adhesion;
            if coefficient == 0.0 && adhesion == 0.0 {
                return Friction::Smooth;
            }
            Friction::Coulomb { coefficient, adhesion, most }
        }
    }
}

fn rigid<const D: usize>(deck: &Deck, index: usize, rigid: &model::Rigid) -> Result<Rigid<D>> {
    let rings = deck.analysis.symmetry == Symmetry::Axisymmetric;
    let surface = surface(&rigid.shape, rings).ok_or_else(|| {
        let why =
            "the shape has no inside: its corners lie on a line, or two in a row in one place";
        Error::Input(deck.origins.message(&format!("rigid.{index}.shape"), why))
    })?;
    let free = match &rigid.free {
        None => None,
        Some(_) if rings => {
            let why = "a body of revolution cannot move freely: leave the density out";
            return Err(Error::Input(deck.origins.message(&format!("rigid.{index}.density"), why)));
        }
        Some(free) => {
            let solid = surface.solid().ok_or_else(|| {
                let why = "a body of this shape has no known volume, and so no mass";
                Error::Input(deck.origins.message(&format!("rigid.{index}.density"), why))
            })?;
            Some(FreeBody::new(&solid, free))
        }
    };
    let motion = Motion(rigid.motion.clone());
    let presence = rigid.presence;
    let since = begin_of(&deck.stages, presence.from.unwrap_or(0));
    Ok(Rigid { name: rigid.name.clone(), surface, motion, free, presence, since })
}

/// `None`: the shape is not of this dimension, or has no inside.
fn surface<const D: usize>(shape: &RigidShape, rings: bool) -> Option<Box<dyn Surface<D>>> {
    let place = |values: &[f64]| -> [f64; D] { std::array::from_fn(|a| values[a]) };
    Some(match shape {
        RigidShape::HalfSpace { point, normal } => {
            let normal = place(normal);
            let size = length(&normal);
            Box::new(HalfSpace { point: place(point), normal: normal.map(|n| n / size) })
        }
        RigidShape::Ball { centre, radius } => {
            Box::new(Ball { centre: place(centre), radius: *radius })
        }
        RigidShape::Box { min, max } => Box::new(Cuboid { min: place(min), max: place(max) }),
        RigidShape::Capsule { from, to, radius } => {
            Box::new(Capsule { from: place(from), to: place(to), radius: *radius })
        }
        RigidShape::Polygon { corners } if rings => of_dimension(Outline::mirrored(corners)?)?,
        RigidShape::Polygon { corners } => of_dimension(Outline::new(corners)?)?,
        RigidShape::Solid(solid) => of_dimension(Triangles(solid.clone()))?,
        RigidShape::Cone { tip, axis, angle, radius, shaft } => {
            let size = length(axis);
            let axis = axis.map(|a| a / size);
            of_dimension(Cone::new(*tip, axis, *angle, *radius, *shaft)?)?
        }
    })
}

/// A surface of dimension `E` as one of dimension `D`; `None` where these differ.
fn of_dimension<const D: usize, const E: usize>(
    surface: impl Surface<E> + 'static,
) -> Option<Box<dyn Surface<D>>> {
    let boxed: Box<dyn Surface<E>> = Box::new(surface);
    let any: Box<dyn std::any::Any> = Box::new(boxed);
    any.downcast::<Box<dyn Surface<D>>>().ok().map(|surface| *surface)
}
