//! What a running analysis leaves behind: rows, frames, progress and the summary.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::contact::surfaces;
use crate::contact::pose::Pose;
use crate::deck::model::{AnalysisType, Every, Symmetry};
use crate::deck::{Deck, Presence, Stage};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::output::directory::ResultsDirectory;
use crate::output::extent::{body_summaries, peak_memory};
use crate::output::report;
use crate::output::restart::run_state::RunState;
use crate::output::series::grid_file::{GridFrame, GridSeries};
use crate::output::series::point_field::PointField;
use crate::output::series::points_file::PointsSeries;
use crate::output::series::rigid_file::RigidSeries;
use crate::output::summary::{Communication, Count, Status};
use crate::output::summary::{StageSummary, Summary};
use crate::output::tables::csv_table::Mark;
use crate::output::tables::history::History;
use crate::output::tables::history::{HistoryColumns, HistoryRow};
use crate::output::tables::residuals::Residuals;
use crate::output::terminal::log::Log;
use crate::output::terminal::progress::{Interval, NewtonReport, Progress, StepReport};
use crate::parallel::World;
use crate::parallel::balance::{Balance, BalanceReport};
use crate::points::Points;
use crate::system::model::Model;

use super::checkpointing::Checkpointer;
use super::clock::Clock;
use super::probes::{Followed, Probes};
use super::step::{Moment, Solved};

/// Open files and running totals of one run.
pub struct Recorder {
    pub log: Log,
    directory: ResultsDirectory,
    history: History,
    residuals: Residuals,
    probes: Option<Probes>,
    points: PointsSeries,
    grid: GridSeries,
    /// Of a deck with rigid bodies.
    rigid: Option<RigidSeries>,
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

/// What a restart hands to the recorder.
pub struct Resume {
    pub state: RunState,
    /// Where it was read, and the step at whose end it was written.
    pub checkpoint: PathBuf,
    pub step: usize,
    /// The results directory is that of the earlier part: its tables and series go on.
    pub same_directory: bool,
}

/// The files of a run and who writes into them.
pub struct Opening {
    pub directory: ResultsDirectory,
    pub log: Log,
    pub versions: BTreeMap<String, String>,
    pub checkpointer: Checkpointer,
    pub resume: Option<Resume>,
    /// What each probe of the deck follows.
    pub followed: Vec<Followed>,
    /// The log has a line for every step.
    pub verbose: bool,
}

/// What the summary tells beside what the recorder knows.
pub struct Closing<'a> {
    pub communication: Communication,
    /// Figures of merit.
    pub verify: BTreeMap<String, f64>,
    pub ending: &'a Ending,
}

/// Puts what balances the ranks into a checkpoint.
fn save_balance(balance: &Balance, state: &mut RunState) {
    let (refused, report) = balance.memory();
    state.set("balance.refused", refused);
    state.set("balance.moved_share", report.moved_share);
    state.set("balance.largest_imbalance", report.largest_imbalance);
    state.set_count("balance.rebalanced", report.rebalanced as u64);
}

/// Takes what balances the ranks out of a checkpoint.
pub fn restore_balance(balance: &mut Balance, state: &RunState) -> Result<()> {
    let report = BalanceReport {
        rebalanced: state.count("balance.rebalanced")? as usize,
        moved_share: state.number("balance.moved_share")?,
        largest_imbalance: state.number("balance.largest_imbalance")?,
    };
    balance.resume((state.number("balance.refused")?, report));
    Ok(())
}

/// How a run ended.
#[derive(Debug, Clone)]
pub struct Ending {
    pub status: Status,
    pub reason: String,
    /// A signal asked for it.
    pub on_request: bool,
}

impl Ending {
    pub fn completed() -> Self {
        Ending { status: Status::Completed, reason: String::new(), on_request: false }
    }

    /// The run could not go on but keeps what it has.
    pub fn stopped(reason: String) -> Self {
        Ending { status: Status::Stopped, reason, on_request: false }
    }

    pub fn failed(reason: String) -> Self {
        Ending { status: Status::Failed, reason, on_request: false }
    }
}

impl Recorder {
    /// The files of a results directory: fresh ones, or those of the run that is resumed, which are
    /// read and tested. Nothing is written before [`Self::open`].
    pub fn create(world: &World, deck: &Deck, opening: Opening) -> Result<Self> {
        let Opening { directory, mut log, versions, checkpointer, resume, followed, verbose } =
            opening;
        let comm = world.comm();
        let layout = HistoryColumns {
            whole: deck.analysis.symmetry == Symmetry::Axisymmetric,
            dimension: deck.dimension,
            boundaries: deck.boundaries.iter().map(|boundary| boundary.name.clone()).collect(),
            rigids: deck.rigids.iter().map(|rigid| rigid.name.clone()).collect(),
            free: {
                let free = deck.rigids.iter().filter(|rigid| rigid.free.is_some());
                free.map(|rigid| rigid.name.clone()).collect()
            },
            contacts: deck.contacts.iter().map(|contact| contact.name.clone()).collect(),
            conditioning: deck.analysis.kind == AnalysisType::Conditioning,
            staged: deck.is_staged(),
            damped: deck.analysis.damping.is_some(),
            reduced: deck.analysis.kind == AnalysisType::StrengthReduction,
        };
        let fields = PointField::parse_list(&deck.output.fields)?;
        let (basis, dimension) = (deck.method.basis, deck.dimension);
        let formats = &deck.output.formats;
        let goes_on = resume.as_ref().filter(|resume| resume.same_directory);
        let (history, residuals, points, grid) = match goes_on {
            None => (
                History::create(&directory, layout)?,
                Residuals::create(&directory)?,
                PointsSeries::create(&directory, &fields, formats, basis, dimension),
                GridSeries::create(&directory, formats),
            ),
            Some(Resume { state, .. }) => {
                let count = |name: &str| state.count(name).map(|n| n as usize);
                let step = count("recorder.steps")?;
                let mark = |table: &str| -> Result<Mark> {
                    let rows = count(&format!("recorder.{table}_rows"))?;
                    // Not known to the first checkpoints of this format.
                    let step = count(&format!("recorder.{table}_step")).unwrap_or(usize::MAX);
                    Ok(Mark { rows, step })
                };
                let (history, residuals) = (mark("history")?, mark("residual")?);
                (
                    History::resume(&directory, layout, history, &mut log, comm)?,
                    Residuals::resume(&directory, residuals, &mut log, comm)?,
                    PointsSeries::resume(
                        &directory,
                        &fields,
                        formats,
                        (basis, dimension),
                        step,
                        &mut log,
                        comm,
                    )?,
                    GridSeries::resume(&directory, formats, step, &mut log, comm)?,
                )
            }
        };
        let rigid = match (deck.rigids.is_empty(), goes_on) {
            (true, _) => None,
            (false, None) => Some(RigidSeries::create(&directory)),
            (false, Some(Resume { state, .. })) => {
                let step = state.count("recorder.steps")? as usize;
                Some(RigidSeries::resume(&directory, step, &mut log, comm)?)
            }
        };
        let state = goes_on.map(|resume| &resume.state);
        let probes = Probes::new(world, deck, &followed, &directory, state, &mut log)?;
        let same_directory = goes_on.is_some();
        let interval = match deck.output.log {
            _ if verbose => Interval::Steps(1),
            Every::Steps(steps) => Interval::Steps(steps),
            Every::Seconds(seconds) => Interval::Seconds(seconds),
        };
        let mut recorder = Recorder {
            log,
            history,
            residuals,
            probes,
            points,
            grid,
            rigid,
            directory,
            progress: Progress::new(interval, 0.0, 0.0),
            every: deck.output.every,
            last_frame: 0.0,
            rows_every: deck.output.history,
            last_row: 0.0,
            since_row: SinceRow::default(),
            // Nobody knows how many trials a strength reduction takes.
            steps: deck
                .analysis
                .steps
                .filter(|_| deck.analysis.kind != AnalysisType::StrengthReduction),
            strength_factor: None,
            newton: Count::default(),
            linear: Count::default(),
            steps_completed: 0,
            holds: deck.boundaries.iter().map(|b| (b.name.clone(), b.presence, None)).collect(),
            stages: vec![0; deck.stages.len()],
            staged: deck.is_staged(),
            stage: 0,
            recorded: 0,
            earlier_steps: 0,
            reached: (0.0, 0.0),
            versions,
            populated_cells: 0,
            imbalance: 1.0,
            balance: BalanceReport::default(),
            checkpointer,
            resumed: None,
            same_directory,
            earlier_seconds: 0.0,
            seconds: 0.0,
        };
        if let Some(Resume { state, .. }) = resume {
            recorder.restore(&state)?;
            recorder.resumed = Some(state);
        }
        Ok(recorder)
    }

    /// Opens the tables. Those of a run that is resumed, and its series, lose what came later: the
    /// series first, as whoever looks at them looks for the newest frame.
    pub fn open(&mut self, world: &World) -> Result<()> {
        let comm = world.comm();
        self.log.attach(&self.directory, self.same_directory, comm)?;
        self.points.cut(comm)?;
        self.grid.cut(comm)?;
        self.rigid.as_mut().map_or(Ok(()), |rigid| rigid.cut(comm))?;
        self.history.table.open(comm)?;
        self.probes.as_mut().map_or(Ok(()), |probes| probes.table.open(comm))?;
        self.residuals.table.open(comm)
    }

    /// What the time loop saved with [`Self::end_step`] before the run was interrupted; `None`
    /// in a run that starts at the beginning.
    pub fn resumed(&self) -> Option<&RunState> {
        self.resumed.as_ref()
    }

    /// The last thing in a step, when points, mesh and partition are what the next step starts
    /// from: writes a checkpoint if one is due, with the loop's own `state`. If a signal asks the
    /// run to stop, says how it ends. Collective.
    pub fn end_step<const D: usize>(
        &mut self,
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        moment: Moment,
        state: RunState,
    ) -> Result<Option<Ending>> {
        self.balance = model.balance.report();
        let (due, signal) = self.checkpointer.due(world, self.steps_completed, moment);
        if due || signal.is_some() {
            self.checkpoint(world, model, points, state)?;
        }
        Ok(signal.filter(|_| moment != Moment::End).map(|signal| Ending {
            status: Status::Stopped,
            on_request: true,
            reason: format!(
                "{} asked the run to stop, after step {}{}; a checkpoint was written: go on with \
                 --restart last",
                signal.name(),
                self.steps_completed,
                self.steps.map_or(String::new(), |steps| format!(" of {steps}"))
            ),
        }))
    }

    /// A run that cannot go on leaves its last good state, if its deck plans checkpoints: with
    /// other settings it may go on from there.
    pub fn keep_last_state<const D: usize>(
        &mut self,
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        state: RunState,
    ) -> Result<()> {
        if self.checkpointer.planned() {
            let written = self.checkpoint(world, model, points, state);
            return self.warn_of_files(written);
        }
        Ok(())
    }

    /// In a run that ends for another reason: that some file could not be written is a second
    /// word, and does not take the place of the first.
    pub fn warn_of_files(&mut self, written: Result<()>) -> Result<()> {
        match written {
            Err(Error::File(text)) => {
                self.log.warn(&text);
                Ok(())
            }
            other => other,
        }
    }

    fn checkpoint<const D: usize>(
        &mut self,
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        mut state: RunState,
    ) -> Result<()> {
        self.save(&mut state);
        save_balance(&model.balance, &mut state);
        // A checkpoint counts on its rows: they are to outlast a power cut if it does.
        self.history.table.sync(world.comm())?;
        self.residuals.table.sync(world.comm())?;
        self.probes.as_ref().map_or(Ok(()), |probes| probes.table.sync(world.comm()))?;
        let step = self.steps_completed;
        let path = self.checkpointer.write(world, step, model, points, &state)?;
        self.log.note(&format!("checkpoint: {}", path.display()));
        Ok(())
    }

    fn save(&self, state: &mut RunState) {
        let (history, residuals) = (self.history.table.mark(), self.residuals.table.mark());
        for (name, value) in [
            ("recorder.steps", self.steps_completed),
            ("recorder.history_rows", history.rows),
            ("recorder.history_step", history.step),
            ("recorder.residual_rows", residuals.rows),
            ("recorder.residual_step", residuals.step),
            ("recorder.newton_total", self.newton.total),
            ("recorder.newton_max", self.newton.max),
            ("recorder.linear_total", self.linear.total),
            ("recorder.linear_max", self.linear.max),
            ("recorder.populated_cells", self.populated_cells),
            ("recorder.newton_since_row", self.since_row.newton),
            ("recorder.linear_since_row", self.since_row.linear),
        ] {
            state.set_count(name, value as u64);
        }
        if let Some(probes) = &self.probes {
            probes.save(state);
        }
        for (index, steps) in self.stages.iter().enumerate().filter(|_| self.staged) {
            state.set_count(&format!("recorder.stage_{index}"), *steps as u64);
        }
        state.set("recorder.last_frame", self.last_frame);
        state.set("recorder.last_row", self.last_row);
        state.set("recorder.moved_since_row", self.since_row.moved);
        state.set("recorder.imbalance", self.imbalance);
        state.set("recorder.seconds", self.seconds);
    }

    fn restore(&mut self, state: &RunState) -> Result<()> {
        let count = |name: &str| state.count(name).map(|n| n as usize);
        self.steps_completed = count("recorder.steps")?;
        self.earlier_steps = self.steps_completed;
        self.recorded = self.steps_completed;
        self.newton =
            Count { total: count("recorder.newton_total")?, max: count("recorder.newton_max")? };
        self.linear =
            Count { total: count("recorder.linear_total")?, max: count("recorder.linear_max")? };
        self.populated_cells = count("recorder.populated_cells")?;
        for (index, steps) in self.stages.iter_mut().enumerate() {
            // Stages may have been added.
            *steps = count(&format!("recorder.stage_{index}")).unwrap_or(0);
        }
        self.stage = self.stages.iter().rposition(|&steps| steps > 0).unwrap_or(0);
        self.last_frame = state.number("recorder.last_frame")?;
        // Not known to the first checkpoints of this format, whose steps all have rows.
        self.last_row = state.number("recorder.last_row").unwrap_or(0.0);
        self.since_row = SinceRow {
            newton: count("recorder.newton_since_row").unwrap_or(0),
            linear: count("recorder.linear_since_row").unwrap_or(0),
            moved: state.number("recorder.moved_since_row").unwrap_or(0.0),
        };
        self.imbalance = state.number("recorder.imbalance")?;
        self.earlier_seconds = state.number("recorder.seconds")?;
        self.seconds = self.earlier_seconds;
        Ok(())
    }

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

    /// True if the deck wants a frame at the end of this step.
    pub fn wants_frame(&mut self, step: usize, time: f64, last: bool) -> bool {
        match self.every {
            Every::Steps(every) => last || step.is_multiple_of(every.max(1)),
            Every::Seconds(seconds) => {
                let due = last || time >= self.last_frame + seconds * (1.0 - 1e-9);
                if due {
                    self.last_frame = time;
                }
                due
            }
        }
    }

    /// Writes the points.
    pub fn frame<const D: usize>(
        &mut self,
        world: &World,
        step: usize,
        time: f64,
        points: &Points<D>,
    ) -> Result<()> {
        self.points.write(step, time, points, world.comm())
    }

    /// Writes the surfaces of the rigid bodies in their `poses`.
    pub fn rigid_frame<const D: usize>(
        &mut self,
        world: &World,
        model: &Model<D>,
        poses: &[Pose<D>],
        (step, time): (usize, f64),
    ) -> Result<()> {
        let Some(series) = &mut self.rigid else { return Ok(()) };
        let frame = surfaces(model, poses);
        series.write(step, time, &frame, world.comm())
    }

    /// Writes the active grid of the step just solved, on the `grid` that it was solved on.
    pub fn grid_frame<const D: usize>(
        &mut self,
        world: &World,
        grid: &Grid<D>,
        solved: &Solved<D>,
        step: usize,
        time: f64,
    ) -> Result<()> {
        let Solved { mesh, displacement, reaction, .. } = solved;
        let numbering = &mesh.numbering;
        let per_node = |values: &[f64]| -> Vec<[f64; D]> {
            values.chunks_exact(D).map(|v| std::array::from_fn(|a| v[a])).collect()
        };
        let owned = numbering.owned;
        let coordinates: Vec<[f64; D]> =
            numbering.nodes[..owned].iter().map(|&node| grid.node_position(node)).collect();
        let mut cells = Vec::new();
        let mut connectivity = Vec::new();
        let mut nodes = Vec::new();
        let on_face: std::collections::BTreeSet<usize> = mesh.ghost_cells.iter().copied().collect();
        for &(cell, _) in &mesh.populated.owned {
            nodes.clear();
            grid.cell_nodes(cell, &mut nodes);
            // A cell whose nodes this rank does not all know is written by nobody: it cannot
            // happen, as owners of populated cells reach their nodes.
            let numbers: Option<Vec<usize>> = nodes
                .iter()
                .map(|&node| numbering.local(node).map(|l| numbering.global[l] as usize))
                .collect();
            if let Some(numbers) = numbers {
                connectivity.extend(numbers);
                cells.push(on_face.contains(&cell));
            }
        }
        let weights = mesh.node_weights(world)?;
        let frame = GridFrame {
            element: grid.element(),
            coordinates: &coordinates,
            connectivity: &connectivity,
            displacement_increment: &per_node(&displacement[..owned * D]),
            reaction: &per_node(reaction),
            node_fields: &[("weight", &weights[..owned])],
            ghost_boundary: &cells,
            cell_fields: &[],
        };
        self.grid.write(step, time, &frame, world.comm())
    }

    /// Writes `report.html`. That it could not be written is said, and no fault of the run.
    pub fn write_report(&mut self, world: &World) {
        if world.is_root()
            && let Err(error) = report::write(self.directory.path())
        {
            self.log.say(&format!("warning: no report: {error}"));
        }
    }

    /// How far each stage of a deck that names them has come.
    fn stages_of(&self, deck: &Deck, all: bool) -> Vec<StageSummary> {
        let of_stage = |(index, (stage, &done)): (usize, (&Stage, &usize))| StageSummary {
            name: stage.name.clone(),
            steps_completed: done,
            completed: all || index < self.stage || stage.steps == Some(done),
        };
        let stages = deck.stages.iter().zip(&self.stages).enumerate();
        stages.map(of_stage).filter(|_| self.staged).collect()
    }

    /// Rows and frames from now on belong to this stage; stages are counted from zero.
    pub fn enter_stage(&mut self, stage: usize) {
        self.stage = stage;
        self.points.stage = self.staged.then_some(stage as u64 + 1);
    }

    /// The present stage, from zero.
    pub fn stage(&self) -> usize {
        self.stage
    }

    /// Steps that this process has completed, without those before a restart.
    pub fn steps_here(&self) -> usize {
        self.steps_completed - self.earlier_steps
    }

    /// The summary, and whether it could be written. Collective.
    pub fn finish<const D: usize>(
        &mut self,
        world: &World,
        deck: &Deck,
        points: &Points<D>,
        clock: &Clock,
        closing: Closing<'_>,
    ) -> (Summary, Result<()>) {
        let Closing { communication, verify, ending } = closing;
        let kind = (deck.method.basis, deck.analysis.symmetry);
        let bodies = body_summaries(points, deck.bodies.len(), kind, world.comm());
        let summary = Summary {
            title: deck.title.clone(),
            status: ending.status,
            reason: ending.reason.clone(),
            steps_completed: self.steps_completed,
            steps_requested: self.steps.unwrap_or(self.steps_completed),
            newton_iterations: self.newton,
            linear_iterations: self.linear,
            points: world.sum_usize(points.len()),
            cells_populated: self.populated_cells,
            ranks: world.size(),
            wall_seconds: clock.phases(),
            peak_memory_bytes: peak_memory(world.comm()),
            imbalance: self.imbalance,
            balance: self.balance,
            communication,
            verify,
            bodies: deck.bodies.iter().map(|body| body.name.clone()).zip(bodies).collect(),
            strength_factor: self.strength_factor,
            stages: self.stages_of(deck, ending.status == Status::Completed),
            versions: self.versions.clone(),
            warnings: self.log.warnings(),
        };
        let mut written = summary.write(&self.directory, world.comm());
        if ending.status == Status::Completed {
            written = written.and_then(|()| self.checkpointer.remove_superseded(world));
        }
        (summary, written)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_balance_goes_through_a_checkpoint() {
        let report = BalanceReport { rebalanced: 3, moved_share: 0.4, largest_imbalance: 2.5 };
        let mut balance = Balance::default();
        balance.resume((1.3, report));
        let mut state = RunState::new();
        save_balance(&balance, &mut state);
        let mut other = Balance::default();
        restore_balance(&mut other, &state).unwrap();
        assert_eq!(other.memory(), (1.3, report));
    }
}
