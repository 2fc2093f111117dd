//! Basis functions: which nodes a point touches, with S and its gradient (Lagrangian §6.1).
//!
//! | deck value | file | source |
//! |---|---|---|
//! | `mpm` | `mpm.rs` | Ghost §2.5 |
//! | `gimp` | `gimp.rs` | Ghost §2.5, after Bardenhagen and Kober |
//! | `cpdi1` | `cpdi1.rs` | Rotation §2 (iv) |
//! | `cpdi2` | `cpdi2.rs` | Rotation §2 (iv), Lagrangian footnote 6 |
//! | (all) | `contract.rs` | `trait Basis`: what each of them owes |
//! | (all) | `declaration.rs` | `trait Declaration`: word of the deck, kind of domain, size of rows |
//! | `gimp` | `hats.rs` | cells that a domain overlaps, and means of hats over it |
//! | (both) | `corner.rs` | corners of a domain on the grid |
//! | `domain_update` | `domain.rs` | Lagrangian eq. 32-39 |
//! | `locking` | `centre.rs`; `box_means.rs` for `cpdi1` and `cpdi2`; `cell_parts.rs` | gradients of cells, for F-bar |
//! | `symmetry` | `radial.rs` | rings: S, its gradient and S/r, weighted by the radius |
//! | (lattices) | `product.rs` | functions of one axis multiplied |
//! | (assembly) | `groups.rs` | points that touch the same nodes |

mod box_means;
pub(crate) mod centre;
pub mod contract;
mod declaration;
pub(crate) mod domain;
pub(crate) mod gimp;
pub(crate) mod groups;
pub(crate) mod hats;
pub(crate) mod mpm;
mod product;
pub(crate) mod radial;

#[cfg(test)]
#[path = "../../tests/adding/spline.rs"]
mod spline;
#[cfg(test)]
mod tests;

pub use declaration::{Declaration, Domain};
pub use groups::Groups;

mod cell_parts;
pub(crate) mod corner;
pub(crate) mod cpdi1;
pub mod cpdi2;
pub(crate) mod row;

pub use cell_parts::{CellPart, CellParts};
pub use row::Row;

use rustc_hash::FxHashMap;

use crate::deck::choices::Choice;
use crate::deck::model::GimpEdge;
use crate::error::{Error, Result};
use crate::grid::{Grid, Lattice};
use crate::points::Points;
use cpdi1::Cpdi1;
use cpdi2::Cpdi2;
use gimp::Gimp;
use mpm::Mpm;
#[cfg(test)]
use spline::Spline;

// A new basis is a line here.
declaration::bases! {
    Mpm, Gimp, Cpdi1, Cpdi2,
    // The example of docs/develop/adding-a-basis.md.
    #[cfg(test)] Spline,
}

/// Nodes, weights S and gradients dS/dX~ of all points of a rank, in compressed rows.
/// Nodes ascend within a row and may belong to other ranks.
#[derive(Debug, Clone, Default)]
pub struct Influences<const D: usize> {
    /// Row p is `offsets[p]..offsets[p + 1]`.
    pub offsets: Vec<usize>,
    /// Global node numbers.
    pub nodes: Vec<usize>,
    /// S of each entry.
    pub weights: Vec<f64>,
    /// 1/m
    pub gradients: Vec<[f64; D]>,
    /// Gradients of the cells for the same entries ([`centre`]), 1/m; empty without F-bar.
    pub centre_gradients: Vec<[f64; D]>,
    /// With axisymmetry the hoop row of the same entries ([`radial`]), 1/m: dF_zz - 1 = Σ H u_r.
    pub hoop: Vec<f64>,
    /// The hoop row that F-bar takes in its place, 1/m; empty without F-bar or axisymmetry.
    pub centre_hoop: Vec<f64>,
    /// With F-bar the cells of domains that lie in several; `centre_gradients` has the means over them.
    pub parts: CellParts<D>,
    /// Cells of each point, for bases that collect nodes cell by cell.
    pub cells: PointCells,
}

/// Cells of each point, ascending, in compressed rows; no rows for bases of a lattice's axes.
#[derive(Debug, Clone, Default)]
pub struct PointCells {
    /// End of each row.
    ends: Vec<usize>,
    cells: Vec<usize>,
    /// Point to the cell that its row was made in, where that was chosen ([`Influences::replace_row`]).
    chosen: FxHashMap<usize, usize>,
}

impl PointCells {
    fn push(&mut self, cells: &[usize]) {
        self.cells.extend_from_slice(cells);
        self.ends.push(self.cells.len());
    }

    /// Those of point `p`.
    pub fn of(&self, p: usize) -> Option<&[usize]> {
        if !self.chosen.is_empty()
            && let Some(cell) = self.chosen.get(&p)
        {
            return Some(std::slice::from_ref(cell));
        }
        let end = *self.ends.get(p)?;
        let start = if p == 0 { 0 } else { self.ends[p - 1] };
        Some(&self.cells[start..end])
    }
}

impl<const D: usize> Influences<D> {
    /// No rows yet, with room for `points` rows of about `nodes_each` nodes.
    pub fn with_capacity(points: usize, nodes_each: usize) -> Self {
        let mut offsets = Vec::with_capacity(points + 1);
        offsets.push(0);
        let entries = points * nodes_each;
        Influences {
            offsets,
            nodes: Vec::with_capacity(entries),
            weights: Vec::with_capacity(entries),
            gradients: Vec::with_capacity(entries),
            centre_gradients: Vec::new(),
            hoop: Vec::new(),
            centre_hoop: Vec::new(),
            parts: CellParts::default(),
            cells: PointCells::default(),
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The entries of point `p`, an index range into `nodes`, `weights` and `gradients`.
    #[inline]
    pub fn row(&self, p: usize) -> std::ops::Range<usize> {
        self.offsets[p]..self.offsets[p + 1]
    }

    /// Adds a node to the row being built.
    #[inline]
    pub fn push(&mut self, node: usize, weight: f64, gradient: [f64; D]) {
        self.nodes.push(node);
        self.weights.push(weight);
        self.gradients.push(gradient);
    }

    /// Makes row `p` of `mpm` anew, for a point at `x` that lies on a face of `cell`: nodes off that
    /// face get a weight of exactly zero, and the gradients are the cell's.
    pub fn replace_row(&mut self, grid: &Grid<D>, p: usize, x: &[f64; D], cell: usize) {
        let range = self.row(p);
        mpm::fill_in(grid, x, cell, |a, (node, weight, gradient)| {
            let at = range.start + a;
            debug_assert!(at < range.end, "rows of mpm are those of a cell");
            self.nodes[at] = node;
            self.weights[at] = weight;
            self.gradients[at] = gradient;
        });
        self.cells.chosen.insert(p, cell);
    }

    /// Ends the row being built.
    #[inline]
    pub fn close_row(&mut self) {
        self.offsets.push(self.nodes.len());
    }
}

/// Computes the influences of all points for a new step. Error: a point (or a corner of its
/// domain) outside the grid, named by id and position. A GIMP domain may reach over the grid's
/// edge, where the outer cell's functions go on; only its centre must be inside.
pub fn map_points<const D: usize>(
    grid: &Grid<D>,
    basis: Declared,
    points: &Points<D>,
) -> Result<Influences<D>> {
    map_points_with(grid, basis, GimpEdge::Continued, points)
}

/// [`map_points`] with the deck's choice for GIMP domains that reach over the grid's edge.
pub fn map_points_with<const D: usize>(
    grid: &Grid<D>,
    basis: Declared,
    edge: GimpEdge,
    points: &Points<D>,
) -> Result<Influences<D>> {
    of_deck(basis, edge).map_points(grid, points)
}

/// Appends the cells populated by point `p`: strictly overlapped by its domain, or holding it.
/// Their nodes together are the nodes of row `p` of [`map_points`], which may have kept them
/// ([`Influences::cells`]). A `hint`, a cell near the point, saves a search on a mesh; it never
/// changes the answer.
pub fn populated_cells<const D: usize>(
    grid: &Grid<D>,
    basis: Declared,
    points: &Points<D>,
    p: usize,
    hint: Option<usize>,
    out: &mut Vec<usize>,
) -> Result<()> {
    of_deck(basis, GimpEdge::Continued).populated_cells(grid, points, p, hint, out)
}

/// The lattice that `gimp` needs under its axis-aligned domains.
pub(crate) fn lattice_of<const D: usize>(grid: &Grid<D>) -> Result<&Lattice<D>> {
    match grid {
        Grid::Lattice(lattice) => Ok(lattice),
        Grid::Mesh(mesh) => Err(Error::Input(format!(
            "{}: basis gimp needs a lattice under its axis-aligned domains; use mpm, cpdi1 or \
             cpdi2 on a mesh",
            mesh.name
        ))),
    }
}

/// The error for a point whose position `x` is in no cell.
pub(crate) fn outside<const D: usize>(grid: &Grid<D>, points: &Points<D>, p: usize) -> Error {
    let (low, high) = grid.bounds();
    Error::Run(format!(
        "point {} of body {} is at {:?} m, outside the grid, which spans {low:?} to {high:?} m; \
         enlarge the grid or look for what drove the point away",
        points.id[p], points.body[p], points.position[p],
    ))
}
