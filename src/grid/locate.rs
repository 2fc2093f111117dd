//! Point location on a mesh: uniform bins over the cells' bounding boxes.
//!
//! A query looks at the cells of one bin, whatever the mesh's size, its motion, or the distance
//! the point has travelled. Of several cells that hold a point (on a face, up to
//! [`EDGE_TOLERANCE`]) the lowest-numbered one wins, so the answer is the same on every rank.

use super::bins::{EDGE_TOLERANCE, REACH, bounding_box};
use super::element;
use super::inverse_map::inverse_map;
use super::mesh::Mesh;
use super::topology::OUTSIDE;

/// Cells that [`Mesh::walk`] looks at: three strides cross any of the cells that a box was cut
/// into, and neighbouring points are seldom more than a box apart.
const STRIDES: usize = 5;

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
