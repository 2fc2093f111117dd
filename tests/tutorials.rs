//! Every tutorial of docs/guide/tutorials is followed as a reader would, from top to bottom in one folder:
//! its files are written, its commands and Python blocks run, and the numbers that it states are looked up
//! in the results.
//!
//! A page says by comments, which a browser does not show, what its blocks are:
//!
//! | comment | meaning |
//! |---|---|
//! | `<!-- file: NAME -->` | the next block is the file NAME |
//! | `<!-- more of: NAME -->` | the next block goes to the end of NAME |
//! | `<!-- ends with: 2 -->` | the commands of the next block end with this exit code |
//! | `<!-- not run: WHY -->` | the next block is not run |
//! | `<!-- number: 5.4 within 1 %: PLACE -->` | PLACE holds 5.4, which the text before states |
//!
//! PLACE is `FILE.json a.b.0`, or `FILE.csv last COLUMN`, with `first`, `max` or `min` for `last`, and may end
//! in `* FACTOR`. `UPDATE_DOCS=1 cargo test --test tutorials` copies the pictures that a page's commands make to
//! docs/figures.

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Mutex;

const PROGRAM: &str = env!("CARGO_BIN_EXE_mpm-par");
/// Pages take the cores one after the other.
static ONE_PAGE: Mutex<()> = Mutex::new(());

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn folder_of_pages() -> PathBuf {
    root().join("docs/guide/tutorials")
}

/// What a comment says of the block behind it.
#[derive(Debug, Clone, Default, PartialEq)]
struct Note {
    file: Option<String>,
    appended: bool,
    code: i32,
    not_run: Option<String>,
}

/// What a page asks for, in order.
#[derive(Debug, PartialEq)]
enum Item {
    Block { line: usize, tag: String, text: String, note: Note },
    Number(Stated),
}

/// A number of the text.
#[derive(Debug, PartialEq)]
struct Stated {
    line: usize,
    text: String,
    /// Largest relative error.
    within: f64,
    file: String,
    pick: String,
    factor: f64,
}

/// A comment of one line.
fn comment(line: &str) -> Option<&str> {
    Some(line.trim().strip_prefix("<!--")?.strip_suffix("-->")?.trim())
}

fn stated(line: usize, text: &str) -> Option<Stated> {
    let (number, rest) = text.split_once(" within ")?;
    let (percent, place) = rest.split_once(" %: ")?;
    let (place, factor) = match place.split_once(" * ") {
        Some((place, factor)) => (place, factor.trim().parse().ok()?),
        None => (place, 1.0),
    };
    let (file, pick) = place.trim().split_once(' ')?;
    Some(Stated {
        line,
        text: number.trim().into(),
        within: percent.trim().parse::<f64>().ok()? / 100.0,
        file: file.into(),
        pick: pick.trim().into(),
        factor,
    })
}

fn items(page: &str) -> Vec<Item> {
    let (mut found, mut note) = (Vec::new(), Note::default());
    let mut lines = page.lines().enumerate();
    while let Some((at, line)) = lines.next() {
        let number = at + 1;
        if let Some(tag) = line.strip_prefix("```") {
            let body = lines.by_ref().map(|(_, line)| line).take_while(|line| *line != "```");
            let text = body.fold(String::new(), |text, line| text + line + "\n");
            let note = std::mem::take(&mut note);
            found.push(Item::Block { line: number, tag: tag.trim().into(), text, note });
        } else if let Some(said) = comment(line) {
            let (word, rest) = said.split_once(": ").unwrap_or((said, ""));
            match word {
                "file" => note.file = Some(rest.into()),
                "more of" => {
                    (note.file, note.appended) = (Some(rest.into()), true);
                }
                "ends with" => note.code = rest.parse().expect("an exit code"),
                "not run" => note.not_run = Some(rest.into()),
                "number" => {
                    let number = stated(number, rest);
                    found.push(Item::Number(number.unwrap_or_else(|| panic!("{at}: {said}"))));
                }
                _ => panic!("line {number}: a comment of no known kind: {said}"),
            }
        }
    }
    found
}

/// A shell with `mpm-par` on its PATH, as after `make install`.
fn shell(folder: &Path, command: &str) -> Output {
    let bin = folder.join("bin");
    if !bin.exists() {
        std::fs::create_dir_all(&bin).expect("a folder");
        std::os::unix::fs::symlink(PROGRAM, bin.join("mpm-par")).expect("a link");
    }
    let mut shell = Command::new("sh");
    shell.args(["-c", command]);
    surroundings(&mut shell, folder);
    shell.output().expect("a shell")
}

/// The folder, the PATH, and the permissions of every test's mpirun.
fn surroundings(command: &mut Command, folder: &Path) {
    for (name, value) in common::job(1, 600).get_envs() {
        match value {
            Some(value) => command.env(name, value),
            None => command.env_remove(name),
        };
    }
    let path = std::env::var("PATH").unwrap_or_default();
    command.env("PATH", format!("{}:{path}", folder.join("bin").display()));
    command.current_dir(folder).stdin(Stdio::null());
}

fn python_name() -> String {
    std::env::var("MPM_PAR_PYTHON").unwrap_or_else(|_| "python3".into())
}

/// Whether the Python has what a block imports.
fn can_import(text: &str) -> bool {
    if !text.contains("mpm_par") {
        return true;
    }
    let found = Command::new(python_name()).args(["-c", "import h5py, numpy"]).output();
    found.is_ok_and(|output| output.status.success())
}

fn python(folder: &Path, text: &str) -> Output {
    let mut python = Command::new(python_name());
    surroundings(&mut python, folder);
    python.env("PYTHONDONTWRITEBYTECODE", "1").env("PYTHONPATH", root().join("jobs/python"));
    python.args(["-c", text]).output().expect("Python starts")
}

/// Follows a page. What it makes stays in `folder`.
fn follow(name: &str, folder: &Path) {
    let path = folder_of_pages().join(name);
    let page = std::fs::read_to_string(&path).unwrap_or_else(|reason| panic!("{name}: {reason}"));
    // What the last command or block wrote.
    let mut said = String::new();
    let mut skipped = false;
    for item in items(&page) {
        match item {
            Item::Number(stated) => {
                if !skipped {
                    check(name, &page, folder, &stated);
                }
            }
            Item::Block { line, note: Note { not_run: Some(why), .. }, .. } => {
                println!("{name}:{line}: not run: {why}");
            }
            Item::Block { text, note: Note { file: Some(file), appended, .. }, .. } => {
                let path = folder.join(file);
                let before = match appended {
                    true => std::fs::read_to_string(&path).expect("it is there") + "\n",
                    false => String::new(),
                };
                std::fs::write(path, before + &text).expect("the folder is writable");
            }
            Item::Block { line, tag, text, note } => match tag.as_str() {
                "sh" => {
                    for command in commands(&text) {
                        let output = shell(folder, command);
                        said = words(&output);
                        let code = output.status.code();
                        assert_eq!(code, Some(note.code), "{name}:{line}: {command}\n{said}");
                    }
                }
                "python" if can_import(&text) => {
                    let output = python(folder, &text);
                    said = words(&output);
                    assert!(output.status.success(), "{name}:{line}: python\n{said}");
                }
                "python" => {
                    println!("{name}:{line}: not run: {} has no h5py, numpy", python_name());
                    skipped = true;
                }
                // What the command before it writes; "..." stands for lines left out.
                "text" if skipped => {}
                "text" => {
                    for shown in text.lines().map(squeezed).filter(|shown| shown != "...") {
                        let found = said.lines().any(|line| squeezed(line) == shown);
                        assert!(found, "{name}:{line}: not written: {shown}\n{said}");
                    }
                }
                tag => panic!("{name}:{line}: a block of \"{tag}\", which is not tried"),
            },
        }
    }
    pictures(name, &page, folder);
}

/// Lines without the comments at their ends.
fn commands(text: &str) -> impl Iterator<Item = &str> {
    let lines = text.lines().map(|line| line.split(" #").next().unwrap_or("").trim());
    lines.filter(|line| !line.is_empty() && !line.starts_with('#'))
}

fn words(output: &Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    text(&output.stdout) + &text(&output.stderr)
}

fn squeezed(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The number stands in the text before its comment, and in the results.
fn check(name: &str, page: &str, folder: &Path, stated: &Stated) {
    let at = format!("{name}:{}", stated.line);
    let before: Vec<&str> = page.lines().take(stated.line - 1).collect();
    let near = before.len().saturating_sub(20);
    let text = before[near..].join("\n");
    assert!(text.contains(&stated.text), "{at}: the text before does not say {}", stated.text);
    let expected: f64 = stated.text.parse().unwrap_or_else(|_| panic!("{at}: no number"));
    let content = std::fs::read_to_string(folder.join(&stated.file));
    let content = content.unwrap_or_else(|reason| panic!("{at}: {}: {reason}", stated.file));
    let found = match stated.file.ends_with(".json") {
        true => of_json(&content, &stated.pick),
        false => of_table(&content, &stated.pick),
    };
    let found = found.unwrap_or_else(|| panic!("{at}: no {} in {}", stated.pick, stated.file));
    let found = found * stated.factor;
    println!("{at}: {} stated, {found} found", stated.text);
    assert!(
        (found - expected).abs() <= stated.within * expected.abs(),
        "{at}: {} is stated, {found} found",
        stated.text
    );
}

fn of_json(content: &str, pick: &str) -> Option<f64> {
    let mut value: serde_json::Value = serde_json::from_str(content).ok()?;
    for part in pick.split('.') {
        value = match part.parse::<usize>() {
            Ok(index) => value.get(index)?.clone(),
            Err(_) => value.get(part)?.clone(),
        };
    }
    value.as_f64()
}

fn of_table(content: &str, pick: &str) -> Option<f64> {
    let (which, column) = pick.split_once(' ')?;
    let mut lines = content.lines();
    let head = lines.next()?;
    let at = head.split(',').position(|name| name.split(" [").next() == Some(column))?;
    let values: Option<Vec<f64>> =
        lines.map(|line| line.split(',').nth(at)?.parse().ok()).collect();
    let values = values?;
    match which {
        "first" => values.first().copied(),
        "last" => values.last().copied(),
        "max" => values.into_iter().reduce(f64::max),
        "min" => values.into_iter().reduce(f64::min),
        _ => None,
    }
}

/// The page's pictures were made by its commands: docs/figures/tutorial-NAME is the folder's NAME.
fn pictures(name: &str, page: &str, folder: &Path) {
    for link in page.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
        let Some(own) = link.strip_prefix("../../figures/tutorial-") else { continue };
        let made = folder.join(own);
        assert!(made.exists(), "{name}: no command makes {own}");
        let kept = root().join("docs/figures").join(format!("tutorial-{own}"));
        if std::env::var_os("UPDATE_DOCS").is_some() {
            std::fs::copy(&made, &kept).expect("docs/figures is writable");
        }
        let size = |path: &Path| std::fs::metadata(path).map_or(0, |data| data.len());
        assert!(size(&kept) > 0, "{name}: {} is not there", kept.display());
        assert!(size(&kept) < 60_000, "{name}: {own} is larger than 60 kB");
    }
}

fn follow_alone(name: &str) {
    let _alone = ONE_PAGE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let scratch = tempfile::tempdir().expect("a scratch folder");
    follow(name, scratch.path());
}

/// A test for each page.
macro_rules! tutorials {
    ($($test:ident: $page:literal),* $(,)?) => {
        const PAGES: &[&str] = &[$($page),*];
        $(#[test]
        fn $test() {
            follow_alone($page);
        })*
    };
}

tutorials! {
    a_beam: "beam.md",
    a_slope: "slope.md",
    a_footing: "footing.md",
    a_column_of_sand: "column.md",
    an_excavation: "excavation.md",
    a_block_on_an_incline: "contact.md",
    a_tube: "tube.md",
    a_triaxial_test: "triaxial.md",
    an_impact: "impact.md",
    shapes_of_ones_own: "geometry.md",
    sweeps: "sweeps.md",
    restart_and_clusters: "restart.md",
}

#[test]
fn every_page_is_followed() {
    let entries = std::fs::read_dir(folder_of_pages()).expect("the folder of tutorials");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("a page").file_name().to_string_lossy().into()).collect();
    names.sort();
    let mut known: Vec<&str> = PAGES.to_vec();
    known.push("README.md");
    known.sort_unstable();
    assert_eq!(names, known);
    let text = std::fs::read_to_string(folder_of_pages().join("README.md")).expect("text");
    for page in PAGES {
        assert!(text.contains(&format!("]({page})")), "README.md has no {page}");
    }
}

#[test]
fn pages_are_read_as_they_say() {
    let page = "It is 2.5 m.\n<!-- number: 2.5 within 3 %: out/a.csv last y.x * 10 -->\n\
                <!-- more of: a.toml -->\n```toml\nx = 1\n```\n";
    let found = items(page);
    let note = Note { file: Some("a.toml".into()), appended: true, ..Note::default() };
    let block = Item::Block { line: 4, tag: "toml".into(), text: "x = 1\n".into(), note };
    assert_eq!(found[1], block);
    let Item::Number(stated) = &found[0] else { panic!("{found:?}") };
    assert_eq!((stated.within, stated.factor, &stated.pick[..]), (0.03, 10.0, "last y.x"));
    assert_eq!(of_table("step [-],y.x [m]\n1,3\n2,0.25\n", "last y.x"), Some(0.25));
    assert_eq!(of_table("step [-],y.x [m]\n1,3\n2,0.25\n", "max y.x"), Some(3.0));
    assert_eq!(of_json("{\"a\": {\"b\": [1, 4]}}", "a.b.1"), Some(4.0));
}
