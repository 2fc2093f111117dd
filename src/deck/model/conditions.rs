//! `[[boundary]]`: nodes of the grid, and surfaces off it.

use crate::deck::choices::choices;
use crate::deck::expression::Expression;
use crate::deck::stage::Presence;

impl Boundary {
    /// How it holds a surface off the grid's nodes, if it does.
    pub fn support(&self) -> Option<&Support> {
        match &self.place {
            Place::Surface(support) => Some(support),
            _ => None,
        }
    }

    /// Whether it may hold a motion along an axis.
    pub fn may_hold(&self, axis: usize) -> bool {
        let of_surface = self.support().is_some_and(|support| {
            support.slip || (self.fix.is_empty() && self.displacement.is_empty())
        });
        of_surface
            || self.fix.contains(&axis)
            || self.displacement.iter().any(|(component, _)| *component == axis)
            || (self.rotation.is_some() && axis < 2)
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Boundary {
    pub name: String,
    pub place: Place,
    /// Component -> held at zero.
    pub fix: Vec<usize>,
    /// (component, total displacement over the analysis, m, expression of X, Y, Z, s, t).
    /// A value without `s` or `t` is ramped linearly with the load factor.
    pub displacement: Vec<(usize, Expression)>,
    /// Total rigid rotation over the analysis.
    pub rotation: Option<Rotation>,
    pub presence: Presence,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Rotation {
    /// m
    pub centre: Vec<f64>,
    /// Total, counter-clockwise about z.
    pub degrees: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// A face of the lattice: axis and whether it is the upper end.
    /// left/right: x; bottom/top: y; back/front: z.
    Side { axis: usize, upper: bool },
    /// Nodes inside or on a box (tolerance 1e-9 of the grid spacing), in start positions.
    Box { min: Vec<f64>, max: Vec<f64> },
    /// Nodes of a mesh tag.
    Tag(String),
    /// All nodes of the cells that hold the outermost points of a body (Lagrangian §7.2),
    /// recomputed every step.
    CellsOf { body: usize },
    /// No nodes: a surface that a penalty holds, wherever it lies on the grid.
    Surface(Support),
}

/// A surface that is held off the grid's nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Support {
    pub surface: Held,
    /// Its normal component alone is held.
    pub slip: bool,
    /// Force per area and per distance, times h over the body's stiffness.
    pub penalty: f64,
    pub method: SupportMethod,
}

/// What a [`Support`] holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Held {
    /// A part of a body's own surface.
    Surface(BodySurface),
    /// The material on a line between two places (2D), or on a parallelogram given by three of its
    /// corners, the first between the others (3D), at the start, m.
    Sheet(Vec<Vec<f64>>),
}

/// A part of the surface of a body that is given as a shape, at the start.
#[derive(Debug, Clone, PartialEq)]
pub struct BodySurface {
    pub body: usize,
    /// Axis and whether it is the upper end: where the outward normal, in the frame of the shape, is
    /// nearest to this direction. `None`: everywhere.
    pub side: Option<(usize, bool)>,
    /// Condition on x, y, z at the start; `None`: everywhere.
    pub within: Option<Expression>,
}

choices! {
    SupportMethod {
        Penalty = "penalty",
        /// The material's own traction, and a penalty for what is left.
        Nitsche = "nitsche",
    }
}
