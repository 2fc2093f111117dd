//! Softening in runs: the band's width, restart on the way down, bad decks.

mod common;

use std::path::Path;

use common::run::{Run, relative_difference};

/// A block under plane-strain compression between smooth plates.
const BLOCK: &str = r#"
[analysis]
type = "quasi-static"
steps = 12
max_iterations = 40
on_failure = "cut"
[method]
basis = "gimp"
[grid]
type = "lattice"
size = [2.0, 4.0]
h = 1.0
[material.clay]
model = "tresca"
young = 1e6
poisson = 0.3
shear_strength = "1e4*(1-0.01*(X<0.5 && Y<0.5))"
softening = { strain = 0.4, cohesion = 4e3, length = 0.5 }
[[body]]
name = "block"
material = "clay"
shape = { box = { min = [0, 0], max = [2, 4] } }
[[boundary]]
where = { side = "bottom" }
fix = ["y"]
[[boundary]]
where = { box = { min = [0, 0], max = [0, 0] } }
fix = ["x"]
[[boundary]]
name = "plate"
where = { side = "top" }
displacement = { y = "-0.16" }
[output]
every = 1
fields = ["kirchhoff_stress", "softening_strain", "plastic_strain"]
checkpoint = { every = 1, keep = 20 }
"#;

/// In cells of 1 m the figures of a band of 0.5 m are reached at half of the strain, and every point
/// has the strength of its strain.
#[test]
fn the_strength_of_a_point_is_that_of_its_strain_in_its_cells() {
    // One cell, whose strain cannot gather anywhere.
    let uniform = BLOCK
        .replace("\"1e4*(1-0.01*(X<0.5 && Y<0.5))\"", "1e4")
        .replace("strain = 0.4", "strain = 0.1")
        .replace("basis = \"gimp\"", "basis = \"mpm\"")
        .replace("size = [2.0, 4.0]", "size = [2.0, 1.0]")
        .replace("max = [2, 4]", "max = [1, 1]")
        .replace("-0.16", "-0.08");
    let results = Run::text(&uniform).ranks(2).results();
    let end = results.points(12);
    let (kappa, tau) = (end.field("softening_strain"), end.field("kirchhoff_stress"));
    for (p, kappa) in kappa.iter().enumerate() {
        let principal = [tau[6 * p], tau[6 * p + 3], tau[6 * p + 5]];
        let most = principal.iter().copied().fold(f64::MIN, f64::max);
        let least = principal.iter().copied().fold(f64::MAX, f64::min);
        let exact = if *kappa < 0.05 { 1e4 - 6e3 * kappa / 0.05 } else { 4e3 };
        assert!((0.5 * (most - least) - exact).abs() < 1e-5, "{kappa}: {most} {least}");
        assert!(*kappa > 0.05, "{kappa}");
    }
    // What the plate bears falls to the residual strength: 2 c on a width of a little over 1 m.
    let plate = results.history("reaction.plate.y");
    let peak = plate.iter().fold(0.0f64, |most, r| most.max(r.abs()));
    let last = plate.last().expect("a row").abs();
    assert!((1.0..1.2).contains(&(last / (2.0 * 4e3))) && peak > 1.5 * last, "{peak} {last}");
}

/// A weak corner, so that the strain gathers; restart half-way down is bit by bit on as many ranks.
#[test]
fn a_run_goes_on_in_the_middle_of_the_fall() {
    let whole = Run::text(BLOCK).results();
    let middle = whole.points(8);
    let falling = middle.field("softening_strain").iter().filter(|k| (0.001..0.19).contains(*k));
    assert!(falling.count() > 3);
    let checkpoint = whole.directory.join("checkpoint-000008.h5").display().to_string();
    let part = Run::text(BLOCK).word("--restart").word(checkpoint).results();
    for field in ["kirchhoff_stress", "softening_strain"] {
        let (a, b) = (whole.points(12), part.points(12));
        assert_eq!(relative_difference(a.field(field), b.field(field)), 0.0, "{field}");
    }
}

#[test]
fn softening_without_a_length_is_refused() {
    let message = |deck: &str| {
        let error = mpm_par::deck::read(Path::new("deck.toml"), deck, &[]).expect_err("faulty");
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    };
    let without = message(&BLOCK.replace(", length = 0.5", ""));
    assert!(without.contains("material.clay.softening.length: missing"), "{without}");
    let uniform = BLOCK.replace("\"1e4*(1-0.01*(X<0.5 && Y<0.5))\"", "1e4");
    let more = message(&uniform.replace("cohesion = 4e3", "cohesion = 4e4"));
    assert!(more.contains("softening.cohesion: 40000 is more than the peak value"), "{more}");
}
