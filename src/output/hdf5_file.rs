//! Collective HDF5: the thin safe wall around parallel files.
//!
//! A dataset is a table of rows dealt out over the ranks: rank r holds the rows after those of
//! ranks 0..r. Ranks without rows take part in every call. A file gets its name only when it is
//! whole, so that a killed run leaves no damaged file under a good name.

use std::fs;
use std::path::{Path, PathBuf};
use std::ptr::null;

use hdf5::H5Type;
use hdf5::types::TypeDescriptor;
use hdf5_sys::h5::hsize_t;
use hdf5_sys::h5a::{H5Aread, H5Awrite};
use hdf5_sys::h5d::{H5Dread, H5Dwrite};
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5p::{
    H5FD_mpio_xfer_t, H5P_CLS_DATASET_XFER, H5Pclose, H5Pcreate, H5Pset_dxpl_mpio,
};
use hdf5_sys::h5s::{
    H5S_seloper_t, H5Sclose, H5Screate_simple, H5Sselect_hyperslab, H5Sselect_none,
};
use mpi::collective::{CommunicatorCollectives, SystemOperation};
use mpi::topology::{Communicator, SimpleCommunicator};
use mpi::traits::AsRaw;

use super::agreement::{all_agree, on_root};
use super::whole_file::{cannot_read, cannot_write, partial_path};
use crate::error::{Error, Result};

/// A file that all ranks of `comm` write or read together; drop it before MPI is finalised.
pub struct ParallelFile<'c> {
    file: hdf5::File,
    path: PathBuf,
    comm: &'c SimpleCommunicator,
}

impl<'c> ParallelFile<'c> {
    /// Starts a new file; it appears under `path` only after [`ParallelFile::finish`].
    pub fn create(path: &Path, comm: &'c SimpleCommunicator) -> Result<Self> {
        let partial = partial_path(path);
        // The operating system's reason is only to be had from an ordinary open.
        on_root(comm, || {
            fs::File::create(&partial).map(drop).map_err(|reason| cannot_write(path, &reason))
        })?;
        let file = hdf5::File::with_options()
            .with_fapl(|p| {
                p.mpio(comm.as_raw(), None).all_coll_metadata_ops(true).coll_metadata_write(true)
            })
            .create(&partial);
        let this = |file| Self { file, path: path.to_path_buf(), comm };
        accept(comm, file, |reason| write_failed(path, "", reason)).map(this)
    }

    /// Opens an existing file for reading.
    pub fn open(path: &Path, comm: &'c SimpleCommunicator) -> Result<Self> {
        on_root(comm, || {
            fs::File::open(path).map(drop).map_err(|reason| cannot_read(path, &reason))
        })?;
        let file = hdf5::File::with_options()
            .with_fapl(|p| p.mpio(comm.as_raw(), None).all_coll_metadata_ops(true))
            .open(path);
        let this = |file| Self { file, path: path.to_path_buf(), comm };
        accept(comm, file, |reason| {
            Error::File(format!("{} is not a readable HDF5 file: {reason}", path.display()))
        })
        .map(this)
    }

    /// Writes a table of `columns` columns (a plain vector for one column): `values` are this
    /// rank's rows, row by row. Returns the number of rows of all ranks.
    pub fn write_rows<T: H5Type>(&self, name: &str, columns: usize, values: &[T]) -> Result<usize> {
        assert!(
            columns > 0 && values.len().is_multiple_of(columns),
            "{name}: rows of unequal length"
        );
        let rows = values.len() / columns;
        let (first, total) = self.place(rows);
        let builder = self.file.new_dataset::<T>();
        let dataset = match columns {
            1 => builder.shape(total).create(name),
            _ => builder.shape((total, columns)).create(name),
        };
        let failed = |reason: &hdf5::Error| write_failed(&self.path, name, reason);
        let dataset = accept(self.comm, dataset, failed)?;
        let outcome = hdf5::Datatype::from_type::<T>().and_then(|kind| {
            let slab = Slab { first, rows, columns, flat: dataset.ndim() == 1 };
            let values = values.as_ptr().cast();
            slab.transfer(&dataset, |memory, file, transfer| {
                // SAFETY: the dataset, both dataspaces and the property list are open; `values`
                // holds the rows * columns elements of type T that the memory space selects.
                unsafe { H5Dwrite(dataset.id(), kind.id(), memory, file, transfer, values) }
            })
        });
        accept(self.comm, outcome, failed)?;
        Ok(total)
    }

    /// Rows and columns of a table.
    pub fn shape(&self, name: &str) -> Result<(usize, usize)> {
        let dataset = self.dataset(name)?;
        match dataset.shape()[..] {
            [rows] => Ok((rows, 1)),
            [rows, columns] => Ok((rows, columns)),
            ref shape => Err(Error::File(format!(
                "{}: dataset {name} has {} dimensions, not 1 or 2",
                self.path.display(),
                shape.len()
            ))),
        }
    }

    /// Reads `rows` rows from row `first` on, a choice of each rank.
    pub fn read_rows<T: H5Type + Clone + Default>(
        &self,
        name: &str,
        first: usize,
        rows: usize,
    ) -> Result<Vec<T>> {
        let (total, columns) = self.shape(name)?;
        let inside = first.checked_add(rows).is_some_and(|end| end <= total);
        all_agree(
            self.comm,
            if inside {
                Ok(())
            } else {
                Err(Error::File(format!(
                    "{}: dataset {name} has {total} rows; rows {first}..{} were asked for",
                    self.path.display(),
                    first.saturating_add(rows)
                )))
            },
        )?;
        let dataset = self.dataset(name)?;
        let mut values = vec![T::default(); rows * columns];
        let outcome = hdf5::Datatype::from_type::<T>().and_then(|kind| {
            let slab = Slab { first, rows, columns, flat: dataset.ndim() == 1 };
            let values = values.as_mut_ptr().cast();
            slab.transfer(&dataset, |memory, file, transfer| {
                // SAFETY: as for writing; `values` has room for the rows * columns elements of
                // type T that the memory space selects, and HDF5 converts to T or fails.
                unsafe { H5Dread(dataset.id(), kind.id(), memory, file, transfer, values) }
            })
        });
        accept(self.comm, outcome, |reason| read_failed(&self.path, name, reason))?;
        Ok(values)
    }

    /// Reads all rows on every rank.
    pub fn read_all<T: H5Type + Clone + Default>(&self, name: &str) -> Result<Vec<T>> {
        let total = self.shape(name)?.0;
        self.read_rows(name, 0, total)
    }

    /// Reads the rows `total * rank / size .. total * (rank + 1) / size`: an equal share.
    pub fn read_share<T: H5Type + Clone + Default>(&self, name: &str) -> Result<Vec<T>> {
        let total = self.shape(name)?.0;
        let (rank, size) = (self.comm.rank() as usize, self.comm.size() as usize);
        let (first, end) = (total * rank / size, total * (rank + 1) / size);
        self.read_rows(name, first, end - first)
    }

    /// Attaches a number to the file; the same value on every rank.
    pub fn write_number<T: H5Type>(&self, name: &str, value: &T) -> Result<()> {
        let outcome = self
            .file
            .new_attr::<T>()
            .create(name)
            .and_then(|attribute| attribute.as_writer().write_scalar(value));
        accept(self.comm, outcome, |reason| write_failed(&self.path, name, reason))
    }

    pub fn read_number<T: H5Type>(&self, name: &str) -> Result<T> {
        let outcome =
            self.file.attr(name).and_then(|attribute| attribute.as_reader().read_scalar());
        accept(self.comm, outcome, |reason| read_failed(&self.path, name, reason))
    }

    /// Attaches a text of less than 64 kB to the file; the same on every rank.
    pub fn write_text(&self, name: &str, text: &str) -> Result<()> {
        let outcome = write_text_attribute(&self.file, name, text);
        accept(self.comm, outcome, |reason| write_failed(&self.path, name, reason))
    }

    pub fn read_text(&self, name: &str) -> Result<String> {
        let outcome = self.file.attr(name).and_then(|attribute| read_text_attribute(&attribute));
        accept(self.comm, outcome, |reason| read_failed(&self.path, name, reason))
    }

    /// The row of the whole table at which this rank's `rows` rows start.
    pub fn first_row(&self, rows: usize) -> usize {
        self.place(rows).0
    }

    pub fn has(&self, name: &str) -> bool {
        self.file.link_exists(name)
    }

    /// Closes the file and gives it its name.
    pub fn finish(self) -> Result<()> {
        let (path, comm) = (self.path.clone(), self.comm);
        let partial = self.close_unnamed()?;
        on_root(comm, || fs::rename(partial, &path).map_err(|reason| cannot_write(&path, &reason)))
    }

    /// Closes the file and leaves it under the name it has until it is whole, which is returned.
    pub fn close_unnamed(self) -> Result<PathBuf> {
        let Self { file, path, comm } = self;
        let outcome = file.flush().and_then(|()| file.close());
        accept(comm, outcome, |reason| write_failed(&path, "", reason))?;
        Ok(partial_path(&path))
    }

    fn dataset(&self, name: &str) -> Result<hdf5::Dataset> {
        let dataset = self.file.dataset(name);
        accept(self.comm, dataset, |reason| read_failed(&self.path, name, reason))
    }

    /// This rank's first row, and the number of rows of all ranks.
    fn place(&self, rows: usize) -> (usize, usize) {
        let (mut before, mut total) = (0_u64, 0_u64);
        let rows = rows as u64;
        self.comm.exclusive_scan_into(&rows, &mut before, SystemOperation::sum());
        // MPI leaves the result of rank 0 undefined.
        if self.comm.rank() == 0 {
            before = 0;
        }
        self.comm.all_reduce_into(&rows, &mut total, SystemOperation::sum());
        (before as usize, total as usize)
    }
}

/// The rows of one rank within a dataset.
struct Slab {
    first: usize,
    rows: usize,
    columns: usize,
    flat: bool,
}

impl Slab {
    /// Calls `transfer(memory space, file space, collective property list)`.
    fn transfer(
        &self,
        dataset: &hdf5::Dataset,
        transfer: impl FnOnce(hid_t, hid_t, hid_t) -> i32,
    ) -> hdf5::Result<()> {
        let dimensions = if self.flat { 1 } else { 2 };
        let start = [self.first as hsize_t, 0];
        let count = [self.rows as hsize_t, self.columns as hsize_t];
        let space = dataset.space()?;
        hdf5::sync::sync(|| {
            // SAFETY: the arrays live through the calls and hold `dimensions` <= 2 numbers;
            // every identifier is checked before use and closed once.
            unsafe {
                let memory =
                    Owned::new(H5Screate_simple(dimensions, count.as_ptr(), null()), H5Sclose)?;
                let list = Owned::new(H5Pcreate(*H5P_CLS_DATASET_XFER), H5Pclose)?;
                hdf5::h5check(H5Pset_dxpl_mpio(list.id, H5FD_mpio_xfer_t::H5FD_MPIO_COLLECTIVE))?;
                if self.rows == 0 {
                    hdf5::h5check(H5Sselect_none(space.id()))?;
                    hdf5::h5check(H5Sselect_none(memory.id))?;
                } else {
                    hdf5::h5check(H5Sselect_hyperslab(
                        space.id(),
                        H5S_seloper_t::H5S_SELECT_SET,
                        start.as_ptr(),
                        null(),
                        count.as_ptr(),
                        null(),
                    ))?;
                }
                hdf5::h5check(transfer(memory.id, space.id(), list.id))?;
            }
            Ok(())
        })
    }
}

/// A raw HDF5 identifier, closed on drop.
struct Owned {
    id: hid_t,
    close: unsafe extern "C" fn(hid_t) -> i32,
}

impl Owned {
    fn new(id: hid_t, close: unsafe extern "C" fn(hid_t) -> i32) -> hdf5::Result<Self> {
        if id < 0 { Err("HDF5 gave no identifier".into()) } else { Ok(Self { id, close }) }
    }
}

impl Drop for Owned {
    fn drop(&mut self) {
        // SAFETY: `id` came from the call that belongs to `close` and is closed only here.
        hdf5::sync::sync(|| unsafe { (self.close)(self.id) });
    }
}

/// A text of fixed length: texts of variable length cannot be written by several ranks.
fn write_text_attribute(file: &hdf5::File, name: &str, text: &str) -> hdf5::Result<()> {
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

fn read_text_attribute(attribute: &hdf5::Attribute) -> hdf5::Result<String> {
    let kind = attribute.dtype()?;
    if !matches!(kind.to_descriptor()?, TypeDescriptor::FixedUnicode(_)) || !attribute.is_scalar() {
        return Err("it is not a text of fixed length".into());
    }
    let mut bytes = vec![0_u8; kind.size()];
    hdf5::sync::sync(|| {
        // SAFETY: both identifiers are open and `bytes` is as long as the type.
        hdf5::h5check(unsafe { H5Aread(attribute.id(), kind.id(), bytes.as_mut_ptr().cast()) })
    })?;
    while bytes.last() == Some(&0) {
        bytes.pop();
    }
    String::from_utf8(bytes).map_err(|reason| reason.to_string().into())
}

/// Turns this rank's HDF5 outcome into the outcome of all ranks.
fn accept<T>(
    comm: &SimpleCommunicator,
    outcome: hdf5::Result<T>,
    describe: impl Fn(&hdf5::Error) -> Error,
) -> Result<T> {
    let (value, mine) = match outcome {
        Ok(value) => (Some(value), Ok(())),
        Err(reason) => (None, Err(describe(&reason))),
    };
    all_agree(comm, mine)?;
    Ok(value.expect("all ranks agreed that there is a value"))
}

fn write_failed(path: &Path, name: &str, reason: &hdf5::Error) -> Error {
    let space = if name.is_empty() { "" } else { " in " };
    Error::File(format!("cannot write {name}{space}{}: {reason}", path.display()))
}

fn read_failed(path: &Path, name: &str, reason: &hdf5::Error) -> Error {
    Error::File(format!("cannot read {name} in {}: {reason}", path.display()))
}
