//! The iteration for the consistent mass: one factor over all ranks, so that its length and its
//! result hardly depend on their number.

use super::blocks::blocks;
use crate::common::at_once::at_once;
use crate::common::run::{Run, relative_difference};

/// A block off the grid lines that shakes in all directions, `cells` wide.
fn shaken(dimension: usize, basis: &str, cells: usize) -> Run {
    let (low, high) = (0.13, cells as f64 + 0.13);
    let velocity = ["'3*sin(0.5*X)*cos(0.4*Y)'", "'3*cos(0.45*X)'", "'2*sin(0.5*Z+0.3*X)'"];
    let list = |value: f64| format!("{:?}", vec![value; dimension]);
    let body = format!(
        "name = \"block\"\nshape = {{ box = {{ min = {}, max = {} }} }}\n\
         points_per_cell = {:?}\nvelocity = [{}]",
        list(low),
        list(high),
        vec![2; dimension],
        velocity[..dimension].join(", "),
    );
    let run = blocks(&[&body])
        .set(format!("method.basis=\"{basis}\""))
        .set(format!("grid.size={}", list(cells as f64 + 4.0)))
        .set(format!("grid.origin={}", list(-2.0)))
        .set("ghost.mass_factor=0.25")
        .set("analysis.steps=4")
        .set("analysis.duration=0.004");
    match basis {
        "gimp" => run.set("method.domain_update=\"stretch\""),
        _ => run,
    }
}

#[test]
fn more_ranks_hardly_take_more() {
    at_once([(2, "mpm", 60), (2, "gimp", 60), (3, "mpm", 12)], |(dimension, basis, cells)| {
        let run = shaken(dimension, basis, cells);
        let one = run.results();
        let count = |iterations: &[f64]| iterations.iter().sum::<f64>();
        let alone = count(&one.history("linear_iterations"));
        assert!(alone > 0.0, "{basis} in {dimension}D is iterated, not factored");
        for ranks in [2, 3, 4] {
            let other = run.clone().ranks(ranks).results();
            let together = count(&other.history("linear_iterations"));
            println!("{dimension} {basis} {ranks}: {together} for {alone}");
            assert!(
                together <= 1.6 * alone,
                "{basis} in {dimension}D: {together} on {ranks} ranks, {alone} on one"
            );
            for field in ["displacement", "velocity"] {
                let (a, b) = (one.points(4), other.points(4));
                let difference = relative_difference(b.field(field), a.field(field));
                assert!(difference < 1e-12, "{basis} in {dimension}D: {field} {difference:e}");
            }
        }
    });
}
