//! Past a limit load: what a loaded arch does against the same arch pushed down by its crown.

use crate::common::run::{Results, Run};

/// N, of `inputs/arch.toml` at load factor 1.
const LOAD: f64 = 100.0;
/// m, by which the other run pushes the crown down at load factor 1.
const PUSH: f64 = 1.0;

/// How far the point of the load has come down after a step, m.
fn fall(results: &Results, step: usize) -> f64 {
    let (start, now) = (results.points(0), results.points(step));
    let (x, y) = (start.component("position", 0), start.component("position", 1));
    let away = |p: usize| (x[p] - 0.01).hypot(y[p] - 1.9);
    let loaded = (0..x.len()).min_by(|&a, &b| away(a).total_cmp(&away(b))).unwrap();
    y[loaded] - now.component("position", 1)[loaded]
}

/// Load over the fall of the crown: (fall, load) of each step.
fn pushed_down() -> Vec<(f64, f64)> {
    let steps = 100;
    let results = Run::of("arch")
        .set("load=[]")
        .set(format!("analysis.steps={steps}"))
        .set(format!("boundary.0.displacement={{y=\"-{PUSH}*s\"}}"))
        .results();
    let loads = results.history("reaction.crown.y");
    assert_eq!(loads.len(), steps);
    (1..=steps).zip(loads).map(|(k, load)| (PUSH * k as f64 / steps as f64, -load)).collect()
}

fn limit(path: &[(f64, f64)]) -> f64 {
    path[..path.len() / 2].iter().map(|at| at.1).fold(0.0, f64::max)
}

#[test]
fn cut_steps_jump_to_the_far_branch() {
    let path = pushed_down();
    let limit = limit(&path);
    let least = path.iter().skip_while(|at| at.1 < 0.99 * limit).map(|at| at.1).reduce(f64::min);
    assert!(least.unwrap() < 0.8 * limit, "the load falls behind its limit");
    let results = Run::of("arch").results();
    assert!(*results.history("cuts").last().unwrap() >= 1.0);
    let falls: Vec<f64> = (1..=50).map(|step| fall(&results, step)).collect();
    let jump = (1..50).max_by(|&a, &b| {
        let by = |k: usize| falls[k] - falls[k - 1];
        by(a).total_cmp(&by(b))
    });
    // falls[k] belongs to step k + 1: the first step that ends above the limit.
    let jump = jump.unwrap();
    assert_eq!(jump, (limit / LOAD * 50.0) as usize);
    assert!(falls[jump] - falls[jump - 1] > 0.5, "{falls:?}");
    // Before and behind the jump both controls find the same equilibrium: the same load where the
    // crown has come down as far. (The other way round it is badly conditioned near the limit.)
    for step in [5, 10, 15, 20, 30, 40, 50] {
        let (load, fall) = (LOAD * step as f64 / 50.0, falls[step - 1]);
        let [a, b] = path.windows(2).find(|pair| pair[1].0 >= fall).unwrap() else {
            unreachable!()
        };
        let expected = a.1 + (fall - a.0) / (b.0 - a.0) * (b.1 - a.1);
        assert!((load / expected - 1.0).abs() < 8e-3, "step {step}: {load} N and {expected} N");
    }
}

#[test]
fn a_stopped_run_names_the_last_stable_load() {
    let limit = limit(&pushed_down());
    // Steps on the first branch take up to 6 evaluations, a jump at least 10.
    let outcome = Run::of("arch")
        .set("analysis.on_failure=\"stop\"")
        .set("analysis.steps=200")
        .set("analysis.max_iterations=7")
        .attempt();
    assert_eq!(outcome.code, 1, "{}", outcome.stderr);
    let stable = LOAD
        * (1..200)
            .rev()
            .map(f64::from)
            .find(|k| outcome.stderr.contains(&format!("the last finished step is {k}")))
            .unwrap()
        / 200.0;
    assert!((stable / limit - 1.0).abs() < 5e-3, "{stable} N, limit {limit} N");
}
