//! Estimates from the errors of a step's iterates: whether the next iterate will be converged, and
//! whether the errors still fall.

/// Whether the next error is likely below the tolerance: by Newton's method with solves that are
/// not exact, between a fall by the last factor once more and by its square, or by the square of
/// the error itself. Errors above one are those of a step's start, where nothing pushes yet.
/// (docs/evidence/performance.md has how often that is right.)
pub(crate) fn converges_next(errors: &[f64], tolerance: f64) -> bool {
    let [.., before, last] = errors[..] else { return false };
    let factor = (last / before.min(1.0)).min(1.0);
    last * factor.powf(1.5) <= tolerance || 10.0 * last * last <= tolerance
}

/// The last error is not below a tenth of the least before it: Newton's method, where it works,
/// falls faster near its end.
pub(crate) fn hardly_falls(errors: &[f64]) -> bool {
    let Some((last, before)) = errors.split_last() else { return false };
    let least = before.iter().fold(f64::INFINITY, |a, &b| a.min(b));
    !before.is_empty() && *last > 0.1 * least
}

/// The least of the last errors is hardly below the least before them. Iterates that go to and fro between parts of a
/// piecewise smooth problem (contact that closes and opens, slip to either side) do so for ever with full steps.
pub(crate) fn stalls(errors: &[f64]) -> bool {
    let Some(earlier) = errors.len().checked_sub(STALLED) else { return false };
    let least = |errors: &[f64]| errors.iter().fold(f64::INFINITY, |a, &b| a.min(b));
    earlier >= BEFORE && least(&errors[earlier..]) > 0.9 * least(&errors[..earlier])
}

/// Errors that have to stay.
const STALLED: usize = 9;
/// Errors before them.
const BEFORE: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_error_is_foreseen() {
        // Nothing is known after the first, and little after the second.
        assert!(!converges_next(&[1e-3], 1e-6));
        assert!(!converges_next(&[1e21, 1.1e-2], 1e-8));
        assert!(!converges_next(&[0.9, 1.1e-2], 1e-8));
        // The doughnut's falls: 1e21, 1e-2, 3e-5, 2e-10.
        assert!(converges_next(&[1e21, 1.1e-2, 2.6e-5], 1e-8));
        // Plastic steps fall by a factor.
        assert!(!converges_next(&[1.0, 1e-1, 1e-2, 1e-3], 1e-6));
        assert!(converges_next(&[1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5], 1e-6));
        // A linear problem's second error is its last.
        assert!(converges_next(&[1.0, 1e-12], 1e-9));
    }

    #[test]
    fn errors_that_hardly_fall() {
        assert!(hardly_falls(&[1.0, 1e-3, 2e-9, 3e-9]));
        assert!(hardly_falls(&[0.0, 0.8]));
        // Still on the way.
        assert!(!hardly_falls(&[1.0, 1e-3, 1e-7, 2e-14]));
        // Too few, or not numbers.
        assert!(!hardly_falls(&[1e-9]));
        assert!(!hardly_falls(&[1e-9, 1e-9, f64::NAN]));
    }

    #[test]
    fn errors_that_stall() {
        // Iterates that go round in five, and in two with a drift.
        let mut errors = vec![1.9, 0.47, 0.5];
        for k in 0..9 {
            errors.push([0.51, 0.61, 0.508, 0.521, 0.637][k % 5]);
        }
        assert!(stalls(&errors));
        assert!(!stalls(&errors[..errors.len() - 1]));
        let drifts = (0..12).map(|k| 0.0394 + 0.0066 * f64::from(k % 2) - 1e-5 * f64::from(k));
        assert!(stalls(&drifts.collect::<Vec<_>>()));
        // A slow fall, and a late one.
        let slow: Vec<f64> = (0..40).map(|k| 0.98f64.powi(k)).collect();
        assert!(!stalls(&slow));
        assert!(!stalls(&[1.0, 0.5, 0.4, 0.6, 0.7, 0.5, 0.6, 0.5, 0.6, 0.5, 1e-2, 1e-4]));
    }
}
