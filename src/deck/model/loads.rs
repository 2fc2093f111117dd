//! `[[load]]` and `[water]`.

use super::conditions::BodySurface;
use crate::deck::expression::{Expression, Variable};

/// In quasi-static runs values that hold neither `s` nor `t` are ramped with the load factor.
#[derive(Debug, Clone, PartialEq)]
pub enum Load {
    /// Total force, N (2D: N/m), expressions of s and t, shared equally by the points nearest to
    /// the given places.
    Point { body: usize, nearest: Vec<Vec<f64>>, force: Vec<Expression> },
    /// m/s2, expressions of X, Y, Z, s, t.
    Gravity(Vec<Expression>),
    /// N/m3 of *initial* volume, expressions of X, Y, Z, x, y, z, s, t.
    BodyForce(Vec<Expression>),
    /// Pa, an expression of x, y, z, s, t: a pressure on the surface of all bodies.
    Pressure { value: Expression, zone: Option<PressureZone> },
    /// Pa, an expression of x, y, z, s, t: a pressure on a body's own surface.
    SurfacePressure { surface: BodySurface, value: Expression },
    /// Pa per initial area, expressions of X, Y, Z, s, t: a traction on a body's own surface.
    Traction { surface: BodySurface, value: Vec<Expression> },
    /// Given pore water, of `[water]`: it lifts what is below its level.
    Water(Water),
    /// Body force (N per initial volume) that makes this displacement field exact: one expression
    /// per axis of X, Y, Z, s (manufactured solution).
    Manufactured(Vec<Expression>),
}

impl Load {
    /// Whether a value of it depends on s or t.
    pub fn depends_on_time(&self) -> bool {
        match self {
            Load::Pressure { value, .. } | Load::SurfacePressure { value, .. } => {
                value.depends_on_time()
            }
            Load::Point { force: all, .. }
            | Load::Gravity(all)
            | Load::Traction { value: all, .. }
            | Load::BodyForce(all)
            | Load::Manufactured(all) => all.iter().any(Expression::depends_on_time),
            Load::Water(_) => false,
        }
    }

    /// The body that it acts on alone.
    pub fn body(&self) -> Option<usize> {
        match self {
            Load::Point { body, .. } => Some(*body),
            Load::Traction { surface, .. } | Load::SurfacePressure { surface, .. } => {
                Some(surface.body)
            }
            _ => None,
        }
    }

    /// Whether it may resist a motion along an axis: a pressure that varies along it.
    pub fn may_hold(&self, axis: usize) -> bool {
        const PLACE: [Variable; 3] = [Variable::CurrentX, Variable::CurrentY, Variable::CurrentZ];
        match self {
            Load::Pressure { value, zone } => zone.is_some() || value.depends_on(PLACE[axis]),
            _ => false,
        }
    }
}

/// Still water in the pores and around the bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Water {
    /// m, along the axis.
    pub level: f64,
    /// N/m3
    pub unit_weight: f64,
    /// The vertical one.
    pub axis: usize,
}

impl Water {
    /// p = unit_weight (level - height), 0 above, Pa.
    pub fn pressure(&self, x: &[f64]) -> f64 {
        self.unit_weight * (self.level - x[self.axis]).max(0.0)
    }
}

/// Where a pressure acts in full, in current positions.
#[derive(Debug, Clone, PartialEq)]
pub struct PressureZone {
    pub min: Vec<f64>,
    pub max: Vec<f64>,
    /// Width over which it falls to zero outside, m; `None`: three cells.
    pub fade: Option<f64>,
}
