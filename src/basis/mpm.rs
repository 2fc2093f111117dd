//! S_v = N_v(x_p): the grid's own shape functions at the point (Ghost §2.5).
//!
//! A point on a grid line belongs to the upper cell ([`Grid::locate`]); the row holds all nodes
//! of its cell, also those with weight zero.

use super::product::{Line, push_row};
use super::{Influences, outside, row};
use crate::error::Result;
use crate::grid::Grid;
use crate::grid::locate::REACH;
use crate::points::Points;

pub(super) fn map_points<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
) -> Result<Influences<D>> {
    let mut influences = Influences::with_capacity(points.len(), 1 << D);
    match grid {
        Grid::Lattice(lattice) => {
            let mut lines: [Line; D] = std::array::from_fn(|_| Line::default());
            for p in 0..points.len() {
                let x = &points.position[p];
                let cell = lattice.locate(x).ok_or_else(|| outside(grid, points, p))?;
                let low = lattice.cell_index(cell);
                for axis in 0..D {
                    let local = lattice.scaled(axis, x[axis]) - low[axis] as f64;
                    let slope = 1.0 / lattice.spacing[axis];
                    let line = &mut lines[axis];
                    line.reset(low[axis], 2);
                    line.weights.copy_from_slice(&[1.0 - local, local]);
                    line.slopes.copy_from_slice(&[-slope, slope]);
                }
                push_row(lattice, &lines, &mut influences);
            }
        }
        Grid::Mesh(_) => return map_points_on_mesh(grid, points),
    }
    Ok(influences)
}

/// On a mesh the reference coordinates come from the inverse map of the cell.
fn map_points_on_mesh<const D: usize>(grid: &Grid<D>, points: &Points<D>) -> Result<Influences<D>> {
    let mut hint = None;
    row::map_points(points, |p, row| {
        let x = &points.position[p];
        let at = grid.interpolate(x, REACH, hint).ok_or_else(|| outside(grid, points, p))?;
        hint = Some(at.cell);
        row.clear();
        row.add_place(&at);
        row.merge();
        Ok(())
    })
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
