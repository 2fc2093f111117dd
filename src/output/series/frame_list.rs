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
                let text = fs::read_to_string(path).map_err(|reason| cannot_read(path, &reason))?;
                let all = match self.format {
                    Format::Xdmf => xdmf::split(&text).ok_or_else(|| not_ours(path))?,
                    _ => text.lines().filter_map(|line| numbered(self.name, line)).collect(),
                };
                let before = all.len();
                self.entries = all.into_iter().filter(|(step, _)| *step <= last_step).collect();
                self.longer = self.entries.len() < before;
                self.file.assume(texts(&self.entries));
            } else if self.format == Format::Xdmf && has_frames(path, self.data, last_step)? {
                log.say(&format!(
                    "warning: {} is not there: the series begins anew after step {last_step}, and \
                     does not show the earlier frames",
                    path.display()
                ));
            }
            Ok(())
        })
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
            let found: Vec<_> = text.lines().filter_map(|line| numbered("points", line)).collect();
            assert_eq!(found, steps.into_iter().zip(entries).collect::<Vec<_>>());
            if format == Format::VtkHdf {
                let list: serde_json::Value = serde_json::from_str(&text).unwrap();
                assert_eq!(list["files"][1]["name"], "points-000005.h5");
                assert_eq!(list["files"][1]["time"], 0.5);
            }
        }
    }
}
