//! One point's nodes while they are collected from several places.

use crate::error::Result;
use crate::grid::{Interpolation, ShapeFunctions};
use crate::points::Points;

use super::Influences;

/// Triples (node, S, dS/dX~) and the cells they came from. [`Row::merge`] sums what belongs to
/// the same node; one row can serve all points in turn.
#[derive(Debug, Clone, Default)]
pub struct Row<const D: usize> {
    entries: Vec<(usize, f64, [f64; D])>,
    cells: Vec<usize>,
}

impl<const D: usize> Row<D> {
    /// Makes the row empty.
    pub fn clear(&mut self) {
        self.entries.clear();
        self.cells.clear();
    }

    /// Adds S = N(x) and dS = grad N(x) of a place: the standard functions.
    pub fn add_place(&mut self, at: &Interpolation<D>) {
        let values = &at.values;
        self.cells.push(values.cell);
        for a in 0..values.count {
            self.entries.push((values.nodes[a], values.weights[a], at.gradients[a]));
        }
    }

    /// Adds a corner: S += `weight` N(x) and dS += `gradient` N(x).
    pub fn add_corner(&mut self, at: &ShapeFunctions, weight: f64, gradient: &[f64; D]) {
        self.cells.push(at.cell);
        for (&node, &n) in at.nodes.iter().zip(&at.weights).take(at.count) {
            self.entries.push((node, weight * n, gradient.map(|g| g * n)));
        }
    }

    /// Sorts by node and sums entries of the same node, in the order they were added.
    pub fn merge(&mut self) {
        self.entries.sort_by_key(|entry| entry.0);
        self.entries.dedup_by(|next, kept| {
            if next.0 != kept.0 {
                return false;
            }
            kept.1 += next.1;
            for (sum, g) in kept.2.iter_mut().zip(&next.2) {
                *sum += g;
            }
            true
        });
        self.cells.sort_unstable();
        self.cells.dedup();
    }

    /// (node, S, dS/dX~ in 1/m); after [`Self::merge`] nodes ascend, each once.
    pub fn entries(&self) -> &[(usize, f64, [f64; D])] {
        &self.entries
    }

    /// Cells that contribute nodes; after [`Self::merge`] ascending, each once.
    pub fn cells(&self) -> &[usize] {
        &self.cells
    }
}

/// Influences of all points, each row made by `fill` (which replaces the row it is given).
pub(crate) fn map_points<const D: usize>(
    points: &Points<D>,
    mut fill: impl FnMut(usize, &mut Row<D>) -> Result<()>,
) -> Result<Influences<D>> {
    let mut influences = Influences::with_capacity(points.len(), 1 << D);
    let mut row = Row::default();
    for p in 0..points.len() {
        fill(p, &mut row)?;
        for (node, weight, gradient) in row.entries() {
            influences.push(*node, *weight, *gradient);
        }
        influences.close_row();
        influences.cells.push(row.cells());
    }
    Ok(influences)
}

/// Sorts what was appended after `start`, each value once.
pub(crate) fn sort_tail(values: &mut Vec<usize>, start: usize) {
    values[start..].sort_unstable();
    let mut kept = start;
    for i in start..values.len() {
        if i == start || values[i] != values[kept - 1] {
            values[kept] = values[i];
            kept += 1;
        }
    }
    values.truncate(kept);
}
