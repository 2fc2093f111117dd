//! `trait Basis`: what basis functions owe to the program.

use crate::deck::model::{self, DomainUpdate, GimpEdge};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::points::{Points, rectangle_corners};
use crate::tensor::dense;

use super::centre::{self, Moments, RowNodes};
use super::{Influences, corner, cpdi1, cpdi2, domain, gimp, mpm, radial, row};

/// A step as the domains of the points see it.
pub struct DomainStep<'a, const D: usize> {
    /// The grid of the step, and that of the next.
    pub grids: [&'a Grid<D>; 2],
    /// dF - 1 of each point.
    pub increments: &'a [[[f64; D]; D]],
    /// Displacement of each point, m.
    pub moved: &'a [[f64; D]],
    /// Displacement, as a point sees it, of a node, m; zero where no equation lives. It is asked only
    /// for nodes in the point's own row of [`Basis::map_points`].
    pub nodal: &'a dyn Fn(usize, usize) -> [f64; D],
    /// The points are rings: axisymmetry.
    pub rings: bool,
}

/// Basis functions of points: which nodes each touches, with S and its gradient. Everything after
/// the influences is the same code for all of them.
pub trait Basis<const D: usize> {
    /// S and dS/dX~ (1/m) of all points of a rank, nodes ascending in each row. Error: a point, or
    /// what it needs of its domain, outside the grid, named by id and position.
    fn map_points(&self, grid: &Grid<D>, points: &Points<D>) -> Result<Influences<D>>;

    /// Appends the cells populated by point `p`: strictly overlapped by its domain, or holding it.
    /// Ghost faces lie around them. A `hint`, a cell near the point, saves a search on a mesh; it
    /// never changes the answer.
    fn populated_cells(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        p: usize,
        hint: Option<usize>,
        out: &mut Vec<usize>,
    ) -> Result<()>;

    /// Whether the nodes of a row are those of the cells that its point populates. Rows of wider
    /// functions are numbered by their own nodes.
    fn within_cells(&self) -> bool {
        true
    }

    /// Whether a row is that of one cell: a point on a face has no weight at the nodes off it, but
    /// a gradient, and could be taken by either cell.
    fn of_one_cell(&self) -> bool {
        false
    }

    /// Order of the lowest derivative of the functions that jumps across a face of the grid. Ghost
    /// faces penalise jumps of first derivatives.
    fn jump_order(&self) -> usize {
        1
    }

    /// The 2^D corners of point `p`'s domain, counter-clockwise, hex8 order in 3D; `None` for
    /// points without domains.
    fn corners(&self, points: &Points<D>, p: usize) -> Option<[[f64; D]; 8]> {
        let _ = (points, p);
        None
    }

    /// Whether a step can leave a domain that is of no use: [`Self::check_domain`] is asked then.
    fn domains_deform(&self) -> bool {
        false
    }

    /// Where the step takes the corners of point `p`'s domain, m, for domains that carry them. `hint`:
    /// a cell near the first corner; left at that of the last. Error: the step turns the domain over
    /// or carries it out of the grid.
    fn check_domain(
        &self,
        step: &DomainStep<'_, D>,
        points: &Points<D>,
        p: usize,
        hint: &mut Option<usize>,
    ) -> Result<Option<[[f64; D]; 8]>> {
        let _ = (step, points, p, hint);
        Ok(None)
    }

    /// Updates `points.half_length` at the end of a step by the `rule` of the deck
    /// ([`super::domain`]): after `deformation_gradient` and the carried corners have become those of
    /// the step's end, while `position` and `half_length` are still those of its start. Returns how
    /// many domains had outgrown the stretch of their points, which are put back to it. The default is
    /// that of points without domains.
    ///
    /// Errors: a half length that is zero or not finite, and det F <= 0 where its root is needed,
    /// with the point's id and position.
    fn update_domains(
        &self,
        rule: DomainUpdate,
        step: &DomainStep<'_, D>,
        points: &mut Points<D>,
    ) -> Result<usize> {
        let _ = rule;
        domain::update_cubes(points, step.rings)
    }

    /// For F-bar: moments of this rank's points at the lowest node of each cell (local), which the
    /// ranks then add up. Empty for a basis whose cells' points live on one rank. Without axisymmetry the
    /// `influences` have no hoops.
    fn cell_moments(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        influences: &Influences<D>,
        rows: RowNodes<'_>,
    ) -> Result<Vec<Moments>> {
        let _ = (grid, points, influences, rows);
        Ok(Vec::new())
    }

    /// For F-bar: fills the gradients of the cells ([`super::centre`]), and with axisymmetry their hoop rows, from the
    /// sums of all ranks.
    fn fill_cell_rows(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        influences: &mut Influences<D>,
        rows: RowNodes<'_>,
        sums: &[Moments],
    ) -> Result<()> {
        let _ = (grid, points, influences, rows, sums);
        Err(Error::Input(
            "method.locking = \"f-bar\" is for basis = \"mpm\" and basis = \"gimp\"".to_string(),
        ))
    }

    /// Makes the rows those of rings ([`super::radial`]), whose hoop entries are there and zero. Error:
    /// a point that is not off the axis.
    fn make_rings(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        influences: &mut Influences<D>,
    ) -> Result<()> {
        let _ = (grid, points, influences);
        Err(Error::Input(
            "analysis.symmetry = \"axisymmetric\" is for basis = \"mpm\" and basis = \"gimp\""
                .into(),
        ))
    }
}

/// The basis of a deck. A new one is a line here.
pub fn of_deck<const D: usize>(basis: model::Basis, edge: GimpEdge) -> Box<dyn Basis<D>> {
    match basis {
        model::Basis::Mpm => Box::new(Mpm),
        model::Basis::Gimp => Box::new(Gimp { edge }),
        model::Basis::Cpdi1 => Box::new(Cpdi1),
        model::Basis::Cpdi2 => Box::new(Cpdi2),
    }
}

struct Mpm;

impl<const D: usize> Basis<D> for Mpm {
    fn map_points(&self, grid: &Grid<D>, points: &Points<D>) -> Result<Influences<D>> {
        mpm::map_points(grid, points)
    }

    fn populated_cells(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        p: usize,
        hint: Option<usize>,
        out: &mut Vec<usize>,
    ) -> Result<()> {
        mpm::populated_cells(grid, points, p, hint, out)
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

struct Gimp {
    /// What a domain that reaches over the grid's edge meets there.
    edge: GimpEdge,
}

impl<const D: usize> Basis<D> for Gimp {
    fn map_points(&self, grid: &Grid<D>, points: &Points<D>) -> Result<Influences<D>> {
        gimp::map_points(grid, self.edge, points)
    }

    fn populated_cells(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        p: usize,
        _: Option<usize>,
        out: &mut Vec<usize>,
    ) -> Result<()> {
        gimp::populated_cells(grid, points, p, out)
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

struct Cpdi1;

impl<const D: usize> Basis<D> for Cpdi1 {
    fn map_points(&self, grid: &Grid<D>, points: &Points<D>) -> Result<Influences<D>> {
        let mut hint = None;
        row::map_points(points, |p, row| {
            cpdi1::corners(points, p)?.fill(grid, points, p, &mut hint, row)
        })
    }

    fn populated_cells(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        p: usize,
        hint: Option<usize>,
        out: &mut Vec<usize>,
    ) -> Result<()> {
        let corners = cpdi1::corner_positions(points, p);
        corner::populated_cells(grid, points, p, &corners, hint, out)
    }

    fn corners(&self, points: &Points<D>, p: usize) -> Option<[[f64; D]; 8]> {
        Some(cpdi1::corner_positions(points, p))
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
        let increment = dense::plus_unit(&step.increments[p]);
        cpdi1::check_step(step.grids[1], points, p, &increment, &step.moved[p], hint)?;
        Ok(None)
    }

    fn update_domains(
        &self,
        _: DomainUpdate,
        _: &DomainStep<'_, D>,
        points: &mut Points<D>,
    ) -> Result<usize> {
        domain::update_extents(points, cpdi1::corner_positions);
        Ok(0)
    }
}

struct Cpdi2;

impl<const D: usize> Basis<D> for Cpdi2 {
    fn map_points(&self, grid: &Grid<D>, points: &Points<D>) -> Result<Influences<D>> {
        let mut hint = None;
        row::map_points(points, |p, row| {
            cpdi2::corners(points, p)?.fill(grid, points, p, &mut hint, row)
        })
    }

    fn populated_cells(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        p: usize,
        hint: Option<usize>,
        out: &mut Vec<usize>,
    ) -> Result<()> {
        corner::populated_cells(grid, points, p, &points.corners[p], hint, out)
    }

    fn corners(&self, points: &Points<D>, p: usize) -> Option<[[f64; D]; 8]> {
        Some(points.corners[p])
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
        cpdi2::moved_corners(step.grids, points, p, hint, &|node| (step.nodal)(p, node)).map(Some)
    }

    fn update_domains(
        &self,
        _: DomainUpdate,
        _: &DomainStep<'_, D>,
        points: &mut Points<D>,
    ) -> Result<usize> {
        domain::update_extents(points, |points, p| points.corners[p]);
        Ok(0)
    }
}
