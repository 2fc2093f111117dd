//! `points-000005.vtu` and its like: a frame as a VTK file, XML with raw data behind it, that VTK's own
//! readers, ParaView, VisIt, meshio and pyvista open.
//!
//! The sizes of all arrays are known before any is written, so that every rank puts its rows in their
//! place by an ordinary write, as in [`super::hdf5_writer`].

use std::fs::{File, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::Path;

use mpi::topology::{Communicator, SimpleCommunicator};

use super::frame::{Array, Frame, Number, Values};
use crate::error::Result;
use crate::output::agreement::{all_agree, on_root, place};
use crate::output::whole_file::{Partial, cannot_write};

/// An array in the file, which begins `start` bytes behind the first one.
struct Part<'a> {
    array: &'a Array<'a>,
    /// This rank's first row, and the number of all.
    rows: (usize, usize),
    start: u64,
}

impl Part<'_> {
    /// VTK's type, and the bytes of a row.
    fn kind(&self) -> (&'static str, usize) {
        match self.array.number {
            Number::Float => ("Float64", 8 * self.array.columns),
            Number::Integer => ("Int64", 8 * self.array.columns),
            Number::Byte => ("UInt8", self.array.columns),
        }
    }

    fn bytes(&self) -> u64 {
        (self.rows.1 * self.kind().1) as u64
    }

    fn xml(&self) -> String {
        let Array { name, columns, components, .. } = self.array;
        let words = components.iter().enumerate();
        let words: String =
            words.map(|(k, word)| format!(" ComponentName{k}=\"{word}\"")).collect();
        format!(
            "<DataArray type=\"{}\" Name=\"{name}\" NumberOfComponents=\"{columns}\"{words} \
             format=\"appended\" offset=\"{}\"/>\n",
            self.kind().0,
            self.start
        )
    }
}

/// Writes a frame. `time` is in s, or the load factor. Collective.
pub fn write(path: &Path, time: f64, frame: &Frame<'_>, comm: &SimpleCommunicator) -> Result<()> {
    let (of_points, of_cells) = (place(comm, frame.points), place(comm, frame.cells));
    let (first, cells, per_cell) = (of_cells.0, frame.cells, frame.topology.points_per_cell());
    let of_nodes = (first * per_cell, of_cells.1 * per_cell);
    let places = Array::new("Points", Number::Float, || (frame.places.values)());
    let places = Array { columns: 3, ..places };
    let numbers = Array::integers("connectivity", || frame.numbers(first));
    let end_of = |cell| (cell * per_cell) as i64;
    let ends = Array::integers("offsets", || (first + 1..=first + cells).map(end_of).collect());
    let types = || Values::Bytes(vec![frame.topology.vtk_number(); cells]);
    let types = Array::new("types", Number::Byte, types);
    let groups: [(&str, Vec<(&Array<'_>, _)>); 4] = [
        ("PointData", frame.own_point_data().map(|array| (array, of_points)).collect()),
        ("CellData", frame.cell_data.iter().map(|array| (array, of_cells)).collect()),
        ("Points", vec![(&places, of_points)]),
        ("Cells", vec![(&numbers, of_nodes), (&ends, of_cells), (&types, of_cells)]),
    ];
    let mut parts = Vec::new();
    let mut xml = String::new();
    let mut end = 0_u64;
    for (group, arrays) in groups {
        xml.push_str(&format!("<{group}>\n"));
        for (array, rows) in arrays {
            let part = Part { array, rows, start: end };
            xml.push_str(&part.xml());
            end += 8 + part.bytes();
            parts.push(part);
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
        for part in &parts {
            let start = head.len() as u64 + part.start;
            if comm.rank() == 0 {
                file.write_all_at(&part.bytes().to_ne_bytes(), start)?;
            }
            let before = (part.rows.0 * part.kind().1) as u64;
            file.write_all_at((part.array.values)().bytes(), start + 8 + before)?;
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
