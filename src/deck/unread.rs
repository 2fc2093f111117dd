//! Keys that the deck's choices leave unread: refused, each with the choice that would read it.
//!
//! The schema's rows say which choices read a key ([`schema::Reader`]); this walks the deck by the
//! schema, so that a new row needs no line here. A key of the file that an option `--set` leaves
//! unread is set aside with a note: a deck may be tried with another choice without being edited.

use std::collections::BTreeMap;

use super::model::Deck;
use super::problems::Problems;
use super::schema::{self, Key, Kind, Need, Reader, Section};
use super::tree::{self, Entry, Node, Origin, Value};

/// Reports the keys of no effect below `root`, or takes them out; the notes say which were.
pub fn check(problems: &Problems, root: &mut Node) -> Vec<String> {
    let mut choices = BTreeMap::new();
    for section in schema::sections() {
        for reader in section.keys.iter().flat_map(|key| key.readers) {
            if let Some(choice) = made(root, reader.choice) {
                choices.insert(reader.choice, choice);
            }
        }
    }
    let mut walk = Walk { problems, choices, notes: Vec::new() };
    walk.table(root, schema::section(""), "");
    walk.notes
}

/// Whether an analysis reads a key.
pub fn is_read(deck: &Deck, key: &Key) -> bool {
    key.readers.iter().all(|reader| match word(deck, reader.choice) {
        Some(word) => reader.values.contains(&word),
        None => true,
    })
}

/// The word of a choice of a checked deck, of those that keys of any section depend on.
fn word(deck: &Deck, choice: &str) -> Option<&'static str> {
    Some(match choice {
        "analysis.type" => deck.analysis.kind.name(),
        "analysis.on_failure" => deck.analysis.on_failure.name(),
        "method.basis" => deck.method.basis.name(),
        "method.mass" => deck.method.mass.name(),
        "method.velocity_update" => match (deck.method.xpic, deck.method.affine) {
            (Some(_), _) => "xpic",
            (None, Some(affine)) => affine.name(),
            (None, None) => "flip",
        },
        "grid.type" => match deck.grid {
            super::model::Grid::Lattice(_) => "lattice",
            super::model::Grid::Mesh(_) => "mesh",
        },
        _ => return None,
    })
}

/// The value of a choice, as written or by default, and where it is written.
type Made = (String, Origin);

/// The choice at a dotted path; `None` if it is missing or no word.
fn made(root: &Node, path: &str) -> Option<Made> {
    let (section, name) = path.split_once('.')?;
    let key = schema::section(section).key(name)?;
    let table = entry(root, section).map(|entry| &entry.node);
    if let Some(found) = table.and_then(|table| entry(table, name)) {
        let value = match &found.node.value {
            Value::String(word) => word.clone(),
            _ => found.node.describe(),
        };
        if let Kind::Choice(words) = key.kind
            && !words.contains(&value.as_str())
        {
            return None;
        }
        return Some((value, found.node.origin.clone()));
    }
    let Need::Default(text) = key.need else { return None };
    match tree::parse_value(text, &Origin::Nowhere).ok()?.value {
        Value::String(word) => Some((word, Origin::Nowhere)),
        _ => None,
    }
}

fn entry<'n>(table: &'n Node, name: &str) -> Option<&'n Entry> {
    let Value::Table(entries) = &table.value else { return None };
    entries.iter().find(|entry| entry.key == name)
}

struct Walk<'a> {
    problems: &'a Problems,
    choices: BTreeMap<&'static str, Made>,
    notes: Vec<String>,
}

impl Walk<'_> {
    fn table(&mut self, node: &mut Node, section: &'static Section, path: &str) {
        let Value::Table(entries) = &mut node.value else { return };
        entries.retain_mut(|entry| {
            let Some(key) = section.key(&entry.key) else { return true };
            let full = match path {
                "" => entry.key.clone(),
                _ => format!("{path}.{}", entry.key),
            };
            if let Some((reader, choice)) = self.unread(key) {
                return self.refuse(&full, entry, reader, choice);
            }
            match (key.kind, &mut entry.node.value) {
                (Kind::Table(name), _) => {
                    let before = self.notes.len();
                    self.table(&mut entry.node, schema::section(name), &full);
                    // A table of which nothing is left was not meant for this choice either.
                    let empty = matches!(&entry.node.value, Value::Table(rest) if rest.is_empty());
                    return !empty || self.notes.len() == before;
                }
                (Kind::Tables(name), Value::Array(items)) => {
                    for (index, item) in items.iter_mut().enumerate() {
                        self.table(item, schema::section(name), &format!("{full}.{index}"));
                    }
                }
                (Kind::Named(name), Value::Table(named)) => {
                    for one in named {
                        let path = format!("{full}.{}", one.key);
                        self.table(&mut one.node, schema::section(name), &path);
                    }
                }
                _ => {}
            }
            true
        });
    }

    /// The first choice that leaves a key unread.
    fn unread(&self, key: &Key) -> Option<(&'static Reader, Made)> {
        let other = |reader: &'static Reader| {
            let made = self.choices.get(reader.choice)?;
            (!reader.values.contains(&made.0.as_str())).then(|| (reader, made.clone()))
        };
        key.readers.iter().find_map(other)
    }

    /// Whether the key stays: it does where it is refused.
    fn refuse(&mut self, full: &str, entry: &Entry, reader: &Reader, (value, from): Made) -> bool {
        let choice = reader.choice;
        if matches!((&entry.node.origin, &from), (Origin::Text(_), Origin::Set(_))) {
            self.notes.push(format!(
                "note: {full} of the deck has no effect with --set {choice}={value} and is set aside"
            ));
            return false;
        }
        let values: Vec<String> =
            reader.values.iter().map(|value| format!("\"{value}\"")).collect();
        let message = format!(
            "has no effect: only {choice} = {} reads it, found \"{value}\"",
            values.join(" or ")
        );
        let help = format!("leave it out (from the command line: --set {full}=)");
        self.problems.report(&entry.node.origin, full, message, help);
        true
    }
}
