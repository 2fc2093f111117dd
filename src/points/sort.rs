//! Points in the order of their cells, so that neighbours in space are neighbours in memory and
//! every sum over points runs in the same order on a repeat.

use super::Points;

/// Points are left as they are while at most one in this many comes before its predecessor: a few
/// strays cost less than moving every point's state.
const STRAYS: usize = 50;

/// Drops the points that are not in `kept` (ascending; `None`: none) and sorts the others by (cell,
/// id), unless nearly all are in that order already. `cells[p]` is the cell of point p. Points
/// that are out of order in more than a few places end in the one order that cell and id give.
pub fn sort_by_cell<const D: usize>(
    points: &mut Points<D>,
    cells: &[usize],
    kept: Option<Vec<usize>>,
) {
    let key = |p: usize| (cells[p], points.id[p]);
    let strays = match &kept {
        Some(kept) => kept.windows(2).filter(|pair| key(pair[0]) > key(pair[1])).count(),
        None => (1..cells.len()).filter(|&p| key(p - 1) > key(p)).count(),
    };
    let count = kept.as_ref().map_or(cells.len(), Vec::len);
    if strays * STRAYS > count {
        let kept = kept.unwrap_or_else(|| (0..count).collect());
        let order = order_of(cells, &points.id, kept);
        points.select(&order);
    } else if let Some(kept) = kept {
        points.select(&kept);
    }
}

/// `kept` in ascending (cell, id): by counting where the cells lie close together, by comparing
/// where they do not.
fn order_of(cells: &[usize], ids: &[u64], mut kept: Vec<usize>) -> Vec<usize> {
    let of_kept = || kept.iter().map(|&p| cells[p]);
    let (Some(low), Some(high)) = (of_kept().min(), of_kept().max()) else { return kept };
    if (high - low) / 16 > kept.len() {
        kept.sort_unstable_by_key(|&p| (cells[p], ids[p]));
        return kept;
    }
    let mut ends = vec![0; high - low + 1];
    of_kept().for_each(|cell| ends[cell - low] += 1);
    let mut before = 0;
    for end in &mut ends {
        before += std::mem::replace(end, before);
    }
    let mut order = vec![0; kept.len()];
    for p in kept {
        let place = &mut ends[cells[p] - low];
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
            sort_by_cell(&mut points, &cells, None);
            assert!(points.id.iter().zip(&points.position).all(|(&id, x)| x[0] == id as f64));
            points.id
        };
        assert_eq!(sorted(&[3, 1, 4, 0, 2, 5]), [4, 5, 2, 3, 0, 1]);
        assert_eq!(sorted(&[0, 1, 2, 3, 4, 5]), sorted(&[5, 4, 3, 2, 1, 0]));
    }

    #[test]
    fn what_is_not_kept_is_dropped_sorted_or_not() {
        for cells in [[1, 2, 3, 4, 5], [5, 4, 3, 2, 1]] {
            let mut points = points(0..5);
            sort_by_cell(&mut points, &cells, Some(vec![0, 2, 3]));
            assert_eq!(points.id, if cells[0] == 1 { [0, 2, 3] } else { [3, 2, 0] });
            assert_eq!(points.mass.len(), 3);
        }
    }

    #[test]
    fn counting_and_comparing_agree() {
        let ids: Vec<u64> = (0..300).map(|k| k * 7919 % 307).collect();
        let cells: Vec<usize> = (0..300).map(|k| 40 + k * k % 83).collect();
        let far: Vec<usize> = cells.iter().map(|cell| cell << 20).collect();
        let all: Vec<usize> = (0..300).collect();
        let order = order_of(&cells, &ids, all.clone());
        assert!(order.windows(2).all(|p| (cells[p[0]], ids[p[0]]) < (cells[p[1]], ids[p[1]])));
        assert_eq!(order, order_of(&far, &ids, all));
        let odd = |order: &[usize]| -> Vec<usize> {
            order.iter().copied().filter(|p| p % 2 == 1).collect()
        };
        assert_eq!(odd(&order), order_of(&cells, &ids, (1..300).step_by(2).collect()));
        assert!(order_of(&[], &[], Vec::new()).is_empty());
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
            sort_by_cell(&mut points, &cells, None);
            assert_eq!(points.id.is_sorted(), kept, "{strays} strays");
        }
    }
}
