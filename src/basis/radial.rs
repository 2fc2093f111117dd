//! S, ∇S and S/r of rings: axisymmetry, x = r the radius and y the axis.
//!
//! A point stands for the ring 2π r_c A, r_c the radius at the middle of its domain. With the stress
//! constant on the domain, its share of a node's force is ∫ σ : ∇(N e_i) 2π r dA, that is V times
//!
//! - the gradient's row: G_I = ∫ ∇N_I r dA / (r_c A), the mean over the ring's volume;
//! - the hoop row: H_I = ∫ (N_I / r) r dA / (r_c A) = S°_I / r_c, S° the plain mean of N_I.
//!
//! dF_zz - 1 = Σ H_I u_rI. Both are exact, wherever the cells cut the domain: a uniform stress gives no
//! force at inner nodes (J. A. Nairn and J. E. Guilkey, IJNME 101 (2015) 127-147, weight the functions
//! by r for this reason). u_r = a r and u_y = b y give dF = (1 + a, 1 + b, 1 + a) to rounding, as
//! Σ S°_I r_I = r_c. Masses and loads of a point are spread by S_I = ∫ N_I r dA / (r_c A), so that a
//! weight balances a stress that is constant along r. The place of a point follows Σ S°_I u_I: S
//! would carry it like the ring's centre of mass, which lies l²/(3 r_c) further out, and part it from its
//! domain. S°_I is H_I over the sum of its row.
//!
//! For `mpm` the domain is a point, and S = S° = N(x_p). A domain that reaches beyond the axis, by what
//! its update is off, ends at the axis.

use super::contract::Basis;
use super::hats::{self, spans};
use super::product::{Line, for_each_index};
use super::{Influences, lattice_of, outside};
use crate::error::{Error, Result};
use crate::grid::{Grid, Lattice};
use crate::points::Points;

/// A domain's part in a cell, along one axis.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct AxisPart {
    /// Of the domain, of rings by volume
    pub share: f64,
    /// Mean place in the cell, so weighted
    pub place: f64,
    /// Of rings along the radius: share of the area over the domain's radius, 1/m; and the plain mean place.
    pub plain: [f64; 2],
}

/// Makes the rows those of rings: fills `hoop`, and weighs those of `gimp` by the radius. Error: a
/// point that is not off the axis, by id and place.
pub fn make_rings<const D: usize>(
    grid: &Grid<D>,
    basis: &dyn Basis<D>,
    points: &Points<D>,
    influences: &mut Influences<D>,
) -> Result<()> {
    influences.hoop = vec![0.0; influences.nodes.len()];
    basis.make_rings(grid, points, influences)
}

pub(super) fn rings_of_points<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
    influences: &mut Influences<D>,
) -> Result<()> {
    for p in 0..points.len() {
        let (row, radius) = (influences.row(p), points.position[p][0]);
        if !(radius > 0.0) {
            return Err(on_axis(grid, points, p));
        }
        for at in row {
            influences.hoop[at] = influences.weights[at] / radius;
        }
    }
    Ok(())
}

pub(super) fn rings_of_domains<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
    influences: &mut Influences<D>,
) -> Result<()> {
    let lattice = lattice_of(grid)?;
    let mut lines: [Line; D] = std::array::from_fn(|_| Line::default());
    let mut radial = Radial::default();
    for p in 0..points.len() {
        let spans = spans(grid, lattice, points, p)?;
        let (x, half) = (&points.position[p], &points.half_length[p]);
        for axis in 1..D {
            let (centre, spacing) = (lattice.scaled(axis, x[axis]), lattice.spacing[axis]);
            let reach = half[axis] / spacing;
            hats::fill(&mut lines[axis], spans[axis], centre, reach, spacing, None);
        }
        let cells = spans[0].last - spans[0].first + 1;
        let ends = [(x[0] - half[0]).max(0.0), x[0] + half[0]];
        if !(x[0] > 0.0) {
            return Err(on_axis(grid, points, p));
        }
        radial.fill(lattice, spans[0].first, cells, ends);
        let counts = spans.map(|span| span.last - span.first + 2);
        let start = influences.row(p).start;
        let mut at = start;
        for_each_index(&counts, |index| {
            // S and H are products of the lines, and so is each component of the gradient.
            let along = |lines: &[Line; D], slope: Option<usize>| -> f64 {
                (1..D)
                    .map(|a| {
                        let line = &lines[a];
                        if slope == Some(a) {
                            line.slopes[index[a]]
                        } else {
                            line.weights[index[a]]
                        }
                    })
                    .product()
            };
            let r = index[0];
            let across = along(&lines, None);
            influences.weights[at] = radial.weights[r] * across;
            influences.hoop[at] = radial.hoop[r] * across;
            influences.gradients[at] = std::array::from_fn(|a| match a {
                0 => radial.slopes[r] * across,
                _ => radial.weights[r] * along(&lines, Some(a)),
            });
            at += 1;
        });
        debug_assert_eq!(at, influences.row(p).end, "rows of gimp are those of its spans");
    }
    Ok(())
}

/// Functions of consecutive nodes along the radius.
#[derive(Debug, Clone, Default)]
struct Radial {
    /// ∫ N r dr / (r_c L)
    weights: Vec<f64>,
    /// ∫ N' r dr / (r_c L), 1/m
    slopes: Vec<f64>,
    /// ∫ N dr / (r_c L), 1/m
    hoop: Vec<f64>,
    axis_parts: Vec<AxisPart>,
}

impl Radial {
    /// Over `ends`, m, in `cells` cells from cell `first` on. Beyond the grid's edge the straight lines
    /// of the outer cell go on.
    fn fill<const D: usize>(
        &mut self,
        lattice: &Lattice<D>,
        first: usize,
        cells: usize,
        ends: [f64; 2],
    ) {
        for values in [&mut self.weights, &mut self.slopes, &mut self.hoop] {
            values.clear();
            values.resize(cells + 1, 0.0);
        }
        let spacing = lattice.spacing[0];
        self.axis_parts.clear();
        axis_parts_of_rings(lattice, first, cells, ends, &mut self.axis_parts);
        for (cell, part) in self.axis_parts.iter().enumerate() {
            let (share, centre, [plain, at]) = (part.share, part.place, part.plain);
            for (node, n, n_plain, sign) in
                [(cell, 1.0 - centre, 1.0 - at, -1.0), (cell + 1, centre, at, 1.0)]
            {
                self.weights[node] += share * n;
                self.slopes[node] += sign * share / spacing;
                self.hoop[node] += plain * n_plain;
            }
        }
    }
}

/// The parts of a ring's domain along the radius ([`super::centre`]); arguments as in [`Radial::fill`].
pub(super) fn axis_parts_of_rings<const D: usize>(
    lattice: &Lattice<D>,
    first: usize,
    cells: usize,
    [low, high]: [f64; 2],
    out: &mut Vec<AxisPart>,
) {
    let spacing = lattice.spacing[0];
    let line = |node: usize| lattice.origin[0] + (first + node) as f64 * spacing;
    let (length, middle) = (high - low, 0.5 * (low + high));
    for cell in 0..cells {
        let start = if cell == 0 { low } else { line(cell) };
        let end = if cell + 1 == cells { high } else { line(cell + 1) };
        let (length_here, radius) = (end - start, 0.5 * (start + end));
        let plain = length_here / length;
        let at = (radius - line(cell)) / spacing;
        let place = at + length_here * length_here / (12.0 * radius * spacing);
        out.push(AxisPart { share: plain * radius / middle, place, plain: [plain / middle, at] });
    }
}

fn on_axis<const D: usize>(grid: &Grid<D>, points: &Points<D>, p: usize) -> Error {
    if points.position[p][0] < 0.0 {
        return outside(grid, points, p);
    }
    Error::Run(format!(
        "point {} at {:?} m lies on the axis x = 0, where it is no ring: with analysis.symmetry = \
         \"axisymmetric\" points need a radius above zero",
        points.id[p], points.position[p]
    ))
}
