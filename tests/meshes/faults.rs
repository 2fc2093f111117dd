//! What is wrong with a mesh or a domain is said with file and entity, and the right exit code.

use crate::common::run::Run;

const DECK: &str = r#"
title = "fault"
ghost = "off"
[analysis]
type = "quasi-static"
steps = 2
[method]
basis = "mpm"
[grid]
type = "mesh"
file = "MESH"
[material.m]
model = "hencky"
young = 1.0
poisson = 0.0
[[body]]
name = "block"
material = "m"
shape = { cells = "all" }
[[boundary]]
where = { tag = "base" }
fix = ["x", "y"]
"#;

const HEADER: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n1 1 \"base\"\n\
                      $EndPhysicalNames\n$Entities\n0 1 1 0\n1 0 0 0 1 0 0 1 1 0\n\
                      1 0 0 0 1 1 0 0 0\n$EndEntities\n";

/// A file with these nodes and cells of `kind` (Gmsh's number), one line from node 1 to 2 as "base".
fn mesh(nodes: &[[f64; 2]], kind: usize, cells: &[&[usize]]) -> String {
    let n = nodes.len();
    let mut text = format!("{HEADER}$Nodes\n1 {n} 1 {n}\n2 1 0 {n}\n");
    for k in 1..=n {
        text += &format!("{k}\n");
    }
    for [x, y] in nodes {
        text += &format!("{x} {y} 0\n");
    }
    let count = cells.len() + 1;
    text += &format!("$EndNodes\n$Elements\n2 {count} 1 {count}\n1 1 1 1\n1 1 2\n");
    text += &format!("2 1 {kind} {}\n", cells.len());
    for (k, cell) in cells.iter().enumerate() {
        let nodes: Vec<String> = cell.iter().map(usize::to_string).collect();
        text += &format!("{} {}\n", k + 2, nodes.join(" "));
    }
    text + "$EndElements\n"
}

/// Runs the deck on a mesh file, on one rank and on two; the outcome must have this exit code and
/// these words, said once.
#[track_caller]
fn refused(name: &str, contents: &str, deck: &str, code: i32, words: &[&str]) {
    for ranks in [1, 2] {
        refused_on(ranks, name, contents, deck, code, words);
    }
}

#[track_caller]
fn refused_on(ranks: usize, name: &str, contents: &str, deck: &str, code: i32, words: &[&str]) {
    let folder = tempfile::tempdir().expect("a scratch folder");
    std::fs::write(folder.path().join(name), contents).expect("writable");
    let outcome = Run::text(&deck.replace("MESH", name)).ranks(ranks).attempt_in(folder);
    let said = format!("{}\n{}", outcome.stdout, outcome.stderr);
    assert_eq!(outcome.code, code, "{said}");
    for word in words {
        assert!(outcome.stderr.contains(word), "no `{word}` in:\n{said}");
    }
    let lines = outcome.stderr.lines().filter(|line| words.iter().all(|w| line.contains(w)));
    assert!(lines.count() <= 1, "said more than once:\n{said}");
    if code == 2 {
        assert!(!outcome.files().iter().any(|f| f.starts_with("out/")), "nothing half-written");
    }
}

const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

#[test]
fn a_good_file_runs() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let text = mesh(&SQUARE, 3, &[&[1, 2, 3, 4]]);
    std::fs::write(folder.path().join("good.msh"), text).expect("writable");
    let outcome = Run::text(&DECK.replace("MESH", "good.msh")).attempt_in(folder);
    assert_eq!(outcome.code, 0, "{}\n{}", outcome.stdout, outcome.stderr);
}

/// A quarter of the public plane files list their cells clockwise.
#[test]
fn clockwise_cells_are_turned() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let text = mesh(&SQUARE, 3, &[&[1, 4, 3, 2]]);
    std::fs::write(folder.path().join("clockwise.msh"), text).expect("writable");
    let outcome = Run::text(&DECK.replace("MESH", "clockwise.msh")).attempt_in(folder);
    assert_eq!(outcome.code, 0, "{}\n{}", outcome.stdout, outcome.stderr);
}

#[test]
fn old_gmsh_files() {
    let text = "$MeshFormat\n1.0 0 8\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n";
    let words = ["old.msh", "version 1.0", "2.2, 4.0 and 4.1", "gmsh", "-format msh41"];
    refused("old.msh", text, DECK, 2, &words);
}

#[test]
fn unknown_elements() {
    let mut nodes = SQUARE.to_vec();
    nodes.extend([[0.5, 0.0], [0.5, 0.5]]);
    let text = mesh(&nodes, 9, &[&[1, 2, 3, 5, 4, 6]]);
    refused("curved.msh", &text, DECK, 2, &["curved.msh", "element 2", "tri6", "all quad4"]);
}

#[test]
fn inverted_and_duplicate_cells() {
    let text = mesh(&SQUARE, 3, &[&[1, 2, 4, 3]]);
    refused("turned.msh", &text, DECK, 2, &["turned.msh", "cell 2", "inverted", "node 4 at"]);
    let text = mesh(&SQUARE, 3, &[&[1, 2, 3, 4], &[2, 3, 4, 1]]);
    refused("twice.msh", &text, DECK, 2, &["twice.msh", "cell 3", "duplicate of cell 2"]);
}

#[test]
fn hanging_nodes() {
    let nodes = [SQUARE.as_slice(), &[[2.0, 0.0], [2.0, 1.0], [1.0, 0.5], [2.0, 0.5]]].concat();
    let text = mesh(&nodes, 3, &[&[1, 2, 3, 4], &[2, 5, 8, 7], &[7, 8, 6, 3]]);
    refused(
        "hanging.msh",
        &text,
        DECK,
        2,
        &["hanging.msh", "node 7 at", "hangs on a face of cell 2"],
    );
}

#[test]
fn missing_tags() {
    let text = mesh(&SQUARE, 3, &[&[1, 2, 3, 4]]);
    let deck = DECK.replace("tag = \"base\"", "tag = \"top\"");
    refused("square.msh", &text, &deck, 2, &["square.msh", "no tag \"top\"", "\"base\""]);
    let deck = DECK.replace("cells = \"all\"", "cells = \"rock\"");
    refused("square.msh", &text, &deck, 2, &["square.msh", "no tag \"rock\""]);
    let deck = DECK.replace("tag = \"base\"", "tag = \"bsae\"");
    let words = ["boundary.0.where.tag", "did you mean \"base\"?"];
    refused("square.msh", &text, &deck, 2, &words);
}

#[test]
fn files_that_are_not_there() {
    let words = ["absent.msh", "cannot read"];
    refused("other.msh", "", &DECK.replace("MESH", "absent.msh"), 2, &words);
}

#[test]
fn gimp_on_a_mesh() {
    let text = mesh(&SQUARE, 3, &[&[1, 2, 3, 4]]);
    let deck = DECK.replace("\"mpm\"", "\"gimp\"");
    refused("square.msh", &text, &deck, 2, &["gimp", "needs type = \"lattice\"", "cpdi1"]);
}

#[test]
fn finite_elements_on_a_lattice() {
    let outcome = Run::of("column").set("method.control=\"fem\"").attempt();
    assert_eq!(outcome.code, 2);
    assert!(outcome.stderr.contains("control = \"fem\" needs grid.type = \"mesh\""));
}

/// A block pulled out of a mesh that stays.
fn pulled(basis: &str, per_cell: usize, ranks: usize) -> (i32, String) {
    let outcome = Run::of("stretch")
        .ranks(ranks)
        .set(format!("method.basis=\"{basis}\""))
        .set(format!("body.0.points_per_cell=[{per_cell}, {per_cell}]"))
        .set("grid.motion={ follow = [\"y\"] }")
        .set("analysis.steps=20")
        .attempt();
    (outcome.code, outcome.stderr)
}

#[test]
fn points_and_corners_that_leave_the_mesh() {
    for ranks in [1, 2] {
        let (code, said) = pulled("mpm", 2, ranks);
        assert_eq!(code, 1, "{said}");
        assert!(said.contains("point ") && said.contains("leaves the grid"), "{said}");
        for basis in ["cpdi1", "cpdi2"] {
            let (code, said) = pulled(basis, 1, ranks);
            assert_eq!(code, 1, "{said}");
            assert!(said.contains("corner ") && said.contains("is outside the grid at"), "{said}");
            assert!(said.contains("step ") && said.contains("point "), "{said}");
        }
    }
}

/// In the plane the volume of a CPDI2 domain is that of its point: one says it for both.
#[test]
fn domains_that_turn_over() {
    for ranks in [1, 2] {
        let outcome = Run::of("stretch")
            .ranks(ranks)
            .set("method.basis=\"cpdi2\"")
            .set("grid.motion=")
            .set("boundary.2.displacement={ x = -6.0 }")
            .set("analysis.steps=1")
            .set("analysis.max_iterations=40")
            .set("analysis.inverted_iterates=\"allow\"")
            .attempt();
        let said = outcome.stderr;
        assert_eq!(outcome.code, 1, "{said}");
        for word in ["step 1 of 1", "point ", "is turned inside out (det dF"] {
            assert!(said.contains(word), "no `{word}` in:\n{said}");
        }
    }
}

/// In space the volume of a CPDI2 domain is not that of its point. Here x = X (1 - 2 Z), y =
/// Y (1 + 2 Z), z = Z folds a cube of side 2: its mean gradient stays the unit matrix, while the
/// volume becomes 8 (1 - 4/3).
#[test]
fn domains_in_space_that_fold() {
    let mut deck = String::from(
        r#"
title = "fold"
ghost = "off"
[analysis]
type = "quasi-static"
steps = 1
[method]
basis = "cpdi2"
[grid]
type = "lattice"
origin = [-5, -5, -5]
size = [10, 10, 10]
h = 2.0
[material.m]
model = "hencky"
young = 1.0
poisson = 0.0
[[body]]
name = "block"
material = "m"
shape = { box = { min = [-1, -1, -1], max = [1, 1, 1] } }
points_per_cell = [1, 1, 1]
"#,
    );
    for corner in 0..8 {
        let at = |axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
        let [x, y, z] = [at(0), at(1), at(2)];
        let list = |by: f64| format!("[{}, {}, {}]", x + by, y + by, z + by);
        deck += &format!(
            "[[boundary]]\nwhere = {{ box = {{ min = {}, max = {} }} }}\n\
             displacement = {{ x = {:?}, y = {:?}, z = 0 }}\n",
            list(-0.1),
            list(0.1),
            -2.0 * x * z,
            2.0 * y * z
        );
    }
    for ranks in [1, 2, 3] {
        let outcome = Run::text(&deck).ranks(ranks).attempt();
        let said = outcome.stderr;
        assert_eq!(outcome.code, 1, "{said}");
        let words = ["step 1 of 1", "the CPDI2 domain of point ", "is inverted: volume -2.66666"];
        for word in words.into_iter().chain(["corners [[", "or basis cpdi1 or mpm"]) {
            assert!(said.contains(word), "no `{word}` in:\n{said}");
        }
        assert_eq!(said.matches("error: step 1").count(), 1, "{said}");
    }
}
