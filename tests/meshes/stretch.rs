//! Uniaxial stretch in plane strain with nu = 0: Rotation §3.1, Figures 3 and 4.

use crate::common::run::{Results, Run};

const YOUNG: f64 = 1000.0;
const YIELD: f64 = 400.0;
const STEPS: usize = 20;
const METHODS: [&str; 4] = [
    "method.basis=\"mpm\"",
    "method.basis=\"cpdi1\"",
    "method.basis=\"cpdi2\"",
    "method.control=\"fem\"",
];

fn run(method: &str) -> Results {
    Run::of("stretch").set(method).set("output.every=100").results()
}

/// Reaction 2 tau_xx / lambda of the block after each step, and the first step that yields.
///
/// The stretches stay along the axes, so logarithmic strains add up as small ones do. With
/// nu = 0 the stress is E times the elastic strain; the return to the cylinder scales the deviator.
/// The height is free (tau_yy = 0), which fixes the total strain along y in each step: backward
/// Euler, as the program integrates.
fn closed_form() -> (Vec<f64>, usize) {
    let returned = |trial: [f64; 3]| -> ([f64; 3], bool) {
        let mean = trial.iter().sum::<f64>() / 3.0;
        let radius = YOUNG * trial.iter().map(|e| (e - mean).powi(2)).sum::<f64>().sqrt();
        let scale = (YIELD / radius).min(1.0);
        (trial.map(|e| mean + scale * (e - mean)), scale < 1.0)
    };
    let mut elastic = [0.0f64; 3];
    let mut forces = Vec::new();
    let mut first_yield = 0;
    let mut before = 1.0f64;
    for step in 1..=STEPS {
        let stretch = 1.0 + 2.0 * step as f64 / STEPS as f64;
        let along = (stretch / before).ln();
        before = stretch;
        let trial = |across: f64| returned([elastic[0] + along, elastic[1] + across, elastic[2]]);
        // tau_yy grows with the strain along y: bisection.
        let (mut low, mut high) = (-2.0, 2.0);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if trial(middle).0[1] > 0.0 { high = middle } else { low = middle }
        }
        let (state, yields) = trial(0.5 * (low + high));
        elastic = state;
        if yields && first_yield == 0 {
            first_yield = step;
        }
        forces.push(2.0 * YOUNG * elastic[0] / stretch);
    }
    (forces, first_yield)
}

#[test]
fn the_closed_form_is_the_papers() {
    let (forces, first_yield) = closed_form();
    assert_eq!(first_yield, 7);
    for (step, force) in forces[..6].iter().enumerate() {
        let stretch = 1.0 + 0.1 * (step + 1) as f64;
        let elastic = 2.0 * YOUNG * stretch.ln() / stretch;
        assert!((force / elastic - 1.0).abs() < 1e-12);
    }
    assert!(forces[6] < forces[5], "the reaction falls once the block yields");
}

#[test]
fn reactions_are_the_closed_form_for_all_four_methods() {
    let (expected, first_yield) = closed_form();
    let mut first: Option<Vec<f64>> = None;
    for method in METHODS {
        let results = run(method);
        let found = results.history("reaction.right.x");
        assert_eq!(found.len(), STEPS);
        for (step, (found, expected)) in found.iter().zip(&expected).enumerate() {
            let error = (found / expected - 1.0).abs();
            assert!(error < 1e-9, "{method} step {}: {found} {expected}", step + 1);
        }
        let dissipated = results.history("energy_plastic");
        let yields = dissipated.iter().position(|&d| d > 1e-12).map(|step| step + 1);
        assert_eq!(yields, Some(first_yield), "{method}: {dissipated:?}");
        let reference = first.get_or_insert_with(|| found.clone());
        for (a, b) in found.iter().zip(reference.iter()) {
            assert!((a / b - 1.0).abs() < 1e-8, "{method}");
        }
    }
}

/// ln(e_3 / e_2) / ln(e_2 / e_1) of the last three residuals of a step, averaged over the steps
/// that yield (elastic ones are solved in two iterations).
#[test]
fn newton_converges_quadratically() {
    for method in METHODS {
        let results = run(method);
        let orders: Vec<f64> = (7..=STEPS)
            .map(|step| {
                let residuals = results.residuals(step);
                let [.., a, b, c] = residuals[..] else { panic!("step {step}: {residuals:?}") };
                (c / b).ln() / (b / a).ln()
            })
            .collect();
        let mean = orders.iter().sum::<f64>() / orders.len() as f64;
        assert!(mean >= 1.95, "{method}: {mean} {orders:?}");
    }
}
