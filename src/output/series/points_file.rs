//! `points-000005.h5` per output step, `points.xdmf` over all of them, and `domains.xdmf`, which
//! shows the same data on the points' sub-domains.

use mpi::topology::{Communicator, SimpleCommunicator};

use super::domains;
use super::frame_list::{FrameList, Kind};
use super::hdf5_writer::FileWriter;
use super::point_field::{PointField, Quantity, append_vector};
use super::vtkhdf::{self, Group, Nodes, Source};
use super::vtu::{self, Array, Frame};
use super::xdmf::{Attribute, Center, DataItem, Number, Snapshot, Topology, XdmfSeries};
use crate::deck::model::{Basis, Format};
use crate::error::Result;
use crate::output::directory::ResultsDirectory;
use crate::output::terminal::log::Log;
use crate::points::Points;

/// Beginning of the frames' names.
const FRAMES: &str = "points-";

/// Fields that every file holds, asked for or not.
const ALWAYS: [PointField; 3] = [PointField::Id, PointField::Body, PointField::Rank];

/// The points' time series.
pub struct PointsSeries {
    directory: ResultsDirectory,
    fields: Vec<PointField>,
    basis: Basis,
    formats: Vec<Format>,
    lists: Vec<FrameList>,
    /// Of the domains.
    domain_lists: Vec<FrameList>,
    points: XdmfSeries,
    domains: Option<XdmfSeries>,
    /// Number of the present stage, from one; `None` in a deck without stages.
    pub stage: Option<u64>,
}

impl PointsSeries {
    /// A new series; `fields` are the deck's `output.fields`, `formats` its `output.format`.
    pub fn create(
        directory: &ResultsDirectory,
        fields: &[PointField],
        formats: &[Format],
        basis: Basis,
        dimension: usize,
    ) -> Self {
        let has_domains = domains::topology(basis, dimension).is_some();
        Self {
            directory: directory.clone(),
            fields: with_always(fields),
            basis,
            formats: formats.to_vec(),
            lists: Kind::of(formats)
                .map(|kind| FrameList::new(directory, "points", kind))
                .collect(),
            domain_lists: Kind::of(formats)
                .filter(|_| has_domains)
                .map(|kind| FrameList::new(directory, "domains", kind))
                .collect(),
            points: XdmfSeries::new(&directory.file("points.xdmf")),
            domains: has_domains.then(|| XdmfSeries::new(&directory.file("domains.xdmf"))),
            stage: None,
        }
    }

    /// Continues the series of a run that is restarted after `last_step`. Nothing is written before
    /// [`Self::cut`].
    pub fn resume(
        directory: &ResultsDirectory,
        fields: &[PointField],
        formats: &[Format],
        (basis, dimension): (Basis, usize),
        last_step: usize,
        log: &mut Log,
        comm: &SimpleCommunicator,
    ) -> Result<Self> {
        let mut this = Self::create(directory, fields, formats, basis, dimension);
        let resumed = |frames| {
            Kind::of(formats)
                .map(move |kind| FrameList::resume(directory, frames, kind, last_step, comm))
        };
        this.lists = resumed("points").collect::<Result<_>>()?;
        if this.domains.is_some() {
            this.domain_lists = resumed("domains").collect::<Result<_>>()?;
        }
        if !formats.contains(&Format::Xdmf) {
            return Ok(this);
        }
        this.points =
            XdmfSeries::resume(&directory.file("points.xdmf"), FRAMES, last_step, log, comm)?;
        if let Some(series) = &mut this.domains {
            *series =
                XdmfSeries::resume(&directory.file("domains.xdmf"), FRAMES, last_step, log, comm)?;
        }
        Ok(this)
    }

    /// [`XdmfSeries::cut`]
    pub fn cut(&mut self, comm: &SimpleCommunicator) -> Result<()> {
        for list in self.lists.iter_mut().chain(&mut self.domain_lists) {
            list.cut(comm)?;
        }
        self.points.cut(comm)?;
        self.domains.as_mut().map_or(Ok(()), |series| series.cut(comm))
    }

    /// Writes all points at the end of `step`. `time` is in s, or the load factor.
    pub fn write<const D: usize>(
        &mut self,
        step: usize,
        time: f64,
        points: &Points<D>,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        let name = format!("{FRAMES}{step:06}.h5");
        let file = FileWriter::create(&self.directory.file(&name), comm)?;
        file.write_number("step", &(step as u64))?;
        file.write_number("time", &time)?;
        if let Some(stage) = self.stage {
            file.write_number("stage", &stage)?;
        }

        let mut columns = Vec::with_capacity(3 * points.len());
        for position in &points.position {
            append_vector(position, &mut columns);
        }
        let total = file.write_rows("position", 3, &columns)?;
        file.describe("position", "m", "x, at the end of the step")?;
        let vertices = numbers(&file, "vertices", 1, points.len())?;
        let item = |number, rows, columns, dataset: &str| DataItem {
            number,
            rows,
            columns,
            file: name.clone(),
            dataset: dataset.into(),
        };

        let mut attributes = Vec::new();
        for &field in &self.fields {
            // The geometry is the position already.
            if field != PointField::Position {
                write_field(&file, field, points, comm.rank())?;
                file.describe(field.name(), field.unit(), field.description())?;
            }
            let number = match field.quantity() {
                Quantity::Integer => Number::Int,
                _ => Number::Float,
            };
            attributes.push(Attribute {
                name: field.name().into(),
                center: Center::Node,
                data: item(number, total, field.quantity().columns(), field.name()),
            });
        }
        let mut snapshot = Snapshot {
            step,
            time,
            topology: Topology::Polyvertex,
            connectivity: item(Number::Int, vertices, 1, "vertices"),
            geometry: item(Number::Float, total, 3, "position"),
            attributes,
        };
        let shape = domains::topology(self.basis, D);
        if shape.is_some() {
            let corners = domains::corner_rows(points, self.basis);
            file.write_rows("domain_corners", 3, &corners)?;
            numbers(&file, "domain_corner_numbers", 1 << D, points.len())?;
        }
        if self.formats.contains(&Format::VtkHdf) {
            vtkhdf::add(&file, &self.group(points.len()), comm)?;
        }
        file.finish()?;
        if let (true, Some(shape)) = (self.formats.contains(&Format::VtkHdf), shape) {
            self.write_domains_as_vtkhdf((step, time), shape, points.len(), &name, comm)?;
        }
        if self.formats.contains(&Format::Vtu) {
            self.write_as_vtu((step, time), shape, points, comm)?;
        }
        for list in self.lists.iter_mut().chain(&mut self.domain_lists) {
            list.push(step, time, comm)?;
        }
        if !self.formats.contains(&Format::Xdmf) {
            return Ok(());
        }
        self.points.push(&snapshot, comm)?;

        if let (Some(series), Some(shape)) = (&mut self.domains, shape) {
            let corners = 1 << D;
            snapshot.topology = shape;
            snapshot.connectivity = item(Number::Int, total, corners, "domain_corner_numbers");
            snapshot.geometry = item(Number::Float, total * corners, 3, "domain_corners");
            for attribute in &mut snapshot.attributes {
                attribute.center = Center::Cell;
            }
            series.push(&snapshot, comm)?;
        }
        Ok(())
    }

    /// What a VTKHDF file of `count` points on this rank links.
    fn group(&self, count: usize) -> Group<'_> {
        Group {
            source: Source::Here,
            topology: Topology::Polyvertex,
            points: count,
            cells: count,
            places: "position",
            nodes: Nodes::Dataset("vertices"),
            point_data: self.fields.iter().map(|field| field.name()).collect(),
            cell_data: Vec::new(),
        }
    }

    /// `domains-000005.h5`: the domains of `count` points on this rank, whose data lie in the file `of`.
    fn write_domains_as_vtkhdf(
        &self,
        (step, time): (usize, f64),
        shape: Topology,
        count: usize,
        of: &str,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        let path = self.directory.file(&format!("domains-{step:06}.h5"));
        let file = FileWriter::create(&path, comm)?;
        file.write_number("step", &(step as u64))?;
        file.write_number("time", &time)?;
        let points = self.group(count);
        let group = Group {
            source: Source::File(of),
            topology: shape,
            points: count * shape.nodes_per_element(),
            places: "domain_corners",
            nodes: Nodes::InOrder,
            point_data: Vec::new(),
            cell_data: points.point_data.clone(),
            ..points
        };
        vtkhdf::add(&file, &group, comm)?;
        file.finish()
    }

    /// `points-000005.vtu` and `domains-000005.vtu`
    fn write_as_vtu<const D: usize>(
        &self,
        (step, time): (usize, f64),
        shape: Option<Topology>,
        points: &Points<D>,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        let rank = comm.rank();
        let arrays = || -> Vec<Array<'_>> {
            let fields = self.fields.iter().filter(|field| **field != PointField::Position);
            fields.map(|field| array_of(*field, points, rank)).collect()
        };
        let count = points.len();
        let frame = Frame {
            topology: Topology::Polyvertex,
            points: count,
            cells: count,
            places: Box::new(|| {
                let mut places = Vec::with_capacity(3 * count);
                points.position.iter().for_each(|x| append_vector(x, &mut places));
                places
            }),
            connectivity: None,
            point_data: arrays(),
            cell_data: Vec::new(),
        };
        let path = |begin: &str| self.directory.file(&format!("{begin}{step:06}.vtu"));
        vtu::write(&path(FRAMES), time, frame, comm)?;
        let Some(topology) = shape else { return Ok(()) };
        let frame = Frame {
            topology,
            points: count << D,
            cells: count,
            places: Box::new(|| domains::corner_rows(points, self.basis)),
            connectivity: None,
            point_data: Vec::new(),
            cell_data: arrays(),
        };
        vtu::write(&path("domains-"), time, frame, comm)
    }
}

fn array_of<'a, const D: usize>(field: PointField, points: &'a Points<D>, rank: i32) -> Array<'a> {
    let quantity = field.quantity();
    let count = points.len();
    if quantity == Quantity::Integer {
        return Array::integers(field.name(), move || {
            (0..count).filter_map(|p| field.integer(points, p, rank)).collect()
        });
    }
    let array = Array::floats(field.name(), quantity.columns(), move || {
        let mut values = Vec::with_capacity(count * quantity.columns());
        (0..count).for_each(|p| field.append(points, p, &mut values));
        values
    });
    array.with_components(quantity.component_names())
}

fn with_always(fields: &[PointField]) -> Vec<PointField> {
    let mut all = Vec::new();
    for &field in fields.iter().chain(&ALWAYS) {
        if !all.contains(&field) {
            all.push(field);
        }
    }
    all
}

fn write_field<const D: usize>(
    file: &FileWriter,
    field: PointField,
    points: &Points<D>,
    rank: i32,
) -> Result<()> {
    if field.quantity() == Quantity::Integer {
        let values: Vec<i64> =
            (0..points.len()).filter_map(|p| field.integer(points, p, rank)).collect();
        file.write_rows(field.name(), 1, &values)?;
    } else {
        let columns = field.quantity().columns();
        let mut values = Vec::with_capacity(columns * points.len());
        for p in 0..points.len() {
            field.append(points, p, &mut values);
        }
        file.write_rows(field.name(), columns, &values)?;
    }
    Ok(())
}

/// Writes the numbers 0, 1, 2, ... over all ranks, `columns` to a row. Readers disagree about
/// point clouds and polygons without connectivity, so it is spelled out.
fn numbers(file: &FileWriter, name: &str, columns: usize, rows: usize) -> Result<usize> {
    let first = file.first_row(rows) * columns;
    let values: Vec<i64> = (first..first + rows * columns).map(|number| number as i64).collect();
    file.write_rows(name, columns, &values)
}
