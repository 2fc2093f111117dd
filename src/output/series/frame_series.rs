//! A series: `points-000005.h5` and its like, one file a frame, and the lists of frames that readers open.

use mpi::topology::SimpleCommunicator;

use super::frame::{Frame, Totals};
use super::frame_list::FrameList;
use super::hdf5_writer::FileWriter;
use super::{vtkhdf, vtu};
use crate::deck::choices::Choice;
use crate::deck::model::Format;
use crate::error::Result;
use crate::output::directory::ResultsDirectory;
use crate::output::terminal::log::Log;

/// When a frame was taken: its step, and its time in s, or the load factor.
pub type StepTime = (usize, f64);

/// The frames of one name.
pub struct Series {
    directory: ResultsDirectory,
    /// Beginning of the files' names: `points`, `domains`, `grid` or `rigid`.
    name: &'static str,
    lists: Vec<FrameList>,
    /// Those in formats that the deck does not ask for, which the run before a restart may have left.
    ended: Vec<FrameList>,
    /// Number of the present stage, from one, which each file then states.
    pub stage: Option<u64>,
}

impl Series {
    /// A new series in the deck's `output.format`; the HDF5 files of its frames are those of `data`.
    pub fn create(
        directory: &ResultsDirectory,
        (name, data): (&'static str, &'static str),
        formats: &[Format],
    ) -> Self {
        let list = |format| FrameList::new(directory, (name, data), format);
        let lists = formats.iter().map(|&format| list(format)).collect();
        let others = Format::SPELLINGS.iter().map(|(_, format)| *format);
        let ended = others.filter(|format| !formats.contains(format)).map(list).collect();
        Self { directory: directory.clone(), name, lists, ended, stage: None }
    }

    /// Continues the lists of a run that is restarted after `last_step`. Nothing is written before
    /// [`Self::cut`].
    pub fn resume(
        &mut self,
        last_step: usize,
        log: &mut Log,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        self.lists.iter_mut().try_for_each(|list| list.resume(last_step, log, comm))?;
        self.ended.iter_mut().try_for_each(|list| list.end(last_step, comm))
    }

    /// Takes what comes later than the step of the restart out of the lists.
    pub fn cut(&mut self, comm: &SimpleCommunicator) -> Result<()> {
        self.lists.iter_mut().chain(&mut self.ended).try_for_each(|list| list.cut(comm))
    }

    pub fn has(&self, format: Format) -> bool {
        self.lists.iter().any(|list| list.format == format)
    }

    /// Name of the HDF5 file of a step.
    pub fn file_name(&self, step: usize) -> String {
        format!("{}-{step:06}.h5", self.name)
    }

    /// Writes a frame and lists it. Collective.
    pub fn write(
        &mut self,
        when: StepTime,
        frame: &Frame<'_>,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        let totals = self.write_data(when, frame, None, comm)?.0;
        self.list(when, frame, totals, comm)
    }

    /// Writes the HDF5 file of a frame, with the shape of another one over the same data. Collective.
    pub fn write_data(
        &self,
        when: StepTime,
        frame: &Frame<'_>,
        other: Option<&Frame<'_>>,
        comm: &SimpleCommunicator,
    ) -> Result<(Totals, Option<Totals>)> {
        let file = self.begin(when, comm)?;
        let totals = frame.store(&file)?;
        let others = other.map(|other| other.store_shape(&file)).transpose()?;
        if self.has(Format::VtkHdf) {
            vtkhdf::add(&file, frame, None, comm)?;
        }
        file.finish()?;
        Ok((totals, others))
    }

    /// Writes a VTKHDF file whose data lie in the file `data`. Collective.
    pub fn write_links(
        &self,
        when: StepTime,
        frame: &Frame<'_>,
        data: &str,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        let file = self.begin(when, comm)?;
        vtkhdf::add(&file, frame, Some(data), comm)?;
        file.finish()
    }

    /// Lists a frame whose data are written, and writes its VTK file if the deck asks for it. Collective.
    pub fn list(
        &mut self,
        (step, time): StepTime,
        frame: &Frame<'_>,
        totals: Totals,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        if self.has(Format::Vtu) {
            let path = self.directory.file(&format!("{}-{step:06}.vtu", self.name));
            vtu::write(&path, time, frame, comm)?;
        }
        let mut lists = self.lists.iter_mut();
        lists.try_for_each(|list| list.push((step, time), frame, totals, comm))
    }

    fn begin<'c>(
        &self,
        (step, time): StepTime,
        comm: &'c SimpleCommunicator,
    ) -> Result<FileWriter<'c>> {
        let path = self.directory.file(&self.file_name(step));
        let file = FileWriter::create(&path, comm)?;
        file.write_number("step", &(step as u64))?;
        file.write_number("time", &time)?;
        if let Some(stage) = self.stage {
            file.write_number("stage", &stage)?;
        }
        Ok(file)
    }
}
