//! Implicit quasi-static analysis (Lagrangian §6.3-6.5, Ghost §2.4): locate, map, number,
//! {assemble, solve}*, update, migrate, write.

use crate::deck::Deck;
use crate::error::Result;
use crate::loads::point_forces::map_forces;
use crate::output::restart::run_state::RunState;
use crate::output::tables::history::HistoryRow;
use crate::parallel::World;
use crate::petsc::log::Phase;
use crate::points::Points;
use crate::system::conditions::{Conditions, StepSpan};
use crate::system::numbering::Numbering;

use super::equilibrium::Equilibrium;
use super::load_steps::Stepping;
use super::newton::Carried;
use super::solver::Trials;
use super::step_end::{End, Solved};
use super::{newton, step_end};
use crate::record::clock::Clock;
use crate::record::reactions::{at_held, reactions};
use crate::record::recorder::{Ending, Recorder};
use crate::record::verify;
use crate::system::step_system::{Coupling, Discretisation, Model};
use crate::transfer::update;

/// Runs all load steps and writes everything a run leaves. A step that cannot be finished ends
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
    // The load factor serves as the time of formulas.
    let mut stepping = Stepping::new(steps, 1.0, analysis.on_failure, analysis.smallest_step);
    let (mut totals, mut trials) = (Totals::default(), Trials::default());
    match recorder.resumed() {
        Some(state) => {
            stepping.restore(state)?;
            trials.restore(state);
            totals.restore(state)?;
        }
        None => recorder.frame(world, 0, 0.0, points)?,
    }
    let state_of = |stepping: &Stepping, trials: &Trials, totals: &Totals| {
        let mut state = RunState::new();
        stepping.save(&mut state);
        trials.save(&mut state);
        totals.save(&mut state);
        state
    };
    while let Some(span) = stepping.next_span() {
        let number = stepping.step_number();
        let solved = solve_step(world, model, points, recorder, clock, &mut trials, span, number)?;
        let mut solved = match solved {
            Ok(solved) => solved,
            Err(why) => {
                recorder.log.say(&format!("step {number} refused: {why}"));
                if stepping.refuse() {
                    continue;
                }
                let state = state_of(&stepping, &trials, &totals);
                recorder.keep_last_state(world, model, points, state)?;
                return Ok(Ending::stopped(format!(
                    "step {number} of {steps} could not be solved: {why}; the last finished step \
                     is {}",
                    stepping.completed()
                )));
            }
        };
        let moment = stepping.accept();
        recorder.steps_completed = stepping.completed();
        totals.add(&mut solved.row);
        solved.row.cuts = stepping.cuts;
        let end = End { number, label: span.factor_end, moment, newton: true };
        let state = state_of(&stepping, &trials, &totals);
        let finished = step_end::finish(world, model, points, recorder, clock, solved, end, state)?;
        if let Some(ending) = finished.stop {
            return Ok(ending);
        }
    }
    Ok(Ending::completed())
}

/// The first load step of the deck.
pub fn first_span(deck: &Deck) -> StepSpan {
    let factor_end = 1.0 / deck.analysis.steps.unwrap_or(1) as f64;
    StepSpan { factor_start: 0.0, factor_end, time_start: 0.0, time_end: factor_end }
}

/// Sums over the run so far.
#[derive(Default)]
struct Totals {
    work: f64,
    ghost: f64,
}

impl Totals {
    /// Adds a step's work and Ghost energy; its row then tells those of the run.
    fn add(&mut self, row: &mut HistoryRow) {
        self.work += row.work_external;
        self.ghost += row.energy_ghost;
        (row.work_external, row.energy_ghost) = (self.work, self.ghost);
    }

    fn save(&self, state: &mut RunState) {
        state.set("totals.work", self.work);
        state.set("totals.ghost", self.ghost);
    }

    fn restore(&mut self, state: &RunState) -> Result<()> {
        self.work = state.number("totals.work")?;
        self.ghost = state.number("totals.ghost")?;
        Ok(())
    }
}

/// One load step from `span.factor_start` to `factor_end`. The inner `Err` says why the step is
/// refused; points are then as they were.
#[allow(clippy::too_many_arguments)]
fn solve_step<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &mut Points<D>,
    recorder: &mut Recorder,
    clock: &mut Clock,
    trials: &mut Trials,
    span: StepSpan,
    number: usize,
) -> Result<std::result::Result<Solved<D>, String>> {
    let deck = &model.deck;
    let (mesh, conditions) = clock.time(Phase::Locate, || {
        Discretisation::with_conditions(world, model, points, Coupling::Matrix, span)
    })?;
    let numbering = &mesh.numbering;
    let external = |factor: f64, time: f64| -> Result<Vec<f64>> {
        let forces = model.point_forces(world, points, factor, time)?;
        owned_forces(world, numbering, &mesh, &forces)
    };
    let (external_start, external_end, problem) = clock.time(Phase::Assemble, || {
        let external_start = external(span.factor_start, span.time_start)?;
        let external_end = external(span.factor_end, span.time_end)?;
        let left_out = mesh.nodes_left_out(world, deck.method.drop_below);
        let problem = Equilibrium::new(
            world,
            &model.grid,
            &mesh,
            mesh.step_points(points, &model.materials),
            &conditions,
            &left_out,
            external_end.clone(),
            newton::settings(model),
        )?;
        Ok((external_start, external_end, problem))
    })?;
    let solved =
        newton::solve(world, model, &mesh, points, problem, recorder, clock, trials, number)?;
    let solved = match solved {
        Ok(solved) => solved,
        Err(why) => return Ok(Err(why)),
    };
    let (displacement, internal) = (solved.displacement, solved.internal);

    let carry = || newton::carried(world, model, &mesh, points, &displacement, span);
    let Carried { made, moved_grid } = match clock.time(Phase::Update, carry)? {
        Ok(carried) => carried,
        Err(why) => return Ok(Err(why)),
    };
    let work = work_of_step::<D>(
        &conditions,
        numbering,
        &displacement,
        [&external_start, &external_end],
        [&solved.internal_start, &internal],
    );
    let energies = clock.time(Phase::Update, || {
        let updated = update::apply(
            &model.grid,
            &model.materials,
            deck.method.basis,
            deck.method.domain_update,
            numbering,
            &displacement,
            &made,
            points,
            None,
        );
        world.fail_together(updated)?;
        Ok(update::energies(points, &model.materials))
    })?;
    let sums = world.sum_slice(&[energies.strain, energies.plastic, work]);
    let supplied: Vec<f64> =
        internal.iter().zip(&external_end).map(|(force, external)| force - external).collect();
    let reaction = at_held(&conditions, &supplied);
    let row = HistoryRow {
        step: number,
        load_factor: span.factor_end,
        newton_iterations: solved.evaluations,
        residual: solved.residual,
        linear_iterations: solved.linear_iterations,
        energy_strain: sums[0],
        energy_plastic: sums[1],
        energy_ghost: solved.ghost_energy,
        work_external: sums[2],
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
    Ok(Ok(Solved { row, mesh, displacement, reaction, moved_grid }))
}

/// Nodal external force of the owned degrees of freedom. Collective.
pub fn owned_forces<const D: usize>(
    world: &World,
    numbering: &Numbering,
    mesh: &Discretisation<D>,
    forces: &[[f64; D]],
) -> Result<Vec<f64>> {
    let mut nodal = map_forces(numbering, &mesh.influences, forces);
    numbering.halo.reverse_add(world, &mut nodal, D)?;
    nodal.truncate(numbering.owned * D);
    Ok(nodal)
}

/// Work of loads and moved boundaries over the step, by the trapezoidal rule, this rank's share.
pub fn work_of_step<const D: usize>(
    conditions: &Conditions,
    numbering: &Numbering,
    displacement: &[f64],
    external: [&[f64]; 2],
    internal: [&[f64]; 2],
) -> f64 {
    (0..numbering.owned * D)
        .map(|dof| {
            // On a held component the boundary supplies what the loads do not.
            let side = if conditions.fixed[dof] { internal } else { external };
            0.5 * (side[0][dof] + side[1][dof]) * displacement[dof]
        })
        .sum()
}

/// Figures of merit at the end of the run; the log tells which have no value. Collective.
pub fn figures<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    recorder: &mut Recorder,
) -> Result<std::collections::BTreeMap<String, f64>> {
    let (factor, time) = recorder.reached;
    let time = if model.deck.analysis.kind.has_time() { time } else { factor };
    let mut figures = verify::figures(world, &model.deck.verify, points, factor, time)?;
    if let Some(field) = &model.manufactured {
        let materials = &model.materials;
        verify::manufactured(&mut figures, world, field, materials, points, factor, time);
    }
    for warning in &figures.warnings {
        recorder.log.warn(warning);
    }
    Ok(figures.values)
}
