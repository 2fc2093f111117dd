//! The files of a run, fresh or continued.

use crate::deck::Deck;
use crate::deck::fields::PointField;
use crate::deck::model::{AnalysisType, Every, Format, Symmetry};
use crate::error::Result;
use crate::output::directory::ResultsDirectory;
use crate::output::restart::run_state::RunState;
use crate::output::series::frame_series::Series;
use crate::output::series::points_file::PointsSeries;
use crate::output::summary::Count;
use crate::output::tables::csv_table::Mark;
use crate::output::tables::history::{ContactName, History, HistoryColumns};
use crate::output::tables::residuals::Residuals;
use crate::output::terminal::log::Log;
use crate::output::terminal::progress::{Interval, Progress};
use crate::parallel::World;
use crate::parallel::balance::BalanceReport;
use crate::record::checkpointing::Checkpointer;
use crate::record::probes::{Followed, Probes};
use std::collections::BTreeMap;
use std::path::PathBuf;

use super::{Recorder, SinceRow};

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
            contacts: deck.contacts.iter().map(ContactName::of).collect(),
            conditioning: deck.analysis.kind == AnalysisType::Conditioning,
            staged: deck.is_staged(),
            damped: deck.analysis.damping.is_some(),
            reduced: deck.analysis.kind == AnalysisType::StrengthReduction,
        };
        let fields = PointField::parse_list(&deck.output.fields)?;
        let formats = &deck.output.formats;
        let goes_on = resume.as_ref().filter(|resume| resume.same_directory);
        let mut history = History::create(&directory, layout)?;
        let mut residuals = Residuals::create(&directory)?;
        let kind = (deck.method.basis, deck.dimension);
        let mut points = PointsSeries::create(&directory, &fields, formats, kind);
        let mut grid = Series::create(&directory, ("grid", "grid"), formats);
        let mut rigid = (!deck.rigids.is_empty())
            .then(|| Series::create(&directory, ("rigid", "rigid"), &[Format::Xdmf]));
        if let Some(Resume { state, .. }) = goes_on {
            let count = |name: &str| state.count(name).map(|n| n as usize);
            let step = count("recorder.steps")?;
            let mark = |table: &str| -> Result<Mark> {
                let rows = count(&format!("recorder.{table}_rows"))?;
                // Not known to the first checkpoints of this format.
                let step = count(&format!("recorder.{table}_step")).unwrap_or(usize::MAX);
                Ok(Mark { rows, step })
            };
            let (of_history, of_residuals) = (mark("history")?, mark("residual")?);
            history.table.resume(of_history, &mut log, comm)?;
            residuals.table.resume(of_residuals, &mut log, comm)?;
            points.resume(step, &mut log, comm)?;
            grid.resume(step, &mut log, comm)?;
            rigid.as_mut().map_or(Ok(()), |series| series.resume(step, &mut log, comm))?;
        }
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
}
