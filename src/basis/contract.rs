//! `trait Basis`: what basis functions owe to the program.

use crate::deck::model::DomainUpdate;
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::points::Points;

use super::Influences;
use super::centre::{Moments, RowNodes};
use super::domain;

pub use super::domain::DomainStep;

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
            "method.locking = \"f-bar\": this basis gives no gradients of cells".to_string(),
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
