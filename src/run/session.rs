//! From the command line to a finished results directory: what happens on every rank.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::Write as _;
use std::path::Path;

use mpi::environment::Universe;
use mpi::traits::*;

use crate::cli::{self, Arguments};
use crate::deck::model::{AnalysisType, Ghost};
use crate::deck::{self, Deck};
use crate::error::{Error, Result};
use crate::input_file;
use crate::output::directory::{self, Inputs, ResultsDirectory};
use crate::output::restart::run_lock::RunLock;
use crate::output::start;
use crate::output::summary::Status;
use crate::output::terminal::log::Log;
use crate::output::terminal::report::{self, Banner, Failure};
use crate::parallel::{World, launcher, signals};
use crate::petsc::log::Stages;
use crate::petsc::{self, Session};
use crate::petsc::{files, known};

use super::start_checks::formulas;
use super::start_checks::support;
use super::{aside, element_run, plan, process, setup};
use crate::analysis::explicit::Explicit;
use crate::analysis::implicit::Implicit;
use crate::analysis::initial_balance;
use crate::analysis::strength_reduction::StrengthReduction;
use crate::analysis::{conditioning, solver, time_loop};
use crate::output::summary::Communication;
use crate::record::checkpointing::{self, Checkpointer, Restart};
use crate::record::clock::Clock;
use crate::record::context::Run;
use crate::record::probes;
use crate::record::recorder::{Closing, Ending, Opening, Recorder, Resume, restore_balance};
use crate::record::verify;
use crate::system::apart::require_apart;
use crate::system::conditions::StepSpan;
use crate::system::step_system;
use crate::transfer::soundness;

/// Runs the program with the words of its command line (the program's name first); returns the
/// exit code, the same on all ranks.
pub fn run(words: impl IntoIterator<Item = OsString>) -> i32 {
    let words: Vec<OsString> = words.into_iter().collect();
    if cli::runs_nothing(&words) {
        return aside::run(&words);
    }
    process::before_start();
    start::before_mpi();
    let Some((universe, _)) = mpi::initialize_with_threading(mpi::Threading::Funneled) else {
        eprintln!("error: MPI could not be started");
        return Error::Environment(String::new()).exit_code();
    };
    petsc::install_panic_hook();
    let world = World::new(universe.world().duplicate());
    let words = world.fail_together(same_on_all_ranks(&world, words));
    let outcome =
        words.and_then(cli::parse).and_then(|arguments| with_world(&universe, &world, &arguments));
    match outcome {
        Ok(()) => 0,
        Err(error) => {
            if world.is_root() {
                // The disk that is full may be the one where this goes, too.
                let _ = writeln!(std::io::stderr(), "error: {}", error.to_string().trim_end());
            }
            error.exit_code()
        }
    }
}

/// The words, if all ranks were given those of the first: else each would go its own way. The
/// program's own name may differ.
fn same_on_all_ranks(world: &World, words: Vec<OsString>) -> Result<Vec<OsString>> {
    let own: Vec<u8> = words.iter().skip(1).fold(Vec::new(), |mut all, word| {
        all.extend(word.as_encoded_bytes());
        all.push(0);
        all
    });
    let mut first = own.clone();
    world.broadcast_bytes(0, &mut first);
    if first == own {
        return Ok(words);
    }
    Err(Error::Input(format!(
        "rank {} was given other arguments than rank 0: expected one command for all ranks, as in \
         mpirun -n N mpm-par INPUT.toml",
        world.rank()
    )))
}

/// Errors that reach this level are the same on every rank.
fn with_world(universe: &Universe, world: &World, arguments: &Arguments) -> Result<()> {
    let text = read_deck_text(world, arguments)?;
    let named = match arguments.input.to_str() {
        Some(cli::STANDARD_INPUT) => Path::new("standard input"),
        _ => &arguments.input,
    };
    let deck = world.fail_together(deck::read(named, &text, &arguments.sets))?;
    let session = Session::start(universe, &deck.petsc, &arguments.petsc)?;
    world.fail_together(known::require_known())?;
    files::require_writable(world.comm())?;
    let mut log = Log::new(world.comm());
    if arguments.voice == cli::Voice::Quiet {
        log.be_quiet();
    }
    let versions = versions();
    log.say(&report::banner(&Banner {
        version: env!("CARGO_PKG_VERSION").into(),
        ranks: world.size(),
        libraries: versions.clone().into_iter().collect(),
    }));
    for note in [petsc::blas::note(), petsc::factors::note()].into_iter().flatten() {
        log.say(&note);
    }
    let mpi = versions.get("MPI").map_or("", String::as_str);
    if let Some(text) = launcher::warning(world.size(), mpi, |name| std::env::var(name).ok()) {
        log.say(&text);
    }
    if let Some(test) = deck.element_test.clone() {
        let outcome = element_run::run(world, &deck, &test, &text, arguments, versions, log);
        return session.end(outcome);
    }
    let start = Start { world, session: &session, arguments, text, versions, log };
    let outcome = match deck.dimension {
        2 => start.in_space::<2>(deck),
        _ => start.in_space::<3>(deck),
    };
    session.end(outcome)
}

/// Rank 0 reads the deck and sends its text to the others.
fn read_deck_text(world: &World, arguments: &Arguments) -> Result<String> {
    let path = &arguments.input;
    let read = if world.is_root() {
        let bytes = match path.to_str() {
            Some(cli::STANDARD_INPUT) => input_file::read_all(std::io::stdin(), input_file::DECK),
            _ => input_file::read(path, input_file::DECK),
        };
        bytes.map_err(|reason| {
            Error::Input(format!("cannot read the deck {}: {reason}", path.display()))
        })
    } else {
        Ok(Vec::new())
    };
    let mut bytes = world.fail_together(read)?;
    world.broadcast_bytes(0, &mut bytes);
    String::from_utf8(bytes)
        .map_err(|_| Error::Input(format!("{} is not UTF-8 text", path.display())))
}

fn versions() -> BTreeMap<String, String> {
    let mpi = mpi::environment::library_version().unwrap_or_default();
    // The first line: the others of MPICH are about its build.
    let mpi = mpi.split([',', '\n']).next().unwrap_or_default();
    let mpi = mpi.split_whitespace().collect::<Vec<_>>().join(" ");
    BTreeMap::from([
        ("mpm-par".to_string(), env!("CARGO_PKG_VERSION").to_string()),
        ("PETSc".to_string(), petsc::version()),
        ("MPI".to_string(), mpi),
        ("HDF5".to_string(), {
            let (major, minor, patch) = hdf5::library_version();
            format!("{major}.{minor}.{patch}")
        }),
    ])
}

/// What a run knows before its dimension.
struct Start<'a> {
    world: &'a World,
    session: &'a Session<'a>,
    arguments: &'a Arguments,
    text: String,
    versions: BTreeMap<String, String>,
    log: Log,
}

impl Start<'_> {
    fn in_space<const D: usize>(mut self, deck: Deck) -> Result<()> {
        let world = self.world;
        let mut clock = Clock::new(Some(Stages::register()?));
        let resolved = deck::resolved(&deck);
        let physics = checkpointing::physics_of(world, &deck)?;
        let (out, comm) = (&self.arguments.out, world.comm());
        let mut lock = RunLock::of(out);
        if !self.arguments.check {
            // Before a checkpoint is chosen: the run that has the directory may be writing one.
            lock.take(false, &mut self.log, comm)?;
        }
        let (model, points, resume) = match &self.arguments.restart {
            None => {
                let (model, points) = setup::prepare::<D>(world, deck)?;
                (model, points, None)
            }
            Some(choice) => {
                let found = checkpointing::find::<D>(world, &physics, choice, out, &mut self.log)?;
                checkpointing::require_later_end(&deck, &found)?;
                self.log.say(&report::restart(&found.path, found.step, found.ranks, world.size()));
                let resume = Resume {
                    state: found.state.clone(),
                    checkpoint: found.path.clone(),
                    step: found.step,
                    same_directory: checkpointing::lies_in(world, &found.path, out),
                };
                let (mut model, points) = setup::restore(world, deck, found)?;
                restore_balance(&mut model.balance, &resume.state)?;
                (model, points, Some(resume))
            }
        };
        let active = step_system::active(world, &model, &points);
        let active = active.map_err(|error| match error {
            // Before any step it is the deck that puts a domain there.
            Error::Run(text) if resume.is_none() => Error::Input(format!("at the start {text}")),
            other => other,
        })?;
        let mut warnings = match resume {
            None => {
                require_apart(world, &model, &points, deck::When::default())?;
                formulas::check(world, &model, &points, &active.1)?
            }
            Some(_) => Vec::new(),
        };
        let first = StepSpan::first_of(&model.deck.stages, 0);
        match model.deck.analysis.kind {
            kind if kind.is_static() && resume.is_none() => {
                support::require(world, &model, &points, &active, first)?;
                support::require_later(world, &model, &points)?;
            }
            AnalysisType::Explicit | AnalysisType::ImplicitDynamic if resume.is_none() => {
                warnings.extend(support::falls(world, &model, &points, &active, first)?);
            }
            _ => {}
        }
        if resume.is_none() {
            warnings.extend(initial_balance::warning(world, &model, &points)?);
        }
        let followed = probes::find(world, &model.deck, &model.grid, &points)?;
        let plan = plan::of(world, &model, &points, &active);
        self.log.say(&report::plan(&plan));
        model.deck.notes.iter().for_each(|note| self.log.say(note));
        warnings.iter().chain(&plan.warnings).for_each(|warning| self.log.warn(warning));
        drop(active);
        solver::rehearse(world, &model, plan.equations)?;
        if self.arguments.check {
            directory::require_place(out, comm)?;
            self.log.say("The deck is good; nothing was run (--check).");
            return Ok(());
        }
        lock.take(true, &mut self.log, comm)?;
        let earlier = resume.as_ref().filter(|resume| resume.same_directory);
        let earlier = earlier.map(|resume| (resume.checkpoint.clone(), resume.step));
        let results = match earlier {
            Some(_) => ResultsDirectory::reopen(out, comm)?,
            None => {
                let inputs = self.inputs(&model.deck);
                ResultsDirectory::create(out, self.arguments.force, &inputs, comm)?
            }
        };
        let checkpointer = Checkpointer::new(&model.deck, &physics, &results);
        let (log, versions, into) = (self.log, self.versions, results.clone());
        let verbose = self.arguments.voice == cli::Voice::Verbose;
        let opening =
            Opening { directory: into, log, versions, checkpointer, resume, followed, verbose };
        let mut recorder = Recorder::create(world, &model.deck, opening)?;
        // All of the earlier part is known to fit: now it may be changed.
        if let (Some((used, step)), Some(choice)) = (&earlier, &self.arguments.restart) {
            checkpointing::set_later_aside(world, out, choice, used, *step)?;
            results.leave_earlier_part(comm)?;
        }
        results.write_decks(&self.text, &resolved, comm)?;
        recorder.open(world)?;
        if let Some((_, step)) = earlier {
            checkpointing::set_later_frames_aside(world, out, step)?;
        }
        signals::listen();
        process::before_steps();
        clock.end_setup();

        let mut run = Run { world, model, points, recorder, clock };
        let outcome = match run.model.deck.analysis.kind {
            AnalysisType::QuasiStatic | AnalysisType::ImplicitDynamic => {
                let mut analysis = Implicit::new(&run);
                time_loop::run(&mut run, &mut analysis)
            }
            AnalysisType::StrengthReduction => {
                let mut analysis = StrengthReduction::new(&run);
                let ending = time_loop::run(&mut run, &mut analysis);
                run.recorder.strength_factor = analysis.factor();
                ending
            }
            AnalysisType::Explicit => {
                let begun = Explicit::new(&mut run);
                begun.and_then(|mut analysis| time_loop::run(&mut run, &mut analysis))
            }
            AnalysisType::Conditioning => conditioning::run(&mut run),
            // Runs without a grid: see [`element_run`].
            AnalysisType::ElementTest => Ok(Ending::completed()),
        };
        let mut of_numerics = true;
        let (ending, kind): (_, fn(String) -> Error) = match outcome {
            Ok(ending) => (ending, Error::Run),
            Err(error) => {
                let of_files = error.exit_code() == 3;
                of_numerics = error.exit_code() == 1;
                let kind = match error.exit_code() {
                    3 => Error::File,
                    4 => Error::Environment,
                    _ => Error::Run,
                };
                if of_files {
                    run.recorder.leave_unrecorded();
                }
                let (text, step) = (error.to_string(), run.recorder.steps_completed + 1);
                // A file has its step in its name.
                let named = of_files || text.starts_with("step ");
                let text = if named { text } else { format!("step {step}: {text}") };
                (Ending::failed(text), kind)
            }
        };
        let figures = verify::of_run(&mut run)?;
        let unused = self.session.unused_options()?;
        if !unused.is_empty() {
            let text = format!("PETSc options that nothing used: {}", unused.join(", "));
            run.recorder.log.warn(&text);
        }
        let (traffic, steps) = (run.clock.traffic(), run.recorder.steps_here());
        let sent = Communication::of(world, traffic, steps, run.model.partition.replicated_bytes());
        let closing = Closing { communication: sent, verify: figures, ending: &ending };
        let (summary, written) =
            run.recorder.finish(world, &run.model.deck, &run.points, &run.clock, closing);
        let (ending, kind): (_, fn(String) -> Error) = match written {
            Err(error) if ending.status == Status::Completed => {
                (Ending::failed(error.to_string()), Error::File)
            }
            // What happened first is what the run is to say.
            written => {
                run.recorder.warn_of_files(written)?;
                (ending, kind)
            }
        };
        if run.model.deck.output.report {
            run.recorder.write_report(world);
        }
        run.recorder.log.say(&report::closing(&summary, &run.recorder.directory()));
        if ending.status == Status::Completed {
            return Ok(());
        }
        let failure = Failure {
            what: ending.reason.clone(),
            last_good_step: Some(run.recorder.steps_completed),
            results: Some(run.recorder.directory()),
            // Whoever sent a signal needs no advice, and no numerics heals a deck, a full disk or an
            // option that PETSc refuses.
            advice: match kind(String::new()).exit_code() {
                _ if ending.on_request => Vec::new(),
                3 => vec![checkpointing::advice(world, &run.recorder.directory())],
                // What is missing there is said already, and no step is small enough.
                _ if !of_numerics || ending.reason.contains(soundness::NOT_HELD) => Vec::new(),
                _ => advice(&run.model.deck),
            },
            ..Failure::default()
        };
        Err(kind(report::failure(&failure)))
    }
}

impl Start<'_> {
    /// What must outlast the preparation of the results directory.
    fn inputs(&self, deck: &Deck) -> Inputs {
        let mut files = deck.files();
        files.push(self.arguments.input.clone());
        if let Some(Restart::File(path)) = &self.arguments.restart {
            files.push(path.clone());
        }
        Inputs { deck: self.text.clone(), files }
    }
}

/// What usually helps when a step cannot be solved, given what the deck does not yet use.
fn advice(deck: &Deck) -> Vec<String> {
    let mut advice = Vec::new();
    if matches!(deck.analysis.kind, AnalysisType::Explicit | AnalysisType::Conditioning) {
        return vec!["smaller steps: analysis.steps, or analysis.cfl = 0.5 in its place".into()];
    }
    match &deck.ghost {
        None => advice.push("stabilise small overlaps: leave out ghost = \"off\"".to_string()),
        Some(ghost) if ghost.stiffness.is_none() && ghost.stiffness_factor.is_none() => {
            let factor = Ghost::STIFFNESS_FACTOR;
            advice.push(format!("stabilise small overlaps: ghost.stiffness_factor = {factor}"));
        }
        Some(_) => {}
    }
    if deck.analysis.on_failure == crate::deck::model::OnFailure::Stop {
        advice.push("let steps be cut: analysis.on_failure = \"cut\"".to_string());
    }
    advice.push("more, smaller steps: analysis.steps".to_string());
    if deck.analysis.kind == AnalysisType::QuasiStatic && !deck.contacts.is_empty() {
        let rest = "a body that contacts alone hold has no state of rest once it slides or lifts off: hold it \
                   by a [[boundary]], or use analysis.type = \"implicit-dynamic\"";
        advice.push(rest.to_string());
    }
    advice
}
