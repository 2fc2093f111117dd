//! Products, determinants and inverses of `D` x `D` arrays, D = 2 or 3.

#![allow(clippy::needless_range_loop, reason = "tensor formulas read by their indices")]

use nalgebra::Matrix3;

/// A second-order tensor in `D` dimensions, `t[row][column]`.
pub type Square<const D: usize> = [[f64; D]; D];

#[inline]
pub fn identity<const D: usize>() -> Square<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }))
}

/// 1 + a
#[inline]
pub fn plus_unit<const D: usize>(a: &Square<D>) -> Square<D> {
    let mut sum = *a;
    for (i, row) in sum.iter_mut().enumerate() {
        row[i] += 1.0;
    }
    sum
}

/// a b
#[inline]
pub fn multiply<const D: usize>(a: &Square<D>, b: &Square<D>) -> Square<D> {
    let mut product = [[0.0; D]; D];
    for i in 0..D {
        for k in 0..D {
            for j in 0..D {
                product[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    product
}

/// a b^T
#[inline]
pub fn multiply_transposed<const D: usize>(a: &Square<D>, b: &Square<D>) -> Square<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| dot(&a[i], &b[j])))
}

/// a v
#[inline]
pub fn apply<const D: usize>(a: &Square<D>, v: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|i| dot(&a[i], v))
}

#[inline]
pub fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut sum = 0.0;
    for i in 0..D {
        sum += a[i] * b[i];
    }
    sum
}

#[inline]
pub fn transpose<const D: usize>(a: &Square<D>) -> Square<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

#[inline]
pub fn determinant<const D: usize>(a: &Square<D>) -> f64 {
    match D {
        2 => a[0][0] * a[1][1] - a[0][1] * a[1][0],
        3 => {
            a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1])
                - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0])
                + a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0])
        }
        _ => unreachable!("tensors have two or three dimensions"),
    }
}

/// det(1 + a) - 1, which keeps the digits of small `a`.
#[inline]
pub fn determinant_excess<const D: usize>(a: &Square<D>) -> f64 {
    let minor = |i: usize, j: usize| a[i][i] * a[j][j] - a[i][j] * a[j][i];
    match D {
        2 => a[0][0] + a[1][1] + minor(0, 1),
        _ => {
            let minors = minor(0, 1) + minor(1, 2) + minor(0, 2);
            a[0][0] + a[1][1] + a[2][2] + (minors + determinant(a))
        }
    }
}

/// Inverse and determinant; a singular tensor gives entries that are not finite.
#[inline]
pub fn inverse<const D: usize>(a: &Square<D>) -> (Square<D>, f64) {
    let det = determinant(a);
    let scale = 1.0 / det;
    let mut inverse = [[0.0; D]; D];
    if D == 2 {
        inverse[0][0] = a[1][1] * scale;
        inverse[0][1] = -a[0][1] * scale;
        inverse[1][0] = -a[1][0] * scale;
        inverse[1][1] = a[0][0] * scale;
    } else {
        for i in 0..D {
            let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
            for j in 0..D {
                let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
                inverse[j][i] = (a[i1][j1] * a[i2][j2] - a[i1][j2] * a[i2][j1]) * scale;
            }
        }
    }
    (inverse, det)
}

/// The first `D` rows and columns.
#[inline]
pub fn block<const D: usize>(a: &Matrix3<f64>) -> Square<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[(i, j)]))
}

/// Three-dimensional tensor with `zz` in the last place when D = 2.
#[inline]
pub fn embed<const D: usize>(a: &Square<D>, zz: f64) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| {
        if i < D && j < D {
            a[i][j]
        } else if i == j {
            zz
        } else {
            0.0
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Square<3> = [[2.0, -1.0, 0.5], [0.3, 1.5, -0.7], [-0.2, 0.4, 3.0]];
    const B: Square<3> = [[0.1, 1.0, -0.4], [2.0, 0.3, 0.6], [-1.0, 0.8, 0.2]];

    #[test]
    fn agrees_with_nalgebra_in_3d() {
        let (a, b) = (embed(&A, 0.0), embed(&B, 0.0));
        assert!((embed(&multiply(&A, &B), 0.0) - a * b).norm() < 1e-15);
        assert!((embed(&multiply_transposed(&A, &B), 0.0) - a * b.transpose()).norm() < 1e-15);
        assert!((embed(&transpose(&A), 0.0) - a.transpose()).norm() == 0.0);
        let (inverse, det) = inverse(&A);
        assert!((det - a.determinant()).abs() < 1e-14);
        assert!((embed(&inverse, 0.0) * a - Matrix3::identity()).norm() < 1e-15);
        let v = apply(&A, &[1.0, 2.0, 3.0]);
        assert!((v[0] - 1.5).abs() < 1e-15 && (v[2] - 9.6).abs() < 1e-14);
    }

    #[test]
    fn excess_is_the_determinant_less_one() {
        for scale in [1.0, 0.1] {
            let space = A.map(|row| row.map(|v| scale * v));
            let whole = determinant(&plus_unit(&space)) - 1.0;
            assert!((determinant_excess(&space) - whole).abs() < 1e-13);
            let plane = [[space[0][0], space[0][1]], [space[1][0], space[1][1]]];
            let whole = determinant(&plus_unit(&plane)) - 1.0;
            assert!((determinant_excess(&plane) - whole).abs() < 1e-14);
        }
        // 3e-20 would be lost beside one.
        let small = determinant_excess(&[[1e-20, 0.0], [0.0, 2e-20]]);
        assert!((small / 3e-20 - 1.0).abs() < 1e-15);
    }

    #[test]
    fn plane_is_a_block_of_space() {
        let a = [[1.2, 0.4], [-0.3, 0.9]];
        let whole = embed(&a, 1.0);
        assert_eq!(block::<2>(&whole), a);
        let (inverse, det) = inverse(&a);
        assert!((det - 1.2).abs() < 1e-15);
        assert!((whole.determinant() - det).abs() < 1e-15);
        assert!((embed(&inverse, 1.0) * whole - Matrix3::identity()).norm() < 1e-15);
    }

    #[test]
    fn singular_tensors_do_not_look_finite() {
        let (inverse2, _) = inverse(&[[1.0, 2.0], [2.0, 4.0]]);
        assert!(!inverse2[0][0].is_finite());
        let (inverse3, _) = inverse(&[[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
        assert!(!inverse3[1][1].is_finite());
    }
}
