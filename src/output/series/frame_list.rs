//! Small files that list the frames of a series and their times.
//!
//! | file | lists | for |
//! |---|---|---|
//! | `points.pvd` | `points-*.vtu` | ParaView, VisIt |
//! | `points.vtkhdf.series` | `points-*.h5`, which are VTKHDF files then | ParaView |
//!
//! and likewise for `domains` and `grid`.

use std::fs;

use mpi::topology::SimpleCommunicator;

use super::growing_file::GrowingFile;
use crate::deck::model::Format;
use crate::error::Result;
use crate::output::agreement::on_root;
use crate::output::directory::ResultsDirectory;
use crate::output::names::{PVD_HEAD, SERIES_LIST_HEAD};
use crate::output::whole_file::cannot_read;

/// Which list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Pvd,
    Series,
}

impl Kind {
    /// The lists that a deck's formats ask for.
    pub fn of(formats: &[Format]) -> impl Iterator<Item = Kind> + use<'_> {
        formats.iter().filter_map(|format| match format {
            Format::Xdmf => None,
            Format::VtkHdf => Some(Kind::Series),
            Format::Vtu => Some(Kind::Pvd),
        })
    }

    fn name(self, frames: &str) -> String {
        match self {
            Kind::Pvd => format!("{frames}.pvd"),
            Kind::Series => format!("{frames}.vtkhdf.series"),
        }
    }

    fn ends(self) -> (&'static str, &'static str) {
        match self {
            Kind::Pvd => (PVD_HEAD, "</Collection>\n</VTKFile>\n"),
            Kind::Series => (SERIES_LIST_HEAD, "]}\n"),
        }
    }

    /// A line of its own.
    fn piece(self, frames: &str, step: usize, time: f64, first: bool) -> String {
        match self {
            Kind::Pvd => format!(
                "<DataSet timestep=\"{time:e}\" part=\"0\" file=\"{frames}-{step:06}.vtu\"/>\n"
            ),
            Kind::Series => {
                let comma = if first { "" } else { "," };
                format!("{comma}{{\"name\":\"{frames}-{step:06}.h5\",\"time\":{time:e}}}\n")
            }
        }
    }
}

/// A list that grows by a frame at a time and is whole at any moment.
#[derive(Debug)]
pub struct FrameList {
    kind: Kind,
    /// `points`, `domains` or `grid`.
    frames: &'static str,
    file: GrowingFile,
    /// Step and line of each frame; on rank 0 only.
    pieces: Vec<(usize, String)>,
    /// The file holds later ones.
    longer: bool,
}

impl FrameList {
    pub fn new(directory: &ResultsDirectory, frames: &'static str, kind: Kind) -> Self {
        let (head, tail) = kind.ends();
        let file = GrowingFile::new(&directory.file(&kind.name(frames)), head, tail);
        FrameList { kind, frames, file, pieces: Vec::new(), longer: false }
    }

    /// Continues the list of an earlier run, up to and including `last_step`; one that is not there
    /// begins anew. Nothing is written before [`Self::cut`].
    pub fn resume(
        directory: &ResultsDirectory,
        frames: &'static str,
        kind: Kind,
        last_step: usize,
        comm: &SimpleCommunicator,
    ) -> Result<Self> {
        let mut list = Self::new(directory, frames, kind);
        on_root(comm, || {
            let path = list.file.path();
            if path.exists() {
                let text = fs::read_to_string(path).map_err(|reason| cannot_read(path, &reason))?;
                let all: Vec<(usize, String)> =
                    text.lines().filter_map(|line| numbered(frames, line)).collect();
                let before = all.len();
                list.pieces = all.into_iter().filter(|(step, _)| *step <= last_step).collect();
                list.longer = list.pieces.len() < before;
                list.file.assume(texts(&list.pieces));
            }
            Ok(())
        })?;
        Ok(list)
    }

    /// Takes what comes later out of the file.
    pub fn cut(&mut self, comm: &SimpleCommunicator) -> Result<()> {
        on_root(comm, || {
            if self.longer {
                self.file.replace(texts(&self.pieces))?;
                self.longer = false;
            }
            Ok(())
        })
    }

    /// Adds a frame.
    pub fn push(&mut self, step: usize, time: f64, comm: &SimpleCommunicator) -> Result<()> {
        on_root(comm, || {
            self.pieces
                .push((step, self.kind.piece(self.frames, step, time, self.pieces.is_empty())));
            self.file.push(texts(&self.pieces))
        })
    }
}

fn texts(pieces: &[(usize, String)]) -> impl Iterator<Item = &str> + Clone {
    pieces.iter().map(|(_, text)| text.as_str())
}

/// The step that a line names, and the line.
fn numbered(frames: &str, line: &str) -> Option<(usize, String)> {
    let rest = line.split(&format!("\"{frames}-")).nth(1)?;
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    Some((digits.parse().ok()?, format!("{line}\n")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_found_again() {
        for kind in [Kind::Pvd, Kind::Series] {
            let (head, tail) = kind.ends();
            let pieces: Vec<String> =
                [0, 5, 1_000_000].map(|s| kind.piece("points", s, 0.1 * s as f64, s == 0)).to_vec();
            let text = format!("{head}{}{tail}", pieces.concat());
            let found: Vec<_> = text.lines().filter_map(|line| numbered("points", line)).collect();
            let expected: Vec<_> = [0, 5, 1_000_000].into_iter().zip(pieces).collect();
            assert_eq!(found, expected);
            if kind == Kind::Series {
                let list: serde_json::Value = serde_json::from_str(&text).unwrap();
                assert_eq!(list["files"][1]["name"], "points-000005.h5");
                assert_eq!(list["files"][1]["time"], 0.5);
            }
        }
    }
}
