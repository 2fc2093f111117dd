//! A dense matrix of a group of points, added to the system as a whole.

use crate::system::pattern::Pattern;
use crate::system::scatter::BlockRows;

/// Adds the dense matrix of a group with `N` unknowns per node: entry (a, i, b, k) at
/// ((a N + i) nodes + b) N + k.
pub fn add_block<const N: usize, R: BlockRows<N>>(
    pattern: &Pattern,
    group: usize,
    nodes: &[u32],
    block: &[f64],
    rows: &mut R,
) {
    let (place, count) = (pattern.support_columns.of(group), nodes.len());
    let runs = count / place.run;
    for (a, &node) in nodes.iter().enumerate() {
        let row = pattern.row_of[node as usize] as usize;
        rows.touch(pattern, row);
        let width = N * (pattern.offsets[row + 1] - pattern.offsets[row]);
        let start = rows.start(pattern, row);
        for i in 0..N {
            let target = rows.values(start + i * width, width);
            let source = &block[(a * N + i) * count * N..(a * N + i + 1) * count * N];
            for b in 0..count {
                let first = usize::from(place.positions[a * runs + b / place.run]);
                let column = (first + b % place.run) * N;
                for k in 0..N {
                    target[column + k] += source[b * N + k];
                }
            }
        }
    }
}
