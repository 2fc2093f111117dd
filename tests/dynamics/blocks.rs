//! Small decks of blocks of one soft material, 10 kg/m3, on cells of 1 m. What differs between
//! tests is set on top.

use crate::common::run::Run;

const DECK: &str = r#"
title = "Blocks"
ghost = "off"
[analysis]
type = "explicit"
steps = 60
duration = 0.03
[method]
basis = "mpm"
[grid]
type = "lattice"
size = [8, 8]
h = 1.0
[material.soft]
model = "hencky"
young = 1000
poisson = 0.3
[output]
every = 10000
fields = ["displacement", "velocity"]
"#;

/// One body for each piece of text, which gives its shape, and further keys if it has any.
pub fn blocks(bodies: &[&str]) -> Run {
    let mut text = DECK.to_string();
    for body in bodies {
        text += &format!("[[body]]\nmaterial = \"soft\"\ndensity = 10\n{body}\n");
    }
    Run::text(&text)
}
