//! The elastic doughnut as a problem of one variable: r(R) and theta(R) between R = 5 and 10 that
//! make the Hencky energy smallest, independent of the program's mechanics.
//!
//! With F = [[r', 0], [r theta', r/R]] and nu = 0 the energy is E/2 (ln^2 l1 + ln^2 l2), where
//! l1, l2 = sqrt(J) exp(-/+ h), h = acosh(I / 2J) / 2, I = F : F.

use mpm_par::deck::Scope;
use mpm_par::deck::expression::Expression;

const INNER: f64 = 5.0;
const OUTER: f64 = 10.0;
/// Energy over E in X = r', Y = r theta', Z = r / R.
const ENERGY: &str = "0.25*ln(X*Z)^2 + 0.25*acosh((X^2 + Y^2 + Z^2)/(2*X*Z))^2";

type Block = [[f64; 2]; 2];

/// Gradient and Hessian in (r1, t1, r2, t2) of one linear element, midpoint rule.
fn element(
    energy: &mpm_par::deck::expression::Smooth,
    inner: f64,
    length: f64,
    u: [f64; 4],
) -> ([f64; 4], [[f64; 4]; 4]) {
    let middle = inner + 0.5 * length;
    let (r, twist) = (0.5 * (u[0] + u[2]), (u[3] - u[1]) / length);
    let place = [(u[2] - u[0]) / length, r * twist, r / middle];
    let jet = energy.jet(&Scope { initial: place, ..Scope::default() });
    // d place / d u
    let d = 1.0 / length;
    let slopes = [
        [-d, 0.0, d, 0.0],
        [0.5 * twist, -r * d, 0.5 * twist, r * d],
        [0.5 / middle, 0.0, 0.5 / middle, 0.0],
    ];
    let weight = middle * length;
    let mut gradient = [0.0; 4];
    let mut hessian = [[0.0; 4]; 4];
    for a in 0..4 {
        for i in 0..3 {
            gradient[a] += weight * jet.first[i] * slopes[i][a];
            for b in 0..4 {
                for j in 0..3 {
                    hessian[a][b] += weight * jet.second_along(i, j) * slopes[i][a] * slopes[j][b];
                }
            }
        }
    }
    // r theta' is bilinear: d2/(dr dt) = 0.5 d sign.
    for (a, b, sign) in [(0, 1, -1.0), (0, 3, 1.0), (2, 1, -1.0), (2, 3, 1.0)] {
        let mixed = weight * jet.first[1] * 0.5 * d * sign;
        hessian[a][b] += mixed;
        hessian[b][a] += mixed;
    }
    (gradient, hessian)
}

fn times(a: &Block, x: [f64; 2]) -> [f64; 2] {
    [a[0][0] * x[0] + a[0][1] * x[1], a[1][0] * x[0] + a[1][1] * x[1]]
}

fn inverse(a: &Block) -> Block {
    let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    [[a[1][1] / det, -a[0][1] / det], [-a[1][0] / det, a[0][0] / det]]
}

fn product(a: &Block, b: &Block) -> Block {
    let columns = [0, 1].map(|j| times(a, [b[0][j], b[1][j]]));
    [[columns[0][0], columns[1][0]], [columns[0][1], columns[1][1]]]
}

/// r and theta at the nodes of `count` elements for a clockwise twist of the inner circle.
fn solve(degrees: f64, count: usize) -> Vec<[f64; 2]> {
    let energy = Expression::parse(ENERGY).unwrap().smooth().unwrap();
    let length = (OUTER - INNER) / count as f64;
    let total = -degrees.to_radians();
    let mut state: Vec<[f64; 2]> = (0..=count)
        .map(|k| [INNER + k as f64 * length, total * (1.0 - k as f64 / count as f64)])
        .collect();
    for iteration in 0.. {
        assert!(iteration < 30, "the reference does not converge");
        let mut residual = vec![[0.0; 2]; count + 1];
        let (mut diagonal, mut upper) =
            (vec![[[0.0; 2]; 2]; count + 1], vec![[[0.0; 2]; 2]; count]);
        for k in 0..count {
            let [a, b] = [state[k], state[k + 1]];
            let start = INNER + k as f64 * length;
            let (g, h) = element(&energy, start, length, [a[0], a[1], b[0], b[1]]);
            for i in 0..2 {
                residual[k][i] += g[i];
                residual[k + 1][i] += g[i + 2];
                for j in 0..2 {
                    diagonal[k][i][j] += h[i][j];
                    diagonal[k + 1][i][j] += h[i + 2][j + 2];
                    upper[k][i][j] = h[i][j + 2];
                }
            }
        }
        // Block elimination on the free nodes 1..count.
        for k in 1..count - 1 {
            let lower = [0, 1].map(|i| [0, 1].map(|j| upper[k][j][i]));
            let factor = product(&lower, &inverse(&diagonal[k]));
            let (less, moved) = (product(&factor, &upper[k]), times(&factor, residual[k]));
            for i in 0..2 {
                residual[k + 1][i] -= moved[i];
                for j in 0..2 {
                    diagonal[k + 1][i][j] -= less[i][j];
                }
            }
        }
        let mut step = vec![[0.0; 2]; count + 1];
        let mut largest = 0.0f64;
        for k in (1..count).rev() {
            let known = if k + 1 < count { times(&upper[k], step[k + 1]) } else { [0.0; 2] };
            let rhs = [0, 1].map(|i| -residual[k][i] - known[i]);
            step[k] = times(&inverse(&diagonal[k]), rhs);
            largest = largest.max(step[k][0].abs()).max(step[k][1].abs());
        }
        for (u, s) in state.iter_mut().zip(&step) {
            u[0] += s[0];
            u[1] += s[1];
        }
        if largest < 1e-11 {
            break;
        }
    }
    state
}

/// Displacement at (R, 0) for R = 5, 5.5, ..., 10, extrapolated from `count` (a multiple of ten)
/// and twice as many elements.
pub fn displacement(degrees: f64, count: usize) -> Vec<[f64; 2]> {
    let (coarse, fine) = (solve(degrees, count), solve(degrees, 2 * count));
    (0..=10)
        .map(|k| {
            let (a, b) = (coarse[k * count / 10], fine[k * count / 5]);
            let [r, theta] = [0, 1].map(|i| b[i] + (b[i] - a[i]) / 3.0);
            [r * theta.cos() - (INNER + 0.5 * k as f64), r * theta.sin()]
        })
        .collect()
}

#[test]
fn the_reference_is_converged() {
    let (coarse, fine) = (displacement(10.0, 100), displacement(10.0, 200));
    for (a, b) in coarse.iter().zip(&fine) {
        assert!((a[0] - b[0]).abs() < 1e-7 && (a[1] - b[1]).abs() < 1e-7, "{a:?} {b:?}");
    }
}
