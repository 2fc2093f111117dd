//! `points-000005.h5` per output step, `points.xdmf` over all of them, and `domains.xdmf`, which
//! shows the same data on the points' sub-domains.

use mpi::topology::{Communicator, SimpleCommunicator};

use super::domains;
use super::hdf5_writer::FileWriter;
use super::point_field::{PointField, Quantity, append_vector};
use super::xdmf::{Attribute, Center, DataItem, Number, Snapshot, Topology, XdmfSeries};
use crate::deck::model::Basis;
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
    points: XdmfSeries,
    domains: Option<XdmfSeries>,
}

impl PointsSeries {
    /// A new series; `fields` are the deck's `output.fields`.
    pub fn create(
        directory: &ResultsDirectory,
        fields: &[PointField],
        basis: Basis,
        dimension: usize,
    ) -> Self {
        let has_domains = domains::topology(basis, dimension).is_some();
        Self {
            directory: directory.clone(),
            fields: with_always(fields),
            basis,
            points: XdmfSeries::new(&directory.file("points.xdmf")),
            domains: has_domains.then(|| XdmfSeries::new(&directory.file("domains.xdmf"))),
        }
    }

    /// Continues the series of a run that is restarted after `last_step`. Nothing is written before
    /// [`Self::cut`].
    pub fn resume(
        directory: &ResultsDirectory,
        fields: &[PointField],
        basis: Basis,
        dimension: usize,
        last_step: usize,
        log: &mut Log,
        comm: &SimpleCommunicator,
    ) -> Result<Self> {
        let mut this = Self::create(directory, fields, basis, dimension);
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

        let mut columns = Vec::with_capacity(3 * points.len());
        for position in &points.position {
            append_vector(position, &mut columns);
        }
        let total = file.write_rows("position", 3, &columns)?;
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
        file.finish()?;
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
