//! `[[probe]]`: where points are watched, and which fields.

use crate::deck::fields::{self, FieldRank};
use crate::deck::model::{Probe, Spot};
use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::tree::Value;

/// `bodies`: names of the bodies.
pub fn probes(root: &Table<'_>, dimension: usize, bodies: &[String]) -> Got<Vec<Probe>> {
    let mut names: Vec<String> = Vec::new();
    root.tables("probe", |_, table| {
        let name = table.text("name");
        let spot = spot(&table, dimension, bodies);
        let fields = selectors(&table, dimension);
        let name = table.unique(name?, &mut names, "probe")?;
        Ok(Probe { name, spot: spot?, fields: fields? })
    })
}

fn spot(table: &Table<'_>, dimension: usize, bodies: &[String]) -> Got<Spot> {
    let near = table.vector_if("near", dimension);
    let id = table.count_if("id");
    let body = match table.given("body") {
        true => Some(table.choice_of_names("body", bodies)?),
        false => None,
    };
    match (near?, id?, body) {
        (Some(place), None, body) => Ok(Spot::Near { place, body }),
        (None, Some(id), None) => Ok(Spot::Id(id as u64)),
        (None, None, Some(body)) => Ok(Spot::Mean(body)),
        (None, None, None) => Err(table.problem("", "expected one of \"near\", \"id\", \"body\"")),
        _ => Err(table.problem("id", "expected alone: a point has one place and one body")),
    }
}

/// The words of `fields`, all known.
fn selectors(table: &Table<'_>, dimension: usize) -> Got<Vec<String>> {
    let Some(node) = table.node("fields") else { return Err(table.missing("fields", "")) };
    let Value::Array(items) = &node.value else { return Err(table.wrong("fields", node)) };
    if items.is_empty() {
        return Err(table.wrong("fields", node));
    }
    let each = items.iter().map(|item| {
        let Value::String(word) = &item.value else { return Err(table.wrong("fields", item)) };
        let (base, component) = match word.split_once('.') {
            Some((base, component)) => (base, Some(component)),
            None => (word.as_str(), None),
        };
        let known = match fields::rank(base) {
            None => fields::names(),
            Some(FieldRank::Integer) => {
                return Err(table.problem("fields", format!("\"{word}\" does not change in time")));
            }
            Some(rank) => match component {
                Some(component) if !rank.components(dimension).contains(&component) => {
                    let parts = rank.components(dimension);
                    if parts.is_empty() {
                        let why = format!("\"{base}\" is one number and has no components");
                        return Err(table.problem("fields", why));
                    }
                    let known: Vec<String> = parts.iter().map(|c| format!("{base}.{c}")).collect();
                    let known: Vec<&str> = known.iter().map(String::as_str).collect();
                    return Err(table.unknown_word("fields", word, &known, &item.origin));
                }
                _ => return Ok(word.clone()),
            },
        };
        Err(table.unknown_word("fields", word, &known, &item.origin))
    });
    // All of them, so that every unknown word is reported.
    let words: Vec<Got<String>> = each.collect();
    words.into_iter().collect()
}
