//! The one time loop of quasi-static, implicit dynamic and explicit analyses:
//!
//! ```text
//! resume, or write the first frame
//! while there is a next step:
//!     if a stage begins with it: bodies come and go
//!     solve it                      what the analysis gives
//!     where that fails: undo it; halve it and go on, or leave what the run has and end
//!     accept it
//!     finish it: frames, mesh, migration, row of the history, checkpoint
//! ```

use crate::deck::When;
use crate::error::{Error, Result};
use crate::output::restart::run_state::RunState;
use crate::petsc::log::Phase;
use crate::points::Points;
use crate::record::context::Run;
use crate::record::recorder::Ending;
use crate::record::step::{Moment, Solved};
use crate::system::conditions::StepSpan;
use crate::system::model::Model;
use crate::transfer::refusal::Halt;
use crate::transfer::soundness;

use super::failure::Failure;
use super::stage_changes;

/// A step to be solved.
#[derive(Debug, Clone, Copy)]
pub struct Next {
    pub span: StepSpan,
    /// Nominal step, from one.
    pub number: usize,
}

/// Answer to a refused step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// A smaller one comes next.
    Smaller,
    /// None smaller is allowed.
    Smallest,
    /// The analysis cuts no steps.
    Uncut,
}

/// How lines and messages name the steps of an analysis.
#[derive(Debug, Clone, Copy)]
pub struct Labels {
    /// The terminal shows Newton's iterations.
    pub newton: bool,
    /// Frames and messages carry the time rather than the load factor.
    pub time: bool,
    /// Messages count the steps to this number.
    pub steps: Option<usize>,
}

/// What an analysis gives the loop.
pub trait Analysis<const D: usize> {
    fn labels(&self) -> Labels;

    /// Takes its state out of a checkpoint.
    fn restore(&mut self, state: &RunState) -> Result<()>;

    /// Its state for a checkpoint.
    fn state(&self) -> RunState;

    /// The next step; `None` at the end.
    fn next(&self) -> Option<Next>;

    /// Solves a step. The points end at their new state, not yet migrated. Collective.
    fn step(&mut self, run: &mut Run<D>, next: Next) -> std::result::Result<Solved<D>, Halt>;

    /// Gives the points back the state of the step's start. False where no copy is kept: then a
    /// refused step has left them alone, and any other failure ends the run as an error.
    fn undo(&mut self, points: &mut Points<D>) -> bool;

    /// Answers a refused step.
    fn refuse(&mut self) -> Answer;

    /// What the method itself may have to do with a failure.
    fn hint(&self, _model: &Model<D>, _halt: &Halt) -> &'static str {
        ""
    }

    /// Bodies that came and went with a stage have brought this much energy, J.
    fn energy_came(&mut self, _energy: f64) {}

    /// Moves on after a success. Collective.
    fn accept(&mut self, run: &Run<D>, next: Next) -> Moment;

    /// Nominal steps finished.
    fn completed(&self) -> usize;
}

/// Runs all steps and writes everything a run leaves. A step that cannot be finished ends the run
/// as `analysis.on_failure` says; what was written before stays. Collective.
pub fn run<const D: usize>(run: &mut Run<D>, analysis: &mut impl Analysis<D>) -> Result<Ending> {
    // The last step whose end a frame shows.
    let mut framed = match run.recorder.resumed() {
        Some(state) => {
            analysis.restore(state)?;
            None
        }
        None => {
            run.recorder.enter_stage(0);
            run.frame(0, 0.0)?;
            let start = run.model.contacts.poses(When::default());
            run.recorder.rigid_frame(run.world, &run.model, &start, (0, 0.0))?;
            Some(0)
        }
    };
    let mut entered = None;
    while let Some(next) = analysis.next() {
        if entered != Some(next.span.stage) {
            let gained = stage_changes::enter(run, next.span)?;
            analysis.energy_came(gained);
            entered = Some(next.span.stage);
        }
        let solved = match analysis.step(run, next) {
            Ok(solved) => solved,
            Err(halt) => match halted(run, analysis, next, halt, framed)? {
                Some(ending) => return Ok(ending),
                None => continue,
            },
        };
        let moment = analysis.accept(run, next);
        run.recorder.steps_completed = analysis.completed();
        let (now_framed, stop) = finish(run, analysis, next, solved, moment)?;
        if now_framed {
            framed = Some(next.number);
        }
        if let Some(ending) = stop {
            return Ok(ending);
        }
    }
    Ok(Ending::completed())
}

/// A step without end: `None` where a smaller one comes next, else how the run ends; it then leaves
/// a frame of the points where the step began, unless step `framed` is that, and their state.
/// Collective.
fn halted<const D: usize>(
    run: &mut Run<D>,
    analysis: &mut impl Analysis<D>,
    next: Next,
    halt: Halt,
    framed: Option<usize>,
) -> Result<Option<Ending>> {
    let halt = match halt {
        Halt::Failed(error) if !matches!(error, Error::Run(_) | Error::Input(_)) => {
            return Err(error);
        }
        halt => halt,
    };
    let point = run.world.first_message(soundness::not_finite(&run.points));
    let undone = analysis.undo(&mut run.points);
    let halt = match halt {
        Halt::Failed(error) if !undone => return Err(error),
        halt => halt,
    };
    let (Labels { time, steps, .. }, number) = (analysis.labels(), next.number);
    let mut cuts = false;
    match &halt {
        Halt::Refused(refusal) => {
            let answer = analysis.refuse();
            cuts = answer != Answer::Uncut;
            if cuts {
                run.recorder.log.say(&format!("step {number} refused: {}", refusal.what));
            }
            if answer == Answer::Smaller {
                return Ok(None);
            }
        }
        Halt::Unstable { .. } | Halt::Failed(_) => {}
    }
    let completed = analysis.completed();
    if undone && framed != Some(completed) {
        let span = next.span;
        let written = run.frame(completed, span.time_start);
        run.recorder.warn_of_files(written)?;
    }
    let Run { world, model, points, recorder, .. } = run;
    recorder.keep_last_state(world, model, points, analysis.state())?;
    let failure = Failure {
        step: number,
        steps,
        time: time.then_some(next.span.time_end),
        hint: analysis.hint(model, &halt),
        why: halt,
        point,
        completed,
    };
    let text = failure.to_string();
    match failure.why {
        Halt::Failed(Error::Input(_)) => Err(Error::Input(text)),
        Halt::Refused(_) if cuts => Ok(Some(Ending::stopped(text))),
        _ => Ok(Some(Ending::failed(text))),
    }
}

/// What every accepted step ends with, whatever the analysis: a frame of the points and of the grid
/// as it was solved, the mesh moved on, points to their owners, a row of the history, a checkpoint
/// where one is due. Returns whether there is a frame, and how the run ends if a signal asked it to.
/// Collective.
fn finish<const D: usize>(
    run: &mut Run<D>,
    analysis: &impl Analysis<D>,
    next: Next,
    mut solved: Solved<D>,
    moment: Moment,
) -> Result<(bool, Option<Ending>)> {
    let (number, manner) = (next.number, analysis.labels());
    // Without time it is the load factor, counted on over the stages.
    let label = next.span.time_end;
    let framed = moment != Moment::PartOfStep
        && run.recorder.wants_frame(number, label, moment == Moment::End);
    if framed {
        let Run { world, model, points, recorder, clock } = run;
        clock.time(Phase::Output, || {
            recorder.frame(world, number, label, points)?;
            recorder.rigid_frame(world, model, &solved.poses, (number, label))?;
            recorder.grid_frame(world, &model.grid, &solved, number, label)
        })?;
    }
    if let Some(grid) = solved.moved_grid.take() {
        run.model.grid = grid;
    }
    let mut row = solved.row;
    row.moved_points = run.migrate_and_balance()?;
    let Run { world, model, points, recorder, clock } = run;
    row.wall_seconds = clock.elapsed();
    clock.time(Phase::Output, || recorder.step(world, points, &row, manner.newton, moment))?;
    let state = analysis.state();
    let stop =
        clock.time(Phase::Output, || recorder.end_step(world, model, points, moment, state))?;
    Ok((framed, stop))
}
