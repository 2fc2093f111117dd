//! v = M~^-1 Σ m S^T v_p, a = M~^-1 (f_ext - f_int), v_p += dt S a, x_p += dt S w with w near
//! v' = v + dt a (Ghost §2.3, eq. 4-11; w: [`crate::transfer::transport`]): one explicit step, stress updated
//! first, last, or last with the velocity mapped once more.

use crate::basis::Domain;
use crate::deck::model::{Mass, StressUpdate};
use crate::output::tables::history::HistoryRow;
use crate::parallel::World;
use crate::petsc::log::Phase;
use crate::points::Points;
use crate::system::conditions::{Conditions, StepSpan};
use crate::system::step_points::StepPoints;
use crate::system::terms::declaration::{self, Context};
use crate::system::terms::following::Following;
use crate::system::terms::touching::{self, OfBodies};

use super::explicit_bodies::{AtNodes, meet};
use super::explicit_contact::ContactSteps;
use super::explicit_nodes::{Forces, Motion, Nodes};
use super::external::add;
use super::{damping, release};
use crate::mass::grid_mass::GridMass;
use crate::mass::light_nodes::LightNodes;
use crate::mass::solver::MassSolver;
use crate::points::Snapshot;
use crate::record::context::Run;
use crate::record::ledger::StepSums;
use crate::record::reactions::{at_held, reactions, supports_at_start, with_supports};
use crate::record::step::{Solved, grid_side};
use crate::system::model::Model;
use crate::system::shared_nodes;
use crate::system::step_system::{Coupling, Discretisation};
use crate::transfer::affine::Affine;
use crate::transfer::mapping::{self, Deformation, Pushed};
use crate::transfer::refusal::{Cause, Halt, Refusal};
use crate::transfer::soundness;
use crate::transfer::transport::{self, Carrier};
use crate::transfer::update::{self, Increments};

/// One time step; the points end at their new state, not yet migrated, and `before` holds what was
/// overwritten so far, after a failure too. `contact` goes on with a step that is done. The row
/// lacks the ledger's columns. Collective.
pub(crate) fn advance<const D: usize>(
    run: &mut Run<D>,
    before: &mut Snapshot<D>,
    solver: &mut MassSolver,
    contact: &mut ContactSteps<D>,
    span: StepSpan,
) -> std::result::Result<(Solved<D>, StepSums), Halt> {
    let Run { world, model, points, clock, .. } = run;
    before.begin();
    let (deck, grid) = (&model.deck, &model.grid);
    let (method, dt) = (&deck.method, span.time_end - span.time_start);
    let usf = method.stress_update == StressUpdate::Usf;
    let (mesh, conditions) = clock.time(Phase::Locate, || {
        let coupling = match method.mass {
            Mass::Consistent => Coupling::Mass,
            Mass::Lumped => Coupling::Diagonal,
        };
        Discretisation::with_conditions(world, model, points, coupling, span)
    })?;
    // Empty without loads.
    let external = if deck.loads.is_empty() {
        Vec::new()
    } else {
        model.point_forces(world, points, span.start())?
    };
    let (mass, light) = clock.time(Phase::Assemble, || {
        let step = mesh.step_points(points, &model.materials);
        let mut mass = GridMass::assemble(world, &mesh, step, method.mass)?;
        let light = LightNodes::find(world, &mesh, step, grid.cell_size(), &mut mass)?;
        Ok((mass, light))
    })?;
    let shared = match &mass {
        GridMass::Lumped(mass) if !model.contacts.body_pairs.is_empty() => {
            let by = (&mass[..], span.stage);
            clock.time(Phase::Assemble, || shared_nodes::find(world, model, &mesh, points, by))?
        }
        _ => Vec::new(),
    };
    let mut pressed = match Following::new(model, &mesh, points, span.start()) {
        Some(following) => following.owned_at_start(world, &mesh)?,
        None => Vec::new(),
    };
    let counter = release::counter_force(model, &mesh, points, (span.stage, span.factor_start));
    let counter = release::owned(world, &mesh, counter)?;
    let exerted = declaration::exerted(Context::new(world, model, (&mesh, points), span), None)?;
    for force in [&counter, &exerted] {
        match pressed.is_empty() {
            true => pressed.clone_from(force),
            false => add(&mut pressed, 1.0, force),
        }
    }
    let borne = supports_at_start(model, &mesh, points, span);
    let mut pushing = contact.begin(world, model, &mesh, points, span)?;
    if let Some(pushing) = &mut pushing {
        pushing.force.iter_mut().zip(&pressed).for_each(|(sum, f)| *sum += f);
    }
    let inertia = (&mass, light, solver);
    let mut nodes = Nodes::new(world, model, &mesh, &conditions, inertia, &external, dt)?;
    nodes.joined = shared_nodes::joined(&shared);
    nodes.pressed = pushing.as_ref().map_or(&pressed, |pushing| &pushing.force);

    let (mut velocity, forces) = nodes.velocity_and_forces(points, clock)?;
    let carrier = carrier(model);
    let first = match method.stress_update {
        StressUpdate::Usf => Some(nodes.deform_first(carrier, &velocity, points, before)?),
        StressUpdate::Usl | StressUpdate::Musl => None,
    };
    let Forces { mut pushed, mut acceleration } = match (forces, &first) {
        (Some(forces), _) => forces,
        (None, first) => {
            let none = Deformation::default();
            let deformation = first.as_ref().map_or(&none, |(deformation, _)| deformation);
            nodes.forces(points, deformation, clock)?
        }
    };
    let slowed = match deck.analysis.damping {
        Some(damping) => {
            let fixed = &conditions.fixed;
            damping::deceleration(world, &mesh, damping, fixed, &velocity, &acceleration)?
        }
        None => Vec::new(),
    };
    for (a, d) in acceleration.iter_mut().zip(&slowed) {
        *a -= d;
    }
    let (mut met, mut states) = (Vec::new(), Vec::new());
    if let (false, GridMass::Lumped(mass)) = (model.contacts.body_pairs.is_empty(), &mass) {
        let at = AtNodes { mass, fixed: &conditions.fixed, velocity: &velocity, dt };
        (met, states) = clock.time(Phase::Assemble, || {
            meet(world, model, &mesh, (&*points, &shared), &at, &mut acceleration, &mut pushed)
        })?;
        nodes.carry(mesh.step_points(points, &model.materials), &mut acceleration)?;
    }
    for (v, a) in velocity.iter_mut().zip(&acceleration) {
        *v += dt * a;
    }
    // The work of what resists a motion along the way is that over the mean velocity of the step: over the velocity of
    // its end alone an oscillator would lose energy in every period.
    let lag: f64 = exerted.iter().zip(&acceleration).map(|(f, a)| 0.5 * dt * dt * f * a).sum();
    let mut damped = 0.0;
    if !slowed.is_empty() {
        // By the mean velocity of the step.
        let moved = velocity.iter().zip(&acceleration).map(|(v, a)| dt * (v - 0.5 * dt * a));
        damped = damping::dissipated(&mass, &mesh, &slowed, moved);
    }
    let step = mesh.step_points(points, &model.materials);
    let Pushed { rate, velocity: new_velocity } =
        clock.time(Phase::Update, || Ok(nodes.push(step, &mut velocity, &mut acceleration)))?;
    let affine = clock.time(Phase::Update, || Ok(nodes.gather(step, &velocity)))?;
    let slopes = affine.as_ref().map_or(&[][..], |affine| &affine.velocity_gradient);
    let Motion { moved, again } =
        nodes.motion(carrier, step, &new_velocity, slopes, &velocity, &acceleration)?;
    let displacement: Vec<f64> = velocity.iter().map(|v| v * dt).collect();
    let deforming = again.as_ref().unwrap_or(&displacement);
    let (deformation, energies) = first.unzip();
    let mut made =
        clock.time(Phase::Update, || Ok(increments(step, &moved, deforming, deformation)))?;
    if let Some(pushing) = &pushing
        && let Some(what) = world.first_message(pushing.term.too_deep(points, &moved))
    {
        return Err(Refusal { cause: Cause::Penetration, what }.into());
    }
    clock.time(Phase::Update, || Ok(refuse(world, model, &mesh, points, &mut made, &moved)))??;
    let touching = pushing.as_ref().map(|pushing| pushing.term.finish_explicit(&moved));

    let mut residual = residual(&mass, &mesh, &acceleration, &pushed);
    for (r, taken) in residual.iter_mut().zip(&nodes.taken) {
        *r += taken / dt;
    }
    let pressure_work: f64 = pressed.iter().zip(&moved).map(|(f, u)| f * u).sum();
    // The force of a ring acts where its mass is, its place is the middle of its section.
    let weighed;
    let carried = if mesh.influences.hoop.is_empty() {
        &made.displacement
    } else {
        weighed = mapping::at_points(step, &moved);
        &weighed
    };
    let work = point_work(&external, carried) + pressure_work - lag
        + touching.as_ref().map_or(0.0, |touching| touching.work)
        + boundary_work(&conditions, &residual, &displacement);
    let ghost = mass.ghost_energy(&mesh, &velocity);
    let linear_iterations = nodes.inverse.iterations();
    clock.add(Phase::Solve, nodes.seconds);
    let (energies, overgrown) = clock.time(Phase::Update, || {
        if !usf {
            update::stretch(&made.deformation, points, Some(before));
        }
        let numbering = &mesh.numbering;
        let followed = update::follow(model, numbering, &moved, &made, points, Some(before));
        let overgrown = world.fail_together(followed)?;
        let energies = energies.unwrap_or_else(|| {
            update::respond(&model.materials, made.straining(), points, Some(before))
        });
        update::move_points(&made.displacement, points, Some(before));
        let of_bodies = OfBodies { states: std::mem::take(&mut states), slips: Vec::new() };
        touching::keep(&model.contacts, touching.as_ref(), of_bodies, points, Some(before));
        before.velocity.replace(&mut points.velocity, new_velocity);
        before.acceleration.replace(&mut points.acceleration, rate);
        if let Some(Affine { velocity_gradient, spread }) = affine {
            before.velocity_gradient.replace(&mut points.velocity_gradient, velocity_gradient);
            before.spread.replace(&mut points.spread, spread);
        }
        Ok((energies, overgrown))
    })?;

    let reaction = at_held(&conditions, &residual);
    let mut row = HistoryRow {
        stage: span.stage,
        load_factor: span.factor_end,
        time: span.time_end,
        dt,
        linear_iterations,
        reactions: with_supports(
            world,
            &borne,
            reactions(world, grid, &mesh, points, &deck.boundaries, &conditions, &residual),
        ),
        ..grid_side(world, &mesh, points)
    };
    if !met.is_empty() {
        contact.book_bodies(world, &met, &mut row);
    }
    if let Some(touching) = &touching {
        contact.book(world, touching, &mut row);
    }
    let driven = mass.driven_energy(&mesh, &conditions.increment, dt);
    let sums = StepSums { energies, ghost, work, driven, overgrown, damped };
    let poses = contact.poses(model, span);
    Ok((Solved { row, mesh, displacement, reaction, moved_grid: None, poses }, sums))
}

/// What carries the points of this deck.
fn carrier<const D: usize>(model: &Model<D>) -> Carrier {
    let method = &model.deck.method;
    transport::carrier(
        method.position_update,
        method.stress_update,
        method.mass == Mass::Consistent,
        model.penalties.iter().any(|penalty| penalty.mass > 0.0),
        method.flip,
    )
}

/// What the points gain by the nodal increments; `deformation`: what they have taken already.
fn increments<const D: usize>(
    step: StepPoints<'_, D>,
    moved: &[f64],
    deforming: &[f64],
    deformation: Option<Deformation<D>>,
) -> Increments<D> {
    if deformation.is_none() && deforming == moved {
        return update::increments(step, moved);
    }
    // With the stress updated first, b_e has followed already.
    let later = deformation.is_none();
    let deformation =
        deformation.unwrap_or_else(|| mapping::displacement_gradients(step, deforming));
    let averaged = if later {
        update::averaged(&mapping::common_changes(step, deforming, None), &deformation)
    } else {
        Deformation::default()
    };
    Increments {
        deformation,
        averaged,
        displacement: mapping::displacements(step, moved),
        corners: Vec::new(),
    }
}

/// Refuses increments that cannot be applied. Collective.
fn refuse<const D: usize>(
    world: &World,
    model: &Model<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    made: &mut Increments<D>,
    moved: &[f64],
) -> std::result::Result<(), Halt> {
    let (grid, method) = (&model.grid, &model.deck.method);
    soundness::require_sound(world, grid, &model.deck.boundaries, points, made)?;
    // With the stress updated first the points have the step's deformation already.
    let usf = method.stress_update == StressUpdate::Usf;
    let mut still = (usf && method.basis.domain() == Domain::Parallelepiped).then(|| Increments {
        deformation: Deformation {
            blocks: vec![[[0.0; D]; D]; points.len()],
            ..Deformation::default()
        },
        averaged: Deformation::default(),
        displacement: made.displacement.clone(),
        corners: Vec::new(),
    });
    let made = still.as_mut().unwrap_or(made);
    let numbering = &mesh.numbering;
    let grids = [grid; 2];
    soundness::require_sound_domains(world, grids, method.basis, numbering, moved, points, made)?;
    Ok(())
}

/// M a - f over the owned degrees of freedom: what boundaries supply where they hold.
fn residual<const D: usize>(
    mass: &GridMass,
    mesh: &Discretisation<D>,
    acceleration: &[f64],
    force: &[[f64; D]],
) -> Vec<f64> {
    let mut residual = mass.multiply(mesh, acceleration);
    for (r, f) in residual.iter_mut().zip(force.as_flattened()) {
        *r -= f;
    }
    residual
}

fn point_work<const D: usize>(external: &[[f64; D]], displacement: &[[f64; D]]) -> f64 {
    external.as_flattened().iter().zip(displacement.as_flattened()).map(|(f, u)| f * u).sum()
}

fn boundary_work(conditions: &Conditions, residual: &[f64], displacement: &[f64]) -> f64 {
    residual
        .iter()
        .zip(displacement)
        .zip(&conditions.fixed)
        .map(|((r, u), fixed)| if *fixed { r * u } else { 0.0 })
        .sum()
}
