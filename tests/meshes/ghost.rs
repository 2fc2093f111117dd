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

/// A body that ends in the tip of one simplex, and a point in the simplex across that tip, which
/// has two or more empty ones between it and the body on either side.
fn loose(dimension: usize) -> Run {
    let (h, per_cell) = (0.125, [16, 8][dimension - 2]);
    let n = [4, 2][dimension - 2];
    let axis: Vec<f64> =
        (0..4 * n).map(|k| 0.5 + (f64::from(k) + 0.5) * h / f64::from(n)).collect();
    // Off the planes that part the simplices.
    let shifts = [0.0, -0.03 * h, -0.06 * h];
    let mut places = vec![Vec::new()];
    for shift in &shifts[..dimension] {
        let along =
            |place: Vec<f64>| axis.iter().map(move |x| [place.as_slice(), &[x + shift]].concat());
        places = places.into_iter().flat_map(along).collect();
    }
    // The simplices where x > y > z; the tip is their corner at the far end of the diagonal.
    places.retain(|place| place.windows(2).all(|pair| pair[0] > pair[1]));
    places.push([1.01, 1.02, 1.04][..dimension].to_vec());
    let volume = h.powi(dimension as i32) / f64::from(per_cell);
    let rows: Vec<String> = places
        .iter()
        .map(|place| {
            place.iter().map(|x| format!("{x},")).collect::<String>() + &volume.to_string()
        })
        .collect();
    let folder = std::env::temp_dir().join(format!("loose-{dimension}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a scratch folder");
    let csv = folder.join("loose.csv");
    let header = ["x,y,volume", "x,y,z,volume"][dimension - 2];
    std::fs::write(&csv, format!("{header}\n{}\n", rows.join("\n"))).expect("writable");
    let (grid, body) = if dimension == 2 {
        (box_mesh("[0, 0]", "[2, 2]", "[16, 16]", "tri3"), "disc = {")
    } else {
        (box_mesh("[0, 0, 0]", "[2, 2, 2]", "[16, 16, 16]", "tet4"), "ball = {")
    };
    let run = round(&grid, dimension, 0.0625, 1);
    run.replaced(|text| {
        let begin = text.find("lattice = {").expect("a seeding");
        let end = begin + text[begin..].find("[[boundary]]").expect("a boundary");
        assert!(text[begin..end].contains(body), "{text}");
        let points = format!("shape = {{ points = {:?} }}\n", csv.display().to_string());
        format!("{}{points}{}", &text[..begin], &text[end..])
    })
}

/// A simplex that holds on by a node only, behind two empty ones, is tied to the body: without
/// that the one point in it would leave its other nodes undetermined.
#[test]
fn simplices_behind_two_empty_ones_are_tied() {
    for dimension in [2, 3] {
        let run = loose(dimension);
        let names = ["kappa_mass_ghost", "kappa_stiffness_ghost", "ghost_faces"];
        let of = |ranks: usize| {
            let results = run.clone().ranks(ranks).results();
            names.map(|name| results.history(name)[0])
        };
        let one = of(1);
        assert!(one[0] < 1e3 && one[1] < 3e3, "{dimension}D: {one:?}");
        for ranks in [2, 3, 4] {
            let several = of(ranks);
            for (a, b) in several.iter().zip(&one) {
                assert!(
                    (a / b - 1.0).abs() < 1e-8,
                    "{ranks} ranks, {dimension}D: {several:?} {one:?}"
                );
            }
        }
    }
}
