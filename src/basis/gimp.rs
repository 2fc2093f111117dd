//! S_v = 1/(2 l_p) int N_v over [x_p - l_p, x_p + l_p], product over the axes (Ghost §2.5).
//!
//! The means are those of `hats.rs`. A cell is populated when the domain overlaps it; the row of a
//! point is exactly the nodes of its populated cells.

use super::centre::{self, Moments, RowNodes};
use super::contract::Basis;
use super::declaration::{Declaration, Domain};
use super::domain::{self, DomainStep};
use super::hats::{fill, spans};
use super::product::{Line, for_each_index, push_row};
use super::{Influences, lattice_of, radial};
use crate::deck::model::{DomainUpdate, GimpEdge};
use crate::error::Result;
use crate::grid::Grid;
use crate::points::{Points, rectangle_corners};

/// Rectangular domains along the axes of a lattice.
pub struct Gimp {
    /// What a domain that reaches over the grid's edge meets there.
    pub edge: GimpEdge,
}

impl Declaration for Gimp {
    const WORD: &'static str = "gimp";
    const DOC: &'static str = "rectangular domains: smoother, no jumps where points cross cells";
    const DOMAIN: Domain = Domain::Box;
    const NODES: [(usize, usize); 2] = [(6, 20), (15, 70)];

    fn of_deck(edge: GimpEdge) -> Self {
        Gimp { edge }
    }
}

impl<const D: usize> Basis<D> for Gimp {
    fn map_points(&self, grid: &Grid<D>, points: &Points<D>) -> Result<Influences<D>> {
        let lattice = lattice_of(grid)?;
        let mut influences = Influences::with_capacity(points.len(), 3usize.pow(D as u32));
        let mut lines: [Line; D] = std::array::from_fn(|_| Line::default());
        for p in 0..points.len() {
            let spans = spans(grid, lattice, points, p)?;
            for axis in 0..D {
                let centre = lattice.scaled(axis, points.position[p][axis]);
                let reach = points.half_length[p][axis] / lattice.spacing[axis];
                let (cells, spacing) = (lattice.cells[axis], lattice.spacing[axis]);
                let end = (self.edge == GimpEdge::Published).then_some(cells);
                fill(&mut lines[axis], spans[axis], centre, reach, spacing, end);
            }
            push_row(lattice, &lines, &mut influences);
        }
        Ok(influences)
    }

    fn populated_cells(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        p: usize,
        _: Option<usize>,
        out: &mut Vec<usize>,
    ) -> Result<()> {
        let lattice = lattice_of(grid)?;
        let spans = spans(grid, lattice, points, p)?;
        for_each_index(&spans.map(|s| s.last - s.first + 1), |index| {
            out.push(lattice.cell_at(std::array::from_fn(|a| spans[a].first + index[a])));
        });
        Ok(())
    }

    fn corners(&self, points: &Points<D>, p: usize) -> Option<[[f64; D]; 8]> {
        Some(rectangle_corners(points.position[p], points.half_length[p]))
    }

    fn update_domains(
        &self,
        rule: DomainUpdate,
        step: &DomainStep<'_, D>,
        points: &mut Points<D>,
    ) -> Result<usize> {
        domain::update_rectangles(rule, step, points)
    }

    fn cell_moments(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        influences: &Influences<D>,
        rows: RowNodes<'_>,
    ) -> Result<Vec<Moments>> {
        centre::moments_of_domains(grid, points, !influences.hoop.is_empty(), rows)
    }

    fn fill_cell_rows(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        influences: &mut Influences<D>,
        rows: RowNodes<'_>,
        sums: &[Moments],
    ) -> Result<()> {
        centre::fill_from_domains(grid, points, influences, rows, sums)
    }

    fn make_rings(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        influences: &mut Influences<D>,
    ) -> Result<()> {
        radial::rings_of_domains(grid, points, influences)
    }
}
