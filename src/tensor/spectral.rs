//! A = sum_a lambda_a n_a x n_a: principal values and axes of symmetric tensors.
//!
//! No iteration: in the plane one Jacobi rotation; in space the best separated principal value
//! comes from the characteristic cubic of the scaled deviator, the other two from the plane
//! normal to its axis (after Scherzinger and Dohrmann, CMAME 197, 2008). Every quantity is a
//! well-conditioned function of the deviator, so values that nearly coincide lose no digits.

use nalgebra::Matrix3;

use super::dense::dot;

/// Principal values and unit axes; `axes[a]` belongs to `values[a]`. Not ordered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spectrum {
    pub values: [f64; 3],
    pub axes: [[f64; 3]; 3],
}

const UNIT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl Spectrum {
    /// Of a symmetric tensor (its upper triangle is read). Plane when zx = zy = 0.
    /// Entries that are not finite give values that are not finite.
    #[inline]
    pub fn of(a: &Matrix3<f64>) -> Self {
        if a[(0, 2)] == 0.0 && a[(1, 2)] == 0.0 {
            Self::plane(a[(0, 0)], a[(1, 1)], a[(0, 1)], a[(2, 2)])
        } else {
            Self::space([a[(0, 0)], a[(1, 1)], a[(2, 2)]], [a[(1, 2)], a[(0, 2)], a[(0, 1)]])
        }
    }

    /// With zx = zy = 0: the last axis is z.
    #[inline]
    pub fn plane(xx: f64, yy: f64, xy: f64, zz: f64) -> Self {
        let (values, c, s) = rotate(xx, yy, xy);
        Spectrum {
            values: [values[0], values[1], zz],
            axes: [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
        }
    }

    /// `normal` = (xx, yy, zz), `shear` = (yz, xz, xy).
    #[inline]
    pub fn space(normal: [f64; 3], shear: [f64; 3]) -> Self {
        let mean = (normal[0] + normal[1] + normal[2]) / 3.0;
        let d = normal.map(|x| x - mean);
        let size = ((dot(&d, &d) + 2.0 * dot(&shear, &shear)) / 6.0).sqrt();
        if size == 0.0 {
            return Spectrum { values: normal, axes: UNIT };
        }
        let scale = 1.0 / size;
        let [x, y, z] = d.map(|e| e * scale);
        let [yz, xz, xy] = shear.map(|e| e * scale);
        let half_det =
            0.5 * (x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz));

        // Root of beta^3 - 3 beta = 2 half_det that is farthest from the other two.
        let beta = 2.0 * (half_det.abs().min(1.0).acos() / 3.0).cos() * half_det.signum();
        let rows = [[x - beta, xy, xz], [xy, y - beta, yz], [xz, yz, z - beta]];
        let first = normal_to(&rows);
        let (second, third) = complement(&first);

        let act = |v: &[f64; 3]| {
            [
                x * v[0] + xy * v[1] + xz * v[2],
                xy * v[0] + y * v[1] + yz * v[2],
                xz * v[0] + yz * v[1] + z * v[2],
            ]
        };
        let (a_first, a_second, a_third) = (act(&first), act(&second), act(&third));
        let (pair, c, s) =
            rotate(dot(&second, &a_second), dot(&third, &a_third), dot(&second, &a_third));
        let combine = |f: f64, g: f64| std::array::from_fn(|i| f * second[i] + g * third[i]);
        Spectrum {
            values: [dot(&first, &a_first), pair[0], pair[1]].map(|value| mean + size * value),
            axes: [first, combine(c, -s), combine(s, c)],
        }
    }

    /// sum_a values_a n_a x n_a with these axes.
    #[inline]
    pub fn compose(&self, values: [f64; 3]) -> Matrix3<f64> {
        let [first, second, third] = &self.axes;
        if *third == UNIT[2] && first[2] == 0.0 && second[2] == 0.0 {
            // In the plane a third of the terms below is left, the same to the last bit.
            let (u, v) = (first.map(|e| values[0] * e), second.map(|e| values[1] * e));
            let xy = u[0] * first[1] + v[0] * second[1];
            let (xx, yy) = (u[0] * first[0] + v[0] * second[0], u[1] * first[1] + v[1] * second[1]);
            return Matrix3::new(xx, xy, 0.0, xy, yy, 0.0, 0.0, 0.0, values[2]);
        }
        let mut sum = [0.0; 6];
        for (value, n) in values.iter().zip(&self.axes) {
            let scaled = n.map(|e| value * e);
            sum[0] += scaled[0] * n[0];
            sum[1] += scaled[1] * n[1];
            sum[2] += scaled[2] * n[2];
            sum[3] += scaled[1] * n[2];
            sum[4] += scaled[0] * n[2];
            sum[5] += scaled[0] * n[1];
        }
        let [xx, yy, zz, yz, xz, xy] = sum;
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}

/// ln A of a symmetric positive tensor.
#[cfg(test)]
pub fn logarithm(a: &Matrix3<f64>) -> Matrix3<f64> {
    let spectrum = Spectrum::of(a);
    spectrum.compose(spectrum.values.map(f64::ln))
}

/// exp A of a symmetric tensor.
#[cfg(test)]
pub fn exponential(a: &Matrix3<f64>) -> Matrix3<f64> {
    let spectrum = Spectrum::of(a);
    spectrum.compose(spectrum.values.map(f64::exp))
}

/// The symmetric positive root of a symmetric positive tensor.
pub fn square_root(a: &Matrix3<f64>) -> Matrix3<f64> {
    let spectrum = Spectrum::of(a);
    spectrum.compose(spectrum.values.map(f64::sqrt))
}

/// ln(1 + x) with all digits also where x is small: what the sum loses of x comes back to first
/// order.
#[inline(always)]
pub fn ln_1p(x: f64) -> f64 {
    let sum = 1.0 + x;
    sum.ln() + (x - (sum - 1.0)) / sum
}

/// (ln(1 + a) - ln(1 + b)) / (a - b) for a, b > -1 with the logarithms known; 1/(1 + a) where a = b.
#[inline]
pub fn logarithm_slope(a: f64, b: f64, ln_a: f64, ln_b: f64) -> f64 {
    let sum = 2.0 + a + b;
    let z = (a - b) / sum;
    if z.abs() < 0.05 {
        // ln(a/b) = 2 artanh z; the first term left out is below 2e-17.
        let q = z * z;
        let series = 1.0
            + q * (1.0 / 3.0
                + q * (1.0 / 5.0 + q * (1.0 / 7.0 + q * (1.0 / 9.0 + q * (1.0 / 11.0)))));
        2.0 * series / sum
    } else {
        (ln_a - ln_b) / (a - b)
    }
}

/// Jacobi rotation of [[p, q], [q, r]]: the values of the axes (c, -s) and (s, c), and c, s.
///
/// With d = (r - p)/2 and R = sqrt(d^2 + q^2): tan = q sign(d) / (|d| + R) and
/// cos^2 = (1 + |d|/R) / 2, whose roots and quotients hardly wait for each other.
#[inline]
fn rotate(p: f64, r: f64, q: f64) -> ([f64; 2], f64, f64) {
    let d = 0.5 * (r - p);
    let root = (d * d + q * q).sqrt();
    // Also where the squares are too small for a number: then so is q beside any p and r.
    if q == 0.0 || root == 0.0 {
        return ([p, r], 1.0, 0.0);
    }
    let t = q.copysign(q * d) / (d.abs() + root);
    let c = (0.5 + 0.5 * (d.abs() / root)).sqrt();
    ([p - t * q, r + t * q], c, t * c)
}

/// Unit vector normal to the rows of a tensor of rank two: the longest of their cross products.
#[inline]
fn normal_to(rows: &[[f64; 3]; 3]) -> [f64; 3] {
    let mut best = cross(&rows[0], &rows[1]);
    let mut square = dot(&best, &best);
    for (i, j) in [(1, 2), (2, 0)] {
        let candidate = cross(&rows[i], &rows[j]);
        let candidate_square = dot(&candidate, &candidate);
        if candidate_square > square {
            (best, square) = (candidate, candidate_square);
        }
    }
    let scale = 1.0 / square.sqrt();
    best.map(|e| e * scale)
}

/// Two unit vectors normal to `n` and to each other.
#[inline]
fn complement(n: &[f64; 3]) -> ([f64; 3], [f64; 3]) {
    let u = if n[0].abs() > n[1].abs() {
        let scale = 1.0 / (n[0] * n[0] + n[2] * n[2]).sqrt();
        [-n[2] * scale, 0.0, n[0] * scale]
    } else {
        let scale = 1.0 / (n[1] * n[1] + n[2] * n[2]).sqrt();
        [0.0, n[2] * scale, -n[1] * scale]
    };
    (u, cross(n, &u))
}

#[inline]
fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn matrix(axes: &[[f64; 3]; 3]) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| axes[j][i])
    }

    /// A rotation from any three numbers (Cayley).
    fn rotation(w: [f64; 3]) -> Matrix3<f64> {
        let s = Matrix3::new(0.0, -w[2], w[1], w[2], 0.0, -w[0], -w[1], w[0], 0.0);
        (Matrix3::identity() - s).try_inverse().expect("1 - skew is regular")
            * (Matrix3::identity() + s)
    }

    fn check(a: &Matrix3<f64>, expected: [f64; 3]) {
        let spectrum = Spectrum::of(a);
        let n = matrix(&spectrum.axes);
        let size = a.norm();
        assert!((n.transpose() * n - Matrix3::identity()).norm() < 3e-15);
        assert!((spectrum.compose(spectrum.values) - a).norm() < 4e-15 * size);
        let mut values = spectrum.values;
        values.sort_by(f64::total_cmp);
        let mut sorted = expected;
        sorted.sort_by(f64::total_cmp);
        for (value, exact) in values.iter().zip(&sorted) {
            assert!((value - exact).abs() < 4e-15 * size, "{value} {exact}");
        }
    }

    #[test]
    fn equal_and_nearly_equal_values() {
        let q = rotation([0.3, -0.8, 0.5]);
        for gap in [0.0, 1e-17, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0] {
            for values in [
                [1.0, 1.0 + gap, 1.0 - gap],
                [1.0, 1.0, 1.0 + gap],
                [2.0, 1.0 + gap, 1.0],
                [0.1, 1.0 + gap, 1.0],
                [1.0 + gap, 1.0 + 2.0 * gap, 1e-6],
            ] {
                let a = q * Matrix3::from_diagonal(&values.into()) * q.transpose();
                check(&((a + a.transpose()) * 0.5), values);
                check(&Matrix3::from_diagonal(&values.into()), values);
            }
        }
    }

    #[test]
    fn small_deviators_keep_their_digits() {
        // 1 + e with e of 1e-9: the axes are those of e, to what the rounding of 1 + e leaves.
        let q = rotation([0.2, 0.4, -0.6]);
        let e = q * Matrix3::from_diagonal(&[1e-9, 2e-9, -5e-9].into()) * q.transpose();
        let spectrum = Spectrum::of(&(Matrix3::identity() + (e + e.transpose()) * 0.5));
        let n = matrix(&spectrum.axes);
        let diagonal = n.transpose() * e * n;
        for i in 0..3 {
            for j in 0..i {
                assert!(diagonal[(i, j)].abs() < 1e-15);
            }
        }
    }

    #[test]
    fn spectral_functions_invert_each_other() {
        let q = rotation([0.7, 0.1, -0.3]);
        let a = q * Matrix3::from_diagonal(&[0.2, 1.3, 4.0].into()) * q.transpose();
        let a = (a + a.transpose()) * 0.5;
        assert!((exponential(&logarithm(&a)) - a).norm() < 1e-14);
        let root = square_root(&a);
        assert!((root * root - a).norm() < 1e-14);
        let plane = Matrix3::new(2.0, 0.3, 0.0, 0.3, 1.0, 0.0, 0.0, 0.0, 1.5);
        assert!((exponential(&logarithm(&plane)) - plane).norm() < 1e-14);
        assert_eq!(logarithm(&plane)[(2, 2)], 1.5f64.ln());
    }

    #[test]
    fn slope_of_the_logarithm_is_smooth() {
        let slope = |a: f64, b: f64| logarithm_slope(a - 1.0, b - 1.0, a.ln(), b.ln());
        assert_eq!(slope(2.5, 2.5), 1.0 / 2.5);
        for x in [1e-15_f64, 1e-10, 1e-4, 0.01, 0.09, 0.104, 0.106, 0.2, 3.0, -0.09, -0.11, -0.5] {
            let a = 1.7 * (1.0 + x);
            let step: f64 = (a - 1.7) / 1.7;
            let exact = step.ln_1p() / (1.7 * step);
            assert!((slope(a, 1.7) / exact - 1.0).abs() < 4e-15, "{x}");
            assert!((slope(1.7, a) / exact - 1.0).abs() < 4e-15, "{x}");
        }
    }

    #[test]
    fn not_a_number_goes_through() {
        let mut a = Matrix3::identity();
        a[(0, 1)] = f64::NAN;
        assert!(Spectrum::of(&a).values.iter().any(|v| v.is_nan()));
        a[(0, 2)] = 0.1;
        assert!(Spectrum::of(&a).values.iter().any(|v| v.is_nan()));
    }

    proptest! {
        #[test]
        fn any_tensor(values in prop::array::uniform3(-3.0..3.0f64),
                      w in prop::array::uniform3(-2.0..2.0f64)) {
            let q = rotation(w);
            let a = q * Matrix3::from_diagonal(&values.into()) * q.transpose();
            check(&((a + a.transpose()) * 0.5), values);
        }

        #[test]
        fn any_plane_tensor(p in -3.0..3.0f64, r in -3.0..3.0f64, q in -2.0..2.0f64) {
            let spectrum = Spectrum::plane(p, r, q, 0.7);
            let a = Matrix3::new(p, q, 0.0, q, r, 0.0, 0.0, 0.0, 0.7);
            prop_assert!((spectrum.compose(spectrum.values) - a).norm() < 4e-15 * a.norm());
            prop_assert_eq!(spectrum.values[2], 0.7);
        }
    }
}
