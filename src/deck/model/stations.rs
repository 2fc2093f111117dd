//! Grid lines along an axis, from their distance at some places.

/// A place, m, and the distance of the lines there, m.
pub type Station = [f64; 2];

/// Lines from the first place to the last, each place on one of them. From place to place the distance
/// grows linearly with the coordinate, h(x) = h_0 + (h_1 - h_0) (x - x_0) / (x_1 - x_0), so that each
/// cell is longer than the one before by the same factor. Origins must ascend, and distances be positive.
pub fn lines(stations: &[Station]) -> Vec<f64> {
    let mut lines: Vec<f64> = stations.first().map(|[place, _]| *place).into_iter().collect();
    for pair in stations.windows(2) {
        let [[from, h], [to, next]] = [pair[0], pair[1]];
        let (length, ratio) = (to - from, next / h);
        let growth = ratio.ln();
        let cells = cells_between(pair[0], pair[1]);
        for k in 1..cells as usize {
            let share = k as f64 / cells;
            let place =
                if growth == 0.0 { share } else { (growth * share).exp_m1() / growth.exp_m1() };
            lines.push(from + length * place);
        }
        lines.push(to);
    }
    lines
}

/// Cells between the first place and the last, without making their lines: a deck may ask for more than
/// memory holds. The largest number where it cannot be counted.
pub fn count_cells(stations: &[Station]) -> usize {
    let cells: f64 = stations.windows(2).map(|pair| cells_between(pair[0], pair[1])).sum();
    if cells.is_nan() { usize::MAX } else { cells as usize }
}

/// ∫ dx / h from one place to the next, rounded, and at least one.
fn cells_between([from, h]: Station, [to, next]: Station) -> f64 {
    let ratio = next / h;
    // ln r / (r - 1), which is 1 for lines of equal distance.
    let mean = if ratio == 1.0 { 1.0 } else { ratio.ln() / (ratio - 1.0) };
    ((to - from) / h * mean).round().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::{count_cells, lines};

    #[test]
    fn equal_distances_are_a_lattice() {
        let made = lines(&[[0.0, 0.25], [1.0, 0.25]]);
        assert_eq!(made, [0.0, 0.25, 0.5, 0.75, 1.0]);
    }

    /// Cells beside each other have one quotient, and those at a place have about its distance.
    #[test]
    fn distances_grow_by_one_factor() {
        let made = lines(&[[0.0, 0.4], [1.0, 0.02], [6.0, 1.0]]);
        let at = made.iter().position(|x| *x == 1.0).expect("a line at 1");
        assert_eq!((at, made.len()), (8, 29));
        assert_eq!(count_cells(&[[0.0, 0.4], [1.0, 0.02], [6.0, 1.0]]), 28);
        assert_eq!(count_cells(&[[0.0, 0.4], [1e300, 0.02]]), usize::MAX);
        let cells: Vec<f64> = made.windows(2).map(|w| w[1] - w[0]).collect();
        for part in [&cells[..at], &cells[at..]] {
            for three in part.windows(3) {
                let off = three[2] / three[1] / (three[1] / three[0]) - 1.0;
                assert!(off.abs() < 1e-11, "{part:?}");
            }
        }
        assert!((cells[at - 1] / 0.02 - 1.0).abs() < 0.3 && (cells[at] / 0.02 - 1.0).abs() < 0.3);
    }
}
