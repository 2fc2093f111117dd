//! What a word of the deck means: keys by their dotted path or name, models, fields, and the choices
//! of a key.

use super::fields::{self, FIELDS};
use super::problems::nearest;
use super::schema::{self, Key, Kind, Need, Section};
use super::synonyms;
use crate::error::{Error, Result};
use crate::material::{self, CATALOGUE, state_variables};

/// A few lines on `word`: `analysis.steps`, `body.0.shape.box`, `young`, `mohr-coulomb`, `stress.yy`.
///
/// # Errors
/// `Input` for a word that nothing has, with the nearest one.
pub fn explain(word: &str) -> Result<String> {
    let mut parts = Vec::new();
    match at_path(word) {
        Some((section, key)) => parts.push(of_key(section, key)),
        None => parts.extend(by_name(word)),
    }
    if let Some(section) =
        schema::sections().find(|section| !word.is_empty() && section.name == word)
    {
        parts.push(of_section(section));
    }
    if let Some(entry) = material::entry(word) {
        let parameters: Vec<&str> = entry.parameters.iter().map(|known| known.key).collect();
        let keys = parameters.join(", ");
        parts.push(format!("material model \"{word}\"\n  {}\n  reads: {keys}", entry.doc));
    }
    let base = word.split('.').next().unwrap_or(word);
    if let Some(field) = FIELDS.iter().find(|field| field.name == base) {
        parts.push(format!("field \"{}\" [{}]\n  {}", field.name, field.unit, field.doc));
    } else if let Some(variable) = state_variables().iter().find(|known| known.name == base) {
        let unit = variable.unit;
        parts.push(format!("field \"{base}\" [{unit}]\n  State variable of a material."));
    }
    parts.extend(choices(word));
    if parts.is_empty() {
        let known = names();
        let last = word.rsplit('.').next().unwrap_or(word);
        let near = synonyms::key(last, known.iter().map(String::as_str))
            .or_else(|| synonyms::word(last, known.iter().map(String::as_str)))
            .or_else(|| nearest(last, known.iter().map(String::as_str)));
        let hint = near.map_or(String::new(), |near| format!(": did you mean \"{near}\"?"));
        return Err(Error::Input(format!(
            "--explain: no key, model or field is called \"{word}\"{hint}\n    try: mpm-par --list, \
             or the dotted path of a key as in analysis.steps"
        )));
    }
    Ok(parts.join("\n\n"))
}

/// The key at a dotted path; indices of arrays and names of materials may stand in it.
fn at_path(path: &str) -> Option<(&'static Section, &'static Key)> {
    let mut words = path.split('.').filter(|word| word.parse::<usize>().is_err()).peekable();
    let mut section = schema::section("");
    loop {
        let key = section.key(words.next()?)?;
        if words.peek().is_none() {
            return Some((section, key));
        }
        section = match key.kind {
            Kind::Table(name) | Kind::Tables(name) => schema::section(name),
            Kind::Named(name) => {
                let inner = schema::section(name);
                // The user's own name, unless the schema's paths are meant: material.young.
                if words.peek().is_some_and(|word| inner.key(word).is_none()) {
                    words.next();
                }
                inner
            }
            _ => {
                // Intervals have tables of their own beside a plain form.
                let name = format!("{}.{}", section.name, key.name);
                schema::sections().find(|known| known.name == name)?
            }
        };
        words.peek()?;
    }
}

/// Unit of the key at a dotted path; empty for a key without one.
pub(crate) fn unit_of(path: &str) -> &'static str {
    at_path(path).map_or("", |(_, key)| key.unit)
}

/// Keys of this name in any section.
fn by_name(name: &str) -> Vec<String> {
    let of_section = |section: &'static Section| Some(of_key(section, section.key(name)?));
    schema::sections().filter_map(of_section).collect()
}

fn of_key(section: &Section, key: &Key) -> String {
    let place = match section.name {
        "" => String::new(),
        _ => format!(" of {}", section.header),
    };
    let range = key.range.describe();
    let mut value = key.kind.describe();
    if !range.is_empty() {
        value = format!("{value} {range}");
    }
    if !key.unit.is_empty() {
        value = format!("{value} ({})", key.unit);
    }
    let absent = match key.need {
        Need::Required => "required".to_string(),
        Need::Optional("-") => "optional".to_string(),
        Need::Optional(when) => format!("without it: {when}"),
        Need::Default(text) => format!("default: {text}"),
    };
    let mut text = format!("key {}{place}\n  {}\n  value: {value}\n  {absent}", key.name, key.doc);
    for reader in key.readers {
        text.push_str(&format!("\n  only with {} = {}", reader.choice, reader.values.join(" or ")));
    }
    if let Kind::Table(name) | Kind::Tables(name) | Kind::Named(name) = key.kind {
        let keys: Vec<&str> = schema::section(name).keys.iter().map(|key| key.name).collect();
        text.push_str(&format!("\n  keys: {}", keys.join(", ")));
    }
    text
}

fn of_section(section: &Section) -> String {
    let keys: Vec<&str> = section.keys.iter().map(|key| key.name).collect();
    format!("{}\n  {}\n  keys: {}", section.header, section.doc, keys.join(", "))
}

/// Keys that take `word` as a choice.
fn choices(word: &str) -> Vec<String> {
    let mut found = Vec::new();
    for section in schema::sections() {
        for key in section.keys {
            if let Kind::Choice(words) = key.kind
                && words.contains(&word)
                && key.name != "model"
            {
                found.push(format!("a value of {} in {}\n  {}", key.name, section.header, key.doc));
            }
        }
    }
    found
}

fn names() -> Vec<String> {
    let keys = schema::sections().flat_map(|section| section.keys).map(|key| key.name);
    let models = CATALOGUE.iter().map(|entry| entry.name);
    let mut all: Vec<String> = keys.chain(models).map(String::from).collect();
    all.extend(fields::names().into_iter().map(String::from));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_model_and_field_is_explained() {
        for name in names() {
            assert!(explain(&name).is_ok(), "{name}");
        }
        for (word, part) in [
            ("analysis.steps", "a whole number"),
            ("body.0.shape.box.min", "Lower corner"),
            ("material.clay.young", "Pa"),
            ("material.young", "Pa"),
            ("output.every.seconds", "Simulated time"),
            ("gimp", "a value of basis in [method]"),
            ("stress.yy", "field \"stress\" [Pa]"),
            ("preconsolidation", "field \"preconsolidation\" [Pa]"),
        ] {
            let text = explain(word).unwrap();
            assert!(text.contains(part), "{word}: {text}");
        }
        let error = explain("yong").unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("did you mean \"young\"?"), "{error}");
    }
}
