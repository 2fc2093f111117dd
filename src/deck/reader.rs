//! Reads a table of the deck by its section of the schema: known keys, types, ranges, defaults.

use super::expression::{Expression, Variable};
use super::problems::{Got, Problems, Reported, nearest};
use super::schema::{self, Key, Kind, Need, Range, Section, quoted};
use super::tree::{self, Entry, Node, Origin, Value};
use super::words::Words;

/// One table of the deck with its section of the schema.
#[derive(Clone, Copy)]
pub struct Table<'a> {
    problems: &'a Problems<'a>,
    section: &'static Section,
    path: &'a str,
    origin: &'a Origin,
    entries: &'a [Entry],
}

const NOWHERE: Origin = Origin::Nowhere;

impl<'a> Table<'a> {
    /// Opens `node` as the section `name`; reports unknown keys. `path` is its dotted path.
    pub fn open(
        problems: &'a Problems<'a>,
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
    pub fn absent(problems: &'a Problems<'a>, section: &'static Section, path: &'a str) -> Self {
        Table { problems, section, path, origin: &NOWHERE, entries: &[] }
    }

    fn unknown_key(&self, entry: &Entry) {
        let known: Vec<&str> = self.section.keys.iter().map(|key| key.name).collect();
        let mut help = Vec::new();
        if let Some(near) = nearest(&entry.key, known.iter().copied()) {
            help.push(format!("did you mean \"{near}\"?"));
        } else if let Some(other) = schema::sections().find(|s| s.key(&entry.key).is_some()) {
            help.push(format!("\"{}\" belongs to {}", entry.key, other.header));
        }
        help.push(format!("known keys of {}: {}", self.section.header, known.join(", ")));
        let message = format!("unknown key \"{}\"", entry.key);
        self.problems.report(&entry.origin, &self.full(&entry.key), message, help.join("\n"));
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

    pub fn given(&self, key: &str) -> bool {
        self.node(key).is_some()
    }

    pub fn problems(&self) -> &'a Problems<'a> {
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

    fn number_in(&self, key: &Key, node: &Node) -> Got<f64> {
        match node.number().filter(|v| v.is_finite() && key.range.contains(*v)) {
            Some(value) => Ok(value),
            None => Err(self.mismatch(key, node)),
        }
    }

    fn count_in(&self, key: &Key, node: &Node) -> Got<usize> {
        match node.value {
            Value::Integer(value) if value >= 0 && key.range.contains(value as f64) => {
                usize::try_from(value).map_err(|_| self.mismatch(key, node))
            }
            _ => Err(self.mismatch(key, node)),
        }
    }

    fn text_in(&self, key: &Key, node: &Node) -> Got<String> {
        match &node.value {
            Value::String(text) => Ok(text.clone()),
            _ => Err(self.mismatch(key, node)),
        }
    }

    fn items<'n>(&self, key: &Key, node: &'n Node) -> Got<&'n [Node]> {
        match &node.value {
            Value::Array(items) => Ok(items),
            _ => Err(self.mismatch(key, node)),
        }
    }

    /// `items` that must be one per axis.
    fn per_axis<'n>(&self, key: &Key, node: &'n Node, dimension: usize) -> Got<&'n [Node]> {
        let items = self.items(key, node)?;
        if items.len() == dimension {
            return Ok(items);
        }
        let message = format!(
            "expected {dimension} values, one per axis ({dimension}D, from [grid]), found {}",
            items.len()
        );
        Err(self.problems.report(&node.origin, &self.full(key.name), message, String::new()))
    }

    pub fn number_if(&self, name: &str) -> Got<Option<f64>> {
        self.read(name, |key, node| self.number_in(key, node))
    }

    pub fn number(&self, name: &str) -> Got<f64> {
        self.present(name, self.number_if(name))
    }

    pub fn count_if(&self, name: &str) -> Got<Option<usize>> {
        self.read(name, |key, node| self.count_in(key, node))
    }

    pub fn count(&self, name: &str) -> Got<usize> {
        self.present(name, self.count_if(name))
    }

    pub fn text_if(&self, name: &str) -> Got<Option<String>> {
        self.read(name, |key, node| self.text_in(key, node))
    }

    pub fn text(&self, name: &str) -> Got<String> {
        self.present(name, self.text_if(name))
    }

    /// Length of the array of a key, for keys that set the dimension.
    pub fn length(&self, name: &str) -> Option<usize> {
        match &self.node(name)?.value {
            Value::Array(items) => Some(items.len()),
            _ => None,
        }
    }

    pub fn vector_if(&self, name: &str, dimension: usize) -> Got<Option<Vec<f64>>> {
        self.read(name, |key, node| self.vector_in(key, node, dimension))
    }

    pub fn vector(&self, name: &str, dimension: usize) -> Got<Vec<f64>> {
        self.present(name, self.vector_if(name, dimension))
    }

    /// Numbers of an array of the given length, in the key's range.
    pub fn vector_in(&self, key: &Key, node: &Node, dimension: usize) -> Got<Vec<f64>> {
        let items = self.per_axis(key, node, dimension)?;
        let number = Key { kind: Kind::Number, ..*key };
        items.iter().map(|item| self.number_in(&number, item)).collect()
    }

    /// One number for all axes, or one per axis.
    pub fn number_or_vector_if(&self, name: &str, dimension: usize) -> Got<Option<Vec<f64>>> {
        self.read(name, |key, node| match node.value {
            Value::Array(_) => self.vector_in(key, node, dimension),
            _ => Ok(vec![self.number_in(key, node)?; dimension]),
        })
    }

    /// Whole numbers: one per axis, or (if the schema allows it) one for all.
    pub fn counts_if(&self, name: &str, dimension: usize) -> Got<Option<Vec<usize>>> {
        self.read(name, |key, node| {
            if key.kind == Kind::CountOrCounts && !matches!(node.value, Value::Array(_)) {
                return Ok(vec![self.count_in(key, node)?; dimension]);
            }
            let items = self.per_axis(key, node, dimension)?;
            let count = Key { kind: Kind::Count, ..*key };
            items.iter().map(|item| self.count_in(&count, item)).collect()
        })
    }

    /// Positions; one alone may be written without the outer array.
    pub fn points(&self, name: &str, dimension: usize) -> Got<Vec<Vec<f64>>> {
        self.present(
            name,
            self.read(name, |key, node| {
                let items = self.items(key, node)?;
                if items.iter().all(|item| item.number().is_some()) && !items.is_empty() {
                    return Ok(vec![self.vector_in(key, node, dimension)?]);
                }
                let vector = Key { kind: Kind::Vector, ..*key };
                items.iter().map(|item| self.vector_in(&vector, item, dimension)).collect()
            }),
        )
    }

    fn word<T: Words>(&self, name: &str, word: &str, origin: &Origin) -> Got<T> {
        if let Some((_, value)) = T::WORDS.iter().find(|(known, _)| *known == word) {
            return Ok(*value);
        }
        let names: Vec<&str> = T::WORDS.iter().map(|(known, _)| *known).collect();
        Err(self.unknown_word(name, word, &names, origin))
    }

    /// Reports a word that is none of `known`.
    pub fn unknown_word(
        &self,
        name: &str,
        word: &str,
        known: &[&str],
        origin: &Origin,
    ) -> Reported {
        let help = nearest(word, known.iter().copied())
            .map(|near| format!("did you mean \"{near}\"?"))
            .unwrap_or_default();
        let expected = match known {
            [] => "nothing to choose from".to_string(),
            [one] => format!("expected \"{one}\""),
            _ => format!("expected one of {}", quoted(known)),
        };
        let message = format!("{expected}, found \"{word}\"");
        self.problems.report(origin, &self.full(name), message, help)
    }

    /// An enumeration of the model.
    pub fn choice<T: Words>(&self, name: &str) -> Got<T> {
        self.present(name, self.choice_if(name))
    }

    pub fn choice_if<T: Words>(&self, name: &str) -> Got<Option<T>> {
        self.read(name, |key, node| {
            let text = self.text_in(key, node)?;
            self.word(name, &text, &node.origin)
        })
    }

    /// A word of the schema's list; `allowed` of them hold here.
    pub fn choice_of(&self, name: &str, allowed: &[&str]) -> Got<usize> {
        let at = self.read(name, |key, node| {
            let text = self.text_in(key, node)?;
            allowed
                .iter()
                .position(|known| *known == text)
                .ok_or_else(|| self.unknown_word(name, &text, allowed, &node.origin))
        });
        self.present(name, at)
    }

    /// Positions in `allowed` of the words of an array, without repeats.
    pub fn choices(&self, name: &str, allowed: &[&str]) -> Got<Vec<usize>> {
        let found = self.read(name, |key, node| {
            let mut chosen = Vec::new();
            for item in self.items(key, node)? {
                let text = self.text_in(&Key { kind: Kind::Text, ..*key }, item)?;
                let Some(at) = allowed.iter().position(|known| *known == text) else {
                    return Err(self.unknown_word(name, &text, allowed, &item.origin));
                };
                if chosen.contains(&at) {
                    let message = format!("\"{text}\" is named twice");
                    let full = self.full(name);
                    return Err(self.problems.report(&item.origin, &full, message, String::new()));
                }
                chosen.push(at);
            }
            Ok(chosen)
        });
        Ok(found?.unwrap_or_default())
    }

    fn expression_in(&self, key: &Key, node: &Node, variables: &str) -> Got<Expression> {
        if let Some(value) = node.number().filter(|value| value.is_finite()) {
            return Ok(Expression::constant(value));
        }
        let Value::String(text) = &node.value else { return Err(self.mismatch(key, node)) };
        let report = |message: String| {
            self.problems.report(&node.origin, &self.full(key.name), message, String::new())
        };
        let expression = Expression::parse(text).map_err(report)?;
        let foreign = Variable::ALL
            .into_iter()
            .find(|v| expression.depends_on(*v) && !variables.split(' ').any(|n| n == v.name()));
        match foreign {
            Some(v) => {
                let name = v.name();
                Err(report(format!("`{name}` is not known here; variables: {variables}")))
            }
            None => Ok(expression),
        }
    }

    fn variables(key: &Key) -> &'static str {
        match key.kind {
            Kind::Expression(variables) | Kind::Expressions(variables) => variables,
            _ => "X Y Z x y z s t",
        }
    }

    pub fn expression_if(&self, name: &str) -> Got<Option<Expression>> {
        self.read(name, |key, node| self.expression_in(key, node, Self::variables(key)))
    }

    /// A formula that must be a string, in the given variables.
    pub fn formula(&self, name: &str, variables: &str) -> Got<Expression> {
        self.present(
            name,
            self.read(name, |key, node| {
                self.text_in(key, node)?;
                self.expression_in(key, node, variables)
            }),
        )
    }

    pub fn expressions_if(&self, name: &str, dimension: usize) -> Got<Option<Vec<Expression>>> {
        self.read(name, |key, node| {
            let variables = Self::variables(key);
            let one = Key { kind: Kind::Expression(variables), ..*key };
            let items = self.per_axis(key, node, dimension)?;
            items.iter().map(|item| self.expression_in(&one, item, variables)).collect()
        })
    }

    /// A range that only this use has, such as a fraction.
    pub fn number_from(&self, name: &str, node: &Node, range: Range) -> Got<f64> {
        self.number_in(&Key { range, ..*self.key(name) }, node)
    }

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
        let Value::Array(items) = &node.value else { return Err(self.mismatch(key, node)) };
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
        let Value::Table(entries) = &node.value else { return Err(self.mismatch(key, node)) };
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

    /// Reports that a value is not what the schema says.
    pub fn wrong(&self, name: &str, node: &Node) -> Reported {
        self.mismatch(self.key(name), node)
    }
}
