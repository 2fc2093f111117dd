//! The schema: every key of the deck once, with type, unit, default, range and meaning.
//!
//! | file | idea |
//! |---|---|
//! | `mod.rs` | what a key is |
//! | `top.rs` | keys of the top level, with those of terms from what they declare |
//! | `problem.rs` | keys of the analysis: analysis, stage, method, ghost, grid |
//! | `materials.rs` | keys of materials, from what the models declare |
//! | `bodies.rs` | keys of what is analysed: bodies, shapes, boundaries, water |
//! | `loads.rs` | keys of loads, from what they declare |
//! | `contact.rs` | keys of rigid bodies and contact |
//! | `results.rs` | keys of what is written and watched: verify, probe, output, parallel |
//!
//! Known keys, type and range checks, defaults, the resolved deck and `docs/guide/deck.md` all come
//! from here.

mod bodies;
mod contact;
mod loads;
pub(crate) mod materials;
mod problem;
mod results;
mod top;

use crate::system::terms;

pub use crate::material::parameter::{ANY, POSITIVE, Range, at_least, between, inside};
pub use bodies::{BOX_KEYS, SIDES};
pub use loads::OF_BODY;

/// Components of a direction, in order.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// What a value may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A string.
    Text,
    /// A number.
    Number,
    /// A whole number.
    Count,
    /// true or false.
    Flag,
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A list of some of these words.
    Choices(&'static [&'static str]),
    /// A number or a formula in these variables.
    Expression(&'static str),
    /// One number or formula per axis.
    Expressions(&'static str),
    /// One number per axis.
    Vector,
    /// Whole numbers, one per axis.
    Counts,
    /// One number for all axes, or one per axis.
    NumberOrVector,
    /// One whole number for all axes, or one per axis.
    CountOrCounts,
    /// A list of positions.
    Points,
    /// A table with the keys of this section.
    Table(&'static str),
    /// A table whose keys the user names.
    Named(&'static str),
    /// An array of tables.
    Tables(&'static str),
    /// Read by its own code; the text says what is accepted.
    Special(&'static str),
}

impl Kind {
    /// For messages and documentation.
    pub fn describe(&self) -> String {
        match self {
            Kind::Text => "a string".into(),
            Kind::Number => "a number".into(),
            Kind::Count => "a whole number".into(),
            Kind::Flag => "true or false".into(),
            Kind::Choice(words) => format!("one of {}", quoted(words)),
            Kind::Choices(words) => format!("an array of {}", quoted(words)),
            Kind::Expression(variables) => {
                format!("a number or an expression (string) of {variables}")
            }
            Kind::Expressions(variables) => {
                format!("an array of numbers or expressions (strings) of {variables}, one per axis")
            }
            Kind::Vector => "an array of numbers, one per axis".into(),
            Kind::Counts => "an array of whole numbers, one per axis".into(),
            Kind::NumberOrVector => "a number, or an array of one per axis".into(),
            Kind::CountOrCounts => "a whole number, or an array of one per axis".into(),
            Kind::Points => "an array of positions, each an array of one number per axis".into(),
            Kind::Table(_) => "a table".into(),
            Kind::Named(_) => "tables, each under a name of its own".into(),
            Kind::Tables(_) => "an array of tables".into(),
            Kind::Special(text) => (*text).into(),
        }
    }
}

/// Words in quotation marks, with commas.
pub fn quoted(words: &[&str]) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}

/// Whether a key may be left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Need {
    /// It must be given.
    Required,
    /// The text says when it is needed or what happens without it.
    Optional(&'static str),
    /// A TOML value.
    Default(&'static str),
}

/// One key of the deck.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// As the deck spells it.
    pub name: &'static str,
    /// What its value may be.
    pub kind: Kind,
    /// SI unit, or empty.
    pub unit: &'static str,
    /// Whether it may be left out.
    pub need: Need,
    /// Where a number must lie.
    pub range: Range,
    /// Choices that read it: all must have been made. Empty: it is always read.
    pub readers: &'static [Reader],
    /// Its meaning, for the reference.
    pub doc: &'static str,
}

/// A choice made elsewhere in the deck, by its dotted path, and its values that read a key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reader {
    /// Dotted path of the choice.
    pub choice: &'static str,
    /// Values of it that read the key.
    pub values: &'static [&'static str],
}

/// The choices of `choice` that read a key.
pub const fn only(choice: &'static str, values: &'static [&'static str]) -> Reader {
    Reader { choice, values }
}

/// Analyses that solve equilibrium by iterations.
pub const IMPLICIT: Reader =
    only("analysis.type", &["quasi-static", "strength-reduction", "implicit-dynamic"]);
const QUASI_STATIC: Reader = only("analysis.type", &["quasi-static", "strength-reduction"]);
const STRENGTH_REDUCTION: Reader = only("analysis.type", &["strength-reduction"]);
const EXPLICIT: Reader = only("analysis.type", &["explicit"]);
const IMPLICIT_DYNAMIC: Reader = only("analysis.type", &["implicit-dynamic"]);
/// Analyses in which the bodies have inertia.
const DYNAMIC: Reader = only("analysis.type", &["explicit", "implicit-dynamic"]);
/// Analyses that move the bodies by forces.
pub const LOADED: Reader =
    only("analysis.type", &["quasi-static", "strength-reduction", "explicit", "implicit-dynamic"]);
/// Analyses with a stiffness matrix, and with a mass matrix: what Ghost stabilises.
const STIFF: Reader = only(
    "analysis.type",
    &["quasi-static", "strength-reduction", "implicit-dynamic", "conditioning"],
);
const HEAVY: Reader = only("analysis.type", &["explicit", "implicit-dynamic", "conditioning"]);
/// Analyses of bodies on a grid.
const ON_GRID: Reader = only(
    "analysis.type",
    &["quasi-static", "strength-reduction", "explicit", "implicit-dynamic", "conditioning"],
);
const ELEMENT_TEST: Reader = only("analysis.type", &["element-test"]);
const GIMP: Reader = only("method.basis", &["gimp"]);

/// A key without unit, range and readers.
pub const fn key(name: &'static str, kind: Kind, need: Need, doc: &'static str) -> Key {
    Key { name, kind, unit: "", need, range: ANY, readers: &[], doc }
}

/// `from` of what may be there before the first stage.
const fn from_stage(absent: &'static str) -> Key {
    const DOC: &str =
        "The stage it comes with; \"initial\": it has been there before the first one.";
    key("from", Kind::Text, Need::Optional(absent), DOC).read_by(&[LOADED])
}

const UNTIL: Key =
    key("until", Kind::Text, Need::Optional("it stays"), "The last stage in which it is there.")
        .read_by(&[LOADED]);

impl Key {
    /// With an SI unit.
    pub const fn unit(self, unit: &'static str) -> Self {
        Key { unit, ..self }
    }

    /// With a range for numbers.
    pub const fn range(self, range: Range) -> Self {
        Key { range, ..self }
    }

    /// Read by these choices alone.
    pub const fn read_by(self, readers: &'static [Reader]) -> Self {
        Key { readers, ..self }
    }
}

/// A table of the deck.
#[derive(Debug, Clone, Copy)]
pub struct Section {
    /// Name inside the schema.
    pub name: &'static str,
    /// How the table is written in a deck.
    pub header: &'static str,
    /// Its meaning, for the reference.
    pub doc: &'static str,
    /// In the order of the reference.
    pub keys: &'static [Key],
}

/// All sections, in the order of the documentation.
pub fn sections() -> impl Iterator<Item = &'static Section> {
    let problem = problem::SECTIONS.iter().chain(materials::sections());
    let analysed = bodies::SECTIONS.iter().chain(loads::sections()).chain(contact::SECTIONS);
    let terms = terms::SECTIONS.iter().copied().flatten();
    let all = std::iter::once(top::section()).chain(problem).chain(analysed).chain(terms);
    all.chain(results::SECTIONS)
}

/// The section of that name. Names are fixed in this module, so that it always exists.
pub fn section(name: &str) -> &'static Section {
    sections().find(|section| section.name == name).expect("sections are named by constants")
}

impl Section {
    /// The key of that name, if the section has it.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|key| key.name == name)
    }
}
