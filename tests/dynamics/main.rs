//! The dynamic cases of the Ghost paper, and what must hold of any dynamic run: each test runs
//! decks of `inputs/` through the program. The longer ones are run by `make validate`, which
//! also writes `docs/validation-dynamics.md`.

#[path = "../common/mod.rs"]
mod common;

mod conditioning;
mod conservation;
mod faults;
mod ghosts;
mod implicit;
mod ranks;
mod stretch;
mod validation;
