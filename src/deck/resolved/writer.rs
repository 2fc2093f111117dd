//! Keys and values as TOML spells them.

use crate::deck::expression::Expression;
use crate::deck::model::Deck;
use crate::deck::schema::{self, AXES};
use crate::deck::unread::is_read;

/// The text so far.
pub(super) struct Writer<'a> {
    pub deck: &'a Deck,
    pub text: String,
}

impl Writer<'_> {
    pub fn table(&mut self, header: &str) {
        self.text.push_str(&format!("\n{header}\n"));
    }

    /// One key of a section of the schema, with its unit, if the deck's choices read it.
    pub fn line(&mut self, section: &str, key: &str, value: String) {
        let known = schema::section(section).key(key);
        if known.is_some_and(|known| !is_read(self.deck, known)) {
            return;
        }
        let unit = known.map_or("", |known| known.unit);
        let unit = if unit.is_empty() { String::new() } else { format!("  # {unit}") };
        self.text.push_str(&format!("{key} = {value}{unit}\n"));
    }

    pub fn optional(&mut self, section: &str, key: &str, value: Option<String>) {
        if let Some(value) = value {
            self.line(section, key, value);
        }
    }
}

pub(super) fn quote(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c.is_control() => out.push_str(&format!("\\u{:04x}", c as u32)),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

pub(super) fn number(value: f64) -> String {
    format!("{value:?}")
}

pub(super) fn array(items: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", items.into_iter().collect::<Vec<_>>().join(", "))
}

pub(super) fn inline(pairs: &[(&str, String)]) -> String {
    let pairs: Vec<String> = pairs.iter().map(|(key, value)| format!("{key} = {value}")).collect();
    format!("{{ {} }}", pairs.join(", "))
}

pub(super) fn vector(values: &[f64]) -> String {
    array(values.iter().copied().map(number))
}

pub(super) fn counts(values: &[usize]) -> String {
    array(values.iter().map(usize::to_string))
}

pub(super) fn axes(axes: &[usize]) -> String {
    array(axes.iter().map(|axis| quote(AXES[*axis])))
}

/// A number if it was given as one.
pub(super) fn expression(expression: &Expression) -> String {
    match expression.as_constant() {
        Some(value) if value.to_string() == expression.text() => number(value),
        _ => quote(expression.text()),
    }
}

pub(super) fn expressions(all: &[Expression]) -> String {
    array(all.iter().map(expression))
}
