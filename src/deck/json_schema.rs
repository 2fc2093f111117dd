//! The schema as JSON Schema (draft 7): editors complete and check decks with it.
//!
//! It says of each key what the schema's rows say: type, words, range, unit, default, meaning. What
//! depends on other keys (which choices read a key, which of several keys is needed) only the program
//! checks.

use serde_json::{Map, Value, json};

use super::schema::{self, Key, Kind, Need, Range, Section};
use super::tree::{self, Origin};

/// The whole deck.
pub fn json_schema() -> Value {
    let mut definitions = Map::new();
    for part in schema::sections().filter(|section| !section.name.is_empty()) {
        definitions.insert(part.name.to_string(), table(part));
    }
    let mut root = table(schema::section(""));
    root["$schema"] = json!("http://json-schema.org/draft-07/schema#");
    root["title"] = json!("Deck of mpm-par");
    root["definitions"] = Value::Object(definitions);
    root
}

fn table(section: &Section) -> Value {
    let mut properties = Map::new();
    for key in section.keys {
        properties.insert(key.name.to_string(), property(section, key));
    }
    // A key that only some choices read is needed by those alone.
    let needed = |key: &&Key| key.need == Need::Required && key.readers.is_empty();
    let required: Vec<&str> = section.keys.iter().filter(needed).map(|key| key.name).collect();
    let mut object = json!({
        "type": "object",
        "description": section.doc,
        "properties": properties,
        "additionalProperties": false,
    });
    if !required.is_empty() {
        object["required"] = json!(required);
    }
    object
}

fn property(section: &Section, key: &Key) -> Value {
    let mut value = of_kind(key.kind, key.range);
    // The one table that a word may replace.
    if (section.name, key.name) == ("", "ghost") {
        value = json!({ "anyOf": [{ "const": "off" }, value] });
    }
    let mut words = vec![key.doc.to_string()];
    if !key.unit.is_empty() {
        words.push(format!("[{}]", key.unit));
    }
    if let Kind::Special(text) = key.kind {
        words.push(format!("Value: {text}."));
    }
    match key.need {
        Need::Default(text) => {
            if let Some(given) = default_of(text) {
                value["default"] = given;
            }
            words.push(format!("Default: {text}."));
        }
        Need::Optional("-") | Need::Required => {}
        Need::Optional(when) => words.push(format!("Without it: {when}.")),
    }
    for reader in key.readers {
        words.push(format!("Only with {} = {}.", reader.choice, reader.values.join(" or ")));
    }
    value["description"] = json!(words.join(" "));
    value
}

fn of_kind(kind: Kind, range: Range) -> Value {
    let number = || bounded(json!({ "type": "number" }), range);
    let count = || {
        let mut value = bounded(json!({ "type": "integer" }), range);
        if value.get("minimum").is_none() {
            value["minimum"] = json!(0);
        }
        value
    };
    let list = |items: Value| json!({ "type": "array", "items": items });
    let reference = |name: &str| json!({ "$ref": format!("#/definitions/{name}") });
    // Siblings of a reference are not read in draft 7.
    let whole = |value: Value| json!({ "allOf": [value] });
    let expression = || json!({ "anyOf": [number(), { "type": "string" }] });
    match kind {
        Kind::Text => json!({ "type": "string" }),
        Kind::Flag => json!({ "type": "boolean" }),
        Kind::Number => number(),
        Kind::Count => count(),
        Kind::Choice(words) => json!({ "enum": words }),
        Kind::Choices(words) => {
            json!({ "type": "array", "items": { "enum": words }, "uniqueItems": true })
        }
        Kind::Expression(_) => expression(),
        Kind::Expressions(_) => list(expression()),
        Kind::Vector => list(number()),
        Kind::Counts => list(count()),
        Kind::NumberOrVector => json!({ "anyOf": [number(), list(number())] }),
        Kind::CountOrCounts => json!({ "anyOf": [count(), list(count())] }),
        Kind::Points => list(json!({ "anyOf": [number(), list(number())] })),
        Kind::Table(name) => whole(reference(name)),
        Kind::Named(name) => {
            json!({ "type": "object", "additionalProperties": reference(name) })
        }
        Kind::Tables(name) => list(reference(name)),
        Kind::Special(_) => json!({}),
    }
}

fn bounded(mut value: Value, range: Range) -> Value {
    let ends = [
        (range.low, range.low_included, "minimum", "exclusiveMinimum"),
        (range.high, range.high_included, "maximum", "exclusiveMaximum"),
    ];
    for (end, included, with, without) in ends {
        if end.is_finite() {
            value[if included { with } else { without }] = json!(end);
        }
    }
    value
}

/// A TOML value as JSON.
fn default_of(text: &str) -> Option<Value> {
    fn plain(value: &tree::Value) -> Option<Value> {
        Some(match value {
            tree::Value::String(text) => json!(text),
            tree::Value::Integer(number) => json!(number),
            tree::Value::Float(number) => json!(number),
            tree::Value::Boolean(flag) => json!(flag),
            tree::Value::Array(items) => {
                json!(items.iter().map(|item| plain(&item.value)).collect::<Option<Vec<_>>>()?)
            }
            _ => return None,
        })
    }
    plain(&tree::parse_value(text, &Origin::Nowhere).ok()?.value)
}
