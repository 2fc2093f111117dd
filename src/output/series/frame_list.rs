//! Small files that list the frames of a series and their times, for the readers that open them.
//!
//! | file | lists | for |
//! |---|---|---|
//! | `points.xdmf` | `points-*.h5` | ParaView, VisIt |
//! | `points.pvd` | `points-*.vtu` | ParaView, VisIt |
//! | `points.vtkhdf.series` | `points-*.h5`, which are VTKHDF files then | ParaView |
//!
//! and likewise for `domains`, `grid` and `rigid`.

use std::fs;
use std::path::Path;

use mpi::topology::SimpleCommunicator;

use super::frame::{Frame, Totals};
use super::frame_series::StepTime;
use super::growing_file::GrowingFile;
use super::xdmf;
use crate::deck::model::Format;
use crate::error::{Error, Result};
use crate::output::agreement::on_root;
use crate::output::directory::ResultsDirectory;
use crate::output::names::{PVD_HEAD, SERIES_HEAD, SERIES_LIST_HEAD, names_in, number_of};
use crate::output::terminal::log::Log;
use crate::output::whole_file::cannot_read;

/// A list that grows by a frame at a time and is whole at any moment.
#[derive(Debug)]
pub struct FrameList {
    pub format: Format,
    /// `points`, `domains`, `grid` or `rigid`.
    name: &'static str,
    /// Beginning of the names of the HDF5 files that hold the data.
    data: &'static str,
    file: GrowingFile,
    /// Step and text of each frame; on rank 0 only.
    entries: Vec<(usize, String)>,
    /// The file holds later ones.
    longer: bool,
}

impl FrameList {
    pub fn new(
        directory: &ResultsDirectory,
        (name, data): (&'static str, &'static str),
        format: Format,
    ) -> Self {
        let ending = match format {
            Format::Xdmf => "xdmf",
            Format::Vtu => "pvd",
            Format::VtkHdf => "vtkhdf.series",
        };
        let (head, tail) = ends(format);
        let file = GrowingFile::new(&directory.file(&format!("{name}.{ending}")), head, tail);
        FrameList { format, name, data, file, entries: Vec::new(), longer: false }
    }

    /// Continues the list of an earlier run, up to and including `last_step`; one that is not there begins
    /// anew, which is said where frames were written before. Nothing is written before [`Self::cut`].
    pub fn resume(
        &mut self,
        last_step: usize,
        log: &mut Log,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        on_root(comm, || {
            let path = self.file.path();
            if path.exists() {
                let entries = self.found()?.ok_or_else(|| not_ours(path))?;
                self.keep(entries, last_step);
            } else if has_frames(path, self.data, last_step)? {
                log.say(&format!(
                    "warning: {} is not there: the series begins anew after step {last_step}, and \
                     does not show the earlier frames",
                    path.display()
                ));
            }
            Ok(())
        })
    }

    /// Looks for the list of an earlier run in a format that the deck no longer asks for: frames after `last_step`
    /// go, and a list must not name them. What is no list of ours stays as it is.
    pub fn end(&mut self, last_step: usize, comm: &SimpleCommunicator) -> Result<()> {
        on_root(comm, || {
            if self.file.path().exists()
                && let Some(entries) = self.found()?
            {
                self.keep(entries, last_step);
            }
            Ok(())
        })
    }

    /// Step and text of each frame in the file; `None` if the file is no whole list of this kind.
    fn found(&self) -> Result<Option<Vec<(usize, String)>>> {
        let path = self.file.path();
        let bytes = fs::read(path).map_err(|reason| cannot_read(path, &reason))?;
        let text = std::str::from_utf8(&bytes).ok();
        Ok(text.and_then(|text| entries_of(self.format, self.name, text)))
    }

    fn keep(&mut self, mut entries: Vec<(usize, String)>, last_step: usize) {
        let before = entries.len();
        entries.retain(|(step, _)| *step <= last_step);
        self.longer = entries.len() < before;
        self.entries = entries;
        self.file.assume(texts(&self.entries));
    }

    /// Takes what comes later out of the file.
    pub fn cut(&mut self, comm: &SimpleCommunicator) -> Result<()> {
        on_root(comm, || {
            if std::mem::take(&mut self.longer) {
                self.file.replace(texts(&self.entries))?;
            }
            Ok(())
        })
    }

    /// Adds a frame.
    pub fn push(
        &mut self,
        (step, time): StepTime,
        frame: &Frame<'_>,
        totals: Totals,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        on_root(comm, || {
            let entry = match self.format {
                Format::Xdmf => {
                    let data = format!("{}-{step:06}.h5", self.data);
                    xdmf::entry((step, time), frame, totals, &data)
                }
                format => line(format, self.name, (step, time), self.entries.is_empty()),
            };
            self.entries.push((step, entry));
            self.file.push(texts(&self.entries))
        })
    }
}

/// What stands before and behind the frames.
fn ends(format: Format) -> (&'static str, &'static str) {
    match format {
        Format::Xdmf => (SERIES_HEAD, xdmf::TAIL),
        Format::Vtu => (PVD_HEAD, "</Collection>\n</VTKFile>\n"),
        Format::VtkHdf => (SERIES_LIST_HEAD, "]}\n"),
    }
}

/// The line of a frame in the lists that have one for each.
fn line(format: Format, name: &str, (step, time): StepTime, first: bool) -> String {
    match format {
        Format::Vtu => {
            format!("<DataSet timestep=\"{time:e}\" part=\"0\" file=\"{name}-{step:06}.vtu\"/>\n")
        }
        _ => {
            let comma = if first { "" } else { "," };
            format!("{comma}{{\"name\":\"{name}-{step:06}.h5\",\"time\":{time:e}}}\n")
        }
    }
}

fn texts(entries: &[(usize, String)]) -> impl Iterator<Item = &str> + Clone {
    entries.iter().map(|(_, text)| text.as_str())
}

/// Step and text of each frame that the text of a list names; `None` if it is no whole list.
fn entries_of(format: Format, name: &str, text: &str) -> Option<Vec<(usize, String)>> {
    if format == Format::Xdmf {
        return xdmf::split(text);
    }
    let (head, tail) = ends(format);
    let lines = text.strip_prefix(head)?.strip_suffix(tail)?;
    lines.lines().map(|line| numbered(name, line)).collect()
}

/// The step that a line names, and the line.
fn numbered(name: &str, line: &str) -> Option<(usize, String)> {
    let rest = line.split(&format!("\"{name}-")).nth(1)?;
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    Some((digits.parse().ok()?, format!("{line}\n")))
}

/// The folder of a list holds frames up to `last_step`.
fn has_frames(path: &Path, data: &str, last_step: usize) -> Result<bool> {
    let names = names_in(path.parent().unwrap_or(Path::new(".")))?;
    let number = |name: &String| number_of(name, &format!("{data}-"));
    Ok(names.iter().filter_map(number).any(|step| step <= last_step))
}

fn not_ours(path: &Path) -> Error {
    Error::File(format!(
        "{} is not a time series that this program wrote: restore it, or move it away and the \
         series starts anew",
        path.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_found_again() {
        for format in [Format::Vtu, Format::VtkHdf] {
            let (head, tail) = ends(format);
            let steps = [0, 5, 1_000_000];
            let entries: Vec<String> =
                steps.map(|s| line(format, "points", (s, 0.1 * s as f64), s == 0)).to_vec();
            let text = format!("{head}{}{tail}", entries.concat());
            let wanted = steps.into_iter().zip(entries).collect::<Vec<_>>();
            assert_eq!(entries_of(format, "points", &text), Some(wanted));
            // Cut short, within a line, too.
            for length in 0..text.len() {
                assert_eq!(entries_of(format, "points", &text[..length]), None, "{length}");
            }
            if format == Format::VtkHdf {
                let list: serde_json::Value = serde_json::from_str(&text).unwrap();
                assert_eq!(list["files"][1]["name"], "points-000005.h5");
                assert_eq!(list["files"][1]["time"], 0.5);
            }
        }
    }
}
