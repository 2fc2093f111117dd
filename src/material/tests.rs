//! What every model owes: yield surface, consistent tangent, energy, no surprises at the limits.

#![allow(clippy::needless_range_loop, reason = "tensor formulas read by their indices")]

use proptest::prelude::*;

use super::{Hencky, Material, Response, VonMises};

const YOUNG: f64 = 100.0;
const POISSON: f64 = 0.3;
const YIELD: f64 = 2.0;

fn elasticity() -> Hencky {
    Hencky::new(YOUNG, POISSON)
}

fn von_mises() -> Material {
    Material::VonMises(VonMises::perfect(elasticity(), YIELD))
}

/// sqrt(2 J2) of principal stresses.
fn radius(stress: [f64; 3]) -> f64 {
    let mean = stress.iter().sum::<f64>() / 3.0;
    stress.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>().sqrt()
}

/// The largest distance of the consistent tangent from the central differences of the stress over `step` to each
/// side, Pa. NaN counts as infinite.
pub(super) fn tangent_error(material: &Material, trial: [f64; 3], state: &[f64], step: f64) -> f64 {
    let tangent = material.respond(trial, state).tangent;
    let mut error: f64 = 0.0;
    for b in 0..3 {
        let shifted = |by: f64| {
            let mut strain = trial;
            strain[b] += by;
            material.respond(strain, state).stress
        };
        let (up, down) = (shifted(step), shifted(-step));
        for a in 0..3 {
            let off = (tangent[a][b] - (up[a] - down[a]) / (2.0 * step)).abs();
            error = error.max(if off.is_nan() { f64::INFINITY } else { off });
        }
    }
    error
}

fn check_tangent(material: &Material, trial: [f64; 3]) {
    let response = material.respond(trial, &[]);
    assert!(tangent_error(material, trial, &[], 1e-7) < 1e-6 * YOUNG);
    for (pair, (a, b)) in [(0, 1), (1, 2), (2, 0)].into_iter().enumerate() {
        let jump = response.stress[a] - response.stress[b];
        assert!((response.shear[pair] * (trial[a] - trial[b]) - jump).abs() < 1e-12 * YOUNG);
    }
}

/// The stress is the elastic one of the elastic strain, and strain is only moved, not lost.
fn check_split(trial: [f64; 3], response: &Response) {
    let elastic = elasticity().stress(response.elastic_strain);
    let mut plastic = 0.0;
    let mut work = 0.0;
    for a in 0..3 {
        assert!((response.stress[a] - elastic[a]).abs() < 1e-13 * YOUNG);
        let flow = trial[a] - response.elastic_strain[a];
        plastic += flow * flow;
        work += flow * response.stress[a];
    }
    assert!((response.plastic_increment - plastic.sqrt()).abs() < 1e-15);
    assert!((response.dissipation - work).abs() < 1e-13 * YOUNG);
    let (before, after): (f64, f64) = (trial.iter().sum(), response.elastic_strain.iter().sum());
    assert!((before - after).abs() < 1e-15, "plastic flow keeps the volume");
}

proptest! {
    #[test]
    fn von_mises_owes(trial in prop::array::uniform3(-0.2..0.2f64)) {
        let response = von_mises().respond(trial, &[]);
        let trial_radius = radius(elasticity().stress(trial));
        if trial_radius > YIELD {
            prop_assert!((radius(response.stress) / YIELD - 1.0).abs() < 1e-13);
            prop_assert!(response.plastic_increment > 0.0);
        } else {
            prop_assert_eq!(response.elastic_strain, trial);
            prop_assert_eq!(response.plastic_increment, 0.0);
        }
        check_split(trial, &response);
        if (trial_radius / YIELD - 1.0).abs() > 1e-3 {
            check_tangent(&von_mises(), trial);
        }
    }

    #[test]
    fn hencky_owes(trial in prop::array::uniform3(-0.5..0.5f64)) {
        let material = Material::Hencky(elasticity());
        check_tangent(&material, trial);
        check_split(trial, &material.respond(trial, &[]));
        // Stress is the gradient of the energy; a quadratic makes central differences exact.
        for a in 0..3 {
            let energy = |by: f64| {
                let mut strain = trial;
                strain[a] += by;
                elasticity().energy(strain)
            };
            let difference = (energy(0.25) - energy(-0.25)) / 0.5;
            prop_assert!((difference - elasticity().stress(trial)[a]).abs() < 1e-12 * YOUNG);
        }
    }
}

#[test]
fn hencky_constants() {
    // Uniaxial stress: tau = E eps and eps_side = -nu eps.
    let stress = elasticity().stress([0.01, -0.003, -0.003]);
    assert!((stress[0] - 1.0).abs() < 1e-14);
    assert!(stress[1].abs() < 1e-14 && stress[2].abs() < 1e-14);
    assert!((elasticity().bulk_modulus() - YOUNG / (3.0 * (1.0 - 2.0 * POISSON))).abs() < 1e-12);
    let wave = YOUNG * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
    assert!((elasticity().p_wave_modulus() - wave).abs() < 1e-12);
}

#[test]
fn a_point_at_yield_starts_elastic() {
    // Returned once, the stored strain must not flow again without a new increment.
    let mut strain = [0.11, -0.02, 0.043];
    strain = von_mises().respond(strain, &[]).elastic_strain;
    for noise in [-3e-16, 0.0, 3e-16] {
        let again = von_mises().respond(strain.map(|e| e * (1.0 + noise)), &[]);
        assert_eq!(again.plastic_increment, 0.0);
        assert_eq!(again.tangent, Material::Hencky(elasticity()).respond(strain, &[]).tangent);
    }
}

#[test]
fn pressure_alone_never_yields() {
    let response = von_mises().respond([-3.0; 3], &[]);
    assert_eq!(response.plastic_increment, 0.0);
    assert!(response.stress.iter().all(|s| s.is_finite()));
}

#[test]
fn not_a_number_goes_through() {
    let response = von_mises().respond([f64::NAN, 0.0, 0.0], &[]);
    assert!(response.stress.iter().all(|s| s.is_nan()));
}
