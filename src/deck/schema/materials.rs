//! Keys of `[material.NAME]`: what the models of [`crate::material::CATALOGUE`] read, united.

use std::sync::LazyLock;

use super::{Key, Kind, Need, Section, key};
use crate::material::parameter::{ANY, Absence, Parameter};
use crate::material::{CATALOGUE, Entry};

/// The section of materials and those of the tables inside it.
pub fn sections() -> &'static [Section] {
    static SECTIONS: LazyLock<Vec<Section>> = LazyLock::new(make);
    &SECTIONS
}

/// Names of all models.
pub fn models() -> &'static [&'static str] {
    static NAMES: LazyLock<Vec<&'static str>> =
        LazyLock::new(|| CATALOGUE.iter().map(|entry| entry.name).collect());
    &NAMES
}

/// Models that read a key of `[material.NAME]`, a table's name included.
pub fn readers(key: &str) -> Vec<&'static str> {
    let reads = |entry: &&Entry| {
        entry.parameters.iter().any(|known| {
            let (table, own) = known.split();
            table.unwrap_or(own) == key
        })
    };
    CATALOGUE.iter().filter(reads).map(|entry| entry.name).collect()
}

fn make() -> Vec<Section> {
    let models = models();
    let described: Vec<String> =
        CATALOGUE.iter().map(|entry| format!("`{}`: {}", entry.name, entry.doc)).collect();
    let doc = format!(
        "A material, by a name of your own. Parameters are numbers or formulas of the place at \
         the start. Yield functions act on the Kirchhoff stress: a cohesion c acts as c/J in the \
         Cauchy stress. Models:\n\n- {}",
        described.join("\n- ")
    );
    let mut keys = vec![key("model", Kind::Choice(models), Need::Required, "Constitutive law.")];
    let mut tables: Vec<(&'static str, Vec<Key>)> = Vec::new();
    for parameter in CATALOGUE.iter().flat_map(|entry| entry.parameters) {
        match parameter.split() {
            (None, name) if !keys.iter().any(|known| known.name == name) => {
                keys.push(united(parameter));
            }
            (Some(table), name) => {
                let at = tables.iter().position(|(known, _)| *known == table);
                let at = at.unwrap_or_else(|| {
                    tables.push((table, Vec::new()));
                    let when = leaked(format!("none; {}", readers(table).join(", ")));
                    let path = leaked(format!("material.{table}"));
                    let doc = leaked(format!("See `material.{table}` below."));
                    keys.push(key(table, Kind::Table(path), Need::Optional(when), doc));
                    tables.len() - 1
                });
                if !tables[at].1.iter().any(|known| known.name == name) {
                    tables[at].1.push(united(parameter));
                }
            }
            _ => {}
        }
    }
    let mut all = vec![Section {
        name: "material",
        header: "[material.NAME]",
        doc: leaked(doc),
        keys: Vec::leak(keys),
    }];
    all.extend(tables.into_iter().map(|(table, keys)| Section {
        name: leaked(format!("material.{table}")),
        header: leaked(format!("material.{table}")),
        doc: leaked(format!("Read by {}.", readers(table).join(", "))),
        keys: Vec::leak(keys),
    }));
    all
}

/// The key of a parameter that several models may read, each in its own way.
fn united(parameter: &Parameter) -> Key {
    let uses: Vec<(&Entry, &Parameter)> = CATALOGUE
        .iter()
        .flat_map(|entry| entry.parameters.iter().map(move |known| (entry, known)))
        .filter(|(_, known)| known.key == parameter.key)
        .collect();
    let names = |wanted: &dyn Fn(&Parameter) -> bool| {
        let chosen = uses.iter().filter(|(_, known)| wanted(known));
        chosen.map(|(entry, _)| entry.name).collect::<Vec<_>>().join(", ")
    };
    let everywhere = uses.len() == CATALOGUE.len();
    let mut parts = Vec::new();
    let needed = names(&|known| known.absence == Absence::Never);
    if !needed.is_empty() {
        parts.push(format!("needed by {needed}"));
    }
    let mut meanings: Vec<&str> = Vec::new();
    for (_, known) in &uses {
        if let Absence::Means(_, means) = known.absence
            && !meanings.contains(&means)
        {
            meanings.push(means);
            let which = names(&|other| matches!(other.absence, Absence::Means(_, m) if m == means));
            parts.push(if everywhere { means.to_string() } else { format!("{which}: {means}") });
        }
    }
    let within = uses.iter().all(|(_, known)| matches!(known.absence, Absence::WithTable(_)));
    let need = match &parts[..] {
        [_] if everywhere && !needed.is_empty() => Need::Required,
        [] if within => Need::Required,
        _ => Need::Optional(leaked(parts.join("; "))),
    };
    let mut docs: Vec<(&str, String)> = Vec::new();
    for (_, known) in &uses {
        if !docs.iter().any(|(doc, _)| *doc == known.doc) {
            docs.push((known.doc, names(&|other| other.doc == known.doc)));
        }
    }
    let doc = match &docs[..] {
        [(doc, _)] => doc.to_string(),
        several => several
            .iter()
            .map(|(doc, names)| format!("{names}: {doc}"))
            .collect::<Vec<_>>()
            .join(" "),
    };
    let kind = match parameter.words {
        [] => Kind::Expression("X Y Z"),
        words => Kind::Choice(words),
    };
    let one_range = uses.iter().all(|(_, known)| known.range == parameter.range);
    Key {
        name: parameter.split().1,
        kind,
        unit: parameter.unit,
        need,
        range: if one_range { parameter.range } else { ANY },
        readers: &[],
        doc: leaked(doc),
    }
}

/// Text of the schema lives as long as the program.
fn leaked(text: String) -> &'static str {
    String::leak(text)
}
