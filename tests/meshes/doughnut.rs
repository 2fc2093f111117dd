//! Doughnut twist: Rotation §3.2, Figures 6, 7, 8 and 11.

use crate::axisymmetric;
use crate::common::run::{Results, Run, input};

const MPM: &str = "method.basis=\"mpm\"";
const CPDI1: &str = "method.basis=\"cpdi1\"";
const CPDI2: &str = "method.basis=\"cpdi2\"";
const FEM: &str = "method.control=\"fem\"";
/// Nodes along theta = 0 that are free to move.
const INNER: std::ops::Range<usize> = 1..10;

/// Displacement of the sampling points of `doughnut-10.toml` after 10 degrees, from R = 5 to 10.
fn radius(results: &Results) -> Vec<[f64; 2]> {
    radius_after(results, 2)
}

fn radius_after(results: &Results, step: usize) -> Vec<[f64; 2]> {
    let points = results.points(step);
    let u = points.field("displacement");
    let rows: Vec<[f64; 2]> = u.chunks_exact(3).map(|row| [row[0], row[1]]).collect();
    // The body "radius" comes second, so its identities are the largest.
    rows[rows.len() - 11..].to_vec()
}

fn small(method: &str) -> Run {
    Run::of("doughnut-10").set(method)
}

fn sizes(u: &[[f64; 2]]) -> Vec<f64> {
    u.iter().map(|u| u[0].hypot(u[1])).collect()
}

/// Relative difference of the displacement's magnitude at each free node along the radius.
fn differences(found: &[[f64; 2]], control: &[[f64; 2]]) -> Vec<f64> {
    let (found, control) = (sizes(found), sizes(control));
    INNER.map(|k| (found[k] / control[k] - 1.0).abs()).collect()
}

/// Largest difference of the magnitude along the radius over the prescribed displacement.
fn of_prescribed(found: &[[f64; 2]], control: &[[f64; 2]]) -> f64 {
    let (found, control) = (sizes(found), sizes(control));
    largest(&INNER.map(|k| (found[k] - control[k]).abs() / control[0]).collect::<Vec<_>>())
}

fn denser(per_cell: usize) -> Run {
    small(MPM).set(format!("body.0.points_per_cell=[{per_cell}, {per_cell}]"))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Bounds printed in the paper.
const MPM_PRINTED: f64 = 5e-4;
const CPDI1_PRINTED: f64 = 0.05;
const CPDI2_PRINTED: f64 = 0.01;

/// cpdi1 and cpdi2 stay below their printed bounds at every node. `mpm` does at every node as a
/// fraction of the prescribed displacement, and in the mean relative to each node's own
/// displacement; at single nodes that exceeds the bound, by less than the mesh is off (8.5e-4).
fn assert_figure_6(control: &[[f64; 2]]) {
    let found = radius(&small(MPM).results());
    let mpm = differences(&found, control);
    assert!(mean(&mpm) < MPM_PRINTED && largest(&mpm) < 7e-4, "{mpm:?}");
    assert!(of_prescribed(&found, control) < MPM_PRINTED, "{found:?} {control:?}");
    let against = |method: &str| differences(&radius(&small(method).results()), control);
    let cpdi2 = against(CPDI2);
    assert!(largest(&cpdi2) < CPDI2_PRINTED, "{cpdi2:?}");
    let cpdi1 = against(CPDI1);
    assert!(largest(&cpdi1) < CPDI1_PRINTED, "{cpdi1:?}");
}

#[test]
fn ten_degrees_agree_with_finite_elements_on_the_same_mesh() {
    let control = radius(&small(FEM).results());
    assert_figure_6(&control);
    for per_cell in [3, 4, 6] {
        let more = differences(&radius(&denser(per_cell).results()), &control);
        assert!(largest(&more) < MPM_PRINTED, "{per_cell} x {per_cell} points: {more:?}");
    }
}

/// Before points have crossed cells, after 5 of the 10 degrees, all nodes are within the bound.
#[test]
fn five_degrees_agree_at_every_node() {
    let exact = axisymmetric::displacement(5.0, 400);
    let five = |method| {
        let run = small(method).set("analysis.steps=1").set("boundary.1.rotation.degrees=-5");
        radius_after(&run.results(), 1)
    };
    let mpm = differences(&five(MPM), &exact);
    assert!(largest(&mpm) < MPM_PRINTED, "{mpm:?}");
    let mesh = differences(&five(FEM), &exact);
    assert!(largest(&mesh) < MPM_PRINTED, "{mesh:?}");
}

#[test]
#[ignore = "long: make validate"]
fn ten_degrees_agree_with_fine_finite_elements() {
    let control = radius(&fine(160, 1e-6).results());
    assert_figure_6(&control);
    for per_cell in [3, 4, 6, 10] {
        let more = of_prescribed(&radius(&denser(per_cell).results()), &control);
        assert!(more < MPM_PRINTED, "{per_cell} x {per_cell} points: {more:e}");
    }
    let coarse = differences(&radius(&small(FEM).results()), &control);
    assert!(largest(&coarse) < 1e-3, "{coarse:?}");
}

/// A finite element control whose sampling points have the area `area`, m2.
fn fine(radial: usize, area: f64) -> Run {
    let text = std::fs::read_to_string(input("doughnut-10")).expect("a deck of this project");
    // A body of points each: what a deck can say of its sampling points is their file.
    let folder = std::env::temp_dir().join(format!("radius-{radial}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a scratch folder");
    let csv = folder.join("radius.csv");
    let rows: Vec<String> =
        (0..=10).map(|k| format!("{},0,{area:e}", 5.0 + 0.5 * f64::from(k))).collect();
    std::fs::write(&csv, format!("x,y,volume\n{}\n", rows.join("\n"))).expect("writable");
    let text = text.replace("doughnut-radius.csv", &csv.display().to_string());
    Run::text(&text)
        .set(FEM)
        .set(format!("grid.generate.annulus.radial={radial}"))
        .set(format!("grid.generate.annulus.around={}", radial / 5 * 36))
}

/// Sampling points add stiffness of their own: an area a over a cell of size h shifts the
/// displacement there by about a strain / h, 1.6e-5 at 160 rings with the paper's 1 mm squares.
/// Without it the fine control follows the second order of the coarser ones: 8.6e-4 / 16^2.
#[test]
#[ignore = "long: make validate"]
fn the_fine_control_has_the_error_of_its_mesh() {
    let exact = axisymmetric::displacement(10.0, 400);
    let error = |radial| largest(&differences(&radius(&fine(radial, 1e-12).results()), &exact));
    let errors = [10, 20, 40, 80, 160].map(error);
    for pair in errors.windows(2) {
        assert!(((pair[0] / pair[1]).log2() - 2.0).abs() < 0.025, "{errors:?}");
    }
    assert!(errors[4] < 3.6e-6, "{errors:?}");
    let heavy = largest(&differences(&radius(&fine(160, 1e-6).results()), &exact));
    assert!((5e-6..2e-5).contains(&heavy), "{heavy:e}");
}

/// The coarse control converges at second order to the axisymmetric solution.
#[test]
fn finite_elements_converge_to_the_axisymmetric_solution() {
    let exact = axisymmetric::displacement(10.0, 400);
    let errors = [(10, 72), (20, 144), (40, 288)].map(|(radial, around)| {
        let fem = small(FEM)
            .set(format!("grid.generate.annulus.radial={radial}"))
            .set(format!("grid.generate.annulus.around={around}"));
        largest(&differences(&radius(&fem.results()), &exact))
    });
    assert!(errors[0] < 1e-3, "{errors:?}");
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((1.9..2.1).contains(&order), "{errors:?}");
    }
}

/// A history column at whole steps only, over `scale`.
fn at_steps(results: &Results, name: &str, scale: f64) -> Vec<f64> {
    let factors = results.history("load_factor");
    let values = results.history(name);
    let whole = |factor: f64| (16.0 * factor - (16.0 * factor).round()).abs() < 1e-9;
    let rows = factors.iter().zip(values).filter(|(factor, _)| whole(**factor));
    rows.map(|(_, value)| value.abs() / scale).collect()
}

/// Reaction of Figure 8 after each 5 degrees: sum of nodal forces over C E.
fn reaction(method: &str) -> Vec<f64> {
    let results = Run::of("doughnut").set(method).set("output.every=100").results();
    let series = at_steps(&results, "reaction.inner.sum_abs", 10.0 * std::f64::consts::PI * 1e6);
    assert_eq!(series.len(), 16, "{method}");
    series
}

/// Largest deviation from the mean, relative.
fn unevenness(values: &[f64]) -> f64 {
    let middle = mean(values);
    largest(&values.iter().map(|v| (v / middle - 1.0).abs()).collect::<Vec<_>>())
}

#[test]
fn eighty_degrees_look_like_figure_8() {
    let [mpm, cpdi1, cpdi2, fem] = [MPM, CPDI1, CPDI2, FEM].map(reaction);
    // Elastic: nearly the same.
    for step in 0..4 {
        for other in [&mpm, &cpdi1, &cpdi2] {
            assert!((other[step] / fem[step] - 1.0).abs() < 0.05, "step {}", step + 1);
        }
    }
    let peak = |series: &[f64]| largest(&series[..9]);
    assert!(peak(&mpm) > 1.1 * peak(&cpdi1), "mpm has the larger peak");
    assert!((peak(&cpdi1) / peak(&cpdi2) - 1.0).abs() < 0.02);
    // Beyond 50 degrees mpm and cpdi1 keep their reaction.
    for series in [&mpm, &cpdi1] {
        assert!(unevenness(&series[9..]) < 0.08, "{series:?}");
        assert!(mean(&series[9..]) < 0.75 * peak(series), "{series:?}");
    }
    // cpdi2 rises again, finite elements never stop rising.
    assert!(cpdi2[15] > 1.3 * cpdi2[9] && cpdi2[15] < 0.5 * fem[15], "{cpdi2:?}");
    assert!(fem.windows(2).all(|pair| pair[1] > pair[0]), "{fem:?}");
    assert!(fem[15] > 2.0 * fem[7], "{fem:?}");
}

/// Torque over C E, C the circumference of the ellipse.
fn torque(method: &str) -> Vec<f64> {
    let results = Run::of("ellipse").set(method).set("output.every=100").results();
    let series = at_steps(&results, "reaction.inner.torque", 31.73e6);
    assert_eq!(series.len(), 16, "{method}");
    series
}

#[test]
fn the_elliptic_hole_looks_like_figure_11() {
    let [mpm, cpdi1, cpdi2, fem] = [MPM, CPDI1, CPDI2, FEM].map(torque);
    for step in 0..3 {
        for other in [&mpm, &cpdi1, &cpdi2] {
            assert!((other[step] / fem[step] - 1.0).abs() < 0.05, "step {}", step + 1);
        }
    }
    for series in [&mpm, &cpdi1] {
        assert!(unevenness(&series[11..]) < 0.05, "a level after 60 degrees: {series:?}");
        assert!(series[15] < 0.8 * largest(series), "{series:?}");
    }
    let lowest = cpdi2[8..].iter().copied().fold(f64::INFINITY, f64::min);
    assert!(cpdi2[15] > 1.1 * lowest && cpdi2[15] > 1.2 * cpdi1[15], "{cpdi2:?}");
    assert!(fem.windows(2).all(|pair| pair[1] > pair[0]), "{fem:?}");
}
