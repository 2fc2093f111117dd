//! The tangents once more, coded plainly from Lagrangian (A.1)-(A.6) in Cartesian components:
//! no principal axes, the logarithm and its derivative from their integrals
//! ln b = int_0^1 (b - 1) r dt and d ln b = int_0^1 r db r dt with r = (1 + t (b - 1))^-1.

#![allow(clippy::needless_range_loop, reason = "tensor formulas read by their indices")]

use nalgebra::Matrix3;

use super::tests::{Case, elastic, plastic};
use crate::deck::model::Frame;
use crate::material::{Hencky, Material};
use crate::tensor::dense;

type Fourth = [[[[f64; 3]; 3]; 3]; 3];

/// Gauss points and weights on [0, 1], five in each of 40 equal parts.
fn quadrature() -> Vec<(f64, f64)> {
    const PARTS: usize = 40;
    let (a, b) = (10.0f64 / 7.0, 70.0f64.sqrt());
    let inner = (5.0 - 2.0 * a.sqrt()).sqrt() / 3.0;
    let outer = (5.0 + 2.0 * a.sqrt()).sqrt() / 3.0;
    let (wi, wo) = ((322.0 + 13.0 * b) / 900.0, (322.0 - 13.0 * b) / 900.0);
    let rule = [(-outer, wo), (-inner, wi), (0.0, 128.0 / 225.0), (inner, wi), (outer, wo)];
    let mut points = Vec::new();
    for part in 0..PARTS {
        for (x, w) in rule {
            let t = (part as f64 + 0.5 + 0.5 * x) / PARTS as f64;
            points.push((t, 0.5 * w / PARTS as f64));
        }
    }
    points
}

fn resolvent(b: &Matrix3<f64>, t: f64) -> Matrix3<f64> {
    let one = Matrix3::identity();
    (one + (b - one) * t).try_inverse().expect("b is positive")
}

fn logarithm(b: &Matrix3<f64>) -> Matrix3<f64> {
    let one = Matrix3::identity();
    quadrature().iter().map(|&(t, w)| (b - one) * resolvent(b, t) * w).sum()
}

/// L_mnpq (A.2), symmetric in p and q.
fn logarithm_derivative(b: &Matrix3<f64>) -> Fourth {
    let mut derivative = Fourth::default();
    for (t, w) in quadrature() {
        let r = resolvent(b, t);
        fill(&mut derivative, |m, n, p, q| {
            0.5 * w * (r[(m, p)] * r[(q, n)] + r[(m, q)] * r[(p, n)])
        });
    }
    derivative
}

fn fill(tensor: &mut Fourth, entry: impl Fn(usize, usize, usize, usize) -> f64) {
    for i in 0..3 {
        for j in 0..3 {
            for k in 0..3 {
                for l in 0..3 {
                    tensor[i][j][k][l] += entry(i, j, k, l);
                }
            }
        }
    }
}

/// x_ijmn y_mnkl
fn contract(x: &Fourth, y: &Fourth) -> Fourth {
    let mut product = Fourth::default();
    fill(&mut product, |i, j, k, l| {
        (0..9).map(|mn| x[i][j][mn / 3][mn % 3] * y[mn / 3][mn % 3][k][l]).sum()
    });
    product
}

fn delta(i: usize, j: usize) -> f64 {
    f64::from(u8::from(i == j))
}

/// The elastic part of the models tested here.
fn elasticity(material: &Material) -> &Hencky {
    match material {
        Material::Hencky(model) => model,
        Material::VonMises(model) => &model.elasticity,
        other => panic!("{other:?} has no tensor form here"),
    }
}

/// Kirchhoff stress and D^alg_ijmn for a trial strain, radial return in tensor form.
fn small_strain(material: &Material, strain: &Matrix3<f64>) -> (Matrix3<f64>, Fourth) {
    let elasticity = elasticity(material);
    let (bulk, two_mu) = (elasticity.lambda + 2.0 / 3.0 * elasticity.mu, 2.0 * elasticity.mu);
    let one = Matrix3::identity();
    let deviator = strain - one * (strain.trace() / 3.0);
    let norm = deviator.norm();
    let (theta, flow) = match material {
        Material::VonMises(model) if two_mu * norm > model.radius => {
            (model.radius / (two_mu * norm), deviator / norm)
        }
        _ => (1.0, Matrix3::zeros()),
    };
    let mut tangent = Fourth::default();
    fill(&mut tangent, |i, j, m, n| {
        let identity = 0.5 * (delta(i, m) * delta(j, n) + delta(i, n) * delta(j, m));
        bulk * delta(i, j) * delta(m, n)
            + two_mu
                * theta
                * (identity - delta(i, j) * delta(m, n) / 3.0 - flow[(i, j)] * flow[(m, n)])
    });
    (one * (bulk * strain.trace()) + deviator * (two_mu * theta), tangent)
}

fn check<const D: usize>(case: &Case<D>) {
    let increment = dense::embed(&case.increment, 1.0);
    let inverse = increment.try_inverse().expect("the increment is regular");
    let start_det = case.gradient.determinant();
    let det = increment.determinant() * start_det;
    let trial = increment * case.elastic() * increment.transpose();
    let (tau, moduli) = small_strain(&case.material, &(logarithm(&trial) * 0.5));
    let half = contract(&moduli, &logarithm_derivative(&trial));

    // (A.1), (A.2)
    let mut change = Fourth::default();
    fill(&mut change, |p, q, k, l| delta(p, k) * trial[(q, l)] + delta(q, k) * trial[(p, l)]);
    let mut updated = contract(&half, &change);
    for value in updated.iter_mut().flatten().flatten().flatten() {
        *value *= 0.5 / det;
    }
    fill(&mut updated, |i, j, k, l| -tau[(i, l)] / det * delta(j, k));

    // (A.3)-(A.6)
    let mut change = Fourth::default();
    let (right, left) = (case.elastic() * increment.transpose(), increment * case.elastic());
    fill(&mut change, |i, j, k, l| delta(i, k) * right[(l, j)] + left[(i, l)] * delta(j, k));
    let rate = contract(&half, &change);
    let mut previous = Fourth::default();
    fill(&mut previous, |i, j, k, l| {
        (0..3)
            .map(|m| {
                0.5 * rate[i][m][k][l] * inverse[(j, m)]
                    - tau[(i, m)] * inverse[(j, k)] * inverse[(l, m)]
            })
            .sum::<f64>()
            / start_det
    });

    let size = elasticity(&case.material).mu;
    for (frame, expected, stress) in [
        (Frame::Updated, updated, tau / det),
        (Frame::Previous, previous, tau * inverse.transpose() / start_det),
    ] {
        let (c, state) = case.contribution(frame);
        assert!((state.kirchhoff_stress - tau).norm() < 1e-12 * size);
        for i in 0..D {
            for j in 0..D {
                assert!((c.stress[i][j] - stress[(i, j)]).abs() < 2e-12 * size, "{frame:?}");
                for k in 0..D {
                    for l in 0..D {
                        let (a, b) = (c.tangent[i][j][k][l], expected[i][j][k][l]);
                        assert!((a - b).abs() < 1e-11 * size, "{frame:?} {i}{j}{k}{l}: {a} {b}");
                    }
                }
            }
        }
    }
}

#[test]
fn papers_formulas_give_the_same_tangent() {
    for seed in 0..5 {
        check(&Case::<2>::random(elastic(), seed, 0.2));
        check(&Case::<2>::random(plastic(), seed, 0.2));
        check(&Case::<3>::random(elastic(), seed, 0.2));
        check(&Case::<3>::random(plastic(), seed, 0.2));
    }
    check(&Case::unstrained(elastic(), dense::identity::<3>()));
    check(&Case::unstrained(elastic(), dense::identity::<2>()));
}
