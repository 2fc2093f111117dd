//! Stress and tangent against differences, closed forms and the papers' formulas.

#![allow(clippy::needless_range_loop, reason = "tensor formulas read by their indices")]

use nalgebra::Matrix3;

use super::{BATCH, Contribution, StepStart, StressState, contribution, stress, stresses};
use crate::deck::model::Frame;
use crate::material::{Hencky, LocalMaterial, Material, VonMises};
use crate::tensor::dense::{self, Square};
use crate::tensor::spectral::exponential;

pub(crate) const FRAMES: [Frame; 3] = [Frame::Previous, Frame::Updated, Frame::Total];

pub(crate) fn elastic() -> Material {
    Material::Hencky(Hencky::new(100.0, 0.3))
}

pub(crate) fn plastic() -> Material {
    Material::VonMises(VonMises::perfect(Hencky::new(100.0, 0.3), 5.0))
}

/// Numbers in (-1, 1), the same on every run.
pub(crate) struct Sequence(pub u64);

impl Sequence {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// `base` + `size` times random entries.
    pub fn tensor<const D: usize>(&mut self, base: f64, size: f64) -> Square<D> {
        let mut tensor = dense::identity::<D>();
        for row in &mut tensor {
            for entry in row {
                *entry = base * *entry + size * self.next();
            }
        }
        tensor
    }

    /// A symmetric positive tensor near 1; plane strain with its own zz for D = 2.
    pub fn left_cauchy_green<const D: usize>(&mut self, size: f64) -> Matrix3<f64> {
        let any = dense::embed(&self.tensor::<D>(0.0, size), size * self.next());
        exponential(&(any + any.transpose()))
    }
}

/// a - 1
fn less_unit<const D: usize>(a: &Square<D>) -> Square<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] - if i == j { 1.0 } else { 0.0 }))
}

/// A point at the start of a step.
pub(crate) struct Case<const D: usize> {
    pub material: Material,
    pub gradient: Matrix3<f64>,
    /// b_e - 1
    pub excess: Matrix3<f64>,
    /// dF
    pub increment: Square<D>,
}

impl<const D: usize> Case<D> {
    pub fn random(material: Material, seed: u64, size: f64) -> Self {
        let mut random = Sequence(seed);
        Case {
            material,
            gradient: dense::embed(&random.tensor::<D>(1.0, 0.3), 1.0),
            excess: random.left_cauchy_green::<D>(0.2) - Matrix3::identity(),
            increment: random.tensor::<D>(1.0, size),
        }
    }

    pub fn unstrained(material: Material, increment: Square<D>) -> Self {
        let gradient = Matrix3::identity();
        Case { material, gradient, excess: Matrix3::zeros(), increment }
    }

    /// b_e
    pub fn elastic(&self) -> Matrix3<f64> {
        Matrix3::identity() + self.excess
    }

    /// dF - 1
    pub fn moved(&self) -> Square<D> {
        less_unit(&self.increment)
    }

    pub fn start(&self) -> StepStart<'_> {
        StepStart {
            material: LocalMaterial::uniform(&self.material),
            state: &[],
            deformation_gradient: &self.gradient,
            elastic_excess: &self.excess,
            volume_initial: 0.7,
        }
    }

    pub fn contribution(&self, frame: Frame) -> (Contribution<D>, StressState) {
        contribution(frame, &self.start(), &self.moved())
    }

    /// Force on a node with basis gradient `g` = dS/dX~, with the increment changed by `change`.
    fn force(&self, frame: Frame, g: &[f64; D], change: &Square<D>) -> [f64; D] {
        let mut increment = self.moved();
        for i in 0..D {
            for j in 0..D {
                increment[i][j] += change[i][j];
            }
        }
        let (c, _) = contribution(frame, &self.start(), &increment);
        dense::apply(&c.stress, &mapped(&c, g)).map(|t| t * c.volume)
    }

    /// K_aibk between nodes with basis gradients `a` and `b`.
    fn stiffness(&self, frame: Frame, a: &[f64; D], b: &[f64; D]) -> Square<D> {
        let (c, _) = self.contribution(frame);
        let (a, b) = (mapped(&c, a), mapped(&c, b));
        let mut k = [[0.0; D]; D];
        for i in 0..D {
            for j in 0..D {
                for m in 0..D {
                    for l in 0..D {
                        k[i][m] += a[j] * c.tangent[i][j][m][l] * b[l] * c.volume;
                    }
                }
            }
        }
        k
    }
}

/// dS/dy_j = dS/dX~_i G_ij
fn mapped<const D: usize>(c: &Contribution<D>, g: &[f64; D]) -> [f64; D] {
    dense::apply(&dense::transpose(&c.gradient_map), g)
}

fn norm<const D: usize>(t: &Square<D>) -> f64 {
    t.iter().flatten().map(|e| e * e).sum::<f64>().sqrt()
}

fn difference<const D: usize>(a: &Square<D>, b: &Square<D>) -> f64 {
    let mut d = *a;
    for i in 0..D {
        for j in 0..D {
            d[i][j] -= b[i][j];
        }
    }
    norm(&d)
}

/// Central differences of the mapped force with respect to nodal displacements.
fn check_tangent<const D: usize>(case: &Case<D>) {
    const STEP: f64 = 2e-6;
    let mut random = Sequence(99);
    for frame in FRAMES {
        let a: [f64; D] = std::array::from_fn(|_| random.next());
        let b: [f64; D] = std::array::from_fn(|_| random.next());
        let exact = case.stiffness(frame, &a, &b);
        let mut differences = [[0.0; D]; D];
        for k in 0..D {
            let mut change = [[0.0; D]; D];
            change[k] = b.map(|e| e * STEP);
            let up = case.force(frame, &a, &change);
            change[k] = b.map(|e| -e * STEP);
            let down = case.force(frame, &a, &change);
            for i in 0..D {
                differences[i][k] = (up[i] - down[i]) / (2.0 * STEP);
            }
        }
        let error = difference(&exact, &differences) / norm(&exact);
        assert!(error < 2e-8, "{frame:?}: {error:e} {exact:?} {differences:?}");
    }
}

fn scaled_identity<const D: usize>(factor: f64) -> Square<D> {
    dense::identity::<D>().map(|row| row.map(|e| e * factor))
}

fn check_random_tangents<const D: usize>() {
    let mut flowing = 0;
    for seed in 0..20 {
        check_tangent(&Case::<D>::random(elastic(), seed, 0.3));
        let case = Case::<D>::random(plastic(), seed, 0.3);
        if case.contribution(Frame::Previous).1.plastic_increment > 1e-3 {
            flowing += 1;
        }
        check_tangent(&case);
    }
    assert!(flowing >= 15, "too few of the cases flow: {flowing}");
}

#[test]
fn tangent_is_the_derivative_of_the_force_2d() {
    check_random_tangents::<2>();
}

#[test]
fn tangent_is_the_derivative_of_the_force_3d() {
    check_random_tangents::<3>();
}

fn check_coinciding_stretches<const D: usize>() {
    for factor in [1.0, 0.8, 2.0] {
        for gap in [0.0, 1e-14, 1e-9, 1e-5] {
            for axis in 0..D {
                let mut increment = scaled_identity::<D>(factor);
                increment[axis][axis] += gap;
                increment[0][1] += 0.3 * gap;
                check_tangent(&Case::unstrained(elastic(), increment));
            }
        }
    }
    // Two equal in-plane or transverse stretches beside a large third, flowing.
    let mut increment = scaled_identity::<D>(1.0);
    increment[0][0] = 1.3;
    check_tangent(&Case::unstrained(plastic(), increment));
    check_tangent(&Case::unstrained(plastic(), scaled_identity::<2>(1.3)));
}

#[test]
fn coinciding_stretches_2d() {
    check_coinciding_stretches::<2>();
}

#[test]
fn coinciding_stretches_3d() {
    check_coinciding_stretches::<3>();
}

fn check_frames<const D: usize>(material: Material) {
    for seed in 0..10 {
        let case = Case::<D>::random(material, seed, 0.3);
        let mut random = Sequence(seed + 1000);
        let a: [f64; D] = std::array::from_fn(|_| random.next());
        let b: [f64; D] = std::array::from_fn(|_| random.next());
        let none = [[0.0; D]; D];
        let force = case.force(Frame::Previous, &a, &none);
        let stiffness = case.stiffness(Frame::Previous, &a, &b);
        for frame in [Frame::Updated, Frame::Total] {
            let other = case.force(frame, &a, &none);
            let size = dense::dot(&force, &force).sqrt();
            for i in 0..D {
                assert!((force[i] - other[i]).abs() < 1e-12 * size, "{frame:?}");
            }
            let other = case.stiffness(frame, &a, &b);
            assert!(difference(&stiffness, &other) < 1e-12 * norm(&stiffness), "{frame:?}");
        }
    }
}

#[test]
fn frames_agree_to_round_off() {
    check_frames::<2>(elastic());
    check_frames::<2>(plastic());
    check_frames::<3>(elastic());
    check_frames::<3>(plastic());
}

#[test]
fn stress_alone_is_the_same_stress() {
    let case = Case::<3>::random(plastic(), 5, 0.3);
    let alone = stress(&case.start(), &case.moved());
    let (_, state) = case.contribution(Frame::Previous);
    assert_eq!(alone.kirchhoff_stress, state.kirchhoff_stress);
    assert_eq!(alone.elastic_excess, state.elastic_excess);
}

#[test]
fn hencky_simple_shear() {
    // eps = asinh(g/2) [[cos, sin], [sin, -cos]], the angle from tan = 2/g.
    let mu = 100.0 / 2.6;
    for g in [1e-8, 0.1, 1.0, 4.0] {
        let case = Case::unstrained(elastic(), [[1.0, g], [0.0, 1.0]]);
        let (c, state) = case.contribution(Frame::Updated);
        let size = 2.0 * mu * (0.5f64 * g).asinh();
        let hypotenuse = (4.0 + g * g).sqrt();
        let (cos, sin) = (g / hypotenuse, 2.0 / hypotenuse);
        let tau = state.kirchhoff_stress;
        assert!((tau[(0, 1)] - size * sin).abs() < 1e-14 * mu);
        assert!((tau[(0, 0)] - size * cos).abs() < 1e-14 * mu);
        assert!((tau[(1, 1)] + size * cos).abs() < 1e-14 * mu);
        assert!(tau[(2, 2)].abs() < 1e-13 * mu);
        assert!((c.stress[0][1] - tau[(0, 1)]).abs() < 1e-14 * mu);
        assert!((c.volume - 0.7).abs() < 1e-15);
        let energy = 2.0 * mu * (0.5f64 * g).asinh().powi(2);
        assert!((state.stored_energy - energy).abs() < 1e-13 * mu.max(energy));
    }
}

#[test]
fn small_strains_keep_their_digits() {
    // Uniaxial strains of 1e-3 to 1e-20 in each of ten steps: the
    // stress of (1 + e)^10 to thirteen digits, and b_e with it.
    let (lambda, mu) = (100.0 * 0.3 / (1.3 * 0.4), 100.0 / 2.6);
    let material = elastic();
    for e in [1e-3, 1e-7, 1e-12, 1e-20] {
        let mut state = StressState::default();
        let (gradient, mut excess) = (Matrix3::identity(), Matrix3::zeros());
        for _ in 0..10 {
            let start = StepStart {
                material: LocalMaterial::uniform(&material),
                state: &[],
                deformation_gradient: &gradient,
                elastic_excess: &excess,
                volume_initial: 1.0,
            };
            let (contribution, now) = contribution(Frame::Updated, &start, &[[e, 0.0], [0.0, 0.0]]);
            assert!((contribution.stress[0][0] / now.kirchhoff_stress[(0, 0)] - 1.0).abs() < 2e-3);
            (state, excess) = (now, now.elastic_excess);
        }
        let strain = 10.0 * e.ln_1p();
        for (axis, modulus) in [(0, lambda + 2.0 * mu), (1, lambda), (2, lambda)] {
            let ratio = state.kirchhoff_stress[(axis, axis)] / (modulus * strain);
            assert!((ratio - 1.0).abs() < 1e-13, "{e} {axis}: {ratio}");
        }
        assert!((excess[(0, 0)] / (2.0 * strain).exp_m1() - 1.0).abs() < 1e-13, "{e}");
    }
}

#[test]
fn von_mises_uniaxial_strain() {
    // F = diag(s, 1, 1): tau_xx = K ln s + rho sqrt(2/3) beyond yield.
    let (bulk, mu, rho) = (100.0 / 1.2, 100.0 / 2.6, 5.0);
    let s: f64 = 1.4;
    let case = Case::unstrained(plastic(), [[s, 0.0], [0.0, 1.0]]);
    let (c, state) = case.contribution(Frame::Total);
    let tau = state.kirchhoff_stress;
    assert!((tau[(0, 0)] - (bulk * s.ln() + rho * (2.0f64 / 3.0).sqrt())).abs() < 1e-12);
    let side = bulk * s.ln() - rho * (1.0f64 / 6.0).sqrt();
    assert!((tau[(1, 1)] - side).abs() < 1e-12 && (tau[(2, 2)] - side).abs() < 1e-12);
    let flow = s.ln() * (2.0f64 / 3.0).sqrt() - rho / (2.0 * mu);
    assert!((state.plastic_increment - flow).abs() < 1e-15);
    assert!((state.dissipation - rho * flow).abs() < 1e-14);
    assert!((c.stress[0][0] - tau[(0, 0)] / s).abs() < 1e-12);
    // Plastic flow keeps the volume: det b_e = det(dF)^2.
    let elastic = Matrix3::identity() + state.elastic_excess;
    assert!((elastic.determinant() - s * s).abs() < 1e-13);
}

#[test]
fn work_is_stored_or_dissipated() {
    // The integral of P : dF over many small steps is the stored energy plus the dissipation.
    let steps = 4000;
    let path = |k: usize| {
        let t = k as f64 / steps as f64;
        [[1.0 + 0.2 * t, 0.5 * t], [0.1 * t, 1.0 - 0.1 * t]]
    };
    let material = plastic();
    let (mut gradient, mut excess) = (Matrix3::identity(), Matrix3::zeros());
    let (mut work, mut dissipated, mut stored) = (0.0, 0.0, 0.0);
    let mut before = [[0.0; 2]; 2];
    for k in 1..=steps {
        let now = dense::embed(&path(k), 1.0);
        let inverse = gradient.try_inverse().expect("the path is regular");
        let start = StepStart {
            material: LocalMaterial::uniform(&material),
            state: &[],
            deformation_gradient: &gradient,
            elastic_excess: &excess,
            volume_initial: 1.0,
        };
        let increment = less_unit(&dense::block::<2>(&(now * inverse)));
        let (c, state) = contribution(Frame::Total, &start, &increment);
        let (old, new) = (path(k - 1), path(k));
        for i in 0..2 {
            for j in 0..2 {
                work += 0.5 * (c.stress[i][j] + before[i][j]) * (new[i][j] - old[i][j]);
            }
        }
        dissipated += state.dissipation;
        stored = state.stored_energy;
        before = c.stress;
        (gradient, excess) = (now, state.elastic_excess);
    }
    assert!(dissipated > 0.3 * work);
    assert!((work - stored - dissipated).abs() < 2e-4 * work, "{work} {stored} {dissipated}");
}

#[test]
fn rotation_turns_the_stress_and_nothing_else() {
    let case = Case::<2>::random(plastic(), 3, 0.3);
    let (_, state) = case.contribution(Frame::Previous);
    let (sin, cos) = 1.1f64.sin_cos();
    let q = [[cos, -sin], [sin, cos]];
    let turned = Case { increment: dense::multiply(&q, &case.increment), ..case };
    let (_, turned) = turned.contribution(Frame::Previous);
    let q = dense::embed(&q, 1.0);
    let expected = q * state.kirchhoff_stress * q.transpose();
    assert!((turned.kirchhoff_stress - expected).norm() < 1e-13 * expected.norm());
    assert!((turned.stored_energy / state.stored_energy - 1.0).abs() < 1e-13);
}

#[test]
fn inverted_increments_are_consistent() {
    // A reflection leaves the stretches: tau is reflected, J changes its sign.
    let case = Case::<2>::random(elastic(), 11, 0.2);
    let (c, state) = case.contribution(Frame::Updated);
    let mirror = [[-1.0, 0.0], [0.0, 1.0]];
    let inverted = Case { increment: dense::multiply(&mirror, &case.increment), ..case };
    let (other, reflected) = inverted.contribution(Frame::Updated);
    let m = dense::embed(&mirror, 1.0);
    let expected = m * state.kirchhoff_stress * m;
    assert!((reflected.kirchhoff_stress - expected).norm() < 1e-13 * expected.norm());
    assert!((other.volume + c.volume).abs() < 1e-15);
    assert!(other.volume < 0.0);
    check_tangent(&inverted);
    let mut inverted = Case::<3>::random(plastic(), 12, 0.2);
    inverted.increment[1] = inverted.increment[1].map(|e| -e);
    check_tangent(&inverted);
}

#[test]
fn singular_increments_show() {
    for frame in FRAMES {
        let case = Case::unstrained(elastic(), [[1.0, 0.0], [0.0, 0.0]]);
        let (c, state) = case.contribution(frame);
        assert!(c.stress.iter().flatten().any(|t| !t.is_finite()));
        assert!(state.kirchhoff_stress.iter().any(|t| !t.is_finite()));
        let case = Case::unstrained(plastic(), [[1.0, f64::NAN], [0.0, 1.0]]);
        assert!(case.contribution(frame).0.stress.iter().flatten().any(|t| !t.is_finite()));
    }
}

#[test]
fn a_batch_gives_each_point_what_it_gets_alone() {
    fn check<const D: usize>() {
        for count in [1, 7, BATCH] {
            let material = |k: usize| if k.is_multiple_of(3) { elastic() } else { plastic() };
            let cases: Vec<Case<D>> =
                (0..count).map(|k| Case::random(material(k), k as u64, 0.02 * k as f64)).collect();
            let increments: Vec<Square<D>> = cases.iter().map(Case::moved).collect();
            let mut states = [StressState::default(); BATCH];
            stresses(|k| cases[k].start(), &increments, &[], &mut states);
            for (case, state) in cases.iter().zip(&states) {
                assert_eq!(*state, stress(&case.start(), &case.moved()));
            }
            let flows =
                states[..count].iter().filter(|state| state.plastic_increment > 0.0).count();
            assert!(count < 7 || (flows > 0 && flows < count), "both kinds: {flows} of {count}");
        }
    }
    check::<2>();
    check::<3>();
}
