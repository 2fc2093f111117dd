//! `grid-000005.h5` per output step and `grid.xdmf`: the active part of the background grid.

use mpi::topology::{Communicator, SimpleCommunicator};

use super::frame_list::{FrameList, Kind};
use super::hdf5_writer::FileWriter;
use super::vtkhdf::{self, Group, Nodes, Source};
use super::vtu::{self, Array, Frame};
use super::xdmf::{Attribute, Center, DataItem, Number, Snapshot, Topology, XdmfSeries};
use crate::deck::model::{Element, Format};
use crate::error::Result;
use crate::output::directory::ResultsDirectory;
use crate::output::terminal::log::Log;

/// One rank's share of the active grid. Active nodes are numbered over all ranks, contiguous by
/// rank: the nodes given here are the next ones after those of the lower ranks.
#[derive(Debug, Clone, Copy)]
pub struct GridFrame<'a, const D: usize> {
    pub element: Element,
    /// Owned active nodes, m.
    pub coordinates: &'a [[f64; D]],
    /// Owned active cells: the element's node numbers per cell, row by row.
    pub connectivity: &'a [usize],
    /// Displacement over the last step, m, per owned node.
    pub displacement_increment: &'a [[f64; D]],
    /// Force held by the constraints, N, per owned node; zero where the node is free.
    pub reaction: &'a [[f64; D]],
    /// More numbers per owned node: name and values.
    pub node_fields: &'a [(&'a str, &'a [f64])],
    /// Per owned cell: has a face that carries Ghost stabilisation.
    pub ghost_boundary: &'a [bool],
    /// More numbers per owned cell: name and values.
    pub cell_fields: &'a [(&'a str, &'a [f64])],
}

fn topology_of(element: Element) -> Topology {
    match element {
        Element::Tri3 => Topology::Triangle,
        Element::Quad4 => Topology::Quadrilateral,
        Element::Tet4 => Topology::Tetrahedron,
        Element::Hex8 => Topology::Hexahedron,
    }
}

/// The grid's time series.
pub struct GridSeries {
    directory: ResultsDirectory,
    series: XdmfSeries,
    formats: Vec<Format>,
    lists: Vec<FrameList>,
}

impl GridSeries {
    pub fn create(directory: &ResultsDirectory, formats: &[Format]) -> Self {
        let series = XdmfSeries::new(&directory.file("grid.xdmf"));
        let lists = Kind::of(formats).map(|kind| FrameList::new(directory, "grid", kind)).collect();
        Self { directory: directory.clone(), series, formats: formats.to_vec(), lists }
    }

    /// Continues the series of a run that is restarted after `last_step`. Nothing is written before
    /// [`Self::cut`].
    pub fn resume(
        directory: &ResultsDirectory,
        formats: &[Format],
        last_step: usize,
        log: &mut Log,
        comm: &SimpleCommunicator,
    ) -> Result<Self> {
        let mut this = Self::create(directory, formats);
        let resumed = Kind::of(formats)
            .map(|kind| FrameList::resume(directory, "grid", kind, last_step, comm));
        this.lists = resumed.collect::<Result<_>>()?;
        if formats.contains(&Format::Xdmf) {
            let path = directory.file("grid.xdmf");
            this.series = XdmfSeries::resume(&path, "grid-", last_step, log, comm)?;
        }
        Ok(this)
    }

    /// [`XdmfSeries::cut`]
    pub fn cut(&mut self, comm: &SimpleCommunicator) -> Result<()> {
        for list in &mut self.lists {
            list.cut(comm)?;
        }
        self.series.cut(comm)
    }

    /// Writes the active grid of `step`. `time` is in s, or the load factor.
    pub fn write<const D: usize>(
        &mut self,
        step: usize,
        time: f64,
        frame: &GridFrame<'_, D>,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        let topology = topology_of(frame.element);
        let per_cell = topology.nodes_per_element();
        let nodes = frame.coordinates.len();
        let cells = frame.connectivity.len() / per_cell;
        assert_eq!(frame.displacement_increment.len(), nodes, "one increment per node");
        assert_eq!(frame.reaction.len(), nodes, "one reaction per node");
        assert_eq!(frame.ghost_boundary.len(), cells, "one flag per cell");

        let name = format!("grid-{step:06}.h5");
        let file = FileWriter::create(&self.directory.file(&name), comm)?;
        file.write_number("step", &(step as u64))?;
        file.write_number("time", &time)?;
        let item = |number, rows, columns, dataset: &str| DataItem {
            number,
            rows,
            columns,
            file: name.clone(),
            dataset: dataset.into(),
        };
        let connectivity: Vec<i64> = frame.connectivity.iter().map(|&node| node as i64).collect();
        let all_nodes = file.write_rows("coordinates", 3, &in_space(frame.coordinates))?;
        let all_cells = file.write_rows("connectivity", per_cell, &connectivity)?;

        let mut attributes = Vec::new();
        let mut attribute = |name: &str, center, number, columns| {
            let rows = if center == Center::Node { all_nodes } else { all_cells };
            let data = item(number, rows, columns, name);
            attributes.push(Attribute { name: name.into(), center, data });
        };
        for (name, vectors) in
            [("displacement_increment", frame.displacement_increment), ("reaction", frame.reaction)]
        {
            file.write_rows(name, 3, &in_space(vectors))?;
            attribute(name, Center::Node, Number::Float, 3);
        }
        for (name, values) in frame.node_fields {
            assert_eq!(values.len(), nodes, "{name}: one value per node");
            file.write_rows(name, 1, values)?;
            attribute(name, Center::Node, Number::Float, 1);
        }
        for (name, unit, meaning) in [
            ("coordinates", "m", "nodes, where the step was solved"),
            ("displacement_increment", "m", "over the step"),
            ("reaction", "N", "force held by the constraints"),
        ] {
            file.describe(name, unit, meaning)?;
        }
        let rank = i64::from(comm.rank());
        file.write_rows("node_rank", 1, &vec![rank; nodes])?;
        attribute("node_rank", Center::Node, Number::Int, 1);
        file.write_rows("cell_rank", 1, &vec![rank; cells])?;
        attribute("cell_rank", Center::Cell, Number::Int, 1);
        let flags: Vec<i64> = frame.ghost_boundary.iter().map(|&flag| i64::from(flag)).collect();
        file.write_rows("ghost_boundary", 1, &flags)?;
        attribute("ghost_boundary", Center::Cell, Number::Int, 1);
        for (name, values) in frame.cell_fields {
            assert_eq!(values.len(), cells, "{name}: one value per cell");
            file.write_rows(name, 1, values)?;
            attribute(name, Center::Cell, Number::Float, 1);
        }
        if self.formats.contains(&Format::VtkHdf) {
            let of = |center: Center| {
                let own = attributes.iter().filter(move |attribute| attribute.center == center);
                own.map(|attribute| attribute.name.as_str()).collect()
            };
            let group = Group {
                source: Source::Here,
                topology,
                points: nodes,
                cells,
                places: "coordinates",
                nodes: Nodes::Given(frame.connectivity),
                point_data: of(Center::Node),
                cell_data: of(Center::Cell),
            };
            vtkhdf::add(&file, &group, comm)?;
        }
        file.finish()?;
        if self.formats.contains(&Format::Vtu) {
            let path = self.directory.file(&format!("grid-{step:06}.vtu"));
            vtu::write(&path, time, as_vtu(frame, &flags, rank), comm)?;
        }
        for list in &mut self.lists {
            list.push(step, time, comm)?;
        }

        let snapshot = Snapshot {
            step,
            time,
            topology,
            connectivity: item(Number::Int, all_cells, per_cell, "connectivity"),
            geometry: item(Number::Float, all_nodes, 3, "coordinates"),
            attributes,
        };
        match self.formats.contains(&Format::Xdmf) {
            true => self.series.push(&snapshot, comm),
            false => Ok(()),
        }
    }
}

/// `flags`: `ghost_boundary` as numbers.
fn as_vtu<'a, const D: usize>(
    frame: &'a GridFrame<'_, D>,
    flags: &'a [i64],
    rank: i64,
) -> Frame<'a> {
    let (nodes, cells) = (frame.coordinates.len(), flags.len());
    let vectors = |name, values: &'a [[f64; D]]| {
        Array::floats(name, 3, move || in_space(values)).with_components(&["x", "y", "z"])
    };
    let numbers = |fields: &'a [(&str, &[f64])]| {
        fields.iter().map(|(name, values)| Array::floats(name, 1, || values.to_vec()))
    };
    let mut point_data = vec![
        vectors("displacement_increment", frame.displacement_increment),
        vectors("reaction", frame.reaction),
    ];
    point_data.extend(numbers(frame.node_fields));
    point_data.push(Array::integers("node_rank", move || vec![rank; nodes]));
    let mut cell_data = vec![
        Array::integers("cell_rank", move || vec![rank; cells]),
        Array::integers("ghost_boundary", || flags.to_vec()),
    ];
    cell_data.extend(numbers(frame.cell_fields));
    Frame {
        topology: topology_of(frame.element),
        points: nodes,
        cells,
        places: Box::new(|| in_space(frame.coordinates)),
        connectivity: Some(frame.connectivity),
        point_data,
        cell_data,
    }
}

fn in_space<const D: usize>(vectors: &[[f64; D]]) -> Vec<f64> {
    let mut rows = Vec::with_capacity(3 * vectors.len());
    for vector in vectors {
        crate::output::series::point_field::append_vector(vector, &mut rows);
    }
    rows
}
