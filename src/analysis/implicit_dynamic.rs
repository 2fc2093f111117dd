//! M~ a' + (1 + α) f'  - α f = 0 with f = f_int + K_G u - f_ext, Newmark's
//! a' = u/(β dt²) - v/(β dt) - (1/(2β) - 1) a and v' = v + dt ((1 - γ) a + γ a'): implicit
//! dynamics by Newmark's method (α = 0) or that of Hilber, Hughes and Taylor, over the equations
//! of the quasi-static analysis (Ghost §2.4) with the stabilised mass (Ghost §3.3).
//!
//! Velocity and acceleration come from the points by Ghost eq. 10 and return as increments
//! (velocity, by the deck's FLIP share) and values (acceleration).

use crate::assembly::conditions::StepSpan;
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::output::RunState;
use crate::output::history::HistoryRow;
use crate::parallel::World;
use crate::petsc::log::Phase;
use crate::points::Points;

use super::balance::{self};
use super::checkpointing::Moment;
use super::clock::Clock;
use super::discretise::{Coupling, Discretisation, Model};
use super::equilibrium::{Equilibrium, Inertia};
use super::grid_mass::GridMass;
use super::ledger::{Entry, Ledger, StepSums};
use super::newton::Carried;
use super::quasi_static::{owned_forces, work_of_step};
use super::reactions::reactions;
use super::recorder::{Ending, Recorder};
use super::stepping::Stepping;
use super::time_step::stability_limit;
use super::{mapping, newton, update};

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
    let mut ghost_energy = 0.0;
    let mut framed = match recorder.resumed() {
        Some(state) => {
            stepping.restore(state)?;
            ledger.restore(state)?;
            ghost_energy = state.number("ghost_energy")?;
            None
        }
        None => {
            recorder.frame(world, 0, 0.0, points)?;
            Some(0)
        }
    };
    let state_of = |stepping: &Stepping, ledger: &Ledger, ghost_energy: f64| {
        let mut state = RunState::new();
        stepping.save(&mut state);
        ledger.save(&mut state);
        state.set("ghost_energy", ghost_energy);
        state
    };
    let mut before = update::Snapshot::default();
    while let Some(span) = stepping.next_span() {
        let number = stepping.step_number();
        // The points are as they were where a step fails.
        before.record(points, model.deck.method.basis);
        let outcome = match solve_step(world, model, points, recorder, clock, span, number) {
            Ok(Ok(solved)) => {
                let mut row = solved.row.clone();
                let entry = Entry::unite(world, points, solved.sums);
                match ledger.book(&entry, &mut row) {
                    Ok(()) => Ok((solved, row)),
                    Err(why) => {
                        // The row shows what happened.
                        recorder.step(world, &row, true)?;
                        Err(Fault::Final(format!(
                            "{why}; smaller steps, or analysis.hht_alpha = -0.1, damp what they \
                             excite"
                        )))
                    }
                }
            }
            Ok(Err(why)) => Err(Fault::Step(why)),
            Err(Error::Run(why)) => Err(Fault::Final(why)),
            Err(other) => return Err(other),
        };
        let (solved, mut row) = match outcome {
            Ok(done) => done,
            Err(fault) => {
                before.restore(points);
                if let Fault::Step(why) = &fault {
                    recorder.log.say(&format!("step {number} refused: {why}"));
                    if stepping.refuse() {
                        continue;
                    }
                }
                let completed = stepping.completed();
                if framed != Some(completed) {
                    recorder.frame(world, completed, span.time_start, points)?;
                }
                let state = state_of(&stepping, &ledger, ghost_energy);
                recorder.keep_last_state(world, model, points, state)?;
                let culprit = world.first_message(update::not_finite(points));
                let culprit = culprit.map_or(String::new(), |text| format!(": {text}"));
                let end = format!("t = {:.6e} s", span.time_end);
                return Ok(match fault {
                    Fault::Step(why) => Ending::stopped(format!(
                        "step {number} of {steps} ({end}) could not be solved: {why}{culprit}; the \
                         last finished step is {completed}"
                    )),
                    Fault::Final(why) => Ending::failed(format!(
                        "step {number} of {steps} ({end}): {why}{culprit}; the last finished step \
                         is {completed}"
                    )),
                });
            }
        };
        let ended = stepping.accept();
        recorder.steps_completed = stepping.completed();
        ghost_energy += solved.ghost_work;
        row.energy_ghost += ghost_energy;
        row.cuts = stepping.cuts;
        let last = stepping.next_span().is_none();
        clock.time(Phase::Output, || {
            if ended && recorder.wants_frame(number, span.time_end, last) {
                let time = span.time_end;
                recorder.frame(world, number, time, points)?;
                framed = Some(number);
                let (displacement, reaction) = (&solved.displacement, &solved.reaction);
                recorder.grid_frame(
                    world,
                    model,
                    &solved.mesh,
                    number,
                    time,
                    displacement,
                    reaction,
                )?;
            }
            Ok(())
        })?;
        if let Some(grid) = solved.moved_grid {
            model.grid = grid;
        }
        let busy = clock.busy();
        let settle = || balance::settle(world, model, points, busy);
        row.moved_points = clock.time(Phase::Migrate, settle)?.moved;
        row.wall_seconds = clock.elapsed();
        clock.time(Phase::Output, || recorder.step(world, &row, true))?;
        let moment = match (last, ended) {
            (true, _) => Moment::End,
            (_, true) => Moment::Step,
            (_, false) => Moment::PartOfStep,
        };
        let state = state_of(&stepping, &ledger, ghost_energy);
        let stop =
            clock.time(Phase::Output, || recorder.end_step(world, model, points, moment, state))?;
        if let Some(ending) = stop {
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
}

/// A finished step: its row but for the ledger, and the grid as it was solved.
struct Solved<const D: usize> {
    row: HistoryRow,
    sums: StepSums,
    /// u K_G u / 2 of the step over all ranks, J.
    ghost_work: f64,
    mesh: Discretisation<D>,
    displacement: Vec<f64>,
    reaction: Vec<f64>,
    /// The mesh where it goes after the step, if it moves.
    moved_grid: Option<Grid<D>>,
}

/// Newmark's numbers for a step of `dt`.
#[derive(Clone, Copy)]
struct Newmark {
    beta: f64,
    gamma: f64,
    /// In [-1/3, 0].
    alpha: f64,
    dt: f64,
}

impl Newmark {
    /// Acceleration and velocity at the end for the increment `u`.
    fn end(&self, u: f64, v: f64, a: f64) -> (f64, f64) {
        let Newmark { beta, gamma, dt, .. } = *self;
        let end = u / (beta * dt * dt) - self.start(v, a);
        (end, v + dt * ((1.0 - gamma) * a + gamma * end))
    }

    /// What the acceleration at the end owes to the start, with its sign reversed.
    fn start(&self, v: f64, a: f64) -> f64 {
        v / (self.beta * self.dt) + (0.5 / self.beta - 1.0) * a
    }
}

/// One time step. The inner `Err` says why it is refused; points are then as they were.
fn solve_step<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &mut Points<D>,
    recorder: &mut Recorder,
    clock: &mut Clock,
    span: StepSpan,
    number: usize,
) -> Result<std::result::Result<Solved<D>, String>> {
    let deck = &model.deck;
    let newmark = Newmark {
        beta: deck.analysis.newmark_beta,
        gamma: deck.analysis.newmark_gamma,
        alpha: deck.analysis.hht_alpha,
        dt: span.time_end - span.time_start,
    };
    let (mesh, conditions) = clock.time(Phase::Locate, || {
        Discretisation::with_conditions(world, model, points, Coupling::Matrix, span)
    })?;
    let numbering = &mesh.numbering;
    let (nodes, owned) = (numbering.len(), numbering.owned * D);
    let step = mesh.step_points(points, &model.materials);
    let forces_at = |factor, time| model.point_forces(world, points, factor, time);
    let point_forces_start = forces_at(span.factor_start, span.time_start)?;
    let external_start = owned_forces(world, numbering, &mesh, &point_forces_start)?;
    let forces_end = forces_at(span.factor_end, span.time_end)?;
    let external_end = owned_forces(world, numbering, &mesh, &forces_end)?;

    let left_out = mesh.nodes_left_out(world, deck.method.drop_below);
    let mut held = conditions.fixed.clone();
    for (local, _) in left_out.iter().enumerate().filter(|(_, out)| **out) {
        held[local * D..(local + 1) * D].fill(true);
    }
    let mass =
        clock.time(Phase::Assemble, || GridMass::assemble(world, &mesh, step, deck.method.mass))?;
    // f_ext - f_int at the start, complete on the owners.
    let mut balance_start = mapping::force(step, &point_forces_start, &[], nodes);
    let at_rest = vec![0.0; nodes * D];
    let held_velocity: Vec<f64> = conditions.increment.iter().map(|u| u / newmark.dt).collect();
    let (velocity, acceleration) = clock.time(Phase::Solve, || {
        let mut inverse = mass.inverse(world, &model.grid, &mesh, &held)?;
        let sums = mapping::momentum(step, &points.velocity, nodes);
        let velocity = inverse.solve(sums, &held_velocity)?;
        // The first step has no history: its acceleration is that of the forces.
        let sums = match span.time_start {
            0.0 => balance_start.clone(),
            _ => mapping::momentum(step, &points.acceleration, nodes),
        };
        Ok((velocity, inverse.solve(sums, &at_rest)?))
    })?;
    numbering.halo.reverse_add(world, balance_start.as_flattened_mut(), D)?;

    let predictor: Vec<f64> =
        velocity.iter().zip(&acceleration).map(|(v, a)| newmark.start(*v, *a)).collect();
    let mut driving = mass.multiply(&mesh, &predictor);
    for (dof, force) in driving.iter_mut().enumerate() {
        *force += (1.0 + newmark.alpha) * external_end[dof]
            - newmark.alpha * balance_start.as_flattened()[dof];
    }
    let inertia = Inertia {
        share: 1.0 + newmark.alpha,
        matrix: mass.scaled(&mesh, 1.0 / (newmark.beta * newmark.dt.powi(2))),
    };
    let problem = Equilibrium::new(
        world,
        &mesh,
        step,
        &conditions,
        &left_out,
        driving.clone(),
        newton::settings(model),
    )?
    .with_inertia(inertia);
    let solved = newton::solve(world, model, &mesh, points, problem, recorder, clock, number)?;
    let solved = match solved {
        Ok(solved) => solved,
        Err(why) => return Ok(Err(why)),
    };
    let displacement = solved.displacement;

    let carried = match newton::carried(world, model, &mesh, points, &displacement, span)? {
        Ok(carried) => carried,
        Err(why) => return Ok(Err(why)),
    };
    let Carried { made, moved_grid } = carried;

    let (mut end_acceleration, mut end_velocity) = (at_rest.clone(), at_rest);
    for dof in 0..nodes * D {
        (end_acceleration[dof], end_velocity[dof]) =
            newmark.end(displacement[dof], velocity[dof], acceleration[dof]);
    }
    let change: Vec<f64> = end_velocity.iter().zip(&velocity).map(|(new, old)| new - old).collect();
    let carried = mapping::at_points(step, &end_velocity);
    let gained = mapping::at_points(step, &change);
    let new_acceleration = mapping::at_points(step, &end_acceleration);
    // What the boundaries supply.
    let supplied: Vec<f64> = (0..owned).map(|dof| solved.internal[dof] - driving[dof]).collect();
    let work = work_of_step::<D>(
        &conditions,
        numbering,
        &displacement,
        [&external_start, &external_end],
        [&supplied, &supplied],
    );
    let ghost = mass.ghost_energy(&mesh, &end_velocity);
    clock.time(Phase::Update, || {
        let updated = update::apply(
            &model.grid,
            &model.materials,
            deck.method.basis,
            deck.method.domain_update,
            numbering,
            &displacement,
            &made,
            points,
        );
        world.fail_together(updated)
    })?;
    let flip = deck.method.flip;
    for ((v, gain), grid) in points.velocity.iter_mut().zip(&gained).zip(&carried) {
        for i in 0..D {
            v[i] = flip * (v[i] + gain[i]) + (1.0 - flip) * grid[i];
        }
    }
    points.acceleration = new_acceleration;

    let sums = StepSums { energies: update::energies(points, &model.materials), ghost, work };
    let reaction: Vec<f64> = supplied
        .iter()
        .zip(&conditions.fixed)
        .map(|(force, fixed)| if *fixed { *force } else { 0.0 })
        .collect();
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
            numbering,
            &deck.boundaries,
            &conditions,
            &supplied,
            &vec![0.0; owned],
        ),
        ..mesh.row(world, points)
    };
    let ghost_work = solved.ghost_energy;
    Ok(Ok(Solved { row, sums, ghost_work, mesh, displacement, reaction, moved_grid }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newmark_of_the_average_acceleration_is_exact_for_a_constant_one() {
        let newmark = Newmark { beta: 0.25, gamma: 0.5, alpha: 0.0, dt: 0.3 };
        let (v, a) = (2.0, -1.5);
        let (end, velocity) = newmark.end(v * 0.3 + 0.5 * a * 0.09, v, a);
        assert!((end - a).abs() < 1e-13 && (velocity - (v + 0.3 * a)).abs() < 1e-13);
    }
}
