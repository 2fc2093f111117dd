//! Stresses and tangents of single points against independently computed figures, and tangents
//! against differences in every region.

#![allow(clippy::needless_range_loop, reason = "tensor formulas read by their indices")]

use super::tests::tangent_error;
use super::{Material, Response, entry};

/// E = 100 MPa, nu = 0.3, c = 10 kPa in kPa.
const ELASTIC: [f64; 2] = [1e5, 0.3];

fn made(name: &str, given: &[f64]) -> Material {
    let entry = entry(name).expect("known");
    (entry.make)(&entry.completed(given))
}

fn mohr_coulomb(friction: f64, dilation: f64, tension: f64) -> Material {
    let all = [ELASTIC[0], ELASTIC[1], friction, dilation, 10.0, tension];
    made("mohr-coulomb", &all)
}

/// `fit`: plane strain, outer, inner.
fn drucker_prager(friction: f64, dilation: f64, fit: f64) -> Material {
    let all = [ELASTIC[0], ELASTIC[1], friction, dilation, 10.0, fit];
    made("drucker-prager", &all)
}

/// A figure with about eight digits.
pub(super) fn near(found: f64, wanted: f64, scale: f64) {
    assert!((found - wanted).abs() < scale, "{found} in place of {wanted}");
}

fn check(material: &Material, trial: [f64; 3], stress: [f64; 3], tangent: [[f64; 3]; 3]) {
    let found = material.respond(trial, &[]);
    for a in 0..3 {
        near(found.stress[a], stress[a], 1e-6);
        for b in 0..3 {
            near(found.tangent[a][b], tangent[a][b], 1.1e-3);
        }
    }
    by_differences(material, trial, &[]);
}

/// The tangent, the shear moduli and the split of the strain of one state.
fn by_differences(material: &Material, trial: [f64; 3], state: &[f64]) {
    by_differences_with(material, trial, state, 1e-9);
}

/// The same with differences over `step` to each side.
pub(super) fn by_differences_with(material: &Material, trial: [f64; 3], state: &[f64], step: f64) {
    let young = material.stiffness();
    near(tangent_error(material, trial, state, step), 0.0, 1e-6 * young);
    owed(material, trial, &material.respond(trial, state));
}

/// What holds in every state: shear moduli, elastic strain and dissipation.
fn owed(material: &Material, trial: [f64; 3], found: &Response) {
    let young = material.stiffness();
    for (pair, (a, b)) in [(0, 1), (1, 2), (2, 0)].into_iter().enumerate() {
        let jump = found.stress[a] - found.stress[b];
        near(found.shear[pair] * (trial[a] - trial[b]), jump, 1e-12 * young);
        assert!(found.shear[pair] >= 0.0);
    }
    let strain = material.elastic_strain(found.stress);
    for a in 0..3 {
        near(strain[a], found.elastic_strain[a], 1e-12);
    }
    assert!(found.dissipation >= -1e-15 * young, "{}", found.dissipation);
}

#[test]
fn mohr_coulomb_returns_to_its_planes_edges_and_apex() {
    let law = mohr_coulomb(30.0, 10.0, f64::INFINITY);
    check(
        &law,
        [6e-4, -2e-4, -16e-4],
        [-49.128991, -89.347094, -182.027989],
        [
            [32642.964, 23701.501, 46362.039],
            [39171.557, 128441.801, 55634.446],
            [97928.892, 71104.502, 139086.116],
        ],
    );
    let edge = [33237.345, 33237.345, 47206.224];
    check(
        &law,
        [4e-4, 3.8e-4, -20e-4],
        [-59.042856, -59.042856, -211.769584],
        [edge, edge, [99712.035, 99712.035, 141618.672]],
    );
    let edge = [69557.220, 98790.493, 98790.493];
    check(
        &law,
        [12e-4, -12e-4, -12.2e-4],
        [-40.716895, -156.791700, -156.791700],
        [[23185.740, 32930.164, 32930.164], edge, edge],
    );
    let apex = 10.0 * 3.0_f64.sqrt();
    check(&law, [10e-4, 5e-4, 2e-4], [apex; 3], [[0.0; 3]; 3]);
}

#[test]
fn tresca_is_mohr_coulomb_without_friction() {
    let all = [ELASTIC[0], ELASTIC[1], 10.0];
    for law in [mohr_coulomb(0.0, 0.0, f64::INFINITY), made("tresca", &all)] {
        let row = [96153.846, 57692.308, 96153.846];
        check(
            &law,
            [3e-4, 0.9e-4, -1.5e-4],
            [29.615385, 20.769231, 9.615385],
            [row, [57692.308, 134615.385, 57692.308], row],
        );
        let stress = [-280.0 / 3.0, -280.0 / 3.0, -340.0 / 3.0];
        check(&law, [6e-4, -2e-4, -16e-4], stress, [[1e5 / 1.2; 3]; 3]);
    }
}

#[test]
fn drucker_prager_returns_to_its_cone_and_apex() {
    let law = drucker_prager(30.0, 10.0, 0.0);
    check(
        &law,
        [2e-4, -1e-4, -12e-4],
        [-52.286866, -73.864899, -152.984357],
        [
            [65326.491, 7784.651, 60529.430],
            [16627.140, 97952.825, 60488.700],
            [101794.379, 92911.159, 132266.136],
        ],
    );
    check(&law, [10e-4, 5e-4, 2e-4], [10.0 * 3.0_f64.sqrt(); 3], [[0.0; 3]; 3]);
    // Triaxial compression and extension at yield: the outer and inner cones meet the pyramid.
    for (fit, trial) in [(1.0, [3e-4, 3e-4, -20e-4]), (2.0, [8e-4, -10e-4, -10e-4])] {
        let [a, _, c] = drucker_prager(30.0, 10.0, fit).respond(trial, &[]).stress;
        near(1.5 * a - 0.5 * c, 10.0 * 3.0_f64.sqrt(), 1e-10);
    }
}

#[test]
fn drucker_prager_owes_on_cone_and_apex() {
    let mut random = Sequence(3);
    for law in [
        drucker_prager(30.0, 10.0, 0.0),
        drucker_prager(20.0, 20.0, 1.0),
        drucker_prager(0.0, 0.0, 2.0),
    ] {
        let mut smooth = 0;
        for k in 0..1000 {
            let mut trial = [random.next(), random.next(), random.next()].map(|e| 1e-3 * e);
            if k % 10 == 0 {
                trial[1] = trial[0];
            }
            let found = law.respond(trial, &[]);
            owed(&law, trial, &found);
            let kind = |by: f64| {
                let shifted = law.respond(trial.map(|e| e * (1.0 + by)), &[]);
                (shifted.plastic_increment > 0.0, shifted.shear[0] == 0.0)
            };
            if kind(1e-4) == kind(-1e-4) {
                by_differences(&law, trial, &[]);
                smooth += 1;
            }
        }
        assert!(smooth > 900, "{smooth}");
        let tangent = law.respond([2e-4, -1e-4, -12e-4], &[]).tangent;
        let skew = (tangent[0][1] - tangent[1][0]).abs() + (tangent[0][2] - tangent[2][0]).abs();
        assert_eq!(law.symmetric(), skew < 1e-9 * ELASTIC[0]);
    }
}

/// Numbers in (-1, 1), the same on every run.
pub(super) struct Sequence(pub u64);

impl Sequence {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Random states, every tenth with two or three coinciding strains: on the surface, ordered like
/// the trial, and with a tangent that differences confirm away from borders of regions.
#[test]
fn mohr_coulomb_owes_in_every_region() {
    let mut random = Sequence(7);
    for (friction, dilation, tension) in
        [(30.0, 10.0, f64::INFINITY), (25.0, 25.0, 5.0), (0.0, 0.0, 3.0), (35.0, 0.0, 0.0)]
    {
        let law = mohr_coulomb(friction, dilation, tension);
        let (sine, cosine) = (f64::to_radians(friction).sin(), f64::to_radians(friction).cos());
        let mut smooth = 0;
        for k in 0..4000 {
            let mut trial = [random.next(), random.next(), random.next()].map(|e| 1e-3 * e);
            if k % 10 == 0 {
                trial[1] = trial[0];
            }
            if k % 30 == 0 {
                trial[2] = trial[0];
            }
            let found = law.respond(trial, &[]);
            owed(&law, trial, &found);
            let mut sorted = found.stress;
            sorted.sort_by(|a, b| b.total_cmp(a));
            let f = (1.0 + sine) * sorted[0] - (1.0 - sine) * sorted[2] - 20.0 * cosine;
            assert!(f < 1e-7 && sorted[0] <= tension + 1e-7, "{f} {sorted:?}");
            // Differences over the border of a region are no tangent: both sides must agree.
            let beside = |by: f64| {
                let strain = [trial[0] + by, trial[1] - 0.7 * by, trial[2] + 0.4 * by];
                law.respond(strain, &[]).tangent
            };
            let apart = trial[0] != trial[1] && trial[1] != trial[2] && trial[2] != trial[0];
            if apart && beside(3e-7) == found.tangent && beside(-3e-7) == found.tangent {
                by_differences(&law, trial, &[]);
                smooth += 1;
            }
        }
        assert!(smooth > 3000, "{smooth}");
    }
}

#[test]
fn a_returned_point_starts_the_next_step_elastic() {
    let law = mohr_coulomb(30.0, 10.0, 5.0);
    for trial in [[6e-4, -2e-4, -16e-4], [4e-4, 3.8e-4, -20e-4], [10e-4, 5e-4, 2e-4]] {
        let strain = law.respond(trial, &[]).elastic_strain;
        for noise in [-3e-16, 0.0, 3e-16] {
            let again = law.respond(strain.map(|e| e * (1.0 + noise)), &[]);
            assert_eq!(again.plastic_increment, 0.0);
        }
    }
}

#[test]
fn parameters_that_do_not_fit_are_named() {
    let entry = entry("mohr-coulomb").expect("known");
    let key = |p: [f64; 6]| (entry.check)(&entry.completed(&p)).err().map(|misfit| misfit.key);
    let none = f64::INFINITY;
    assert_eq!(key([1e5, 0.3, 30.0, 10.0, 10.0, none]), None);
    assert_eq!(key([1e5, 0.3, 0.0, 0.0, 0.0, none]), Some("cohesion"));
    assert_eq!(key([1e5, 0.3, 30.0, 31.0, 10.0, none]), Some("dilation"));
    assert_eq!(key([1e5, 0.3, 30.0, 0.0, 10.0, 18.0]), Some("tension"));
    assert_eq!(key([1e5, 0.3, 0.0, 0.0, 10.0, 18.0]), None);
}
