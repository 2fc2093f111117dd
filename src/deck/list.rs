//! What a deck can choose from, one line each.

use super::choices::Choice;
use super::fields::FIELDS;
use super::model::Basis;
use super::schema;
use super::templates::TEMPLATES;
use crate::material::{CATALOGUE, state_variables};
use crate::system::terms::KEYS;

/// A line on each analysis; a test holds it to the deck's words.
const ANALYSES: [(&str, &str); 6] = [
    ("quasi-static", "equilibrium under loads that grow in steps (Newton)"),
    ("explicit", "dynamics in small steps, for impact and fast flow"),
    ("implicit-dynamic", "dynamics in steps that a wave may cross (Newmark, Newton)"),
    ("conditioning", "rigid motion over the grid: condition numbers, nothing solved"),
    ("strength-reduction", "a factor of safety: strength is divided until nothing stands"),
    ("element-test", "one point under a laboratory path, without grid"),
];

/// Materials, bases, analyses, loads, terms, fields and templates.
pub fn list() -> String {
    let mut out = String::new();
    let mut part = |title: &str, rows: Vec<(String, String)>| {
        let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        out.push_str(&format!("{title}\n"));
        for (name, text) in rows {
            out.push_str(format!("  {name:width$}  {}", cut(&text)).trim_end());
            out.push('\n');
        }
        out.push('\n');
    };
    let pairs = |rows: &[(&str, &str)]| -> Vec<(String, String)> {
        rows.iter().map(|(name, text)| (name.to_string(), text.to_string())).collect()
    };
    let models: Vec<(&str, &str)> =
        CATALOGUE.iter().map(|entry| (entry.name, first_sentence(entry.doc))).collect();
    part("materials ([material.NAME] model)", pairs(&models));
    let bases: Vec<(&str, &str)> =
        Basis::SPELLINGS.iter().map(|(name, basis)| (*name, basis.doc())).collect();
    part("bases ([method] basis)", pairs(&bases));
    part("analyses ([analysis] type)", pairs(&ANALYSES));
    let loads: Vec<(&str, &str)> = schema::section("load")
        .keys
        .iter()
        .filter(|key| !["from", "until"].contains(&key.name))
        .map(|key| (key.name, first_sentence(key.doc)))
        .collect();
    part("loads ([[load]])", pairs(&loads));
    let terms: Vec<(&str, &str)> =
        KEYS.iter().map(|key| (key.name, first_sentence(key.doc))).collect();
    part("further terms (a table of their own)", pairs(&terms));
    let mut fields: Vec<(String, String)> = FIELDS
        .iter()
        .map(|field| {
            let meaning = if field.doc.is_empty() { field.name } else { field.doc };
            (field.name.to_string(), format!("[{}] {meaning}", field.unit))
        })
        .collect();
    fields.extend(state_variables().iter().map(|variable| {
        let owners =
            CATALOGUE.iter().filter(|entry| entry.state.iter().any(|s| s.name == variable.name));
        let owners: Vec<&str> = owners.map(|entry| entry.name).collect();
        (variable.name.to_string(), format!("[{}] state of {}", variable.unit, owners.join(", ")))
    }));
    part("fields ([output] fields, [[verify]], [[probe]])", fields);
    let templates: Vec<(&str, &str)> = TEMPLATES.iter().map(|t| (t.name, t.title())).collect();
    part("templates (--new NAME)", pairs(&templates));
    out.push_str("More on any of these words and on every key: mpm-par --explain WORD");
    out
}

/// What fits into a line; `--explain` prints the rest.
fn cut(text: &str) -> String {
    const MOST: usize = 110;
    if text.chars().count() <= MOST {
        return text.to_string();
    }
    let short: String = text.chars().take(MOST).collect();
    let end = short.rfind(' ').unwrap_or(short.len());
    format!("{} ...", short[..end].trim_end_matches([',', ';', ':']))
}

/// A sentence ends at a full stop before a capital: "eq. 43" goes on.
fn first_sentence(text: &str) -> &str {
    let mut stops = text.match_indices(". ");
    let end = stops.find(|(at, _)| text[at + 2..].starts_with(char::is_uppercase));
    end.map_or(text, |(at, _)| &text[..at]).trim_end_matches('.')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::model::AnalysisType;

    #[test]
    fn every_choice_has_its_line() {
        assert_eq!(ANALYSES.map(|(name, _)| name), AnalysisType::NAMES);
        let text = list();
        for name in CATALOGUE.iter().map(|entry| entry.name).chain(Basis::NAMES.iter().copied()) {
            assert!(text.lines().any(|line| line.trim_start().starts_with(name)), "{name}");
        }
        assert!(text.contains("(Lagrangian eq. 43)") && !text.contains("eq\n"), "{text}");
        let widest = text.lines().map(str::len).max().unwrap_or(0);
        assert!(widest < 160, "{widest} columns");
    }
}
