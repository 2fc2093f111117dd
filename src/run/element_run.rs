//! A run of one point, without a grid: rank 0 computes and writes, all ranks get the outcome.

use std::collections::BTreeMap;

use crate::analysis::element_test::{self, Row};
use crate::cli::Arguments;
use crate::deck::model::ElementTest;
use crate::deck::{self, Deck, Scope};
use crate::error::{Error, Result};
use crate::material::Material;
use crate::output::directory::{ELEMENT, Inputs, ResultsDirectory};
use crate::output::extent::peak_memory;
use crate::output::report as page;
use crate::output::restart::run_lock::RunLock;
use crate::output::summary::{Status, Summary};
use crate::output::tables::csv_table::CsvTable;
use crate::output::terminal::log::Log;
use crate::output::terminal::report::{self, Failure};
use crate::parallel::World;
use crate::record::clock::Clock;

/// Runs the test of a deck and writes its results. The test takes milliseconds, so that it runs
/// before anything is written: what is wrong with its start is an error of the input.
pub fn run(
    world: &World,
    deck: &Deck,
    test: &ElementTest,
    text: &str,
    arguments: &Arguments,
    versions: BTreeMap<String, String>,
    mut log: Log,
) -> Result<()> {
    if arguments.restart.is_some() {
        let why = "--restart: an element test has no checkpoints; run it anew, with --force";
        return Err(Error::Input(why.into()));
    }
    let (comm, clock) = (world.comm(), Clock::new(None));
    let material = deck.materials[test.material].at(&Scope::default());
    // The same on all ranks; the others would only wait.
    let (rows, outcome) = element_test::run(&material, test);
    if let Err(Error::Input(why)) = &outcome {
        return Err(Error::Input(format!("{}: {why}", arguments.input.display())));
    }
    log.say(&format!(
        "\n{}\n  element test  {} of \"{}\" ({}), {} steps",
        deck.title,
        test.path.name(),
        deck.materials[test.material].name,
        deck.materials[test.material].model.name,
        test.total_steps()
    ));
    deck.notes.iter().for_each(|note| log.say(note));
    if arguments.check {
        log.say("The deck is good; nothing was written (--check).");
        return Ok(());
    }
    let mut lock = RunLock::of(&arguments.out);
    lock.take(true, &mut log, comm)?;
    let mut files = deck.files();
    files.push(arguments.input.clone());
    let inputs = Inputs { deck: text.to_string(), files };
    let directory = ResultsDirectory::create(&arguments.out, arguments.force, &inputs, comm)?;
    directory.write_decks(text, &deck::resolved(deck), comm)?;
    log.attach(&directory, false, comm)?;
    write(world, &directory, &material, &rows)?;
    let summary = Summary {
        title: deck.title.clone(),
        status: if outcome.is_ok() { Status::Completed } else { Status::Failed },
        reason: outcome.as_ref().err().map(Error::to_string).unwrap_or_default(),
        steps_completed: rows.len() - 1,
        steps_requested: test.total_steps(),
        points: 1,
        ranks: world.size(),
        wall_seconds: clock.phases(),
        peak_memory_bytes: peak_memory(comm),
        imbalance: 1.0,
        versions,
        warnings: log.warnings(),
        ..Summary::default()
    };
    summary.write(&directory, comm)?;
    if deck.output.report
        && world.is_root()
        && let Err(error) = page::write(directory.path())
    {
        log.say(&format!("warning: no report: {error}"));
    }
    if let Some(row) = rows.last() {
        log.say(&format!(
            "  at the end    strains {:?}\n                p = {:.6e} Pa, q = {:.6e} Pa, J = {:.6}\n  \
             results       {}",
            row.strain,
            row.pressure(),
            row.deviator(),
            row.volume_ratio(),
            directory.file(ELEMENT).display()
        ));
    }
    outcome.map_err(|error| {
        let failure = Failure {
            what: error.to_string(),
            last_good_step: Some(rows.len() - 1),
            results: Some(directory.path().to_path_buf()),
            ..Failure::default()
        };
        Error::Run(report::failure(&failure))
    })
}

fn write(
    world: &World,
    directory: &ResultsDirectory,
    material: &Material,
    rows: &[Row],
) -> Result<()> {
    let header = element_test::header(material);
    let mut table = CsvTable::create(&directory.file(ELEMENT), &header)?;
    table.open(world.comm())?;
    let all: Vec<Vec<f64>> = rows
        .iter()
        .enumerate()
        .map(|(step, row)| element_test::numbers(material, step, row))
        .collect();
    let all: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
    table.push_all(&all, world.comm())
}
