//! Tables inside tables.

use super::Table;
use crate::deck::problems::Got;
use crate::deck::schema::{self, Kind, Need};
use crate::deck::tree::{Entry, Node, Value};

impl Table<'_> {
    /// Runs `read` on a sub-table; `None` if it is absent (and required keys are reported).
    pub fn table_if<T>(
        &self,
        name: &str,
        read: impl FnOnce(Table<'_>) -> Got<T>,
    ) -> Got<Option<T>> {
        let key = self.key(name);
        let (Kind::Table(section), path) = (key.kind, self.full(name)) else {
            unreachable!("only keys of kind table are opened as tables")
        };
        match self.node(name) {
            Some(node) => {
                let table = Table::open(self.problems, schema::section(section), &path, node)?;
                read(table).map(Some)
            }
            None if key.need == Need::Required => Err(self.missing(name, "")),
            None => Ok(None),
        }
    }

    /// As [`Table::table_if`] for tables that are needed here.
    pub fn table<T>(&self, name: &str, read: impl FnOnce(Table<'_>) -> Got<T>) -> Got<T> {
        self.present(name, self.table_if(name, read))
    }

    /// Runs `read` on a sub-table, on an empty one if it is absent.
    pub fn table_or_default<T>(
        &self,
        name: &str,
        read: impl FnOnce(Table<'_>) -> Got<T>,
    ) -> Got<T> {
        if self.given(name) {
            return self.table(name, read);
        }
        let Kind::Table(section) = self.key(name).kind else {
            unreachable!("only keys of kind table are opened as tables")
        };
        let path = self.full(name);
        read(Table::absent(self.problems, schema::section(section), &path))
    }

    /// Runs `read` on each table of an array of tables; all are read before a problem returns.
    pub fn tables<T>(
        &self,
        name: &str,
        mut read: impl FnMut(usize, Table<'_>) -> Got<T>,
    ) -> Got<Vec<T>> {
        let key = self.key(name);
        let Kind::Tables(section) = key.kind else {
            unreachable!("only keys of kind tables are opened as arrays of tables")
        };
        let Some(node) = self.node(name) else { return Ok(Vec::new()) };
        let Value::Array(items) = &node.value else {
            if let Value::Table(_) = node.value {
                let full = self.full(name);
                let message = format!("expected an array of tables, found a single table [{full}]");
                let help = format!("write [[{full}]], in double brackets, once for each of them");
                return Err(self.problem_with_help(name, message, help));
            }
            return Err(self.mismatch(key, node));
        };
        let all: Vec<Got<T>> = items
            .iter()
            .enumerate()
            .map(|(index, item)| {
                let path = format!("{}.{index}", self.full(name));
                read(index, Table::open(self.problems, schema::section(section), &path, item)?)
            })
            .collect();
        all.into_iter().collect()
    }

    /// `of` each table of an array of tables, as written and whether or not it is right; nothing of another value.
    fn in_each<T>(&self, tables: &str, of: impl Fn(&[Entry]) -> T) -> Vec<T> {
        let Some(Value::Array(items)) = self.node(tables).map(|node| &node.value) else {
            return Vec::new();
        };
        let entries = |item: &Node| match &item.value {
            Value::Table(entries) => of(entries),
            _ => of(&[]),
        };
        items.iter().map(entries).collect()
    }

    /// Whether each table of an array of tables gives the key.
    pub fn given_in_each(&self, tables: &str, key: &str) -> Vec<bool> {
        self.in_each(tables, |entries| entries.iter().any(|entry| entry.key == key))
    }

    /// Names of an array of tables, so that other sections can refer to faulty ones; those without one are numbered.
    pub fn names_of(&self, tables: &str) -> Vec<String> {
        let given = self.in_each(tables, |entries| {
            let name = entries.iter().find(|entry| entry.key == "name")?;
            match &name.node.value {
                Value::String(name) => Some(name.clone()),
                _ => None,
            }
        });
        let named = given.into_iter().enumerate();
        named.map(|(k, name)| name.unwrap_or_else(|| format!("{tables}-{}", k + 1))).collect()
    }

    /// Runs `read` on each named table below a key.
    pub fn named<T>(
        &self,
        name: &str,
        mut read: impl FnMut(&str, Table<'_>) -> Got<T>,
    ) -> Got<Vec<T>> {
        let key = self.key(name);
        let Kind::Named(section) = key.kind else {
            unreachable!("only keys of kind named are opened as named tables")
        };
        let Some(node) = self.node(name) else { return Ok(Vec::new()) };
        let Value::Table(entries) = &node.value else {
            let full = self.full(name);
            let message = format!("expected {}, found {}", key.kind.describe(), node.describe());
            let help = format!("write [{full}.NAME], in single brackets, with a name of your own");
            return Err(self.problem_with_help(name, message, help));
        };
        let all: Vec<Got<T>> = entries
            .iter()
            .map(|entry| {
                let path = format!("{}.{}", self.full(name), entry.key);
                let section = schema::section(section);
                read(&entry.key, Table::open(self.problems, section, &path, &entry.node)?)
            })
            .collect();
        all.into_iter().collect()
    }
}
