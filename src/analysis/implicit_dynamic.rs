//! M~ a' + (1 + α) f'  - α f = 0 with f = f_int + K_G u - f_ext and a' by [`super::newmark`]:
//! implicit dynamics by Newmark's method (α = 0) or that of Hilber, Hughes and Taylor, over the
//! equations of the quasi-static analysis (Ghost §2.4) with the stabilised mass (Ghost §3.3).
//!
//! Velocities come from the points by Ghost eq. 10 and return as increments, by the deck's FLIP
//! share. The acceleration a of a step's start is that of the forces there, M~ a = f_ext - f_int:
//! one that came back from the points would have passed the grid twice, which a lumped mass and the
//! Ghost mass smooth, and energy is lost at each step. Newmark's method is then of one step, in
//! positions and velocities alone. With α < 0 the acceleration does come from the points: it holds
//! the force of the step before, by which that method damps.
//!
//! A boundary's reaction is the mean (1 - γ) r + γ r' of what it supplies at both ends of the step:
//! Σ m v' - Σ m v = dt (Σ reactions + Σ mean loads) to round-off, as M~ (v' - v) is made of just these.

use crate::error::{Error, Result};
use crate::output::restart::run_state::RunState;
use crate::output::tables::history::HistoryRow;
use crate::parallel::World;
use crate::petsc::log::Phase;
use crate::points::Points;
use crate::system::conditions::{Conditions, StepSpan};
use crate::system::terms::stress::StepPoints;

use super::equilibrium::Equilibrium;
use super::load_steps::{Moment, Stepping};
use super::newmark::{Newmark, PointRates, Rates};
use super::newton::Carried;
use super::quasi_static::{owned_forces, work_of_step};
use super::solver::Trials;
use super::step_end::{End, Solved};
use super::time_steps::stability_limit;
use super::{newton, step_end};
use crate::mass::grid_mass::{GridMass, Inverse};
use crate::record::clock::Clock;
use crate::record::ledger::{Entry, Ledger, StepSums};
use crate::record::reactions::{at_held, reactions};
use crate::record::recorder::{Ending, Recorder};
use crate::system::step_system::{Coupling, Discretisation, Model};
use crate::system::terms::linear::Inertia;
use crate::transfer::undo::Snapshot;
use crate::transfer::{mapping, update};

/// Runs all time steps and writes everything a run leaves. A step that cannot be finished ends
/// the run as `on_failure` says; what was written before stays.
pub fn run<const D: usize>(
    world: &World,
    model: &mut Model<D>,
    points: &mut Points<D>,
    recorder: &mut Recorder,
    clock: &mut Clock,
) -> Result<Ending> {
    let analysis = &model.deck.analysis;
    let steps = analysis.steps.unwrap_or(1);
    let duration = analysis.duration.unwrap_or(1.0);
    let mut stepping = Stepping::new(steps, duration, analysis.on_failure, analysis.smallest_step);
    let mass = model.deck.method.mass;
    let (_, wave_energy) = stability_limit(world, &model.grid, &model.materials, mass, points);
    let start =
        StepSums { energies: update::energies(points, &model.materials), ..StepSums::default() };
    let mut ledger = Ledger::new(&Entry::unite(world, points, start), wave_energy);
    let (mut ghost_energy, mut trials) = (0.0, Trials::default());
    let mut framed = match recorder.resumed() {
        Some(state) => {
            stepping.restore(state)?;
            trials.restore(state);
            ledger.restore(state)?;
            ghost_energy = state.number("ghost_energy")?;
            None
        }
        None => {
            recorder.frame(world, 0, 0.0, points)?;
            Some(0)
        }
    };
    let state_of = |stepping: &Stepping, trials: &Trials, ledger: &Ledger, ghost_energy: f64| {
        let mut state = RunState::new();
        stepping.save(&mut state);
        trials.save(&mut state);
        ledger.save(&mut state);
        state.set("ghost_energy", ghost_energy);
        state
    };
    let mut before = Snapshot::default();
    while let Some(span) = stepping.next_span() {
        let number = stepping.step_number();
        before.begin();
        let kept = &mut before;
        let outcome =
            solve_step(world, model, points, kept, recorder, clock, &mut trials, span, number);
        let outcome = match outcome {
            Ok(Ok(mut step)) => {
                let entry = Entry::unite(world, points, step.sums);
                match ledger.book(&entry, &mut step.solved.row) {
                    Ok(()) => Ok(step),
                    Err(why) => {
                        // The row shows what happened.
                        recorder.step(world, &step.solved.row, true, Moment::End)?;
                        Err(Fault::Final(format!(
                            "{why}; smaller steps, or analysis.hht_alpha = -0.1, damp what they \
                             excite"
                        )))
                    }
                }
            }
            Ok(Err(why)) => Err(Fault::Step(why)),
            Err(Error::Run(why)) => Err(Fault::Final(why)),
            Err(Error::Input(why)) => Err(Fault::Deck(why)),
            Err(other) => return Err(other),
        };
        let Step { mut solved, ghost_work, .. } = match outcome {
            Ok(step) => step,
            Err(fault) => {
                let culprit = world.first_message(update::not_finite(points));
                let culprit = culprit.map_or(String::new(), |text| format!(": {text}"));
                before.restore(points);
                if let Fault::Step(why) = &fault {
                    recorder.log.say(&format!("step {number} refused: {why}"));
                    if stepping.refuse() {
                        continue;
                    }
                }
                let completed = stepping.completed();
                let state = state_of(&stepping, &trials, &ledger, ghost_energy);
                let time = span.time_start;
                step_end::leave(world, model, points, recorder, framed, completed, time, state)?;
                let end = format!("t = {:.6e} s", span.time_end);
                return match fault {
                    Fault::Step(why) => Ok(Ending::stopped(format!(
                        "step {number} of {steps} ({end}) could not be solved: {why}{culprit}; the \
                         last finished step is {completed}"
                    ))),
                    Fault::Final(why) => Ok(Ending::failed(format!(
                        "step {number} of {steps} ({end}): {why}{culprit}; the last finished step \
                         is {completed}"
                    ))),
                    Fault::Deck(why) => Err(Error::Input(format!(
                        "step {number} of {steps} ({end}): {why}; the last finished step is \
                         {completed}"
                    ))),
                };
            }
        };
        let moment = stepping.accept();
        recorder.steps_completed = stepping.completed();
        ghost_energy += ghost_work;
        solved.row.energy_ghost += ghost_energy;
        solved.row.cuts = stepping.cuts;
        let end = End { number, label: span.time_end, moment, newton: true };
        let state = state_of(&stepping, &trials, &ledger, ghost_energy);
        let finished = step_end::finish(world, model, points, recorder, clock, solved, end, state)?;
        if finished.framed {
            framed = Some(number);
        }
        if let Some(ending) = finished.stop {
            return Ok(ending);
        }
    }
    Ok(Ending::completed())
}

/// Why a step is not accepted.
enum Fault {
    /// A smaller one may be.
    Step(String),
    Final(String),
    /// A formula of the deck has no value.
    Deck(String),
}

/// A step as it was solved; its row lacks the ledger's columns.
struct Step<const D: usize> {
    solved: Solved<D>,
    sums: StepSums,
    /// u K_G u / 2 of the step over all ranks, J.
    ghost_work: f64,
}

/// One time step. The inner `Err` says why it is refused; points are then as they were.
#[allow(clippy::too_many_arguments)]
fn solve_step<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &mut Points<D>,
    before: &mut Snapshot<D>,
    recorder: &mut Recorder,
    clock: &mut Clock,
    trials: &mut Trials,
    span: StepSpan,
    number: usize,
) -> Result<std::result::Result<Step<D>, String>> {
    let deck = &model.deck;
    let newmark = Newmark::new(&deck.analysis, span.time_end - span.time_start);
    let (mesh, conditions) = clock.time(Phase::Locate, || {
        Discretisation::with_conditions(world, model, points, Coupling::Matrix, span)
    })?;
    let numbering = &mesh.numbering;
    let step = mesh.step_points(points, &model.materials);
    let left_out = mesh.nodes_left_out(world, deck.method.drop_below);
    let mass =
        clock.time(Phase::Assemble, || GridMass::assemble(world, &mesh, step, deck.method.mass))?;
    let loads =
        clock.time(Phase::Assemble, || Loads::of_step(world, model, points, &mesh, span))?;
    let (start, momentum) = clock.time(Phase::Solve, || {
        let held = held_or_left_out::<D>(&conditions, &left_out);
        let inverse = mass.inverse(world, &model.grid, &mesh, &held)?;
        let carried = newmark.alpha != 0.0 && span.time_start > 0.0;
        rates_at_start(inverse, step, points, &conditions, &loads, newmark.dt, carried)
    })?;

    let (driving, problem) = clock.time(Phase::Assemble, || {
        let mut driving = mass.multiply(&mesh, &newmark.predictor(&start));
        let share = 1.0 + newmark.alpha;
        for (dof, force) in driving.iter_mut().enumerate() {
            *force += share * loads.external_end[dof] - newmark.alpha * loads.balance_start[dof];
        }
        let inertia = Inertia { share, matrix: mass.scaled(&mesh, newmark.stiffness()) };
        let problem = Equilibrium::new(
            world,
            &model.grid,
            &mesh,
            step,
            &conditions,
            &left_out,
            driving.clone(),
            newton::settings(model),
        )?;
        Ok((driving, problem.with_inertia(inertia)))
    })?;
    let solved =
        newton::solve(world, model, &mesh, points, problem, recorder, clock, trials, number)?;
    let solved = match solved {
        Ok(solved) => solved,
        Err(why) => return Ok(Err(why)),
    };
    let displacement = solved.displacement;
    let carry = || newton::carried(world, model, &mesh, points, &displacement, span);
    let Carried { made, moved_grid } = match clock.time(Phase::Update, carry)? {
        Ok(carried) => carried,
        Err(why) => return Ok(Err(why)),
    };

    let end = newmark.rates(&start, &displacement);
    // What the boundaries supply: at both ends of the step, and in the mean.
    let at_end: Vec<f64> =
        solved.internal.iter().zip(&driving).map(|(force, driving)| force - driving).collect();
    let at_start = match newmark.alpha {
        0.0 => difference(mass.multiply(&mesh, &start.acceleration), &loads.balance_start),
        _ => at_end.clone(),
    };
    let mut supplied = newmark.mean(&at_start, &at_end);
    if deck.method.flip < 1.0 {
        // Points that take the nodes' velocity lose what held nodes had of theirs.
        let taken = difference(mass.multiply(&mesh, &start.velocity), &momentum);
        let share = (1.0 - deck.method.flip) / newmark.dt;
        supplied.iter_mut().zip(taken).for_each(|(force, taken)| *force += share * taken);
    }
    let work = work_of_step::<D>(
        &conditions,
        numbering,
        &displacement,
        [&loads.external_start, &loads.external_end],
        [&at_start, &at_end],
    );
    let ghost = mass.ghost_energy(&mesh, &end.velocity);
    let energies = clock.time(Phase::Update, || {
        let step = mesh.step_points(points, &model.materials);
        let rates = PointRates::new(step, points, &start, &end, deck.method.flip);
        let updated = update::apply(
            &model.grid,
            &model.materials,
            deck.method.basis,
            deck.method.domain_update,
            numbering,
            &displacement,
            &made,
            points,
            Some(before),
        );
        world.fail_together(updated)?;
        before.velocity.replace(&mut points.velocity, rates.velocity);
        before.acceleration.replace(&mut points.acceleration, rates.acceleration);
        Ok(update::energies(points, &model.materials))
    })?;

    let driven = mass.driven_energy(&mesh, &conditions.increment, newmark.dt);
    let sums = StepSums { energies, ghost, work, driven, overgrown: 0 };
    let reaction = at_held(&conditions, &supplied);
    let row = HistoryRow {
        step: number,
        load_factor: span.factor_end,
        time: span.time_end,
        dt: newmark.dt,
        newton_iterations: solved.evaluations,
        residual: solved.residual,
        linear_iterations: solved.linear_iterations,
        reactions: reactions(
            world,
            &model.grid,
            &mesh,
            points,
            &deck.boundaries,
            &conditions,
            &supplied,
        ),
        ..mesh.row(world, points)
    };
    let ghost_work = solved.ghost_energy;
    let solved = Solved { row, mesh, displacement, reaction, moved_grid };
    Ok(Ok(Step { solved, sums, ghost_work }))
}

/// Nodal forces of a step, N: of the owned degrees of freedom.
struct Loads<const D: usize> {
    external_start: Vec<f64>,
    external_end: Vec<f64>,
    /// f_ext - f_int at the start.
    balance_start: Vec<f64>,
    /// This rank's share of it at local nodes.
    share_at_start: Vec<[f64; D]>,
}

impl<const D: usize> Loads<D> {
    /// Collective.
    fn of_step(
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        mesh: &Discretisation<D>,
        span: StepSpan,
    ) -> Result<Self> {
        let numbering = &mesh.numbering;
        let forces_start = model.point_forces(world, points, span.factor_start, span.time_start)?;
        let forces_end = model.point_forces(world, points, span.factor_end, span.time_end)?;
        let step = mesh.step_points(points, &model.materials);
        let share_at_start = mapping::force(step, &forces_start, &[], numbering.len());
        let mut balance_start = share_at_start.as_flattened().to_vec();
        numbering.halo.reverse_add(world, &mut balance_start, D)?;
        Ok(Loads {
            external_start: owned_forces(world, numbering, mesh, &forces_start)?,
            external_end: owned_forces(world, numbering, mesh, &forces_end)?,
            balance_start,
            share_at_start,
        })
    }
}

/// Components whose rates the mass does not decide: held ones, and all of nodes left out.
fn held_or_left_out<const D: usize>(conditions: &Conditions, left_out: &[bool]) -> Vec<bool> {
    let mut held = conditions.fixed.clone();
    for (local, _) in left_out.iter().enumerate().filter(|(_, out)| **out) {
        held[local * D..(local + 1) * D].fill(true);
    }
    held
}

/// Nodal velocity from the points' (Ghost eq. 10), acceleration from the forces or, `carried`, from
/// the points' too; beside them the nodes' momentum, Σ m S^T v. Collective.
#[allow(clippy::too_many_arguments)]
fn rates_at_start<const D: usize>(
    mut inverse: Inverse<'_, D>,
    step: StepPoints<'_, D>,
    points: &Points<D>,
    conditions: &Conditions,
    loads: &Loads<D>,
    dt: f64,
    carried: bool,
) -> Result<(Rates, Vec<f64>)> {
    let nodes = conditions.fixed.len() / D;
    let held_velocity: Vec<f64> = conditions.increment.iter().map(|u| u / dt).collect();
    let momentum = inverse.summed(mapping::momentum(step, &points.velocity, nodes))?;
    let velocity = inverse.solve_to_ghosts(&momentum, &held_velocity, None)?;
    let sums = match carried {
        false => loads.share_at_start.clone(),
        true => mapping::momentum(step, &points.acceleration, nodes),
    };
    let acceleration = inverse.solve(sums, &vec![0.0; nodes * D])?;
    Ok((Rates { velocity, acceleration }, momentum.into_flattened()))
}

/// a - b over the shorter of both.
fn difference(a: Vec<f64>, b: &[f64]) -> Vec<f64> {
    a.into_iter().zip(b).map(|(a, b)| a - b).collect()
}
