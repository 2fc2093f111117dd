//! The results directory: every file a run leaves behind, and what the terminal says.
//!
//! | file on disk | type | file |
//! |---|---|---|
//! | the directory itself, deck copies | [`ResultsDirectory`] | `directory.rs` |
//! | `points-*.h5`, `points.xdmf`, `domains.xdmf` | [`PointsSeries`] | `points_file.rs`, `domains.rs` |
//! | `grid-*.h5`, `grid.xdmf` | [`GridSeries`] | `grid_file.rs` |
//! | `history.csv` | [`History`] | `history.rs` |
//! | `residuals.csv` | [`Residuals`] | `residuals.rs` |
//! | `summary.json` | [`Summary`] | `summary.rs`, `extent.rs` |
//! | `log.txt` | [`Log`] | `log.rs` |
//! | `checkpoint-*.h5` | [`checkpoint::Checkpoint`] | `checkpoint.rs`, `run_state.rs`, `seal.rs` |
//!
//! | idea | file |
//! |---|---|
//! | the names and formulas of the point fields | `point_field.rs` |
//! | HDF5 files written, and read, by all ranks | `hdf5_writer.rs`, `hdf5_reader.rs` |
//! | what writing asks of the process before MPI starts | `start.rs` |
//! | one run at a time in a directory | `run_lock.rs` |
//! | XDMF time series | `xdmf.rs` |
//! | text of the banner, the plan, the steps, the closing table, a failure | `report.rs`, `progress.rs` |
//! | one rank acts, every rank learns the outcome | `agreement.rs` |
//! | tables that grow row by row | `csv_table.rs` |
//! | files that are whole or absent | `whole_file.rs` |
//!
//! Functions that take a communicator are collective: every rank calls them and every rank gets
//! the same outcome, also when only one of them met the error.

pub mod agreement;
pub mod checkpoint;
pub mod csv_table;
pub mod directory;
pub mod domains;
pub mod extent;
pub mod grid_file;
pub mod hdf5_reader;
pub mod hdf5_writer;
pub mod history;
pub mod log;
pub mod point_field;
pub mod points_file;
pub mod progress;
pub mod report;
pub mod residuals;
pub mod run_lock;
pub mod run_state;
pub mod seal;
pub mod start;
pub mod summary;
pub mod whole_file;
pub mod xdmf;

#[cfg(test)]
mod tests;

pub use directory::ResultsDirectory;
pub use grid_file::{GridFrame, GridSeries};
pub use hdf5_reader::FileReader;
pub use hdf5_writer::FileWriter;
pub use history::{Column, History};
pub use log::Log;
pub use point_field::{PointField, Quantity};
pub use points_file::PointsSeries;
pub use progress::Progress;
pub use residuals::Residuals;
pub use run_lock::RunLock;
pub use run_state::RunState;
pub use summary::Summary;
