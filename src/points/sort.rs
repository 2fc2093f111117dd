//! Points in the order of their cells, so that neighbours in space are neighbours in memory and
//! every sum over points runs in the same order on a repeat.

use super::Points;
use super::gather::Moves;

/// Points are left as they are while at most one in this many comes before its predecessor: a few
/// strays cost less than moving every point's state.
const STRAYS: usize = 50;

/// Puts the points from place `own` on where others are `gone` (ascending, below `own`), closes the
/// places that are left with the last points, and sorts as [`sort_by_cell`] does. What leaves and
/// what arrives in a step lies along the same borders: the order hardly suffers, and all the others
/// stay where they are.
pub fn fill_gaps<const D: usize>(
    points: &mut Points<D>,
    cells: &mut Vec<usize>,
    gone: &[usize],
    own: usize,
) {
    let moves = Moves::new(gone, own, points.len());
    points.rearrange(&moves);
    moves.apply(cells);
    sort_by_cell(points, cells);
}

/// Sorts the points by (cell, id), unless nearly all are in that order already. `cells[p]` is the
/// cell of point p. Points that are out of order in more than a few places end in the one order
/// that cell and id give.
pub fn sort_by_cell<const D: usize>(points: &mut Points<D>, cells: &[usize]) {
    let key = |p: usize| (cells[p], points.id[p]);
    let strays = (1..cells.len()).filter(|&p| key(p - 1) > key(p)).count();
    if strays * STRAYS > cells.len() {
        points.select(&order_of(cells, &points.id));
    }
}

/// Places in ascending (cell, id): by counting where the cells lie close together, by comparing
/// where they do not.
fn order_of(cells: &[usize], ids: &[u64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..cells.len()).collect();
    let (Some(&low), Some(&high)) = (cells.iter().min(), cells.iter().max()) else { return order };
    if (high - low) / 16 > cells.len() {
        order.sort_unstable_by_key(|&p| (cells[p], ids[p]));
        return order;
    }
    let mut ends = vec![0; high - low + 1];
    cells.iter().for_each(|&cell| ends[cell - low] += 1);
    let mut before = 0;
    for end in &mut ends {
        before += std::mem::replace(end, before);
    }
    for (p, &cell) in cells.iter().enumerate() {
        let place = &mut ends[cell - low];
        order[*place] = p;
        *place += 1;
    }
    let mut start = 0;
    for end in ends {
        order[start..end].sort_unstable_by_key(|&p| ids[p]);
        start = end;
    }
    order
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
    fn arrivals_fill_gaps() {
        let count = 10 * STRAYS;
        let mut points = points(0..count + 1);
        let mut cells: Vec<usize> = (0..count).chain([4]).collect();
        fill_gaps(&mut points, &mut cells, &[1, 7], count);
        assert_eq!(
            (points.len(), points.mass.len(), cells.len()),
            (count - 1, count - 1, count - 1)
        );
        assert_eq!(points.id[..3], [0, count as u64, 2]);
        assert_eq!(points.id[7], count as u64 - 1, "the last one closes the gap");
        assert_eq!((cells[1], cells[7]), (4, count - 1));
    }

    #[test]
    fn counting_and_comparing_agree() {
        let ids: Vec<u64> = (0..300).map(|k| k * 7919 % 307).collect();
        let cells: Vec<usize> = (0..300).map(|k| 40 + k * k % 83).collect();
        let far: Vec<usize> = cells.iter().map(|cell| cell << 20).collect();
        let order = order_of(&cells, &ids);
        assert!(order.windows(2).all(|p| (cells[p[0]], ids[p[0]]) < (cells[p[1]], ids[p[1]])));
        assert_eq!(order, order_of(&far, &ids));
        assert!(order_of(&[], &[]).is_empty());
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
