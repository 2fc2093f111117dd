//! From raw nodes and cells to a [`Mesh`] that is fit for use, or to a message that names what
//! is wrong with it.
//!
//! | fault | found by |
//! |---|---|
//! | inverted or flat cell | det J <= 0 at a corner |
//! | duplicate cell | two cells with the same nodes |
//! | face of three cells | faces with the same nodes |
//! | cell folded over its neighbour | both list their common face in the same direction |
//! | hanging or doubled node | a node on an outer face that is not one of the face's nodes |

use std::collections::BTreeMap;

use crate::error::{Error, Result};

use super::bins::Bins;
use super::element;
use super::mesh::{Mesh, smallest_edge};
use super::topology::{OUTSIDE, ThirdCell, Topology};
use crate::deck::model::Element;

/// Raw contents of a mesh before it is checked.
#[derive(Debug, Clone)]
pub struct Draft<const D: usize> {
    /// Source for messages, such as `"ring.msh"`.
    pub name: String,
    pub element: Element,
    /// m
    pub positions: Vec<[f64; D]>,
    /// `element.node_count()` nodes per cell.
    pub cells: Vec<u32>,
    /// Numbers of nodes and cells in the source; empty: counted from 0 as here.
    pub node_labels: Vec<u64>,
    pub cell_labels: Vec<u64>,
    pub node_sets: BTreeMap<String, Vec<u32>>,
    pub cell_sets: BTreeMap<String, Vec<u32>>,
}

impl<const D: usize> Draft<D> {
    /// Without nodes.
    pub fn new(name: String, element: Element) -> Self {
        Draft {
            name,
            element,
            positions: Vec::new(),
            cells: Vec::new(),
            node_labels: Vec::new(),
            cell_labels: Vec::new(),
            node_sets: BTreeMap::new(),
            cell_sets: BTreeMap::new(),
        }
    }

    /// Checks everything and builds neighbours and bins. Errors name the cell or node by its
    /// number in the source, and its position.
    pub fn finish(self) -> Result<Mesh<D>> {
        if self.cells.is_empty() {
            return Err(Error::Input(format!("{}: the mesh has no cells", self.name)));
        }
        if let Some(node) = self.positions.iter().position(|x| x.iter().any(|x| !x.is_finite())) {
            let label = self.node(node);
            return Err(Error::Input(format!("{}: {label} is not at a finite place", self.name)));
        }
        if let Some((cell, corner)) = first_inverted(self.element, &self.positions, &self.cells) {
            return Err(self.inverted(cell, corner));
        }
        self.check_duplicates()?;
        let topology = Topology::new(self.element, &self.cells, self.positions.len())
            .map_err(|third| self.third_cell(&third))?;
        self.check_folds(&topology)?;
        let bins = Bins::new(self.element, &self.positions, &self.cells, &topology.neighbours);
        self.check_hanging(&topology, &bins)?;
        let Self { name, element, positions, cells, mut node_sets, mut cell_sets, .. } = self;
        for set in node_sets.values_mut().chain(cell_sets.values_mut()) {
            set.sort_unstable();
            set.dedup();
        }
        Ok(Mesh {
            size: smallest_edge(element, &positions, &cells),
            initial: positions.clone(),
            name,
            element,
            positions,
            cells,
            topology,
            bins,
            node_sets,
            cell_sets,
            folded: false,
        })
    }

    fn nodes_of(&self, cell: usize) -> &[u32] {
        let n = self.element.node_count();
        &self.cells[cell * n..(cell + 1) * n]
    }

    fn node(&self, node: usize) -> String {
        let label = self.node_labels.get(node).copied().unwrap_or(node as u64);
        format!("node {label} at {:?}", self.positions[node])
    }

    fn cell(&self, cell: usize) -> String {
        let label = self.cell_labels.get(cell).copied().unwrap_or(cell as u64);
        let nodes: Vec<String> = self
            .nodes_of(cell)
            .iter()
            .map(|&n| self.node_labels.get(n as usize).copied().unwrap_or(u64::from(n)).to_string())
            .collect();
        format!("cell {label} (nodes {})", nodes.join(", "))
    }

    fn inverted(&self, cell: usize, corner: usize) -> Error {
        let at = self.node(self.nodes_of(cell)[corner] as usize);
        let order = if D == 2 { "order around it" } else { "Gmsh's order" };
        Error::Input(format!(
            "{}: {} is inverted or flat (negative Jacobian) at {at}; list its nodes in {order} and \
             keep all its angles below 180 degrees",
            self.name,
            self.cell(cell)
        ))
    }

    fn third_cell(&self, ThirdCell(cells): &ThirdCell) -> Error {
        let [a, b, c] = cells.map(|c| self.cell(c as usize));
        Error::Input(format!(
            "{}: {a}, {b} and {c} all have the same face; a face can have two cells at most",
            self.name
        ))
    }

    fn check_duplicates(&self) -> Result<()> {
        const NONE: u32 = u32::MAX;
        let corners = self.element.node_count();
        // The last cell met at its lowest node, and the one met there before each cell.
        let mut last = vec![NONE; self.positions.len()];
        let mut before = vec![NONE; self.cells.len() / corners];
        for (cell, nodes) in self.cells.chunks_exact(corners).enumerate() {
            let lowest = nodes.iter().fold(NONE, |low, &node| low.min(node));
            let mut other = std::mem::replace(&mut last[lowest as usize], cell as u32);
            before[cell] = other;
            while other != NONE {
                let known = self.nodes_of(other as usize);
                if same_nodes(known, nodes) {
                    let (first, cell) = (self.cell(other as usize), self.cell(cell));
                    return Err(Error::Input(format!(
                        "{}: {cell} is a duplicate of {first}; remove one of them",
                        self.name
                    )));
                }
                other = before[other as usize];
            }
        }
        Ok(())
    }

    /// Two cells that are both listed in the positive sense go round their common face in opposite
    /// directions. If they do not, both lie on the same side of it.
    fn check_folds(&self, topology: &Topology) -> Result<()> {
        let faces = self.element.faces();
        for (cell, across) in topology.neighbours.chunks_exact(faces.len()).enumerate() {
            let nodes = self.nodes_of(cell);
            for (face, &other) in faces.iter().zip(across) {
                // Each pair is looked at from its first cell.
                if other == OUTSIDE || (other as usize) < cell {
                    continue;
                }
                let (from, to) = (nodes[face[0]], nodes[face[1]]);
                let theirs = self.nodes_of(other as usize);
                // An edge has one direction; a ring of nodes has one between each two.
                let pairs = if face.len() == 2 { 1 } else { face.len() };
                let directed = faces.iter().any(|face| {
                    let ring = |k: usize| theirs[face[k % face.len()]];
                    (0..pairs).any(|k| (ring(k), ring(k + 1)) == (to, from))
                        && face.iter().all(|&a| nodes.contains(&theirs[a]))
                });
                if !directed {
                    let (one, two) = (self.cell(cell), self.cell(other as usize));
                    return Err(Error::Input(format!(
                        "{}: {one} and {two} lie on the same side of their common face: one is \
                         folded over the other; move or remove the nodes that make it so",
                        self.name
                    )));
                }
            }
        }
        Ok(())
    }

    /// On a conforming mesh an outer face touches no nodes but its own. A hanging node makes
    /// the faces around it outer ones, and so does a node that is there twice.
    fn check_hanging(&self, topology: &Topology, bins: &Bins<D>) -> Result<()> {
        let faces = self.element.faces();
        let outer_faces = |cell: usize| {
            let across = &topology.neighbours[cell * faces.len()..(cell + 1) * faces.len()];
            let nodes = self.nodes_of(cell);
            let outer = faces.iter().zip(across).filter(|(_, other)| **other == OUTSIDE);
            outer.map(move |(face, _)| face.iter().map(|&a| nodes[a]).collect::<Vec<u32>>())
        };
        let mut nodes: Vec<u32> = (0..self.cells.len() / self.element.node_count())
            .flat_map(outer_faces)
            .flatten()
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        for node in nodes {
            let p = self.positions[node as usize];
            for &cell in bins.candidates(&p) {
                for face in outer_faces(cell as usize).filter(|face| !face.contains(&node)) {
                    let x: Vec<[f64; D]> =
                        face.iter().map(|&n| self.positions[n as usize]).collect();
                    let tolerance = 1e-8 * distance(&x[0], &x[1]);
                    if distance_to_face(&x, &p) <= tolerance {
                        let twin = (0..x.len()).find(|&k| distance(&x[k], &p) <= tolerance);
                        return Err(self.hanging(node, cell, twin.map(|k| face[k])));
                    }
                }
            }
        }
        Ok(())
    }

    fn hanging(&self, node: u32, cell: u32, twin: Option<u32>) -> Error {
        let (node, cell) = (self.node(node as usize), self.cell(cell as usize));
        Error::Input(match twin {
            Some(twin) => format!(
                "{}: {node} and {} of {cell} are at the same place; merge coincident nodes",
                self.name,
                self.node(twin as usize)
            ),
            None => format!(
                "{}: {node} hangs on a face of {cell}; cells must meet at whole faces",
                self.name
            ),
        })
    }
}

/// Whether two cells have the same nodes, in any order.
fn same_nodes(a: &[u32], b: &[u32]) -> bool {
    let sorted = |nodes: &[u32]| {
        let mut key = [u32::MAX; 8];
        key[..nodes.len()].copy_from_slice(nodes);
        key.sort_unstable();
        key
    };
    // Mostly one look at each node of the other tells them apart.
    a.iter().all(|node| b.contains(node)) && sorted(a) == sorted(b)
}

/// The first cell, and its corner, where det J is not clearly positive.
pub(crate) fn first_inverted<const D: usize>(
    element: Element,
    positions: &[[f64; D]],
    cells: &[u32],
) -> Option<(usize, usize)> {
    let corners = element.node_count();
    let places: Vec<[f64; D]> = (0..corners).map(|a| element.reference_node(a)).collect();
    first_inverted_at(element, positions, cells, &places)
}

/// The first cell, and which of the reference `places`, where det J is not clearly positive.
pub(crate) fn first_inverted_at<const D: usize>(
    element: Element,
    positions: &[[f64; D]],
    cells: &[u32],
    places: &[[f64; D]],
) -> Option<(usize, usize)> {
    let corners = element.node_count();
    let gradients: Vec<[[f64; D]; 8]> =
        places.iter().map(|xi| element.shape_gradients(xi)).collect();
    for (cell, nodes) in cells.chunks_exact(corners).enumerate() {
        let x: Vec<[f64; D]> = nodes.iter().map(|&n| positions[n as usize]).collect();
        for (place, dn) in gradients.iter().enumerate() {
            let j = element::jacobian(&x, dn);
            // Hadamard: |det J| is at most the product of the columns' lengths.
            let bound: f64 =
                (0..D).map(|c| j.iter().map(|row| row[c] * row[c]).sum::<f64>().sqrt()).product();
            let det = element::determinant(&j);
            if det.is_nan() || det <= 1e-10 * bound {
                return Some((cell, place));
            }
        }
    }
    None
}

fn distance<const D: usize>(p: &[f64; D], q: &[f64; D]) -> f64 {
    p.iter().zip(q).map(|(p, q)| (p - q) * (p - q)).sum::<f64>().sqrt()
}

/// Distance of `p` from an edge, a triangle, or a quadrilateral (as its two triangles).
fn distance_to_face<const D: usize>(face: &[[f64; D]], p: &[f64; D]) -> f64 {
    match *face {
        [a, b] => distance_to_edge(&a, &b, p),
        [a, b, c] => distance_to_triangle(&a, &b, &c, p),
        [a, b, c, d] => {
            distance_to_triangle(&a, &b, &c, p).min(distance_to_triangle(&a, &c, &d, p))
        }
        _ => f64::INFINITY,
    }
}

fn distance_to_edge<const D: usize>(a: &[f64; D], b: &[f64; D], p: &[f64; D]) -> f64 {
    let along = |q: &[f64; D]| -> f64 { (0..D).map(|i| (q[i] - a[i]) * (b[i] - a[i])).sum() };
    let t = (along(p) / along(b)).clamp(0.0, 1.0);
    distance(&std::array::from_fn(|i| a[i] + t * (b[i] - a[i])), p)
}

fn distance_to_triangle<const D: usize>(
    a: &[f64; D],
    b: &[f64; D],
    c: &[f64; D],
    p: &[f64; D],
) -> f64 {
    let [u, v, w] = [b, c, p].map(|q| -> [f64; D] { std::array::from_fn(|i| q[i] - a[i]) });
    let dot = |x: &[f64; D], y: &[f64; D]| -> f64 { x.iter().zip(y).map(|(x, y)| x * y).sum() };
    let (uu, uv, vv, wu, wv) = (dot(&u, &u), dot(&u, &v), dot(&v, &v), dot(&w, &u), dot(&w, &v));
    let det = uu * vv - uv * uv;
    let (s, t) = ((wu * vv - wv * uv) / det, (wv * uu - wu * uv) / det);
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        let foot = std::array::from_fn(|i| a[i] + s * u[i] + t * v[i]);
        return distance(&foot, p);
    }
    distance_to_edge(a, b, p).min(distance_to_edge(b, c, p)).min(distance_to_edge(c, a, p))
}
