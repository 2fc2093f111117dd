//! What goes wrong is named with its step, point and cause; what was written stays.

use super::blocks::blocks;
use super::ghosts::collision;
use super::implicit::swelling_ghost;
use crate::common::run::{Outcome, Results, Run};

#[track_caller]
fn assert_says(outcome: &Outcome, code: i32, words: &[&str]) {
    let text = format!("{}{}", outcome.stdout, outcome.stderr);
    assert_eq!(outcome.code, code, "{text}");
    for word in words {
        assert!(outcome.stderr.contains(word), "no \"{word}\" in\n{}", outcome.stderr);
    }
}

/// The run ended by a fault after `done` steps, and everything up to there is in the files: a
/// row for each step, the points at the last one whatever the deck's plan of frames, the reason.
#[track_caller]
fn assert_keeps(outcome: Outcome, done: usize) -> Results {
    let said = outcome.stderr.clone();
    let results = outcome.results();
    assert_eq!(results.count("steps_completed"), done);
    assert_ne!(results.summary["status"], "completed");
    let reason = results.summary["reason"].as_str().expect("a reason").to_string();
    assert!(said.contains(&reason), "the summary says {reason}\nand the terminal {said}");
    let steps = results.history("step");
    assert_eq!(steps[..done], (1..=done).map(|n| n as f64).collect::<Vec<_>>());
    let points = results.points(done);
    assert_eq!(points.id.len(), results.count("points"));
    for field in ["displacement", "velocity"] {
        assert!(done == 0 || points.field(field).iter().all(|value| value.is_finite()));
    }
    assert!(results.text("points.xdmf").contains(&format!("points-{done:06}.h5")));
    results
}

/// Steps that the summary counts.
fn steps_done(outcome: &Outcome) -> usize {
    let path = outcome.folder.path().join("out/summary.json");
    let text = std::fs::read_to_string(path).expect("summary.json");
    let summary: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    summary["steps_completed"].as_u64().expect("a count") as usize
}

fn implicit(run: Run) -> Run {
    run.set("analysis.type=\"implicit-dynamic\"").set("ghost.stiffness_factor=0.1")
}

#[test]
fn a_time_step_over_the_limit_is_named() {
    for ranks in [1, 2] {
        let run = collision().set("analysis.steps=25").set("output.checkpoint={ every = 100 }");
        let outcome = run.ranks(ranks).attempt();
        assert_says(&outcome, 1, &["step ", "energy has grown", "time step", "stability limit"]);
        let done = steps_done(&outcome);
        let results = assert_keeps(outcome, done);
        assert_eq!(results.summary["status"], "failed");
        // The row of the step that is not accepted shows what happened.
        let kinetic = results.history("energy_kinetic");
        assert!(kinetic.len() == done + 1 && done >= 1, "{kinetic:?}");
        // The points are those of the last accepted row.
        let velocity = results.points(done);
        let speed: f64 = velocity.field("velocity").iter().map(|v| v * v).sum();
        let mass = results.number("bodies.lower.mass") / (velocity.id.len() as f64 / 2.0);
        let found = 0.5 * mass * speed;
        assert!((found / kinetic[done - 1] - 1.0).abs() < 1e-9, "{found} {kinetic:?}");
        let last = results.directory.join(format!("checkpoint-{done:06}.h5"));
        assert!(last.exists(), "{}", last.display());
    }
}

#[test]
fn a_point_that_leaves_the_grid_is_named_and_the_last_state_written() {
    let leaving = collision()
        .set("grid.origin=[0, -0.2]")
        .set("body.0.velocity=[-0.1, 0]")
        .set("body.0.shape.translate=[0.05, 0.005]");
    let explicit = leaving.clone().set("analysis.steps=500").set("method.stress_update=\"usl\"");
    for (run, ranks) in [(explicit, 1), (implicit(leaving).set("analysis.steps=35"), 2)] {
        let plan = "output.checkpoint={ every = 100 }";
        let outcome = run.ranks(ranks).set(plan).attempt();
        assert_says(&outcome, 1, &["step ", "point ", "leaves the grid"]);
        let done = steps_done(&outcome);
        let results = assert_keeps(outcome, done);
        let points = results.points(done);
        assert!(done > 0 && points.component("displacement", 0).iter().any(|u| *u < 0.0));
        // A deck that plans checkpoints finds one of the last good state.
        let last = results.directory.join(format!("checkpoint-{done:06}.h5"));
        assert!(last.exists(), "{}", last.display());
    }
}

/// m/s.
const SPEED: f64 = 1.02;

/// A block of a point a cell that moves towards the left edge of the grid.
fn towards_the_edge() -> Run {
    let block = format!(
        "shape = {{ box = {{ min = [2, 2], max = [4, 4] }} }}\npoints_per_cell = 1\n\
         velocity = [\"-{SPEED:?}\", \"0\"]"
    );
    blocks(&[&block])
}

/// A domain that would reach out of the grid while its point is still inside refuses the implicit
/// step that takes it there, which is cut and tried again before the run gives up.
#[test]
fn a_domain_that_leaves_the_grid_refuses_the_implicit_step() {
    let leaving = towards_the_edge()
        .set("analysis={ type = \"implicit-dynamic\", steps = 10, duration = 3 }")
        .set("analysis.on_failure=\"cut\"")
        .set("analysis.smallest_step=0.25")
        .set("ghost={ mass_factor = 0.25, stiffness_factor = 0.1 }");
    for (basis, ranks) in [("cpdi1", 1), ("cpdi2", 2)] {
        let run = leaving.clone().set(format!("method.basis=\"{basis}\"")).ranks(ranks);
        let outcome = run.attempt();
        // Corners may be a quarter of a cell outside, until 2.206 s; the points leave at 2.451 s.
        let words = ["step 8 of 10", "could not be solved", "corner ", "is outside the grid at"];
        assert_says(&outcome, 1, &words);
        let results = outcome.results();
        assert_eq!(results.summary["status"], "stopped");
        assert_eq!(results.count("steps_completed"), 7);
        // The first quarter of the eighth step is the last that is taken.
        let (time, cuts) = (results.history("time"), results.history("cuts"));
        let last = *time.last().expect("rows");
        assert!((last - 2.175).abs() < 1e-12, "{basis}: {time:?}");
        assert!(*cuts.last().expect("rows") >= 2.0, "{basis}: {cuts:?}");
        for ux in results.points(7).component("displacement", 0) {
            assert!((ux + SPEED * last).abs() < 1e-9, "{basis}: {ux}");
        }
    }
}

/// The explicit step that takes a domain out of the grid is the one that fails, not the next.
#[test]
fn a_domain_that_leaves_the_grid_ends_the_explicit_step() {
    let leaving = towards_the_edge()
        .set("analysis={ type = \"explicit\", steps = 100, duration = 3 }")
        .set("ghost.mass_factor=0.25");
    for (basis, update, ranks) in [("cpdi1", "usl", 1), ("cpdi1", "usf", 2), ("cpdi2", "usl", 1)] {
        let run = leaving
            .clone()
            .set(format!("method.basis=\"{basis}\""))
            .set(format!("method.stress_update=\"{update}\""))
            .ranks(ranks);
        let outcome = run.attempt();
        // Corners may be a quarter of a cell outside, until 2.206 s.
        assert_says(&outcome, 1, &["step 74 ", "corner ", "is outside the grid at"]);
        let results = outcome.results();
        assert_eq!(results.count("steps_completed"), 73, "{basis}, {update}");
        for ux in results.points(73).component("displacement", 0) {
            assert!((ux + SPEED * 2.19).abs() < 1e-9, "{basis}, {update}: {ux}");
        }
    }
}

#[test]
fn an_unstabilised_consistent_mass_is_named() {
    let outcome = collision().set("ghost.mass_factor=0").attempt();
    assert_says(&outcome, 1, &["step ", "consistent mass", "mass_factor"]);
    let done = steps_done(&outcome);
    assert_keeps(outcome, done);
    // Newmark's method meets it in the mapping of the velocity.
    let sliver = swelling_ghost().set("ghost.mass_factor=0").attempt();
    assert_says(&sliver, 1, &["of 40", "node at [", "consistent mass", "mass_factor"]);
    let done = steps_done(&sliver);
    assert_keeps(sliver, done);
}

#[test]
fn a_velocity_that_is_not_a_number_is_named() {
    let run = collision().set("body.0.velocity=[\"sqrt(X - 0.2)\", \"0\"]").ranks(2);
    for run in [run.clone(), implicit(run)] {
        let outcome = run.attempt();
        // Seen before anything is written.
        assert_says(&outcome, 2, &["body.0.velocity: x is NaN m/s at point ", "not finite"]);
        assert!(!outcome.folder.path().join("out").exists());
    }
}

/// The load has a value until 20 ms.
#[test]
fn a_load_that_becomes_not_a_number_is_named_with_its_step_and_point() {
    let deck = std::fs::read_to_string(crate::common::run::input("ghost-collision"))
        .expect("a deck")
        + "[[load]]\nbody_force = [\"1000*sqrt(0.02 - t)\", \"0\"]\n";
    let run = super::ghosts::COARSE
        .seed(Run::text(&deck), 2)
        .ranks(2)
        .set("analysis.steps=700")
        .set("output.every=100000");
    // Explicit steps take the load at their start, implicit ones at their end as well.
    for (run, fails) in [(run.clone(), 6), (implicit(run), 5)] {
        let outcome = run.attempt();
        let step = format!("step {fails} ");
        assert_says(&outcome, 1, &[&step, "the load on point ", " at [", "not finite"]);
        let results = assert_keeps(outcome, fails - 1);
        assert!(results.history("energy_kinetic").iter().all(|w| w.is_finite()));
    }
}

/// All points meet in the centre after one second.
#[test]
fn a_body_that_vanishes_is_named() {
    let run = Run::of("stretching-ghost")
        .set("body.0.velocity=[\"0.5 - X\", \"0.5 - Y\"]")
        .set("analysis.duration=2.0")
        .set("analysis.steps=200")
        .set("output.every=100000");
    let outcome = run.attempt();
    assert_says(&outcome, 1, &["step 100 ", "point ", " at [", "is turned inside out"]);
    let results = assert_keeps(outcome, 99);
    // (1 - 0.99)^2
    for volume_ratio in results.points(99).field("J") {
        assert!((volume_ratio - 1e-4).abs() < 1e-10, "{volume_ratio}");
    }
}

/// Before anything runs: exit code 2, and no results directory.
#[test]
fn a_body_without_points_is_named() {
    let outcome = collision()
        .set("body.1.shape={ disc = { centre = [0.05, 0.05], radius = 0.001 } }")
        .ranks(2)
        .attempt();
    assert_says(&outcome, 2, &["body \"upper\" has no points"]);
    assert!(outcome.files().is_empty(), "{:?}", outcome.files());
}

/// A row of points on a grid line gives the nodes across the cell gradients but no mass. With a lumped
/// mass such nodes move along with the points (`exactness.rs`); a consistent one without Ghost has no
/// answer for them.
#[test]
fn a_node_that_is_pushed_but_has_no_mass_is_named() {
    let outcome = blocks(&[r#"
shape = { box = { min = [2, 2.9], max = [4, 3.1] } }
lattice = { spacing = 0.5, offset = [2.25, 3.0] }
velocity = ["X", "0"]"#])
    .set("analysis.steps=10")
    .set("analysis.duration=0.01")
    .set("method.mass=\"consistent\"")
    .attempt();
    assert_says(&outcome, 1, &["step 2", "node at [", "no mass"]);
    assert_keeps(outcome, 1);
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
