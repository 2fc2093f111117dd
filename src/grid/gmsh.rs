//! Meshes from Gmsh files: tri3, quad4, tet4 or hex8 with physical groups as tags.
//!
//! Groups of the mesh's own dimension are body tags, those of lower dimension boundary tags.
//! A group without a name is known by its number. Nodes of no cell are dropped. Cells that are
//! listed clockwise (in 3D: left-handed) are turned.

use std::path::Path;

use rustc_hash::FxHashMap;

use crate::error::{Error, Result};
use crate::input_file;

use super::check::Draft;
use super::element;
use super::mesh::Mesh;
use super::msh::{self, Contents, Kind};
use crate::deck::model::Element;

/// Nodes of a plane mesh may be off z = 0 by this share of its extent: round-off of a program
/// that works in three dimensions.
const FLAT: f64 = 1e-10;

/// Reads and checks a mesh of dimension `D`.
///
/// Errors (all name the file): not readable, another version than 2.2, 4.0 or 4.1, elements other
/// than the four or of mixed type, wrong dimension, a reference to a missing node, and those of
/// [`Draft::finish`].
pub fn read<const D: usize>(path: &Path) -> Result<Mesh<D>> {
    let contents = parse(path)?;
    let element = element_of(&contents, path)?;
    if element.dimension() != D {
        return Err(wrong(path, format!("holds a {}D mesh, not {D}D", element.dimension())));
    }
    draft(&contents, element, path)?.finish()
}

fn wrong(path: &Path, message: impl std::fmt::Display) -> Error {
    Error::Input(format!("mesh file {}: {message}", path.display()))
}

fn parse(path: &Path) -> Result<Contents> {
    let bytes = input_file::read(path, input_file::DATA)
        .map_err(|e| wrong(path, format!("cannot be read: {e}")))?;
    msh::parse(&bytes).map_err(|reason| wrong(path, reason))
}

fn supported(kind: Kind) -> Option<Element> {
    match kind.name {
        "tri3" => Some(Element::Tri3),
        "quad4" => Some(Element::Quad4),
        "tet4" => Some(Element::Tet4),
        "hex8" => Some(Element::Hex8),
        _ => None,
    }
}

/// The one element type of the highest dimension in the file.
fn element_of(contents: &Contents, path: &Path) -> Result<Element> {
    let top = contents.blocks.iter().map(|block| block.kind.dimension).max().unwrap_or(0);
    if top < 2 {
        return Err(wrong(path, "has no cells: no elements of dimension 2 or 3"));
    }
    let mut found: Option<Element> = None;
    for block in contents.blocks.iter().filter(|block| block.kind.dimension == top) {
        let (first, kind) = (block.labels[0], block.kind);
        let refused = |what: &str, cure: String| {
            Err(wrong(
                path,
                format!(
                    "element {first} {what}; all cells must be tri3, all quad4, all tet4 or all hex8\n    try: {cure}"
                ),
            ))
        };
        if kind.order > 1 {
            let what = format!("is a {}, of order {}", kind.name, kind.order);
            return refused(&what, by_gmsh(path, "SetOrder 1;"));
        }
        match supported(kind) {
            Some(element) if *found.get_or_insert(element) == element => {}
            _ => {
                return refused(&format!("is a {} in a mixed mesh", kind.name), unmixed(top, path));
            }
        }
    }
    found.ok_or_else(|| wrong(path, "has no cells"))
}

/// Makes one type of the cells of a mixed mesh.
fn unmixed(dimension: usize, path: &Path) -> String {
    if dimension == 2 {
        by_gmsh(path, "Mesh.SubdivisionAlgorithm = 1; RefineMesh;")
            + " (quadrilaterals of half the size)"
    } else {
        "mesh the geometry again with tetrahedra only (no Recombine, no Layers), then with \
         Mesh.SubdivisionAlgorithm = 2; RefineMesh; if hexahedra are wanted"
            .into()
    }
}

/// Commands that let Gmsh read the file, work on it and write another one.
fn by_gmsh(path: &Path, work: &str) -> String {
    format!(
        "echo 'Merge \"{}\"; {work} Save \"new.msh\";' > convert.geo && gmsh -0 convert.geo",
        path.display()
    )
}

fn draft<const D: usize>(contents: &Contents, element: Element, path: &Path) -> Result<Draft<D>> {
    let mut places: FxHashMap<u64, [f64; 3]> = FxHashMap::default();
    for &(label, place) in &contents.nodes {
        if places.insert(label, place).is_some() {
            return Err(wrong(path, format!("lists node {label} twice")));
        }
    }
    let mut draft = Draft::new(format!("mesh file {}", path.display()), element);

    // Number the nodes of cells by ascending label, whatever the order of the cells.
    let cell_blocks = contents.blocks.iter().filter(|block| block.kind.dimension == D);
    let mut used: Vec<u64> = cell_blocks.flat_map(|block| block.nodes.iter().copied()).collect();
    used.sort_unstable();
    used.dedup();
    let mut number: FxHashMap<u64, u32> = FxHashMap::default();
    let mut all = Vec::new();
    for label in used {
        let Some(place) = places.get(&label) else {
            return Err(wrong(path, format!("node {label} is used by an element but not defined")));
        };
        number.insert(label, draft.positions.len() as u32);
        draft.positions.push(std::array::from_fn(|a| place[a]));
        draft.node_labels.push(label);
        all.push(*place);
    }
    if D == 2 {
        check_flat(&all, &draft.node_labels, path)?;
    }

    for block in &contents.blocks {
        let dimension = block.kind.dimension;
        let tags: Vec<String> = block
            .groups
            .iter()
            .map(|&group| {
                let name = contents.names.get(&(dimension as i64, group));
                name.cloned().unwrap_or_else(|| group.to_string())
            })
            .collect();
        for (&label, nodes) in block.labels.iter().zip(block.nodes.chunks_exact(block.kind.nodes)) {
            if dimension == D {
                let cell = draft.cell_labels.len() as u32;
                draft.cell_labels.push(label);
                let mut nodes: Vec<u32> = nodes.iter().map(|label| number[label]).collect();
                make_right_handed(element, &draft.positions, &mut nodes);
                draft.cells.extend(nodes);
                for tag in &tags {
                    draft.cell_sets.entry(tag.clone()).or_default().push(cell);
                }
            } else {
                // A boundary element may touch nodes of no cell (a construction line).
                let nodes: Vec<u32> =
                    nodes.iter().filter_map(|label| number.get(label).copied()).collect();
                for tag in &tags {
                    draft.node_sets.entry(tag.clone()).or_default().extend(&nodes);
                }
            }
        }
    }
    Ok(draft)
}

/// Whether a plane mesh lies in z = 0, but for round-off.
fn check_flat(places: &[[f64; 3]], labels: &[u64], path: &Path) -> Result<()> {
    let extent = (0..2)
        .map(|axis| {
            let along = places.iter().map(|place| place[axis]);
            along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
        })
        .fold(0.0, f64::max);
    for (place, label) in places.iter().zip(labels) {
        if !(place[2].abs() <= FLAT * extent) {
            return Err(wrong(
                path,
                format!("node {label} at {place:?} is off the plane z = 0 of a 2D mesh"),
            ));
        }
    }
    Ok(())
}

/// Turns the nodes of a cell that is listed clockwise, or left-handed: its content (area, volume;
/// of a hexahedron the Jacobian at the centre times 8) is negative. The mesh's check finds cells
/// that are bent or folded.
fn make_right_handed<const D: usize>(element: Element, positions: &[[f64; D]], nodes: &mut [u32]) {
    let x: Vec<[f64; D]> = nodes.iter().map(|&node| positions[node as usize]).collect();
    let at_centre = element.shape_gradients(&element.reference_centre());
    if element::determinant(&element::jacobian(&x, &at_centre)) < 0.0 {
        match element {
            Element::Tri3 | Element::Tet4 => nodes.swap(1, 2),
            Element::Quad4 => nodes.swap(1, 3),
            Element::Hex8 => {
                nodes.swap(1, 3);
                nodes.swap(5, 7);
            }
        }
    }
}
