//! The dynamic cases of the Ghost paper, and what must hold of any dynamic run: each test runs
//! decks of `inputs/` through the program. The longer ones are run by `make validate`, which
//! also rewrites the tables of `docs/evidence/validation-dynamics.md`.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/program.rs"]
mod program;

mod affine;
mod blocks;
mod conditioning;
mod conservation;
mod driven;
mod energy;
mod faults;
mod figure_14;
mod ghosts;
mod granular;
mod implicit;
mod impulse;
mod iterations;
mod ranks;
mod report;
mod restart;
mod space;
mod stretch;
mod table_3;
mod table_3_masses;
mod table_3_shapes;
