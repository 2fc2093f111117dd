//! Ghost faces on meshes: a mesh of squares is a lattice, and triangles are as well served.

use crate::common::run::{Results, Run, input, relative_difference};

/// The deck with another grid; sides of the lattice become the tags of a generated box.
fn with_grid(name: &str, grid: &str) -> Run {
    let text = std::fs::read_to_string(input(name)).expect("a deck of this project");
    let begin = text.find("[grid]").expect("a grid");
    let end = begin + text[begin..].find("[material").expect("a material after the grid");
    let text = format!("{}[grid]\n{grid}\n\n{}", &text[..begin], &text[end..]);
    Run::text(&text.replace("side =", "tag ="))
}

fn box_mesh(min: &str, max: &str, cells: &str, element: &str) -> String {
    format!(
        "type = \"mesh\"\ngenerate = {{ box = {{ min = {min}, max = {max}, cells = {cells}, \
         element = \"{element}\" }} }}"
    )
}

fn positions(results: &Results, step: usize) -> Vec<f64> {
    results.points(step).field("position").to_vec()
}

const LATTICE: &str = "type = \"lattice\"\norigin = [0, 0]\nsize = [11, 10]\nh = 0.5";

#[test]
fn a_stabilised_beam_is_the_same_on_a_lattice_and_on_a_mesh_of_squares() {
    let quads = box_mesh("[0, 0]", "[11, 10]", "[22, 20]", "quad4");
    for scaling in ["published", "scale-free"] {
        let run = |grid: &str| {
            let lattice = grid == LATTICE;
            let run = with_grid("beam", grid);
            let run = if lattice {
                // with_grid renamed the side; a lattice has no tags
                run.set("boundary.0.where={ side = \"left\" }")
            } else {
                run
            };
            run.set("method.basis=\"mpm\"")
                .set("analysis.steps=10")
                .set("analysis.tolerance=1e-8")
                .set(format!("ghost.scaling=\"{scaling}\""))
                .results()
        };
        let (lattice, mesh) = (run(LATTICE), run(&quads));
        let difference = relative_difference(&positions(&mesh, 10), &positions(&lattice, 10));
        assert!(difference < 1e-9, "{scaling}: {difference:e}");
        let faces = [&lattice, &mesh].map(|results| results.history("ghost_faces"));
        assert_eq!(faces[0], faces[1], "{scaling}");
        assert!(faces[0][0] > 0.0);
    }
}

#[test]
fn a_stabilised_beam_bends_on_triangles() {
    let triangles = box_mesh("[0, 0]", "[11, 10]", "[22, 20]", "tri3");
    let run = with_grid("beam", &triangles).set("method.basis=\"cpdi2\"").set("analysis.steps=20");
    let results = run.results();
    assert!(results.history("ghost_faces").iter().all(|&count| count > 0.0));
    let tip = |step| positions(&results, step).chunks_exact(3).map(|x| x[1]).fold(10.0, f64::min);
    assert!(tip(20) < 8.0, "the beam bends by more than a metre: {}", tip(20));
}

/// A disc moved through the grid, 2 x 2 points a cell: condition numbers of mass and stiffness.
fn disc(grid: &str) -> Results {
    let deck = format!(
        "title = \"disc\"\n[analysis]\ntype = \"conditioning\"\nsteps = 20\n\
         [conditioning]\ndisplacement = [0.2, 0.13]\n[method]\nbasis = \"mpm\"\n\
         [ghost]\nmass_factor = 0.25\nstiffness_factor = 1.0\n[grid]\n{grid}\n\
         [material.soft]\nmodel = \"hencky\"\nyoung = 1.0\npoisson = 0.3\n\
         [[body]]\nname = \"disc\"\nmaterial = \"soft\"\ndensity = 1.0\n\
         lattice = {{ spacing = 0.0625 }}\n\
         shape = {{ disc = {{ centre = [0.9, 0.9], radius = 0.5 }} }}\n\
         [[boundary]]\nwhere = {{ box = {{ min = [0.8, 0.8], max = [1.2, 1.2] }} }}\n\
         fix = [\"x\", \"y\"]\n"
    );
    Run::text(&deck).results()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

#[test]
fn mass_and_stiffness_are_bounded_on_meshes() {
    let lattice = disc("type = \"lattice\"\norigin = [0, 0]\nsize = [2, 2]\nh = 0.125");
    let quads = disc(&box_mesh("[0, 0]", "[2, 2]", "[16, 16]", "quad4"));
    for name in ["kappa_mass_ghost", "kappa_stiffness_ghost"] {
        let (a, b) = (lattice.history(name), quads.history(name));
        for (a, b) in a.iter().zip(&b) {
            assert!((a / b - 1.0).abs() < 1e-5, "{name}: {a} on the lattice, {b} on the mesh");
        }
    }
    let triangles = disc(&box_mesh("[0, 0]", "[2, 2]", "[16, 16]", "tri3"));
    // A ragged cut leaves triangles whose neighbours are all empty: no face ties those down, so
    // the mass is bounded less firmly than on squares. The bare stiffness of standard points on
    // linear triangles is well conditioned by itself: gradients do not depend on the place.
    let mass = largest(&triangles.history("kappa_mass_ghost"));
    let bare = largest(&triangles.history("kappa_mass"));
    assert!(mass < 1e5 && (bare > 10.0 * mass || bare.is_nan()), "{mass:e}, bare {bare:e}");
    let stiffness = largest(&triangles.history("kappa_stiffness_ghost"));
    assert!(stiffness < 1e4, "{stiffness:e}");
}
