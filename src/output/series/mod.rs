//! Fields over time, for ParaView and Python: HDF5 data and the XDMF that describes them.
//!
//! | file on disk | what it shows |
//! |---|---|
//! | `points-*`, `domains-*` | `points_file.rs`, `point_field.rs`, `domains.rs` |
//! | `grid-*` | `grid_file.rs` |
//! | `rigid-*` | `rigid_file.rs` |
//!
//! Each of them makes a [`frame::Frame`], which a [`frame_series::Series`] writes in the formats of the deck:
//!
//! | file on disk | file |
//! |---|---|
//! | `*.h5`, and its VTKHDF group | `hdf5_writer.rs`, `vtkhdf.rs` |
//! | `*.vtu` | `vtu.rs` |
//! | `*.xdmf`, `*.pvd`, `*.vtkhdf.series` | `frame_list.rs`, `xdmf.rs`, `growing_file.rs` |
//!
//! `hdf5_reader.rs` reads HDF5 files on all ranks, `frames.rs` the frames of a run by one process.

pub(crate) mod domains;
pub(crate) mod frame;
pub(crate) mod frame_list;
pub(crate) mod frame_series;
pub(crate) mod frames;
pub(crate) mod grid_file;
pub(crate) mod growing_file;
pub(crate) mod hdf5_reader;
pub(crate) mod hdf5_writer;
pub(crate) mod point_field;
pub(crate) mod points_file;
pub(crate) mod rigid_file;
pub(crate) mod vtkhdf;
pub(crate) mod vtu;
pub(crate) mod xdmf;
