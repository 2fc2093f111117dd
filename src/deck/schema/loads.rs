//! Keys of `[[load]]`: what each load of [`crate::loads`] declares, and when it acts.

use std::sync::LazyLock;

use super::{Key, Kind, Need, SIDES, Section, UNTIL, from_stage, key};
use crate::loads::{KEYS, SECTIONS};

/// A part of a body's own surface.
pub const OF_BODY: &[Key] = &[
    key("body", Kind::Text, Need::Optional("the only body"), "Name of a body given as a shape."),
    key("side", Kind::Choice(SIDES), Need::Optional("the whole surface"), SIDE),
    key("where", Kind::Text, Need::Optional("everywhere"), WITHIN),
];

const SIDE: &str = "The part whose outward normal, in the frame of the shape before rotate, is nearest to this direction: a box's own side, a quarter of a disc.";
const WITHIN: &str = "Condition on x, y, z at the start, such as \"x*x + y*y < 2\".";

const FROM: Key =
    from_stage("the first stage; initial for a constant gravity in a deck with initial_stress");

/// The section of loads and those of the tables inside it.
pub fn sections() -> &'static [Section] {
    static ALL: LazyLock<Vec<Section>> = LazyLock::new(|| {
        let keys = KEYS.iter().chain(&[FROM, UNTIL]).copied().collect();
        let load = Section {
            name: "load",
            header: "[[load]]",
            doc: "Exactly one of the keys but from and until. Values are numbers or expressions. In quasi-static analyses a value that holds neither s nor t grows with s; one that holds s or t is taken as it is.",
            keys: Vec::leak(keys),
        };
        std::iter::once(load).chain(SECTIONS.iter().copied().flatten().copied()).collect()
    });
    &ALL
}
