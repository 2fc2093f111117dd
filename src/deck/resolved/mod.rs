//! The deck with every default, as TOML that reads back to the same deck.
//!
//! | sections | file |
//! |---|---|
//! | `analysis`, `method`, `ghost`, `stage`, `grid`, `element_test` | `problem.rs` |
//! | `material`, `body` | `bodies.rs` |
//! | `boundary`, `water`, `load` | `conditions.rs` |
//! | `rigid`, `contact` | `contact.rs` |
//! | `verify`, `probe`, `output`, `parallel`, `petsc` | `results.rs` |
//! | (tables and keys) | `writer.rs` |
//! | (values) | `toml_text.rs` |

mod bodies;
mod conditions;
mod contact;
mod problem;
mod results;
pub mod toml_text;
mod writer;

use super::model::Deck;
use toml_text::quote;
use writer::Writer;

/// TOML of `deck` with all defaults. Relative paths have become absolute ones.
pub fn resolved(deck: &Deck) -> String {
    let mut w = Writer { deck, text: String::new() };
    w.line("", "title", quote(&deck.title));
    // A key of the top level stands before the first table.
    if deck.ghost.is_none() {
        w.line("", "ghost", quote("off"));
    }
    problem::analysis(&mut w, deck);
    if deck.element_test.is_none() {
        problem::stages(&mut w, deck);
        problem::grid(&mut w, deck);
    }
    bodies::materials_and_bodies(&mut w, deck);
    if let Some(test) = &deck.element_test {
        problem::element_test(&mut w, deck, test);
        return w.text;
    }
    conditions::conditions(&mut w, deck);
    contact::contact(&mut w, deck);
    results::results(&mut w, deck);
    w.text
}
