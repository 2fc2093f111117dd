//! The results directory: every file a run leaves behind, and what the terminal says.
//!
//! | file or folder | idea |
//! |---|---|
//! | `directory.rs` | the directory itself, deck copies |
//! | `series/` | fields over time: HDF5 and XDMF |
//! | `tables/` | `history.csv`, `residuals.csv` |
//! | `restart/` | checkpoints, one run at a time |
//! | `plot/` | pictures of points and tables |
//! | `report/` | `report.html` |
//! | `terminal/` | what the terminal and `log.txt` say |
//! | `summary.rs`, `extent.rs` | `summary.json` |
//! | `start.rs` | what writing asks of the process before MPI starts |
//! | `agreement.rs` | one rank acts, all ranks get its outcome |
//! | `whole_file.rs` | files that are whole or absent |
//! | `names.rs` | the names of all files in a results directory |
//! | `ownership.rs` | which of them a run is proven to have written |
//!
//! Functions that take a communicator are collective: every rank calls them and every rank gets
//! the same outcome, also when only one of them met the error.

pub(crate) mod agreement;
pub(crate) mod directory;
pub(crate) mod extent;
pub(crate) mod names;
pub(crate) mod ownership;
pub(crate) mod plot;
pub(crate) mod report;
pub mod restart;
pub(crate) mod series;
pub(crate) mod start;
pub(crate) mod summary;
pub(crate) mod tables;
pub(crate) mod terminal;
pub(crate) mod warnings;
pub(crate) mod whole_file;

#[cfg(test)]
mod tests;
