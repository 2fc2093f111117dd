//! Distributed material point method: from the papers to the modules.
//!
//! Data enters as a deck, becomes a problem, is dealt out to ranks, and goes round the six steps
//! of the method (Ghost Figure 1) until it leaves as files. Imports point down this table only.
//!
//! | step or section | module |
//! |---|---|
//! | command line, exit codes | [`cli`], [`error`] |
//! | `input.toml` | [`deck`] |
//! | load steps, time steps (Ghost §2.3, 2.4; Lagrangian §6.3, 6.5) | [`analysis`] |
//! | results | [`output`] |
//! | (d) multigrid's levels | [`multigrid`] |
//! | (b, c) points to grid, system of equations (Lagrangian eq. 27-29) | [`assembly`] |
//! | Ghost faces and their matrix (Ghost §3, §4) | [`ghost`] |
//! | who owns what, migration | [`parallel`] |
//! | strains, stress measures and tangents in three frames (Lagrangian §3-5, App. A) | [`mechanics`] |
//! | constitutive models | [`material`] |
//! | (a) basis functions, domain updates (Lagrangian §6.1, 6.4; Rotation §2) | [`basis`] |
//! | material points | [`points`] |
//! | background lattice or mesh | [`grid`] |
//! | (d) solvers | [`petsc`] |
//! | small tensors | [`tensor`] |

pub mod analysis;
pub mod assembly;
pub mod basis;
pub mod cli;
pub mod deck;
pub mod error;
pub mod ghost;
pub mod grid;
pub mod material;
pub mod mechanics;
pub mod multigrid;
pub mod output;
pub mod parallel;
pub mod petsc;
pub mod points;
pub mod tensor;
