//! The numbers that docs/guide/gallery.md states are those of the decks that `--new` writes.

mod common;

use std::f64::consts::PI;

use common::run::{Results, Run, last, probed};
use mpm_par::deck::templates::template_of;

/// Template; how the page states the number; its value in the results; the largest relative error.
type Entry = (&'static str, &'static str, fn(&Results) -> f64, f64, f64);

const GALLERY: [Entry; 8] = [
    ("beam", "8.10 m", |r| -probed(r, "tip.displacement.y"), 8.10, 0.005),
    ("slope", "18.0 mm", |r| -1e3 * probed(r, "crest.displacement.y"), 18.0, 0.01),
    ("footing", "5.49", |r| -last(r, "reaction.footing.y") / 10e3, 5.49, 0.003),
    ("excavation", "15.1 mm", |r| 1e3 * probed(r, "bottom.displacement.y"), 15.1, 0.01),
    (
        "cone",
        "5.5 times",
        |r| -last(r, "reaction.cone.y") / (PI * (0.58f64 * 0.018).powi(2) * 10e3),
        5.5,
        0.03,
    ),
    (
        "column-collapse",
        "0.21 m",
        |r| r.summary["bodies"]["column"]["max"][0].as_f64().expect("a place") - 0.1,
        0.21,
        0.05,
    ),
    (
        "collision",
        "96 %",
        |r| {
            let of = |name: &str| r.history(name);
            100.0 * (last(r, "energy_kinetic") + last(r, "energy_strain")) / of("energy_kinetic")[0]
        },
        96.0,
        0.01,
    ),
    (
        "triaxial",
        "234.0 kPa",
        |r| {
            let text = r.text("element.csv");
            let header = text.lines().next().expect("a header");
            let at = header.split(',').position(|name| name.starts_with("q [")).expect("a column");
            let row = text.trim_end().lines().last().expect("a row");
            1e-3 * row.split(',').nth(at).expect("a value").parse::<f64>().expect("a number")
        },
        234.0,
        0.001,
    ),
];

#[test]
fn the_gallery_states_what_its_decks_give() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/guide/gallery.md");
    let page = std::fs::read_to_string(page).expect("a page");
    for (name, stated, value, number, within) in GALLERY {
        let row = page.lines().find(|line| line.contains(&format!("`--new {name}`")));
        let row = row.unwrap_or_else(|| panic!("{name} is not in the gallery"));
        assert!(row.contains(stated), "{name}: {stated} is not stated: {row}");
        let results = Run::text(template_of(name).expect("a template").text).ranks(2).results();
        let found = value(&results);
        assert!((found / number - 1.0).abs() <= within, "{name}: {found}, stated: {number}");
    }
}
