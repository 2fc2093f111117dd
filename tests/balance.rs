//! A collapse that starts badly dealt out levels itself, and its answer does not show it.

mod common;

use common::run::{Results, Run, relative_difference};

/// Larger cells with fewer points, the physics is the same.
const SMALL: [&str; 2] = ["grid.h=0.1", "body.0.points_per_cell=[2, 2]"];
const OFF: &str = "parallel.rebalance_above=0";
const OUTPUT: &str = "output.every={ seconds = 10 }";

fn slump(settings: &[&str]) -> Run {
    settings.iter().fold(Run::of("slump").ranks(4), |run, word| run.set(*word))
}

fn small() -> Run {
    slump(&SMALL).set(OUTPUT)
}

/// All fields of the points at the end.
fn end(results: &Results) -> Vec<(&'static str, Vec<f64>)> {
    let points = results.points(results.count("steps_completed"));
    ["position", "displacement", "velocity", "stress", "plastic_strain"]
        .into_iter()
        .filter(|name| points.has(name))
        .map(|name| (name, points.field(name).to_vec()))
        .collect()
}

/// Largest relative difference of the ends of two runs.
fn difference(a: &Results, b: &Results) -> f64 {
    let (a, b) = (end(a), end(b));
    assert!(a.len() >= 3 && a.len() == b.len());
    a.iter().zip(&b).map(|((_, a), (_, b))| relative_difference(a, b)).fold(0.0, f64::max)
}

/// The share of the points of the busiest rank over the mean starts at 3 and stays below 1.1
/// once it has been levelled.
fn assert_levelled(results: &Results, steps: usize) {
    let imbalance = results.history("imbalance");
    assert_eq!(imbalance.len(), steps);
    assert!((imbalance[0] - 3.0).abs() < 0.03, "starts at {}", imbalance[0]);
    let later = imbalance[1..].iter().copied().fold(0.0, f64::max);
    assert!(later < 1.1, "{later}");
    assert_eq!(results.number("imbalance"), imbalance[steps - 1]);
    assert!((results.number("balance.largest_imbalance") - 3.0).abs() < 0.03);
    // The first deal, and more while the block spreads; few points move for them.
    assert!(results.count("balance.rebalanced") >= 2);
    assert!(results.number("balance.moved_share") < 1.0);
    let moved = results.history("moved_points");
    assert!(moved[0] > 0.3, "the first step's end moves points: {}", moved[0]);
    let total: f64 = moved.iter().sum();
    assert!(total >= results.number("balance.moved_share") - 1e-12);
}

#[test]
fn a_collapse_levels_itself_and_ends_as_without_it() {
    let with = small().results();
    let without = small().set(OFF).results();
    let steps = with.count("steps_completed");
    assert_levelled(&with, steps);
    assert!(without.number("imbalance") > 2.5, "it does not level by itself");
    assert_eq!(without.count("balance.rebalanced"), 0);
    let error = difference(&with, &without);
    assert!(error < 1e-8, "{error:e}");
    // Points as the measure of cost: a repeat is the same bit by bit, migrations included.
    let again = small().results();
    assert_eq!(difference(&with, &again), 0.0);
    for column in ["imbalance", "moved_points", "energy_kinetic", "energy_plastic"] {
        assert_eq!(with.history(column), again.history(column), "{column}");
    }
    // Measured time as the cost: other partitions, the same answer.
    let timed = small().set("parallel.cost=\"time\"").results();
    assert!(timed.count("balance.rebalanced") > 0);
    let error = difference(&with, &timed);
    assert!(error < 1e-8, "{error:e}");
}

/// Of two ranks one holds 3/4 of the points; of three the first holds all of them.
#[test]
fn fewer_ranks_level_themselves_too() {
    let alone = small().ranks(1).results();
    for (ranks, size, start) in
        [(2, "grid.size=[6.0, 2.4]", 1.5), (3, "grid.size=[12.0, 2.4]", 3.0)]
    {
        let run = small().ranks(ranks).set(size);
        let (with, without) = (run.results(), run.set(OFF).results());
        let imbalance = with.history("imbalance");
        assert!((imbalance[0] - start).abs() < 0.03, "{ranks} ranks start at {}", imbalance[0]);
        let later = imbalance[1..].iter().copied().fold(0.0, f64::max);
        assert!(later < 1.1, "{ranks} ranks: {later}");
        assert!(without.number("imbalance") > 0.9 * start, "it does not level by itself");
        for (name, other) in [("without levelling", &without), ("on one rank", &alone)] {
            let error = difference(&with, other);
            assert!(error < 1e-8, "{ranks} ranks and {name}: {error:e}");
        }
    }
}

/// Ghost faces, halos and the corners of CPDI domains are right in the first step after the
/// points have moved: Newton's residuals and the end are those of the run that stays unequal.
#[test]
fn implicit_steps_do_not_notice_a_new_partition() {
    let deck = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/decks/restart.toml");
    let corners = ["method.basis=\"cpdi2\"", "method.domain_update="];
    for method in [&[][..], &corners] {
        let run = |more: &[&str]| {
            let settings = ["analysis.steps=4", "parallel.initial=\"slabs\"", "parallel.brick=1"];
            [&settings[..], method, more]
                .concat()
                .iter()
                .fold(Run::file(deck).ranks(4), |run, word| run.set(*word))
                .results()
        };
        let (with, without) = (run(&[]), run(&[OFF]));
        assert!(with.history("imbalance")[0] > 2.0, "{:?}", with.history("imbalance"));
        assert!(with.number("imbalance") < 1.1, "{:?}", with.history("imbalance"));
        assert!(with.count("balance.rebalanced") > 0);
        assert_eq!(without.count("balance.rebalanced"), 0);
        assert_eq!(with.summary["newton_iterations"], without.summary["newton_iterations"]);
        assert_eq!(with.history("ghost_faces"), without.history("ghost_faces"));
        let error = difference(&with, &without);
        assert!(error < 1e-8, "{method:?}: {error:e}");
    }
}

/// The deck as it is: 500 000 points.
#[test]
#[ignore = "ten minutes or more on two cores: make validate"]
fn half_a_million_points_level_themselves() {
    // Without levelling one run may pass the limit of the others on a busy machine.
    let run = slump(&[]).limit(2 * 3600);
    let with = run.results();
    assert_eq!(with.count("points"), 500_000);
    let steps = with.count("steps_completed");
    assert_levelled(&with, steps);
    let without = run.set(OFF).results();
    let error = difference(&with, &without);
    println!("{steps} steps, end {:.3}, difference {error:e}", with.number("imbalance"));
    assert!(error < 1e-8, "{error:e}");
}
