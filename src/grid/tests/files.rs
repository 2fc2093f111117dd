//! Gmsh files: small ones in tests/data, and broken ones made from them.

use std::path::{Path, PathBuf};

use super::super::gmsh;
use super::*;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn text(name: &str) -> String {
    std::fs::read_to_string(data(name)).unwrap()
}

fn read<const D: usize>(content: impl AsRef<[u8]>) -> crate::error::Result<Mesh<D>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.msh");
    std::fs::write(&path, content).unwrap();
    gmsh::read(&path)
}

fn refused<const D: usize>(content: impl AsRef<[u8]>, words: &[&str]) {
    let error = read::<D>(content).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    let text = error.to_string();
    for word in words.iter().chain(&["broken.msh"]) {
        assert!(text.contains(word), "\"{word}\" is not in: {text}");
    }
}

/// Tags that are dense but out of order, named and unnamed groups, and a node of no cell.
#[test]
fn quads_with_groups() {
    let mesh: Mesh<2> = gmsh::read(&data("quads.msh")).unwrap();
    assert_eq!((mesh.element, mesh.node_count(), mesh.cell_count()), (Element::Quad4, 6, 2));
    // Node 1 of the file is a construction point; 2 to 7 are the rest, by number.
    let at = |node: usize| mesh.node_position(node);
    assert_eq!([at(0), at(1), at(2)], [[2.0, 0.0], [1.0, 0.0], [0.0, 0.0]]);
    assert_eq!([at(3), at(4), at(5)], [[0.0, 1.0], [1.0, 1.0], [2.0, 1.0]]);
    assert_eq!(mesh.tagged_nodes("left wall").unwrap(), [2, 3]);
    assert_eq!(mesh.tagged_nodes("9").unwrap(), [0, 5]);
    assert_eq!(mesh.tagged_cells("steel").unwrap(), [0]);
    assert_eq!(mesh.tagged_cells("soil").unwrap(), [1]);
    assert_eq!(mesh.tagged_nodes("steel").unwrap(), [1, 2, 3, 4]);
}

#[test]
fn triangles_and_solids() {
    let mesh: Mesh<2> = gmsh::read(&data("triangles.msh")).unwrap();
    assert_eq!((mesh.element, mesh.cell_count()), (Element::Tri3, 4));
    assert_eq!(mesh.interior_faces().count(), 4);
    let area: f64 = (0..4).map(|c| mesh.cell_volume(c)).sum();
    assert!((area - 1.0).abs() < 1e-15);

    let mesh: Mesh<3> = gmsh::read(&data("tets.msh")).unwrap();
    assert_eq!((mesh.element, mesh.cell_count()), (Element::Tet4, 2));
    assert_eq!(mesh.interior_faces().count(), 1);
    assert_eq!(mesh.tagged_nodes("base").unwrap(), [0, 1, 2]);

    let mesh: Mesh<3> = gmsh::read(&data("hexes.msh")).unwrap();
    assert_eq!((mesh.element, mesh.cell_count()), (Element::Hex8, 2));
    assert!((mesh.cell_volume(0) - 1.0).abs() < 1e-14);
    assert_eq!(mesh.tagged_nodes("floor").unwrap().len(), 6);
    assert_eq!(mesh.tagged_cells("block").unwrap(), [0, 1]);
}

/// The triangles again, in the binary form with the same numbers.
#[test]
fn binary_files() {
    let text_mesh: Mesh<2> = gmsh::read(&data("triangles.msh")).unwrap();
    let mut bytes: Vec<u8> = b"$MeshFormat\n4.1 1 8\n".to_vec();
    bytes.extend(1i32.to_le_bytes());
    bytes.extend(b"\n$EndMeshFormat\n$Nodes\n");
    let nodes = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]];
    // Tags out of order: the file lists nodes from the last to the first.
    bytes.extend([1u64, 5, 1, 5].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend([2i32, 1, 0].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend(5u64.to_le_bytes());
    bytes.extend([5u64, 4, 3, 2, 1].iter().flat_map(|n| n.to_le_bytes()));
    for x in nodes.iter().rev() {
        bytes.extend([x[0], x[1], 0.0f64].iter().flat_map(|n| n.to_le_bytes()));
    }
    bytes.extend(b"\n$EndNodes\n$Elements\n");
    bytes.extend([1u64, 4, 1, 4].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend([2i32, 1, 2].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend(4u64.to_le_bytes());
    for e in 1..=4u64 {
        bytes.extend([e, e, e % 4 + 1, 5].iter().flat_map(|n| n.to_le_bytes()));
    }
    bytes.extend(b"\n$EndElements\n");
    let mesh: Mesh<2> = read(&bytes).unwrap();
    assert_eq!(mesh.cells, text_mesh.cells);
    assert_eq!(mesh.positions, text_mesh.positions);
    refused::<2>(&bytes[..bytes.len() - 60], &["not a valid Gmsh file", "$Elements", "byte 4"]);
}

#[test]
fn wrong_versions_and_broken_files() {
    let good = text("quads.msh");
    refused::<2>(
        good.replace("4.1 0 8", "1.0 0 8"),
        &["version 1.0;", "2.2, 4.0 and 4.1", "msh41"],
    );
    refused::<2>(good.replace("4.1 0 8", "5 0 8"), &["version 5;"]);
    refused::<2>(good.replace("4.1 0 8", "4 1 8"), &["binary", "4.0", "msh41"]);
    refused::<2>(good.replace("4.1 0 8", "4.1 ? 8"), &["file type"]);
    refused::<2>(good.replace("4.1 0 8", "4.1 0"), &["malformed line after $MeshFormat"]);
    refused::<2>("solid cube", &["not a Gmsh file"]);
    refused::<2>("", &["not a Gmsh file"]);
    refused::<2>(
        &good[..good.find("$EndNodes").unwrap() - 20],
        &["not a valid Gmsh file", "file ends", "line 33", "$Nodes"],
    );
    refused::<2>(
        good.replace("1 0 0\n1 1 0", "1 O 0\n1 1 0"),
        &["line 34", "`O`", "a number", "$Nodes"],
    );
    refused::<2>(
        good.replace("3 7 1 7", "3 8000000000000000000 1 7"),
        &["8000000000000000000 nodes", "7 of them", "$Nodes"],
    );
    refused::<2>(good.replace("1 1 1 1\n10", "1 1 99 1\n10"), &["line 42", "type", "99"]);
    refused::<2>(&good[..good.find("$Nodes").unwrap()], &["no nodes", "$Nodes"]);
    refused::<2>(&good[..good.find("$EndPhysical").unwrap()], &["$PhysicalNames"]);
    refused::<2>(&good[..good.find("$Elements").unwrap()], &["no cells"]);
    refused::<3>(&good, &["2D mesh, not 3D"]);
    let missing = gmsh::read::<2>(Path::new("nowhere/none.msh")).unwrap_err();
    assert!(missing.to_string().contains("nowhere/none.msh"));
}

#[test]
fn wrong_entities_are_named() {
    let good = text("quads.msh");
    // Element 12 (cell) made a triangle of second order, then a triangle beside a quad.
    refused::<2>(
        good.replace("2 2 3 1\n12 3 2 7 6", "2 2 9 1\n12 3 2 7 6 5 4"),
        &["element 12", "tri6, of order 2", "all quad4", "SetOrder 1;", "gmsh -0"],
    );
    refused::<2>(
        good.replace("2 2 3 1\n12 3 2 7 6", "2 2 2 1\n12 3 2 7"),
        &["element 12", "tri3 in a mixed mesh", "SubdivisionAlgorithm = 1; RefineMesh;"],
    );
    // A prism (type 6) beside nothing else.
    refused::<3>(
        text("hexes.msh")
            .replace("3 1 5 2", "3 1 6 2")
            .replace("5 4 7 8 11 10", "5 7 8 11")
            .replace("6 5 8 9 12 11", "6 8 9 12"),
        &["prism6", "tetrahedra"],
    );
    refused::<2>(good.replace("12 3 2 7 6", "12 3 2 77 6"), &["node 77", "not defined"]);
    refused::<2>(good.replace("12 3 2 7 6", "12 3 2 6 7"), &["cell 12", "inverted"]);
    refused::<2>(good.replace("2 1 0\n", "2 1 0.5\n"), &["node 7", "z = 0"]);
    refused::<2>(good.replace("\n6\n", "\n7\n"), &["node", "twice"]);
}

/// Area or volume of a tag's cells, and the places of its nodes.
type Tagged<const D: usize> = (f64, Vec<[f64; D]>);

/// Cells, their area or volume by tag, and places of the nodes of each tag.
fn picture<const D: usize>(mesh: &Mesh<D>, tags: &[&str]) -> (usize, usize, Vec<Tagged<D>>) {
    let by_tag = tags.iter().map(|tag| {
        let cells = mesh.tagged_cells(tag).unwrap_or_default();
        let content = cells.iter().map(|&cell| mesh.cell_volume(cell)).sum();
        let nodes = mesh.tagged_nodes(tag).unwrap();
        let mut places: Vec<_> = nodes.iter().map(|&n| mesh.node_position(n)).collect();
        // By places without their last digits, which differ between text and binary files.
        places.sort_by_key(|x| x.map(|x| (x * 1e9).round() as i64));
        (content, places)
    });
    (mesh.node_count(), mesh.cell_count(), by_tag.collect())
}

/// One mesh in every form that Gmsh 4.15 writes: text and binary, with parameters of its geometry,
/// cut into parts. Two groups share cells, one has no name, one name ends in a quote.
#[test]
fn versions_and_forms_hold_the_same_mesh() {
    let tags = ["soil", "layer 5\"", "9", "base"];
    let of = |name: &str| {
        let path = data("gmsh").join(name);
        let mesh: Mesh<2> = gmsh::read(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        picture(&mesh, &tags)
    };
    let expected = of("plane-4.1.msh");
    let areas: Vec<f64> = expected.2.iter().map(|tag| tag.0).collect();
    for (area, exact) in areas.iter().zip([2.0, 3.0, 1.0, 0.0]) {
        assert!((area - exact).abs() < 1e-14, "{areas:?}");
    }
    // The base goes from 0 to 3 along y = 0.
    let base = &expected.2[3].1;
    assert_eq!((base.len(), base[0], base[11]), (12, [0.0, 0.0], [3.0, 0.0]));
    assert!(base.iter().all(|x| x[1] == 0.0), "{base:?}");
    for form in [
        "2.2",
        "2.2-binary",
        "2.2-parametric",
        "2.2-parametric-binary",
        "2.2-parts",
        "4.0",
        "4.0-parametric",
        "4.0-parts",
        "4.1-binary",
        "4.1-parametric",
        "4.1-parametric-binary",
        "4.1-parts",
        "4.1-parts-binary",
    ] {
        let found = of(&format!("plane-{form}.msh"));
        assert_eq!((found.0, found.1), (expected.0, expected.1), "{form}");
        for (found, expected) in found.2.iter().zip(&expected.2) {
            assert!((found.0 - expected.0).abs() < 1e-14, "{form}: {found:?}");
            // Text has 16 digits of a place, binary files have all.
            assert_eq!(found.1.len(), expected.1.len(), "{form}");
            for (x, y) in found.1.iter().flatten().zip(expected.1.iter().flatten()) {
                assert!((x - y).abs() < 1e-14, "{form}: {x} {y}");
            }
        }
    }
}

#[test]
fn solids_in_every_version() {
    for form in ["4.1", "4.0", "2.2", "2.2-binary", "2.2-parametric", "4.1-parametric", "4.1-parts"]
    {
        let path = data("gmsh").join(format!("solid-{form}.msh"));
        let mesh: Mesh<3> = gmsh::read(&path).unwrap_or_else(|e| panic!("{form}: {e}"));
        let (nodes, cells, by_tag) = picture(&mesh, &["block", "base"]);
        assert_eq!((nodes, cells), (14, 24), "{form}");
        assert!((by_tag[0].0 - 1.0).abs() < 1e-14, "{form}");
        assert_eq!(by_tag[1].1.len(), 5, "{form}");
        assert!(by_tag[1].1.iter().all(|x| x[2] == 0.0), "{form}");
    }
}

/// Clockwise or left-handed cells, one or all of them, give the mesh of the others. A cell that is
/// folded over its neighbour is not turned into a good one.
#[test]
fn cells_are_turned() {
    let good: Mesh<2> = gmsh::read(&data("quads.msh")).unwrap();
    let file = text("quads.msh");
    let one: Mesh<2> = read(file.replace("12 3 2 7 6", "12 3 6 7 2")).unwrap();
    assert_eq!(one.cells, good.cells);
    let both = file.replace("12 3 2 7 6", "12 3 6 7 2").replace("11 4 3 6 5", "11 4 5 6 3");
    assert_eq!(read::<2>(both).unwrap().cells, good.cells);
    // The second cell on the side of the first.
    let folded = file.replace("2 0 0\n1 0 0\n1 1 0\n2 1 0", "0.5 0.1 0\n1 0 0\n1 1 0\n0.5 0.9 0");
    refused::<2>(folded, &["cell 11", "cell 12", "folded"]);

    for (name, cell, turned) in [
        ("tets.msh", "2 10 20 30 40", "2 20 10 30 40"),
        ("hexes.msh", "3 1 2 5 4 7 8 11 10", "3 7 8 11 10 1 2 5 4"),
    ] {
        let good: Mesh<3> = gmsh::read(&data(name)).unwrap();
        let file = text(name);
        assert!(file.contains(cell), "{name}");
        let mesh: Mesh<3> = read(file.replace(cell, turned)).unwrap();
        for cell in 0..good.cell_count() {
            assert!((mesh.cell_volume(cell) - good.cell_volume(cell)).abs() < 1e-14, "{name}");
        }
    }
}

#[test]
fn blanks_remarks_and_round_off() {
    let good: Mesh<2> = gmsh::read(&data("quads.msh")).unwrap();
    let file = text("quads.msh");
    for variant in [
        file.replace("$MeshFormat\n4.1 0 8", "$MeshFormat \n4.1 0 8 "),
        file.replace('\n', "\r\n"),
        format!("$Comments\nby hand\n$EndComments\n{file}"),
        format!("\u{feff}\n{file}"),
        file.replace("1 1 0\n", "1 1 1e-18\n"),
        file.replace("$Nodes\n", "$Nodes \n").replace("$Elements\n", "\n$Elements  \n"),
    ] {
        let mesh: Mesh<2> = read(&variant).unwrap_or_else(|e| panic!("{e}\n{variant}"));
        assert_eq!((&mesh.cells, &mesh.positions), (&good.cells, &good.positions));
        assert_eq!(mesh.tagged_nodes("left wall").unwrap(), [2, 3]);
    }
    // Another unit of length moves neither the limit nor the mesh: nm and Mm.
    for scale in [1e-9, 1e6] {
        let moved = file.replace("1 1 0\n", &format!("{scale} {scale} {}\n", 1e-18 * scale));
        let moved = moved
            .replace("\n0 1 0\n0 0 0\n", &format!("\n0 {scale} 0\n0 0 0\n"))
            .replace("\n2 0 0\n1 0 0\n", &format!("\n{} 0 0\n{scale} 0 0\n", 2.0 * scale))
            .replace("\n2 1 0\n", &format!("\n{} {scale} 0\n", 2.0 * scale));
        assert_eq!(read::<2>(&moved).unwrap().cells, good.cells);
    }
    let named = file.replace("\"steel\"", "\"5\"\"");
    assert_eq!(read::<2>(named).unwrap().tagged_cells("5\"").unwrap(), [0]);
}
