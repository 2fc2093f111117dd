//! Explicit dynamics over all time steps (Ghost §2.3): what a run checks, records and leaves.

use crate::deck::model::{Mass, StressUpdate};
use crate::error::{Error, Result};
use crate::output::RunState;
use crate::parallel::World;
use crate::petsc::log::Phase;
use crate::points::Points;

use super::balance;
use super::checkpointing::Moment;
use super::clock::Clock;
use super::discretise::Model;
use super::explicit_step::{Solved, advance};
use super::ledger::{Entry, Ledger, StepSums};
use super::recorder::{Ending, Recorder};
use super::time_step::{TimeSteps, stability_limit};
use super::update;

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
        let first = model.deck.method.stress_update == StressUpdate::Usf;
        let before = update::Snapshot::of(points, first);
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
        row.wall_seconds = clock.elapsed();
        if let Err(why) = ledger.book(&entry, &mut row) {
            // The row shows what happened.
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
            recorder.step(world, &row, false)?;
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
        clock.time(Phase::Migrate, || balance::settle(world, model, points, busy))?;
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
