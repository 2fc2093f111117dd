//! What a running analysis leaves behind.
//!
//! | idea | file |
//! |---|---|
//! | files of a run, fresh or continued | `opening.rs` |
//! | rows and progress | `mod.rs` |
//! | frames | `frames.rs` |
//! | state in a checkpoint | `checkpoints.rs` |
//! | end, summary, report | `closing.rs` |

mod checkpoints;
mod closing;
mod frames;
mod opening;

pub use checkpoints::restore_balance;
pub use closing::{Closing, Ending};
pub use opening::{Opening, Resume};

use super::checkpointing::Checkpointer;
use super::probes::Probes;
use super::step::Moment;
use crate::deck::Presence;
use crate::deck::model::Every;
use crate::error::Result;
use crate::output::directory::ResultsDirectory;
use crate::output::restart::run_state::RunState;
use crate::output::series::frame_series::Series;
use crate::output::series::points_file::PointsSeries;
use crate::output::summary::Count;
use crate::output::tables::history::{History, HistoryRow};
use crate::output::tables::residuals::Residuals;
use crate::output::terminal::log::Log;
use crate::output::terminal::progress::{NewtonReport, Progress, StepReport};
use crate::parallel::World;
use crate::parallel::balance::BalanceReport;
use crate::points::Points;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Open files and running totals of one run.
pub struct Recorder {
    pub log: Log,
    directory: ResultsDirectory,
    history: History,
    residuals: Residuals,
    probes: Option<Probes>,
    points: PointsSeries,
    grid: Series,
    /// Of a deck with rigid bodies.
    rigid: Option<Series>,
    progress: Progress,
    every: Every,
    last_frame: f64,
    /// Between rows of the history.
    rows_every: Every,
    /// Time, or load factor, of the last row.
    last_row: f64,
    /// Of steps since the last row.
    since_row: SinceRow,
    steps: Option<usize>,
    pub newton: Count,
    pub linear: Count,
    pub steps_completed: usize,
    /// What a strength reduction has found.
    pub strength_factor: Option<f64>,
    /// Names of the deck's boundaries, when they are there, and the volume that each held in its
    /// first row of this process, m3.
    holds: Vec<(String, Presence, Option<f64>)>,
    /// Nominal steps finished in each stage.
    stages: Vec<usize>,
    staged: bool,
    /// The present one, from zero.
    stage: usize,
    /// The last step with a row in the history.
    recorded: usize,
    /// Those of them before a restart.
    earlier_steps: usize,
    /// Load factor and time (s) reached so far.
    pub reached: (f64, f64),
    pub versions: BTreeMap<String, String>,
    populated_cells: usize,
    imbalance: f64,
    balance: BalanceReport,
    checkpointer: Checkpointer,
    resumed: Option<RunState>,
    /// [`Resume::same_directory`]; false without a restart.
    same_directory: bool,
    /// s that earlier parts of the run took.
    earlier_seconds: f64,
    /// s up to the last row, earlier parts included.
    seconds: f64,
}

/// Counts of the steps that have no row of their own: the next row takes them.
#[derive(Debug, Clone, Copy, Default)]
struct SinceRow {
    newton: usize,
    linear: usize,
    moved: f64,
}

impl Recorder {
    pub fn directory(&self) -> PathBuf {
        self.directory.path().to_path_buf()
    }

    /// Records one accepted step (or part of one): a row and a line, where the deck's intervals
    /// want them. A step that ends the run, for whatever reason, is a [`Moment::End`].
    pub fn step<const D: usize>(
        &mut self,
        world: &World,
        points: &Points<D>,
        row: &HistoryRow,
        with_newton: bool,
        moment: Moment,
    ) -> Result<()> {
        self.seconds = self.earlier_seconds + row.wall_seconds;
        self.since_row.newton += row.newton_iterations;
        self.since_row.linear += row.linear_iterations;
        self.since_row.moved += row.moved_points;
        if self.wants_row(row, moment) {
            let SinceRow { newton, linear, moved } = std::mem::take(&mut self.since_row);
            let whole = HistoryRow {
                newton_iterations: newton,
                linear_iterations: linear,
                moved_points: moved,
                wall_seconds: self.seconds,
                ..row.clone()
            };
            self.history.push(&whole, world.comm())?;
            if let Some(probes) = &mut self.probes {
                probes.push(world, points, &whole)?;
            }
        }
        self.watch_boundaries(row);
        self.recorded = row.step;
        self.reached = (row.load_factor, row.time);
        if moment != Moment::PartOfStep
            && let Some(steps) = self.stages.get_mut(row.stage)
        {
            *steps += 1;
        }
        self.populated_cells = row.populated_cells;
        self.imbalance = row.imbalance;
        let newton = with_newton.then_some(NewtonReport {
            iterations: row.newton_iterations,
            residual: row.residual,
            linear_iterations: row.linear_iterations,
            cuts: row.cuts,
        });
        let report = StepReport {
            step: row.step,
            steps: self.steps,
            share: match self.steps.filter(|_| self.staged) {
                Some(steps) => row.step as f64 / steps as f64,
                None => row.load_factor,
            },
            time: (row.time > 0.0).then_some(row.time),
            newton,
            elapsed: row.wall_seconds,
            last: moment == Moment::End,
        };
        self.progress.step(&mut self.log, &report);
        Ok(())
    }

    /// Warns of boundaries that the bodies have left since the first row. One that held nothing then
    /// waits for a body, which may come and go.
    fn watch_boundaries(&mut self, row: &HistoryRow) {
        for ((name, presence, first), reaction) in self.holds.iter_mut().zip(&row.reactions) {
            if !presence.holds_in(row.stage) {
                continue;
            }
            let (first, held) = (*first.get_or_insert(reaction.held), reaction.held);
            if 4.0 * held >= first {
                continue;
            }
            let text = format!(
                "boundary \"{name}\" holds less than a quarter of the material that it held at first: \
                 the material has left its nodes, and its reaction is no longer that of a support. \
                 Nodes that follow a body are found by where = {{ cells_of = \"...\" }}"
            );
            let detail = format!("(reaction.{name}.held is {held:.3e}, {first:.3e} at first)");
            self.log.warn_of_step(row.step, &text, &detail);
        }
    }

    fn wants_row(&mut self, row: &HistoryRow, moment: Moment) -> bool {
        let time = if row.time > 0.0 { row.time } else { row.stage as f64 + row.load_factor };
        let wanted = match self.rows_every {
            Every::Steps(1) => true,
            Every::Steps(every) => moment == Moment::Step && row.step.is_multiple_of(every.max(1)),
            Every::Seconds(seconds) => time >= self.last_row + seconds * (1.0 - 1e-9),
        };
        let wanted = wanted || moment == Moment::End;
        if wanted {
            self.last_row = time;
        }
        wanted
    }

    /// A step that could be solved but not written is not a completed one.
    pub fn leave_unrecorded(&mut self) {
        self.steps_completed = self.steps_completed.min(self.recorded);
    }

    /// Residuals of a step's evaluations.
    pub fn iterations(&mut self, world: &World, step: usize, errors: &[f64]) -> Result<()> {
        self.residuals.push_step(step, errors, world.comm())
    }

    /// Rows and frames from now on belong to this stage; stages are counted from zero.
    pub fn enter_stage(&mut self, stage: usize) {
        self.stage = stage;
        self.points.enter_stage(self.staged.then_some(stage as u64 + 1));
    }

    /// The present stage, from zero.
    pub fn stage(&self) -> usize {
        self.stage
    }

    /// Steps that this process has completed, without those before a restart.
    pub fn steps_here(&self) -> usize {
        self.steps_completed - self.earlier_steps
    }
}
