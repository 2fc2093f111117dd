//! Basis functions: which nodes a point touches, with S and its gradient (Lagrangian §6.1).
//!
//! | deck value | file | source |
//! |---|---|---|
//! | `mpm` | `mpm.rs` | Ghost §2.5 |
//! | `gimp` | `gimp.rs` | Ghost §2.5, after Bardenhagen and Kober |
//! | `cpdi1` | `cpdi1.rs` | Rotation §2 (iv) |
//! | `cpdi2` | `cpdi2.rs` | Rotation §2 (iv), Lagrangian footnote 6 |
//! | (both) | `corner.rs` | corners of a domain on the grid |
//! | `domain_update` | `domain.rs` | Lagrangian eq. 32-39 |

pub mod corner;
pub mod cpdi1;
pub mod cpdi2;
pub mod row;

pub use row::Row;

use crate::deck::model::Basis;
use crate::error::Result;
use crate::grid::Grid;
use crate::points::Points;

/// Nodes, weights S and gradients dS/dX~ of all points of a rank, in compressed rows.
/// Nodes ascend within a row and may belong to other ranks.
#[derive(Debug, Clone, Default)]
pub struct Influences<const D: usize> {
    /// Row p is `offsets[p]..offsets[p + 1]`.
    pub offsets: Vec<usize>,
    /// Global node numbers.
    pub nodes: Vec<usize>,
    pub weights: Vec<f64>,
    /// 1/m
    pub gradients: Vec<[f64; D]>,
}

/// Computes the influences of all points for a new step. Error: a point (or a corner of its
/// domain) outside the grid, named by id and position.
pub fn map_points<const D: usize>(
    _grid: &Grid<D>,
    _basis: Basis,
    _points: &Points<D>,
) -> Result<Influences<D>> {
    todo!()
}

/// Appends the cells populated by point `p`: strictly overlapped by its domain, or holding it.
pub fn populated_cells<const D: usize>(
    _grid: &Grid<D>,
    _basis: Basis,
    _points: &Points<D>,
    _p: usize,
    _out: &mut Vec<usize>,
) -> Result<()> {
    todo!()
}
