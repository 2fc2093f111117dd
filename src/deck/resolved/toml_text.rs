//! Values as TOML spells them.

use crate::deck::expression::Expression;
use crate::deck::model::{Body, BodySurface};
use crate::deck::schema::{AXES, SIDES};

/// A string.
pub fn quote(text: &str) -> String {
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

/// A number.
pub fn number(value: f64) -> String {
    format!("{value:?}")
}

/// Values that are TOML already.
pub fn array(items: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", items.into_iter().collect::<Vec<_>>().join(", "))
}

/// Keys with values that are TOML already.
pub fn inline(pairs: &[(&str, String)]) -> String {
    let pairs: Vec<String> = pairs.iter().map(|(key, value)| format!("{key} = {value}")).collect();
    format!("{{ {} }}", pairs.join(", "))
}

/// Numbers.
pub fn vector(values: &[f64]) -> String {
    array(values.iter().copied().map(number))
}

/// Whole numbers.
pub fn counts(values: &[usize]) -> String {
    array(values.iter().map(usize::to_string))
}

/// Names of axes.
pub fn axes(axes: &[usize]) -> String {
    array(axes.iter().map(|axis| quote(AXES[*axis])))
}

/// A number if it was given as one.
pub fn expression(expression: &Expression) -> String {
    match expression.as_constant() {
        Some(value) if value.to_string() == expression.text() => number(value),
        _ => quote(expression.text()),
    }
}

/// Formulas, one per axis.
pub fn expressions(all: &[Expression]) -> String {
    array(all.iter().map(expression))
}

/// Keys of a part of a body's surface.
pub fn body_surface(bodies: &[Body], surface: &BodySurface) -> Vec<(&'static str, String)> {
    let mut pairs = vec![("body", quote(&bodies[surface.body].name))];
    if let Some((axis, upper)) = surface.side {
        pairs.push(("side", quote(SIDES[2 * axis + usize::from(upper)])));
    }
    pairs.extend(surface.within.as_ref().map(|within| ("where", quote(within.text()))));
    pairs
}
