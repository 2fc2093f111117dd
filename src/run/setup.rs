//! From a checked deck to points on their ranks: seed, partition, migrate, place point forces;
//! or the same from a checkpoint.

use std::sync::Arc;

use crate::basis::Domain;
use crate::contact::Contacts;
use crate::contact::point_state::PREFIX;
use crate::deck::expression::Expression;
use crate::deck::model::{self, Initial, Load};
use crate::deck::{Deck, Presence};
use crate::error::{Error, Result};
use crate::ghost::stencil::Penalty;
use crate::grid::{Grid, Lattice, Mesh};
use crate::loads::{Found, Manufactured, Point, Start};
use crate::material::Material;
use crate::output::restart::checkpoint::Restored;
use crate::parallel::nearest::require_near;
use crate::parallel::number::close_gaps;
use crate::parallel::{self, Partition, World};
use crate::points::overlap;
use crate::points::seed::{self, CellByCell};
use crate::points::share::Share;
use crate::points::{Named, Points};

use super::materials::{self, Overview, Stresses};
use super::start_checks::memory;
use super::surfaces;
use crate::parallel::balance::Balance;
use crate::system::model::Model;

/// Builds the model and this rank's points. Collective.
pub fn prepare<const D: usize>(world: &World, mut deck: Deck) -> Result<(Model<D>, Points<D>)> {
    memory::require::<D>(world, &deck)?;
    let grid = world.fail_together(build_grid(&deck))?;
    set_cell_size(&mut deck, &grid);
    check_tags(&deck, &grid)?;
    check_basis(&deck, &grid)?;
    let share = Share { rank: world.rank(), ranks: world.size() };
    let (mut points, first_ids) = world.fail_together(seed::seed(&deck, &grid, share))?;
    world.fail_together(overlap::check(&deck, &grid, &points))?;
    let cells = check_bodies(world, &deck, &grid, &points)?;
    let brick = deck.parallel.brick;
    let partition = match deck.parallel.initial {
        Initial::Balanced => Partition::for_cells(world, &grid, brick, &cells, None)?,
        Initial::Slabs => Partition::slabs(world, &grid, brick, &cells)?,
    };
    let seeding = CellByCell::new(&deck, &grid, first_ids)?;
    parallel::distribute_seeded(world, &partition, &grid, &mut points, cells, &seeding)?;
    close_gaps(world, &mut points)?;
    let mut found = find_carriers(world, &deck, &grid, &points)?;
    hold_constant_forces(&deck, &mut found, &mut points);
    let materials = materials::of_bodies(&deck);
    materials::equip(world, &deck, &materials, &mut points, Stresses::Initial)?;
    let mut model = model_of(world, deck, grid, partition, materials, found, &points)?;
    points.slip = Named::zeros(model.slip_names(), points.len());
    let late = late_bodies(&model.deck);
    model.waiting = set_aside(&mut points, &late);
    Ok((model, points))
}

/// Gives the materials the width of a cell.
fn set_cell_size<const D: usize>(deck: &mut Deck, grid: &Grid<D>) {
    let cell = grid.cell_size();
    deck.materials.iter_mut().for_each(|material| material.cell = cell);
}

/// Which bodies come with a stage after the first.
fn late_bodies(deck: &Deck) -> Vec<bool> {
    deck.bodies.iter().map(|body| body.presence.from.is_some_and(|from| from > 0)).collect()
}

/// Takes the points of some bodies out.
fn set_aside<const D: usize>(points: &mut Points<D>, bodies: &[bool]) -> Points<D> {
    if !bodies.contains(&true) {
        return points.empty_like();
    }
    let (gone, kept): (Vec<usize>, Vec<usize>) =
        (0..points.len()).partition(|&p| bodies[points.body[p] as usize]);
    let mut aside = points.clone();
    aside.select(&gone);
    points.select(&kept);
    aside
}

/// All points of the deck as they were seeded, with what their materials ask for: what a
/// continuation needs of bodies that are not there. `counted`: as the checkpoint's points are. Collective.
fn seeded<const D: usize>(
    world: &World,
    deck: &Deck,
    grid: &Grid<D>,
    materials: &[Material],
    counted: bool,
) -> Result<Points<D>> {
    let share = Share { rank: world.rank(), ranks: world.size() };
    let (mut points, _) = world.fail_together(seed::seed(deck, grid, share))?;
    if counted {
        close_gaps(world, &mut points)?;
    }
    materials::equip(world, deck, materials, &mut points, Stresses::Initial)?;
    Ok(points)
}

/// The model and this rank's points as a checkpoint holds them: the stored partition where it
/// fits this run, a new one otherwise. Collective.
pub fn restore<const D: usize>(
    world: &World,
    mut deck: Deck,
    restored: Restored<D>,
) -> Result<(Model<D>, Points<D>)> {
    let mut grid = world.fail_together(build_grid(&deck))?;
    set_cell_size(&mut deck, &grid);
    let materials = materials::of_bodies(&deck);
    let all = match deck.has_passing_bodies() {
        true => Some(seeded(world, &deck, &grid, &materials, restored.points.counted)?),
        false => None,
    };
    let Restored { ranks, mut points, mesh_positions, brick, owners, .. } = restored;
    points.shed(deck.method.basis);
    points.water = deck.water();
    if !points.counts_anew && deck.stages.iter().any(|stage| stage.reset_displacement) {
        // An earlier part of the run had no such stage.
        points.counts_anew = true;
        points.displacement_start.clone_from(&points.position_initial);
    }
    if let (Grid::Mesh(mesh), Some(positions)) = (&mut grid, mesh_positions) {
        world.fail_together(mesh.set_positions(positions))?;
    }
    let unchanged = ranks == world.size() && (deck.parallel.brick.is_none_or(|b| Some(b) == brick));
    let stored = unchanged.then(|| Partition::restore(&grid, brick, owners, ranks)).flatten();
    let partition = match stored {
        Some(partition) => partition,
        None => Partition::build(world, &grid, deck.parallel.brick, &points, None)?,
    };
    materials::equip_restored(world, &deck, &materials, &mut points)?;
    // With the stored partition nothing moves; the points are in the order of their cells.
    parallel::migrate(world, &partition, &grid, &mut points)?;
    let mut found = find_carriers(world, &deck, &grid, all.as_ref().unwrap_or(&points))?;
    // The points have brought theirs.
    hold_constant_forces(&deck, &mut found, &mut Points::<D>::default());
    let of_all = all.as_ref().unwrap_or(&points);
    let mut model = model_of(world, deck, grid, partition, materials, found, of_all)?;
    let names = model.slip_names();
    let slips = names.iter().any(|names| !names.is_empty());
    if points.slip.names() != names
        && points.slip.differ_in(&names, |name| name.starts_with(PREFIX))
    {
        points.slip = points.slip.renamed(names.clone(), &points.body);
    }
    if slips && points.slip.names() != names {
        let what = "the checkpoint holds no slip of this deck's contacts: it cannot be continued";
        return Err(Error::File(what.into()));
    }
    if let Some(mut all) = all {
        all.slip = Named::zeros(model.slip_names(), all.len());
        let mut counts = vec![0.0; model.deck.bodies.len()];
        points.body.iter().for_each(|&body| counts[body as usize] += 1.0);
        let counts = world.sum_slice(&counts);
        let late = late_bodies(&model.deck).into_iter().zip(counts);
        let waiting: Vec<bool> = late.map(|(late, count)| late && count == 0.0).collect();
        model.waiting = set_aside(&mut all, &waiting);
    }
    Ok((model, points))
}

/// Everything that stays the same while points move. Collective.
fn model_of<const D: usize>(
    world: &World,
    deck: Deck,
    grid: Grid<D>,
    partition: Partition<D>,
    materials: Vec<Material>,
    found: Vec<Found<D>>,
    points: &Points<D>,
) -> Result<Model<D>> {
    let Overview { stiffness, symmetric: associated } =
        Overview::of(world, &deck, &materials, points);
    let penalties = deck
        .bodies
        .iter()
        .zip(&stiffness)
        .map(|(body, &young)| {
            deck.ghost.as_ref().map_or(Penalty { stiffness: 0.0, mass: 0.0 }, |ghost| {
                Penalty::of_body(ghost, young, body.density)
            })
        })
        .collect();
    let field = deck.loads.iter().find_map(|load| match load {
        Load::MadeField(field) => Some(&field.0),
        _ => None,
    });
    let manufactured = field.map(|field| Manufactured::new(field)).transpose()?;
    let loads = deck
        .loads
        .iter()
        .zip(found)
        .map(|(load, found)| load.make(Start { world, points, found, cell: grid.cell_size() }));
    let loads = loads.collect::<Result<Vec<_>>>()?;
    let supports = surfaces::supports(world, &deck, points, grid.cell_size())?;
    let contacts =
        Arc::new(Contacts::of_deck(&deck, &stiffness, (grid.cell_size(), grid.node_count()))?);
    let facing = surfaces::facing(world, &deck, points, &contacts)?;
    let symmetric = associated
        && contacts.symmetric()
        && loads.iter().all(|load| load.symmetric())
        && !supports.iter().any(|support| support.nitsche);
    let (balance, waiting) = (Balance::default(), points.empty_like());
    Ok(Model {
        deck,
        grid,
        partition,
        materials,
        penalties,
        stiffness,
        symmetric,
        associated,
        loads,
        supports,
        facing,
        contacts,
        manufactured,
        balance,
        waiting,
    })
}

/// The grid that a deck asks for.
pub fn build_grid<const D: usize>(deck: &Deck) -> Result<Grid<D>> {
    match &deck.grid {
        model::Grid::Lattice(lattice) => {
            let axis = |values: &[f64]| std::array::from_fn(|a| values[a]);
            Ok(Grid::Lattice(Lattice {
                origin: axis(&lattice.origin),
                spacing: axis(&lattice.spacing),
                cells: std::array::from_fn(|a| lattice.cells[a]),
            }))
        }
        model::Grid::Mesh(mesh) => Ok(Grid::Mesh(Mesh::build(&mesh.source)?)),
    }
}

/// Parallelograms do not fill triangles, nor parallelepipeds tetrahedra: their gaps and overlaps
/// miss the patch test, and the stress of one state differs with the frame it is written in.
fn check_basis<const D: usize>(deck: &Deck, grid: &Grid<D>) -> Result<()> {
    if deck.method.basis.domain() != Domain::Parallelepiped || !grid.element().is_simplex() {
        return Ok(());
    }
    let (cells, parts) =
        [("triangles", "parallelograms"), ("tetrahedra", "parallelepipeds")][D - 2];
    Err(Error::Input(format!(
        "method.basis = \"cpdi1\" on {cells}: its domains are {parts}, which do not fill such \
         cells, so that a constant stress is not kept; use \"cpdi2\", whose domains do, or \"mpm\""
    )))
}

/// Every boundary's tag names nodes of the mesh.
fn check_tags<const D: usize>(deck: &Deck, grid: &Grid<D>) -> Result<()> {
    for (index, boundary) in deck.boundaries.iter().enumerate() {
        if let model::Place::Tag(tag) = &boundary.place {
            let key = format!("boundary.{index}.where.tag");
            let place = |error: Error| match error {
                Error::Input(why) => Error::Input(deck.origins.message(&key, &why)),
                other => other,
            };
            grid.tagged_nodes(tag).map_err(place)?;
        }
    }
    Ok(())
}

/// Every body has points, all inside the grid; returns their cells.
fn check_bodies<const D: usize>(
    world: &World,
    deck: &Deck,
    grid: &Grid<D>,
    points: &Points<D>,
) -> Result<Vec<usize>> {
    let mut counts = vec![0.0; deck.bodies.len()];
    for &body in &points.body {
        counts[body as usize] += 1.0;
    }
    for (body, count) in deck.bodies.iter().zip(world.sum_slice(&counts)) {
        if count == 0.0 {
            return Err(Error::Input(format!(
                "body \"{}\" has no points: its shape holds no point of its seeding inside the \
                 grid; check shape, units and points_per_cell",
                body.name
            )));
        }
    }
    let cells: Vec<usize> =
        grid.locate_each(points.position.iter()).map_while(|cell| cell).collect();
    let outside = (cells.len() < points.len()).then(|| {
        let p = cells.len();
        format!(
            "body \"{}\": point {} at {:?} lies outside the grid; enlarge the grid or move the body",
            deck.bodies[points.body[p] as usize].name, points.id[p], points.position[p]
        )
    });
    world.refuse(Error::Input, outside)?;
    Ok(cells)
}

/// What carries each load of the deck. Each point
/// load is shared equally among the points nearest to its places; of points equally
/// near (to 1e-9 of the distance scale) the one with the smallest id takes it. Error: a place further
/// from all points than the diagonal of a cell and half that of the point's domain.
fn find_carriers<const D: usize>(
    world: &World,
    deck: &Deck,
    grid: &Grid<D>,
    points: &Points<D>,
) -> Result<Vec<Found<D>>> {
    let mut all = vec![Found::default(); deck.loads.len()];
    for (index, load) in deck.loads.iter().enumerate() {
        if let Some((surface, key)) = load.surface() {
            let key = format!("load.{index}.{key}");
            all[index].surface = surfaces::of_body(world, deck, points, surface, &key)?;
        }
        let Load::Point(Point { body, nearest, .. }) = load else { continue };
        for place in nearest {
            let of = Some((*body, deck.bodies[*body].name.as_str()));
            let id = require_near(world, grid, points, of, place).map_err(|why| {
                let key = format!("load.{index}.point.nearest");
                Error::Input(deck.origins.message(&key, &why))
            })?;
            all[index].carriers.push((id, 1.0 / nearest.len() as f64));
        }
    }
    Ok(all)
}

/// Gives point forces that hold neither s nor t to the points that carry them, and to them alone.
fn hold_constant_forces<const D: usize>(
    deck: &Deck,
    found: &mut [Found<D>],
    points: &mut Points<D>,
) {
    for ((load, presence), found) in deck.loads.iter().zip(&deck.load_presence).zip(found) {
        let Load::Point(Point { nearest, force, .. }) = load else { continue };
        let passes = deck.is_staged() || *presence != Presence::default();
        if passes || force.iter().any(Expression::depends_on_time) {
            continue;
        }
        for (id, _) in std::mem::take(&mut found.carriers) {
            let Some(p) = points.id.iter().position(|own| *own == id) else { continue };
            for (held, f) in points.point_force[p].iter_mut().zip(force) {
                *held += f.as_constant().unwrap_or(f64::NAN) / nearest.len() as f64;
            }
        }
    }
}
