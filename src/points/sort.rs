//! Points in the order of their cells, so that neighbours in space are neighbours in memory and
//! every sum over points runs in the same order on a repeat.

use super::Points;

/// Points are left as they are while at most one in this many comes before its predecessor: a few
/// strays cost less than moving every point's state.
const STRAYS: usize = 50;

/// Sorts points by (cell, id), unless nearly all are in that order already. `cells[p]` is the
/// cell of point p. Points that are out of order in more than a few places end in the one order
/// that cell and id give.
pub fn sort_by_cell<const D: usize>(points: &mut Points<D>, cells: &[usize]) {
    let keys: Vec<(usize, u64)> = cells.iter().copied().zip(points.id.iter().copied()).collect();
    let strays = keys.windows(2).filter(|pair| pair[0] > pair[1]).count();
    if strays * STRAYS <= keys.len() {
        return;
    }
    let mut order: Vec<usize> = (0..keys.len()).collect();
    order.sort_unstable_by_key(|&p| keys[p]);
    points.select(&order);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(order: impl Iterator<Item = usize>) -> Points<2> {
        let mut points = Points::<2>::default();
        for k in order {
            points.push_unstrained(k as u64, 0, [k as f64, 0.0], 1.0, 1.0, [0.5; 2]);
        }
        points
    }

    #[test]
    fn order_depends_on_cell_and_id_only() {
        let sorted = |order: &[usize]| {
            let mut points = points(order.iter().copied());
            let cells: Vec<usize> = order.iter().map(|k| 100 - k / 2).collect();
            sort_by_cell(&mut points, &cells);
            assert!(points.id.iter().zip(&points.position).all(|(&id, x)| x[0] == id as f64));
            points.id
        };
        assert_eq!(sorted(&[3, 1, 4, 0, 2, 5]), [4, 5, 2, 3, 0, 1]);
        assert_eq!(sorted(&[0, 1, 2, 3, 4, 5]), sorted(&[5, 4, 3, 2, 1, 0]));
    }

    #[test]
    fn a_few_strays_stay() {
        let count = 10 * STRAYS;
        for (strays, kept) in [(0, true), (10, true), (11, false)] {
            let mut points = points(0..count);
            let mut cells: Vec<usize> = (0..count).collect();
            for k in 0..strays {
                cells.swap(7 * k, 7 * k + 1);
            }
            sort_by_cell(&mut points, &cells);
            assert_eq!(points.id.is_sorted(), kept, "{strays} strays");
        }
    }
}
