//! Keys of the top level: the tables that a deck consists of.

use std::sync::LazyLock;

use super::Kind::{Named, Special, Table, Tables, Text};
use super::Need::{Default, Optional, Required};
use super::{ELEMENT_TEST, Key, LOADED, ON_GRID, Section, key};
use crate::system::terms::KEYS;

const BEFORE: &[Key] = &[
    key("title", Text, Default("\"\""), "Shown in the banner and stored with the results."),
    key("analysis", Table("analysis"), Required, "What is solved, and how finely."),
    key("method", Table("method"), Optional("all defaults"), "Variant of the method.")
        .read_by(&[ON_GRID]),
    key(
        "ghost",
        Table("ghost"),
        Optional("on, with the default factors of [ghost]"),
        "Ghost stabilisation; `ghost = \"off\"`, before the first table, turns it off.",
    )
    .read_by(&[ON_GRID]),
    key("grid", Table("grid"), Required, "Background grid.").read_by(&[ON_GRID]),
    key("material", Named("material"), Required, "At least one `[material.NAME]`."),
    key("body", Tables("body"), Required, "At least one `[[body]]`.").read_by(&[ON_GRID]),
    key("boundary", Tables("boundary"), Optional("none"), "Prescribed displacements.")
        .read_by(&[ON_GRID]),
    key("load", Tables("load"), Optional("none"), "Forces.").read_by(&[LOADED]),
    key("rigid", Tables("rigid"), Optional("none"), "Rigid bodies.").read_by(&[LOADED]),
    key("contact", Tables("contact"), Optional("none"), "Which bodies touch which rigid bodies.")
        .read_by(&[LOADED]),
    key("water", Table("water"), Optional("dry"), "Still water at a given level.")
        .read_by(&[LOADED]),
];

const AFTER: &[Key] = &[
    key("stage", Tables("stage"), Optional("one stage of analysis.steps"),
        "Stages in their order: what comes, goes and ramps in each.")
        .read_by(&[LOADED]),
    key("verify", Tables("verify"), Optional("none"), "Figures of merit.")
        .read_by(&[ON_GRID]),
    key("probe", Tables("probe"), Optional("none"), "Points that are watched.")
        .read_by(&[ON_GRID]),
    key("output", Table("output"), Optional("all defaults"), "What is written, and when.")
        .read_by(&[ON_GRID]),
    key("parallel", Table("parallel"), Optional("all defaults"), "Distribution.")
        .read_by(&[ON_GRID]),
    key("petsc", Special("a table of strings, numbers or true"), Optional("none"),
        "PETSc options of the solvers (`qs_`, `mass_`, `kappa_`) by name without the dash; `true` is a bare flag. No files, no viewers but the terminal; of other options only `log_view = true`: the command line takes all.")
        .read_by(&[ON_GRID]),
    key("conditioning", Table("conditioning"),
        Optional("needed by type = \"conditioning\""), "Rigid motion of the study."),
    key("element_test", Table("element_test"),
        Optional("needed by type = \"element-test\""), "Path of the test.")
        .read_by(&[ELEMENT_TEST]),
];

/// The section of the top level, with the keys of the terms that a deck may switch on.
pub fn section() -> &'static Section {
    static TOP: LazyLock<Section> = LazyLock::new(|| Section {
        name: "",
        header: "the top level",
        doc: "What a deck consists of.",
        keys: Vec::leak([BEFORE, KEYS, AFTER].concat()),
    });
    &TOP
}
