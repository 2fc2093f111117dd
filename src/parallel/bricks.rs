//! Units of partition on a lattice: bricks of b cells a side, the last of an axis maybe thinner.
//! Everything is arithmetic; nothing is stored per cell or brick.

use crate::grid::Lattice;

/// Largest brick side chosen automatically: larger ones make ragged parts and save nothing.
const LARGEST_SIDE: usize = 16;
/// Largest table of owners chosen automatically, units (four bytes each, on every rank).
pub(crate) const LARGEST_TABLE: usize = 4 << 20;
/// Populated bricks that every rank should have, so that loads can be levelled to about 2 %.
const BRICKS_PER_RANK: usize = 50;

/// The brick pattern of a lattice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bricks<const D: usize> {
    cells: [usize; D],
    side: usize,
    counts: [usize; D],
}

impl<const D: usize> Bricks<D> {
    pub fn new(lattice: &Lattice<D>, side: usize) -> Self {
        let side = side.max(1);
        Bricks { cells: lattice.cells, side, counts: lattice.cells.map(|n| n.div_ceil(side)) }
    }

    /// A side that gives each of `ranks` ranks enough of the bricks that hold `populated` cells,
    /// with a table of bounded size.
    pub fn automatic_side(lattice: &Lattice<D>, populated: usize, ranks: usize) -> usize {
        let cells_per_brick = populated as f64 / (BRICKS_PER_RANK * ranks) as f64;
        // A hair above, so that exact powers are not lost to rounding.
        let ideal = (cells_per_brick.powf(1.0 / D as f64) * (1.0 + 1e-12)).floor() as usize;
        let mut side = ideal.clamp(1, LARGEST_SIDE);
        while Self::new(lattice, side).count() > LARGEST_TABLE {
            side += 1;
        }
        side
    }

    /// Cells per side.
    pub fn side(&self) -> usize {
        self.side
    }

    /// Bricks in the grid.
    pub fn count(&self) -> usize {
        self.counts.iter().product()
    }

    fn at(&self, index: [usize; D]) -> usize {
        (0..D).rev().fold(0, |flat, axis| flat * self.counts[axis] + index[axis])
    }

    fn index(&self, mut brick: usize) -> [usize; D] {
        self.counts.map(|n| {
            let i = brick % n;
            brick /= n;
            i
        })
    }

    /// The brick of the cell with index `cell`.
    pub fn of_cell(&self, cell: [usize; D]) -> usize {
        self.at(cell.map(|i| i / self.side))
    }

    /// The brick of a node: that of the cell with the node's index, the last one at the upper
    /// edges of the grid.
    pub fn of_node(&self, node: [usize; D]) -> usize {
        self.of_cell(std::array::from_fn(|axis| node[axis].min(self.cells[axis] - 1)))
    }

    /// Place of a brick among those along x, and how many there are.
    pub fn along_x(&self, brick: usize) -> (usize, usize) {
        (self.index(brick)[0], self.counts[0])
    }

    /// Index of the cell at a brick's lower corner.
    pub fn first_cell(&self, brick: usize) -> [usize; D] {
        self.index(brick).map(|i| i * self.side)
    }

    /// Calls `visit` with each brick that shares a face, an edge or a corner, in ascending order,
    /// and with the weight of the contact: the cells along the shared face or edge, 1 for a
    /// corner.
    pub fn neighbours(&self, brick: usize, mut visit: impl FnMut(usize, usize)) {
        let index = self.index(brick);
        for code in 0..3usize.pow(D as u32) {
            let mut rest = code;
            let mut weight = 1;
            let mut inside = true;
            let other: [usize; D] = std::array::from_fn(|axis| {
                let shift = rest % 3;
                rest /= 3;
                if shift == 1 {
                    let start = index[axis] * self.side;
                    weight *= self.side.min(self.cells[axis] - start);
                }
                let moved = (index[axis] + shift).wrapping_sub(1);
                inside &= moved < self.counts[axis];
                moved
            });
            if inside && other != index {
                visit(self.at(other), weight);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice<const D: usize>(cells: [usize; D]) -> Lattice<D> {
        Lattice { origin: [0.0; D], spacing: [1.0; D], cells }
    }

    #[test]
    fn cells_and_nodes_find_their_bricks() {
        let bricks = Bricks::new(&lattice([7, 4]), 3);
        assert_eq!(bricks.count(), 3 * 2);
        assert_eq!(bricks.of_cell([0, 0]), 0);
        assert_eq!(bricks.of_cell([6, 3]), 5);
        assert_eq!(bricks.of_node([3, 2]), 1);
        assert_eq!(bricks.of_node([7, 4]), 5);
        assert_eq!(bricks.of_node([6, 0]), 2);
    }

    #[test]
    fn neighbours_are_mutual_ascending_and_weighted_by_contact() {
        let bricks = Bricks::new(&lattice([7, 4, 5]), 3);
        let list = |brick| {
            let mut list = Vec::new();
            bricks.neighbours(brick, |other, weight| list.push((other, weight)));
            list
        };
        for brick in 0..bricks.count() {
            let own = list(brick);
            assert!(own.is_sorted_by_key(|n| n.0));
            for (other, weight) in own {
                assert!(list(other).contains(&(brick, weight)), "{brick} {other}");
            }
        }
        // Brick 0 (3 x 3 x 3 cells): +x shares 9 cells, +y (1 thick) 9, +x+y an edge of 3.
        let own = list(0);
        assert_eq!(own.iter().map(|n| n.1).collect::<Vec<_>>(), [9, 9, 3, 9, 3, 3, 1]);
    }

    #[test]
    fn automatic_side_balances_count_and_table() {
        let grid = lattice([400, 400]);
        assert_eq!(Bricks::automatic_side(&grid, 160_000, 2), 16);
        assert_eq!(Bricks::automatic_side(&grid, 160_000, 200), 4);
        assert_eq!(Bricks::automatic_side(&grid, 10, 4), 1);
        let huge = lattice([1000, 1000, 1000]);
        let side = Bricks::automatic_side(&huge, 100, 64);
        assert!(Bricks::new(&huge, side).count() <= LARGEST_TABLE);
        assert!(Bricks::new(&huge, side - 1).count() > LARGEST_TABLE);
    }
}
