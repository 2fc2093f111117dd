//! S_v = N_v(x_p): the grid's own shape functions at the point (Ghost §2.5).
//!
//! A point on a grid line belongs to the upper cell ([`Grid::locate`]); the row holds all nodes
//! of its cell, also those with weight zero.

use super::{Influences, outside};
use crate::error::Result;
use crate::grid::{Grid, Lattice};
use crate::points::Points;

pub(super) fn map_points<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
) -> Result<Influences<D>> {
    let mut influences = Influences::with_capacity(points.len(), 1 << D);
    match grid {
        Grid::Lattice(lattice) => {
            for p in 0..points.len() {
                let x = &points.position[p];
                let cell = lattice.locate(x).ok_or_else(|| outside(grid, points, p))?;
                let low = lattice.cell_index(cell);
                let local = std::array::from_fn(|a| lattice.scaled(a, x[a]) - low[a] as f64);
                push_cell(lattice, low, local, &mut influences);
                influences.close_row();
            }
        }
    }
    Ok(influences)
}

pub(super) fn populated_cells<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
    p: usize,
    out: &mut Vec<usize>,
) -> Result<()> {
    out.push(grid.locate(&points.position[p]).ok_or_else(|| outside(grid, points, p))?);
    Ok(())
}

/// Pushes the shape functions of cell `low` at `local` in [0, 1]^D, nodes ascending.
fn push_cell<const D: usize>(
    lattice: &Lattice<D>,
    low: [usize; D],
    local: [f64; D],
    influences: &mut Influences<D>,
) {
    for corner in 0..1 << D {
        let upper: [bool; D] = std::array::from_fn(|a| corner >> a & 1 == 1);
        let weights: [f64; D] =
            std::array::from_fn(|a| if upper[a] { local[a] } else { 1.0 - local[a] });
        let gradient = std::array::from_fn(|axis| {
            let slope = if upper[axis] { 1.0 } else { -1.0 } / lattice.spacing[axis];
            (0..D).filter(|&a| a != axis).fold(slope, |product, a| product * weights[a])
        });
        let node = lattice.node_at(std::array::from_fn(|a| low[a] + usize::from(upper[a])));
        influences.push(node, weights.iter().product(), gradient);
    }
}
