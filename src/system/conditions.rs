//! Dirichlet conditions: which components of which active nodes move how far in this step.

use crate::basis;
use crate::deck::expression::Expression;
use crate::deck::model::{Basis, Boundary, Place, Rotation};
use crate::deck::stage::{Stage, begin_of};
use crate::deck::{Presence, Scope, When};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::parallel::World;
use crate::points::Points;

use super::numbering::Numbering;
use super::unknowns::Unknowns;

/// Where in the analysis a step lies: load factor and time at both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepSpan {
    /// From zero.
    pub stage: usize,
    /// s of the stage.
    pub factor_start: f64,
    /// s at the end.
    pub factor_end: f64,
    /// s
    pub time_start: f64,
    /// s
    pub time_end: f64,
}

impl StepSpan {
    /// The first step of a stage. Of steps that follow the stability limit only the begin is known.
    pub fn first_of(stages: &[Stage], stage: usize) -> Self {
        let known = stages.get(stage).map(|stage| (stage.steps, stage.duration));
        let (steps, duration) = known.unwrap_or_default();
        let factor_end = match (steps, duration) {
            (Some(steps), _) => 1.0 / steps as f64,
            (None, Some(_)) => 0.0,
            (None, None) => 1.0,
        };
        let time_start = begin_of(stages, stage);
        let time_end = time_start + factor_end * duration.unwrap_or(1.0);
        StepSpan { stage, factor_start: 0.0, factor_end, time_start, time_end }
    }

    /// The moment at which it begins.
    pub fn start(&self) -> When {
        When { stage: self.stage, factor: self.factor_start, time: self.time_start }
    }

    /// The moment at which it ends.
    pub fn end(&self) -> When {
        When { stage: self.stage, factor: self.factor_end, time: self.time_end }
    }

    /// As what is there at certain times sees it: s runs in the stage it comes with, and is 1 later.
    pub fn seen_by(&self, presence: Presence) -> StepSpan {
        StepSpan {
            factor_start: presence.factor(self.start()),
            factor_end: presence.factor(self.end()),
            ..*self
        }
    }
}

/// Prescribed increments of the unknowns, `N` per node, at the local nodes (owned and ghost).
#[derive(Debug, Clone, Default)]
pub struct Conditions {
    /// Per local degree of freedom (node * N + component): held by a condition.
    pub fixed: Vec<bool>,
    /// Increment over the step, m for displacements; zero where free.
    pub increment: Vec<f64>,
    /// For each boundary of the deck the owned degrees of freedom that it takes the reaction of, ascending. Every
    /// reaction counts once: of several boundaries that hold a component of a node the one takes it whose motion
    /// the node follows, and of equal motions the first in the deck.
    pub members: Vec<Vec<u32>>,
    /// Local nodes that each boundary holds in some component, ascending, shared ones included.
    pub held_nodes: Vec<Vec<u32>>,
}

impl Conditions {
    /// Evaluates boundaries for one step: components of a boundary count the unknowns of a node. Collective.
    /// Error: an increment is not finite, two boundaries disagree, or one rotates what is no displacement.
    pub fn evaluate<const D: usize, const N: usize>(
        world: &World,
        grid: &Grid<D>,
        basis: Basis,
        numbering: &Numbering,
        points: &Points<D>,
        (boundaries, unknowns): (&[Boundary], Unknowns<N>),
        span: StepSpan,
    ) -> Result<Self> {
        let mut conditions = Conditions {
            fixed: vec![false; numbering.len() * N],
            increment: vec![0.0; numbering.len() * N],
            members: vec![Vec::new(); boundaries.len()],
            held_nodes: vec![Vec::new(); boundaries.len()],
        };
        // Place in the deck of the boundary that a degree of freedom follows.
        let mut leader = vec![usize::MAX; numbering.len() * N];
        let mut problem = None;
        let held_now = |boundary: &Boundary| boundary.presence.holds_in(span.stage);
        for (b, boundary) in boundaries.iter().enumerate().filter(|(_, b)| held_now(b)) {
            let span = span.seen_by(boundary.presence);
            let inside = members(world, grid, basis, numbering, points, &boundary.place)?;
            for local in (0..numbering.len()).filter(|&local| inside[local]) {
                let node = numbering.nodes[local];
                conditions.held_nodes[b].push(local as u32);
                let mut held = [None; N];
                for &component in &boundary.fix {
                    held[component] = Some(0.0);
                }
                for (component, expression) in &boundary.displacement {
                    let start = grid.node_position_initial(node);
                    held[*component] = Some(increment_of(expression, &start, span));
                }
                if let Some(rotation) = &boundary.rotation {
                    if !unknowns.displacements {
                        problem = problem.or(Some(format!(
                            "boundary \"{}\" rotates nodes whose unknowns are {}: only displacements rotate",
                            boundary.name,
                            unknowns.names.join(", ")
                        )));
                    }
                    // About z: the third component is the other keys'.
                    let turn = rotated(rotation, &grid.node_position(node), span);
                    for (slot, value) in held.iter_mut().zip(turn) {
                        *slot = Some(value);
                    }
                }
                for (component, value) in held.iter().enumerate() {
                    let Some(value) = *value else { continue };
                    let dof = local * N + component;
                    if !value.is_finite() {
                        problem = problem.or(Some(format!(
                            "boundary \"{}\" moves {} of the node at {:?} by \
                             {value}: its expression is not finite there",
                            boundary.name,
                            unknowns.names[component],
                            grid.node_position(node),
                        )));
                    }
                    let clash = conditions.fixed[dof] && conditions.increment[dof] != value;
                    if clash && conditions.increment[dof] != 0.0 && value != 0.0 {
                        problem = problem.or(Some(format!(
                            "boundary \"{}\" moves {} of the node at {:?} by \
                             {value} in this step, but an earlier boundary moves it by {}; let \
                             one of them leave the node out",
                            boundary.name,
                            unknowns.names[component],
                            grid.node_position(node),
                            conditions.increment[dof]
                        )));
                    }
                    if !clash || value != 0.0 {
                        conditions.increment[dof] = value;
                    }
                    if !conditions.fixed[dof] || (clash && value != 0.0) {
                        leader[dof] = b;
                    }
                    conditions.fixed[dof] = true;
                }
            }
        }
        for (dof, &b) in leader[..numbering.owned * N].iter().enumerate() {
            if let Some(members) = conditions.members.get_mut(b) {
                members.push(dof as u32);
            }
        }
        world.refuse(Error::Input, problem)?;
        Ok(conditions)
    }
}

impl Conditions {
    /// Holds x of the nodes on the axis x = 0 of a body of revolution, where u_r / r has no other value
    /// that stays finite: the first of `N` unknowns is u_r. No boundary has their reaction, as it acts on a ring
    /// of no radius. Collective. Error: a boundary of the deck moves one off the axis.
    pub fn hold_axis<const D: usize, const N: usize>(
        &mut self,
        world: &World,
        grid: &Grid<D>,
        numbering: &Numbering,
    ) -> Result<()> {
        let slack = 1e-9 * grid.cell_size();
        let mut problem = None;
        for (local, &node) in numbering.nodes.iter().enumerate() {
            let x = grid.node_position(node);
            if x[0].abs() > slack {
                continue;
            }
            if self.increment[local * N] != 0.0 {
                problem.get_or_insert(format!(
                    "a boundary moves x of the node at {x:?} by {} in this step, off the axis x = 0 of a \
                     body of revolution, which keeps its place; let the boundary leave the node out",
                    self.increment[local * N]
                ));
            }
            self.fixed[local * N] = true;
        }
        world.refuse(Error::Input, problem)
    }
}

/// Which local nodes lie in `place`.
fn members<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    basis: Basis,
    numbering: &Numbering,
    points: &Points<D>,
    place: &Place,
) -> Result<Vec<bool>> {
    match place {
        Place::Surface(_) => Ok(vec![false; numbering.len()]),
        Place::CellsOf { body } => cells_of(world, grid, basis, numbering, points, *body),
        Place::Side { axis, upper } => {
            Ok(numbering.nodes.iter().map(|&node| grid.on_side(node, *axis, *upper)).collect())
        }
        Place::Tag(tag) => {
            let tagged = grid.tagged_nodes(tag)?;
            Ok(numbering.nodes.iter().map(|node| tagged.binary_search(node).is_ok()).collect())
        }
        Place::Box { min, max } => {
            let slack = 1e-9 * grid.cell_size();
            Ok(numbering
                .nodes
                .iter()
                .map(|&node| {
                    let x = grid.node_position_initial(node);
                    (0..D).all(|a| x[a] >= min[a] - slack && x[a] <= max[a] + slack)
                })
                .collect())
        }
    }
}

/// Nodes of the cells reached by the outermost points of a body, wherever those points live.
fn cells_of<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    basis: Basis,
    numbering: &Numbering,
    points: &Points<D>,
    body: usize,
) -> Result<Vec<bool>> {
    let mut marks = vec![0.0; numbering.len()];
    let (mut cells, mut nodes) = (Vec::new(), Vec::new());
    for p in 0..points.len() {
        if points.body[p] as usize != body || points.outermost[p] == 0.0 {
            continue;
        }
        cells.clear();
        basis::populated_cells(grid, basis, points, p, None, &mut cells)?;
        for &cell in &cells {
            nodes.clear();
            grid.cell_nodes(cell, &mut nodes);
            for &node in &nodes {
                if let Some(local) = numbering.local_of(body, node) {
                    marks[local] = 1.0;
                }
            }
        }
    }
    numbering.halo.reverse_add(world, &mut marks, 1)?;
    numbering.halo.forward(world, &mut marks, 1)?;
    Ok(marks.into_iter().map(|mark| mark > 0.0).collect())
}

/// Increment of a prescribed total displacement over the step, as its boundary sees that. Without `s` or `t` the total is
/// reached linearly with the load factor.
fn increment_of<const D: usize>(expression: &Expression, start: &[f64; D], span: StepSpan) -> f64 {
    let mut initial = [0.0; 3];
    initial[..D].copy_from_slice(start);
    let at = |load_factor: f64, time: f64| {
        expression.value(&Scope { initial, current: initial, load_factor, time })
    };
    if expression.depends_on_time() {
        at(span.factor_end, span.time_end) - at(span.factor_start, span.time_start)
    } else {
        at(span.factor_end, span.time_end) * (span.factor_end - span.factor_start)
    }
}

/// Displacement in x and y under the step's share of a rigid rotation about z.
fn rotated<const D: usize>(rotation: &Rotation, x: &[f64; D], span: StepSpan) -> [f64; 2] {
    let angle = rotation.degrees.to_radians() * (span.factor_end - span.factor_start);
    let (sin, cos) = angle.sin_cos();
    let arm = [x[0] - rotation.centre[0], x[1] - rotation.centre[1]];
    [(cos - 1.0) * arm[0] - sin * arm[1], sin * arm[0] + (cos - 1.0) * arm[1]]
}
