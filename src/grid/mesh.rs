//! Unstructured cells of one element type, their neighbours and named sets.
//!
//! Positions, connectivity and neighbours are replicated on every rank; what it costs per cell
//! (nodes per cell as in a large mesh, point location included):
//!
//! | element | bytes per cell |
//! |---|---|
//! | tri3 | about 60 |
//! | quad4 | about 90 |
//! | tet4 | about 77 |
//! | hex8 | about 160 |
//!
//! [`Mesh::memory_bytes`] gives the actual sum.

use std::collections::BTreeMap;

use crate::deck::nearest;
use crate::error::{Error, Result};

use super::FacePair;
use super::bins::Bins;
use super::element;
use super::quadrature::{self, SubCell};
use super::topology::{OUTSIDE, Topology};
use crate::deck::model::Element;

/// A checked mesh: see [`super::check`] for what holds.
#[derive(Debug, Clone)]
pub struct Mesh<const D: usize> {
    /// Where it came from, for messages: a file name or "generated annulus".
    pub name: String,
    /// The element of all cells.
    pub element: Element,
    pub(crate) positions: Vec<[f64; D]>,
    pub(crate) initial: Vec<[f64; D]>,
    /// Node numbers, `element.node_count()` per cell.
    pub(crate) cells: Vec<u32>,
    pub(crate) topology: Topology,
    pub(crate) bins: Bins<D>,
    pub(crate) node_sets: BTreeMap<String, Vec<u32>>,
    pub(crate) cell_sets: BTreeMap<String, Vec<u32>>,
    /// Smallest edge, m.
    pub(crate) size: f64,
    /// A cell has folded at a corner, as those of a mesh that follows the material may: cells
    /// then overlap.
    pub(crate) folded: bool,
}

impl<const D: usize> Mesh<D> {
    /// Nodes in all.
    pub fn node_count(&self) -> usize {
        self.positions.len()
    }

    /// Cells in all.
    pub fn cell_count(&self) -> usize {
        self.cells.len() / self.element.node_count()
    }

    /// Present position of a node, m.
    pub fn node_position(&self, node: usize) -> [f64; D] {
        self.positions[node]
    }

    /// Position before any motion, m.
    pub fn node_position_initial(&self, node: usize) -> [f64; D] {
        self.initial[node]
    }

    /// Node numbers of a cell in the element's order.
    pub fn nodes_of(&self, cell: usize) -> &[u32] {
        let n = self.element.node_count();
        &self.cells[cell * n..(cell + 1) * n]
    }

    /// Appends the nodes of a cell, in the element's order.
    pub fn cell_nodes(&self, cell: usize, out: &mut Vec<usize>) {
        out.extend(self.nodes_of(cell).iter().map(|&n| n as usize));
    }

    /// Positions of a cell's nodes, m; zero beyond the element's node count.
    pub fn cell_positions(&self, cell: usize) -> [[f64; D]; 8] {
        let mut x = [[0.0; D]; 8];
        for (x, &node) in x.iter_mut().zip(self.nodes_of(cell)) {
            *x = self.positions[node as usize];
        }
        x
    }

    /// The cell across each face of the element, `None` on the outer edge.
    pub fn across(&self, cell: usize) -> impl Iterator<Item = Option<usize>> + '_ {
        self.across_raw(cell).iter().map(|&c| (c != OUTSIDE).then_some(c as usize))
    }

    pub(crate) fn across_raw(&self, cell: usize) -> &[u32] {
        let faces = self.element.faces().len();
        &self.topology.neighbours[cell * faces..(cell + 1) * faces]
    }

    /// Appends the cells that share a face with `cell`, in the order of its faces.
    pub fn face_neighbours(&self, cell: usize, out: &mut Vec<usize>) {
        out.extend(self.across(cell).flatten());
    }

    /// The skeleton: every interior face once, ascending by lower cell.
    pub fn interior_faces(&self) -> impl Iterator<Item = FacePair> + '_ {
        (0..self.cell_count()).flat_map(move |lower| {
            let above = self.across(lower).flatten().filter(move |&upper| upper > lower);
            above.map(move |upper| FacePair { lower, upper })
        })
    }

    /// Outer faces as (cell, local face).
    pub fn boundary_faces(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..self.cell_count()).flat_map(move |cell| {
            let outer = self.across(cell).enumerate().filter(|(_, other)| other.is_none());
            outer.map(move |(face, _)| (cell, face))
        })
    }

    /// Lowest and highest coordinates of the nodes as they are now, m.
    pub fn bounds(&self) -> ([f64; D], [f64; D]) {
        let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
        for x in &self.positions {
            for a in 0..D {
                low[a] = low[a].min(x[a]);
                high[a] = high[a].max(x[a]);
            }
        }
        (low, high)
    }

    /// Lowest-numbered cell at a node: the same on every rank.
    pub fn lowest_cell(&self, node: usize) -> usize {
        self.topology.lowest_cell[node] as usize
    }

    /// Smallest edge of the mesh as it is now, m.
    pub fn cell_size(&self) -> f64 {
        self.size
    }

    /// m^D, by quadrature that is exact for the element.
    pub fn cell_volume(&self, cell: usize) -> f64 {
        let x = self.cell_positions(cell);
        let rule = quadrature::gauss_rule::<D>(self.element, 2);
        let nodes = &x[..self.element.node_count()];
        rule.iter()
            .map(|(xi, w)| {
                let j = element::jacobian(nodes, &self.element.shape_gradients(xi));
                w * element::determinant(&j)
            })
            .sum()
    }

    /// Appends n^D equal sub-cells (`n` per axis; simplices use `n[0]`); volumes add up to the
    /// cell's.
    pub fn sub_cells(&self, cell: usize, n: [usize; D], out: &mut Vec<SubCell<D>>) {
        let x = self.cell_positions(cell);
        quadrature::sub_cells(self.element, &x[..self.element.node_count()], n, out);
    }

    /// Appends the Gauss points (m) and volumes (m^D) of a cell, `n` per axis.
    pub fn gauss_points(&self, cell: usize, n: usize, out: &mut Vec<([f64; D], f64)>) {
        let x = self.cell_positions(cell);
        let nodes = &x[..self.element.node_count()];
        for (xi, weight) in quadrature::gauss_rule::<D>(self.element, n) {
            let j = element::jacobian(nodes, &self.element.shape_gradients(&xi));
            let volume = weight * element::determinant(&j);
            out.push((element::position(self.element, nodes, &xi), volume));
        }
    }

    /// Nodes of a boundary tag, ascending; a body tag gives the nodes of its cells.
    ///
    /// Error: no such tag; the message lists those there are.
    pub fn tagged_nodes(&self, tag: &str) -> Result<Vec<usize>> {
        if let Some(nodes) = self.node_sets.get(tag) {
            return Ok(nodes.iter().map(|&n| n as usize).collect());
        }
        let mut nodes = Vec::new();
        for cell in self.tagged_cells(tag)? {
            self.cell_nodes(cell, &mut nodes);
        }
        nodes.sort_unstable();
        nodes.dedup();
        Ok(nodes)
    }

    /// Cells of a body tag, ascending.
    ///
    /// Error: no such tag; the message lists those there are.
    pub fn tagged_cells(&self, tag: &str) -> Result<Vec<usize>> {
        match self.cell_sets.get(tag) {
            Some(cells) => Ok(cells.iter().map(|&c| c as usize).collect()),
            None => Err(self.missing_tag(tag)),
        }
    }

    fn missing_tag(&self, tag: &str) -> Error {
        let list = |set: &BTreeMap<String, Vec<u32>>| match set.len() {
            0 => "none".to_string(),
            _ => set.keys().map(|k| format!("\"{k}\"")).collect::<Vec<_>>().join(", "),
        };
        let kind =
            if self.node_sets.contains_key(tag) { " of cells (it names a boundary)" } else { "" };
        let tags = self.node_sets.keys().chain(self.cell_sets.keys());
        let meant = nearest(tag, tags.map(String::as_str).filter(|known| *known != tag));
        let meant = meant.map_or(String::new(), |known| format!(" (did you mean \"{known}\"?)"));
        Error::Input(format!(
            "{}: no tag \"{tag}\"{kind}{meant}; boundary tags: {}; body tags: {}",
            self.name,
            list(&self.node_sets),
            list(&self.cell_sets)
        ))
    }

    /// Bytes this mesh holds on each rank.
    pub fn memory_bytes(&self) -> usize {
        let sets = self.node_sets.values().chain(self.cell_sets.values());
        let words = self.cells.len()
            + self.topology.neighbours.len()
            + self.topology.lowest_cell.len()
            + sets.map(Vec::len).sum::<usize>();
        4 * words
            + 2 * self.positions.len() * std::mem::size_of::<[f64; D]>()
            + self.bins.memory_bytes()
    }

    /// What has to follow every change of positions: bins and the smallest edge.
    pub(crate) fn refresh(&mut self) {
        self.size = smallest_edge(self.element, &self.positions, &self.cells);
        self.bins =
            Bins::new(self.element, &self.positions, &self.cells, &self.topology.neighbours);
    }
}

pub(crate) fn smallest_edge<const D: usize>(
    element: Element,
    positions: &[[f64; D]],
    cells: &[u32],
) -> f64 {
    let mut smallest = f64::INFINITY;
    for nodes in cells.chunks_exact(element.node_count()) {
        for face in element.faces() {
            for (k, &a) in face.iter().enumerate() {
                let b = face[(k + 1) % face.len()];
                let (p, q) = (positions[nodes[a] as usize], positions[nodes[b] as usize]);
                let squared: f64 = p.iter().zip(&q).map(|(p, q)| (p - q) * (p - q)).sum();
                smallest = smallest.min(squared);
            }
        }
    }
    smallest.sqrt()
}
