//! VTKHDF files (version 1.0, unstructured grid): a group of an HDF5 file whose members are links to the
//! datasets that are there, and what VTK wants beside them.

use hdf5::types::FixedAscii;
use mpi::topology::{Communicator, SimpleCommunicator};

use super::frame::Frame;
use super::hdf5_writer::FileWriter;
use crate::error::Result;
use crate::output::agreement::place;

/// Adds the group to a file; `data` names the file with the frame's datasets if it is another one.
/// Collective.
pub fn add(
    file: &FileWriter,
    frame: &Frame<'_>,
    data: Option<&str>,
    comm: &SimpleCommunicator,
) -> Result<()> {
    file.lay_out(|file| {
        let root = file.create_group("VTKHDF")?;
        root.new_attr::<i64>().shape(2).create("Version")?.as_writer().write_raw(&[1_i64, 0])?;
        let kind = FixedAscii::<16>::from_ascii(b"UnstructuredGrid");
        let kind = kind.map_err(|reason| hdf5::Error::from(reason.to_string()))?;
        root.new_attr::<FixedAscii<16>>().create("Type")?.as_writer().write_scalar(&kind)?;
        root.create_group("PointData")?;
        root.create_group("CellData")?;
        Ok(())
    })?;
    let per_cell = frame.topology.points_per_cell();
    let (first, cells) = (file.first_row(frame.cells), frame.cells);
    // VTK takes the points of all cells in one line, as a dataset of one column has them.
    let linked = per_cell == 1;
    if !linked {
        file.write_rows("VTKHDF/Connectivity", 1, &frame.numbers(first))?;
    }
    let ends: Vec<i64> = (0..usize::from(comm.rank() == 0))
        .chain(first + 1..first + cells + 1)
        .map(|cell| (cell * per_cell) as i64)
        .collect();
    file.write_rows("VTKHDF/Offsets", 1, &ends)?;
    let types = vec![frame.topology.vtk_number(); cells];
    let all_cells = file.write_rows("VTKHDF/Types", 1, &types)?;
    for (name, count) in [
        ("NumberOfPoints", place(comm, frame.points).1),
        ("NumberOfCells", all_cells),
        ("NumberOfConnectivityIds", all_cells * per_cell),
    ] {
        let one = [count as i64];
        let rows = if comm.rank() == 0 { &one[..] } else { &[] };
        file.write_rows(&format!("VTKHDF/{name}"), 1, rows)?;
    }
    file.lay_out(|file| {
        let link = |dataset: &str, name: &str| match data {
            None => file.link_hard(&format!("/{dataset}"), name),
            Some(other) => file.link_external(other, &format!("/{dataset}"), name),
        };
        link(frame.places.name, "/VTKHDF/Points")?;
        if linked {
            link(frame.nodes, "/VTKHDF/Connectivity")?;
        }
        for (group, arrays) in [("PointData", &frame.point_data), ("CellData", &frame.cell_data)] {
            for array in arrays {
                link(array.name, &format!("/VTKHDF/{group}/{}", array.name))?;
            }
        }
        Ok(())
    })
}
