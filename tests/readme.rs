//! What README.md and the pages of docs/ print is tried: decks are run or checked, fragments of decks
//! fit the documented example, commands and Python blocks of README.md run as they stand, in order, in one
//! folder. What a test cannot run is listed with its reason.

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use mpm_par::deck::{self, reference};

const PROGRAM: &str = env!("CARGO_BIN_EXE_mpm-par");
/// Beginnings of printed commands that are not run here, and why.
const NOT_RUN: &[(&str, &str)] = &[
    ("apt-get ", "installs packages"),
    ("curl ", "downloads Rust"),
    ("git clone ", "downloads this project"),
    ("cd ", "goes into the clone"),
    ("make run", "builds; its command line is run by `make_run_and_install_do_what_they_say`"),
    ("make test", "is what runs this test"),
    ("make install", "builds; run by `make_run_and_install_do_what_they_say`"),
    ("mpirun -n 8 mpm-par deck.toml --restart", "needs an interrupted run: tests/restart.rs"),
    ("mpirun -n 3 mpm-par deck.toml --restart", "needs an interrupted run: tests/restart.rs"),
    ("MACHINE=slurm sbatch ", "needs a batch system: tests/slurm.rs"),
    ("LIMIT=3600 bash jobs/chain.sbatch", "needs a long run: tests/jobs.rs"),
];
/// Pages whose decks are run to their end; those of other pages are checked.
const RUN_DECKS_OF: [&str; 2] = ["README.md", "docs/guide/deck.md"];

const TUTORIALS: &str = "docs/guide/tutorials/";
/// A page whose commands are run as they stand.
const FIRST_HOUR: &str = "docs/guide/start.md";

struct Block {
    /// `README.md:41`
    place: String,
    page: String,
    tag: String,
    text: String,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// README.md and the pages of docs/ but for its log: (name from the root, text).
fn pages() -> Vec<(String, String)> {
    let mut paths = vec![root().join("README.md")];
    let mut folders = vec![root().join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder of docs/ can be listed") {
            let path = entry.expect("a folder of docs/ can be listed").path();
            if path.is_dir() && !path.ends_with("log") {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "md") {
                paths.push(path);
            }
        }
    }
    paths.sort();
    let read = |path: PathBuf| {
        let name = path.strip_prefix(root()).expect("below the root").display().to_string();
        (name, std::fs::read_to_string(&path).expect("a page is text"))
    };
    paths.into_iter().map(read).collect()
}

/// All fenced blocks, in order, but those of the tutorials, which `tests/tutorials.rs` follows.
fn blocks() -> Vec<Block> {
    let mut found = Vec::new();
    for (page, text) in pages().into_iter().filter(|(page, _)| !page.starts_with(TUTORIALS)) {
        let mut open: Option<Block> = None;
        for (number, line) in text.lines().enumerate() {
            let fence = line.trim_start().strip_prefix("```");
            match (&mut open, fence) {
                (None, Some(tag)) => {
                    open = Some(Block {
                        place: format!("{page}:{}", number + 1),
                        page: page.clone(),
                        tag: tag.trim().to_string(),
                        text: String::new(),
                    });
                }
                (Some(_), Some(_)) => found.extend(open.take()),
                (Some(block), None) => {
                    block.text.push_str(line);
                    block.text.push('\n');
                }
                (None, None) => {}
            }
        }
        assert!(open.is_none(), "{page}: a block does not end");
    }
    found
}

fn tagged(tag: &str) -> Vec<Block> {
    blocks().into_iter().filter(|block| block.tag == tag).collect()
}

fn is_whole(deck: &str) -> bool {
    ["[analysis]", "[grid]", "[[body]]"].iter().all(|part| deck.contains(part))
}

/// The words of a shell that has `mpm-par` on its PATH, as after `make install`.
fn shell(folder: &Path, command: &str) -> Output {
    let bin = folder.join("bin");
    if !bin.exists() {
        std::fs::create_dir_all(&bin).expect("a folder");
        std::os::unix::fs::symlink(PROGRAM, bin.join("mpm-par")).expect("a link");
    }
    let path = std::env::var("PATH").unwrap_or_default();
    // The limits and permissions of every test's mpirun; the words after it are the page's.
    let template = common::job(1, 600);
    let mut shell = Command::new("sh");
    for (name, value) in template.get_envs() {
        match value {
            Some(value) => shell.env(name, value),
            None => shell.env_remove(name),
        };
    }
    shell.args(["-c", command]).current_dir(folder).stdin(Stdio::null());
    shell.env("PATH", format!("{}:{path}", bin.display())).output().expect("a shell")
}

#[track_caller]
fn assert_runs(place: &str, command: &str, output: &Output) {
    assert!(
        output.status.success(),
        "{place}: {command}\n{}\n{}\n{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn printed_decks_run() {
    for block in tagged("toml").iter().filter(|block| is_whole(&block.text)) {
        let folder = tempfile::tempdir().expect("a scratch folder");
        std::fs::write(folder.path().join("printed.toml"), &block.text).expect("written");
        let check = if RUN_DECKS_OF.contains(&block.page.as_str()) { "" } else { " --check" };
        let command = format!("mpm-par printed.toml{check}");
        assert_runs(&block.place, &command, &shell(folder.path(), &command));
    }
}

/// Each key of a fragment replaces that of the documented example.
#[test]
fn printed_parts_of_decks_fit_the_example() {
    for block in tagged("toml").iter().filter(|block| !is_whole(&block.text)) {
        let table: toml::Table =
            block.text.parse().unwrap_or_else(|error| panic!("{}: {error}", block.place));
        let sets: Vec<String> = table.iter().map(|(key, value)| format!("{key}={value}")).collect();
        let read = deck::read(Path::new("example.toml"), reference::EXAMPLE, &sets);
        read.unwrap_or_else(|error| panic!("{}: {error}", block.place));
    }
}

/// Without the comment at its end.
fn commands(block: &Block) -> impl Iterator<Item = &str> {
    let lines = block.text.lines().map(|line| line.split(" #").next().unwrap_or("").trim());
    lines.filter(|line| !line.is_empty() && !line.starts_with('#'))
}

fn not_run(command: &str) -> Option<&'static str> {
    NOT_RUN.iter().find(|(begin, _)| command.starts_with(begin)).map(|(_, why)| *why)
}

/// README.md from top to bottom in one folder: its deck as beam.toml, its commands, what the table
/// of results names, and its Python block.
#[test]
fn the_commands_of_readme_run_as_printed() {
    let scratch = tempfile::tempdir().expect("a scratch folder");
    let folder = scratch.path();
    let mut ran = 0;
    for block in blocks().iter().filter(|block| block.page == "README.md") {
        match block.tag.as_str() {
            "toml" => std::fs::write(folder.join("beam.toml"), &block.text).expect("written"),
            "sh" => {
                for command in commands(block) {
                    if let Some(why) = not_run(command) {
                        println!("{}: not run: {command}: {why}", block.place);
                        continue;
                    }
                    assert_runs(&block.place, command, &shell(folder, command));
                    ran += 1;
                }
            }
            "python" => python(block, folder),
            tag => panic!("{}: a block of \"{tag}\", which is not tried", block.place),
        }
    }
    assert!(ran >= 3, "{ran} commands ran");
    assert!(folder.join("out/beam/summary.json").exists());
    let text = std::fs::read_to_string(root().join("README.md")).expect("text");
    let rows =
        text.lines().filter(|line| line.starts_with("| `") && line.matches('|').count() == 3);
    let mut files = 0;
    for row in rows {
        let names = row.split('|').nth(1).expect("a column").split('`').skip(1).step_by(2);
        for name in names.filter(|name| name.contains('.') && !name.contains('*')) {
            assert!(folder.join("out/beam").join(name).exists(), "README.md names {name}");
            files += 1;
        }
    }
    assert!(files >= 8, "{files} files of results are named");
}

/// The guide's first hour, in one folder.
#[test]
fn the_first_hour_runs_as_printed() {
    let scratch = tempfile::tempdir().expect("a scratch folder");
    let folder = scratch.path();
    for block in tagged("sh").iter().filter(|block| block.page == FIRST_HOUR) {
        for command in commands(block) {
            assert_runs(&block.place, command, &shell(folder, command));
        }
    }
    for file in ["slope.toml", "out/slope/report.html", "slope-p.png", "crest.svg"] {
        assert!(folder.join(file).exists(), "{FIRST_HOUR} makes {file}");
    }
}

/// Every page is in the book's table, but for the log.
#[test]
fn the_book_has_every_page() {
    let summary = std::fs::read_to_string(root().join("docs/SUMMARY.md")).expect("text");
    for (page, _) in pages() {
        let Some(page) = page.strip_prefix("docs/").filter(|page| *page != "SUMMARY.md") else {
            continue;
        };
        assert!(summary.contains(&format!("]({page})")), "docs/SUMMARY.md has no {page}");
    }
}

/// Runs the block where Python has what it imports; else looks for the data that it names.
fn python(block: &Block, folder: &Path) {
    let modules = Command::new("python3").args(["-c", "import h5py, numpy"]).output();
    if modules.is_ok_and(|output| output.status.success()) {
        let output = Command::new("python3")
            .args(["-c", &block.text])
            .current_dir(folder)
            .output()
            .expect("it has just run");
        return assert_runs(&block.place, "python3", &output);
    }
    println!(
        "{}: not run: no Python with h5py and numpy here; its names are looked for",
        block.place
    );
    let quoted = |from: &str| -> Vec<String> {
        let parts = block.text.split(from).skip(1);
        parts.map(|rest| rest.split('"').next().unwrap_or("").to_string()).collect()
    };
    let file = quoted("h5py.File(\"");
    let points = hdf5::File::open(folder.join(&file[0])).expect("the block's file");
    for name in quoted("points[\"") {
        points.dataset(&name).unwrap_or_else(|error| panic!("{}: {name}: {error}", block.place));
    }
    let summary = std::fs::read_to_string(folder.join(&quoted("open(\"")[0])).expect("a summary");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    for key in quoted("\"))[\"") {
        assert!(summary.get(&key).is_some(), "{}: no {key}", block.place);
    }
}

/// Every command printed in docs/ is known here: an unknown one would be neither run nor listed.
#[test]
fn commands_of_the_pages_are_listed() {
    let run = ["README.md", FIRST_HOUR];
    for block in tagged("sh").iter().filter(|block| !run.contains(&block.page.as_str())) {
        for command in commands(block) {
            let Some(why) = not_run(command) else {
                panic!("{}: {command}: neither run nor listed in NOT_RUN", block.place);
            };
            println!("{}: not run: {command}: {why}", block.place);
        }
    }
}

/// Commands inside the text: the deck is there and takes the settings.
#[test]
fn decks_named_in_the_pages_take_the_printed_settings() {
    let mut found = 0;
    for (page, text) in pages() {
        // Blocks have been tried; what is left has single back quotes.
        let plain: String = text.split("```").step_by(2).collect();
        for span in plain.split('`').skip(1).step_by(2) {
            let words: Vec<&str> = span.split_whitespace().collect();
            let Some(at) = words.iter().position(|word| word.ends_with("mpm-par")) else {
                continue;
            };
            let Some(deck) = words.get(at + 1).filter(|deck| {
                deck.starts_with("inputs/")
                    && deck.ends_with(".toml")
                    && !deck.contains(char::is_uppercase)
            }) else {
                continue;
            };
            let sets = words.iter().zip(&words[1..]).filter(|(word, _)| **word == "--set");
            let sets: Vec<String> = sets.map(|(_, value)| value.replace('\'', "")).collect();
            // A placeholder or an ellipsis is no setting.
            if sets
                .iter()
                .any(|set| set.contains("...") || set.ends_with(|c: char| c.is_uppercase()))
            {
                continue;
            }
            let path = root().join(deck);
            let text = std::fs::read_to_string(&path)
                .unwrap_or_else(|error| panic!("{page}: {span}: {error}"));
            deck::read(&path, &text, &sets)
                .unwrap_or_else(|error| panic!("{page}: {span}: {error}"));
            found += 1;
        }
    }
    assert!(found >= 8, "{found} commands with a deck");
}

#[test]
fn links_between_the_pages_lead_somewhere() {
    for (page, text) in pages() {
        let folder = root().join(&page).parent().expect("a folder").to_path_buf();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let path = link.split('#').next().unwrap_or_default();
            let elsewhere = path.is_empty() || path.contains("://") || path.contains('\n');
            assert!(elsewhere || folder.join(path).exists(), "{page}: no {link}");
        }
    }
}

#[test]
fn make_run_and_install_do_what_they_say() {
    let make = |words: &[&str]| {
        // What is old is not made: no build inside a test.
        Command::new("make").args(["-o", "build"]).args(words).current_dir(root()).output()
    };
    let prefix = tempfile::tempdir().expect("a scratch folder");
    let place = prefix.path().display();
    let done = make(&["install", &format!("PREFIX={place}"), &format!("PROGRAM={PROGRAM}")]);
    let done = done.expect("make is on the PATH");
    assert_runs("Makefile", "make install", &done);
    let version = Command::new(prefix.path().join("bin/mpm-par")).arg("--version").output();
    assert!(version.expect("it is installed").status.success());
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(said.contains("not on the PATH"), "{said}");

    let dry = make(&["-n", "run", "RANKS=4", "DECK=inputs/column.toml"]).expect("make");
    let said = String::from_utf8_lossy(&dry.stdout).into_owned();
    let expected = "jobs/mpirun.sh 4 target/release/mpm-par inputs/column.toml --force";
    assert!(said.contains(expected), "{said}");
}
