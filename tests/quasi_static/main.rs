//! The quasi-static cases of the papers, and what must hold of any of them: each test runs decks
//! of `inputs/` through the program. The longer ones are run by `make validate`.

#[path = "../common/mod.rs"]
mod common;

mod beam;
mod collapse;
mod column;
mod default_ghost;
mod element;
mod equality;
mod round_off;
mod shear;
mod snap;
mod solid;
mod solver;
mod supports;
