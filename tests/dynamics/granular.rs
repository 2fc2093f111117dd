//! Columns of grains that collapse: run-out and energies of inputs/column-collapse.toml.

use crate::common::run::{Results, Run};

/// End of the last centimetre in which the deposit is as thick as a cell of 1 cm, m; the points have
/// 2.5e-5 m2 each.
fn front(results: &Results) -> f64 {
    let points = results.points(results.count("steps_completed"));
    let mut counts = vec![0usize; 100];
    for x in points.component("position", 0) {
        counts[(x / 0.01) as usize] += 1;
    }
    let thick = |count: usize| count as f64 * 2.5e-5 / 0.01 >= 0.01 - 1e-12;
    let last = counts.iter().rposition(|&count| thick(count)).expect("a deposit");
    0.01 * (last + 1) as f64
}

fn collapses(run: Run) {
    let results = run.results();
    let front = front(&results);
    assert!((front / 0.22 - 1.0).abs() < 0.1, "the front rests at {front} m");
    let column = |name: &str| results.history(name);
    let work = column("work_external");
    let sums = ["energy_kinetic", "energy_strain", "energy_plastic", "energy_ghost"].map(column);
    let last = work.len() - 1;
    let held: f64 = sums.iter().map(|sum| sum[last]).sum();
    assert!((held / work[last] - 1.0).abs() < 1e-2, "{held} J of {}", work[last]);
    // At rest, but for single grains.
    assert!(sums[0][last] < 0.03 * work[last]);
}

#[test]
fn a_column_of_sand_runs_out_as_measured() {
    collapses(Run::of("column-collapse"));
}

#[test]
#[ignore = "half a minute"]
fn a_column_of_drucker_prager_sand_runs_out_as_measured() {
    collapses(Run::of("column-collapse").set("material.sand.model=\"drucker-prager\""));
}
