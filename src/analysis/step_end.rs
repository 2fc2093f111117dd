//! What every accepted step ends with, whatever the analysis: a frame of the points and of the
//! grid as it was solved, the mesh moved on, points to their owners, a row of the history, a
//! checkpoint where one is due.

use crate::error::Result;
use crate::grid::Grid;
use crate::output::restart::run_state::RunState;
use crate::output::tables::history::HistoryRow;
use crate::parallel::World;
use crate::petsc::log::Phase;
use crate::points::Points;

use super::load_steps::Moment;
use crate::parallel::balance;
use crate::record::clock::Clock;
use crate::record::recorder::{Ending, Recorder};
use crate::system::step_system::{Discretisation, Model};

/// A solved step: its row, and the grid as it was solved.
pub struct Solved<const D: usize> {
    pub row: HistoryRow,
    pub mesh: Discretisation<D>,
    /// Of local nodes, m.
    pub displacement: Vec<f64>,
    /// Of the owned degrees of freedom, N.
    pub reaction: Vec<f64>,
    /// The mesh where it goes after the step, if it moves.
    pub moved_grid: Option<Grid<D>>,
}

/// Where in the run the step ended.
#[derive(Debug, Clone, Copy)]
pub struct End {
    /// Nominal step, from one.
    pub number: usize,
    /// What frames are labelled with: load factor or time.
    pub label: f64,
    pub moment: Moment,
    /// The terminal's line tells of Newton's iteration.
    pub newton: bool,
}

/// What became of it.
pub struct Finished {
    /// A frame shows the points as they are now.
    pub framed: bool,
    /// A signal asked the run to end here.
    pub stop: Option<Ending>,
}

/// Finishes a step whose points are updated but not migrated. `state`: what the time loop needs to
/// go on from here. Collective.
#[allow(clippy::too_many_arguments)]
pub fn finish<const D: usize>(
    world: &World,
    model: &mut Model<D>,
    points: &mut Points<D>,
    recorder: &mut Recorder,
    clock: &mut Clock,
    solved: Solved<D>,
    end: End,
    state: RunState,
) -> Result<Finished> {
    let Solved { mut row, mesh, displacement, reaction, moved_grid } = solved;
    let End { number, label, moment, newton } = end;
    let framed =
        moment != Moment::PartOfStep && recorder.wants_frame(number, label, moment == Moment::End);
    if framed {
        clock.time(Phase::Output, || {
            recorder.frame(world, number, label, points)?;
            recorder.grid_frame(world, model, &mesh, number, label, &displacement, &reaction)
        })?;
    }
    if let Some(grid) = moved_grid {
        model.grid = grid;
    }
    let busy = clock.busy();
    let settle = || balance::settle(world, model, points, busy);
    row.moved_points = clock.time(Phase::Migrate, settle)?.moved;
    row.wall_seconds = clock.elapsed();
    clock.time(Phase::Output, || recorder.step(world, &row, newton, moment))?;
    let stop =
        clock.time(Phase::Output, || recorder.end_step(world, model, points, moment, state))?;
    Ok(Finished { framed, stop })
}

/// What a run leaves that ends behind step `completed`, at time `label`, as the next one cannot be
/// finished: a frame unless `framed` says that there is one, and the state. Collective.
#[allow(clippy::too_many_arguments)]
pub fn leave<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    recorder: &mut Recorder,
    framed: Option<usize>,
    completed: usize,
    label: f64,
    state: RunState,
) -> Result<()> {
    if framed != Some(completed) {
        let written = recorder.frame(world, completed, label, points);
        recorder.warn_of_files(written)?;
    }
    recorder.keep_last_state(world, model, points, state)
}
