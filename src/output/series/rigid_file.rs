//! `rigid-000005.h5` per output step and `rigid.xdmf`: the surfaces of rigid bodies where they are.

use mpi::topology::{Communicator, SimpleCommunicator};

use super::hdf5_writer::FileWriter;
use super::point_field::append_vector;
use super::xdmf::{Attribute, Center, DataItem, Number, Snapshot, Topology, XdmfSeries};
use crate::error::Result;
use crate::output::directory::ResultsDirectory;
use crate::output::names::RIGID;
use crate::output::terminal::log::Log;

/// Surfaces of all rigid bodies, the same on every rank.
#[derive(Debug, Clone, Default)]
pub struct RigidFrame<const D: usize> {
    /// m
    pub corners: Vec<[f64; D]>,
    /// Segments (2D) or triangles.
    pub facets: Vec<[usize; D]>,
    /// Number of each facet's rigid body in the deck, from zero.
    pub body: Vec<i64>,
}

/// Their time series.
pub struct RigidSeries {
    directory: ResultsDirectory,
    series: XdmfSeries,
}

impl RigidSeries {
    pub fn create(directory: &ResultsDirectory) -> Self {
        let series = XdmfSeries::new(&directory.file(RIGID));
        Self { directory: directory.clone(), series }
    }

    /// Continues the series of a run that is restarted after `last_step`. Nothing is written before
    /// [`Self::cut`].
    pub fn resume(
        directory: &ResultsDirectory,
        last_step: usize,
        log: &mut Log,
        comm: &SimpleCommunicator,
    ) -> Result<Self> {
        let series = XdmfSeries::resume(&directory.file(RIGID), "rigid-", last_step, log, comm)?;
        Ok(Self { directory: directory.clone(), series })
    }

    /// [`XdmfSeries::cut`]
    pub fn cut(&mut self, comm: &SimpleCommunicator) -> Result<()> {
        self.series.cut(comm)
    }

    /// Writes the surfaces of `step`. `time` is in s, or the load factor. Collective.
    pub fn write<const D: usize>(
        &mut self,
        step: usize,
        time: f64,
        frame: &RigidFrame<D>,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        let name = format!("rigid-{step:06}.h5");
        let file = FileWriter::create(&self.directory.file(&name), comm)?;
        file.write_number("step", &(step as u64))?;
        file.write_number("time", &time)?;
        // The first rank writes what all have.
        let (mut coordinates, mut connectivity, mut body) = (Vec::new(), Vec::new(), Vec::new());
        if comm.rank() == 0 {
            frame.corners.iter().for_each(|x| append_vector(x, &mut coordinates));
            connectivity.extend(frame.facets.as_flattened().iter().map(|&corner| corner as i64));
            body.extend_from_slice(&frame.body);
        }
        let all_corners = file.write_rows("coordinates", 3, &coordinates)?;
        let all_facets = file.write_rows("connectivity", D, &connectivity)?;
        file.write_rows("rigid", 1, &body)?;
        file.finish()?;
        let item = |number, rows, columns, dataset: &str| DataItem {
            number,
            rows,
            columns,
            file: name.clone(),
            dataset: dataset.into(),
        };
        let data = item(Number::Int, all_facets, 1, "rigid");
        let snapshot = Snapshot {
            step,
            time,
            topology: if D == 2 { Topology::Segment } else { Topology::Triangle },
            connectivity: item(Number::Int, all_facets, D, "connectivity"),
            geometry: item(Number::Float, all_corners, 3, "coordinates"),
            attributes: vec![Attribute { name: "rigid".into(), center: Center::Cell, data }],
        };
        self.series.push(&snapshot, comm)
    }
}
