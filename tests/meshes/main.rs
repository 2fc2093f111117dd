//! Meshes that move, CPDI and manufactured solutions: what the Rotation paper and the CPDI and
//! mesh parts of the Lagrangian paper show, by decks of `inputs/` run through the program.
//! docs/evidence/validation-meshes.md tells the numbers; the longer tests are run by `make validate`.

#[path = "../common/mod.rs"]
mod common;

mod axisymmetric;
mod cpdi;
mod doughnut;
mod faults;
mod ghost;
mod irregular;
mod manufactured;
mod ranks;
mod stretch;
mod unstructured;
