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
    assert_eq!(gmsh::dimension(&data("quads.msh")).unwrap(), 2);
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
    assert_eq!(gmsh::dimension(&data("hexes.msh")).unwrap(), 3);
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
    refused::<2>(&bytes[..bytes.len() - 60], &["not a valid Gmsh 4.1 file"]);
}

#[test]
fn wrong_versions_and_broken_files() {
    let good = text("quads.msh");
    refused::<2>(good.replace("4.1 0 8", "2.2 0 8"), &["version 2.2", "only 4.1", "msh41"]);
    refused::<2>(good.replace("4.1 0 8", "4 0 8"), &["version 4;"]);
    refused::<2>(good.replace("4.1 0 8", "4.1 ? 8"), &["file type"]);
    refused::<2>("solid cube", &["not a Gmsh file"]);
    refused::<2>("", &["not a Gmsh file"]);
    refused::<2>(&good[..good.find("$EndNodes").unwrap() - 20], &["not a valid Gmsh 4.1 file"]);
    refused::<2>(&good[..good.find("$Nodes").unwrap()], &["no $Nodes"]);
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
        &["element 12", "Tri6", "tri3, quad4"],
    );
    refused::<2>(
        good.replace("2 2 3 1\n12 3 2 7 6", "2 2 2 1\n12 3 2 7"),
        &["element 12", "mixed"],
    );
    refused::<2>(good.replace("12 3 2 7 6", "12 3 2 77 6"), &["node 77", "not defined"]);
    refused::<2>(good.replace("12 3 2 7 6", "12 3 6 7 2"), &["cell 12", "inverted"]);
    refused::<2>(good.replace("2 1 0\n", "2 1 0.5\n"), &["node 7", "z = 0"]);
    refused::<2>(good.replace("\n6\n", "\n7\n"), &["node", "twice"]);
}
