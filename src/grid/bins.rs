//! Uniform bins over the bounding boxes of a mesh's cells.

use super::topology::OUTSIDE;
use crate::deck::model::Element;

/// A point this far outside a cell, as a fraction of the cell's extent, still counts as inside.
pub const EDGE_TOLERANCE: f64 = 5e-10;

/// Furthest reach of `Mesh::locate_near` outside the mesh, as a fraction of the cell's extent.
pub const REACH: f64 = 0.25;

/// Cells by the bins their bounding boxes overlap, in compressed rows.
#[derive(Debug, Clone)]
pub(crate) struct Bins<const D: usize> {
    low: [f64; D],
    /// Bins per metre.
    scale: [f64; D],
    counts: [usize; D],
    offsets: Vec<u32>,
    /// Ascending within a bin.
    cells: Vec<u32>,
}

impl<const D: usize> Bins<D> {
    /// Bins of the size of a cell's bounding box; O(cells).
    pub fn new(
        element: Element,
        positions: &[[f64; D]],
        cells: &[u32],
        neighbours: &[u32],
    ) -> Self {
        let (corners, faces) = (element.node_count(), element.faces().len());
        let count = cells.len() / corners;
        let boxes: Vec<([f64; D], [f64; D])> = (0..count)
            .map(|cell| {
                // Outer cells also answer for points just outside the mesh.
                let outer = neighbours[cell * faces..(cell + 1) * faces].contains(&OUTSIDE);
                let margin = if outer { 1.2 * REACH } else { 2.0 * EDGE_TOLERANCE };
                let nodes = cells[cell * corners..(cell + 1) * corners].iter();
                bounding_box(nodes.map(|&n| positions[n as usize]), margin)
            })
            .collect();
        let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
        for (l, h) in &boxes {
            for a in 0..D {
                low[a] = low[a].min(l[a]);
                high[a] = high[a].max(h[a]);
            }
        }
        let volume: f64 = (0..D).map(|a| high[a] - low[a]).product();
        let per_box = if element.is_simplex() { [2.0, 6.0][D - 2] } else { 1.0 };
        let edge = (per_box * volume / count.max(1) as f64).powf(1.0 / D as f64);
        // Off the cells' own pitch: bins that line up with cells would list each cell in twice
        // as many bins per axis, because its faces fall on theirs.
        let low = low.map(|x| x - 0.382 * edge);
        let counts = std::array::from_fn(|a| {
            (((high[a] - low[a]) / edge).ceil() as usize).clamp(1, count.max(1))
        });
        let scale = [1.0 / edge; D];
        let mut bins = Self { low, scale, counts, offsets: Vec::new(), cells: Vec::new() };

        let mut offsets = vec![0u32; counts.iter().product::<usize>() + 1];
        for b in &boxes {
            bins.for_each_bin(b, |bin| offsets[bin + 1] += 1);
        }
        for bin in 1..offsets.len() {
            offsets[bin] += offsets[bin - 1];
        }
        let mut next = offsets.clone();
        let mut entries = vec![0u32; offsets[offsets.len() - 1] as usize];
        for (cell, b) in boxes.iter().enumerate() {
            bins.for_each_bin(b, |bin| {
                entries[next[bin] as usize] = cell as u32;
                next[bin] += 1;
            });
        }
        bins.offsets = offsets;
        bins.cells = entries;
        bins
    }

    /// Bin index along an axis, clamped to the bins.
    fn index(&self, axis: usize, x: f64) -> usize {
        (((x - self.low[axis]) * self.scale[axis]).max(0.0) as usize).min(self.counts[axis] - 1)
    }

    fn for_each_bin(&self, (low, high): &([f64; D], [f64; D]), mut visit: impl FnMut(usize)) {
        let first: [usize; D] = std::array::from_fn(|a| self.index(a, low[a]));
        let last: [usize; D] = std::array::from_fn(|a| self.index(a, high[a]));
        let mut at = first;
        loop {
            visit((0..D).rev().fold(0, |flat, a| flat * self.counts[a] + at[a]));
            let Some(axis) = (0..D).find(|&a| at[a] < last[a]) else { return };
            at[axis] += 1;
            at[..axis].copy_from_slice(&first[..axis]);
        }
    }

    /// Cells whose boxes may hold `x`, ascending.
    pub(crate) fn candidates(&self, x: &[f64; D]) -> &[u32] {
        if x.iter().any(|x| !x.is_finite()) {
            return &[];
        }
        let bin = (0..D).rev().fold(0, |flat, a| flat * self.counts[a] + self.index(a, x[a]));
        &self.cells[self.offsets[bin] as usize..self.offsets[bin + 1] as usize]
    }

    pub fn memory_bytes(&self) -> usize {
        4 * (self.offsets.len() + self.cells.len())
    }
}

/// Bounding box widened on every side by `margin` times its largest extent.
pub(super) fn bounding_box<const D: usize>(
    points: impl Iterator<Item = [f64; D]>,
    margin: f64,
) -> ([f64; D], [f64; D]) {
    let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for x in points {
        for a in 0..D {
            low[a] = low[a].min(x[a]);
            high[a] = high[a].max(x[a]);
        }
    }
    let reach = margin * (0..D).map(|a| high[a] - low[a]).fold(0.0, f64::max);
    (low.map(|x| x - reach), high.map(|x| x + reach))
}
