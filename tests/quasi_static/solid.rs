//! Three dimensions: one cell thick is plane strain, and what only space can show.

use crate::beam::assert_quadratic;
use crate::common::run::{PointTable, Results, Run};

/// Rows of both tables keyed by initial place in the plane (and in depth, for the solid).
fn places(points: &PointTable) -> Vec<[f64; 3]> {
    let (x, u) = (points.field("position"), points.field("displacement"));
    let start = |row: usize, c: usize| x[3 * row + c] - u[3 * row + c];
    (0..points.id.len()).map(|row| [0, 1, 2].map(|c| start(row, c))).collect()
}

/// Every point of the solid moves and is stressed as the plane one with the same place.
#[track_caller]
fn assert_equal_in_the_plane(solid: &Results, plane: &Results, step: usize, length: f64) {
    let (solid, plane) = (solid.points(step), plane.points(step));
    let (solid_places, plane_places) = (places(&solid), places(&plane));
    assert!(solid_places.len().is_multiple_of(plane_places.len()));
    let largest = plane.field("stress").iter().fold(0.0f64, |m, v| m.max(v.abs()));
    for (row, place) in solid_places.iter().enumerate() {
        let same = |other: &&[f64; 3]| (0..2).all(|c| (other[c] - place[c]).abs() < 1e-6);
        let twin = plane_places.iter().position(|other| same(&other)).expect("a plane twin");
        for c in 0..3 {
            let moved = solid.field("displacement")[3 * row + c];
            let exact = if c < 2 { plane.field("displacement")[3 * twin + c] } else { 0.0 };
            assert!((moved - exact).abs() < 1e-8 * length, "{place:?}: {moved} {exact}");
        }
        for c in 0..6 {
            let (here, there) =
                (solid.field("stress")[6 * row + c], plane.field("stress")[6 * twin + c]);
            assert!((here - there).abs() < 1e-8 * largest, "{place:?} [{c}]: {here} {there}");
        }
    }
}

#[test]
fn column_one_cell_thick_is_plane_strain() {
    let (solid, plane) = (Run::of("column-3d").results(), Run::of("column").results());
    assert_equal_in_the_plane(&solid, &plane, 20, 50.0);
    let [a, b] = [&solid, &plane].map(|run| run.verify("stress_error"));
    assert!((a - b).abs() < 1e-8 * b, "{a} {b}");
}

#[test]
fn shear_one_cell_thick_is_plane_strain() {
    let (solid, plane) = (Run::of("shear-3d").results(), Run::of("shear").results());
    assert_equal_in_the_plane(&solid, &plane, 30, 6.0);
    for name in ["shear_stress", "normal_stress"] {
        assert!(solid.verify(name) < 1e-11);
    }
}

#[test]
fn beam_one_cell_thick_is_plane_strain() {
    let tight = |deck: &str| {
        Run::of(deck).set("analysis.tolerance=1e-12").set("analysis.steps=20").results()
    };
    let solid = tight("beam-3d");
    let plane = Run::of("beam")
        .set("grid.h=0.5")
        .set("analysis.tolerance=1e-12")
        .set("analysis.steps=20")
        .set("output.every=10")
        .results();
    assert_equal_in_the_plane(&solid, &plane, 20, 10.0);
    // The published totals, in space.
    assert_eq!(Run::of("beam-3d").results().count("newton_iterations.total"), 204);
}

/// A square bar twisted by 90 degrees in nine steps.
#[test]
fn twisted_bar_converges_quadratically() {
    let results = Run::of("twist").results();
    for step in 1..=9 {
        assert_quadratic(&results.residuals(step), step);
    }
    // Saint-Venant: G J theta / L with J = 0.1406 a^4, on this coarse grid from above.
    let thin = 1e6 / 2.6 * 0.1406 * (10f64.to_radians() / 3.0);
    let torque = results.history("reaction.head.torque");
    assert!((1.0..1.15).contains(&(torque[0] / thin)), "{} N m for {thin}", torque[0]);
    let foot = results.history("reaction.foot.torque");
    assert!((foot[8] / torque[8] + 1.0).abs() < 0.02, "{} {}", foot[8], torque[8]);
    // Four-fold symmetry: no net side force. Lengthening is held: the bar pulls at its ends.
    let side = results.history("reaction.head.x")[8].abs();
    assert!(side < 1e-6 * torque[8], "{side}");
}

#[test]
fn block_collapse_converges_quadratically() {
    let results = Run::of("cube-collapse").set("analysis.tolerance=1e-11").results();
    for step in 1..=20 {
        assert_quadratic(&results.residuals(step), step);
    }
    let [x, y] = [0, 1].map(|a| results.number(&format!("bodies.block.extent_max.{a}")));
    assert!((x - y).abs() < 1e-8 && x > 4.2, "{x} {y}");
    let plastic = results.history("energy_plastic");
    assert!(plastic.windows(2).all(|pair| pair[1] >= pair[0]) && plastic[19] > 0.0);
    // Loads do work, the block stores a part of it and dissipates another.
    let (work, strain) = (results.history("work_external"), results.history("energy_strain"));
    let share = (strain[19] + plastic[19]) / work[19];
    assert!((0.9..1.1).contains(&share), "{share}");
}
