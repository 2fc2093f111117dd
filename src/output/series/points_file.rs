//! `points-000005.h5` per output step, `points.xdmf` over all of them, and `domains.xdmf`, which
//! shows the same data on the points' sub-domains.

use hdf5::types::FixedAscii;
use mpi::topology::{Communicator, SimpleCommunicator};

use super::domains;
use super::frame_list::{FrameList, Kind};
use super::hdf5_writer::FileWriter;
use super::point_field::{PointField, Quantity, append_vector};
use super::vtu::{self, VERTEX};
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
            lists: lists(formats).map(|kind| FrameList::new(directory, kind)).collect(),
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
        let resumed =
            lists(formats).map(|kind| FrameList::resume(directory, kind, last_step, comm));
        this.lists = resumed.collect::<Result<_>>()?;
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
        for list in &mut self.lists {
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
            as_vtkhdf(&file, &self.fields, points.len(), comm)?;
        }
        file.finish()?;
        if self.formats.contains(&Format::Vtu) {
            let path = self.directory.file(&format!("{FRAMES}{step:06}.vtu"));
            vtu::write(&path, time, &self.fields, points, comm)?;
        }
        for list in &mut self.lists {
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
}

fn lists(formats: &[Format]) -> impl Iterator<Item = Kind> + use<'_> {
    formats.iter().filter_map(|format| match format {
        Format::Xdmf => None,
        Format::VtkHdf => Some(Kind::Series),
        Format::Vtu => Some(Kind::Pvd),
    })
}

/// Makes the file a VTKHDF one (version 1.0, unstructured grid): a group whose members are links to the
/// datasets that are there, and what VTK wants beside them.
fn as_vtkhdf(
    file: &FileWriter,
    fields: &[PointField],
    count: usize,
    comm: &SimpleCommunicator,
) -> Result<()> {
    file.arrange(|file| {
        let group = file.create_group("VTKHDF")?;
        group.new_attr::<i64>().shape(2).create("Version")?.as_writer().write_raw(&[1_i64, 0])?;
        let kind = FixedAscii::<16>::from_ascii(b"UnstructuredGrid");
        let kind = kind.map_err(|reason| hdf5::Error::from(reason.to_string()))?;
        group.new_attr::<FixedAscii<16>>().create("Type")?.as_writer().write_scalar(&kind)?;
        group.create_group("PointData")?;
        Ok(())
    })?;
    let first = file.first_row(count);
    let offsets: Vec<i64> = (0..usize::from(comm.rank() == 0))
        .chain(first + 1..first + count + 1)
        .map(|end| end as i64)
        .collect();
    file.write_rows("VTKHDF/Offsets", 1, &offsets)?;
    let total = file.write_rows("VTKHDF/Types", 1, &vec![VERTEX; count])?;
    for name in ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"] {
        let one = [total as i64];
        let rows = if comm.rank() == 0 { &one[..] } else { &[] };
        file.write_rows(&format!("VTKHDF/{name}"), 1, rows)?;
    }
    file.arrange(|file| {
        file.link_hard("/position", "/VTKHDF/Points")?;
        file.link_hard("/vertices", "/VTKHDF/Connectivity")?;
        for field in fields {
            let name = field.name();
            file.link_hard(&format!("/{name}"), &format!("/VTKHDF/PointData/{name}"))?;
        }
        Ok(())
    })
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
