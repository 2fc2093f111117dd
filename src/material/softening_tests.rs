//! Softening and hardening laws: tangents against differences, residual strength, closed forms, bad parameters.

#![allow(clippy::needless_range_loop, reason = "tensor formulas read by their indices")]

use super::tests::tangent_error;
use super::{CATALOGUE, Material, Response, law};

const YOUNG: f64 = 1e5;

fn laws() -> Vec<Material> {
    let elastic = [("young", YOUNG), ("poisson", 0.3)];
    let cone = [
        ("friction", 30.0),
        ("dilation", 10.0),
        ("cohesion", 10.0),
        ("softening.strain", 0.02),
        ("softening.cohesion", 2.0),
        ("softening.friction", 25.0),
        ("softening.dilation", 0.0),
        ("softening.length", 0.1),
    ];
    let with =
        |name: &str, more: &[(&str, f64)]| law(name, &[&elastic[..], &cone[..], more].concat()).1;
    let hardening = |name: &str| {
        let cone = &cone[..3];
        law(name, &[&elastic[..], cone, &[("hardening", 3e3)]].concat()).1
    };
    vec![
        hardening("mohr-coulomb"),
        hardening("drucker-prager"),
        with("mohr-coulomb", &[]),
        with("mohr-coulomb", &[("tension", 1.0)]),
        with("drucker-prager", &[]),
        with("drucker-prager", &[("fit", 1.0)]),
        with("drucker-prager", &[("fit", 2.0)]),
        clay(0.02),
    ]
}

/// Tresca's, whose strength of 10 Pa falls to 4 Pa over this strain.
fn clay(strain: f64) -> Material {
    let given = [
        ("young", YOUNG),
        ("poisson", 0.3),
        ("shear_strength", 10.0),
        ("softening.strain", strain),
        ("softening.cohesion", 4.0),
        ("softening.length", 0.1),
    ];
    law("tresca", &given).1
}

/// States in planes, edges, apex and cut-off.
const TRIALS: [[f64; 3]; 9] = [
    [6e-4, -2e-4, -16e-4],
    [4e-4, 3.8e-4, -20e-4],
    [12e-4, -12e-4, -12.2e-4],
    [10e-4, 5e-4, 2e-4],
    [3e-4, -1e-4, -1e-4],
    [-1e-4, -30e-4, 2e-4],
    [5e-4, 0.2e-4, -3e-4],
    [2e-4, 1e-4, -40e-4],
    [8e-3, -1e-3, -9e-3],
];

/// The consistent tangent is the derivative of the stress of a step, from the peak on and from
/// half-way down.
#[test]
fn tangents_are_those_of_differences() {
    for (number, law) in laws().into_iter().enumerate() {
        let mut falling = 0;
        for start in [0.0, 0.008, 0.5] {
            for trial in TRIALS {
                let response = law.respond(trial, &[start]);
                falling += usize::from(response.state[0] > start && start < 0.02);
                let off = tangent_error(&law, trial, &[start], 1e-9);
                assert!(off < 2e-6 * YOUNG, "law {number}, {trial:?} from {start}: {off}");
            }
        }
        assert!(falling > 8, "law {number}: {falling}");
    }
}

/// The state is the sum of sqrt(2/3) |dev of the plastic strain|, and the stress lies on the surface
/// of the state's own values.
#[test]
fn the_stress_is_that_of_the_fallen_strength() {
    let law = clay(0.02);
    let mut state = 0.0;
    let mut strain = [0.0; 3];
    let mut strengths = Vec::new();
    for _ in 0..60 {
        let trial = [strain[0] + 1e-3, strain[1], strain[2] - 1e-3];
        let response: Response = law.respond(trial, &[state]);
        let flow = [0, 1, 2].map(|a| trial[a] - response.elastic_strain[a]);
        let grown = (2.0 / 3.0 * flow.iter().map(|e| e * e).sum::<f64>()).sqrt();
        assert!((response.state[0] - state - grown).abs() < 1e-13);
        (strain, state) = (response.elastic_strain, response.state[0]);
        let strength = 0.5 * (response.stress[0] - response.stress[2]);
        let exact = if state < 0.02 { 10.0 - 6.0 * state / 0.02 } else { 4.0 };
        assert!((strength - exact).abs() < 1e-9, "{state}: {strength} {exact}");
        strengths.push(strength);
    }
    assert_eq!(*strengths.last().expect("a strength"), 4.0);
    assert!(strengths.is_sorted_by(|a, b| a >= b) && state > 0.02);
}

/// In pure shear by e, tau = 2 G (e - l) = c + H 2 l / sqrt(3), l the plastic strain: in one step or in many.
#[test]
fn cohesion_grows_with_the_plastic_strain() {
    let (cohesion, rise, shear) = (10.0, 3e3, YOUNG / 2.6);
    let given = [
        ("young", YOUNG),
        ("poisson", 0.3),
        ("friction", 0.0),
        ("dilation", 0.0),
        ("cohesion", cohesion),
        ("hardening", rise),
    ];
    for name in ["mohr-coulomb", "drucker-prager"] {
        let (_, law) = law(name, &given);
        for steps in [1, 40] {
            let (mut strain, mut state) = ([0.0; 3], 0.0);
            let total = 2e-3;
            for _ in 0..steps {
                let more = total / steps as f64;
                let response =
                    law.respond([strain[0] + more, strain[1], strain[2] - more], &[state]);
                (strain, state) = (response.elastic_strain, response.state[0]);
            }
            let slope = 2.0 / 3.0f64.sqrt();
            let plastic = (2.0 * shear * total - cohesion) / (2.0 * shear + slope * rise);
            let tau = 2.0 * shear * strain[0];
            assert!(
                (tau / (cohesion + slope * rise * plastic) - 1.0).abs() < 1e-12,
                "{name}: {tau}"
            );
            assert!((state / (slope * plastic) - 1.0).abs() < 1e-12, "{name}: {state}");
        }
    }
}

/// A fall steeper than the elasticity can follow still ends on the surface.
#[test]
fn a_steep_fall_ends_at_the_residual_strength() {
    let law = clay(1e-6);
    let response = law.respond([2e-4, 0.0, -2e-4], &[0.0]);
    assert!((0.5 * (response.stress[0] - response.stress[2]) - 4.0).abs() < 1e-9);
}

/// Residual values above the peak, and a cut-off beyond the residual apex, are refused.
#[test]
fn residual_values_that_do_not_fit_are_named() {
    let check = |more: &[(&str, f64)]| {
        let cone = [
            ("young", YOUNG),
            ("poisson", 0.3),
            ("friction", 30.0),
            ("dilation", 10.0),
            ("cohesion", 10.0),
            ("softening.strain", 0.02),
            ("softening.length", 0.1),
        ];
        let (values, _) = law("mohr-coulomb", &[more, &cone[..]].concat());
        let entry = CATALOGUE.iter().find(|entry| entry.name == "mohr-coulomb").expect("a law");
        (entry.check)(&values).map_err(|misfit| misfit.key)
    };
    assert_eq!(check(&[("softening.cohesion", 5.0), ("softening.dilation", 0.0)]), Ok(()));
    assert_eq!(check(&[("softening.cohesion", 11.0)]), Err("softening.cohesion"));
    assert_eq!(check(&[("hardening", 5.0)]), Err("hardening"));
    assert_eq!(check(&[("softening.friction", 5.0)]), Err("softening.dilation"));
    assert_eq!(check(&[("softening.cohesion", 1.0), ("tension", 5.0)]), Err("tension"));
}
