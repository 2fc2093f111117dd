//! Gmsh 4.1 files (text or binary): tri3, quad4, tet4 or hex8 with physical groups as tags.
//!
//! Groups of the mesh's own dimension are body tags, those of lower dimension boundary tags.
//! A group without a name is known by its number. Nodes of no cell are dropped.

use std::collections::BTreeMap;
use std::path::Path;

use mshio::{ElementType, MshFile};
use rustc_hash::FxHashMap;

use crate::error::{Error, Result};

use super::check::Draft;
use super::mesh::Mesh;
use crate::deck::model::Element;

type Msh = MshFile<u64, i32, f64>;

/// Reads and checks a mesh of dimension `D`.
///
/// Errors (all name the file): not readable, not version 4.1, elements other than the four or
/// of mixed type, wrong dimension, a reference to a missing node, and those of [`Draft::finish`].
pub fn read<const D: usize>(path: &Path) -> Result<Mesh<D>> {
    let (msh, names) = parse(path)?;
    let element = element_of(&msh, path)?;
    if element.dimension() != D {
        return Err(wrong(path, format!("holds a {}D mesh, not {D}D", element.dimension())));
    }
    draft(&msh, &names, element, path)?.finish()
}

/// Dimension of the mesh in a file, 2 or 3. Errors as for [`read`], without its checks.
pub fn dimension(path: &Path) -> Result<usize> {
    let (msh, _) = parse(path)?;
    Ok(element_of(&msh, path)?.dimension())
}

fn wrong(path: &Path, message: impl std::fmt::Display) -> Error {
    Error::Input(format!("mesh file {}: {message}", path.display()))
}

/// Names of physical groups by (dimension, number).
type Names = FxHashMap<(i32, i32), String>;

fn parse(path: &Path) -> Result<(Msh, Names)> {
    let mut bytes = std::fs::read(path).map_err(|e| wrong(path, format!("cannot be read: {e}")))?;
    check_header(&bytes, path)?;
    let names = physical_names(&bytes, path)?;
    keep_node_tags(&mut bytes, path)?;
    let parsed = mshio::parse_msh_bytes(&bytes).map_err(|e| {
        // The parser's account quotes the input around the fault over many lines.
        let text = e.to_string();
        let line = text.lines().map(str::trim).find(|l| !l.is_empty()).unwrap_or("").to_string();
        wrong(path, format!("is not a valid Gmsh 4.1 file ({line})"))
    })?;
    Ok((parsed, names))
}

/// The parser panics on a malformed header line and says little about a version it does not
/// know, so the line is looked at first.
fn check_header(bytes: &[u8], path: &Path) -> Result<()> {
    let not_gmsh = || wrong(path, "is not a Gmsh file: it does not start with $MeshFormat");
    let rest = bytes.strip_prefix(b"$MeshFormat").ok_or_else(not_gmsh)?;
    let text = String::from_utf8_lossy(&rest[..rest.len().min(80)]).into_owned();
    let line = text.trim_start_matches('\r').trim_start_matches('\n');
    let words: Vec<&str> = line.lines().next().unwrap_or("").split_whitespace().collect();
    let &[version, kind, size] = words.as_slice() else {
        return Err(wrong(path, "has a malformed line after $MeshFormat"));
    };
    if version != "4.1" {
        return Err(wrong(
            path,
            format!(
                "has Gmsh format version {version}; only 4.1 is read. Convert it with: \
                 gmsh {} -save -format msh41 -o new.msh",
                path.display()
            ),
        ));
    }
    if !matches!(kind, "0" | "1") || size != "8" {
        return Err(wrong(path, format!("has the unknown file type \"{kind} {size}\"")));
    }
    Ok(())
}

/// Position just after the first line that is `section`.
fn section(bytes: &[u8], section: &str) -> Option<usize> {
    let found = bytes.windows(section.len()).position(|w| w == section.as_bytes())?;
    let line_end = bytes[found..].iter().position(|&b| b == b'\n')?;
    Some(found + line_end + 1)
}

/// `$PhysicalNames` is skipped by the parser; it is text in binary files, too.
fn physical_names(bytes: &[u8], path: &Path) -> Result<Names> {
    let mut names = Names::default();
    let Some(start) = section(bytes, "$PhysicalNames") else { return Ok(names) };
    for line in bytes[start..].split(|&b| b == b'\n').skip(1) {
        let line = String::from_utf8_lossy(line);
        if line.starts_with("$EndPhysicalNames") {
            return Ok(names);
        }
        if line.trim().is_empty() {
            continue;
        }
        let mut words = line.trim().splitn(3, char::is_whitespace);
        let parsed = (|| {
            let dimension = words.next()?.parse().ok()?;
            let tag = words.next()?.parse().ok()?;
            Some(((dimension, tag), words.next()?.trim().trim_matches('"').to_string()))
        })();
        let Some((key, name)) = parsed else {
            return Err(wrong(path, format!("has a malformed physical name: {}", line.trim())));
        };
        names.insert(key, name);
    }
    Err(wrong(path, "ends inside $PhysicalNames"))
}

/// The parser forgets the node tags of a file whose tags have no gaps, although they may come
/// in any order. Raising the largest tag that the section's header declares makes it keep them.
fn keep_node_tags(bytes: &mut Vec<u8>, path: &Path) -> Result<()> {
    const LARGEST: u64 = u64::MAX / 2;
    let start = section(bytes, "$Nodes").ok_or_else(|| wrong(path, "has no $Nodes section"))?;
    let binary = bytes[..start.min(80)].windows(5).any(|w| w == b"4.1 1");
    if binary {
        // Blocks, nodes, smallest and largest tag, eight bytes each; byte order from the header.
        let little = section(bytes, "$MeshFormat")
            .and_then(|at| bytes[at..].iter().position(|&b| b == b'\n').map(|end| at + end + 1))
            .is_some_and(|at| bytes.get(at..at + 4) == Some(&[1, 0, 0, 0]));
        let tag = if little { LARGEST.to_le_bytes() } else { LARGEST.to_be_bytes() };
        match bytes.get_mut(start + 24..start + 32) {
            Some(place) => place.copy_from_slice(&tag),
            None => return Err(wrong(path, "ends inside $Nodes")),
        }
        if bytes[start + 8..start + 16] == [0; 8] {
            return Err(wrong(path, "has no nodes"));
        }
        return Ok(());
    }
    let end = bytes[start..].iter().position(|&b| b == b'\n').map_or(bytes.len(), |e| start + e);
    let line = String::from_utf8_lossy(&bytes[start..end]).into_owned();
    let words: Vec<&str> = line.split_whitespace().collect();
    let &[blocks, nodes, smallest, _] = words.as_slice() else {
        return Err(wrong(path, "has a malformed line after $Nodes"));
    };
    if nodes == "0" {
        return Err(wrong(path, "has no nodes"));
    }
    let header = format!("{blocks} {nodes} {smallest} {LARGEST}");
    bytes.splice(start..end, header.into_bytes());
    Ok(())
}

fn supported(kind: ElementType) -> Option<Element> {
    match kind {
        ElementType::Tri3 => Some(Element::Tri3),
        ElementType::Qua4 => Some(Element::Quad4),
        ElementType::Tet4 => Some(Element::Tet4),
        ElementType::Hex8 => Some(Element::Hex8),
        _ => None,
    }
}

/// The one element type of the highest dimension in the file.
fn element_of(msh: &Msh, path: &Path) -> Result<Element> {
    let blocks = msh.data.elements.as_ref().map_or(&[][..], |e| &e.element_blocks);
    let blocks = || blocks.iter().filter(|block| !block.elements.is_empty());
    let top = blocks().map(|block| block.entity_dim).max().unwrap_or(0);
    if top < 2 {
        return Err(wrong(path, "has no cells: no elements of dimension 2 or 3"));
    }
    let mut found: Option<Element> = None;
    for block in blocks().filter(|block| block.entity_dim == top) {
        let first = block.elements[0].element_tag;
        let Some(element) = supported(block.element_type) else {
            return Err(wrong(
                path,
                format!(
                    "element {first} has the type {:?}; cells can be tri3, quad4, tet4 or hex8",
                    block.element_type
                ),
            ));
        };
        if *found.get_or_insert(element) != element {
            return Err(wrong(
                path,
                format!("element {first} makes a mixed mesh; all cells must be of one type"),
            ));
        }
    }
    found.ok_or_else(|| wrong(path, "has no cells"))
}

fn draft<const D: usize>(
    msh: &Msh,
    names: &Names,
    element: Element,
    path: &Path,
) -> Result<Draft<D>> {
    let mut places: FxHashMap<u64, [f64; 3]> = FxHashMap::default();
    for block in msh.data.nodes.iter().flat_map(|n| &n.node_blocks) {
        let tags = block.node_tags.as_ref().ok_or_else(|| wrong(path, "lost its node tags"))?;
        for (&tag, &index) in tags {
            let node = &block.nodes[index];
            if places.insert(tag, [node.x, node.y, node.z]).is_some() {
                return Err(wrong(path, format!("lists node {tag} twice")));
            }
        }
        if tags.len() != block.nodes.len() {
            return Err(wrong(path, format!("lists a node twice in entity {}", block.entity_tag)));
        }
    }

    let groups = physical_groups(msh);
    let mut draft = Draft {
        name: format!("mesh file {}", path.display()),
        element,
        positions: Vec::new(),
        cells: Vec::new(),
        node_labels: Vec::new(),
        cell_labels: Vec::new(),
        node_sets: BTreeMap::new(),
        cell_sets: BTreeMap::new(),
    };
    let blocks = || msh.data.elements.iter().flat_map(|e| &e.element_blocks);
    let is_cell = |dim: i32| dim as usize == D;

    // Number the nodes of cells by ascending tag, whatever the order of the cells.
    let mut used: Vec<u64> = blocks()
        .filter(|block| is_cell(block.entity_dim))
        .flat_map(|block| block.elements.iter().flat_map(|e| e.nodes.iter().copied()))
        .collect();
    used.sort_unstable();
    used.dedup();
    let mut number: FxHashMap<u64, u32> = FxHashMap::default();
    for tag in used {
        let Some(place) = places.get(&tag) else {
            return Err(wrong(path, format!("node {tag} is used by an element but not defined")));
        };
        if D == 2 && place[2] != 0.0 {
            return Err(wrong(
                path,
                format!("node {tag} at {place:?} is off the plane z = 0 of a 2D mesh"),
            ));
        }
        number.insert(tag, draft.positions.len() as u32);
        draft.positions.push(std::array::from_fn(|a| place[a]));
        draft.node_labels.push(tag);
    }

    for block in blocks() {
        let key = (block.entity_dim, block.entity_tag);
        let tags: Vec<String> = groups
            .get(&key)
            .into_iter()
            .flatten()
            .map(|tag| {
                let name = names.get(&(block.entity_dim, tag.abs()));
                name.cloned().unwrap_or_else(|| tag.abs().to_string())
            })
            .collect();
        for entry in &block.elements {
            if is_cell(block.entity_dim) {
                let cell = draft.cell_labels.len() as u32;
                draft.cell_labels.push(entry.element_tag);
                draft.cells.extend(entry.nodes.iter().map(|tag| number[tag]));
                for tag in &tags {
                    draft.cell_sets.entry(tag.clone()).or_default().push(cell);
                }
            } else {
                // A boundary element may touch nodes of no cell (a construction line).
                let nodes: Vec<u32> =
                    entry.nodes.iter().filter_map(|tag| number.get(tag).copied()).collect();
                for tag in &tags {
                    draft.node_sets.entry(tag.clone()).or_default().extend(&nodes);
                }
            }
        }
    }
    Ok(draft)
}

/// Physical group numbers of each entity (dimension, tag).
fn physical_groups(msh: &Msh) -> FxHashMap<(i32, i32), Vec<i32>> {
    let mut groups = FxHashMap::default();
    if let Some(entities) = &msh.data.entities {
        let points = entities.points.iter().map(|e| ((0, e.tag), &e.physical_tags));
        let curves = entities.curves.iter().map(|e| ((1, e.tag), &e.physical_tags));
        let surfaces = entities.surfaces.iter().map(|e| ((2, e.tag), &e.physical_tags));
        let volumes = entities.volumes.iter().map(|e| ((3, e.tag), &e.physical_tags));
        for (key, tags) in points.chain(curves).chain(surfaces).chain(volumes) {
            groups.insert(key, tags.clone());
        }
    }
    groups
}
