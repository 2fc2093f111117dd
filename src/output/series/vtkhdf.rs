//! VTKHDF files (version 1.0, unstructured grid): a group of an HDF5 file whose members are links to the
//! datasets that are there, and what VTK wants beside them. Collective.

use hdf5::types::FixedAscii;
use mpi::topology::{Communicator, SimpleCommunicator};

use super::hdf5_writer::FileWriter;
use super::vtu::cell_type;
use super::xdmf::Topology;
use crate::error::Result;

/// Where the datasets lie: in the file itself, or in another one of the folder.
#[derive(Debug, Clone, Copy)]
pub enum Source<'a> {
    Here,
    File(&'a str),
}

/// The points of each cell.
#[derive(Debug, Clone, Copy)]
pub enum Nodes<'a> {
    /// A dataset of the file has them in line.
    Dataset(&'a str),
    /// Each cell has its own, in order.
    InOrder,
    /// Of this rank's cells, numbered over all ranks.
    Given(&'a [usize]),
}

/// What is linked, and this rank's share of it.
pub struct Group<'a> {
    pub source: Source<'a>,
    pub topology: Topology,
    pub points: usize,
    pub cells: usize,
    /// Dataset of x, y, z of each point.
    pub places: &'a str,
    pub nodes: Nodes<'a>,
    /// Datasets with a row for each point, and for each cell.
    pub point_data: Vec<&'a str>,
    pub cell_data: Vec<&'a str>,
}

/// Adds the group to a file.
pub fn add(file: &FileWriter, group: &Group<'_>, comm: &SimpleCommunicator) -> Result<()> {
    file.arrange(|file| {
        let root = file.create_group("VTKHDF")?;
        root.new_attr::<i64>().shape(2).create("Version")?.as_writer().write_raw(&[1_i64, 0])?;
        let kind = FixedAscii::<16>::from_ascii(b"UnstructuredGrid");
        let kind = kind.map_err(|reason| hdf5::Error::from(reason.to_string()))?;
        root.new_attr::<FixedAscii<16>>().create("Type")?.as_writer().write_scalar(&kind)?;
        root.create_group("PointData")?;
        root.create_group("CellData")?;
        Ok(())
    })?;
    let per_cell = group.topology.nodes_per_element();
    let (first, cells) = (file.first_row(group.cells), group.cells);
    let in_order = (first * per_cell..(first + cells) * per_cell).map(|node| node as i64);
    let numbers: Vec<i64> = match group.nodes {
        Nodes::Dataset(_) => Vec::new(),
        Nodes::InOrder => in_order.collect(),
        Nodes::Given(given) => given.iter().map(|&node| node as i64).collect(),
    };
    if !matches!(group.nodes, Nodes::Dataset(_)) {
        file.write_rows("VTKHDF/Connectivity", 1, &numbers)?;
    }
    let ends: Vec<i64> = (0..usize::from(comm.rank() == 0))
        .chain(first + 1..first + cells + 1)
        .map(|cell| (cell * per_cell) as i64)
        .collect();
    file.write_rows("VTKHDF/Offsets", 1, &ends)?;
    let types = vec![cell_type(group.topology); cells];
    let all_cells = file.write_rows("VTKHDF/Types", 1, &types)?;
    let all_points = total(group.points, comm);
    for (name, count) in [
        ("NumberOfPoints", all_points),
        ("NumberOfCells", all_cells),
        ("NumberOfConnectivityIds", all_cells * per_cell),
    ] {
        let one = [count as i64];
        let rows = if comm.rank() == 0 { &one[..] } else { &[] };
        file.write_rows(&format!("VTKHDF/{name}"), 1, rows)?;
    }
    file.arrange(|file| {
        let link = |dataset: &str, name: &str| match group.source {
            Source::Here => file.link_hard(&format!("/{dataset}"), name),
            Source::File(other) => file.link_external(other, &format!("/{dataset}"), name),
        };
        link(group.places, "/VTKHDF/Points")?;
        if let Nodes::Dataset(name) = group.nodes {
            link(name, "/VTKHDF/Connectivity")?;
        }
        for name in &group.point_data {
            link(name, &format!("/VTKHDF/PointData/{name}"))?;
        }
        for name in &group.cell_data {
            link(name, &format!("/VTKHDF/CellData/{name}"))?;
        }
        Ok(())
    })
}

fn total(count: usize, comm: &SimpleCommunicator) -> usize {
    use mpi::collective::{CommunicatorCollectives, SystemOperation};
    let mut total = 0_u64;
    comm.all_reduce_into(&(count as u64), &mut total, SystemOperation::sum());
    total as usize
}
