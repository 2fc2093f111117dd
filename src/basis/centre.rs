//! Gradients of cells, for F-bar (de Souza Neto et al. 1996, IJSS 33:3277; Coombs et al. 2018, CMAME
//! 333:1 for material points).
//!
//! The change of volume that a point's stress sees is taken where a cell's functions can represent a
//! constant one: as the mean over the material in the cell, Σ V ∇N / Σ V. In a cell that the material
//! fills this is the value at the centre, which the sources take. In a cell at the body's surface the
//! centre may lie where there is no material: a pressure would work there on a change of volume that the points
//! do not have, while the mean keeps it, Σ V ∇N_0 = Σ V ∇N, so that a uniform pressure acts as it does
//! without F-bar. A uniform deformation stays what it is.
//!
//! For `mpm` the sums run over the points of the cell. For `gimp` they run over the parts of all domains that lie in
//! the cell, whichever rank they live on: Σ_q V_q w_qc <∇N>_qc / Σ_q V_q w_qc with the shares w_qc of the domains. A
//! point has the change of volume of its cells ([`super::cell_parts`]). The functions of a cell are linear along
//! each axis, so that moments of the parts give these means.

use super::cell_parts::CellPart;
use super::hats::spans;
use super::product::for_each_index;
use super::radial::{AxisPart, axis_parts_of_rings};
use super::{Groups, Influences, lattice_of};
use crate::error::Result;
use crate::grid::{Grid, Lattice};
use crate::points::Points;

/// Moments of the material in a cell, m3: entry m is Σ V Π ξ_a over the axes a in the bits of m, ξ in [0, 1]
/// the place in the cell. For rings, V is weighted by the radius, and entries 4 + m are the moments of V/r, m2.
pub type Moments = [f64; 8];

/// Local nodes of the points' rows.
#[derive(Clone, Copy)]
pub struct RowNodes<'a> {
    pub groups: &'a Groups,
    /// Of each entry of `groups.nodes`
    pub nodes: &'a [u32],
    /// Local nodes
    pub count: usize,
}

impl RowNodes<'_> {
    /// Local nodes of point `p`'s row
    pub(super) fn of(&self, p: usize) -> &[u32] {
        let (group, offsets) = (self.groups.group_of_point[p], &self.groups.node_offsets);
        &self.nodes[offsets[group]..offsets[group + 1]]
    }
}

/// Fills the rows of F-bar with the means over the points of each cell ([`means`]).
pub(super) fn fill_from_points<const D: usize>(points: &Points<D>, influences: &mut Influences<D>) {
    let gradients = means(points, influences, &influences.gradients);
    let hoops: Vec<[f64; 1]> = influences.hoop.iter().map(|hoop| [*hoop]).collect();
    if !hoops.is_empty() {
        influences.centre_hoop = means(points, influences, &hoops).into_flattened();
    }
    influences.centre_gradients = gradients;
}

/// Means of the entries' `values` over the points of each cell, weighted by their volumes. A cell's points live
/// on one rank, and their rows are those of the cell. A point on a face may have its row made in a cell of choice
/// ([`Influences::replace_row`]): it keeps its own values and is in no mean, as that cell may be another rank's.
pub(super) fn means<const D: usize, const N: usize>(
    points: &Points<D>,
    influences: &Influences<D>,
    values: &[[f64; N]],
) -> Vec<[f64; N]> {
    let groups = Groups::new(influences);
    let mut sums = vec![[0.0; N]; groups.nodes.len()];
    let mut whole = vec![0.0; groups.len()];
    let at_home = |p: &usize| !influences.cells.chosen.contains_key(p);
    for p in (0..points.len()).filter(at_home) {
        let (group, volume) = (groups.group_of_point[p], points.volume(p));
        whole[group] += volume;
        for (sum, at) in sums[groups.node_offsets[group]..].iter_mut().zip(influences.row(p)) {
            for (sum, value) in sum.iter_mut().zip(&values[at]) {
                *sum += volume * value;
            }
        }
    }
    let mut means = values.to_vec();
    for p in (0..points.len()).filter(at_home) {
        let group = groups.group_of_point[p];
        for (sum, at) in sums[groups.node_offsets[group]..].iter().zip(influences.row(p)) {
            means[at] = sum.map(|sum| sum / whole[group]);
        }
    }
    means
}

/// The parts of point `p`'s domain along each axis, and the first cell of each.
fn axis_parts<const D: usize>(
    grid: &Grid<D>,
    lattice: &Lattice<D>,
    points: &Points<D>,
    p: usize,
    rings: bool,
    out: &mut [Vec<AxisPart>; D],
) -> Result<()> {
    let spans = spans(grid, lattice, points, p)?;
    let (x, half) = (&points.position[p], &points.half_length[p]);
    for (axis, line) in out.iter_mut().enumerate() {
        line.clear();
        let span = spans[axis];
        if rings && axis == 0 {
            let ends = [(x[0] - half[0]).max(0.0), x[0] + half[0]];
            axis_parts_of_rings(lattice, span.first, span.last - span.first + 1, ends, line);
            continue;
        }
        let reach = half[axis] / lattice.spacing[axis];
        let offset = lattice.scaled(axis, x[axis]) - span.first as f64;
        let (low, high, last) = (offset - reach, offset + reach, span.last - span.first);
        for cell in 0..=last {
            let start = if cell == 0 { low } else { cell as f64 };
            let end = if cell == last { high } else { (cell + 1) as f64 };
            let (share, place) = ((end - start) / (high - low), 0.5 * (start + end) - cell as f64);
            line.push(AxisPart { share, place, plain: [0.0; 2] });
        }
    }
    Ok(())
}

/// Moments of this rank's domains at the lowest node of each cell (local).
pub(super) fn moments_of_domains<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
    rings: bool,
    rows: RowNodes<'_>,
) -> Result<Vec<Moments>> {
    let lattice = lattice_of(grid)?;
    let mut sums = vec![Moments::default(); rows.count];
    let mut parts: [Vec<AxisPart>; D] = std::array::from_fn(|_| Vec::new());
    for p in 0..points.len() {
        axis_parts(grid, lattice, points, p, rings, &mut parts)?;
        let (nodes, volume) = (rows.of(p), points.volume(p));
        let counts = parts.each_ref().map(|line| line.len());
        for_each_index(&counts, |index| {
            let sum = &mut sums[nodes[place_in_row(&counts, index)] as usize];
            for mask in 0..1 << D {
                let (mut moment, mut inverse) = (volume, volume);
                for axis in 0..D {
                    let part = &parts[axis][index[axis]];
                    let bit = mask >> axis & 1 == 1;
                    let own = part.share * if bit { part.place } else { 1.0 };
                    moment *= own;
                    inverse *= match axis {
                        0 => part.plain[0] * if bit { part.plain[1] } else { 1.0 },
                        _ => own,
                    };
                }
                sum[mask] += moment;
                if rings {
                    sum[4 + mask] += inverse;
                }
            }
        });
    }
    Ok(sums)
}

/// Fills the rows of F-bar from the moments of all ranks' domains.
pub(super) fn fill_from_domains<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
    influences: &mut Influences<D>,
    rows: RowNodes<'_>,
    sums: &[Moments],
) -> Result<()> {
    let lattice = lattice_of(grid)?;
    let rings = !influences.hoop.is_empty();
    influences.centre_gradients = vec![[0.0; D]; influences.nodes.len()];
    influences.centre_hoop = vec![0.0; influences.hoop.len()];
    let mut parts: [Vec<AxisPart>; D] = std::array::from_fn(|_| Vec::new());
    let mut of_point = Vec::new();
    for p in 0..points.len() {
        axis_parts(grid, lattice, points, p, rings, &mut parts)?;
        let (nodes, start) = (rows.of(p), influences.row(p).start);
        let counts = parts.each_ref().map(|line| line.len());
        of_point.clear();
        for_each_index(&counts, |index| {
            let sum = &sums[nodes[place_in_row(&counts, index)] as usize];
            let share: f64 = (0..D).map(|a| parts[a][index[a]].share).product();
            let mut entries = [0; 8];
            for (corner, entry) in entries.iter_mut().enumerate().take(1 << D) {
                let node = std::array::from_fn(|a| index[a] + (corner >> a & 1));
                *entry = place_in_row(&counts, node);
            }
            of_point.push(part_of(share, entries, sum, &lattice.spacing, rings));
        });
        influences.add_parts(start, &of_point);
    }
    Ok(())
}

/// The part of a domain in a cell with these `moments`. `entries`: places of the cell's nodes in the point's row.
pub(super) fn part_of<const D: usize>(
    share: f64,
    entries: [usize; 8],
    moments: &Moments,
    spacing: &[f64; D],
    rings: bool,
) -> CellPart<D> {
    let mut part = CellPart {
        share,
        entries: entries.map(|entry| entry as u16),
        gradients: [[0.0; D]; 8],
        hoops: [0.0; 8],
    };
    let weight = 1.0 / moments[0];
    for corner in 0..1usize << D {
        add_cell_gradient(&mut part.gradients[corner], weight, moments, corner, spacing);
        if rings {
            part.hoops[corner] = weight * product_mean(&moments[4..], corner, (1 << D) - 1);
        }
    }
    part
}

impl<const D: usize> Influences<D> {
    /// Ends the cells of the next point; `start`: the begin of its row. The means over the cells go to the rows of
    /// F-bar. Several cells are kept beside them.
    pub(super) fn add_parts(&mut self, start: usize, parts: &[CellPart<D>]) {
        for part in parts {
            for (place, row, hoop) in part.nodes() {
                let mean = &mut self.centre_gradients[start + place];
                mean.iter_mut().zip(row).for_each(|(mean, g)| *mean += part.share * g);
                if let Some(mean) = self.centre_hoop.get_mut(start + place) {
                    *mean += part.share * hoop;
                }
            }
        }
        self.parts.push(parts);
    }
}

/// Place of a node in a row of domains; `counts`: cells along each axis, one less than nodes.
fn place_in_row<const D: usize>(counts: &[usize; D], index: [usize; D]) -> usize {
    (0..D).rev().fold(0, |place, axis| place * (counts[axis] + 1) + index[axis])
}

/// Adds `weight` times Σ V ∇N of the node at `corner` (a bit per axis) of a cell with these `moments`, 1/m.
fn add_cell_gradient<const D: usize>(
    gradient: &mut [f64; D],
    weight: f64,
    moments: &Moments,
    corner: usize,
    spacing: &[f64; D],
) {
    for axis in 0..D {
        let others = !(1usize << axis) & ((1 << D) - 1);
        let sign = if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
        let slope = sign / spacing[axis];
        gradient[axis] += weight * slope * product_mean(&moments[..], corner, others);
    }
}

/// Σ V Π_a N_a over the `axes` (bits), N_a = ξ_a at the upper end of axis a and 1 - ξ_a at the lower one, the
/// ends those of `corner`.
fn product_mean(moments: &[f64], corner: usize, axes: usize) -> f64 {
    let (upper, lower) = (corner & axes, !corner & axes);
    // Π (1 - ξ) over the lower ends is the alternating sum over their subsets.
    let (mut sum, mut subset) = (0.0, lower);
    loop {
        let sign = if subset.count_ones() % 2 == 0 { 1.0 } else { -1.0 };
        sum += sign * moments[upper | subset];
        if subset == 0 {
            return sum;
        }
        subset = (subset - 1) & lower;
    }
}
