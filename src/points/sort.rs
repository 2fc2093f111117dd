//! Points in the order of their cells, so that neighbours in space are neighbours in memory and
//! every sum over points runs in the same order on a repeat.

use super::Points;

/// Sorts points by (cell, id). `cells[p]` is the cell of point p; it is brought into the new
/// order too. The order does not depend on the one before, nor on the rank count.
pub fn sort_by_cell<const D: usize>(points: &mut Points<D>, cells: &mut Vec<usize>) {
    let keys: Vec<(usize, u64)> = cells.iter().copied().zip(points.id.iter().copied()).collect();
    if keys.is_sorted() {
        return;
    }
    let mut order: Vec<usize> = (0..keys.len()).collect();
    order.sort_unstable_by_key(|&p| keys[p]);
    points.select(&order);
    *cells = order.iter().map(|&p| keys[p].0).collect();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_depends_on_cell_and_id_only() {
        let sorted = |order: &[usize]| {
            let mut points = Points::<2>::default();
            let mut cells = Vec::new();
            for &k in order {
                points.push_unstrained(k as u64, 0, [k as f64, 0.0], 1.0, 1.0, [0.5; 2]);
                cells.push(100 - k / 2);
            }
            sort_by_cell(&mut points, &mut cells);
            assert!(points.id.iter().zip(&points.position).all(|(&id, x)| x[0] == id as f64));
            (points.id, cells)
        };
        let (ids, cells) = sorted(&[3, 1, 4, 0, 2, 5]);
        assert_eq!(ids, [4, 5, 2, 3, 0, 1]);
        assert_eq!(cells, [98, 98, 99, 99, 100, 100]);
        assert_eq!(sorted(&[0, 1, 2, 3, 4, 5]), sorted(&[5, 4, 3, 2, 1, 0]));
    }
}
