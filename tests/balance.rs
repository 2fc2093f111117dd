//! A body that starts on few of the ranks is dealt out, stays dealt out while it flows, and ends
//! as if nothing had been moved.

mod common;
#[path = "common/program.rs"]
mod program;

use std::path::Path;

use program::*;

const SLABS: [&str; 2] = ["--set", "parallel.initial=\"slabs\""];
const FIXED: [&str; 2] = ["--set", "parallel.rebalance_above=0"];

/// Runs `deck` on `ranks` from an uneven start with and without rebalancing, and compares.
fn levelled(ranks: usize, deck: &Path, last: usize, more: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let (even, uneven) = (folder.path().join("even"), folder.path().join("uneven"));
    run_well(ranks, deck, &uneven, &[&SLABS[..], &FIXED, more].concat());
    run_well(ranks, deck, &even, &[&SLABS[..], more].concat());

    let imbalance = column(&even, "imbalance");
    assert!(imbalance[0] > 2.9, "the start is to be uneven: {imbalance:?}");
    assert!(imbalance.last().unwrap() < &1.1, "{imbalance:?}");
    let without = column(&uneven, "imbalance");
    assert!(without.last().unwrap() > &2.0, "it levels by itself: {without:?}");
    let moved = column(&even, "moved_points");
    assert!(moved[0] > 0.4, "{moved:?}");
    let balance = &summary(&even)["balance"];
    assert!(balance["rebalanced"].as_u64().unwrap() >= 1, "{balance}");
    assert!(balance["largest_imbalance"].as_f64().unwrap() > 2.9, "{balance}");
    assert_eq!(summary(&uneven)["balance"]["rebalanced"], 0);

    let ends = [&even, &uneven].map(|out| points_of(&out.join(format!("checkpoint-{last:06}.h5"))));
    let (error, field) = difference(&ends[0], &ends[1]);
    assert!(error < 1e-8, "{field} differs by {error:e}");
}

#[test]
fn a_slump_on_one_of_three_ranks_is_levelled() {
    levelled(3, &deck("balance"), 8, &[]);
}

/// 500 000 points.
#[test]
#[ignore = "long: half a million points"]
fn a_collapse_of_half_a_million_points_is_levelled() {
    // 96 x 72 cells of 72 points a cell: 4 x 3 m of a grid of 12 m.
    let size = [
        "--set",
        "grid.h=0.0416666666666666666",
        "--set",
        "body.0.points_per_cell=[9,8]",
        "--set",
        "analysis.steps=4",
        "--set",
        "output.checkpoint={every=4}",
        "--set",
        "output.every=4",
        "--set",
        "load.0.gravity=[0,-15]",
    ];
    levelled(3, &deck("balance"), 4, &size);
}

/// Points are the default cost: the same partitions and the same bits every time.
#[test]
fn a_levelled_run_repeats_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    let outs = [1, 2].map(|k| folder.path().join(k.to_string()));
    for out in &outs {
        run_well(3, &deck("balance"), out, &SLABS);
    }
    let ends = outs.each_ref().map(|out| points_of(&out.join("checkpoint-000008.h5")));
    assert_eq!(difference(&ends[0], &ends[1]).0, 0.0);
    assert_eq!(history(&outs[0]), history(&outs[1]));
}

/// A restart takes over the partition and what was learnt about it.
#[test]
fn a_restart_of_a_levelled_run_goes_on_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, part) = (folder.path().join("whole"), folder.path().join("part"));
    let plan = [&SLABS[..], &["--set", "output.checkpoint={every=1,keep=9}"]].concat();
    run_well(3, &deck("balance"), &whole, &plan);
    let middle = whole.join("checkpoint-000004.h5").display().to_string();
    run_well(3, &deck("balance"), &part, &[&plan[..], &["--restart", &middle]].concat());
    let ends = [&whole, &part].map(|out| points_of(&out.join("checkpoint-000008.h5")));
    assert_eq!(difference(&ends[0], &ends[1]).0, 0.0);
    assert_eq!(history(&whole)[4..], history(&part)[..]);
    assert_eq!(summary(&whole)["balance"], summary(&part)["balance"]);
}

/// Measured time may place the points anywhere; the results are the same.
#[test]
fn measured_cost_changes_where_points_are_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let (points, time) = (folder.path().join("points"), folder.path().join("time"));
    run_well(3, &deck("balance"), &points, &SLABS);
    run_well(
        3,
        &deck("balance"),
        &time,
        &[&SLABS[..], &["--set", "parallel.cost=\"time\""]].concat(),
    );
    let ends = [&points, &time].map(|out| points_of(&out.join("checkpoint-000008.h5")));
    let (error, field) = difference(&ends[0], &ends[1]);
    assert!(error < 1e-8, "{field} differs by {error:e}");
    assert!(summary(&time)["balance"]["rebalanced"].as_u64().unwrap() >= 1);
}
