//! `points-000005.vtu` and its like: a frame as a VTK file, XML with raw data behind it, that VTK's own
//! readers, ParaView, VisIt, meshio and pyvista open.
//!
//! The sizes of all arrays are known before any is written, so that every rank puts its rows in their
//! place by an ordinary write, as in [`super::hdf5_writer`].

use std::fs::{File, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::Path;

use mpi::collective::{CommunicatorCollectives, SystemOperation};
use mpi::topology::{Communicator, SimpleCommunicator};

use super::hdf5_writer::Plain;
use super::xdmf::Topology;
use crate::error::Result;
use crate::output::agreement::{all_agree, on_root};
use crate::output::whole_file::{Partial, cannot_write};

/// VTK's number of a kind of cell.
pub fn cell_type(topology: Topology) -> u8 {
    match topology {
        Topology::Polyvertex => 1,
        Topology::Segment => 3,
        Topology::Triangle => 5,
        Topology::Quadrilateral => 9,
        Topology::Tetrahedron => 10,
        Topology::Hexahedron => 12,
    }
}

/// A table of numbers at points or cells; this rank's rows are made when they are written.
pub struct Array<'a> {
    name: &'a str,
    /// VTK's type, and bytes of a number.
    kind: (&'static str, usize),
    columns: usize,
    /// VTK takes a row as so many numbers in line, and not as one of several columns.
    in_line: bool,
    components: &'static [&'static str],
    rows: Box<dyn Fn() -> Vec<u8> + 'a>,
}

impl<'a> Array<'a> {
    pub fn floats(name: &'a str, columns: usize, rows: impl Fn() -> Vec<f64> + 'a) -> Self {
        let rows = Box::new(move || bytes_of(&rows()));
        Array { name, kind: ("Float64", 8), columns, in_line: false, components: &[], rows }
    }

    pub fn integers(name: &'a str, rows: impl Fn() -> Vec<i64> + 'a) -> Self {
        let rows = Box::new(move || bytes_of(&rows()));
        Array { name, kind: ("Int64", 8), columns: 1, in_line: false, components: &[], rows }
    }

    /// Names of the columns.
    pub fn with_components(self, components: &'static [&'static str]) -> Self {
        Array { components, ..self }
    }

    fn row_bytes(&self) -> usize {
        self.columns * self.kind.1
    }

    fn xml(&self, offset: u64) -> String {
        let words = self.components.iter().enumerate();
        let names: String =
            words.map(|(k, word)| format!(" ComponentName{k}=\"{word}\"")).collect();
        format!(
            "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\"{names} \
             format=\"appended\" offset=\"{offset}\"/>\n",
            self.kind.0,
            self.name,
            if self.in_line { 1 } else { self.columns }
        )
    }
}

/// This rank's share of a frame.
pub struct Frame<'a> {
    pub topology: Topology,
    pub points: usize,
    pub cells: usize,
    /// x, y, z of each point.
    pub places: Box<dyn Fn() -> Vec<f64> + 'a>,
    /// Points of each cell, numbered over all ranks; `None`: each cell has its own, in order.
    pub connectivity: Option<&'a [usize]>,
    pub point_data: Vec<Array<'a>>,
    pub cell_data: Vec<Array<'a>>,
}

/// A part of the file, whose rows belong to points or to cells.
struct Part<'a> {
    array: Array<'a>,
    first: usize,
    total: usize,
    start: u64,
}

/// Writes a frame. `time` is in s, or the load factor. Collective.
pub fn write(path: &Path, time: f64, frame: Frame<'_>, comm: &SimpleCommunicator) -> Result<()> {
    let Frame { topology, points, cells, places, connectivity, point_data, cell_data } = frame;
    let (of_points, of_cells) = (place(points, comm), place(cells, comm));
    let (first, per_cell) = (of_cells.0, topology.nodes_per_element());
    let numbers = Array::integers("connectivity", move || match connectivity {
        Some(given) => given.iter().map(|&node| node as i64).collect(),
        None => (first * per_cell..(first + cells) * per_cell).map(|node| node as i64).collect(),
    });
    // One row for each cell, as wide as the cell has points.
    let numbers = Array { columns: per_cell, in_line: true, ..numbers };
    let ends = Array::integers("offsets", move || {
        (first + 1..first + cells + 1).map(|cell| (cell * per_cell) as i64).collect()
    });
    let types = Array {
        kind: ("UInt8", 1),
        rows: Box::new(move || vec![cell_type(topology); cells]),
        ..Array::integers("types", Vec::new)
    };
    let places = Array::floats("Points", 3, places);

    let groups = [
        ("PointData", point_data, of_points),
        ("CellData", cell_data, of_cells),
        ("Points", vec![places], of_points),
        ("Cells", vec![numbers, ends, types], of_cells),
    ];
    let mut parts = Vec::new();
    let mut xml = String::new();
    let mut end = 0_u64;
    for (group, arrays, (first, total)) in groups {
        xml.push_str(&format!("<{group}>\n"));
        for array in arrays {
            xml.push_str(&array.xml(end));
            let length = (total * array.row_bytes()) as u64;
            parts.push(Part { array, first, total, start: end });
            end += 8 + length;
        }
        xml.push_str(&format!("</{group}>\n"));
    }
    let head = head(time, (of_points.1, of_cells.1), &xml);

    let partial = Partial::of(path, comm);
    let failed = |reason: &std::io::Error| cannot_write(path, reason);
    on_root(comm, || {
        let file = File::create(partial.path()).map_err(|reason| failed(&reason))?;
        file.write_all_at(head.as_bytes(), 0).map_err(|reason| failed(&reason))
    })?;
    let own = || -> std::io::Result<()> {
        let file = OpenOptions::new().write(true).open(partial.path())?;
        for Part { array, first, total, start } in &parts {
            let start = head.len() as u64 + start;
            if comm.rank() == 0 {
                let length = (total * array.row_bytes()) as u64;
                file.write_all_at(&length.to_ne_bytes(), start)?;
            }
            file.write_all_at(&(array.rows)(), start + 8 + (first * array.row_bytes()) as u64)?;
        }
        if comm.rank() == 0 {
            let tail = b"\n</AppendedData>\n</VTKFile>\n";
            file.write_all_at(tail, head.len() as u64 + end)?;
        }
        file.sync_all()
    };
    all_agree(comm, own().map_err(|reason| failed(&reason)))?;
    on_root(comm, || partial.give_name())
}

fn bytes_of<T: Plain>(values: &[T]) -> Vec<u8> {
    T::bytes(values).to_vec()
}

/// This rank's first row, and the number of all.
fn place(count: usize, comm: &SimpleCommunicator) -> (usize, usize) {
    let (mut before, mut total) = (0_u64, 0_u64);
    comm.exclusive_scan_into(&(count as u64), &mut before, SystemOperation::sum());
    // MPI leaves the result of rank 0 undefined.
    if comm.rank() == 0 {
        before = 0;
    }
    comm.all_reduce_into(&(count as u64), &mut total, SystemOperation::sum());
    (before as usize, total as usize)
}

/// Everything before the data.
fn head(time: f64, (points, cells): (usize, usize), arrays: &str) -> String {
    let order = if cfg!(target_endian = "little") { "LittleEndian" } else { "BigEndian" };
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
         byte_order=\"{order}\" header_type=\"UInt64\">\n<UnstructuredGrid>\n<FieldData>\n\
         <DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time:e}\
         </DataArray>\n</FieldData>\n<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n\
         {arrays}</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_"
    )
}
