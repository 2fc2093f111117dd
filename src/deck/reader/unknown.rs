//! What to say of a key that a table does not know: the name here, or where it belongs.
//!
//! A hint that points to a key which the choices of the deck leave unread costs more than none: the names
//! offered are those that the table's own model, or kind of analysis, reads.

use super::Table;
use crate::deck::problems::nearest;
use crate::deck::schema::{self, materials};
use crate::deck::synonyms::{self, Meant};
use crate::deck::tree::{Entry, Value};

impl Table<'_> {
    pub(super) fn unknown_key(&self, entry: &Entry) {
        let known: Vec<&str> = self.section.keys.iter().map(|key| key.name).collect();
        let mut help: Vec<String> = self.hint(&entry.key).into_iter().collect();
        help.push(format!("known keys of {}: {}", self.section.header, known.join(", ")));
        let message = format!("unknown key \"{}\"", entry.key);
        self.problems.report(&entry.origin, &self.full(&entry.key), message, help.join("\n"));
    }

    fn hint(&self, name: &str) -> Option<String> {
        let known = self.section.keys.iter().map(|key| key.name);
        let read: Vec<&str> = known.filter(|key| self.may_read(key)).collect();
        match synonyms::meant(self.section.name, name, &read, self.is_static()) {
            Meant::Hint(text) => return Some(text.to_string()),
            Meant::Unsaid => return None,
            Meant::Otherwise => {}
        }
        if let Some(meant) = synonyms::key(name, read.iter().copied()) {
            return Some(format!("here it is called \"{meant}\""));
        }
        if let Some(near) = nearest(name, read.iter().copied()) {
            return Some(format!("did you mean \"{near}\"?"));
        }
        if let Some(other) = schema::sections().find(|other| other.key(name).is_some()) {
            return Some(format!("\"{name}\" belongs to {}", other.header));
        }
        // The words of a material have other meanings elsewhere: friction of a contact is no angle.
        let of_material = is_of_material(self.section.name);
        let serves = |other: &str| match of_material {
            true => matches!(other, "body" | "load"),
            false => other != self.section.name,
        };
        let elsewhere: Vec<_> = schema::sections().filter(|other| serves(other.name)).collect();
        let keys = elsewhere.iter().flat_map(|other| other.keys).map(|key| key.name);
        let meant = synonyms::key(name, keys)?;
        let of = elsewhere.iter().find(|other| other.key(meant).is_some())?;
        Some(format!("here it is called \"{meant}\" and belongs to {}", of.header))
    }

    /// Whether the table's own choice of a model or an analysis reads a key; yes where none is made.
    fn may_read(&self, key: &str) -> bool {
        match self.section.name {
            "material" => {
                let model =
                    self.word_at("model").filter(|model| materials::models().contains(model));
                key == "model" || model.is_none_or(|model| materials::readers(key).contains(&model))
            }
            "analysis" => match self.word_at("type") {
                Some("explicit") | None => true,
                Some("implicit-dynamic") => key != "cfl",
                Some(_) => !matches!(key, "duration" | "cfl"),
            },
            _ => true,
        }
    }

    /// Whether this is an analysis of load steps.
    fn is_static(&self) -> bool {
        let kind = self.word_at("type");
        self.section.name == "analysis"
            && matches!(kind, Some("quasi-static" | "strength-reduction"))
    }

    /// The word that the table gives to one of its keys.
    fn word_at(&self, key: &str) -> Option<&str> {
        match &self.node(key)?.value {
            Value::String(word) => Some(word),
            _ => None,
        }
    }
}

fn is_of_material(section: &str) -> bool {
    section == "material" || section.starts_with("material.")
}
