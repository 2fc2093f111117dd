//! `points-000005.h5` per output step, the lists over all of them, and `domains.xdmf` and its like, which
//! show the same data on the points' sub-domains.

use mpi::topology::{Communicator, SimpleCommunicator};

use super::domains;
use super::frame::{Array, Frame, Number, Topology, Values};
use super::frame_series::{Series, StepTime};
use crate::deck::fields::{FieldRank, PointField};
use crate::deck::model::{Basis, Format};
use crate::error::Result;
use crate::output::directory::ResultsDirectory;
use crate::output::terminal::log::Log;
use crate::points::Points;

/// Fields that every file holds, asked for or not.
const ALWAYS: [PointField; 3] = [PointField::Id, PointField::Body, PointField::Rank];

/// The points' time series.
pub struct PointsSeries {
    fields: Vec<PointField>,
    basis: Basis,
    points: Series,
    domains: Option<Series>,
}

impl PointsSeries {
    /// A new series; `fields` are the deck's `output.fields`, `formats` its `output.format`.
    pub fn create(
        directory: &ResultsDirectory,
        fields: &[PointField],
        formats: &[Format],
        (basis, dimension): (Basis, usize),
    ) -> Self {
        let series = |name| Series::create(directory, (name, "points"), formats);
        let has_domains = domains::topology(basis, dimension).is_some();
        Self {
            fields: with_always(fields),
            basis,
            points: series("points"),
            domains: has_domains.then(|| series("domains")),
        }
    }

    /// [`Series::resume`]
    pub fn resume(
        &mut self,
        last_step: usize,
        log: &mut Log,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        self.points.resume(last_step, log, comm)?;
        self.domains.as_mut().map_or(Ok(()), |series| series.resume(last_step, log, comm))
    }

    /// [`Series::cut`]
    pub fn cut(&mut self, comm: &SimpleCommunicator) -> Result<()> {
        self.points.cut(comm)?;
        self.domains.as_mut().map_or(Ok(()), |series| series.cut(comm))
    }

    /// Sets the number of the present stage, from one; `None` in a deck without stages.
    pub fn enter_stage(&mut self, stage: Option<u64>) {
        self.points.stage = stage;
    }

    /// Writes all points at the end of a step.
    pub fn write<const D: usize>(
        &mut self,
        when: StepTime,
        points: &Points<D>,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        let Self { fields, basis, points: series, domains } = self;
        let arrays = || fields.iter().map(|field| array_of(*field, points, comm.rank())).collect();
        let count = points.len();
        let frame = Frame {
            topology: Topology::Polyvertex,
            points: count,
            cells: count,
            places: Array::vectors("position", &points.position)
                .described("m", "x, at the end of the step"),
            nodes: "vertices",
            connectivity: None,
            point_data: arrays(),
            cell_data: Vec::new(),
        };
        let corners = || domains::corner_rows(points, *basis);
        let of_domains = domains::topology(*basis, D).map(|topology| Frame {
            topology,
            points: count << D,
            cells: count,
            places: Array { columns: 3, ..Array::floats("domain_corners", corners) },
            nodes: "domain_corner_numbers",
            connectivity: None,
            point_data: Vec::new(),
            cell_data: arrays(),
        });
        let (totals, others) = series.write_data(when, &frame, of_domains.as_ref(), comm)?;
        series.list(when, &frame, totals, comm)?;
        if let (Some(domains), Some(frame), Some(totals)) = (domains, of_domains, others) {
            if domains.has(Format::VtkHdf) {
                domains.write_links(when, &frame, &series.file_name(when.0), comm)?;
            }
            domains.list(when, &frame, totals, comm)?;
        }
        Ok(())
    }
}

fn array_of<'a, const D: usize>(field: PointField, points: &'a Points<D>, rank: i32) -> Array<'a> {
    let (count, facts) = (points.len(), field.facts());
    let (integer, columns) = (facts.rank == FieldRank::Integer, facts.rank.columns());
    let values = move || {
        if integer {
            let values = (0..count).filter_map(|p| field.integer(points, p, rank));
            return Values::Integers(values.collect());
        }
        let mut values = Vec::with_capacity(count * columns);
        (0..count).for_each(|p| field.append(points, p, &mut values));
        Values::Floats(values)
    };
    let number = if integer { Number::Integer } else { Number::Float };
    let components = facts.rank.components(3);
    let array = Array { columns, components, ..Array::new(facts.name, number, values) };
    array.described(facts.unit, facts.doc)
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
