//! The background grid: where the equations are solved.
//!
//! | deck value | type | file |
//! |---|---|---|
//! | `type = "lattice"` | [`Lattice`]: equal boxes, topology by arithmetic | `lattice.rs` |
//! | `type = "mesh"` | [`Mesh`]: tri3, quad4, tet4, hex8 with faces and tags | `mesh.rs` |
//! | interior faces for Ghost | [`FaceJump`] | `face.rs` |
//!
//! Node and cell numbers are global `usize` values, the same on every rank.

pub mod element;
pub mod face;
pub mod lattice;
pub mod quadrature;

pub use face::FaceJump;
pub use lattice::Lattice;

use crate::error::{Error, Result};

/// Either grid, dispatched per call; both answer the same questions.
#[derive(Debug, Clone)]
pub enum Grid<const D: usize> {
    Lattice(Lattice<D>),
}

/// An interior face: the two cells that share it, in ascending order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FacePair {
    pub lower: usize,
    pub upper: usize,
}

impl<const D: usize> Grid<D> {
    pub fn node_count(&self) -> usize {
        match self {
            Grid::Lattice(lattice) => lattice.node_count(),
        }
    }

    pub fn cell_count(&self) -> usize {
        match self {
            Grid::Lattice(lattice) => lattice.cell_count(),
        }
    }

    /// Coordinates of a node, m.
    pub fn node_position(&self, node: usize) -> [f64; D] {
        match self {
            Grid::Lattice(lattice) => lattice.node_position(node),
        }
    }

    /// Coordinates of a node at the start of the run, m.
    pub fn node_start(&self, node: usize) -> [f64; D] {
        match self {
            Grid::Lattice(lattice) => lattice.node_position(node),
        }
    }

    /// Whether a node lies on a side of the lattice; no node of a mesh does.
    pub fn on_side(&self, node: usize, axis: usize, upper: bool) -> bool {
        match self {
            Grid::Lattice(lattice) => {
                let index = lattice.node_index(node)[axis];
                index == if upper { lattice.cells[axis] } else { 0 }
            }
        }
    }

    /// Nodes of a mesh tag, ascending. Error: no such tag, or a lattice.
    pub fn tagged_nodes(&self, tag: &str) -> Result<Vec<usize>> {
        match self {
            Grid::Lattice(_) => Err(Error::Input(format!(
                "boundary tag \"{tag}\": a lattice has no tags; use side or box"
            ))),
        }
    }

    /// The cell that holds `x`, or `None` outside the grid. A point on a shared face belongs to
    /// the upper cell on a lattice (half-open cells; the grid's own upper edge is closed) and
    /// to the lowest-numbered cell on a mesh.
    pub fn locate(&self, x: &[f64; D]) -> Option<usize> {
        match self {
            Grid::Lattice(lattice) => lattice.locate(x),
        }
    }

    /// Appends the nodes of a cell, counter-clockwise (hex8 order in 3D).
    pub fn cell_nodes(&self, cell: usize, out: &mut Vec<usize>) {
        match self {
            Grid::Lattice(lattice) => lattice.cell_nodes(cell, out),
        }
    }

    /// Appends the cells that share a face with `cell` (inside the grid only).
    pub fn face_neighbours(&self, cell: usize, out: &mut Vec<usize>) {
        match self {
            Grid::Lattice(lattice) => lattice.face_neighbours(cell, out),
        }
    }

    /// A length typical of a cell, m: the smallest spacing on a lattice.
    pub fn cell_size(&self) -> f64 {
        match self {
            Grid::Lattice(lattice) => lattice.spacing.iter().copied().fold(f64::INFINITY, f64::min),
        }
    }
}
