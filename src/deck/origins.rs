//! Line and column of each key of a deck, for messages about faults that show after reading.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::marks::Sources;
use super::tree::{Node, Origin, Value};

/// Where the keys are written, by their dotted paths; the text itself is kept once.
#[derive(Debug, Clone, Default)]
pub struct Origins {
    sources: Arc<Sources>,
    of_key: BTreeMap<String, Origin>,
}

/// The same deck may be written in many ways.
impl PartialEq for Origins {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Origins {
    /// Of all keys below `root`.
    pub(crate) fn of(root: &Node, sources: &Arc<Sources>) -> Self {
        let mut all = Origins { sources: sources.clone(), of_key: BTreeMap::new() };
        all.enter(root, "");
        all
    }

    fn enter(&mut self, node: &Node, path: &str) {
        let below = |key: &str| match path {
            "" => key.to_string(),
            _ => format!("{path}.{key}"),
        };
        let children: Vec<(String, &Node)> = match &node.value {
            Value::Table(entries) => {
                entries.iter().map(|entry| (below(&entry.key), &entry.node)).collect()
            }
            Value::Array(items) => {
                let table = |(_, item): &(usize, &Node)| matches!(item.value, Value::Table(_));
                let tables = items.iter().enumerate().filter(table);
                tables.map(|(index, item)| (below(&index.to_string()), item)).collect()
            }
            _ => Vec::new(),
        };
        for (path, child) in children {
            self.enter(child, &path);
            self.of_key.insert(path, child.origin.clone());
        }
    }

    /// A message about the dotted `key` with where it is written: the table around it where the
    /// deck does not write the key itself.
    pub fn message(&self, key: &str, message: &str) -> String {
        let mut written = key;
        loop {
            match (self.of_key.get(written), written.rfind('.')) {
                (Some(origin), _) => {
                    let (place, lines) = self.sources.mark(origin);
                    return format!("{place}: {key}: {message}{lines}");
                }
                (None, Some(end)) => written = &written[..end],
                (None, None) => return format!("{}: {key}: {message}", self.sources.file),
            }
        }
    }
}
