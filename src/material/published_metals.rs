//! Hardening metals and rubber: radii and stresses against closed forms, tangents against
//! differences.

#![allow(clippy::needless_range_loop, reason = "tensor formulas read by their indices")]

use super::published::{Sequence, by_differences_with, near};
use super::{Material, Model, NeoHookean, VonMises, entry};

const YOUNG: f64 = 117e3;
const FIRST: f64 = 400.0;
const LINEAR: f64 = 100.0;

/// MPa; uniaxial stresses.
fn metal(hardening: f64, saturation: f64, rate: f64) -> Material {
    let all = [YOUNG, 0.35, 0.0, FIRST, 0.0, hardening, saturation, rate];
    Material::VonMises(<VonMises as Model>::new(&all))
}

/// sqrt(3 J2)
fn equivalent(stress: [f64; 3]) -> f64 {
    let [a, b, c] = stress;
    (0.5 * ((a - b).powi(2) + (b - c).powi(2) + (c - a).powi(2))).sqrt()
}

#[test]
fn the_yield_stress_grows_as_the_law_says() {
    let laws: [(f64, f64, f64); 3] =
        [(LINEAR, 0.0, 0.0), (0.0, 700.0, 17.0), (LINEAR, 700.0, 17.0)];
    for (hardening, saturation, rate) in laws {
        let law = metal(hardening, saturation, rate);
        let (mut strain, mut state) = ([0.0; 3], [0.0; 4]);
        let mut random = Sequence(11);
        for _ in 0..200 {
            let step = [random.next(), random.next(), random.next()].map(|e| 0.03 * e);
            let trial = [0, 1, 2].map(|a| strain[a] + step[a]);
            let found = law.respond(trial, &state[..1]);
            // Strain at which the response turns plastic has no derivative: none of these does.
            by_differences_with(&law, trial, &state[..1], 1e-7);
            let alpha = found.state[0];
            let grown = FIRST
                + hardening * alpha
                + (saturation - FIRST).max(0.0) * (1.0 - (-rate * alpha).exp());
            if found.plastic_increment > 0.0 {
                near(equivalent(found.stress), grown, 1e-10 * grown);
            }
            let more = (2.0_f64 / 3.0).sqrt() * found.plastic_increment;
            near(alpha - state[0], more, 1e-15);
            (strain, state) = (found.elastic_strain, found.state);
        }
        assert!(state[0] > 1.0, "{}", state[0]);
    }
}

/// Uniaxial stress in one step or many: sigma = sigma_y + H eps_p with eps_p = eps - sigma/E.
#[test]
fn uniaxial_stress_follows_the_line() {
    let law = metal(LINEAR, 0.0, 0.0);
    for steps in [1, 7] {
        let (mut strain, mut state, mut total) = ([0.0; 3], [0.0; 4], 0.0);
        for _ in 0..steps {
            let axial = 0.2 / f64::from(steps);
            total += axial;
            // The lateral strain by Newton's method on the lateral stress.
            let mut lateral = -0.4 * axial;
            let mut found;
            for _ in 0..30 {
                let trial = [strain[0] + axial, strain[1] + lateral, strain[2] + lateral];
                found = law.respond(trial, &state[..1]);
                lateral -= found.stress[1] / (found.tangent[1][1] + found.tangent[1][2]);
            }
            let trial = [strain[0] + axial, strain[1] + lateral, strain[2] + lateral];
            found = law.respond(trial, &state[..1]);
            near(found.stress[1], 0.0, 1e-9);
            let stress = found.stress[0];
            near(stress, FIRST + LINEAR * (total - stress / YOUNG), 1e-10 * FIRST);
            near(found.state[0], total - stress / YOUNG, 1e-12);
            (strain, state) = (found.elastic_strain, found.state);
        }
    }
}

#[test]
fn without_hardening_nothing_is_carried_and_nothing_changes() {
    let law = metal(0.0, 0.0, 0.0);
    assert!(law.state().is_empty() && metal(1.0, 0.0, 0.0).state().len() == 1);
    // A saturated law at its last yield stress is perfect, too.
    assert!(metal(0.0, FIRST, 3.0).state().is_empty());
    let trial = [0.02, -0.01, 0.003];
    let (perfect, carried) = (law.respond(trial, &[]), law.respond(trial, &[0.0]));
    for a in 0..3 {
        near(perfect.stress[a], carried.stress[a], 1e-12 * YOUNG);
    }
    let misfit = (entry("von-mises").expect("known").check)(&[
        YOUNG,
        0.35,
        0.0,
        FIRST,
        0.0,
        0.0,
        FIRST - 1.0,
        3.0,
    ]);
    assert_eq!(misfit.map_err(|misfit| misfit.key), Err("saturation.stress"));
}

#[test]
fn neo_hookean_is_the_gradient_of_its_energy() {
    let law = Material::NeoHookean(<NeoHookean as Model>::new(&[YOUNG, 0.45]));
    let mut random = Sequence(5);
    for k in 0..200 {
        let mut strain = [random.next(), random.next(), random.next()];
        if k % 10 == 0 {
            strain[1] = strain[0];
        }
        let found = law.respond(strain, &[]);
        by_differences_with(&law, strain, &[], 1e-6);
        for a in 0..3 {
            let energy = |by: f64| {
                let mut shifted = strain;
                shifted[a] += by;
                law.energy(shifted)
            };
            let slope = (energy(1e-5) - energy(-1e-5)) / 2e-5;
            near(found.stress[a], slope, 1e-7 * YOUNG);
        }
    }
    // Simple shear by gamma has tau_12 = mu gamma: (tau_1 - tau_2) sin(2 theta)/2 with
    // sin(2 theta) = 2/sqrt(4 + gamma^2).
    let gamma: f64 = 0.8;
    let stretch = 0.5 * (gamma + (4.0 + gamma * gamma).sqrt());
    let stress = law.respond([stretch.ln(), -stretch.ln(), 0.0], &[]).stress;
    let shear = (stress[0] - stress[1]) / (4.0 + gamma * gamma).sqrt();
    near(shear, YOUNG / 2.9 * gamma, 1e-10 * YOUNG);
}
