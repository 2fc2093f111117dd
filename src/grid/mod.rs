//! The background grid: where the equations are solved.
//!
//! | deck value | type | file |
//! |---|---|---|
//! | `type = "lattice"` | [`Lattice`]: equal boxes, topology by arithmetic | `lattice.rs` |
//! | `type = "mesh"` | [`Mesh`]: tri3, quad4, tet4, hex8 with faces and tags | `mesh.rs` |
//! | `file` | Gmsh files, versions 2.2, 4.0, 4.1 | `gmsh.rs`, `msh/` |
//! | `generate` | boxes and rings | `generate.rs` |
//! | `motion` | rotation and following the material (Rotation §2 (viii)) | `motion.rs` |
//! | `element` | shape functions; inverse maps | `element.rs`, `inverse_map.rs` |
//! | `points_per_cell`, `gauss` on a mesh | sub-cells and Gauss points | `quadrature.rs` |
//!
//! Behind them: `topology.rs` (neighbours), `check.rs` (what a mesh must satisfy), `bins.rs`
//! and `locate.rs` (which cell holds a place), `interpolate.rs` (the basis at a place), `face.rs` ([`FaceJump`] for Ghost).
//! Node and cell numbers are global `usize` values, the same on every rank.

pub(crate) mod bins;
pub(crate) mod check;
pub(crate) mod element;
pub(crate) mod face;
pub mod generate;
pub(crate) mod gmsh;
pub(crate) mod interpolate;
pub(crate) mod inverse_map;
pub(crate) mod lattice;
pub(crate) mod locate;
pub(crate) mod mesh;
pub(crate) mod motion;
pub(crate) mod msh;
pub(crate) mod quadrature;
mod topology;

#[cfg(test)]
mod tests;

pub use face::FaceJump;
pub use interpolate::{Interpolation, ShapeFunctions};
pub use lattice::Lattice;
pub use mesh::Mesh;

use crate::error::{Error, Result};

/// Either grid, dispatched per call; both answer the same questions.
#[allow(clippy::large_enum_variant, reason = "one grid per run: its size does not matter")]
#[derive(Debug, Clone)]
pub enum Grid<const D: usize> {
    /// Equal boxes.
    Lattice(Lattice<D>),
    /// Elements of a file or of a generator.
    Mesh(Mesh<D>),
}

/// An interior face: the two cells that share it, in ascending order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FacePair {
    /// The cell with the lower number.
    pub lower: usize,
    /// The cell with the higher number.
    pub upper: usize,
}

impl<const D: usize> Grid<D> {
    /// Nodes in all.
    pub fn node_count(&self) -> usize {
        match self {
            Grid::Lattice(lattice) => lattice.node_count(),
            Grid::Mesh(mesh) => mesh.node_count(),
        }
    }

    /// Cells in all.
    pub fn cell_count(&self) -> usize {
        match self {
            Grid::Lattice(lattice) => lattice.cell_count(),
            Grid::Mesh(mesh) => mesh.cell_count(),
        }
    }

    /// Present coordinates of a node, m.
    pub fn node_position(&self, node: usize) -> [f64; D] {
        match self {
            Grid::Lattice(lattice) => lattice.node_position(node),
            Grid::Mesh(mesh) => mesh.node_position(node),
        }
    }

    /// Coordinates of a node before the mesh ever moved, m.
    pub fn node_position_initial(&self, node: usize) -> [f64; D] {
        match self {
            Grid::Lattice(lattice) => lattice.node_position(node),
            Grid::Mesh(mesh) => mesh.node_position_initial(node),
        }
    }

    /// Whether a node lies on a side of the lattice; no node of a mesh does.
    pub fn on_side(&self, node: usize, axis: usize, upper: bool) -> bool {
        match self {
            Grid::Lattice(lattice) => {
                let index = lattice.node_index(node)[axis];
                index == if upper { lattice.cells[axis] } else { 0 }
            }
            Grid::Mesh(_) => false,
        }
    }

    /// Nodes of a mesh tag, ascending. Error: no such tag, or a lattice.
    pub fn tagged_nodes(&self, tag: &str) -> Result<Vec<usize>> {
        match self {
            Grid::Lattice(_) => Err(Error::Input(format!(
                "boundary tag \"{tag}\": a lattice has no tags; use side or box"
            ))),
            Grid::Mesh(mesh) => mesh.tagged_nodes(tag),
        }
    }

    /// The cell that holds `x`, or `None` outside the grid. A point on a shared face belongs to
    /// the upper cell on a lattice (half-open cells; the grid's own upper edge is closed) and
    /// to the lowest-numbered cell on a mesh. A mesh holds points up to [`bins::REACH`] of a
    /// cell outside it: a polygon that turns inside a round outline cuts other chords.
    pub fn locate(&self, x: &[f64; D]) -> Option<usize> {
        self.locate_near(x, None)
    }

    /// As [`Self::locate`]. A `hint` is the cell `x` is likely to be in or beside; it never changes
    /// the answer.
    pub fn locate_near(&self, x: &[f64; D], hint: Option<usize>) -> Option<usize> {
        match self {
            Grid::Lattice(lattice) => lattice.locate(x),
            Grid::Mesh(mesh) => mesh.locate_near(x, bins::REACH, hint).map(|found| found.0),
        }
    }

    /// The cell of each place in turn, each found from the one before: neighbours in the list are
    /// mostly neighbours in space.
    pub fn locate_each<'a>(
        &'a self,
        places: impl Iterator<Item = &'a [f64; D]> + 'a,
    ) -> impl Iterator<Item = Option<usize>> + 'a {
        places.scan(None, |last, x| {
            let found = self.locate_near(x, *last);
            *last = found.or(*last);
            Some(found)
        })
    }

    /// Appends the nodes of a cell, counter-clockwise (hex8 order in 3D).
    pub fn cell_nodes(&self, cell: usize, out: &mut Vec<usize>) {
        match self {
            Grid::Lattice(lattice) => lattice.cell_nodes(cell, out),
            Grid::Mesh(mesh) => mesh.cell_nodes(cell, out),
        }
    }

    /// Appends the cells that share a face with `cell` (inside the grid only).
    pub fn face_neighbours(&self, cell: usize, out: &mut Vec<usize>) {
        match self {
            Grid::Lattice(lattice) => lattice.face_neighbours(cell, out),
            Grid::Mesh(mesh) => mesh.face_neighbours(cell, out),
        }
    }

    /// Lowest-numbered cell at a node.
    pub fn lowest_cell(&self, node: usize) -> usize {
        match self {
            Grid::Lattice(lattice) => lattice.lowest_cell(node),
            Grid::Mesh(mesh) => mesh.lowest_cell(node),
        }
    }

    /// Kind of the cells.
    pub fn element(&self) -> element::Element {
        match self {
            Grid::Lattice(_) if D == 2 => element::Element::Quad4,
            Grid::Lattice(_) => element::Element::Hex8,
            Grid::Mesh(mesh) => mesh.element,
        }
    }

    /// Lowest and highest coordinates of the grid, m.
    pub fn bounds(&self) -> ([f64; D], [f64; D]) {
        match self {
            Grid::Lattice(lattice) => {
                (lattice.origin, lattice.node_position(lattice.node_count() - 1))
            }
            Grid::Mesh(mesh) => mesh.bounds(),
        }
    }

    /// A length typical of a cell, m: the smallest spacing on a lattice, the smallest edge on a
    /// mesh.
    pub fn cell_size(&self) -> f64 {
        match self {
            Grid::Lattice(lattice) => lattice.spacing.iter().copied().fold(f64::INFINITY, f64::min),
            Grid::Mesh(mesh) => mesh.cell_size(),
        }
    }
}
