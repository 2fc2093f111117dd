//! S_v(x) = prod_a S_va(x_a): one-dimensional functions multiplied over the axes of a lattice.

#![allow(clippy::needless_range_loop, reason = "one index runs over several arrays")]

use super::Influences;
use crate::grid::Lattice;

/// Functions of consecutive nodes along one axis, from node `first` on.
#[derive(Debug, Clone, Default)]
pub(crate) struct Line {
    pub first: usize,
    pub weights: Vec<f64>,
    /// 1/m
    pub slopes: Vec<f64>,
}

impl Line {
    /// Restarts with `count` nodes of weight zero.
    #[inline]
    pub fn reset(&mut self, first: usize, count: usize) {
        self.first = first;
        for values in [&mut self.weights, &mut self.slopes] {
            values.clear();
            values.resize(count, 0.0);
        }
    }
}

/// Pushes a row with the product of the lines, nodes ascending.
#[inline]
pub(crate) fn push_row<const D: usize>(
    lattice: &Lattice<D>,
    lines: &[Line; D],
    influences: &mut Influences<D>,
) {
    let lowest = lattice.node_at(std::array::from_fn(|a| lines[a].first));
    let strides = strides(lattice.nodes());
    let counts: [usize; D] = std::array::from_fn(|a| lines[a].weights.len());
    for_each_index(&counts, |index| {
        let mut node = lowest;
        let (mut weights, mut slopes) = ([0.0; D], [0.0; D]);
        for a in 0..D {
            node += index[a] * strides[a];
            weights[a] = lines[a].weights[index[a]];
            slopes[a] = lines[a].slopes[index[a]];
        }
        let mut weight = 1.0;
        let mut gradient = slopes;
        for a in 0..D {
            weight *= weights[a];
            for b in 0..D {
                if b != a {
                    gradient[b] *= weights[a];
                }
            }
        }
        influences.push(node, weight, gradient);
    });
    influences.close_row();
}

/// Distance in numbering between neighbours along each axis.
#[inline]
fn strides<const D: usize>(counts: [usize; D]) -> [usize; D] {
    let mut strides = [1; D];
    for a in 1..D {
        strides[a] = strides[a - 1] * counts[a - 1];
    }
    strides
}

/// Calls `visit` with every index below `counts`, first axis fastest.
#[inline]
pub(crate) fn for_each_index<const D: usize>(
    counts: &[usize; D],
    mut visit: impl FnMut([usize; D]),
) {
    let total: usize = counts.iter().product();
    let mut index = [0; D];
    for _ in 0..total {
        visit(index);
        for axis in 0..D {
            index[axis] += 1;
            if index[axis] < counts[axis] {
                break;
            }
            index[axis] = 0;
        }
    }
}
