//! TOML text to a tree of values that remember where they came from.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Where a key or value was written.
#[derive(Debug, Clone, PartialEq)]
pub enum Origin {
    /// Bytes of the deck's text.
    Text(Range<usize>),
    /// Index of a `--set` option.
    Set(usize),
    /// Nowhere: it is missing, or a default.
    Nowhere,
}

#[derive(Debug, Clone)]
pub struct Node {
    pub origin: Origin,
    pub value: Value,
}

#[derive(Debug, Clone)]
pub enum Value {
    String(String),
    Integer(i64),
    Float(f64),
    Boolean(bool),
    Datetime(String),
    Array(Vec<Node>),
    Table(Vec<Entry>),
}

/// A key and its value; entries keep the order of the text.
#[derive(Debug, Clone)]
pub struct Entry {
    pub key: String,
    pub origin: Origin,
    pub node: Node,
}

/// A message about a place in the text.
pub type Located = (Option<Range<usize>>, String);

/// Parses a whole deck. The root is a table.
pub fn parse_document(text: &str) -> Result<Node, Located> {
    let table = DeTable::parse(text).map_err(|e| (e.span(), e.message().to_string()))?;
    let origin = |span: Range<usize>| Origin::Text(span);
    Ok(Node { origin: Origin::Nowhere, value: Value::Table(entries(table.into_inner(), &origin)?) })
}

/// Parses one value, as given to a `--set` option or as a default of the schema.
pub fn parse_value(text: &str, origin: &Origin) -> Result<Node, String> {
    let value = DeValue::parse(text).map_err(|e| e.message().to_string())?;
    node(value, &|_| origin.clone()).map_err(|(_, message)| message)
}

fn entries(
    table: DeTable<'_>,
    origin: &dyn Fn(Range<usize>) -> Origin,
) -> Result<Vec<Entry>, Located> {
    let mut pairs: Vec<_> = table.into_iter().collect();
    pairs.sort_by_key(|(key, _)| key.span().start);
    pairs
        .into_iter()
        .map(|(key, value)| {
            let place = origin(key.span());
            Ok(Entry {
                key: key.into_inner().into_owned(),
                origin: place,
                node: node(value, origin)?,
            })
        })
        .collect()
}

fn node(
    value: Spanned<DeValue<'_>>,
    origin: &dyn Fn(Range<usize>) -> Origin,
) -> Result<Node, Located> {
    let span = value.span();
    let out_of_range = |what: String| (Some(span.clone()), format!("{what} is too large a number"));
    let converted = match value.into_inner() {
        DeValue::String(text) => Value::String(text.into_owned()),
        DeValue::Integer(number) => Value::Integer(
            i64::from_str_radix(number.as_str(), number.radix())
                .map_err(|_| out_of_range(number.to_string()))?,
        ),
        DeValue::Float(number) => Value::Float(
            number.as_str().parse().map_err(|_| out_of_range(number.as_str().to_string()))?,
        ),
        DeValue::Boolean(value) => Value::Boolean(value),
        DeValue::Datetime(value) => Value::Datetime(value.to_string()),
        DeValue::Array(values) => Value::Array(
            values.into_iter().map(|item| node(item, origin)).collect::<Result<_, _>>()?,
        ),
        DeValue::Table(table) => Value::Table(entries(table, origin)?),
    };
    Ok(Node { origin: origin(span), value: converted })
}

impl Node {
    /// What was found, for messages.
    pub fn describe(&self) -> String {
        match &self.value {
            Value::String(text) => format!("the string {text:?}"),
            Value::Integer(number) => format!("{number}"),
            Value::Float(number) => format!("{number:?}"),
            Value::Boolean(value) => format!("{value}"),
            Value::Datetime(text) => format!("the date {text}"),
            Value::Array(items) if items.iter().any(|i| matches!(i.value, Value::Table(_))) => {
                "an array of tables".to_string()
            }
            Value::Array(items) => {
                format!(
                    "an array of {} value{}",
                    items.len(),
                    if items.len() == 1 { "" } else { "s" }
                )
            }
            Value::Table(_) => "a table".to_string(),
        }
    }

    /// The value as a number; whole numbers count.
    pub fn number(&self) -> Option<f64> {
        match self.value {
            Value::Integer(number) => Some(number as f64),
            Value::Float(number) => Some(number),
            _ => None,
        }
    }
}

/// Applies `KEY=VALUE`: the key is a dotted path with indices into arrays, the value is TOML
/// (a word that is not TOML is a string). Without a value the key is removed.
pub fn apply_set(root: &mut Node, option: &str, index: usize) -> Result<(), String> {
    let origin = Origin::Set(index);
    let Some((path, text)) = option.split_once('=') else {
        return Err("expected KEY=VALUE, for example --set method.basis=gimp".to_string());
    };
    let keys: Vec<&str> = path.split('.').map(str::trim).collect();
    if keys.iter().any(|key| key.is_empty()) {
        return Err(format!("\"{path}\" is not a dotted path such as body.0.points_per_cell"));
    }
    let text = text.trim();
    if text.is_empty() {
        return change(root, &keys, "", None, &origin);
    }
    let value = match parse_value(text, &origin) {
        Ok(value) => value,
        Err(why) if text.starts_with(['[', '{', '"', '\'']) => {
            return Err(format!("the value {text} is not TOML: {why}"));
        }
        Err(_) => Node { origin: origin.clone(), value: Value::String(text.to_string()) },
    };
    change(root, &keys, "", Some(value), &origin)
}

/// Replaces (or removes) the value at `keys` below `node`, which is called `name` in messages. A
/// word on the way, such as `ghost = "off"`, gives way to a table.
fn change(
    node: &mut Node,
    keys: &[&str],
    name: &str,
    value: Option<Node>,
    origin: &Origin,
) -> Result<(), String> {
    let (key, rest) = keys.split_first().expect("the path has at least one key");
    let full = if name.is_empty() { (*key).to_string() } else { format!("{name}.{key}") };
    if matches!(node.value, Value::String(_)) && value.is_some() {
        node.value = Value::Table(Vec::new());
    }
    match &mut node.value {
        Value::Table(entries) => {
            let found = entries.iter().position(|entry| entry.key == *key);
            let Some(value) = value else {
                return match found {
                    None => Ok(()),
                    Some(at) if rest.is_empty() => {
                        entries.remove(at);
                        Ok(())
                    }
                    Some(at) => change(&mut entries[at].node, rest, &full, None, origin),
                };
            };
            if rest.is_empty() {
                match found {
                    Some(at) => entries[at].node = value,
                    None => entries.push(Entry {
                        key: (*key).to_string(),
                        origin: origin.clone(),
                        node: value,
                    }),
                }
                return Ok(());
            }
            let at = found.unwrap_or_else(|| {
                let empty = Node { origin: origin.clone(), value: Value::Table(Vec::new()) };
                entries.push(Entry {
                    key: (*key).to_string(),
                    origin: origin.clone(),
                    node: empty,
                });
                entries.len() - 1
            });
            change(&mut entries[at].node, rest, &full, Some(value), origin)
        }
        Value::Array(items) => {
            let count = items.len();
            let Some(at) = key.parse::<usize>().ok().filter(|&at| at < count) else {
                return Err(format!(
                    "{name} is an array of {count}: expected an index from 0 to {}, found \"{key}\"",
                    count.saturating_sub(1)
                ));
            };
            match value {
                Some(value) if rest.is_empty() => items[at] = value,
                None if rest.is_empty() => {
                    items.remove(at);
                }
                value => return change(&mut items[at], rest, &full, value, origin),
            }
            Ok(())
        }
        _ => Err(format!("{name} is {}, not a table with a key \"{key}\"", node.describe())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(text: &str, options: &[&str]) -> Result<String, String> {
        let mut root = parse_document(text).expect("valid");
        for (index, option) in options.iter().enumerate() {
            apply_set(&mut root, option, index)?;
        }
        Ok(show(&root))
    }

    fn show(node: &Node) -> String {
        match &node.value {
            Value::Array(items) => {
                format!("[{}]", items.iter().map(show).collect::<Vec<_>>().join(","))
            }
            Value::Table(entries) => {
                let all = entries.iter().map(|e| format!("{}={}", e.key, show(&e.node)));
                format!("{{{}}}", all.collect::<Vec<_>>().join(","))
            }
            Value::String(text) => format!("{text:?}"),
            _ => node.describe(),
        }
    }

    #[test]
    fn entries_keep_the_order_of_the_text() {
        let text = "b = 1\n[z]\nq = 2\na = 3\n[m]\n";
        assert_eq!(after(text, &[]).as_deref(), Ok("{b=1,z={q=2,a=3},m={}}"));
    }

    #[test]
    fn set_replaces_adds_and_removes() {
        let text = "a = 1\n[[body]]\nn = [1, 2]\n[[body]]\n";
        for (option, expected) in [
            ("a=2.5", "{a=2.5,body=[{n=[1,2]},{}]}"),
            ("body.0.n=[3,3]", "{a=1,body=[{n=[3,3]},{}]}"),
            ("body.0.n.1=7", "{a=1,body=[{n=[1,7]},{}]}"),
            ("body.1.x.y=gimp", "{a=1,body=[{n=[1,2]},{x={y=\"gimp\"}}]}"),
            ("body.1.t=von-mises", "{a=1,body=[{n=[1,2]},{t=\"von-mises\"}]}"),
            ("a=\"x=1\"", "{a=\"x=1\",body=[{n=[1,2]},{}]}"),
            ("a=", "{body=[{n=[1,2]},{}]}"),
            ("body.1=", "{a=1,body=[{n=[1,2]}]}"),
            ("body.0.n=off", "{a=1,body=[{n=\"off\"},{}]}"),
            ("nothing.here=", "{a=1,body=[{n=[1,2]},{}]}"),
        ] {
            assert_eq!(after(text, &[option]).as_deref(), Ok(expected), "{option}");
        }
    }

    #[test]
    fn set_says_what_is_wrong() {
        let text = "a = 1\n[[body]]\n";
        for (option, part) in [
            ("a", "expected KEY=VALUE"),
            ("a..b=1", "not a dotted path"),
            ("a.b=1", "a is 1, not a table with a key \"b\""),
            ("body.1.x=1", "body is an array of 1: expected an index from 0 to 0, found \"1\""),
            ("body.first.x=1", "found \"first\""),
            ("a=[1,", "is not TOML"),
        ] {
            let message = after(text, &[option]).unwrap_err();
            assert!(message.contains(part), "{option}: {message}");
        }
    }
}
