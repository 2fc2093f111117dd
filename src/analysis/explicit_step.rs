//! v = M~^-1 Σ m S^T v_p, a = M~^-1 (f_ext - f_int), v_p += dt S a, x_p += dt S w with w near
//! v' = v + dt a (Ghost §2.3, eq. 4-11; w: [`super::transport`]): one explicit step, stress updated
//! first, last, or last with the velocity mapped once more.

use std::time::Instant;

use crate::assembly::conditions::{Conditions, StepSpan};
use crate::assembly::internal::StepPoints;
use crate::deck::model::{Mass, StressUpdate};
use crate::error::{Error, Result};
use crate::output::history::HistoryRow;
use crate::parallel::World;
use crate::petsc::log::Phase;
use crate::points::Points;

use super::clock::Clock;
use super::discretise::{Coupling, Discretisation, Model};
use super::grid_mass::{GridMass, Inverse, require_mass};
use super::ledger::StepSums;
use super::mapping;
use super::reactions::reactions;
use super::step_end::Solved;
use super::transport::{self, Carrier};
use super::update::{self, Increments, PointEnergies};

/// One time step; the points end at their new state, not yet migrated. The row lacks the ledger's
/// columns. Collective.
pub(super) fn advance<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &mut Points<D>,
    clock: &mut Clock,
    span: StepSpan,
) -> Result<(Solved<D>, StepSums)> {
    let (deck, grid) = (&model.deck, &model.grid);
    let dt = span.time_end - span.time_start;
    let (mesh, conditions) = clock.time(Phase::Locate, || {
        let coupling = match deck.method.mass {
            Mass::Consistent => Coupling::Mass,
            Mass::Lumped => Coupling::Diagonal,
        };
        Discretisation::with_conditions(world, model, points, coupling, span)
    })?;
    let numbering = &mesh.numbering;
    let nodes = numbering.len();
    // Held components move with their boundary's mean velocity over the step.
    let held_velocity: Vec<f64> = conditions.increment.iter().map(|u| u / dt).collect();
    let at_rest = vec![0.0; nodes * D];
    // Empty without loads.
    let external = if deck.loads.is_empty() {
        Vec::new()
    } else {
        model.point_forces(world, points, span.factor_start, span.time_start)?
    };

    let mass = clock.time(Phase::Assemble, || {
        let step = mesh.step_points(points, &model.materials);
        GridMass::assemble(world, &mesh, step, deck.method.mass)
    })?;
    // Before the stress is updated last, one pass over the points gives both sums.
    let mut force = None;
    let sums = clock.time(Phase::Assemble, || {
        let step = mesh.step_points(points, &model.materials);
        if deck.method.stress_update == StressUpdate::Usf {
            return Ok(mapping::momentum(step, &points.velocity, nodes));
        }
        let (momentum, sum) = mapping::momentum_and_force(step, &external, nodes);
        force = Some(sum);
        Ok(momentum)
    })?;
    // Nodal forces with the shares of all ranks; what is pushed must have mass.
    let pushed_by = |force: &[[f64; D]]| -> Result<Vec<[f64; D]>> {
        let mut pushed = force.to_vec();
        numbering.halo.reverse_add(world, pushed.as_flattened_mut(), D)?;
        require_mass(world, grid, &mesh, &mass, &conditions.fixed, &pushed)?;
        Ok(pushed)
    };
    let mut solving = 0.0;
    let mut inverse = timed(&mut solving, || mass.inverse(world, grid, &mesh, &conditions.fixed))?;
    let mut pushed = None;
    let mut acceleration = None;
    let mut velocity = match &force {
        Some(force) => {
            pushed = Some(pushed_by(force)?);
            let both = [sums, force.clone()];
            let prescribed: [&[f64]; 2] = [&held_velocity, &at_rest];
            let [velocity, solved] = timed(&mut solving, || inverse.solve_two(both, prescribed))?;
            acceleration = Some(solved);
            velocity
        }
        None => timed(&mut solving, || inverse.solve(sums, &held_velocity))?,
    };
    if let Some(order) = deck.method.xpic {
        let step = mesh.step_points(points, &model.materials);
        velocity =
            timed(&mut solving, || sharpen(&mut inverse, step, velocity, order, &at_rest, nodes))?;
    }

    let flip = deck.method.flip;
    let carrier = transport::carrier(
        deck.method.position_update,
        deck.method.stress_update,
        deck.method.mass == Mass::Consistent,
        model.penalties.iter().any(|penalty| penalty.mass > 0.0),
        flip,
    );

    // Update stress first: with the velocity at the step's start.
    let mut energies = PointEnergies::default();
    let mut deformation = Vec::new();
    let mut deforming = Vec::new();
    if deck.method.stress_update == StressUpdate::Usf {
        let step = mesh.step_points(points, &model.materials);
        if carrier == Carrier::RemappedBack && flip < 1.0 {
            let shared = blend(flip, &points.velocity, &mapping::at_points(step, &velocity));
            let sums = mapping::momentum(step, &shared, nodes);
            deforming = timed(&mut solving, || inverse.solve(sums, &held_velocity))?;
        } else {
            deforming.clone_from(&velocity);
        }
        deforming.iter_mut().for_each(|v| *v *= dt);
        deformation = mapping::deformation_increments(step, &deforming);
        require_sound(world, points, &deformation)?;
        energies = update::deform(&model.materials, &deformation, points);
    }

    let step = mesh.step_points(points, &model.materials);
    let force = match force {
        Some(force) => force,
        None => clock
            .time(Phase::Assemble, || Ok(mapping::force(step, &external, &deformation, nodes)))?,
    };
    let pushed = match pushed {
        Some(pushed) => pushed,
        None => pushed_by(&force)?,
    };
    let acceleration = match acceleration {
        Some(acceleration) => acceleration,
        None => timed(&mut solving, || inverse.solve(force, &at_rest))?,
    };
    for (v, a) in velocity.iter_mut().zip(&acceleration) {
        *v += dt * a;
    }

    let (rate, new_velocity) = clock
        .time(Phase::Update, || Ok(mapping::push(step, &acceleration, &velocity, flip, dt)))?;

    let musl = deck.method.stress_update == StressUpdate::Musl;
    let mut moving = velocity.clone();
    let mut again = None;
    if carrier.needs_solve() || musl {
        let sums = mapping::momentum(step, &new_velocity, nodes);
        let solved = timed(&mut solving, || inverse.solve_near(sums, &held_velocity, &velocity))?;
        if carrier.needs_solve() {
            moving.clone_from(&solved);
        }
        again = Some(solved);
    }
    if matches!(carrier, Carrier::Start | Carrier::RemappedBack) {
        for (w, a) in moving.iter_mut().zip(&acceleration) {
            *w -= dt * a;
        }
    }
    let moved: Vec<f64> = moving.iter().map(|w| w * dt).collect();
    let displacement: Vec<f64> = velocity.iter().map(|v| v * dt).collect();
    let made = clock.time(Phase::Update, || {
        let deforming = match (deck.method.stress_update, &again) {
            (StressUpdate::Usf, _) => {
                let mut displacement = mapping::at_points(step, &moved);
                return Ok(Increments {
                    deformation: std::mem::take(&mut deformation),
                    displacement: std::mem::take(&mut displacement),
                });
            }
            (StressUpdate::Musl, Some(again)) => again.iter().map(|v| v * dt).collect(),
            _ => displacement.clone(),
        };
        if deforming == moved {
            return Ok(update::increments(step, &moved));
        }
        Ok(Increments {
            deformation: mapping::deformation_increments(step, &deforming),
            displacement: mapping::at_points(step, &moved),
        })
    })?;
    let why =
        clock.time(Phase::Update, || Ok(update::reason_to_refuse(world, grid, points, &made)))?;
    if let Some(why) = why {
        return Err(Error::Run(why));
    }

    let residual = residual(&mass, &mesh, &acceleration, &pushed);
    let work = point_work(&external, &made.displacement)
        + boundary_work(&conditions, &residual, &displacement);
    let ghost = mass.ghost_energy(&mesh, &velocity);
    let linear_iterations = inverse.iterations();
    clock.add(Phase::Solve, solving);
    clock.time(Phase::Update, || {
        let usf = deck.method.stress_update == StressUpdate::Usf;
        if !usf {
            update::stretch(&made.deformation, points);
        }
        let method = &deck.method;
        let followed = update::follow(
            grid,
            method.basis,
            method.domain_update,
            numbering,
            &moved,
            &made.deformation,
            points,
        );
        world.fail_together(followed)?;
        if !usf {
            energies = update::respond(&model.materials, &made.deformation, points);
        }
        update::move_points(&made.displacement, points);
        points.velocity = new_velocity;
        points.acceleration = rate;
        Ok(())
    })?;

    let reaction: Vec<f64> = residual
        .iter()
        .zip(&conditions.fixed)
        .map(|(r, fixed)| if *fixed { *r } else { 0.0 })
        .collect();
    let row = HistoryRow {
        load_factor: span.factor_end,
        time: span.time_end,
        dt,
        linear_iterations,
        reactions: reactions(
            world,
            grid,
            numbering,
            &deck.boundaries,
            &conditions,
            &residual,
            &vec![0.0; residual.len()],
        ),
        ..mesh.row(world, points)
    };
    let sums = StepSums { energies, ghost, work };
    Ok((Solved { row, mesh, displacement, reaction, moved_grid: None }, sums))
}

/// Does `work` and adds its wall seconds to `seconds`.
fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> Result<T>) -> Result<T> {
    let begin = Instant::now();
    let outcome = work();
    *seconds += begin.elapsed().as_secs_f64();
    outcome
}

/// share a + (1 - share) b at each point.
fn blend<const D: usize>(share: f64, a: &[[f64; D]], b: &[[f64; D]]) -> Vec<[f64; D]> {
    a.iter()
        .zip(b)
        .map(|(a, b)| std::array::from_fn(|i| share * a[i] + (1.0 - share) * b[i]))
        .collect()
}

/// Σ_l (1 - S+ S)^l v for l below the order: the series of XPIC(m) for the inverse of the
/// consistent mass, with S+ v_p = M^-1 Σ m S^T v_p by the lumped mass.
fn sharpen<const D: usize>(
    inverse: &mut Inverse<'_, D>,
    step: StepPoints<'_, D>,
    velocity: Vec<f64>,
    order: usize,
    at_rest: &[f64],
    nodes: usize,
) -> Result<Vec<f64>> {
    let mut sum = velocity.clone();
    let mut term = velocity;
    for _ in 1..order {
        let back = mapping::at_points(step, &term);
        let mapped = inverse.solve(mapping::momentum(step, &back, nodes), at_rest)?;
        for ((t, m), s) in term.iter_mut().zip(&mapped).zip(&mut sum) {
            *t -= m;
            *s += *t;
        }
    }
    Ok(sum)
}

/// Increments that can be applied at all. Collective.
fn require_sound<const D: usize>(
    world: &World,
    points: &Points<D>,
    deformation: &[[[f64; D]; D]],
) -> Result<()> {
    let bad = deformation.iter().enumerate().find_map(|(p, increment)| {
        let determinant = crate::tensor::dense::determinant(increment);
        let what = if !determinant.is_finite() {
            "has a displacement that is not finite".to_string()
        } else if determinant <= 0.0 {
            format!("is turned inside out (det dF = {determinant:.3e})")
        } else {
            return None;
        };
        Some(format!("point {} at {:?} {what}", points.id[p], points.position[p]))
    });
    match world.first_message(bad) {
        Some(message) => Err(Error::Run(message)),
        None => Ok(()),
    }
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
