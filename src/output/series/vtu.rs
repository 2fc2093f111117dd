//! `points-000005.vtu`: the points of a frame as a VTK file, XML with raw data behind it, that VTK's own
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
use super::point_field::{PointField, Quantity, append_vector};
use crate::error::Result;
use crate::output::agreement::{all_agree, on_root};
use crate::output::whole_file::{Partial, cannot_write};
use crate::points::Points;

/// An array of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Array {
    Field(PointField),
    Position,
    /// Each point is a cell of its own: its number, the end of its cell's numbers, its kind.
    Connectivity,
    Offsets,
    Types,
}

/// VTK's number of a cell that is a point.
pub const VERTEX: u8 = 1;

impl Array {
    /// VTK's type, name, columns, bytes of a number.
    fn shape(self) -> (&'static str, &'static str, usize, usize) {
        match self {
            Array::Field(field) => {
                let kind = if field.quantity() == Quantity::Integer { "Int64" } else { "Float64" };
                (kind, field.name(), field.quantity().columns(), 8)
            }
            Array::Position => ("Float64", "Points", 3, 8),
            Array::Connectivity => ("Int64", "connectivity", 1, 8),
            Array::Offsets => ("Int64", "offsets", 1, 8),
            Array::Types => ("UInt8", "types", 1, 1),
        }
    }

    /// This rank's rows; `first`: number of its first point.
    fn rows<const D: usize>(self, points: &Points<D>, first: usize, rank: i32) -> Vec<u8> {
        let count = points.len();
        match self {
            Array::Field(field) if field.quantity() == Quantity::Integer => {
                let values = (0..count).filter_map(|p| field.integer(points, p, rank));
                bytes_of(&values.collect::<Vec<i64>>())
            }
            Array::Field(field) => {
                let mut values = Vec::with_capacity(count * field.quantity().columns());
                (0..count).for_each(|p| field.append(points, p, &mut values));
                bytes_of(&values)
            }
            Array::Position => {
                let mut values = Vec::with_capacity(3 * count);
                points.position.iter().for_each(|x| append_vector(x, &mut values));
                bytes_of(&values)
            }
            Array::Connectivity => {
                bytes_of(&(first..first + count).map(|p| p as i64).collect::<Vec<_>>())
            }
            Array::Offsets => {
                bytes_of(&(first + 1..first + count + 1).map(|p| p as i64).collect::<Vec<_>>())
            }
            Array::Types => vec![VERTEX; count],
        }
    }

    fn xml(self, offset: u64) -> String {
        let (kind, name, columns, _) = self.shape();
        let mut names = String::new();
        if let Array::Field(field) = self {
            for (k, word) in field.quantity().component_names().iter().enumerate() {
                names.push_str(&format!(" ComponentName{k}=\"{word}\""));
            }
        }
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{columns}\"{names} \
             format=\"appended\" offset=\"{offset}\"/>\n"
        )
    }
}

fn bytes_of<T: Plain>(values: &[T]) -> Vec<u8> {
    T::bytes(values).to_vec()
}

/// Writes a frame. `time` is in s, or the load factor. Collective.
pub fn write<const D: usize>(
    path: &Path,
    time: f64,
    fields: &[PointField],
    points: &Points<D>,
    comm: &SimpleCommunicator,
) -> Result<()> {
    let (first, total) = place(points.len(), comm);
    let mut arrays: Vec<Array> = fields.iter().copied().map(Array::Field).collect();
    arrays.retain(|array| *array != Array::Field(PointField::Position));
    arrays.extend([Array::Position, Array::Connectivity, Array::Offsets, Array::Types]);
    let mut starts = Vec::new();
    let mut end = 0;
    for array in &arrays {
        let (_, _, columns, size) = array.shape();
        starts.push(end);
        end += 8 + (total * columns * size) as u64;
    }
    let head = head(time, total, &arrays, &starts);
    let partial = Partial::of(path, comm);
    let failed = |reason: &std::io::Error| cannot_write(path, reason);
    on_root(comm, || {
        let file = File::create(partial.path()).map_err(|reason| failed(&reason))?;
        file.write_all_at(head.as_bytes(), 0).map_err(|reason| failed(&reason))
    })?;
    let own = || -> std::io::Result<()> {
        let file = OpenOptions::new().write(true).open(partial.path())?;
        for (array, start) in arrays.iter().zip(&starts) {
            let (_, _, columns, size) = array.shape();
            let start = head.len() as u64 + start;
            if comm.rank() == 0 {
                let length = (total * columns * size) as u64;
                file.write_all_at(&length.to_ne_bytes(), start)?;
            }
            let rows = array.rows(points, first, comm.rank());
            file.write_all_at(&rows, start + 8 + (first * columns * size) as u64)?;
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

/// This rank's first point, and the number of all.
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
fn head(time: f64, total: usize, arrays: &[Array], starts: &[u64]) -> String {
    let order = if cfg!(target_endian = "little") { "LittleEndian" } else { "BigEndian" };
    let lines = |wanted: fn(&Array) -> bool| -> String {
        let all = arrays.iter().zip(starts).filter(|(array, _)| wanted(array));
        all.map(|(array, start)| array.xml(*start)).collect()
    };
    let is_field = |array: &Array| matches!(array, Array::Field(_));
    let is_place = |array: &Array| *array == Array::Position;
    let is_cell = |array: &Array| !matches!(array, Array::Field(_) | Array::Position);
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
         byte_order=\"{order}\" header_type=\"UInt64\">\n<UnstructuredGrid>\n<FieldData>\n\
         <DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time:e}\
         </DataArray>\n</FieldData>\n<Piece NumberOfPoints=\"{total}\" NumberOfCells=\"{total}\">\n\
         <PointData>\n{}</PointData>\n<Points>\n{}</Points>\n<Cells>\n{}</Cells>\n</Piece>\n\
         </UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_",
        lines(is_field),
        lines(is_place),
        lines(is_cell),
    )
}
