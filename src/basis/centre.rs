//! Gradients of cells, for F-bar (de Souza Neto et al. 1996, IJSS 33:3277; Coombs et al. 2018, CMAME
//! 333:1 for material points).
//!
//! The change of volume that a point's stress sees is taken where a cell's functions can represent a
//! constant one. For `mpm` it is the mean Σ V ∇N / Σ V over the points of the cell: one volumetric constraint in
//! each cell, however many points it holds. In a cell that the material fills this is the value at the
//! centre, which the sources take. In a cell at the body's surface the centre may lie where there is no
//! material: a pressure would work there on a change of volume that the points do not have, while the mean
//! keeps it, Σ V ∇N_0 = Σ V ∇N. For `gimp` it is the mean over the centres of all cells that the domain overlaps,
//! each weighted by its share of the domain. Both reproduce the gradient of linear fields exactly, so that
//! a uniform deformation stays what it is.

use super::{Groups, Influences};
use crate::points::Points;

/// Means of the entries' `values` over the points of each cell, weighted by their volumes. A cell's points live
/// on one rank, and their rows are those of the cell. A point on a face whose row was made in a cell of choice
/// keeps its own values and is in no mean: that cell may be another rank's.
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
