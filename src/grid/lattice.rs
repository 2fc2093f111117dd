//! Equal axis-aligned cells; nothing is stored per cell. Indices run x fastest.

/// A regular grid of boxes.
///
/// ```
/// use mpm_par::grid::{Grid, Lattice};
///
/// let grid = Grid::Lattice(Lattice { origin: [0.0; 2], spacing: [0.5; 2], cells: [4, 2] });
/// assert_eq!((grid.node_count(), grid.cell_count()), (15, 8));
/// // In the middle of a cell its four functions are equal.
/// let at = grid.interpolate(&[0.75, 0.25], 0.0, None).expect("inside the grid");
/// assert_eq!(at.values.weights[..4], [0.25; 4]);
/// assert!(grid.interpolate(&[2.1, 0.25], 0.0, None).is_none());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice<const D: usize> {
    /// Lower corner, m.
    pub origin: [f64; D],
    /// Cell size per axis, m.
    pub spacing: [f64; D],
    /// Cells per axis.
    pub cells: [usize; D],
}

/// Distance in cells up to which a position counts as lying on a grid line: far above round-off,
/// far below any length that matters. A point this far beyond the grid's edge is still inside.
pub const LINE_TOLERANCE: f64 = 1e-10;

/// Offsets of a cell's nodes from its lowest one, counter-clockwise, then upward (hex8 order).
pub const CELL_CORNERS: [[usize; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];

/// The same corners seen from the middle of a box, in half lengths: reference coordinates of
/// quad4 (first four, first two columns) and hex8.
pub const CORNER_SIGNS: [[f64; 3]; 8] = {
    let mut signs = [[0.0; 3]; 8];
    let mut entry = 0;
    while entry < 24 {
        signs[entry / 3][entry % 3] = 2.0 * CELL_CORNERS[entry / 3][entry % 3] as f64 - 1.0;
        entry += 1;
    }
    signs
};

impl<const D: usize> Lattice<D> {
    /// Nodes per axis.
    pub fn nodes(&self) -> [usize; D] {
        self.cells.map(|n| n + 1)
    }

    /// Nodes in all.
    pub fn node_count(&self) -> usize {
        self.nodes().iter().product()
    }

    /// Cells in all.
    pub fn cell_count(&self) -> usize {
        self.cells.iter().product()
    }

    /// Number of the node with this index along each axis.
    pub fn node_at(&self, index: [usize; D]) -> usize {
        flatten(index, self.nodes())
    }

    /// Index along each axis of a node.
    pub fn node_index(&self, node: usize) -> [usize; D] {
        unflatten(node, self.nodes())
    }

    /// Number of the cell with this index along each axis.
    pub fn cell_at(&self, index: [usize; D]) -> usize {
        flatten(index, self.cells)
    }

    /// Index along each axis of a cell.
    pub fn cell_index(&self, cell: usize) -> [usize; D] {
        unflatten(cell, self.cells)
    }

    /// Coordinates of a node, m.
    pub fn node_position(&self, node: usize) -> [f64; D] {
        let index = self.node_index(node);
        std::array::from_fn(|a| self.origin[a] + self.spacing[a] * index[a] as f64)
    }

    /// Where the grid ends along one axis, m.
    pub fn end(&self, axis: usize) -> f64 {
        self.origin[axis] + self.spacing[axis] * self.cells[axis] as f64
    }

    /// Position in units of cells along one axis.
    pub fn scaled(&self, axis: usize, x: f64) -> f64 {
        (x - self.origin[axis]) / self.spacing[axis]
    }

    /// The cell that holds `x` (half-open; the grid's upper edge is closed), `None` outside.
    #[inline]
    pub fn locate(&self, x: &[f64; D]) -> Option<usize> {
        self.cell_of(x).map(|index| self.cell_at(index))
    }

    /// [`Self::locate`], as the cell's index along each axis.
    #[inline]
    pub fn cell_of(&self, x: &[f64; D]) -> Option<[usize; D]> {
        let mut index = [0; D];
        for axis in 0..D {
            let t = self.scaled(axis, x[axis]);
            let n = self.cells[axis];
            if !(t >= -LINE_TOLERANCE && t <= n as f64 + LINE_TOLERANCE) {
                return None;
            }
            // Round-off must not split a row of points that lie on one grid line.
            index[axis] = ((t + LINE_TOLERANCE).max(0.0) as usize).min(n - 1);
        }
        Some(index)
    }

    /// Lowest-numbered cell at a node.
    pub fn lowest_cell(&self, node: usize) -> usize {
        self.cell_at(self.node_index(node).map(|i| i.saturating_sub(1)))
    }

    /// Distance in numbering of a cell's nodes from its lowest one, first axis fastest; the first
    /// 2^D count.
    pub fn corner_offsets(&self) -> [usize; 8] {
        std::array::from_fn(|corner| self.node_at(std::array::from_fn(|axis| corner >> axis & 1)))
    }

    /// Appends the cell's nodes in hex8 order.
    pub fn cell_nodes(&self, cell: usize, out: &mut Vec<usize>) {
        let low = self.cell_index(cell);
        for corner in CELL_CORNERS.iter().take(1 << D) {
            out.push(self.node_at(std::array::from_fn(|a| low[a] + corner[a])));
        }
    }

    /// Appends the cells across each face that lies inside the grid, -x, +x, -y, ...
    pub fn face_neighbours(&self, cell: usize, out: &mut Vec<usize>) {
        let index = self.cell_index(cell);
        let mut stride = 1;
        for (&i, &count) in index.iter().zip(&self.cells) {
            if i > 0 {
                out.push(cell - stride);
            }
            if i + 1 < count {
                out.push(cell + stride);
            }
            stride *= count;
        }
    }
}

fn flatten<const D: usize>(index: [usize; D], counts: [usize; D]) -> usize {
    let mut flat = 0;
    for axis in (0..D).rev() {
        flat = flat * counts[axis] + index[axis];
    }
    flat
}

fn unflatten<const D: usize>(mut flat: usize, counts: [usize; D]) -> [usize; D] {
    std::array::from_fn(|axis| {
        let i = flat % counts[axis];
        flat /= counts[axis];
        i
    })
}
