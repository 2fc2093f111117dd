//! `[[rigid]]` and `[[contact]]`.

use std::sync::Arc;

use crate::deck::expression::Expression;
use crate::deck::solid::Solid;
use crate::deck::stage::Presence;

/// A rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct Rigid {
    pub name: String,
    pub shape: RigidShape,
    pub motion: RigidMotion,
    /// It moves freely.
    pub free: Option<FreeRigid>,
    pub presence: Presence,
}

/// What moves a rigid body in place of the deck.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeRigid {
    /// kg/m3
    pub density: f64,
    /// m/s, at the start.
    pub velocity: Vec<f64>,
}

/// The surface of a rigid body, m.
#[derive(Debug, Clone, PartialEq)]
pub enum RigidShape {
    /// `normal` points out of it and may be of any length.
    HalfSpace {
        point: Vec<f64>,
        normal: Vec<f64>,
    },
    Ball {
        centre: Vec<f64>,
        radius: f64,
    },
    Box {
        min: Vec<f64>,
        max: Vec<f64>,
    },
    Capsule {
        from: Vec<f64>,
        to: Vec<f64>,
        radius: f64,
    },
    /// 2D.
    Polygon {
        corners: Vec<[f64; 2]>,
    },
    /// 3D.
    Solid(Arc<Solid>),
    /// 3D; `axis` points from the tip into it, `angle` is that at the tip, degrees.
    Cone {
        tip: [f64; 3],
        axis: [f64; 3],
        angle: f64,
        radius: f64,
        shaft: f64,
    },
}

/// How a rigid body is driven; without anything it is held.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RigidMotion {
    /// m, one per axis, of s and t; empty: none.
    pub displacement: Vec<Expression>,
    /// m/s, one per axis, of t; empty: none.
    pub velocity: Vec<Expression>,
    pub rotation: Option<RigidRotation>,
}

impl RigidMotion {
    /// Whether a formula of it holds s or t.
    pub fn depends_on_time(&self) -> bool {
        let turning = self.rotation.iter().map(|rotation| &rotation.degrees);
        let mut all = self.displacement.iter().chain(&self.velocity).chain(turning);
        all.any(Expression::depends_on_time)
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct RigidRotation {
    /// m; moves along with the body.
    pub centre: Vec<f64>,
    /// Direction, any length; z in 2D.
    pub axis: [f64; 3],
    /// Of s and t, right-handed.
    pub degrees: Expression,
}

/// A body on a rigid body or on another body.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    pub name: String,
    pub partner: Partner,
    /// Index into `Deck::bodies`; of two bodies the first one.
    pub body: usize,
    pub friction: Friction,
    /// Pa
    pub adhesion: f64,
    /// Pa
    pub max_shear: Option<f64>,
    /// Times the body's stiffness over the cell size; not read between two bodies.
    pub penalty: f64,
    pub presence: Presence,
}

/// What a body touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Partner {
    /// Index into `Deck::rigids`.
    Rigid(usize),
    /// Index into `Deck::bodies`.
    Body(usize),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Friction {
    /// Coefficient.
    Coulomb(f64),
    /// No slip.
    Rough,
}
