//! XDMF time series: small XML files by which ParaView finds the data in the HDF5 files.
//!
//! Rules that readers crash on when broken: geometry has three columns always; point clouds
//! state `NodesPerElement`; steps sit in a temporal collection; HDF5 files are named without a
//! folder; every stated dimension is the stored one.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use mpi::topology::SimpleCommunicator;
use quick_xml::escape::escape;

use crate::error::{Error, Result};
use crate::output::agreement::on_root;
use crate::output::names::{SERIES_HEAD, names_in, number_of};
use crate::output::terminal::log::Log;
use crate::output::whole_file::cannot_read;

use super::growing_file::GrowingFile;

/// Number type of a dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// `f64`
    Float,
    /// `i64`
    Int,
}

/// A dataset in an HDF5 file: rows of `columns` numbers.
#[derive(Debug, Clone)]
pub struct DataItem {
    pub number: Number,
    pub rows: usize,
    pub columns: usize,
    /// `points-000005.h5`, without folder
    pub file: String,
    pub dataset: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topology {
    Polyvertex,
    Segment,
    Triangle,
    Quadrilateral,
    Tetrahedron,
    Hexahedron,
}

impl Topology {
    fn name(self) -> &'static str {
        match self {
            Topology::Polyvertex => "Polyvertex",
            Topology::Segment => "Polyline",
            Topology::Triangle => "Triangle",
            Topology::Quadrilateral => "Quadrilateral",
            Topology::Tetrahedron => "Tetrahedron",
            Topology::Hexahedron => "Hexahedron",
        }
    }

    pub fn nodes_per_element(self) -> usize {
        match self {
            Topology::Polyvertex => 1,
            Topology::Segment => 2,
            Topology::Triangle => 3,
            Topology::Quadrilateral | Topology::Tetrahedron => 4,
            Topology::Hexahedron => 8,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Center {
    Node,
    Cell,
}

/// A field over nodes or cells.
#[derive(Debug, Clone)]
pub struct Attribute {
    pub name: String,
    pub center: Center,
    pub data: DataItem,
}

/// Everything there is to see at one time.
#[derive(Debug, Clone)]
pub struct Snapshot {
    pub step: usize,
    /// s, or the load factor in quasi-static runs
    pub time: f64,
    pub topology: Topology,
    pub connectivity: DataItem,
    pub geometry: DataItem,
    pub attributes: Vec<Attribute>,
}

/// An XDMF file that grows by one snapshot at a time and is whole at any moment.
#[derive(Debug)]
pub struct XdmfSeries {
    file: GrowingFile,
    /// Step and XML of each snapshot; on rank 0 only.
    snapshots: Vec<(usize, String)>,
    /// The file holds later ones.
    longer: bool,
}

impl XdmfSeries {
    pub fn new(path: &Path) -> Self {
        Self {
            file: GrowingFile::new(path, SERIES_HEAD, TAIL),
            snapshots: Vec::new(),
            longer: false,
        }
    }

    /// Continues the series of an earlier run, up to and including `last_step`. A file that is gone
    /// is begun anew, which is said where frames (`frames` begins their names) were written before.
    /// Nothing is written before [`Self::cut`].
    pub fn resume(
        path: &Path,
        frames: &str,
        last_step: usize,
        log: &mut Log,
        comm: &SimpleCommunicator,
    ) -> Result<Self> {
        let mut series = Self::new(path);
        on_root(comm, || {
            if path.exists() {
                let text = fs::read_to_string(path).map_err(|reason| cannot_read(path, &reason))?;
                let all = split_snapshots(&text).ok_or_else(|| not_ours(path))?;
                let before = all.len();
                series.snapshots = all.into_iter().filter(|(step, _)| *step <= last_step).collect();
                series.longer = series.snapshots.len() < before;
                series.file.assume(texts(&series.snapshots));
            } else if has_frames(path, frames, last_step)? {
                log.say(&format!(
                    "warning: {} is not there: the series begins anew after step {last_step}, and \
                     does not show the earlier frames",
                    path.display()
                ));
            }
            Ok(())
        })?;
        Ok(series)
    }

    /// Takes what comes later out of the file.
    pub fn cut(&mut self, comm: &SimpleCommunicator) -> Result<()> {
        on_root(comm, || {
            if self.longer {
                self.file.replace(texts(&self.snapshots))?;
                self.longer = false;
            }
            Ok(())
        })
    }

    /// Adds a snapshot.
    pub fn push(&mut self, snapshot: &Snapshot, comm: &SimpleCommunicator) -> Result<()> {
        on_root(comm, || {
            self.snapshots.push((snapshot.step, snapshot_xml(snapshot)));
            self.file.push(texts(&self.snapshots))
        })
    }
}

/// True if a frame up to `last_step` lies beside the series.
fn has_frames(path: &Path, begin: &str, last_step: usize) -> Result<bool> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let names = names_in(folder)?;
    Ok(names.iter().any(|name| number_of(name, begin).is_some_and(|n| n <= last_step)))
}

fn texts(snapshots: &[(usize, String)]) -> impl Iterator<Item = &str> + Clone {
    snapshots.iter().map(|(_, text)| text.as_str())
}

const GRID_START: &str = "      <Grid Name=\"step ";
const GRID_END: &str = "      </Grid>\n";

/// How every series ends.
const TAIL: &str = "    </Grid>\n  </Domain>\n</Xdmf>\n";

fn snapshot_xml(snapshot: &Snapshot) -> String {
    let topology = snapshot.topology;
    let mut xml = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        xml,
        "{GRID_START}{}\" GridType=\"Uniform\">\n        <Time Value=\"{:e}\"/>\n        \
         <Topology TopologyType=\"{}\" NumberOfElements=\"{}\" NodesPerElement=\"{}\">\n{}        \
         </Topology>\n        <Geometry GeometryType=\"XYZ\">\n{}        </Geometry>\n",
        snapshot.step,
        snapshot.time,
        topology.name(),
        snapshot.connectivity.rows,
        topology.nodes_per_element(),
        data_xml(&snapshot.connectivity),
        data_xml(&snapshot.geometry),
    );
    for attribute in &snapshot.attributes {
        let kind = match attribute.data.columns {
            1 => "Scalar",
            3 => "Vector",
            6 => "Tensor6",
            9 => "Tensor",
            _ => "Matrix",
        };
        let center = match attribute.center {
            Center::Node => "Node",
            Center::Cell => "Cell",
        };
        let _ = write!(
            xml,
            "        <Attribute Name=\"{}\" AttributeType=\"{kind}\" Center=\"{center}\">\n{}        \
             </Attribute>\n",
            escape(&attribute.name),
            data_xml(&attribute.data),
        );
    }
    xml.push_str(GRID_END);
    xml
}

fn data_xml(data: &DataItem) -> String {
    let number = match data.number {
        Number::Float => "Float",
        Number::Int => "Int",
    };
    let dimensions = match data.columns {
        1 => data.rows.to_string(),
        columns => format!("{} {columns}", data.rows),
    };
    format!(
        "          <DataItem Dimensions=\"{dimensions}\" NumberType=\"{number}\" Precision=\"8\" \
         Format=\"HDF\">{}:/{}</DataItem>\n",
        escape(&data.file),
        escape(&data.dataset),
    )
}

/// Step and XML of every snapshot of a file that [`XdmfSeries`] wrote.
fn split_snapshots(text: &str) -> Option<Vec<(usize, String)>> {
    let mut snapshots = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find(GRID_START) {
        let end = start + rest[start..].find(GRID_END)? + GRID_END.len();
        let step = rest[start + GRID_START.len()..].split('"').next()?.parse().ok()?;
        snapshots.push((step, rest[start..end].to_owned()));
        rest = &rest[end..];
    }
    text.contains("CollectionType=\"Temporal\"").then_some(snapshots)
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

    fn snapshot(step: usize) -> Snapshot {
        let item = |number, columns, dataset: &str| DataItem {
            number,
            rows: 7,
            columns,
            file: format!("points-{step:06}.h5"),
            dataset: dataset.into(),
        };
        Snapshot {
            step,
            time: 0.1 * step as f64,
            topology: Topology::Polyvertex,
            connectivity: item(Number::Int, 1, "vertices"),
            geometry: item(Number::Float, 3, "position"),
            attributes: vec![Attribute {
                name: "a<b".into(),
                center: Center::Node,
                data: item(Number::Float, 6, "stress"),
            }],
        }
    }

    #[test]
    fn a_series_is_split_into_the_snapshots_it_was_made_of() {
        let parts: Vec<_> = [0, 5, 10].map(|s| (s, snapshot_xml(&snapshot(s)))).to_vec();
        let series_xml = |parts: &[(usize, String)]| {
            format!("{SERIES_HEAD}{}{TAIL}", texts(parts).collect::<String>())
        };
        assert_eq!(split_snapshots(&series_xml(&parts)), Some(parts));
        assert_eq!(split_snapshots("<Xdmf/>"), None);
        assert_eq!(split_snapshots(&series_xml(&[])), Some(vec![]));
    }

    #[test]
    fn the_text_follows_the_rules() {
        let xml = snapshot_xml(&snapshot(5));
        for part in [
            "<Topology TopologyType=\"Polyvertex\" NumberOfElements=\"7\" NodesPerElement=\"1\">",
            "<Attribute Name=\"a&lt;b\" AttributeType=\"Tensor6\" Center=\"Node\">",
            "Dimensions=\"7 6\" NumberType=\"Float\" Precision=\"8\" Format=\"HDF\">\
             points-000005.h5:/stress</DataItem>",
            "<Time Value=\"5e-1\"/>",
        ] {
            assert!(xml.contains(part), "{part} is missing from\n{xml}");
        }
    }
}
