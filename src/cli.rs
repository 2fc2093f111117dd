//! Command line (design: options with two dashes are ours, words with one dash go to PETSc).

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};

use crate::deck::templates::{Template, template_of};
use crate::deck::{explain, json_schema, list};
use crate::error::{Error, Result};
use crate::record::checkpointing::Restart;

/// The command line, read.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Arguments {
    /// Text of `--help`, `--version`, `--list` and their like: print it and leave with 0; nothing
    /// else is set.
    pub print: Option<String>,
    /// `--new`: write this deck and leave with 0; nothing else but `force` is set.
    pub new: Option<Template>,
    /// The deck.
    pub input: PathBuf,
    /// `KEY=VALUE`, in order.
    pub sets: Vec<String>,
    /// Results directory: `--out`, or `out/<deck file stem>`.
    pub out: PathBuf,
    /// Validate and plan, run nothing.
    pub check: bool,
    pub restart: Option<Restart>,
    /// Overwrite existing results.
    pub force: bool,
    pub voice: Voice,
    /// PETSc options and their values, untouched and in order.
    pub petsc: Vec<String>,
}

/// How much the terminal shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Voice {
    /// Warnings and errors.
    Quiet,
    #[default]
    Normal,
    /// Every step, here and in the log.
    Verbose,
}

const USAGE: &str = "mpirun -n N mpm-par INPUT.toml [--set KEY=VALUE]... [--out DIR] \
     [--check] [--restart FILE|last] [--force] [--quiet|--verbose] [PETSc options]";

/// Distributed material point method: runs the analysis that INPUT.toml describes.
#[derive(Debug, Parser)]
#[command(
    name = "mpm-par",
    version,
    disable_help_flag = true,
    disable_version_flag = true,
    override_usage = USAGE,
    after_help = "Words with one dash, and their values, go to PETSc: -qs_ for equilibrium, -mass_ for mass solves.\nTools: mpm-par report DIR, mpm-par plot DIR --field F -o FILE, mpm-par completions SHELL, mpm-par man; each has --help.\nExit codes: 0 done, 1 the run failed, 2 bad input, 3 restart or file problem, 4 environment."
)]
struct CommandLine {
    /// The deck; - reads it from standard input
    #[arg(value_name = "INPUT.toml", required_unless_present_any = ["list", "explain", "schema", "new"])]
    input: Option<PathBuf>,
    /// Change a key of the deck by its dotted path; the value is TOML
    #[arg(long, value_name = "KEY=VALUE", allow_hyphen_values = true)]
    set: Vec<String>,
    /// Results directory (default: out/ and the name of the deck)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Validate, build, print the plan; run nothing
    #[arg(long)]
    check: bool,
    /// Continue from a checkpoint
    #[arg(long, value_name = "FILE|last")]
    restart: Option<PathBuf>,
    /// Overwrite existing results
    #[arg(long)]
    force: bool,
    /// Show warnings and errors only; log.txt stays complete
    #[arg(long, conflicts_with = "verbose")]
    quiet: bool,
    /// Show every step
    #[arg(long)]
    verbose: bool,
    /// Write a commented deck to start from, NAME.toml: --list tells the names
    #[arg(long, value_name = "NAME")]
    new: Option<String>,
    /// List materials, bases, analyses, loads, fields and templates, one line each
    #[arg(long)]
    list: bool,
    /// Tell what a key, a model, a field or a choice of the deck means
    #[arg(long, value_name = "WORD")]
    explain: Option<String>,
    /// Print the JSON Schema of decks, for editors
    #[arg(long)]
    schema: bool,
    /// Print help (also -h)
    #[arg(long, action = clap::ArgAction::Help)]
    help: Option<bool>,
    /// Print version (also -V)
    #[arg(long, action = clap::ArgAction::Version)]
    version: Option<bool>,
}

/// The deck's name that stands for standard input.
pub const STANDARD_INPUT: &str = "-";

/// Options of ours that take the next word.
const WITH_VALUE: [&str; 5] = ["--set", "--out", "--restart", "--explain", "--new"];

/// What the program does besides running decks.
#[derive(Debug, Clone, PartialEq, Subcommand)]
pub enum Tool {
    /// Write report.html of a results directory, also while its run goes on
    Report {
        /// The results directory
        #[arg(value_name = "DIR")]
        directory: PathBuf,
        /// Somewhere else than DIR/report.html
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Draw points coloured by a field, or columns of a table, to a .png or .svg
    Plot(Plot),
    /// Print the completions of a shell
    Completions {
        /// Which one
        shell: clap_complete::Shell,
    },
    /// Print the manual page
    Man,
}

/// What to draw.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct Plot {
    /// The results directory
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,
    /// Points by this field: stress.yy, displacement (its length), J
    #[arg(long, value_name = "FIELD")]
    pub field: Option<String>,
    /// Draw the domains of the points, with their outlines, in place of squares
    #[arg(long, requires = "field")]
    pub domains: bool,
    /// Step of the frame (default: the last)
    #[arg(long, value_name = "N", requires = "field")]
    pub step: Option<usize>,
    /// Values of the first and the last colour, as LOW,HIGH (default: those of the frame)
    #[arg(
        long,
        value_name = "LOW,HIGH",
        requires = "field",
        value_delimiter = ',',
        num_args = 2,
        allow_hyphen_values = true
    )]
    pub range: Option<Vec<f64>>,
    /// Curves: columns of a table, by their names without units, separated by commas
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', conflicts_with = "field")]
    pub columns: Vec<String>,
    /// The table of the curves: history, probes, residuals, element (default: history, or what there is)
    #[arg(long, value_name = "TABLE")]
    pub table: Option<String>,
    /// Column across (default: the first of time, load_factor and step that grows from row to row)
    #[arg(long, value_name = "NAME")]
    pub x: Option<String>,
    /// A logarithmic vertical axis
    #[arg(long)]
    pub log: bool,
    /// The picture: NAME.png or NAME.svg
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

#[derive(Debug, Parser)]
#[command(name = "mpm-par", version)]
struct Tools {
    #[command(subcommand)]
    tool: Tool,
}

/// Words that ask for nothing but a text or a small file: neither MPI nor PETSc is needed.
const ALONE: [&str; 8] =
    ["-h", "-V", "--help", "--version", "--list", "--schema", "--explain", "--new"];

/// True if the command line (the program's name first) starts no run.
pub fn runs_nothing(words: &[OsString]) -> bool {
    let is_alone = |word: &OsString| {
        let text = word.to_string_lossy();
        ALONE.contains(&text.split('=').next().unwrap_or_default())
    };
    is_tool(words) || words.iter().skip(1).any(is_alone)
}

/// True if the first word is that of a [`Tool`].
pub fn is_tool(words: &[OsString]) -> bool {
    let first = words.get(1).map(|word| word.to_string_lossy());
    first.is_some_and(|first| {
        Tools::command().get_subcommands().any(|tool| tool.get_name() == first)
    })
}

/// The tool that the words ask for; `Ok(Err(text))` is a help text to print.
pub fn tool(words: &[OsString]) -> Result<std::result::Result<Tool, String>> {
    match Tools::try_parse_from(words) {
        Ok(tools) => Ok(Ok(tools.tool)),
        Err(e) if matches!(e.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            Ok(Err(e.to_string()))
        }
        Err(e) => {
            let text = e.to_string();
            Err(Error::Input(text.strip_prefix("error: ").unwrap_or(&text).trim_end().to_string()))
        }
    }
}

/// The whole command line with its tools, for completions and the manual page.
pub fn whole_command() -> clap::Command {
    let tools = Tools::command();
    CommandLine::command().subcommands(tools.get_subcommands().cloned())
}

/// Reads the command line; the first word is the program's name. Error: bad usage, with the
/// usage text.
pub fn parse(args: impl IntoIterator<Item = OsString>) -> Result<Arguments> {
    let (ours, petsc) = divide(args)?;
    let words = match CommandLine::try_parse_from(ours) {
        Ok(words) => words,
        Err(e) if matches!(e.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            return Ok(Arguments { print: Some(e.to_string()), ..Arguments::default() });
        }
        Err(e) => return Err(Error::Input(bad_usage(&e.to_string()))),
    };
    let printed = match (&words.explain, words.list, words.schema) {
        (Some(word), ..) => Some(explain::explain(word)?),
        (None, true, _) => Some(list::list()),
        (None, false, true) => Some(format!("{:#}", json_schema::json_schema())),
        (None, false, false) => None,
    };
    let new = words.new.as_deref().map(template_of).transpose()?;
    if printed.is_some() || new.is_some() {
        return Ok(Arguments { print: printed, new, force: words.force, ..Arguments::default() });
    }
    let input = words.input.unwrap_or_default();
    let out = words.out.unwrap_or_else(|| default_out(&input));
    if out.to_str().is_none() {
        return Err(Error::Input(format!(
            "the results directory {} has a name that is not UTF-8, which HDF5 files cannot have: \
             give another one by --out DIR",
            out.display()
        )));
    }
    let restart = words.restart.map(|file| match file.to_str() {
        Some("last") => Restart::Last,
        _ => Restart::File(file),
    });
    Ok(Arguments {
        print: None,
        new: None,
        input,
        sets: words.set,
        out,
        check: words.check,
        restart,
        force: words.force,
        voice: match (words.quiet, words.verbose) {
            (true, _) => Voice::Quiet,
            (_, true) => Voice::Verbose,
            _ => Voice::Normal,
        },
        petsc,
    })
}

/// clap's message, always with the usage.
fn bad_usage(message: &str) -> String {
    let message = message.strip_prefix("error: ").unwrap_or(message).trim_end();
    if message.contains("Usage: ") {
        return message.to_string();
    }
    format!("{message}\n\nUsage: {USAGE}")
}

fn default_out(input: &Path) -> PathBuf {
    if input == Path::new(STANDARD_INPUT) {
        return Path::new("out").join("stdin");
    }
    Path::new("out").join(input.file_stem().unwrap_or(input.as_os_str()))
}

/// Splits our words from PETSc's. A word after a PETSc option is that option's value, unless it
/// is an option itself or ends in `.toml` while no deck has been named.
fn divide(args: impl IntoIterator<Item = OsString>) -> Result<(Vec<OsString>, Vec<String>)> {
    let mut args = args.into_iter();
    let mut ours: Vec<OsString> = args.next().into_iter().collect();
    let mut petsc: Vec<String> = Vec::new();
    let mut after_petsc_option = false;
    let mut deck_named = false;
    while let Some(word) = args.next() {
        let text = word.to_string_lossy().into_owned();
        if ["-h", "-V"].contains(&text.as_str()) {
            // Ours in short, not PETSc's, wherever they stand.
            ours.push(if text == "-h" { "--help".into() } else { "--version".into() });
            after_petsc_option = false;
        } else if text.starts_with("--") {
            let takes_next = WITH_VALUE.contains(&text.as_str());
            ours.push(word);
            ours.extend(takes_next.then(|| args.next()).flatten());
            after_petsc_option = false;
        } else if is_option(&text) {
            petsc.push(unicode(word)?);
            after_petsc_option = true;
        } else if after_petsc_option && (deck_named || !text.ends_with(".toml")) {
            petsc.push(unicode(word)?);
            after_petsc_option = false;
        } else {
            ours.push(word);
            deck_named = true;
            after_petsc_option = false;
        }
    }
    Ok((ours, petsc))
}

/// One dash and a letter or underscore: not a negative number.
fn is_option(word: &str) -> bool {
    let mut letters = word.chars();
    letters.next() == Some('-')
        && letters.next().is_some_and(|c| c.is_alphabetic() || c == '_')
        && word.parse::<f64>().is_err()
}

fn unicode(word: OsString) -> Result<String> {
    word.into_string().map_err(|word| {
        Error::Input(format!("PETSc options must be Unicode, found {}", word.to_string_lossy()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> Result<Arguments> {
        parse(std::iter::once("mpm-par").chain(line.split_whitespace()).map(OsString::from))
    }

    #[test]
    fn everything_has_its_place() {
        let a = read(
            "inputs/beam.toml --set method.basis=gimp --set body.0.points_per_cell=[3,3] --out here \
             --check --restart last --force -qs_ksp_type cg -log_view -shift -1e-3 -a -inf -b .5",
        )
        .expect("valid");
        assert_eq!(a.input, Path::new("inputs/beam.toml"));
        assert_eq!(a.sets, ["method.basis=gimp", "body.0.points_per_cell=[3,3]"]);
        assert_eq!(a.out, Path::new("here"));
        assert!(a.check && a.force && a.print.is_none());
        assert_eq!(a.restart, Some(Restart::Last));
        let petsc =
            ["-qs_ksp_type", "cg", "-log_view", "-shift", "-1e-3", "-a", "-inf", "-b", ".5"];
        assert_eq!(a.petsc, petsc);
    }

    #[test]
    fn order_does_not_matter() {
        for line in [
            "-log_view deck.toml --set=a=-1 -x 1",
            "--set a=-1 -log_view --force deck.toml -x 1",
            "deck.toml -log_view -x 1 --set a=-1",
        ] {
            let a = read(line).expect(line);
            assert_eq!(a.input, Path::new("deck.toml"), "{line}");
            assert_eq!(a.sets, ["a=-1"], "{line}");
            assert_eq!(a.petsc, ["-log_view", "-x", "1"], "{line}");
            assert_eq!(a.out, Path::new("out/deck"), "{line}");
        }
        let a = read("deck.toml -options_file other.toml --restart out/deck/checkpoint-3.h5");
        let a = a.expect("valid");
        assert_eq!(a.petsc, ["-options_file", "other.toml"]);
        assert_eq!(a.restart, Some(Restart::File("out/deck/checkpoint-3.h5".into())));
    }

    #[test]
    fn a_dash_is_standard_input() {
        let a = read("- --set a=1 -log_view").expect("valid");
        assert_eq!((a.input.as_path(), a.out.as_path()), (Path::new("-"), Path::new("out/stdin")));
    }

    #[test]
    fn bad_usage_is_bad_input() {
        for (line, part) in [
            ("", "INPUT.toml"),
            ("deck.toml --sett a=1", "--set"),
            ("deck.toml other.toml", "other.toml"),
            ("deck.toml --set", "--set <KEY=VALUE>"),
            ("deck.toml --out a --out b", "--out"),
            ("deck.toml --quiet --verbose", "--verbose"),
        ] {
            let error = read(line).expect_err(line);
            assert_eq!(error.exit_code(), 2);
            let text = error.to_string();
            assert!(text.contains(part) && text.contains("Usage: mpirun -n N mpm-par"), "{text}");
        }
    }

    #[test]
    fn one_voice() {
        let voice = |line| read(line).expect("valid").voice;
        assert_eq!(voice("deck.toml"), Voice::Normal);
        assert_eq!(voice("--quiet deck.toml -log_view"), Voice::Quiet);
        assert_eq!(voice("deck.toml -log_view --verbose"), Voice::Verbose);
    }

    #[test]
    fn results_go_where_hdf5_can_write() {
        use std::os::unix::ffi::OsStringExt;
        let bad = OsString::from_vec(b"out-\xff".to_vec());
        let deck = OsString::from_vec(b"deck-\xff.toml".to_vec());
        for words in [vec!["deck.toml".into(), "--out".into(), bad], vec![deck]] {
            let words = std::iter::once(OsString::from("mpm-par")).chain(words);
            let error = parse(words).expect_err("not UTF-8");
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains("not UTF-8"), "{error}");
        }
    }

    #[test]
    fn help_and_version_are_texts_to_print() {
        let help = read("--help").expect("valid").print.expect("text");
        assert!(help.contains("--restart <FILE|last>") && help.contains("Exit codes: 0 done"));
        let version = read("--version").expect("valid").print.expect("text");
        assert_eq!(version.trim_end(), concat!("mpm-par ", env!("CARGO_PKG_VERSION")));
        for (word, text) in [("-h", &help), ("-V", &version)] {
            for line in [word.to_string(), format!("deck.toml -log_view {word}")] {
                assert_eq!(read(&line).expect("valid").print.as_ref(), Some(text), "{line}");
            }
        }
        // PETSc has a help of its own.
        assert_eq!(read("deck.toml -help").expect("valid").petsc, ["-help"]);
    }
}
