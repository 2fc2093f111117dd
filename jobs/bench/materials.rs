//! Nanoseconds per point for stress and tangent of each model, region by region, beside von Mises.
//!
//! `cargo bench --bench materials`. Points under rotated trial states of one region each; the least of
//! seven runs. "law" is the return alone, "stress + tangent" the whole evaluation at a point in space.

mod report;

use std::hint::black_box;

use mpm_par::deck::model::Frame;
use mpm_par::material::{self, LocalMaterial, MOST_STATE, Material};
use mpm_par::mechanics::{self, StepStart};
use nalgebra::{Matrix3, Rotation3, Vector3};
use report::{machine, sample};

const POINTS: usize = 2000;

/// A model with some of its parameters, and principal trial strains of one of its regions.
struct Case {
    model: &'static str,
    region: &'static str,
    parameters: &'static [(&'static str, f64)],
    trial: [f64; 3],
}

const ELASTIC: [(&str, f64); 2] = [("young", 1e8), ("poisson", 0.3)];
const METAL: &[(&str, f64)] = &[("yield_stress", 5e4)];
const HARDENING: &[(&str, f64)] = &[("yield_stress", 5e4), ("hardening", 1e6)];
const SOIL: &[(&str, f64)] = &[("friction", 30.0), ("dilation", 10.0), ("cohesion", 1e4)];
const UNDRAINED: &[(&str, f64)] = &[("shear_strength", 1e4)];
const CLAY: &[(&str, f64)] = &[
    ("slope", 1.0),
    ("compression", 0.1),
    ("swelling", 0.02),
    ("preconsolidation", 150e3),
    ("young", 7.5e6),
    ("poisson", 0.25),
];

const SMALL: [f64; 3] = [1e-5, -1e-5, -3e-5];
const SHEARED: [f64; 3] = [6e-4, -2e-4, -16e-4];
const APEX: [f64; 3] = [10e-4, 5e-4, 2e-4];

const fn case(
    model: &'static str,
    region: &'static str,
    parameters: &'static [(&'static str, f64)],
    trial: [f64; 3],
) -> Case {
    Case { model, region, parameters, trial }
}

const CASES: [Case; 15] = [
    // The reference comes first.
    case("von-mises", "plastic", METAL, SHEARED),
    case("von-mises", "elastic", METAL, SMALL),
    case("von-mises", "hardening", HARDENING, SHEARED),
    case("hencky", "elastic", &[], SMALL),
    case("neo-hookean", "elastic", &[], SMALL),
    case("tresca", "elastic", UNDRAINED, SMALL),
    case("tresca", "edge", UNDRAINED, SHEARED),
    case("mohr-coulomb", "elastic", SOIL, SMALL),
    case("mohr-coulomb", "plane", SOIL, SHEARED),
    case("mohr-coulomb", "edge", SOIL, [4e-4, 3.8e-4, -20e-4]),
    case("mohr-coulomb", "apex", SOIL, APEX),
    case("drucker-prager", "cone", SOIL, [2e-4, -1e-4, -12e-4]),
    case("drucker-prager", "apex", SOIL, APEX),
    case("cam-clay", "elastic", CLAY, [-0.001, -0.001, -0.002]),
    case("cam-clay", "plastic", CLAY, [-0.010, -0.012, -0.040]),
];

impl Case {
    fn material(&self) -> Material {
        let entry = material::entry(self.model).expect("a model of the catalogue");
        let given = |key: &str| {
            let all = self.parameters.iter().chain(&ELASTIC);
            all.filter(|(known, _)| *known == key).map(|(_, value)| *value).next()
        };
        let value = |known: &material::Parameter| {
            given(known.key).unwrap_or_else(|| known.value_if_absent())
        };
        let parameters: Vec<f64> = entry.parameters.iter().map(value).collect();
        (entry.make)(&parameters)
    }
}

/// exp(2 eps) - 1 about other axes at each point.
fn states(trial: [f64; 3]) -> Vec<Matrix3<f64>> {
    let values = Matrix3::from_diagonal(&Vector3::from(trial.map(|e| (2.0 * e).exp_m1())));
    let turned = |p: usize| {
        let angle = p as f64;
        let turn = Rotation3::from_euler_angles(0.3 * angle, 0.7 * angle, 1.1 * angle);
        turn.matrix() * values * turn.matrix().transpose()
    };
    (0..POINTS).map(turned).collect()
}

fn main() {
    println!("{}\n", machine());
    println!(
        "| model | region | law, ns | over plastic von-mises | stress + tangent, ns | over plastic von-mises |"
    );
    println!("|---|---|---|---|---|---|");
    let mut reference = [1.0; 2];
    let unit = Matrix3::identity();
    for case in &CASES {
        let material = case.material();
        let state: [f64; MOST_STATE] = material.initial_state([0.0; 3]);
        let words = &state[..material.state().len()];
        let law = sample(POINTS, || {
            let mut sum = 0.0;
            for p in 0..POINTS {
                // Unequal strains, so that nothing is computed once for all points.
                let by = 1.0 + 1e-6 * p as f64;
                let made = material.respond(black_box(case.trial.map(|e| e * by)), words);
                sum += black_box(&made).stress[0];
            }
            black_box(sum);
        });
        let points = states(case.trial);
        let whole = sample(POINTS, || {
            let mut sum = 0.0;
            for elastic_excess in &points {
                let start = StepStart {
                    material: LocalMaterial::uniform(&material),
                    state: words,
                    deformation_gradient: &unit,
                    elastic_excess,
                    volume_initial: 1.0,
                };
                let still = black_box([[0.0; 3]; 3]);
                let (made, after) = mechanics::contribution::<3>(Frame::Previous, &start, &still);
                sum += black_box(&made).volume + black_box(&after).plastic_increment;
            }
            black_box(sum);
        });
        let times = [law.least, whole.least];
        if case.model == "von-mises" && case.region == "plastic" {
            reference = times;
        }
        println!(
            "| {} | {} | {:.0} | {:.2} | {:.0} | {:.2} |",
            case.model,
            case.region,
            times[0],
            times[0] / reference[0],
            times[1],
            times[1] / reference[1]
        );
    }
}
