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

pub fn beam_on_triangles() -> Run {
    let triangles = box_mesh("[0, 0]", "[11, 10]", "[22, 20]", "tri3");
    with_grid("beam", &triangles).set("method.basis=\"cpdi2\"")
}

#[test]
fn a_stabilised_beam_bends_on_triangles() {
    let results = beam_on_triangles().set("analysis.steps=20").results();
    assert!(results.history("ghost_faces").iter().all(|&count| count > 0.0));
    let tip = |step| positions(&results, step).chunks_exact(3).map(|x| x[1]).fold(10.0, f64::min);
    assert!(tip(20) < 8.0, "the beam bends by more than a metre: {}", tip(20));
}

/// A disc (ball) moved through the grid, 2 points a cell and axis: condition numbers of mass and
/// stiffness.
fn round(grid: &str, dimension: usize, spacing: f64, steps: usize) -> Run {
    let list = |values: [&str; 3]| format!("[{}]", values[..dimension].join(", "));
    let deck = format!(
        "title = \"round\"\n[analysis]\ntype = \"conditioning\"\nsteps = {steps}\n\
         [conditioning]\ndisplacement = {}\n[method]\nbasis = \"mpm\"\n\
         [ghost]\nmass_factor = 0.25\nstiffness_factor = 1.0\n[grid]\n{grid}\n\
         [material.soft]\nmodel = \"hencky\"\nyoung = 1.0\npoisson = 0.3\n\
         [[body]]\nname = \"body\"\nmaterial = \"soft\"\ndensity = 1.0\n\
         lattice = {{ spacing = {spacing} }}\n\
         shape = {{ {} = {{ centre = {}, radius = 0.5 }} }}\n\
         [[boundary]]\nwhere = {{ box = {{ min = {}, max = {} }} }}\nfix = {}\n",
        list(["0.2", "0.13", "0.11"]),
        if dimension == 2 { "disc" } else { "ball" },
        list(["0.9"; 3]),
        list(["0.7"; 3]),
        list(["1.3"; 3]),
        list(["\"x\"", "\"y\"", "\"z\""]),
    );
    Run::text(&deck)
}

fn disc(grid: &str) -> Run {
    round(grid, 2, 0.0625, 20)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

#[test]
fn mass_and_stiffness_are_bounded_on_meshes() {
    let lattice = disc("type = \"lattice\"\norigin = [0, 0]\nsize = [2, 2]\nh = 0.125").results();
    let quads = disc(&box_mesh("[0, 0]", "[2, 2]", "[16, 16]", "quad4")).results();
    for name in ["kappa_mass_ghost", "kappa_stiffness_ghost"] {
        let (a, b) = (lattice.history(name), quads.history(name));
        for (a, b) in a.iter().zip(&b) {
            assert!((a / b - 1.0).abs() < 1e-5, "{name}: {a} on the lattice, {b} on the mesh");
        }
    }
}

/// Cells behind an empty triangle or tetrahedron are tied down across it: 201 (2D) and 210 (3D)
/// here, 4.9e4 in 2D without those faces.
#[test]
fn mass_is_bounded_on_simplices() {
    let triangles = disc(&box_mesh("[0, 0]", "[2, 2]", "[16, 16]", "tri3"));
    let [tetrahedra, bricks] = ["tet4", "hex8"].map(|element| {
        round(&box_mesh("[0, 0, 0]", "[2, 2, 2]", "[8, 8, 8]", element), 3, 0.125, 8)
    });
    let worst = |run: &Run, name: &str| largest(&run.results().history(name));
    for run in [&triangles, &tetrahedra, &bricks] {
        let mass = worst(run, "kappa_mass_ghost");
        assert!(mass < 250.0, "{mass:e}");
    }
    // Standard points on linear simplices: gradients do not depend on the place, so the bare
    // stiffness is well conditioned by itself where no node hangs on.
    assert!(worst(&triangles, "kappa_stiffness_ghost") < 2.5e3);
    assert!(worst(&tetrahedra, "kappa_stiffness_ghost") < 250.0);
    let bare = largest(&triangles.results().history("kappa_mass"));
    assert!(bare > 1e5, "{bare:e}");
}
