//! HDF5 files written by all ranks: the library lays them out, the system writes the rows.
//!
//! A dataset is a table of rows dealt out over the ranks: rank r holds the rows after those of
//! ranks 0..r. Ranks without rows take part in every call.
//!
//! Rank 0 alone has the file open in HDF5, to make datasets and attributes. Each dataset lies in
//! one piece, so that every rank puts its rows in their place by an ordinary write. Parallel HDF5
//! would do this through MPI-IO, which does not survive a full disk: the rank that meets the error
//! leaves a collective call in which the others wait for ever, or the library ends in a
//! segmentation fault as it closes the file once more. An ordinary write says what went wrong, on
//! the rank where it did, and all ranks agree on it after every call.

use std::fs::{File, OpenOptions};
use std::mem;
use std::os::unix::fs::FileExt;
use std::path::Path;

use bytemuck::NoUninit;
use hdf5::H5Type;
use hdf5::plist::dataset_create::{AllocTime, FillTime};
use hdf5::types::TypeDescriptor;
use hdf5_sys::h5a::H5Awrite;
use mpi::topology::{Communicator, SimpleCommunicator};
use mpi::traits::Root;

use crate::error::{Error, Result};
use crate::output::agreement::{all_agree, on_root, place};
use crate::output::whole_file::{Partial, cannot_write};

/// What network file systems cache as a unit, bytes.
const PAGE: u64 = 4096;
/// Room for the library's own bytes at the beginning of a file, so that they share no page with
/// rows: what rank 0's machine keeps of it, and writes back whole, would hold another machine's.
/// Checkpoints take most, about 10 kB; what is not used stays a hole.
const OWN_PAGES: u64 = 4 * PAGE;
/// Where a dataset without rows lies.
const NOWHERE: u64 = u64::MAX;

/// A new file that all ranks of `comm` write together; it has its name when it is whole. Dropped
/// before that, it is gone.
pub struct FileWriter<'c> {
    /// On rank 0.
    layout: Option<hdf5::File>,
    /// This rank's own access to the same file.
    rows: File,
    partial: Partial,
    comm: &'c SimpleCommunicator,
}

impl<'c> FileWriter<'c> {
    /// Starts a new file; it appears under `path` only after [`FileWriter::finish`].
    pub fn create(path: &Path, comm: &'c SimpleCommunicator) -> Result<Self> {
        let partial = Partial::of(path, comm);
        let mut layout = None;
        on_root(comm, || {
            // The operating system's reason is only to be had from an ordinary open.
            File::create(partial.path()).map_err(|reason| cannot_write(path, &reason))?;
            let file = hdf5::File::with_options()
                .with_fapl(|p| {
                    p.sec2()
                        .alignment(PAGE, PAGE)
                        .meta_block_size(OWN_PAGES)
                        .small_data_block_size(PAGE)
                })
                .create(partial.path());
            layout = Some(file.map_err(|reason| refused(path, &reason))?);
            Ok(())
        })?;
        // Not for reading: then no system fetches, and writes back, bytes beside the own rows.
        let rows = OpenOptions::new().write(true).open(partial.path());
        let (rows, outcome) = match rows {
            Ok(file) => (Some(file), Ok(())),
            Err(reason) => (None, Err(cannot_write(path, &reason))),
        };
        if let Err(error) = all_agree(comm, outcome) {
            mem::forget(layout);
            return Err(error);
        }
        let rows = rows.expect("all ranks agreed that they have it open");
        Ok(Self { layout, rows, partial, comm })
    }

    /// Writes a table of `columns` columns (a plain vector for one column): `values` are this
    /// rank's rows, row by row. Returns the number of rows of all ranks.
    pub fn write_rows<T: H5Type + NoUninit>(
        &self,
        name: &str,
        columns: usize,
        values: &[T],
    ) -> Result<usize> {
        assert!(
            columns > 0 && values.len().is_multiple_of(columns),
            "{name}: rows of unequal length"
        );
        let (first, total) = place(self.comm, values.len() / columns);
        let mut start = NOWHERE;
        self.lay_out(|file| {
            start = new_dataset::<T>(file, name, total, columns)?;
            Ok(())
        })?;
        self.comm.process_at_rank(0).broadcast_into(&mut start);
        let outcome = if start == NOWHERE {
            Ok(())
        } else {
            let own = start + (first * columns * size_of::<T>()) as u64;
            self.rows.write_all_at(bytemuck::cast_slice(values), own)
        };
        all_agree(self.comm, outcome.map_err(|reason| cannot_write(self.path(), &reason)))?;
        Ok(total)
    }

    /// Attaches a number to the file; the same value on every rank.
    pub fn write_number<T: H5Type>(&self, name: &str, value: &T) -> Result<()> {
        self.lay_out(|file| {
            let attribute = file.new_attr::<T>().create(name)?;
            attribute.as_writer().write_scalar(value)
        })
    }

    /// Attaches unit and meaning to a dataset; an empty text is left out.
    pub fn describe(&self, name: &str, unit: &str, description: &str) -> Result<()> {
        self.lay_out(|file| {
            let dataset = file.dataset(name)?;
            for (key, text) in [("unit", unit), ("description", description)] {
                if !text.is_empty() {
                    write_text_attribute(&dataset, key, text)?;
                }
            }
            Ok(())
        })
    }

    /// The row of the whole table at which this rank's `rows` rows start.
    pub fn first_row(&self, rows: usize) -> usize {
        place(self.comm, rows).0
    }

    /// Brings the file to the disk, closes it and gives it its name.
    pub fn finish(self) -> Result<()> {
        let comm = self.comm;
        let partial = self.close_unnamed()?;
        on_root(comm, || partial.give_name())
    }

    /// Brings the file to the disk, closes it and leaves it under the name it has until it is
    /// whole.
    pub fn close_unnamed(mut self) -> Result<Partial> {
        let path = self.path().to_path_buf();
        let closed = self.layout.take().map_or(Ok(()), close);
        // Some file systems report a full disk only now.
        let outcome = closed
            .map_err(|reason| refused(&path, &reason))
            .and_then(|()| self.rows.sync_all().map_err(|reason| cannot_write(&path, &reason)));
        all_agree(self.comm, outcome)?;
        Ok(mem::take(&mut self.partial))
    }

    fn path(&self) -> &Path {
        self.partial.name()
    }

    /// Lets rank 0 add datasets, groups, links and attributes to the file; every rank gets the outcome.
    pub fn lay_out(&self, act: impl FnOnce(&hdf5::File) -> hdf5::Result<()>) -> Result<()> {
        on_root(self.comm, || match &self.layout {
            Some(file) => act(file).map_err(|reason| refused(self.path(), &reason)),
            None => Ok(()),
        })
    }
}

impl Drop for FileWriter<'_> {
    /// After a failure. What HDF5 still holds in memory has no place on the disk: closing would
    /// fail, and HDF5 does not survive that. The handle is left to the end of the process
    /// ([`crate::output::start`] sees to it that nobody closes it then).
    fn drop(&mut self) {
        mem::forget(self.layout.take());
    }
}

/// Flushes and closes; a file that cannot be flushed is left open for good.
fn close(file: hdf5::File) -> hdf5::Result<()> {
    match file.flush() {
        Ok(()) => file.close(),
        Err(reason) => {
            mem::forget(file);
            Err(reason)
        }
    }
}

/// Makes a dataset in one piece and says where in the file it starts.
fn new_dataset<T: H5Type>(
    file: &hdf5::File,
    name: &str,
    rows: usize,
    columns: usize,
) -> hdf5::Result<u64> {
    let builder =
        file.new_dataset::<T>().alloc_time(Some(AllocTime::Early)).fill_time(FillTime::Never);
    let dataset = match columns {
        1 => builder.shape(rows).create(name),
        _ => builder.shape((rows, columns)).create(name),
    }?;
    match dataset.offset() {
        Some(start) => Ok(start),
        None if rows == 0 => Ok(NOWHERE),
        None => Err("HDF5 gave the dataset no place".into()),
    }
}

/// A text of fixed length: one of variable length would lie elsewhere in the file.
fn write_text_attribute(file: &hdf5::Location, name: &str, text: &str) -> hdf5::Result<()> {
    // HDF5 knows no empty fixed-length text; padding is cut off on reading.
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(bytes.len().max(1), 0);
    let kind = TypeDescriptor::FixedUnicode(bytes.len());
    let attribute = file.new_attr_builder().empty_as(kind).shape(()).create(name)?;
    let kind = attribute.dtype()?;
    hdf5::sync::sync(|| {
        // SAFETY: both identifiers are open and the type is as long as `bytes`.
        hdf5::h5check(unsafe { H5Awrite(attribute.id(), kind.id(), bytes.as_ptr().cast()) })
    })?;
    Ok(())
}

/// The system's reason, if HDF5 met one, in the system's words.
fn refused(path: &Path, reason: &hdf5::Error) -> Error {
    let frames = reason.stack();
    let number = frames.iter().flat_map(|frames| frames.iter()).find_map(|frame| {
        let (_, rest) = frame.desc().split_once("errno = ")?;
        rest.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
    });
    match number {
        Some(number) => cannot_write(path, &std::io::Error::from_raw_os_error(number)),
        None => Error::File(format!("cannot write {}: {reason}", path.display())),
    }
}
