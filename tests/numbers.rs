//! Numbers of points (`id`) go from 0 on without gaps and belong to the same points on any number of ranks,
//! from the start, after a restart, and in stages.

mod common;

use common::run::{Results, Run};

/// Two bodies whose seeding leaves most candidates out: a disc, and a turned lattice in a ring.
const DECK: &str = r#"
[analysis]
type = "explicit"
steps = 6
duration = 6e-3

[method]
basis = "mpm"
mass = "lumped"

[grid]
type = "lattice"
size = [6.0, 4.0]
h = 0.5

[material.rubber]
model = "hencky"
young = 1e4
poisson = 0.3

[[body]]
material = "rubber"
density = 1e3
shape = { disc = { centre = [1.6, 2.0], radius = 1.3 } }
velocity = [5, 1]

[[body]]
material = "rubber"
density = 1e3
shape = { difference = [{ disc = { centre = [4.4, 2], radius = 1.2 } }, { disc = { centre = [4.4, 2], radius = 0.5 } }], rotate = { degrees = 20, about = [4.4, 2] } }
lattice = { spacing = 0.17 }

[output]
every = 3
fields = ["position_initial"]
checkpoint = { every = 3 }
"#;

/// Place at the start and body, in the order of the numbers, which are 0, 1, 2, ...
fn in_order(results: &Results, step: usize) -> Vec<(usize, [f64; 2])> {
    let points = results.points(step);
    let (starts, bodies) = (points.component("position_initial", 0), points.component("body", 0));
    let second = points.component("position_initial", 1);
    let mut rows: Vec<_> = (0..points.id.len())
        .map(|p| (points.id[p], bodies[p] as usize, [starts[p], second[p]]))
        .collect();
    rows.sort_by_key(|row| row.0);
    let numbers: Vec<usize> = rows.iter().map(|row| row.0 as usize).collect();
    assert_eq!(numbers, (0..rows.len()).collect::<Vec<_>>(), "gaps, or numbers twice");
    rows.into_iter().map(|(_, body, place)| (body, place)).collect()
}

#[test]
fn numbers_have_no_gaps_on_any_number_of_ranks() {
    let one = Run::text(DECK).results();
    let first = in_order(&one, 0);
    assert!(first.len() > 190 && first.is_sorted_by_key(|row| row.0), "body by body");
    assert_eq!(in_order(&one, 6), first);
    for ranks in [2, 3, 4] {
        let results = Run::text(DECK).ranks(ranks).results();
        assert_eq!(in_order(&results, 0), first, "{ranks} ranks");
        assert_eq!(in_order(&results, 6), first, "{ranks} ranks");
    }
    let checkpoint = one.directory.join("checkpoint-000003.h5").display().to_string();
    let again = Run::text(DECK).ranks(2).word("--restart").word(checkpoint);
    assert_eq!(in_order(&again.results(), 6), first, "a restart");
}

/// On a mesh points are made again where they arrive.
#[test]
fn numbers_on_a_mesh_have_no_gaps() {
    let mesh = DECK
        .replace("type = \"lattice\"\nsize = [6.0, 4.0]\nh = 0.5", "type = \"mesh\"\ngenerate = { box = { min = [0, 0], max = [6, 4], cells = [12, 8], element = \"tri3\" } }");
    let first = in_order(&Run::text(&mesh).results(), 0);
    assert_eq!(in_order(&Run::text(&mesh).ranks(3).results(), 0), first);
}

/// Bodies that come later have their numbers from the start, also where a checkpoint was written before.
#[test]
fn numbers_of_later_bodies_are_kept() {
    let staged = DECK
        .replace("steps = 6\nduration = 6e-3\n", "")
        .replace("lattice = { spacing = 0.17 }", "lattice = { spacing = 0.17 }\nfrom = \"late\"")
        .replace("[output]", "[[stage]]\nname = \"early\"\nsteps = 4\nduration = 4e-3\n[[stage]]\nname = \"late\"\nsteps = 2\nduration = 2e-3\n[output]");
    let whole = Run::text(&staged).results();
    let first = in_order(&whole, 6);
    let checkpoint = whole.directory.join("checkpoint-000003.h5").display().to_string();
    let again = Run::text(&staged).ranks(3).word("--restart").word(checkpoint).results();
    assert_eq!(in_order(&again, 6), first);
}
