//! Distributed material point method: from the papers to the modules.
//!
//! Data enters as a deck, becomes a problem, is dealt out to ranks, and goes round the six steps
//! of the method (Ghost Figure 1) until it leaves as files. Imports point down this table only.
//!
//! | step or section | module |
//! |---|---|
//! | command line, exit codes | [`cli`], [`error`] |
//! | a run from command line to exit code | [`run`] |
//! | the algorithms: load steps, time steps, Newton's method (Ghost §2.3, 2.4; Lagrangian §6.3, 6.5) | [`analysis`] |
//! | records of a run: history, frames, checkpoints | [`record`] |
//! | results on disk and on the terminal | [`output`] |
//! | mass of the nodes and its solve (Ghost eq. 7, 15, 24) | [`mass`] |
//! | points to nodes and back (Ghost eq. 6, 8-10; Lagrangian eq. 31-39) | [`transfer`] |
//! | (d) multigrid's levels | [`amg`] |
//! | a step's equations and their terms (Lagrangian eq. 27-29) | [`system`] |
//! | external forces | [`loads`] |
//! | surfaces of bodies and the points that carry them | [`surface`] |
//! | rigid surfaces, gaps, friction | [`contact`] |
//! | Ghost faces and their matrix (Ghost §3, §4) | [`ghost`] |
//! | who owns what, migration | [`parallel`] |
//! | strains, stress measures and tangents in three frames (Lagrangian §3-5, App. A) | [`mechanics`] |
//! | constitutive models | [`material`] |
//! | (a) basis functions, domain updates (Lagrangian §6.1, 6.4; Rotation §2) | [`basis`] |
//! | material points | [`points`] |
//! | background lattice or mesh | [`grid`] |
//! | (d) products by blocks | [`blocks`] |
//! | (d) solvers | [`petsc`] |
//! | small tensors | [`tensor`] |
//! | `input.toml` | [`deck`] |
//! | files that a user names, opened with care | [`input_file`] |

#![deny(missing_docs)]

pub mod amg;
pub mod analysis;
pub mod basis;
pub mod blocks;
pub(crate) mod cli;
pub(crate) mod contact;
pub mod deck;
pub mod error;
pub(crate) mod ghost;
pub mod grid;
pub(crate) mod input_file;
pub mod loads;
pub(crate) mod mass;
pub mod material;
pub mod mechanics;
pub mod output;
pub mod parallel;
pub mod petsc;
pub mod points;
pub(crate) mod record;
pub mod run;
pub(crate) mod surface;
pub mod system;
pub(crate) mod tensor;
pub mod transfer;
