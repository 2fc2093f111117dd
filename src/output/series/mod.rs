//! Fields over time, for ParaView and Python: HDF5 data and the XDMF that describes them.
//!
//! | file on disk | file |
//! |---|---|
//! | `points-*.h5`, `points.xdmf` | `points_file.rs`, `point_field.rs` |
//! | `domains.xdmf` | `domains.rs` |
//! | `grid-*.h5`, `grid.xdmf` | `grid_file.rs` |
//! | `*.vtu`, VTKHDF groups, `*.pvd`, `*.vtkhdf.series` | `vtu.rs`, `vtkhdf.rs`, `frame_list.rs` |
//! | frames read by one process | `frames.rs` |
//! | `rigid-*.h5`, `rigid.xdmf` | `rigid_file.rs` |
//! | HDF5 files written, and read, by all ranks | `hdf5_writer.rs`, `hdf5_reader.rs` |
//! | XDMF time series | `xdmf.rs`, `growing_file.rs` |

pub(crate) mod domains;
pub(crate) mod frame_list;
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
