//! Reads a table of the deck by its section of the schema: known keys, types, ranges, defaults.
//!
//! | file | idea |
//! |---|---|
//! | `mod.rs` | known keys, missing keys, defaults |
//! | `values.rs` | numbers, strings, vectors |
//! | `unknown.rs` | what to say of a key that is not known |
//! | `words.rs` | words out of a list, expressions |
//! | `tables.rs` | tables inside tables |

mod tables;
mod unknown;
mod values;
mod words;

use super::problems::{Got, Problems, Reported};
use super::schema::{Key, Kind, Need, Section, quoted};
use super::tree::{self, Entry, Node, Origin, Value};

/// One table of the deck with its section of the schema.
#[derive(Clone, Copy)]
pub struct Table<'a> {
    problems: &'a Problems,
    section: &'static Section,
    path: &'a str,
    origin: &'a Origin,
    entries: &'a [Entry],
}

const NOWHERE: Origin = Origin::Nowhere;

impl<'a> Table<'a> {
    /// Opens `node` as the section `name`; reports unknown keys. `path` is its dotted path.
    pub fn open(
        problems: &'a Problems,
        section: &'static Section,
        path: &'a str,
        node: &'a Node,
    ) -> Got<Self> {
        let Value::Table(entries) = &node.value else {
            let message = format!("expected a table, found {}", node.describe());
            return Err(problems.report(&node.origin, path, message, String::new()));
        };
        let table = Table { problems, section, path, origin: &node.origin, entries };
        for entry in entries {
            if section.key(&entry.key).is_none() {
                table.unknown_key(entry);
            }
        }
        Ok(table)
    }

    /// The table of an absent section: all defaults.
    pub fn absent(problems: &'a Problems, section: &'static Section, path: &'a str) -> Self {
        Table { problems, section, path, origin: &NOWHERE, entries: &[] }
    }

    /// Dotted path of a key of this table.
    pub fn full(&self, key: &str) -> String {
        match (self.path, key) {
            ("", key) => key.to_string(),
            (path, "") => path.to_string(),
            (path, key) => format!("{path}.{key}"),
        }
    }

    fn key(&self, name: &str) -> &'static Key {
        self.section.key(name).expect("keys are named by constants of the schema")
    }

    /// The node of a key, if the deck has it.
    pub fn node(&self, key: &str) -> Option<&'a Node> {
        self.entries.iter().find(|entry| entry.key == key).map(|entry| &entry.node)
    }

    /// All keys of its section.
    pub fn keys(&self) -> impl Iterator<Item = &'static str> {
        self.section.keys.iter().map(|key| key.name)
    }

    /// Whether the deck gives the key.
    pub fn given(&self, key: &str) -> bool {
        self.node(key).is_some()
    }

    pub(crate) fn problems(&self) -> &'a Problems {
        self.problems
    }

    /// Where the value of a key is written; the table itself if it is not.
    pub fn origin(&self, key: &str) -> &'a Origin {
        self.node(key).map_or(self.origin, |node| &node.origin)
    }

    /// Reports a problem with a key (or with the table, for "").
    pub fn problem(&self, key: &str, message: impl Into<String>) -> Reported {
        self.problem_with_help(key, message, "")
    }

    /// [`Self::problem`] with a line on what would be right.
    pub fn problem_with_help(
        &self,
        key: &str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Reported {
        self.problems.report(self.origin(key), &self.full(key), message.into(), help.into())
    }

    /// Reports a key that is needed and not there.
    pub fn missing(&self, key: &str, when: &str) -> Reported {
        let known = self.key(key);
        let mut message = match known.kind {
            Kind::Table(_) => format!("missing section [{}]", self.full(key)),
            _ => format!("missing {}", known.kind.describe()),
        };
        let range = known.range.describe();
        if !range.is_empty() {
            message = format!("{message} {range}");
        }
        if !when.is_empty() {
            message = format!("{message}; {when}");
        }
        self.problems.report(self.origin, &self.full(key), message, known.doc.to_string())
    }

    /// Reports every given key of `keys`, which does not belong here because of `why`.
    pub fn refuse(&self, keys: &[&str], why: &str) -> Got<()> {
        let mut result = Ok(());
        for key in keys.iter().filter(|key| self.given(key)) {
            result = Err(self.problem(key, why));
        }
        result
    }

    /// The one given key of `keys`; reports none or several.
    pub fn one_of(&self, keys: &[&'static str]) -> Got<&'static str> {
        let given: Vec<&'static str> = keys.iter().copied().filter(|k| self.given(k)).collect();
        match given.as_slice() {
            [key] => Ok(key),
            [] => Err(self.problem("", format!("expected one of {}", quoted(keys)))),
            [_, second, ..] => {
                let others = format!("expected only one of {}", quoted(&given));
                Err(self.problem(second, others))
            }
        }
    }

    fn mismatch(&self, key: &Key, node: &Node) -> Reported {
        let range = key.range.describe();
        let range = if range.is_empty() { range } else { format!(" {range}") };
        let unit = if key.unit.is_empty() { String::new() } else { format!(" ({})", key.unit) };
        let message =
            format!("expected {}{range}{unit}, found {}", key.kind.describe(), node.describe());
        self.problems.report(&node.origin, &self.full(key.name), message, String::new())
    }

    /// Reads a key by `read`, or its default; `None` if it is absent without one.
    fn read<T>(&self, name: &str, read: impl Fn(&Key, &Node) -> Got<T>) -> Got<Option<T>> {
        let key = self.key(name);
        match (self.node(name), key.need) {
            (Some(node), _) => read(key, node).map(Some),
            (None, Need::Default(text)) => {
                let node = tree::parse_value(text, &Origin::Nowhere)
                    .expect("defaults of the schema are TOML");
                read(key, &node).map(Some)
            }
            (None, Need::Required) => Err(self.missing(name, "")),
            (None, Need::Optional(_)) => Ok(None),
        }
    }

    /// The value of a key that is required or has a default.
    fn present<T>(&self, name: &str, value: Got<Option<T>>) -> Got<T> {
        value?.ok_or_else(|| self.missing(name, ""))
    }

    /// Reports that a value is not what the schema says.
    pub fn wrong(&self, name: &str, node: &Node) -> Reported {
        self.mismatch(self.key(name), node)
    }
}
