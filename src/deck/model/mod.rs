//! The deck as typed data: what every other module reads. Units are SI unless said otherwise.
//!
//! Vectors that follow the problem's dimension are `Vec<f64>` of length `Deck::dimension`,
//! already checked; enums carry the deck's own words in `name()`.
//!
//! | file | tables of the deck |
//! |---|---|
//! | `analysis.rs` | `[analysis]` and `[element_test]` |
//! | `method.rs` | `[method]` and `[ghost]` |
//! | `grid.rs` | `[grid]` |
//! | `bodies.rs` | `[material.NAME]` and `[[body]]` |
//! | `conditions.rs` | `[[boundary]]`: nodes of the grid, and surfaces off it |
//! | `loads.rs` | `[[load]]` and `[water]` |
//! | `contact.rs` | `[[rigid]]` and `[[contact]]` |
//! | `results.rs` | `[[verify]]`, `[[probe]]`, `[output]` and `[parallel]` |

mod analysis;
mod bodies;
mod conditions;
mod contact;
mod grid;
mod loads;
mod method;
mod results;
pub mod stations;

use std::path::PathBuf;

use crate::deck::origins::Origins;
use crate::deck::stage::{Presence, Stage};

pub use analysis::*;
pub use bodies::*;
pub use conditions::*;
pub use contact::*;
pub use grid::*;
pub use loads::*;
pub use method::*;
pub use results::*;

/// A complete, checked input deck.
#[derive(Debug, Clone, PartialEq)]
pub struct Deck {
    pub title: String,
    /// 2 (plane strain) or 3, from the grid.
    pub dimension: usize,
    /// Folder of the deck: relative paths inside it start here.
    pub directory: PathBuf,
    pub analysis: Analysis,
    /// In order, at least one. `analysis.steps` and `analysis.duration` are their sums.
    pub stages: Vec<Stage>,
    pub method: Method,
    /// What is in force; `None`: nothing is stabilised.
    pub ghost: Option<Ghost>,
    pub grid: Grid,
    pub materials: Vec<Material>,
    pub bodies: Vec<Body>,
    pub boundaries: Vec<Boundary>,
    pub loads: Vec<Load>,
    /// When each load acts, in their order.
    pub load_presence: Vec<Presence>,
    /// Terms that tables of their own switch on: `[[foundation]]`.
    pub terms: Vec<crate::system::terms::Declared>,
    pub rigids: Vec<Rigid>,
    pub contacts: Vec<Contact>,
    pub verify: Vec<Verify>,
    pub probes: Vec<Probe>,
    pub output: Output,
    pub parallel: Parallel,
    /// `[conditioning] displacement`, m: total rigid motion over the analysis.
    pub conditioning_displacement: Option<Vec<f64>>,
    /// `[element_test]`; then the deck has no grid and no bodies.
    pub element_test: Option<ElementTest>,
    /// `[petsc]`: option name without its dash, and value ("" for a bare flag).
    pub petsc: Vec<(String, String)>,
    /// What the user should know of the deck itself, a line each.
    pub notes: Vec<String>,
    /// Where the keys are written.
    pub origins: Origins,
}

impl Deck {
    /// Whether the deck names stages.
    pub fn is_staged(&self) -> bool {
        self.stages.iter().any(|stage| !stage.name.is_empty())
    }

    /// `[water]`
    pub fn water(&self) -> Option<Water> {
        self.loads.iter().find_map(|load| match load {
            Load::Water(water) => Some(*water),
            _ => None,
        })
    }

    /// Whether a body comes after the start or goes before the end.
    pub fn has_passing_bodies(&self) -> bool {
        let passes = |body: &Body| {
            body.presence.from.is_some_and(|from| from > 0) || body.presence.until.is_some()
        };
        self.bodies.iter().any(passes)
    }

    /// The files that the deck names: points of bodies, the mesh.
    pub fn files(&self) -> Vec<PathBuf> {
        let points = self.bodies.iter().filter_map(|body| match &body.source {
            BodySource::File(file) => Some(file.path.clone()),
            _ => None,
        });
        let mesh = match &self.grid {
            Grid::Mesh(MeshGrid { source: MeshSource::File(path), .. }) => Some(path.clone()),
            _ => None,
        };
        points.chain(mesh).collect()
    }
}
