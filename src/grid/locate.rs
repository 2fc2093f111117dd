//! Point location on a mesh: uniform bins over the cells' bounding boxes.
//!
//! A query looks at the cells of one bin, whatever the mesh's size, its motion, or the distance
//! the point has travelled. Of several cells that hold a point (on a face, up to
//! [`EDGE_TOLERANCE`]) the lowest-numbered one wins, so the answer is the same on every rank.

use super::element;
use super::inverse_map::inverse_map;
use super::mesh::Mesh;
use super::topology::OUTSIDE;
use crate::deck::model::Element;

/// A point this far outside a cell, as a fraction of the cell's extent, still counts as inside.
pub const EDGE_TOLERANCE: f64 = 5e-10;

/// Furthest reach of [`Mesh::locate_near`] outside the mesh, as a fraction of the cell's extent.
pub const REACH: f64 = 0.25;

/// Cells that [`Mesh::walk`] looks at: three strides cross any of the cells that a box was cut
/// into, and neighbouring points are seldom more than a box apart.
const STRIDES: usize = 5;

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
fn bounding_box<const D: usize>(
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

/// Whether a cell that `x` is `outside` of is to be taken before one at `known`, or within this limit as
/// the `first`. Of cells equally near the lowest-numbered one is kept: round-off, which differs with
/// the number of ranks, must not decide, as their functions differ out there.
fn closer(outside: f64, known: f64, first: bool) -> bool {
    if first { outside <= known } else { outside < known - EDGE_TOLERANCE }
}

impl<const D: usize> Mesh<D> {
    /// The cell that holds `x`, `None` outside the mesh.
    pub fn locate(&self, x: &[f64; D]) -> Option<usize> {
        self.locate_near(x, 0.0, None).map(|found| found.0)
    }

    /// The cell that holds `x` and the reference coordinates there. Where no cell does, the
    /// outer cell that misses `x` by the smallest fraction of its extent, if that is at most
    /// `allowance` (up to [`REACH`]). A `hint` saves the search when `x` is well inside a cell
    /// near that one; it never changes the answer.
    pub fn locate_near(
        &self,
        x: &[f64; D],
        allowance: f64,
        hint: Option<usize>,
    ) -> Option<(usize, [f64; D])> {
        if self.folded {
            return self.deepest(x).or_else(|| self.nearest(x, allowance));
        }
        if let Some(found) = hint.and_then(|cell| self.walk(cell, x)) {
            return Some(found);
        }
        for &cell in self.bins.candidates(x) {
            if let Some((xi, outside)) = self.reference_of(cell as usize, x, 0.0)
                && outside <= EDGE_TOLERANCE
            {
                return Some((cell as usize, xi));
            }
        }
        self.nearest(x, allowance)
    }

    /// Appends the cells that hold `x`, ascending, the first that [`Self::locate`] names.
    pub(super) fn cells_holding(&self, x: &[f64; D], out: &mut Vec<usize>) {
        if self.folded {
            out.extend(self.locate(x));
            return;
        }
        out.extend(self.bins.candidates(x).iter().map(|&cell| cell as usize).filter(|&cell| {
            self.reference_of(cell, x, 0.0).is_some_and(|(_, outside)| outside <= EDGE_TOLERANCE)
        }));
    }

    /// From `cell` across the face that `x` is furthest beyond, again and again. A cell counts
    /// only if it holds `x` well inside: then no other does.
    fn walk(&self, mut cell: usize, x: &[f64; D]) -> Option<(usize, [f64; D])> {
        for _ in 0..STRIDES {
            let positions = self.cell_positions(cell);
            let nodes = &positions[..self.element.node_count()];
            let xi = inverse_map(self.element, nodes, x)?;
            if self.element.outside(&xi) < -EDGE_TOLERANCE {
                return Some((cell, xi));
            }
            let next = self.across_raw(cell)[self.element.face_towards(&xi)];
            if next == OUTSIDE {
                return None;
            }
            cell = next as usize;
        }
        None
    }

    /// Of the overlapping cells of a folded mesh, the one that holds `x` furthest from its edge,
    /// on the side where it is not turned over: for a Gauss point that is its own.
    fn deepest(&self, x: &[f64; D]) -> Option<(usize, [f64; D])> {
        let mut best: Option<(usize, [f64; D])> = None;
        let mut depth = EDGE_TOLERANCE;
        for &cell in self.bins.candidates(x) {
            let cell = cell as usize;
            let Some((xi, outside)) = self.reference_of(cell, x, 0.0) else { continue };
            let positions = self.cell_positions(cell);
            let nodes = &positions[..self.element.node_count()];
            let j = element::jacobian(nodes, &self.element.shape_gradients(&xi));
            if element::determinant(&j) > 0.0 && closer(outside, depth, best.is_none()) {
                depth = outside;
                best = Some((cell, xi));
            }
        }
        best
    }

    /// The outer cell that misses `x` by the smallest fraction of its extent, if that is at
    /// most `allowance`.
    fn nearest(&self, x: &[f64; D], allowance: f64) -> Option<(usize, [f64; D])> {
        let candidates = self.bins.candidates(x);
        let mut best: Option<(usize, [f64; D])> = None;
        let mut smallest = allowance.min(REACH);
        if smallest > 0.0 {
            for &cell in candidates {
                let cell = cell as usize;
                if self.across_raw(cell).contains(&OUTSIDE)
                    && let Some((xi, outside)) = self.reference_of(cell, x, smallest)
                    && closer(outside, smallest, best.is_none())
                {
                    smallest = outside;
                    best = Some((cell, xi));
                }
            }
        }
        best
    }

    /// Reference coordinates of `x` in `cell` and how far outside they are; `None` if `x` is
    /// clearly further out than `allowance`.
    fn reference_of(&self, cell: usize, x: &[f64; D], allowance: f64) -> Option<([f64; D], f64)> {
        let positions = self.cell_positions(cell);
        let nodes = &positions[..self.element.node_count()];
        let margin = 1.2 * allowance + 2.0 * EDGE_TOLERANCE;
        let (low, high) = bounding_box(nodes.iter().copied(), margin);
        if (0..D).any(|a| x[a] < low[a] || x[a] > high[a]) {
            return None;
        }
        let xi = inverse_map(self.element, nodes, x)?;
        Some((xi, self.element.outside(&xi)))
    }
}
