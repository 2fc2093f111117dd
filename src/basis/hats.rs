//! Hats over rectangular domains, axis by axis: the cells that a domain overlaps, and the mean of each
//! hat over it.
//!
//! The mean of a hat function over an interval is summed cell by cell, where the hat is linear:
//! the share of the domain in the cell times the hat at the middle of that piece. This is exact
//! for any half length and free of cancellation. Where a domain sticks out of the grid, the straight
//! lines of the grid's outer cell go on beyond its edge: S sums to one and reproduces linear fields
//! there too, so that no weight is lost. The formula alone would need the node beyond the edge; its
//! share s^2 / (4 l_p h), s the length that sticks out, is given to the outer two nodes as 2 and -1.
//!
//! A cell is overlapped when it is so along each axis; one that is only touched, to the rounding of the
//! position, is not. The cell that holds the centre always counts.

use super::outside;
use super::product::Line;
use crate::error::{Error, Result};
use crate::grid::lattice::LINE_TOLERANCE;
use crate::grid::{Grid, Lattice};
use crate::points::Points;

/// An overlap counts as touching up to this many roundings of the numbers it is computed from,
/// and no more: what the roundings of many steps add up to is a true, if tiny, overlap, the very
/// case that Ghost stabilisation is for (Ghost Figure 3).
const ROUNDINGS: f64 = 4.0 * f64::EPSILON;
/// Half length in cells below which a domain has vanished: its ends are no longer distinct.
const SMALLEST_REACH: f64 = 1e-13;

/// The first and last cell overlapped along one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Span {
    pub first: usize,
    pub last: usize,
}

impl Span {
    /// Of the scaled interval [low, high] around `centre`, all in cells from the grid's origin;
    /// overlaps up to `touch` do not count.
    #[inline]
    fn new(low: f64, centre: f64, high: f64, cells: usize, touch: f64) -> Self {
        // Conversion to usize saturates: ends beyond the grid are clamped to it.
        let home = (centre as usize).min(cells - 1);
        let first = ((low + touch) as usize).min(home);
        let last = ((high - touch).ceil() as usize).clamp(home + 1, cells) - 1;
        Span { first, last }
    }
}

/// The cells overlapped by the domain of point `p`, per axis.
#[inline]
pub(crate) fn spans<const D: usize>(
    grid: &Grid<D>,
    lattice: &Lattice<D>,
    points: &Points<D>,
    p: usize,
) -> Result<[Span; D]> {
    let (x, half) = (&points.position[p], &points.half_length[p]);
    let mut spans = [Span { first: 0, last: 0 }; D];
    for axis in 0..D {
        let centre = lattice.scaled(axis, x[axis]);
        let end = lattice.cells[axis] as f64;
        if !(centre >= -LINE_TOLERANCE && centre <= end + LINE_TOLERANCE) {
            return Err(outside(grid, points, p));
        }
        let reach = half[axis] / lattice.spacing[axis];
        if !(reach > SMALLEST_REACH && reach.is_finite()) {
            return Err(Error::Run(format!(
                "point {} at {x:?} m has domain half lengths {half:?} m; each must be \
                 positive, and not negligible against the cells",
                points.id[p]
            )));
        }
        let size = x[axis].abs() + lattice.origin[axis].abs() + half[axis];
        let touch = ROUNDINGS * (size / lattice.spacing[axis]);
        let (low, high) = (centre - reach, centre + reach);
        spans[axis] = Span::new(low, centre, high, lattice.cells[axis], touch);
    }
    Ok(spans)
}

/// Fills `line` with the means of the hats over [centre - reach, centre + reach], in cells.
/// `published`: the cells of the grid, where the hats of its outermost nodes fall to zero beyond it.
#[inline]
pub(crate) fn fill(
    line: &mut Line,
    span: Span,
    centre: f64,
    reach: f64,
    spacing: f64,
    published: Option<usize>,
) {
    let last = span.last - span.first;
    line.reset(span.first, last + 2);
    // Distances are taken from the span's first node, so large grids cost no digits. The
    // outermost pieces end where the domain ends: beyond an end that only round-off parts from a
    // grid line, and beyond the grid's edge, the cell's straight lines go on.
    let offset = centre - span.first as f64;
    let (mut low, mut high) = (offset - reach, offset + reach);
    let per_length = 1.0 / (high - low);
    if let Some(cells) = published {
        let edge = (last + 1) as f64;
        if span.first == 0 && low < -LINE_TOLERANCE {
            let share = low.max(-1.0).abs() * per_length;
            let middle = 0.5 * low.max(-1.0);
            line.weights[0] += share * (1.0 + middle);
            line.slopes[0] += share / spacing;
            low = 0.0;
        }
        if span.last + 1 == cells && high > edge + LINE_TOLERANCE {
            let beyond = (high - edge).min(1.0);
            let share = beyond * per_length;
            let middle = 0.5 * beyond;
            line.weights[last + 1] += share * (1.0 - middle);
            line.slopes[last + 1] -= share / spacing;
            high = edge;
        }
    }
    for cell in 0..=last {
        let start = if cell == 0 { low } else { cell as f64 };
        let end = if cell == last { high } else { (cell + 1) as f64 };
        let share = (end - start) * per_length;
        let middle = 0.5 * (start + end) - cell as f64;
        line.weights[cell] += share * (1.0 - middle);
        line.weights[cell + 1] += share * middle;
        line.slopes[cell] -= share / spacing;
        line.slopes[cell + 1] += share / spacing;
    }
}
