//! What the state at the start shows of a deck: formulas without a value there, and conditions that
//! act on nothing. Found before anything is solved or written.

use crate::deck::model::{AnalysisType, Boundary, Deck, Place, Symmetry};
use crate::deck::schema::AXES;
use crate::deck::{Presence, When, figure};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::loads::Moment;
use crate::parallel::World;
use crate::points::Points;
use crate::system::conditions::{Conditions, StepSpan};
use crate::system::numbering::Numbering;

use crate::system::model::Model;
use crate::system::unknowns::Unknowns;

use super::contest::Contest;
use super::faulty::{of_first_point, place};
use super::{loads, terms};

/// Evaluates initial velocities, and loads and boundaries at both ends of the first step, at all
/// points and nodes. Returns warnings. Errors name the key, its line and a point. Collective.
pub fn check<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    numbering: &Numbering,
) -> Result<Vec<String>> {
    let span = StepSpan::first_of(&model.deck.stages, 0);
    velocities(world, &model.deck, points)?;
    if model.deck.analysis.kind != AnalysisType::Conditioning {
        loads::check(world, model, points, span)?;
        terms::check(world, model, points)?;
    }
    boundaries(world, model, points, numbering, span)
}

fn velocities<const D: usize>(world: &World, deck: &Deck, points: &Points<D>) -> Result<()> {
    let fault = |p: usize| (0..D).find(|&a| !points.velocity[p][a].is_finite());
    let message = of_first_point(world, points, fault, |p, axis| {
        deck.origins.message(
            &format!("body.{}.velocity", points.body[p]),
            &format!(
                "{} is {} m/s at {}: the expression is not finite there",
                AXES[axis],
                points.velocity[p][axis],
                place(points, p)
            ),
        )
    });
    message.map_or(Ok(()), |message| Err(Error::Input(message)))
}

fn boundaries<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    numbering: &Numbering,
    span: StepSpan,
) -> Result<Vec<String>> {
    let (deck, grid) = (&model.deck, &model.grid);
    let mut warnings = Vec::new();
    let mut contest = Contest::new(numbering.owned * D);
    let at_start = |boundary: &Boundary| boundary.presence.holds_in(0);
    for (index, boundary) in deck.boundaries.iter().enumerate() {
        if let Place::Box { min, max } = &boundary.place
            && let Some(why) = without_nodes(grid, min, max)
        {
            let key = format!("boundary.{index}.where.box");
            return Err(Error::Input(deck.origins.message(&key, &why)));
        }
        if let Some(from) = boundary.presence.from.filter(|from| *from > 0)
            && boundary.support().is_some()
        {
            prescribed(model, index, StepSpan::first_of(&deck.stages, from))?;
        }
        if !at_start(boundary) {
            continue;
        }
        if let Place::CellsOf { body } = boundary.place
            && !world.any(
                (0..points.len())
                    .any(|p| points.body[p] as usize == body && points.outermost[p] != 0.0),
            )
        {
            let why = format!(
                "body \"{}\" has no outermost points that could be followed: expected one that the \
                 deck seeds in its shape; the points of a file do not tell which are outermost",
                deck.bodies[body].name
            );
            let key = format!("boundary.{index}.where.cells_of");
            return Err(Error::Input(deck.origins.message(&key, &why)));
        }
        if boundary.support().is_some() {
            prescribed(model, index, span)?;
            continue;
        }
        let alone = (std::slice::from_ref(boundary), Unknowns::<D>::displacements());
        let basis = deck.method.basis;
        let found = Conditions::evaluate(world, grid, basis, numbering, points, alone, span);
        let found = found.and_then(|found| {
            if deck.analysis.symmetry == Symmetry::Axisymmetric {
                found.clone().hold_axis::<D, D>(world, grid, numbering)?;
            }
            Ok(found)
        });
        let found = found.map_err(|error| match error {
            Error::Input(text) => {
                Error::Input(deck.origins.message(&format!("boundary.{index}.displacement"), &text))
            }
            other => other,
        })?;
        contest.enter(index, &found);
        if !world.any(!found.held_nodes[0].is_empty()) {
            warnings.push(format!(
                "boundary \"{}\" acts on nothing at the start: no node of it touches a \
                 cell that holds material",
                boundary.name
            ));
        }
    }
    warnings.extend(contest.warning(world, deck, grid, numbering));
    Ok(warnings)
}

/// An error where the displacement of a support is not finite at an end of the first step in which it is
/// there; alike on all ranks.
fn prescribed<const D: usize>(model: &Model<D>, index: usize, span: StepSpan) -> Result<()> {
    let kind = model.deck.analysis.kind;
    for support in model.supports.iter().filter(|support| support.boundary == index) {
        for (s, t) in [(span.factor_start, span.time_start), (span.factor_end, span.time_end)] {
            // As in the stage that it comes with: its s is that stage's.
            let at = Moment::new(kind, Presence::default(), When { stage: 0, factor: s, time: t });
            let stage = match span.stage {
                0 => String::new(),
                later => format!(" of stage \"{}\"", model.deck.stages[later].name),
            };
            for own in support.surface.elements() {
                let u = support.prescribed(&own.element, at);
                if let Some(axis) = u.iter().position(|u| !u.is_finite()) {
                    let why = format!(
                        "is {} m at {:?} m on the surface, s = {s}{stage}: the expression is not finite \
                         there",
                        u[axis], own.element.place
                    );
                    let key = format!("boundary.{index}.displacement.{}", AXES[axis]);
                    return Err(Error::Input(model.deck.origins.message(&key, &why)));
                }
            }
        }
    }
    Ok(())
}

/// Why a box holds no node of the grid, if it holds none.
fn without_nodes<const D: usize>(grid: &Grid<D>, min: &[f64], max: &[f64]) -> Option<String> {
    let slack = 1e-9 * grid.cell_size();
    let Grid::Lattice(lattice) = grid else {
        let inside = |node: usize| {
            let x = grid.node_position_initial(node);
            (0..D).all(|a| x[a] >= min[a] - slack && x[a] <= max[a] + slack)
        };
        let none = !(0..grid.node_count()).any(inside);
        return none.then(|| "holds no node of the mesh".to_string());
    };
    (0..D).find_map(|a| {
        let cells = lattice.cells[a] as f64;
        let first = lattice.scaled(a, min[a] - slack).ceil().max(0.0);
        let last = lattice.scaled(a, max[a] + slack).floor().min(cells);
        if first <= last {
            return None;
        }
        let plane = |at: f64| lattice.origin[a] + lattice.spacing[a] * at.clamp(0.0, cells);
        let (below, above) = (plane(first - 1.0), plane(first));
        let near = if below == above {
            figure(below)
        } else {
            format!("{} and {}", figure(below), figure(above))
        };
        let (name, from, to) = (AXES[a], figure(min[a]), figure(max[a]));
        Some(format!(
            "holds no node of the grid: none has {name} from {from} to {to} m; nearest: {near} m"
        ))
    })
}
