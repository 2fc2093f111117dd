//! `input.toml`: text to a checked [`Deck`].
//!
//! | file | idea |
//! |---|---|
//! | `model/` | the checked deck as typed data |
//! | `stage.rs` | stages, and what is there in which of them |
//! | `choices.rs`, `fields.rs` | the deck's words for enumerations and point fields |
//! | `schema/` | every key once: type, unit, default, range, meaning |
//! | `tree.rs` | TOML to values with their places; `--set` |
//! | `reader.rs`, `problems.rs` | typed access by the schema; messages with file, line, column |
//! | `synonyms.rs`, `slips.rs` | what other programs call things; slips of the pen, and their cure |
//! | `unread.rs` | keys that the deck's choices leave unread |
//! | `marks.rs` | the text of a deck, and how a message points into it |
//! | `origins.rs` | where each key is written, for faults seen later |
//! | `sections/` | each section's values and the checks across sections |
//! | `resolved/` | the deck with every default, as TOML |
//! | `physics.rs` | the part that a continued run must share |
//! | `reference.rs`, `json_schema.rs` | the schema as documentation, and as JSON Schema |
//! | `list.rs`, `explain.rs` | `--list`, `--explain` |
//! | `templates.rs`, `templates/` | `--new`: decks to start from |
//! | `expression/`, `shape.rs` | formulas; regions of space |
//! | `solid/` | regions bounded by triangles: STL files, terrain |
//! | `crossing.rs` | where lines and boxes meet the boundary of a region |

pub(crate) mod choices;
mod crossing;
pub(crate) mod explain;
pub mod expression;
pub(crate) mod fields;
pub mod json_schema;
pub(crate) mod list;
mod marks;
#[allow(
    missing_docs,
    reason = "fields and variants are keys and words of the deck: docs/guide/deck.md"
)]
pub mod model;
mod origins;
pub(crate) mod physics;
mod problems;
mod reader;
pub mod reference;
mod resolved;
pub mod schema;
mod sections;
pub(crate) mod shape;
mod slips;
pub(crate) mod solid;
pub(crate) mod stage;
mod synonyms;
pub mod templates;
mod tree;
mod unread;

use std::path::{Path, PathBuf};

pub use crossing::Side;
pub use expression::{Expression, Scope};
pub use model::Deck;
pub use origins::Origins;
pub use problems::{Got, Reported, figure, nearest, rough};
pub use reader::Table;
pub use resolved::{resolved, toml_text};
pub use sections::conditions::of_body;
pub use sections::petsc::PREFIXES as PETSC_PREFIXES;
pub use sections::shapes::corners;
pub use sections::surfaces::body_surface;
pub use shape::Shape;
pub use slips::of_length;
pub use stage::{Presence, Stage, When};
pub use unread::is_read;

use crate::error::{Error, Result};
use marks::Sources;
use problems::Problems;
use tree::Origin;

/// Reads and checks a deck. `path` names it in messages, and relative paths inside it start at
/// its folder; `sets` are the `KEY=VALUE` of `--set`, applied in order before the checks.
/// Error: up to ten problems, each with its place and what would be right.
///
/// ```
/// use std::path::Path;
///
/// let deck = mpm_par::deck::read(Path::new("deck.toml"), "[analysis]\ntype = \"quasistatic\"", &[]);
/// let problems = deck.expect_err("no such type").to_string();
/// assert!(problems.contains("deck.toml:2") && problems.contains("quasi-static"));
/// ```
pub fn read(path: &Path, text: &str, sets: &[String]) -> Result<Deck> {
    let file = path.display().to_string();
    let sources = Sources { file, text: text.into(), sets: sets.to_vec() };
    let problems = Problems::new(sources);
    let deck = checked(&problems, path, text, sets);
    match (problems.into_error(), deck) {
        (Some(error), _) => Err(error),
        (None, Ok(deck)) => Ok(deck),
        (None, Err(_)) => Err(Error::Input(format!("{}: unreadable deck", path.display()))),
    }
}

fn checked(problems: &Problems, path: &Path, text: &str, sets: &[String]) -> problems::Got<Deck> {
    let mut root = tree::parse_document(text).map_err(|(span, message)| {
        let cure = slips::cure(text, span.as_ref());
        let origin = span.map_or(Origin::Nowhere, Origin::Text);
        problems.report(&origin, "", format!("not valid TOML: {message}"), cure)
    })?;
    for (index, option) in sets.iter().enumerate() {
        tree::apply_set(&mut root, option, index)
            .map_err(|why| problems.report(&Origin::Set(index), "", why, String::new()))?;
    }
    let notes = unread::check(problems, &mut root);
    let mut deck = sections::deck(problems, &root, &directory(path))?;
    deck.notes = notes;
    deck.origins = problems.origins(&root);
    Ok(deck)
}

/// Folder of the deck, absolute so that the resolved deck works from anywhere.
fn directory(path: &Path) -> PathBuf {
    let folder = path.parent().unwrap_or(Path::new(""));
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf())
}
