//! Gradients of cells for F-bar with domains that have corners ([`super::centre`] has the idea).
//!
//! How much of a parallelogram lies in a cell is found from the upright box around its corners, shrunk about its
//! centre to the domain's volume: a domain that is not turned is that box, and the shares are those of `gimp`. Shares
//! by the corners alone would jump: a domain that reaches a hundredth into the next cell has half of its
//! corners there, and pressures in the clay slope ran to 329 kPa. A domain's functions live at the nodes of its
//! corners' cells; cells with other nodes are left out. The shares sum to one, so that linear fields stay exact
//! whatever the domain's shape.

use super::centre::{Moments, RowNodes, part_of};
use super::{Influences, lattice_of};
use crate::error::Result;
use crate::grid::{Grid, Lattice};
use crate::points::Points;

/// A domain's part in a cell.
struct Part<const D: usize> {
    /// Of the domain
    share: f64,
    /// Mean place in the cell, in [0, 1] along each axis
    place: [f64; D],
    /// Places of the cell's nodes in the point's row: bit a of the index is set at the upper end of axis a.
    entries: [usize; 8],
}

/// The part of [low, high] inside the grid along one axis, in cells, and the first and last cell that it meets.
fn reach(low: f64, high: f64, cells: usize) -> (f64, f64, usize, usize) {
    let end = cells as f64;
    // A domain may stick out of the grid; conversion to usize saturates at zero.
    let (low, high) = (low.clamp(0.0, end), high.clamp(0.0, end));
    let first = (low as usize).min(cells - 1);
    let last = (high.ceil() as usize).clamp(first + 1, cells) - 1;
    (low, high, first, last)
}

/// The parts of the box with these half lengths about `centre` in cells all of whose nodes are in `row`.
fn parts_of_box<const D: usize>(
    lattice: &Lattice<D>,
    centre: &[f64; D],
    half: &[f64; D],
    row: &[usize],
    out: &mut Vec<Part<D>>,
) {
    out.clear();
    let offsets = lattice.corner_offsets();
    let lines: [_; D] = std::array::from_fn(|a| {
        let scaled = |x: f64| lattice.scaled(a, x);
        reach(scaled(centre[a] - half[a]), scaled(centre[a] + half[a]), lattice.cells[a])
    });
    let counts = lines.map(|(_, _, first, last)| last - first + 1);
    for number in 0..counts.iter().product() {
        let mut rest: usize = number;
        let (mut part, mut cell) = (Part { share: 1.0, place: [0.0; D], entries: [0; 8] }, [0; D]);
        for (a, (low, high, first, _)) in lines.iter().enumerate() {
            cell[a] = first + rest % counts[a];
            rest /= counts[a];
            let start = low.max(cell[a] as f64);
            let end = high.min((cell[a] + 1) as f64);
            part.share *= if high > low { (end - start) / (high - low) } else { 1.0 };
            part.place[a] = 0.5 * (start + end) - cell[a] as f64;
        }
        let lowest = lattice.node_at(cell);
        let all = (0..1 << D).all(|corner| {
            let found = row.binary_search(&(lowest + offsets[corner]));
            part.entries[corner] = found.unwrap_or_default();
            found.is_ok()
        });
        if all && part.share > 0.0 {
            out.push(part);
        }
    }
}

/// The parts of a domain of this volume, m^D; the shares sum to one.
fn parts<const D: usize>(
    lattice: &Lattice<D>,
    corners: &[[f64; D]; 8],
    volume: f64,
    row: &[usize],
    out: &mut Vec<Part<D>>,
) {
    let corners = &corners[..1 << D];
    let end = |a: usize, larger: fn(f64, f64) -> f64| {
        corners.iter().map(|x| x[a]).reduce(larger).unwrap_or_default()
    };
    let (low, high) = (
        std::array::from_fn::<f64, D, _>(|a| end(a, f64::min)),
        std::array::from_fn::<f64, D, _>(|a| end(a, f64::max)),
    );
    let centre = std::array::from_fn(|a| 0.5 * (low[a] + high[a]));
    let half: [f64; D] = std::array::from_fn(|a| 0.5 * (high[a] - low[a]));
    let whole = half.iter().map(|h| 2.0 * h).product::<f64>();
    let shrunk = (volume / whole).powf(1.0 / D as f64).min(1.0);
    parts_of_box(lattice, &centre, &half.map(|h| shrunk * h), row, out);
    if out.is_empty() {
        // A long domain whose middle cells have no corner: the whole box reaches those that have.
        parts_of_box(lattice, &centre, &half, row, out);
    }
    let kept: f64 = out.iter().map(|part| part.share).sum();
    for part in out {
        part.share /= kept;
    }
}

/// Moments of this rank's domains at the lowest node of each cell (local).
pub(super) fn moments<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
    influences: &Influences<D>,
    rows: RowNodes<'_>,
    corners: impl Fn(usize) -> [[f64; D]; 8],
) -> Result<Vec<Moments>> {
    let lattice = lattice_of(grid)?;
    let mut sums = vec![Moments::default(); rows.count];
    let mut found = Vec::new();
    for p in 0..points.len() {
        let row = &influences.nodes[influences.row(p)];
        parts(lattice, &corners(p), points.volume(p), row, &mut found);
        for part in &found {
            let sum = &mut sums[rows.of(p)[part.entries[0]] as usize];
            for (mask, moment) in sum.iter_mut().enumerate().take(1 << D) {
                let of = |a: usize| if mask >> a & 1 == 1 { part.place[a] } else { 1.0 };
                *moment += points.volume(p) * part.share * (0..D).map(of).product::<f64>();
            }
        }
    }
    Ok(sums)
}

/// Fills the rows of F-bar from the moments of all ranks' domains.
pub(super) fn fill<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
    influences: &mut Influences<D>,
    rows: RowNodes<'_>,
    sums: &[Moments],
    corners: impl Fn(usize) -> [[f64; D]; 8],
) -> Result<()> {
    let lattice = lattice_of(grid)?;
    influences.centre_gradients = vec![[0.0; D]; influences.nodes.len()];
    let (mut found, mut of_point) = (Vec::new(), Vec::new());
    for p in 0..points.len() {
        let row = influences.row(p);
        let start = row.start;
        parts(lattice, &corners(p), points.volume(p), &influences.nodes[row], &mut found);
        of_point.clear();
        of_point.extend(found.iter().map(|part| {
            let sum = &sums[rows.of(p)[part.entries[0]] as usize];
            part_of(part.share, part.entries, sum, &lattice.spacing, false)
        }));
        influences.add_parts(start, &of_point);
    }
    Ok(())
}
