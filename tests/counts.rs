//! What a rank sends, keeps and holds: counts, which no other work on the machine can change.

mod common;

use common::run::{Results, Run};

/// The mound of `inputs/scaling.toml`, two steps.
fn mound(h: f64, ranks: usize) -> Results {
    Run::of("scaling").ranks(ranks).set(format!("grid.h={h:?}")).results()
}

fn communication(results: &Results, what: &str) -> f64 {
    results.number(&format!("communication.{what}"))
}

#[test]
fn a_single_rank_sends_nothing() {
    let results = mound(0.25, 1);
    for what in ["messages_max", "bytes_max"] {
        assert_eq!(communication(&results, what), 0.0, "{what}");
    }
}

#[test]
fn bytes_follow_the_surface_and_messages_the_neighbours() {
    let [coarse, fine] = [0.25, 0.0625].map(|h| mound(h, 4));
    let grown = |what: &str| communication(&fine, what) / communication(&coarse, what);
    // Sixteen times the points have four times the border.
    assert!(fine.number("points") / coarse.number("points") > 15.0);
    assert!(grown("bytes_max") < 5.0, "{}", grown("bytes_max"));
    // One level of multigrid more, and a few iterations.
    assert!(grown("messages_max") < 1.5, "{}", grown("messages_max"));
    assert!(grown("reductions") < 1.5, "{}", grown("reductions"));
    let [few, many] = [&coarse, &fine].map(|run| run.count("linear_iterations.total"));
    assert!(many as f64 / (few as f64) < 1.3, "{few} and {many} iterations");
}

#[test]
fn no_rank_keeps_the_grid_and_iterations_stay() {
    let runs = [1, 2, 4].map(|ranks| mound(0.125, ranks));
    let iterations = runs.each_ref().map(|run| run.count("linear_iterations.total"));
    assert!(iterations.iter().all(|n| n.abs_diff(iterations[0]) <= 2), "{iterations:?}");
    for run in &runs {
        // The table of owners: a few bytes a brick, where the grid has 2 880 cells.
        let kept = communication(run, "replicated_bytes");
        assert!(kept > 0.0 && kept < 4096.0, "{kept}");
    }
}

/// The program's libraries take fifty megabytes whatever the problem, so what counts is the rest.
#[test]
fn memory_is_shared_out() {
    let peak = |h, ranks| mound(h, ranks).number("peak_memory_bytes.max");
    let of_problem = |ranks| peak(0.05, ranks) - peak(1.0, ranks);
    let [one, four] = [of_problem(1), of_problem(4)];
    assert!(four < 0.35 * one, "{four:e} of {one:e} bytes");
}
