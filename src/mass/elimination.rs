//! The order in which a rank eliminates its nodes: first the inner ones, on a plane lattice along its
//! axes towards the border with other ranks, then those on the border, ascending.
//!
//! The mass of evenly spread points is a Kronecker product over the axes, and the factor of a
//! product has no fill in any order that runs along each axis one way. The border comes last, so each
//! side has to run towards it: nodes eliminated on the way from the border to the far end would couple
//! the two.

use std::ops::Range;

use crate::grid::{Grid, Lattice};

use crate::system::border::Border;
use crate::system::numbering::Numbering;
use crate::system::pattern::Pattern;

/// An axis is turned if the border lies below by this share of what it does along the main axis.
const CLEARLY: i64 = 4;

/// Owned nodes in the order of elimination.
pub struct Order {
    pub nodes: Vec<u32>,
    /// The first so many of them are inner nodes: those that meet no node of another rank.
    pub inner: usize,
}

impl Order {
    /// `rows`: the border of the pattern. Meshes have no axes: ascending there, and in space.
    pub fn new<const D: usize>(
        grid: &Grid<D>,
        numbering: &Numbering,
        pattern: &Pattern,
        rows: &Border,
    ) -> Self {
        let listed = |runs: &[Range<usize>]| -> Vec<u32> {
            runs.iter().cloned().flatten().map(|row| row as u32).collect()
        };
        let (border, mut nodes) = (listed(&rows.reaching), listed(&rows.inner));
        let inner = nodes.len();
        // In space the borders are too frayed for it to gain, and pic in the stretch loses digits.
        if D == 2
            && let Grid::Lattice(lattice) = grid
        {
            let of = |node: u32| numbering.nodes[node as usize];
            let pairs = border.iter().flat_map(|&row| {
                let columns = pattern.offsets[row as usize]..pattern.offsets[row as usize + 1];
                let columns = pattern.columns[columns].iter().copied();
                let foreign = columns.filter(|&column| column as usize >= numbering.owned);
                foreign.map(move |column| (of(row), of(column)))
            });
            run_along(lattice, downward(lattice, pairs), &numbering.nodes, &mut nodes);
        }
        nodes.extend(border);
        Order { nodes, inner }
    }
}

/// The axes along which others lie below; `pairs`: each node with one of another rank it meets.
fn downward<const D: usize>(
    lattice: &Lattice<D>,
    pairs: impl Iterator<Item = (usize, usize)>,
) -> [bool; D] {
    let mut sums = [0; D];
    for (here, there) in pairs {
        let (here, there) = (lattice.node_index(here), lattice.node_index(there));
        for axis in 0..D {
            sums[axis] += there[axis] as i64 - here[axis] as i64;
        }
    }
    let most = sums.iter().map(|sum| sum.abs()).max().unwrap_or(0);
    sums.map(|sum| -sum * CLEARLY > most)
}

/// Sorts ascending local nodes along the axes, down the `downward` ones.
fn run_along<const D: usize>(
    lattice: &Lattice<D>,
    downward: [bool; D],
    grid_nodes: &[usize],
    nodes: &mut [u32],
) {
    if downward == [true; D] {
        nodes.reverse();
    } else if downward != [false; D] {
        nodes.sort_by_cached_key(|&node| {
            let index = lattice.node_index(grid_nodes[node as usize]);
            lattice.node_at(std::array::from_fn(|axis| match downward[axis] {
                true => lattice.cells[axis] - index[axis],
                false => index[axis],
            }))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rank_runs_towards_the_others() {
        let lattice = Lattice { origin: [0.0; 2], spacing: [1.0; 2], cells: [2, 1] };
        let node = |x, y| lattice.node_at([x, y]);
        let grid_nodes: Vec<usize> = (0..6).collect();
        let order = |pairs: &[(usize, usize)]| {
            let mut nodes: Vec<u32> = (0..6).collect();
            run_along(&lattice, downward(&lattice, pairs.iter().copied()), &grid_nodes, &mut nodes);
            nodes
        };
        assert_eq!(order(&[]), [0, 1, 2, 3, 4, 5]);
        let above = [(node(0, 0), node(1, 0)), (node(0, 1), node(1, 0)), (node(0, 0), node(1, 1))];
        assert_eq!(order(&above), [0, 1, 2, 3, 4, 5]);
        assert_eq!(order(&above.map(|(a, b)| (b, a))), [2, 1, 0, 5, 4, 3]);
        assert_eq!(order(&[(node(0, 1), node(0, 0))]), [3, 4, 5, 0, 1, 2]);
        assert_eq!(order(&[(node(2, 1), node(1, 0))]), [5, 4, 3, 2, 1, 0]);
    }
}
