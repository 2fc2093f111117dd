//! What goes wrong is named with its step, point and cause; what was written stays.

use super::ghosts::{collision, contact};
use crate::common::run::{Outcome, Run};

#[track_caller]
fn assert_says(outcome: &Outcome, code: i32, words: &[&str]) {
    let text = format!("{}{}", outcome.stdout, outcome.stderr);
    assert_eq!(outcome.code, code, "{text}");
    for word in words {
        assert!(outcome.stderr.contains(word), "no \"{word}\" in\n{}", outcome.stderr);
    }
}

#[test]
fn a_time_step_over_the_limit_is_named() {
    for ranks in [1, 2] {
        let outcome = collision().set("analysis.steps=25").ranks(ranks).attempt();
        assert_says(&outcome, 1, &["step ", "energy has grown", "time step", "stability limit"]);
        let results = outcome.results();
        assert_eq!(results.summary["status"], "failed");
        // The rows up to the fault are there, and so is the start.
        let done = results.count("steps_completed");
        assert!(results.history("step").len() >= done && done >= 1);
        assert!(results.points(0).id.len() > 1000);
    }
}

#[test]
fn a_point_that_leaves_the_grid_is_named_and_the_last_state_written() {
    let outcome = collision()
        .set("grid.origin=[0,0]")
        .set("grid.size=[1,1]")
        .set("body.0.velocity=[-0.1,0]")
        .set("analysis.steps=500")
        .set("method.stress_update=\"usl\"")
        .attempt();
    assert_says(&outcome, 1, &["step ", "point ", "leaves the grid"]);
    let results = outcome.results();
    let done = results.count("steps_completed");
    let points = results.points(done);
    assert!(done > 1 && points.component("displacement", 0).iter().any(|u| *u < 0.0));
}

#[test]
fn an_unstabilised_consistent_mass_is_named() {
    let outcome = collision().set("ghost.mass_factor=0").attempt();
    assert_says(&outcome, 1, &["step ", "consistent mass", "mass_factor"]);
}

#[test]
fn a_velocity_that_is_not_a_number_is_named() {
    let outcome = collision().set("body.0.velocity=[\"sqrt(X - 0.2)\", \"0\"]").ranks(2).attempt();
    assert_says(&outcome, 1, &["step 1", "point ", "not finite"]);
}

/// A row of points on a grid line gives the nodes across the cell gradients but no mass.
#[test]
fn a_node_that_is_pushed_but_has_no_mass_is_named() {
    let deck = |mass: &str| {
        Run::text(
            &r#"
title = "Row"
[analysis]
type = "explicit"
steps = 10
duration = 0.01
[method]
basis = "mpm"
mass = "MASS"
[grid]
type = "lattice"
size = [6, 6]
h = 1.0
[material.soft]
model = "hencky"
young = 1000
poisson = 0.3
[[body]]
name = "row"
material = "soft"
density = 10
shape = { box = { min = [2, 2.9], max = [4, 3.1] } }
lattice = { spacing = 0.5, offset = [2.25, 3.0] }
velocity = ["X", "0"]
[output]
every = 10000
"#
            .replace("MASS", mass),
        )
        .attempt()
    };
    for mass in ["lumped", "consistent"] {
        assert_says(&deck(mass), 1, &["step 2", "node at [", "no mass"]);
    }
}

#[test]
fn a_run_goes_on_from_its_checkpoint() {
    for kind in ["explicit", "implicit-dynamic"] {
        let run = |steps: usize| {
            contact(20)
                .set(format!("analysis.type=\"{kind}\""))
                .set("ghost.stiffness_factor=0.1")
                .set("output.checkpoint={ every = 5 }")
                .set(format!("output.every={steps}"))
        };
        let whole = run(20).results();
        let folder = run(20).results().into_folder();
        for number in [15, 20] {
            let _ =
                std::fs::remove_file(folder.path().join(format!("out/checkpoint-{number:06}.h5")));
        }
        // Only the checkpoints of steps 5 and 10 would be left; `keep` removed the first ones.
        let again = run(20).set("output.checkpoint={ every = 5, keep = 4 }").results();
        let folder_again = again.into_folder();
        for number in [15, 20] {
            std::fs::remove_file(
                folder_again.path().join(format!("out/checkpoint-{number:06}.h5")),
            )
            .expect("it was written");
        }
        let resumed = run(20).word("--restart").word("last").attempt_in(folder_again);
        assert_eq!(resumed.code, 0, "{}", resumed.stderr);
        let resumed = resumed.results();
        for column in ["energy_kinetic", "energy_strain", "work_external", "time"] {
            assert_eq!(resumed.history(column), whole.history(column), "{kind}: {column}");
        }
    }
}

#[test]
fn steps_by_the_stability_limit_reach_the_end() {
    let text = std::fs::read_to_string(crate::common::run::input("ghost-collision"))
        .expect("a deck")
        .replace("steps = 1000", "cfl = 0.4");
    let run = Run::text(&text).set("output.every=100000").results();
    let (time, dt) = (run.history("time"), run.history("dt"));
    assert!((time.last().unwrap() - 3.5).abs() < 1e-12);
    // h / (c sqrt(6)) with c = 1.16 m/s.
    assert!(dt.iter().all(|dt| *dt < 0.4 * 0.1 / (1.1 * 6f64.sqrt())), "{dt:?}");
    assert!(dt.len() < 600, "{}", dt.len());
    let total = run.history("energy_kinetic").last().unwrap()
        + run.history("energy_strain").last().unwrap();
    assert!((total / 2.14726 - 1.0).abs() < 0.05, "{total}");
}
