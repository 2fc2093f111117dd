//! Command lines that run nothing: a text or a small file, before MPI and PETSc start. Under
//! `mpirun` the first rank does it and the others end at once.

use std::ffi::OsString;
use std::fs::{self, OpenOptions};
use std::io::{IsTerminal, Write as _};
use std::path::PathBuf;

use crate::cli::{self, Plot, Tool};
use crate::deck::templates::Template;
use crate::error::{Error, Result};
use crate::output::names::REPORT;
use crate::output::plot::{Curves, Picture};
use crate::output::report;
use crate::output::series::frames;
use crate::parallel::launcher;

/// Does what the words ask for (the program's name first); returns the exit code.
pub fn run(words: &[OsString]) -> i32 {
    if launcher::rank_of_process(|name| std::env::var(name).ok()) != 0 {
        return 0;
    }
    match outcome(words) {
        Ok(()) => 0,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "error: {}", error.to_string().trim_end());
            error.exit_code()
        }
    }
}

fn outcome(words: &[OsString]) -> Result<()> {
    if cli::is_tool(words) {
        return match cli::tool(words)? {
            Err(text) => print(text.trim_end()),
            Ok(tool) => use_tool(tool),
        };
    }
    let arguments = cli::parse(words.iter().cloned())?;
    match (arguments.new, arguments.print) {
        (Some(template), _) => write_deck(&template, arguments.force),
        (None, text) => print(text.unwrap_or_default().trim_end()),
    }
}

fn use_tool(tool: Tool) -> Result<()> {
    match tool {
        Tool::Report { directory, output } => {
            let path = output.unwrap_or_else(|| directory.join(REPORT));
            let bytes = report::write_to(&directory, &path)?;
            print(&format!("wrote {} ({:.1} MB)", path.display(), bytes as f64 / 1e6))
        }
        Tool::Plot(plot) => draw(&plot),
        Tool::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut cli::whole_command(), "mpm-par", &mut script);
            print(&String::from_utf8_lossy(&script))
        }
        Tool::Man => {
            let mut page = Vec::new();
            let rendered = clap_mangen::Man::new(cli::whole_command()).render(&mut page);
            rendered.map_err(|reason| Error::File(format!("cannot write the page: {reason}")))?;
            print(&String::from_utf8_lossy(&page))
        }
    }
}

fn draw(plot: &Plot) -> Result<()> {
    let path = &plot.output;
    match &plot.field {
        Some(field) => draw_points(plot, field)?,
        None => {
            let table = plot.directory.join(format!("{}.csv", table_of(plot)));
            let text = fs::read_to_string(&table).map_err(|reason| {
                Error::File(format!("cannot read {}: {reason}", table.display()))
            })?;
            if plot.columns.is_empty() {
                return Err(nothing_chosen(plot, &text));
            }
            let caption =
                plot.directory.file_name().map(|name| name.to_string_lossy().into_owned());
            let curves =
                Curves::of_table(&text, &plot.columns, plot.x.as_deref(), plot.log, caption)?;
            curves.write(path)?;
        }
    }
    print(&format!("wrote {}", path.display()))
}

/// The table of the curves: an element test has no history.
fn table_of(plot: &Plot) -> &str {
    let is_there = |name: &str| plot.directory.join(format!("{name}.csv")).exists();
    match &plot.table {
        Some(table) => table,
        None if is_there("element") && !is_there("history") => "element",
        None => "history",
    }
}

/// What there is to choose from.
fn nothing_chosen(plot: &Plot, table: &str) -> Error {
    let titles = table.lines().next().unwrap_or("").split(',');
    let columns: Vec<&str> = titles.filter_map(|title| title.split(" [").next()).collect();
    let fields = frames::read_one(&plot.directory, None, false).map(|frames| {
        let names: Vec<&str> = frames.columns.iter().map(|column| column.name.as_str()).collect();
        format!("\n    --field, points of a frame: {}", names.join(", "))
    });
    Error::Input(format!(
        "what is to be drawn?{}\n    --columns, curves of {}.csv: {}",
        fields.unwrap_or_default(),
        table_of(plot),
        columns.join(", ")
    ))
}

fn draw_points(plot: &Plot, field: &str) -> Result<()> {
    let frames = frames::read_one(&plot.directory, plot.step, plot.domains)?;
    let column = |name: &str| frames.columns.iter().position(|column| column.name == name);
    // A vector's own name means its length.
    let Some(at) = column(field).or_else(|| column(&format!("|{field}|"))) else {
        let names: Vec<&str> = frames.columns.iter().map(|column| column.name.as_str()).collect();
        let known = names.join(", ");
        return Err(Error::Input(format!("the frame has no field \"{field}\"; it has {known}")));
    };
    let frame = &frames.frames[0];
    let sampled =
        if frames.stride > 1 { format!(", one point in {}", frames.stride) } else { String::new() };
    let name = plot.directory.file_name().unwrap_or_default().to_string_lossy();
    let picture = Picture {
        frame,
        column: &frames.columns[at],
        values: &frame.values[at],
        flat: frames.flat,
        range: plot.range.as_ref().and_then(|ends| Some((*ends.first()?, *ends.get(1)?))),
        caption: format!("{name}, step {}{sampled}", frame.step),
    };
    picture.write(&plot.output)
}

/// Prints to standard output. A reader that has seen enough closes the pipe: that is no fault.
fn print(text: &str) -> Result<()> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(reason) if reason.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::File(format!("cannot write to standard output: {reason}")))
        }
        _ => Ok(()),
    }
}

/// Writes NAME.toml in the working directory. Where standard output is a deck, it goes there instead
/// (`mpm-par --new slope > mine.toml`), and where it is a pipe or another file, such as a job's log, there too.
fn write_deck(template: &Template, force: bool) -> Result<()> {
    let stdout = std::io::stdout();
    let redirected = is_deck(1);
    if !stdout.is_terminal() {
        print(template.text.trim_end())?;
    }
    let path = PathBuf::from(format!("{}.toml", template.name));
    if redirected {
        let _ = writeln!(
            std::io::stderr(),
            "the deck went to standard output: {} was not written",
            path.display()
        );
        return Ok(());
    }
    let opened =
        OpenOptions::new().write(true).create(true).create_new(!force).truncate(true).open(&path);
    let written = opened.and_then(|mut file| file.write_all(template.text.as_bytes()));
    written.map_err(|reason| match reason.kind() {
        std::io::ErrorKind::AlreadyExists if is_same(&path, template) => {
            Error::Input(format!("{} is there already, unchanged", path.display()))
        }
        std::io::ErrorKind::AlreadyExists => Error::Input(format!(
            "{} is there already: move it away, or replace it by --force",
            path.display()
        )),
        _ => Error::File(format!("cannot write {}: {reason}", path.display())),
    })?;
    let name = path.display();
    let _ = writeln!(
        std::io::stderr(),
        "wrote {name}. Next: mpm-par {name} --check, then mpirun -n 2 mpm-par {name}"
    );
    Ok(())
}

fn is_same(path: &std::path::Path, template: &Template) -> bool {
    fs::read(path).is_ok_and(|bytes| bytes == template.text.as_bytes())
}

/// Whether a regular file with the ending of a deck is open there.
fn is_deck(descriptor: i32) -> bool {
    let link = format!("/proc/self/fd/{descriptor}");
    let named = fs::read_link(&link).is_ok_and(|path| path.extension() == Some("toml".as_ref()));
    named && fs::metadata(&link).is_ok_and(|found| found.is_file())
}
