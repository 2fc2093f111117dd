//! Tables and keys of the resolved deck.

use crate::deck::model::Deck;
use crate::deck::schema;
use crate::deck::unread::is_read;

/// The text so far.
pub(super) struct Writer<'a> {
    pub deck: &'a Deck,
    pub text: String,
}

impl Writer<'_> {
    pub fn table(&mut self, header: &str) {
        self.text.push_str(&format!("\n{header}\n"));
    }

    /// One key of a section of the schema, with its unit, if the deck's choices read it.
    pub fn line(&mut self, section: &str, key: &str, value: String) {
        let known = schema::section(section).key(key);
        if known.is_some_and(|known| !is_read(self.deck, known)) {
            return;
        }
        let unit = known.map_or("", |known| known.unit);
        let unit = if unit.is_empty() { String::new() } else { format!("  # {unit}") };
        self.text.push_str(&format!("{key} = {value}{unit}\n"));
    }

    pub fn optional(&mut self, section: &str, key: &str, value: Option<String>) {
        if let Some(value) = value {
            self.line(section, key, value);
        }
    }
}
