//! HDF5 files that all ranks read: the thin safe wall around its calls.
//!
//! A dataset is a table of rows; every rank takes the rows it wants in calls that all ranks make. A fault of one
//! rank is an error on all of them. Each opens the file for itself, so that a serial HDF5 serves as well
//! as a parallel one.

use std::fs;
use std::path::{Path, PathBuf};
use std::ptr::null;

use hdf5::H5Type;
use hdf5_sys::h5::hsize_t;
use hdf5_sys::h5d::H5Dread;
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5p::H5P_DEFAULT;
use hdf5_sys::h5s::{
    H5S_seloper_t, H5Sclose, H5Screate_simple, H5Sselect_hyperslab, H5Sselect_none,
};
use mpi::topology::SimpleCommunicator;

use crate::error::{Error, Result};
use crate::output::agreement::{all_agree, on_root};
use crate::output::whole_file::cannot_read;

/// A file that all ranks of `comm` read.
pub struct FileReader<'c> {
    file: hdf5::File,
    path: PathBuf,
    comm: &'c SimpleCommunicator,
}

impl<'c> FileReader<'c> {
    /// Opens an existing file for reading.
    pub fn open(path: &Path, comm: &'c SimpleCommunicator) -> Result<Self> {
        on_root(comm, || {
            fs::File::open(path).map(drop).map_err(|reason| cannot_read(path, &reason))
        })?;
        let file = hdf5::File::open(path);
        let this = |file| Self { file, path: path.to_path_buf(), comm };
        accept(comm, file, |reason| {
            Error::File(format!("{} is not a readable HDF5 file: {reason}", path.display()))
        })
        .map(this)
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
            slab.transfer(&dataset, |memory, file| {
                // SAFETY: the dataset and both dataspaces are open; `values` has room for the
                // rows * columns elements of type T that the memory space selects, and HDF5 converts
                // to T or fails.
                unsafe { H5Dread(dataset.id(), kind.id(), memory, file, H5P_DEFAULT, values) }
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

    pub fn read_number<T: H5Type>(&self, name: &str) -> Result<T> {
        let outcome =
            self.file.attr(name).and_then(|attribute| attribute.as_reader().read_scalar());
        accept(self.comm, outcome, |reason| read_failed(&self.path, name, reason))
    }

    pub fn has(&self, name: &str) -> bool {
        self.file.link_exists(name)
    }

    fn dataset(&self, name: &str) -> Result<hdf5::Dataset> {
        let dataset = self.file.dataset(name);
        accept(self.comm, dataset, |reason| read_failed(&self.path, name, reason))
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
    /// Calls `transfer(memory space, file space)`.
    fn transfer(
        &self,
        dataset: &hdf5::Dataset,
        transfer: impl FnOnce(hid_t, hid_t) -> i32,
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
                hdf5::h5check(transfer(memory.id, space.id()))?;
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

fn read_failed(path: &Path, name: &str, reason: &hdf5::Error) -> Error {
    Error::File(format!("cannot read {name} in {}: {reason}", path.display()))
}
