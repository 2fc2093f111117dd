//! Decks that are wrong: the messages, word for word.

use std::path::Path;

use mpm_par::deck;

const BEAM: &str = include_str!("decks/beam.toml");
const COLLISION: &str = include_str!("decks/collision.toml");
const ANNULUS: &str = include_str!("decks/annulus.toml");
const CUBE: &str = include_str!("decks/cube.toml");

fn message(text: &str, sets: &[&str]) -> String {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_string()).collect();
    let error = deck::read(Path::new("beam.toml"), text, &sets).expect_err("a faulty deck");
    assert_eq!(error.exit_code(), 2);
    error.to_string()
}

/// The beam with one piece of text replaced.
fn replaced(from: &str, to: &str) -> String {
    assert!(BEAM.contains(from), "{from}");
    message(&BEAM.replacen(from, to, 1), &[])
}
#[test]
fn print_all() {
    for (a, b) in [
        ("steps = 50", "steps = = 50"),
        ("tolerance = 1e-9", "tolerence = 1e-9"),
        ("tolerance = 1e-9", "tolerance = \"small\""),
        ("poisson = 0.2", "poisson = 0.5"),
        ("basis = \"gimp\"", "basis = \"gmip\""),
        ("max = [10, 10]", "max = [10, 10, 1]"),
        ("size = [11.0, 10.0]", "size = [11.3, 10.0]"),
        ("material = \"steel\"\n", "material = \"stel\"\n"),
        ("fix = [\"x\"]", "fix = [\"z\"]"),
        ("exact = \"80*10*(Y-50)\"", "exact = \"80*1O*(Y-50)\""),
        ("[grid]\n", "[gird]\n"),
        ("steps = 50\n", ""),
        ("field = \"stress.yy\"", "field = \"stress\""),
        ("body = \"beam\"", "body = \"bean\""),
        ("young", "density"),
        ("fix = [\"y\"]", "fix = [\"x\"]"),
        ("steps = 50", "steps = 5.5"),
        ("[10, 9.51]]", "[10]]"),
        ("h = 0.5", "h = 0"),
    ] {
        println!("--- {a} -> {b}\n{}", replaced(a, b));
    }
    for (t, s) in [
        (BEAM, vec!["boundary="]),
        (ANNULUS, vec!["method.basis=gimp"]),
        (COLLISION, vec!["body.0.density=0"]),
        (COLLISION, vec!["body.0.lattice={spacing=0.2}"]),
        (CUBE, vec!["analysis.steps=0"]),
        (CUBE, vec!["body.0.gauss=2"]),
        (CUBE, vec!["analysis.type=conditioning", "analysis.duration="]),
        (BEAM, vec!["body.0.shape.translate=[20,0]"]),
        (BEAM, vec!["a"]),
        (ANNULUS, vec!["boundary.0.rotation=", "boundary.0.fix=[\"x\"]"]),
    ] {
        println!("--- {s:?}\n{}", message(t, &s));
    }
    println!("{}", message("", &[]));
}
