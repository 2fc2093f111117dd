//! Numbers, strings and vectors.

use super::Table;
use crate::deck::problems::Got;
use crate::deck::schema::{Key, Kind, Range};
use crate::deck::tree::{Node, Value};

impl Table<'_> {
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

    pub(crate) fn text_in(&self, key: &Key, node: &Node) -> Got<String> {
        match &node.value {
            Value::String(text) => Ok(text.clone()),
            _ => Err(self.mismatch(key, node)),
        }
    }

    pub(crate) fn items<'n>(&self, key: &Key, node: &'n Node) -> Got<&'n [Node]> {
        match &node.value {
            Value::Array(items) => Ok(items),
            _ => Err(self.mismatch(key, node)),
        }
    }

    /// `items` that must be one per axis.
    pub(crate) fn per_axis<'n>(
        &self,
        key: &Key,
        node: &'n Node,
        dimension: usize,
    ) -> Got<&'n [Node]> {
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

    /// A number, if the key is given or has a default.
    pub fn number_if(&self, name: &str) -> Got<Option<f64>> {
        self.read(name, |key, node| self.number_in(key, node))
    }

    /// A number; missing is a problem.
    pub fn number(&self, name: &str) -> Got<f64> {
        self.present(name, self.number_if(name))
    }

    /// A whole number, if the key is given or has a default.
    pub fn count_if(&self, name: &str) -> Got<Option<usize>> {
        self.read(name, |key, node| self.count_in(key, node))
    }

    /// A whole number; missing is a problem.
    pub fn count(&self, name: &str) -> Got<usize> {
        self.present(name, self.count_if(name))
    }

    /// true or false, if the key is given or has a default.
    pub fn flag_if(&self, name: &str) -> Got<Option<bool>> {
        self.read(name, |key, node| match node.value {
            Value::Boolean(value) => Ok(value),
            _ => Err(self.mismatch(key, node)),
        })
    }

    /// A string, if the key is given or has a default.
    pub fn text_if(&self, name: &str) -> Got<Option<String>> {
        let text = self.read(name, |key, node| self.text_in(key, node))?;
        // Names go into headers of tables and into messages, which have one line.
        if name == "name" && text.as_ref().is_some_and(|text| text.contains(char::is_control)) {
            let message = "expected a name without line ends and other control characters";
            return Err(self.problem(name, message));
        }
        Ok(text)
    }

    /// A string; missing is a problem.
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

    /// One number per axis, if the key is given.
    pub fn vector_if(&self, name: &str, dimension: usize) -> Got<Option<Vec<f64>>> {
        self.read(name, |key, node| self.vector_in(key, node, dimension))
    }

    /// One number per axis; missing is a problem.
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

    /// A range that only this use has, such as a fraction.
    pub fn number_from(&self, name: &str, node: &Node, range: Range) -> Got<f64> {
        self.number_in(&Key { range, ..*self.key(name) }, node)
    }
}
