//! v = M~^-1 Σ m S^T v_p, a = M~^-1 (f_ext - f_int), v_p += dt S a, x_p += dt S (v + dt a)
//! (Ghost §2.3, eq. 4-11): explicit dynamics, stress updated first, last, or last with the
//! velocity mapped once more.

use std::time::Instant;

use crate::assembly::conditions::{Conditions, StepSpan};
use crate::assembly::external::point_forces;
use crate::deck::model::{AnalysisType, Mass, StressUpdate};
use crate::error::{Error, Result};
use crate::output::RunState;
use crate::output::history::HistoryRow;
use crate::parallel::World;
use crate::petsc::log::Phase;
use crate::points::Points;

use super::balance::{self, imbalance};
use super::checkpointing::Moment;
use super::clock::Clock;
use super::discretise::{Coupling, Discretisation, Model};
use super::grid_mass::{GridMass, Inverse, require_mass};
use super::ledger::{Entry, Ledger, StepSums};
use super::mapping;
use super::reactions::reactions;
use super::recorder::{Ending, Recorder};
use super::time_step::{TimeSteps, stability_limit};
use super::update::{self, Increments, PointEnergies};

/// Runs all time steps and writes everything a run leaves.
pub fn run<const D: usize>(
    world: &World,
    model: &mut Model<D>,
    points: &mut Points<D>,
    recorder: &mut Recorder,
    clock: &mut Clock,
) -> Result<Ending> {
    let kind = model.deck.method.mass;
    let limit_now = |model: &Model<D>, points: &Points<D>| {
        stability_limit(world, &model.grid, &model.materials, kind, points)
    };
    let mut steps = TimeSteps::new(&model.deck.analysis);
    let (mut limit, wave_energy) = limit_now(model, points);
    let start =
        StepSums { energies: update::energies(points, &model.materials), ..StepSums::default() };
    let mut ledger = Ledger::new(&Entry::unite(world, points, start), wave_energy);
    let mut framed = match recorder.resumed() {
        Some(state) => {
            steps.restore(state)?;
            ledger.restore(state)?;
            None
        }
        None => {
            recorder.frame(world, 0, 0.0, points)?;
            Some(0)
        }
    };
    let state_of = |steps: &TimeSteps, ledger: &Ledger| {
        let mut state = RunState::new();
        steps.save(&mut state);
        ledger.save(&mut state);
        state
    };
    while let Some(span) = steps.next(limit) {
        let number = steps.number();
        let at = |why: &str| format!("step {number} (to t = {:.6e} s): {why}", span.time_end);
        // The points are as they were where a step fails.
        let before = update::Snapshot::of(points);
        let (mut solved, sums) = match advance(world, model, points, clock, span) {
            Ok(done) => done,
            Err(Error::Run(why)) => {
                before.restore(points);
                if framed != Some(number - 1) {
                    recorder.frame(world, number - 1, span.time_start, points)?;
                }
                recorder.keep_last_state(world, model, points, state_of(&steps, &ledger))?;
                let culprit = world.first_message(not_finite(points));
                let detail = culprit.map_or(String::new(), |text| format!(": {text}"));
                return Ok(Ending::failed(at(&format!("{why}{detail}"))));
            }
            Err(other) => return Err(other),
        };
        let entry = Entry::unite(world, points, sums);
        let mut row = std::mem::take(&mut solved.row);
        row.step = number;
        if let Err(why) = ledger.book(&entry, &mut row) {
            // The row shows what happened.
            row.wall_seconds = clock.elapsed();
            recorder.step(world, &row, false)?;
            let (limit, _) = limit_now(model, points);
            return Ok(Ending::failed(at(&format!(
                "{why}; the time step {:.3e} s is too large (stability limit of full cells \
                 {limit:.3e} s){}",
                row.dt,
                unstabilised(model)
            ))));
        }
        steps.accept(span);
        recorder.steps_completed = number;
        if steps.follows_limit() {
            limit = limit_now(model, points).0;
        }
        let last = steps.next(limit).is_none();
        clock.time(Phase::Output, || {
            if recorder.wants_frame(number, span.time_end, last) {
                let time = span.time_end;
                recorder.frame(world, number, time, points)?;
                framed = Some(number);
                let Solved { mesh, displacement, reaction, .. } = &solved;
                recorder.grid_frame(world, model, mesh, number, time, displacement, reaction)?;
            }
            Ok(())
        })?;
        let busy = clock.busy();
        let settle = || balance::settle(world, model, points, busy);
        row.moved_points = clock.time(Phase::Migrate, settle)?.moved;
        row.wall_seconds = clock.elapsed();
        clock.time(Phase::Output, || recorder.step(world, &row, false))?;
        let moment = if last { Moment::End } else { Moment::Step };
        let state = state_of(&steps, &ledger);
        let stop =
            clock.time(Phase::Output, || recorder.end_step(world, model, points, moment, state))?;
        if let Some(ending) = stop {
            return Ok(ending);
        }
    }
    Ok(Ending::completed())
}

/// The first point whose state is not a number.
fn not_finite<const D: usize>(points: &Points<D>) -> Option<String> {
    let p = (0..points.len()).find(|&p| {
        let sound = points.velocity[p].iter().chain(&points.kirchhoff_stress[p]);
        !sound.chain(&points.position[p]).all(|value| value.is_finite())
    })?;
    Some(format!(
        "point {} at {:?} m has velocity {:?} m/s, which with its stress is not finite",
        points.id[p], points.position[p], points.velocity[p]
    ))
}

/// What makes a consistent mass without Ghost share unstable is not the time step.
fn unstabilised<const D: usize>(model: &Model<D>) -> &'static str {
    let none = model.penalties.iter().all(|penalty| penalty.mass == 0.0);
    if none && model.deck.method.mass == Mass::Consistent {
        "; the consistent mass is not stabilised: [ghost] mass_factor = 0.25 bounds its condition"
    } else {
        ""
    }
}

/// A finished step: its row but for the ledger, and the grid as it was solved.
struct Solved<const D: usize> {
    row: HistoryRow,
    mesh: Discretisation<D>,
    displacement: Vec<f64>,
    reaction: Vec<f64>,
}

/// One time step; the points end at their new state, not yet migrated. Collective.
fn advance<const D: usize>(
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
            Mass::Consistent => Coupling::Matrix,
            Mass::Lumped => Coupling::Diagonal,
        };
        let mesh = Discretisation::with_coupling(world, model, points, coupling)?;
        let conditions = Conditions::evaluate(
            world,
            grid,
            deck.method.basis,
            &mesh.numbering,
            points,
            &deck.boundaries,
            span,
        )?;
        Ok((mesh, conditions))
    })?;
    let numbering = &mesh.numbering;
    let nodes = numbering.len();
    // Held components move with their boundary's mean velocity over the step.
    let held_velocity: Vec<f64> = conditions.increment.iter().map(|u| u / dt).collect();
    let at_rest = vec![0.0; nodes * D];
    let external = world.fail_together(external_forces(model, points, span))?;

    let mass = clock.time(Phase::Assemble, || {
        let step = mesh.step_points(points, &model.materials);
        GridMass::assemble(world, &mesh, step, deck.method.mass)
    })?;
    let mut solving = 0.0;
    let mut timed = |work: &mut dyn FnMut() -> Result<Vec<f64>>| {
        let begin = Instant::now();
        let outcome = work();
        solving += begin.elapsed().as_secs_f64();
        outcome
    };
    let mut inverse = None;
    let mut velocity = timed(&mut || {
        let inverse = inverse.insert(mass.inverse(world, grid, &mesh, &conditions.fixed)?);
        let step = mesh.step_points(points, &model.materials);
        let sums = mapping::momentum(step, &points.velocity, nodes);
        let velocity = inverse.solve(sums, &held_velocity)?;
        match deck.method.xpic {
            Some(order) => sharpen(inverse, step, velocity, order, &at_rest, nodes),
            None => Ok(velocity),
        }
    })?;
    let Some(inverse) = inverse.as_mut() else {
        return Err(Error::Run("the mass matrix was not prepared".into()));
    };

    // Update stress first: with the velocity at the step's start.
    let mut energies = PointEnergies::default();
    let mut deformation = Vec::new();
    let mut deforming = Vec::new();
    if deck.method.stress_update == StressUpdate::Usf {
        deforming = velocity.iter().map(|v| v * dt).collect();
        let step = mesh.step_points(points, &model.materials);
        deformation = mapping::deformation_increments(step, &deforming);
        require_sound(world, points, &deformation)?;
        energies = update::deform(&model.materials, &deformation, points);
    }

    let step = mesh.step_points(points, &model.materials);
    let force = mapping::force(step, &external, &deformation, nodes);
    let mut pushed = force.clone();
    numbering.halo.reverse_add(world, pushed.as_flattened_mut(), D)?;
    require_mass(world, grid, &mesh, &mass, &conditions.fixed, &pushed)?;
    let acceleration = timed(&mut || inverse.solve(force.clone(), &at_rest))?;
    for (v, a) in velocity.iter_mut().zip(&acceleration) {
        *v += dt * a;
    }

    let rate = mapping::at_points(step, &acceleration);
    let carried = mapping::at_points(step, &velocity);
    let new_velocity: Vec<[f64; D]> = points
        .velocity
        .iter()
        .zip(&rate)
        .zip(&carried)
        .map(|((v, a), grid)| {
            let flip = deck.method.flip;
            std::array::from_fn(|i| match deck.method.xpic {
                Some(_) => grid[i],
                None => flip * (v[i] + dt * a[i]) + (1.0 - flip) * grid[i],
            })
        })
        .collect();
    let displacement: Vec<f64> = velocity.iter().map(|v| v * dt).collect();
    match deck.method.stress_update {
        StressUpdate::Usf => {}
        StressUpdate::Usl => deforming.clone_from(&displacement),
        StressUpdate::Musl => {
            let again = timed(&mut || {
                inverse.solve(mapping::momentum(step, &new_velocity, nodes), &held_velocity)
            })?;
            deforming = again.iter().map(|v| v * dt).collect();
        }
    }
    if deck.method.stress_update != StressUpdate::Usf {
        deformation = mapping::deformation_increments(step, &deforming);
    }
    let made = Increments {
        deformation,
        displacement: carried.iter().map(|v| v.map(|v| v * dt)).collect(),
    };
    if let Some(why) = update::reason_to_refuse(world, grid, points, &made) {
        return Err(Error::Run(why));
    }

    let residual = residual(&mass, &mesh, &acceleration, &pushed);
    let work = point_work(&external, &made.displacement)
        + boundary_work(&conditions, &residual, &displacement);
    let ghost = mass.ghost_energy(&mesh, &velocity);
    let linear_iterations = inverse.iterations();
    clock.add(Phase::Solve, solving);
    clock.time(Phase::Update, || {
        if deck.method.stress_update != StressUpdate::Usf {
            energies = update::deform(&model.materials, &made.deformation, points);
        }
        let method = &deck.method;
        let followed = update::follow(
            grid,
            method.basis,
            method.domain_update,
            numbering,
            &deforming,
            &made.deformation,
            points,
        );
        world.fail_together(followed)?;
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
        ghost_faces: world.sum_usize(mesh.faces.len()),
        populated_cells: world.sum_usize(mesh.populated.owned.len()),
        imbalance: imbalance(world, points.len()),
        ..HistoryRow::default()
    };
    let sums = StepSums { energies, ghost, work };
    Ok((Solved { row, mesh, displacement, reaction }, sums))
}

/// Force on each point, empty where there is no load.
fn external_forces<const D: usize>(
    model: &Model<D>,
    points: &Points<D>,
    span: StepSpan,
) -> Result<Vec<[f64; D]>> {
    if model.deck.loads.is_empty() {
        return Ok(Vec::new());
    }
    point_forces(
        points,
        &model.materials,
        &model.deck.loads,
        model.manufactured.as_ref(),
        AnalysisType::Explicit,
        span.factor_start,
        span.time_start,
    )
}

/// Σ_l (1 - S+ S)^l v for l below the order: the series of XPIC(m) for the inverse of the
/// consistent mass, with S+ v_p = M^-1 Σ m S^T v_p by the lumped mass.
fn sharpen<const D: usize>(
    inverse: &mut Inverse<'_, D>,
    step: crate::assembly::internal::StepPoints<'_, D>,
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
