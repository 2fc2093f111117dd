//! Newmark's method and its dissipative relative on a vibrating bar.

use super::blocks::blocks;
use super::ghosts::contact;
use crate::common::run::{Results, Run};

fn bar(steps: usize) -> Run {
    Run::of("bar-vibration").set(format!("analysis.steps={steps}")).set("output.every=100000")
}

fn error(run: Run) -> f64 {
    run.results().verify("displacement_error")
}

#[test]
fn second_order_in_time_against_the_exact_solution() {
    for alpha in ["0.0", "-0.1"] {
        let errors: Vec<f64> = [18, 36, 72]
            .map(|steps| error(bar(steps).set(format!("analysis.hht_alpha={alpha}"))))
            .to_vec();
        for pair in errors.windows(2) {
            let rate = (pair[0] / pair[1]).log2();
            assert!((1.8..2.3).contains(&rate), "alpha {alpha}: {errors:?}");
        }
        assert!(errors[2] < 1e-2, "{errors:?}");
    }
}

#[test]
fn the_explicit_method_finds_the_same_vibration() {
    let run = bar(1200).set("analysis.type=\"explicit\"").set("method.stress_update=\"usf\"");
    assert!(error(run.clone()) < 5e-3);
    assert!(error(run.set("method.mass=\"lumped\"")) < 5e-3);
}

/// Total energy after each step.
fn energies(run: &Results) -> Vec<f64> {
    let strain = run.history("energy_strain");
    run.history("energy_kinetic").iter().zip(strain).map(|(a, b)| a + b).collect()
}

/// h / c = 1.5625 ms: 78 ms are 50 times that, a fifth of the period.
#[test]
fn steps_of_fifty_cells_stay_stable_where_the_end_is_a_sliver() {
    for alpha in ["0.0", "-0.1"] {
        let run = Run::of("bar-vibration")
            .set("method.basis=\"gimp\"")
            .set("method.domain_update=\"stretch\"")
            .set("body.0.points_per_cell=[2,2]")
            .set("analysis.steps=100")
            .set("analysis.duration=7.8125")
            .set(format!("analysis.hht_alpha={alpha}"))
            // The free end reaches 1e-6 of a cell into an empty one.
            .set("grid.origin=[-1.5625e-8, 0.0]")
            .set("boundary.0.where={ box = { min = [-1, 0], max = [1e-3, 1] } }")
            .set("output.every=100000")
            .results();
        let energies = energies(&run);
        let start = 0.25 * (1e-5 * 5.0 * std::f64::consts::PI).powi(2) * 0.015625;
        let highest = energies.iter().copied().fold(0.0, f64::max);
        assert!(highest < 1.05 * start, "alpha {alpha}: {highest} {start}");
        let last = *energies.last().unwrap();
        match alpha {
            "0.0" => assert!(last > 0.9 * start, "{last} {start}"),
            _ => assert!(last < 0.5 * start, "{last} {start}"),
        }
    }
}

/// A ghost with ragged edges that swells and shrinks, in 40 steps of 50 h/c.
pub fn swelling_ghost() -> Run {
    let deck = std::fs::read_to_string(crate::common::run::input("stretching-ghost"))
        .expect("a deck")
        .replace("stress_update = \"usl\"", "")
        .replace("scaling = \"published\"", "stiffness_factor = 1.0");
    let verify = deck.find("[[verify]]").expect("figures of merit");
    let output = deck.find("[output]").expect("an output table");
    Run::text(&format!("{}{}", &deck[..verify], &deck[output..]))
        .set("analysis.type=\"implicit-dynamic\"")
        .set("analysis.steps=40")
        // h/c = 0.0431 s with c^2 = 1346 Pa / 1000 kg/m3.
        .set("analysis.duration=86.2")
        .set("grid.h=0.05")
        .set("material.none.young=1000")
        .set("material.none.poisson=0.3")
        .set("body.0.velocity=[\"1e-3*(X - 0.5)\", \"1e-3*(Y - 0.5)\"]")
        .set("output.every=100000")
}

#[test]
fn steps_of_fifty_cells_stay_stable_where_all_edges_are_ragged() {
    let start = {
        let run = swelling_ghost().set("analysis.steps=1").set("analysis.duration=1e-9");
        energies(&run.results())[0]
    };
    let newmark = energies(&swelling_ghost().results());
    let highest = newmark.iter().copied().fold(0.0, f64::max);
    let last = *newmark.last().unwrap();
    // What is not with the points is with the Ghost share.
    assert!(highest < start && last > 0.8 * start, "{highest:e} {last:e} {start:e}");
    let damped = energies(&swelling_ghost().set("analysis.hht_alpha=-0.1").results());
    assert!(damped.windows(2).all(|pair| pair[1] < pair[0]), "{damped:?}");
    assert!(*damped.last().unwrap() < 0.3 * start, "{damped:?}");
}

/// Domains that follow their corners take part as the others do.
#[test]
fn cpdi2_works_in_implicit_dynamics() {
    let cpdi2 = |run: Run| run.set("method.basis=\"cpdi2\"");
    let errors = [18, 36, 72].map(|steps| error(cpdi2(bar(steps))));
    for pair in errors.windows(2) {
        let rate = (pair[0] / pair[1]).log2();
        assert!((1.8..2.3).contains(&rate), "{errors:?}");
    }
    let fall = cpdi2(fall()).set("method.domain_update=");
    assert!(fall.results().verify("displacement_error") < 1e-12);

    let collision = cpdi2(contact(10))
        .set("analysis.type=\"implicit-dynamic\"")
        .set("ghost.stiffness_factor=0.1")
        .set("analysis.duration=0.35")
        .results();
    assert!(collision.history("energy_strain").last() > Some(&1e-3), "there was contact");
    for axis in ["momentum_x", "momentum_y"] {
        let momentum = collision.history(axis);
        // 2 x 10.7363 kg m/s are there to be exchanged.
        let worst = momentum.iter().fold(0.0f64, |worst, p| worst.max(p.abs()));
        assert!(worst < 1e-7 * 21.4726, "{axis}: {worst:e}");
    }
}

#[test]
fn a_step_response_starts_with_the_acceleration_of_the_load() {
    // Free fall from rest is exact from the first step on.
    let run = fall().results();
    assert!(run.verify("displacement_error") < 1e-12);
    let work = *run.history("work_external").last().unwrap();
    let kinetic = *run.history("energy_kinetic").last().unwrap();
    assert!((work / kinetic - 1.0).abs() < 1e-9, "{work} {kinetic}");
}

/// A disc that falls from rest, half a second in five steps.
fn fall() -> Run {
    blocks(&["shape = { disc = { centre = [2, 3.6], radius = 0.8 } }"])
        .set("analysis={ type = \"implicit-dynamic\", steps = 5, duration = 0.5 }")
        .set("method={ basis = \"gimp\", domain_update = \"stretch\" }")
        .set("ghost={ mass_factor = 0.25, stiffness_factor = 0.1 }")
        .set("grid.size=[4, 5]")
        .set("grid.h=0.5")
        .set("load=[{ gravity = [0, -10] }]")
        .set(
            "verify=[{ name = \"displacement_error\", field = \"displacement\", \
             exact = [\"0\", \"-5*t^2\"], norm = \"max\" }]",
        )
}
