//! The plane between two clouds of points that keeps the largest distance from both: its normal joins
//! the points of their convex hulls that are nearest to each other, by Wolfe's algorithm (1976,
//! Mathematical Programming 11:128-149) for the shortest vector b - a.
//!
//! It is the limit of the logistic regression of Nairn, Hammerquist, Smith (2020, CMAME 362:112859) for
//! a steep function. Points far from the other cloud do not count, so that the sides of a block do not
//! tilt the plane on which it lies, as gradients of masses do: a regression of finite steepness leaves a
//! tilt of 0.1 to 0.2 at its corner.

use super::surface::length;
use crate::tensor::dense::dot;

/// Distance of the hulls, of a cell, up to which nothing separates the clouds.
const TOUCHING: f64 = 1e-9;
/// Gain in the square of the distance, of itself, at which the search ends.
const DONE: f64 = 1e-12;
const ROUNDS: usize = 100;

/// Normal of the plane from the `first` cloud to the `second`; `size`: of a cell, m. `None` where nothing
/// separates them: one is empty, or their hulls meet.
pub fn separate<const D: usize>(
    first: &[[f64; D]],
    second: &[[f64; D]],
    size: f64,
) -> Option<[f64; D]> {
    let (start, end) = (first.first()?, second.first()?);
    let way =
        |a: &[f64; D], b: &[f64; D]| -> [f64; D] { std::array::from_fn(|i| (b[i] - a[i]) / size) };
    // Vertices of the hull of all b - a, and what each counts in the shortest vector.
    let mut corral = vec![way(start, end)];
    let mut shares = vec![1.0];
    let mut shortest = corral[0];
    for _ in 0..ROUNDS {
        let square = dot(&shortest, &shortest);
        if square < TOUCHING * TOUCHING {
            return None;
        }
        let a = extreme(first, &shortest, 1.0)?;
        let b = extreme(second, &shortest, -1.0)?;
        let further = way(a, b);
        if dot(&further, &shortest) >= square * (1.0 - DONE) || corral.contains(&further) {
            break;
        }
        corral.push(further);
        shares.push(0.0);
        while let Some(flat) = on_flat(&corral) {
            // As far towards the shortest vector of the flat as the shares stay positive.
            let steps = shares.iter().zip(&flat).filter(|(_, to)| **to <= DONE);
            let part = steps.map(|(from, to)| from / (from - to)).fold(1.0, f64::min);
            for (share, to) in shares.iter_mut().zip(&flat) {
                *share += part * (to - *share);
            }
            let inside = flat.iter().all(|to| *to > DONE);
            if !inside {
                let least = shares.iter().copied().fold(f64::INFINITY, f64::min).max(DONE);
                let kept: Vec<bool> = shares.iter().map(|share| *share > least).collect();
                let mut keep = kept.iter();
                corral.retain(|_| *keep.next().unwrap_or(&true));
                let mut keep = kept.iter();
                shares.retain(|_| *keep.next().unwrap_or(&true));
            }
            shortest = std::array::from_fn(|i| {
                corral.iter().zip(&shares).map(|(way, share)| share * way[i]).sum()
            });
            if inside || corral.len() < 2 {
                break;
            }
        }
        if corral.is_empty() || dot(&shortest, &shortest) >= square {
            break;
        }
    }
    let size = length(&shortest);
    (size > TOUCHING).then(|| shortest.map(|v| v / size))
}

/// The point furthest along `sign` times a direction.
fn extreme<'a, const D: usize>(
    cloud: &'a [[f64; D]],
    way: &[f64; D],
    sign: f64,
) -> Option<&'a [f64; D]> {
    cloud.iter().max_by(|x, y| (sign * dot(x, way)).total_cmp(&(sign * dot(y, way))))
}

/// Shares, of sum one, of the vectors in the shortest vector of the flat through them: those of
/// (1 1^T + G) μ = 1 with G their products. `None` where they do not span a flat.
fn on_flat<const D: usize>(vectors: &[[f64; D]]) -> Option<Vec<f64>> {
    let count = vectors.len();
    if count > D + 1 {
        return None;
    }
    let (mut a, mut x) = ([[0.0; 4]; 4], [1.0; 4]);
    for i in 0..count {
        for j in 0..count {
            a[i][j] = 1.0 + dot(&vectors[i], &vectors[j]);
        }
    }
    for i in 0..count {
        let pivot = a[i];
        if pivot[i] <= 1e-14 {
            return None;
        }
        for k in i + 1..count {
            let factor = a[k][i] / pivot[i];
            (i..count).for_each(|j| a[k][j] -= factor * pivot[j]);
            x[k] -= factor * x[i];
        }
    }
    for i in (0..count).rev() {
        let known: f64 = (i + 1..count).map(|j| a[i][j] * x[j]).sum();
        x[i] = (x[i] - known) / a[i][i];
    }
    let sum: f64 = x[..count].iter().sum();
    Some(x[..count].iter().map(|x| x / sum).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(xs: std::ops::RangeInclusive<i32>, ys: std::ops::RangeInclusive<i32>) -> Vec<[f64; 2]> {
        xs.flat_map(|i| {
            ys.clone().map(move |j| [0.25 + 0.5 * f64::from(i), 0.25 + 0.5 * f64::from(j)])
        })
        .collect()
    }

    /// A block whose side lies in the middle of what is seen: its corner does not tilt the plane.
    #[test]
    fn the_corner_of_a_block_does_not_tilt_its_base() {
        let (ground, block) = (rows(-4..=3, -4..=-1), rows(-4..=-1, 0..=3));
        for above in [block, vec![[-1.75, 0.25]]] {
            let n = separate(&ground, &above, 1.0).expect("a plane");
            assert!(n[0].abs() < 1e-12 && n[1] > 0.999, "{n:?}");
        }
    }

    /// A turned and scaled pair of clouds gives the turned normal, in space as well.
    #[test]
    fn the_plane_turns_with_the_clouds() {
        let (sin, cos) = 0.7f64.sin_cos();
        let turn =
            |x: &[f64; 2]| [1e3 * (cos * x[0] - sin * x[1]), 1e3 * (sin * x[0] + cos * x[1])];
        // Vertex against edge: the nearest points of the hulls are [0.25, 0.25] and the middle of
        // [0, 1] and [1, 0].
        let (low, high) = (rows(-3..=0, -3..=0), vec![[0.0, 1.0], [1.0, 0.0], [2.0, 2.0]]);
        let n = separate(&low, &high, 1.0).expect("a plane");
        let half = 0.5f64.sqrt();
        assert!((n[0] - half).abs() < 1e-12 && (n[1] - half).abs() < 1e-12, "{n:?}");
        let all = |cloud: &[[f64; 2]]| cloud.iter().map(turn).collect::<Vec<_>>();
        let turned = separate(&all(&low), &all(&high), 1e3).expect("a plane");
        let expected = turn(&n).map(|v| v / 1e3);
        assert!((0..2).all(|a| (turned[a] - expected[a]).abs() < 1e-12), "{turned:?} {expected:?}");
        let lift = |cloud: &[[f64; 2]]| -> Vec<[f64; 3]> {
            cloud.iter().flat_map(|x| [-0.5, 0.0, 0.5].map(|z| [z, x[0], x[1]])).collect()
        };
        let n = separate(&lift(&low), &lift(&high), 1.0).expect("a plane");
        assert!(n[0].abs() < 1e-12 && (n[1] - half).abs() < 1e-12, "{n:?}");
    }

    /// The optimum against every pair of points and every direction of a fine fan.
    #[test]
    fn no_other_direction_keeps_the_clouds_further_apart() {
        let mut seed = 7u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 40) as f64 / (1u64 << 24) as f64
        };
        for _ in 0..20 {
            let mut cloud = |shift: f64| -> Vec<[f64; 2]> {
                (0..20).map(|_| [random(), random() + shift]).collect()
            };
            let (low, high) = (cloud(0.0), cloud(1.05));
            let apart = |n: &[f64; 2]| {
                let least = high.iter().map(|x| dot(x, n)).fold(f64::INFINITY, f64::min);
                least - low.iter().map(|x| dot(x, n)).fold(f64::NEG_INFINITY, f64::max)
            };
            let found = apart(&separate(&low, &high, 1.0).expect("a plane"));
            let fan = (0..2000).map(|k| {
                let angle = f64::from(k) * std::f64::consts::TAU / 2000.0;
                apart(&[angle.cos(), angle.sin()])
            });
            let best = fan.fold(f64::NEG_INFINITY, f64::max);
            assert!(found >= best - 1e-9 && found - best < 2e-3, "{found} {best}");
        }
    }

    #[test]
    fn nothing_separates_what_meets() {
        assert!(separate(&[[1.0, 2.0]], &[[1.0, 2.0]], 1.0).is_none());
        assert!(separate(&[], &[[1.0, 2.0]], 1.0).is_none());
        assert!(separate(&rows(0..=3, 0..=3), &rows(1..=2, 1..=2), 1.0).is_none());
        assert!(separate(&rows(0..=3, 0..=3), &[[0.6, 0.7]], 1.0).is_none());
    }
}
