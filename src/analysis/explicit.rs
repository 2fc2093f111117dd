//! Explicit dynamics over all time steps (Ghost §2.3): what a run checks, records and leaves.

use crate::deck::model::{Basis, DomainUpdate, Mass};
use crate::error::{Error, Result};
use crate::output::restart::run_state::RunState;
use crate::parallel::World;
use crate::points::Points;

use super::explicit_nodes::Halt;
use super::explicit_step::advance;
use super::load_steps::Moment;
use super::step_end::{self, End};
use super::time_steps::{TimeSteps, stability_limit};
use crate::record::clock::Clock;
use crate::record::ledger::{Entry, Ledger, StepSums};
use crate::record::recorder::{Ending, Recorder};
use crate::system::step_system::Model;
use crate::transfer::undo::Snapshot;
use crate::transfer::update;

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
    let mut before = Snapshot::default();
    while let Some(span) = steps.next(limit) {
        let number = steps.number();
        let at = |why: &str| format!("step {number} (to t = {:.6e} s): {why}", span.time_end);
        let (mut solved, sums) = match advance(world, model, points, &mut before, clock, span) {
            Ok(done) => done,
            Err(Halt::Failed(error)) if !matches!(error, Error::Run(_) | Error::Input(_)) => {
                return Err(error);
            }
            Err(halt) => {
                let of_deck = matches!(halt, Halt::Failed(Error::Input(_)));
                let (why, inverted) = match halt {
                    Halt::Refused(refusal) => (refusal.why, refusal.inverted),
                    Halt::Failed(error) => (error.to_string(), false),
                };
                let culprit = world.first_message(update::not_finite(points));
                let detail = culprit.map_or(String::new(), |text| format!(": {text}"));
                before.restore(points);
                let (time, state) = (span.time_start, state_of(&steps, &ledger));
                step_end::leave(world, model, points, recorder, framed, number - 1, time, state)?;
                let hint = if inverted { unstabilised(model) } else { "" };
                let text = at(&format!("{why}{detail}{hint}"));
                return if of_deck { Err(Error::Input(text)) } else { Ok(Ending::failed(text)) };
            }
        };
        let entry = Entry::unite(world, points, sums);
        let row = &mut solved.row;
        row.step = number;
        if let Err(why) = ledger.book(&entry, row) {
            // The row shows what happened.
            row.wall_seconds = clock.elapsed();
            recorder.step(world, row, false, Moment::End)?;
            let (limit, _) = limit_now(model, points);
            before.restore(points);
            let (time, state) = (span.time_start, state_of(&steps, &ledger));
            step_end::leave(world, model, points, recorder, framed, number - 1, time, state)?;
            return Ok(Ending::failed(at(&format!(
                "{why}; the time step {:.3e} s is too large (stability limit of full cells \
                 {limit:.3e} s){}",
                row.dt,
                unstabilised(model)
            ))));
        }
        if entry.overgrown > 0.0 {
            recorder.log.warn_of_step(
                number,
                "GIMP domains had grown to more than twice what their points are stretched by, and \
                 were put back to the stretch: method.domain_update = \"corners\" follows nodes that \
                 hardly hold mass; \"stretch\" or a consistent mass does not",
                &format!("({} domains)", entry.overgrown),
            );
        }
        if let Some(share) = ledger.gain(&entry) {
            recorder.log.warn_of_step(
                number,
                &gaining(model),
                &format!("({:.1} %)", 100.0 * share),
            );
        }
        steps.accept(span);
        recorder.steps_completed = number;
        recorder.linear.add(row.linear_iterations);
        if steps.follows_limit() {
            limit = limit_now(model, points).0;
        }
        let moment = if steps.next(limit).is_none() { Moment::End } else { Moment::Step };
        let end = End { number, label: span.time_end, moment, newton: false };
        let state = state_of(&steps, &ledger);
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

/// Where energy that no work brought in may come from.
fn gaining<const D: usize>(model: &Model<D>) -> String {
    let method = &model.deck.method;
    let cause = match (method.mass, method.basis, method.domain_update) {
        (Mass::Lumped, Basis::Gimp, DomainUpdate::Corners) => {
            "GIMP domains that follow nodes of little mass (domain_update = \"stretch\" does not)"
        }
        (Mass::Consistent, ..) => {
            "points that cross cells under large deformation with the FLIP share of velocity_update \
             (a number below 1 damps it), or the time step"
        }
        _ => "points that cross cells (a basis with domains is smoother), or the time step",
    };
    format!(
        "the energy has grown by more than 5 % of what was there or brought in, without work done \
         on the bodies; likely: {cause}"
    )
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
