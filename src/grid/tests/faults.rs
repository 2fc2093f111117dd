//! Meshes that must be refused, each with the entity named.

use std::collections::BTreeMap;

use super::super::check::Draft;
use super::*;

fn draft<const D: usize>(element: Element, positions: &[[f64; D]], cells: &[u32]) -> Draft<D> {
    Draft {
        name: "test.msh".into(),
        element,
        positions: positions.to_vec(),
        cells: cells.to_vec(),
        node_labels: (0..positions.len() as u64).map(|n| 100 + n).collect(),
        cell_labels: (0..cells.len() as u64).map(|c| 50 + c).collect(),
        node_sets: BTreeMap::new(),
        cell_sets: BTreeMap::new(),
    }
}

fn refused<const D: usize>(draft: Draft<D>, words: &[&str]) {
    let error = draft.finish().unwrap_err();
    assert_eq!(error.exit_code(), 2);
    let text = error.to_string();
    for word in words.iter().chain(&["test.msh"]) {
        assert!(text.contains(word), "\"{word}\" is not in: {text}");
    }
}

const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

#[test]
fn inverted_and_flat_cells() {
    refused(draft(Element::Quad4, &SQUARE, &[0, 3, 2, 1]), &["cell 50", "inverted", "node 100"]);
    refused(draft(Element::Quad4, &SQUARE, &[0, 1, 3, 2]), &["cell 50", "inverted"]);
    // An angle above 180 degrees: only one corner shows it.
    let mut dart = SQUARE;
    dart[2] = [0.2, 0.2];
    refused(draft(Element::Quad4, &dart, &[0, 1, 2, 3]), &["cell 50", "node 102 at [0.2, 0.2]"]);
    let line = [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]];
    refused(draft(Element::Tri3, &line, &[0, 1, 2]), &["cell 50", "flat"]);
    let mut tet = [[0.0; 3]; 4];
    (tet[1][0], tet[2][1], tet[3][2]) = (1.0, 1.0, 1.0);
    assert!(draft(Element::Tet4, &tet, &[0, 1, 2, 3]).finish().is_ok());
    refused(draft(Element::Tet4, &tet, &[0, 2, 1, 3]), &["cell 50"]);
}

#[test]
fn duplicate_cells_and_faces_of_three_cells() {
    refused(
        draft(Element::Quad4, &SQUARE, &[0, 1, 2, 3, 1, 2, 3, 0]),
        &["cell 51 (nodes 101, 102, 103, 100)", "duplicate of cell 50"],
    );
    let tri = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.3, 2.0]];
    refused(
        draft(Element::Tri3, &tri, &[0, 1, 2, 1, 3, 2, 1, 4, 2]),
        &["same face", "cell 50", "cell 51", "cell 52"],
    );
}

#[test]
fn hanging_and_doubled_nodes() {
    // One cell on the left, two above each other on the right.
    let x = [
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [1.0, 0.4],
        [2.0, 0.0],
        [2.0, 0.4],
        [2.0, 1.0],
    ];
    refused(
        draft(Element::Quad4, &x, &[0, 1, 2, 3, 1, 5, 6, 4, 4, 6, 7, 2]),
        &["node 104 at [1.0, 0.4] hangs on a face of cell 50"],
    );
    let twice = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    refused(
        draft(Element::Tri3, &twice, &[0, 1, 2, 3, 4, 5]),
        &["node 101", "node 103", "merge coincident nodes"],
    );
    // The same in space: a box beside two half-boxes.
    let mut x = Vec::new();
    for z in [0.0, 1.0] {
        for y in [0.0, 1.0] {
            x.extend([[0.0, y, z], [1.0, y, z], [2.0, y, z]]);
        }
    }
    for z in [0.0, 1.0] {
        x.extend([[1.0, 0.5, z], [2.0, 0.5, z]]);
    }
    let cells =
        [[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 13, 12, 7, 8, 15, 14], [12, 13, 5, 4, 14, 15, 11, 10]];
    refused(
        draft(Element::Hex8, &x, &cells.concat()),
        &["node 112 at [1.0, 0.5, 0.0] hangs on a face of cell 50"],
    );
    assert!(draft(Element::Hex8, &x, &cells[1..].concat()).finish().is_ok());
}

#[test]
fn empty_meshes_and_places_that_are_not_numbers() {
    refused(draft::<2>(Element::Quad4, &SQUARE, &[]), &["no cells"]);
    let mut x = SQUARE;
    x[3][1] = f64::NAN;
    refused(draft(Element::Quad4, &x, &[0, 1, 2, 3]), &["node 103"]);
}

#[test]
fn a_missing_tag_is_answered_with_those_there_are() {
    let mesh = ring([5.0, 5.0], Element::Quad4, 1.0);
    let text = mesh.tagged_nodes("rim").unwrap_err().to_string();
    assert!(text.contains("\"rim\"") && text.contains("\"inner\", \"outer\""), "{text}");
    assert!(mesh.tagged_cells("inner").unwrap_err().to_string().contains("names a boundary"));
}

#[test]
fn impossible_generators_are_refused() {
    let quad = Element::Quad4;
    for (inner, outer, counts, element, grading) in [
        ([5.0, 11.0], 10.0, [2, 8], quad, 1.0),
        ([0.0, 1.0], 10.0, [2, 8], quad, 1.0),
        ([5.0, 5.0], 10.0, [0, 8], quad, 1.0),
        ([5.0, 5.0], 10.0, [2, 2], quad, 1.0),
        ([5.0, 5.0], 10.0, [2, 8], Element::Hex8, 1.0),
        ([5.0, 5.0], 10.0, [2, 8], quad, 0.5),
    ] {
        let error = annulus::<2>(inner, outer, counts, element, grading).unwrap_err();
        assert_eq!(error.exit_code(), 2);
    }
    assert!(box_mesh([0.0; 2], [1.0, 0.0], [1, 1], quad).is_err());
    assert!(box_mesh([0.0; 2], [1.0; 2], [1, 0], quad).is_err());
    assert!(box_mesh([0.0; 3], [1.0; 3], [1; 3], quad).is_err());
    assert!(box_mesh([0.0; 3], [1.0; 3], [10_000; 3], Element::Hex8).is_err());
}
