//! S_ip = sum_c w_c S_i(x_c), dS_ip = sum_c g_c S_i(x_c): what both CPDI functions share
//! (Rotation §2 (iv)). They differ in the corners x_c, weights w_c and gradients g_c.
//!
//! A corner may stick out of the grid by up to a quarter of a cell ([`REACH`]): domains only
//! approximate the body (parallelograms do not fit together, and a polygon that turns inside a
//! round outline cuts other chords), while the functions of the outer cells, extended linearly,
//! keep partition of unity and linear fields exact.

use crate::deck::model::DomainUpdate;
use crate::error::{Error, Result};
use crate::grid::bins::REACH;
use crate::grid::{Grid, ShapeFunctions};
use crate::points::Points;

use super::centre::{Moments, RowNodes};
use super::contract::Basis;
use super::domain::{self, DomainStep};
use super::{Influences, Row, box_means, row};

/// Domains that touch the grid at their corners only: what is their own.
pub trait Cornered<const D: usize> {
    /// Corners of point `p`'s domain as it is now, m.
    fn places(points: &Points<D>, p: usize) -> [[f64; D]; 8];

    /// The same with weights and gradients. Error: the domain has no volume.
    fn shares(points: &Points<D>, p: usize) -> Result<Corners<D>>;

    /// See [`Basis::check_domain`].
    fn check(
        step: &DomainStep<'_, D>,
        points: &Points<D>,
        p: usize,
        hint: &mut Option<usize>,
    ) -> Result<Option<[[f64; D]; 8]>>;
}

impl<const D: usize, T: Cornered<D>> Basis<D> for T {
    fn map_points(&self, grid: &Grid<D>, points: &Points<D>) -> Result<Influences<D>> {
        let mut hint = None;
        row::map_points(points, |p, row| {
            T::shares(points, p)?.fill(grid, points, p, &mut hint, row)
        })
    }

    fn populated_cells(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        p: usize,
        mut hint: Option<usize>,
        out: &mut Vec<usize>,
    ) -> Result<()> {
        let start = out.len();
        let corners = T::places(points, p);
        for_each_place(grid, points, p, &corners, &mut hint, |_, at| out.push(at.cell))?;
        row::sort_tail(out, start);
        Ok(())
    }

    fn corners(&self, points: &Points<D>, p: usize) -> Option<[[f64; D]; 8]> {
        Some(T::places(points, p))
    }

    fn domains_deform(&self) -> bool {
        true
    }

    fn check_domain(
        &self,
        step: &DomainStep<'_, D>,
        points: &Points<D>,
        p: usize,
        hint: &mut Option<usize>,
    ) -> Result<Option<[[f64; D]; 8]>> {
        T::check(step, points, p, hint)
    }

    fn update_domains(
        &self,
        _: DomainUpdate,
        _: &DomainStep<'_, D>,
        points: &mut Points<D>,
    ) -> Result<usize> {
        domain::update_extents(points, T::places);
        Ok(0)
    }

    fn cell_moments(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        influences: &Influences<D>,
        rows: RowNodes<'_>,
    ) -> Result<Vec<Moments>> {
        box_means::moments(grid, points, influences, rows, |p| T::places(points, p))
    }

    fn fill_cell_rows(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        influences: &mut Influences<D>,
        rows: RowNodes<'_>,
        sums: &[Moments],
    ) -> Result<()> {
        box_means::fill(grid, points, influences, rows, sums, |p| T::places(points, p))
    }
}

/// Corners with their weights (sum 1) and gradients (1/m, sum 0), 2^D of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corners<const D: usize> {
    pub positions: [[f64; D]; 8],
    pub weights: [f64; 8],
    pub gradients: [[f64; D]; 8],
}

impl<const D: usize> Corners<D> {
    /// Replaces `row` by nodes, S and dS/dX~ of point `p`, merged and ascending. `hint`: a cell
    /// near the first corner; left at that of the last.
    ///
    /// Error: a corner beyond reach.
    pub fn fill(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        p: usize,
        hint: &mut Option<usize>,
        row: &mut Row<D>,
    ) -> Result<()> {
        row.clear();
        for_each_place(grid, points, p, &self.positions, hint, |corner, at| {
            row.add_corner(at, self.weights[corner], &self.gradients[corner]);
        })?;
        row.merge();
        Ok(())
    }
}

/// Calls `visit` with each corner's number and the basis's values there. Corners on a face count
/// for the cell on the side of the domain's centre. `hint`: a cell near the first corner; left at
/// that of the last.
///
/// Error: a corner beyond reach, named by point, corner and position.
pub(crate) fn for_each_place<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
    p: usize,
    corners: &[[f64; D]; 8],
    hint: &mut Option<usize>,
    mut visit: impl FnMut(usize, &ShapeFunctions),
) -> Result<()> {
    let corners = &corners[..1 << D];
    let centre =
        std::array::from_fn(|a| corners.iter().map(|x| x[a]).sum::<f64>() / corners.len() as f64);
    for (corner, x) in corners.iter().enumerate() {
        let at = grid.values_towards(x, &centre, REACH, *hint).ok_or_else(|| {
            Error::Run(format!(
                "corner {} of point {} is outside the grid at {x:?} m (the point is at {:?} m); \
                 enlarge the grid, or let the mesh follow the body",
                corner + 1,
                points.id[p],
                points.position[p]
            ))
        })?;
        *hint = Some(at.cell);
        visit(corner, &at);
    }
    Ok(())
}
