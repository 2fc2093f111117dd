//! S_v = N_v(x_p): the grid's own shape functions at the point (Ghost §2.5).
//!
//! A point on a grid line belongs to the upper cell ([`Grid::locate`]); the row holds all nodes
//! of its cell, also those with weight zero. In explicit analyses, where the mass decides, the
//! assembly may choose another cell that holds the point ([`Influences::replace_row`]).

use super::centre::{self, Moments, RowNodes};
use super::contract::Basis;
use super::declaration::{Declaration, Domain};
use super::{Influences, Row, outside, radial, row};
use crate::deck::model::GimpEdge;
use crate::error::Result;
use crate::grid::bins::REACH;
use crate::grid::{Grid, Lattice};
use crate::points::Points;

/// Points without extent.
pub struct Mpm;

impl Declaration for Mpm {
    const WORD: &'static str = "mpm";
    const DOC: &'static str = "points without domains, linear shape functions";
    const DOMAIN: Domain = Domain::None;
    const NODES: [(usize, usize); 2] = [(4, 9), (8, 27)];

    fn of_deck(_edge: GimpEdge) -> Self {
        Mpm
    }
}

impl<const D: usize> Basis<D> for Mpm {
    fn map_points(&self, grid: &Grid<D>, points: &Points<D>) -> Result<Influences<D>> {
        match grid {
            Grid::Lattice(lattice) => map_points_on_lattice(grid, lattice, points),
            Grid::Mesh(_) => map_points_on_mesh(grid, points),
        }
    }

    fn populated_cells(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        p: usize,
        hint: Option<usize>,
        out: &mut Vec<usize>,
    ) -> Result<()> {
        let x = &points.position[p];
        out.push(grid.locate_near(x, hint).ok_or_else(|| outside(grid, points, p))?);
        Ok(())
    }

    fn of_one_cell(&self) -> bool {
        true
    }

    fn fill_cell_rows(
        &self,
        _: &Grid<D>,
        points: &Points<D>,
        influences: &mut Influences<D>,
        _: RowNodes<'_>,
        _: &[Moments],
    ) -> Result<()> {
        centre::fill_from_points(points, influences);
        Ok(())
    }

    fn make_rings(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        influences: &mut Influences<D>,
    ) -> Result<()> {
        radial::rings_of_points(grid, points, influences)
    }
}

/// S = prod_a (1 - t_a or t_a), t the position within the cell in cells.
fn map_points_on_lattice<const D: usize>(
    grid: &Grid<D>,
    lattice: &Lattice<D>,
    points: &Points<D>,
) -> Result<Influences<D>> {
    let mut influences = Influences::with_capacity(points.len(), 1 << D);
    let slope = lattice.spacing.map(|h| 1.0 / h);
    let corners = lattice.corner_offsets();
    for (p, x) in points.position.iter().enumerate() {
        let low = lattice.cell_of(x).ok_or_else(|| outside(grid, points, p))?;
        let lowest = lattice.node_at(low);
        let mut weights = [[0.0; 2]; D];
        for axis in 0..D {
            let local = lattice.scaled(axis, x[axis]) - low[axis] as f64;
            weights[axis] = [1.0 - local, local];
        }
        for (corner, offset) in corners.iter().enumerate().take(1 << D) {
            let upper: [usize; D] = std::array::from_fn(|axis| corner >> axis & 1);
            let mut weight = 1.0;
            let mut gradient: [f64; D] =
                std::array::from_fn(|a| if upper[a] == 1 { slope[a] } else { -slope[a] });
            for a in 0..D {
                let factor = weights[a][upper[a]];
                weight *= factor;
                for b in 0..D {
                    if b != a {
                        gradient[b] *= factor;
                    }
                }
            }
            influences.push(lowest + offset, weight, gradient);
        }
        influences.close_row();
    }
    Ok(influences)
}

/// On a mesh the reference coordinates come from the inverse map of the cell.
fn map_points_on_mesh<const D: usize>(grid: &Grid<D>, points: &Points<D>) -> Result<Influences<D>> {
    let mut hint = None;
    row::map_points(points, |p, row| {
        let x = &points.position[p];
        let at = grid.interpolate(x, REACH, hint).ok_or_else(|| outside(grid, points, p))?;
        hint = Some(at.values.cell);
        row.clear();
        row.add_place(&at);
        row.merge();
        Ok(())
    })
}

/// The row of a place `x` in a `cell` that holds it, entry by entry, nodes ascending.
pub(super) fn fill_in<const D: usize>(
    grid: &Grid<D>,
    x: &[f64; D],
    cell: usize,
    mut put: impl FnMut(usize, (usize, f64, [f64; D])),
) {
    let Some(at) = grid.interpolate_in(cell, x) else { return };
    let mut row = Row::default();
    row.add_place(&at);
    row.merge();
    for (a, &entry) in row.entries().iter().enumerate() {
        put(a, entry);
    }
}
