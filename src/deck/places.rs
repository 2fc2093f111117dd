//! Where each key of a deck is written, for faults that only a later stage can see.

use std::collections::BTreeMap;

use super::tree::{Node, Origin, Value};

/// What a message about a key begins and ends with, by the key's dotted path.
#[derive(Debug, Clone, Default)]
pub struct Places {
    file: String,
    marks: BTreeMap<String, (String, String)>,
}

/// The same deck may be written in many ways.
impl PartialEq for Places {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Places {
    /// Of all keys below `root`; `mark` tells the begin and the end of a message.
    pub(crate) fn of(root: &Node, mark: impl Fn(&Origin) -> (String, String)) -> Self {
        let mut places = Places { file: mark(&Origin::Nowhere).0, marks: BTreeMap::new() };
        places.enter(root, "", &mark);
        places
    }

    fn enter(&mut self, node: &Node, path: &str, mark: &impl Fn(&Origin) -> (String, String)) {
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
            self.marks.insert(path.clone(), mark(&child.origin));
            self.enter(child, &path, mark);
        }
    }

    /// A message about the dotted `key` with its place: that of the table around it where the
    /// deck does not write the key itself.
    pub fn say(&self, key: &str, message: &str) -> String {
        let mut written = key;
        loop {
            match (self.marks.get(written), written.rfind('.')) {
                (Some((place, lines)), _) => return format!("{place}: {key}: {message}{lines}"),
                (None, Some(end)) => written = &written[..end],
                (None, None) => return format!("{}: {key}: {message}", self.file),
            }
        }
    }
}
