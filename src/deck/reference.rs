//! The schema as documentation: `docs/guide/deck.md` is this text.

use super::expression;
use super::fields::{FIELDS, Field};
use super::schema::{self, Kind, Need, Reader, Section};
use crate::material::CATALOGUE;

/// A complete deck, which a test reads.
pub const EXAMPLE: &str = include_str!("example.toml");

const INTRODUCTION: &str = "\
# The deck

A deck is a TOML file that says everything about an analysis. Units are SI. In plane strain
(2D) volumes, masses and forces are per metre of thickness. An unknown key, a wrong type and a
value out of range are errors that name the file, line and column, what is accepted, and the
nearest known name. A key that the deck's other choices leave unread is an error, too, which names
the choice that would read it; where `--set` makes that choice, a key of the file is set aside with
a note. The deck with every default is written beside the results as
`resolved.toml`.

This page is written from the schema in `src/deck/schema/`; a test keeps it so
(`UPDATE_DOCS=1 cargo test --test deck_reference` writes it anew).
";

const OPTIONS: &str = "\
## Changes from the command line

`--set KEY=VALUE` changes any key by its dotted path, arrays by index, as in
`--set method.basis=mpm`, `--set body.0.points_per_cell=[3,3]` or
`--set grid.generate.annulus.inner=3`. The value is TOML; a word that is not TOML is a string.
Missing tables on the way are made. `--set petsc=` (no value) removes a key.
";

/// The reference of all sections and keys, in Markdown.
pub fn markdown() -> String {
    let mut out = format!("{INTRODUCTION}\n```toml\n{EXAMPLE}```\n\n{OPTIONS}\n");
    out.push_str("## Expressions\n\n");
    out.push_str(
        "A number, or a string with a formula. `X Y Z` is the position at the start, `x y z` the \
         current one, `s` the load factor from 0 to 1, `t` the time (in \
         analyses that have none the same as `s`); each key says which of them it takes. A \
         formula must have a finite value wherever it is needed: at the start this is checked \
         before anything is written, later it ends the run. Powers bind more tightly than signs (`-x^2` is negative), comparisons and \
         logic give 1 or 0. Known names are\n\n",
    );
    for part in expression::vocabulary().split("; ") {
        out.push_str(&format!("- {}\n", part.replace("||", "`||`")));
    }
    out.push_str(&format!("\n{}\n", fields()));
    for part in schema::sections() {
        out.push_str(&section(part));
    }
    // One empty line at the end would be one too many.
    out.trim_end().to_string() + "\n"
}

fn fields() -> String {
    let mut out = String::from(
        "## Fields\n\nPoint fields for `output.fields`; `verify.field` takes scalars, components \
         and whole vectors.\n\n| field | components | unit | meaning |\n|---|---|---|---|\n",
    );
    for Field { name, rank, unit, doc } in FIELDS {
        let components: Vec<String> =
            rank.components(3).iter().map(|c| format!("`.{c}`")).collect();
        let components = components.join(" ");
        out.push_str(&format!("| `{name}` | {components} | {unit} | {doc} |\n"));
    }
    for entry in CATALOGUE.iter().filter(|entry| !entry.state.is_empty()) {
        for variable in entry.state {
            let (name, unit) = (variable.name, variable.unit);
            out.push_str(&format!("| `{name}` | | {unit} | State of `{}` |\n", entry.name));
        }
    }
    out
}

/// Which side is which.
const SIDES_SKETCH: &str = "\
Sides are named by their axis: `left` and `right` are the lowest and the highest x, `bottom` and `top`
y, and in 3D `back` and `front` z. With x to the right and y up, z points out of the page:

```
                 top
          +---------------+
         /|              /|           y
        / |    back     / |           |
       +---------------+  |           |
 left  |  |            |  |  right    +---- x
       |  +------------|--+          /
       | /   front     | /          z
       |/              |/
       +---------------+
            bottom
```
";

/// A sentence on a choice without which a key is refused.
fn read_by(reader: &Reader) -> String {
    let values: Vec<String> = reader.values.iter().map(|value| format!("`\"{value}\"`")).collect();
    format!(" Only with `{}` = {}.", reader.choice, values.join(" or "))
}

fn section(section: &Section) -> String {
    let title = match section.name {
        "" => section.header.to_string(),
        _ => format!("`{}`", section.header),
    };
    let mut out = format!(
        "## {title}\n\n{}\n\n| key | value | unit | default | meaning |\n|---|---|---|---|---|\n",
        section.doc
    );
    let (head, table) = out.split_at(out.find("| key |").unwrap_or(out.len()));
    if section.name == "where" {
        out = format!("{head}{SIDES_SKETCH}\n{table}");
    }
    for key in section.keys {
        let range = key.range.describe();
        let mut value = match key.kind {
            Kind::Table(other) => format!("table `{}`", schema::section(other).header),
            Kind::Tables(other) | Kind::Named(other) => {
                format!("`{}`", schema::section(other).header)
            }
            // The list of fields has its own section.
            Kind::Choices(words) if words.len() == FIELDS.len() => "an array of fields".to_string(),
            kind => kind.describe(),
        };
        if !range.is_empty() {
            value = format!("{value}, {range}");
        }
        let default = match key.need {
            Need::Required => "required".to_string(),
            Need::Optional("-") => String::new(),
            Need::Optional(when) => when.to_string(),
            Need::Default(text) => format!("`{text}`"),
        };
        let readers: Vec<String> = key.readers.iter().map(read_by).collect();
        out.push_str(&format!(
            "| `{}` | {value} | {} | {default} | {}{} |\n",
            key.name,
            key.unit,
            key.doc,
            readers.concat()
        ));
    }
    out + "\n"
}
