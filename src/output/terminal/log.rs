//! What is said to the user: on the terminal and in `log.txt`, by rank 0.

use std::fs::{File, OpenOptions};
use std::io::{IsTerminal, Write};

use mpi::topology::{Communicator, SimpleCommunicator};

use crate::error::Result;
use crate::output::agreement::on_root;
use crate::output::directory::{LOG, ResultsDirectory};
use crate::output::warnings::Warnings;
use crate::output::whole_file::cannot_write;

/// Erases the line that the next text replaces.
const ERASE_LINE: &str = "\r\x1b[2K";

/// Speaks on rank 0 and is silent elsewhere. The directory may come later than the first words:
/// they are kept and written to `log.txt` once it is known.
#[derive(Debug, Default)]
pub struct Log {
    speaks: bool,
    on_terminal: bool,
    /// The terminal shows warnings only.
    quiet: bool,
    /// A line without an end stands on the terminal.
    transient: bool,
    unwritten: String,
    file: Option<File>,
    warnings: Warnings,
}

impl Log {
    pub fn new(comm: &SimpleCommunicator) -> Self {
        let speaks = comm.rank() == 0;
        Self { speaks, on_terminal: speaks && stdout_is_terminal(), ..Self::default() }
    }

    /// Opens `log.txt`; `resume` continues the one that is there.
    pub fn attach(
        &mut self,
        directory: &ResultsDirectory,
        resume: bool,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        on_root(comm, || {
            let path = directory.file(LOG);
            let mut options = OpenOptions::new();
            options.create(true).write(true).append(resume).truncate(!resume);
            let file = options.open(&path).and_then(|mut file| {
                file.write_all(self.unwritten.as_bytes())?;
                Ok(file)
            });
            self.file = Some(file.map_err(|reason| cannot_write(&path, &reason))?);
            self.unwritten.clear();
            Ok(())
        })
    }

    /// From here on the terminal shows warnings only; the file keeps everything.
    pub fn be_quiet(&mut self) {
        self.quiet = true;
        self.on_terminal = false;
    }

    pub fn on_terminal(&self) -> bool {
        self.on_terminal
    }

    /// Says `text`, which may have several lines, on the terminal and in the file.
    pub fn say(&mut self, text: &str) {
        self.show(text);
        self.note(text);
    }

    /// Warns of `text`, unless it has done so before, and keeps it for the summary.
    pub fn warn(&mut self, text: &str) {
        if self.warnings.add(None, text) {
            self.say(&format!("warning: {text}"));
        }
    }

    /// [`Self::warn`] of what `step` met; `text` is what may come back in later steps, which then
    /// only the file and the count show. `detail` belongs to this step.
    pub fn warn_of_step(&mut self, step: usize, text: &str, detail: &str) {
        let whole = format!("warning: step {step}: {text} {detail}");
        if self.warnings.add(Some(step), text) {
            self.say(whole.trim_end());
        } else {
            self.note(whole.trim_end());
        }
    }

    /// What the run has warned of.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.lines()
    }

    /// Says `text` on the terminal only.
    pub fn show(&mut self, text: &str) {
        if self.speaks && (!self.quiet || text.starts_with("warning")) {
            let erase = if std::mem::take(&mut self.transient) { ERASE_LINE } else { "" };
            // Nobody listens to a closed pipe; the run and its files go on.
            let mut out = std::io::stdout().lock();
            let text = text.trim_end_matches('\n');
            let text = if self.on_terminal { painted(text) } else { text.into() };
            let _ = writeln!(out, "{erase}{text}");
            let _ = out.flush();
        }
    }

    /// Shows a line that the next one replaces; nothing where output is not a terminal.
    pub fn show_briefly(&mut self, line: &str) {
        if self.on_terminal {
            let mut out = std::io::stdout().lock();
            let _ = write!(out, "{ERASE_LINE}{line}");
            let _ = out.flush();
            self.transient = true;
        }
    }

    /// Writes `text` to the file only.
    pub fn note(&mut self, text: &str) {
        if !self.speaks {
            return;
        }
        let text = format!("{}\n", text.trim_end_matches('\n'));
        match &mut self.file {
            // The results themselves report a full disk; the log does not stop a run.
            Some(file) => drop(file.write_all(text.as_bytes())),
            None => self.unwritten.push_str(&text),
        }
    }
}

/// A warning in yellow, unless the variable NO_COLOR is set (no-color.org).
fn painted(text: &str) -> std::borrow::Cow<'_, str> {
    let plain = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    match text.strip_prefix("warning") {
        Some(rest) if !plain => format!("\x1b[33mwarning\x1b[0m{rest}").into(),
        _ => text.into(),
    }
}

/// Open MPI gives every rank a pseudo-terminal, also when its own output goes to a file; then
/// only the launcher's output shows.
fn stdout_is_terminal() -> bool {
    if !std::io::stdout().is_terminal() {
        return false;
    }
    if std::env::var_os("OMPI_COMM_WORLD_RANK").is_none() {
        return true;
    }
    let launcher = std::os::unix::process::parent_id();
    std::fs::read_link(format!("/proc/{launcher}/fd/1")).is_ok_and(|target| {
        let target = target.to_string_lossy();
        target.starts_with("/dev/pts/") || target.starts_with("/dev/tty")
    })
}
