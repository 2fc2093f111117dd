//! Ghost §2.6, 3.5 and 5.1.1: condition numbers while bodies move through the grid.

use super::ghosts::{COARSE, FINE, MEDIUM, Resolution};
use crate::common::run::{Results, Run};

/// Largest value of a column while the load factor is below `end`.
pub fn largest(run: &Results, column: &str, end: f64) -> f64 {
    run.history("load_factor")
        .iter()
        .zip(run.history(column))
        .filter(|(factor, _)| **factor < end)
        .map(|(_, value)| value)
        .fold(0.0, f64::max)
}

pub fn domain(basis: &str) -> Results {
    Run::of(&format!("translating-domain-{basis}")).results()
}

pub fn ghost(resolution: &Resolution, steps: usize) -> Run {
    resolution
        .seed(Run::of("translating-ghost"), 1)
        .set(format!("analysis.steps={steps}"))
        .set("output.every=100000")
}

#[track_caller]
fn assert_near(value: f64, printed: f64) {
    assert!((value / printed - 1.0).abs() < 0.01, "{value} {printed}");
}

#[test]
fn table_1_of_mpm() {
    let run = domain("mpm");
    assert_near(largest(&run, "kappa_mass_ghost", 2.0), 153.0);
    assert_near(largest(&run, "kappa_stiffness", 0.875), 47.2);
    assert_near(largest(&run, "kappa_stiffness_ghost", 0.875), 42.2);
    assert!(largest(&run, "kappa_mass", 2.0) > 1.0 / f64::EPSILON);
    // Beyond a/h = 7/4 nothing holds the body along x.
    assert!(largest(&run, "kappa_stiffness_ghost", 2.0) > 1e12);
}

#[test]
fn table_1_of_gimp() {
    let run = domain("gimp");
    assert_near(largest(&run, "kappa_mass_ghost", 2.0), 163.0);
    assert_near(largest(&run, "kappa_stiffness_ghost", 2.0), 166.0);
    assert!(largest(&run, "kappa_mass", 2.0) > 1.0 / f64::EPSILON);
    assert!(largest(&run, "kappa_stiffness", 2.0) > 1.0 / f64::EPSILON);
}

#[test]
fn figure_7_the_limit_of_the_stabilised_body_hardly_depends_on_its_place() {
    for basis in ["mpm", "gimp"] {
        let run = domain(basis);
        let extent = |column: &str| {
            let values = run.history(column);
            let (low, high) = (0.0f64, f64::INFINITY);
            values.iter().fold((high, low), |(a, b), &v| (a.min(v), b.max(v)))
        };
        let (low, high) = extent("cfl_ghost");
        assert!(low > 0.6 * high, "{basis}: {low} {high}");
        let (low, high) = extent("cfl");
        assert!(low < 1e-6 * high, "{basis}: {low} {high}");
    }
}

/// Numbers are the same wherever the matrix rows live, and by Lanczos' method.
#[test]
fn ranks_agree_on_the_spectra() {
    let deck = |ranks: usize| {
        ghost(&COARSE, 4).set("conditioning.displacement=[0.05, 0.05]").ranks(ranks).results()
    };
    let one = deck(1);
    for ranks in [2, 3, 4] {
        let other = deck(ranks);
        for column in ["kappa_mass_ghost", "kappa_mass_lumped", "cfl_ghost"] {
            for (a, b) in one.history(column).iter().zip(other.history(column)) {
                assert!((a / b - 1.0).abs() < 1e-8, "{column} on {ranks} ranks: {a} {b}");
            }
        }
        let errors = other.history("velocity_error_ghost");
        assert!(errors.iter().all(|error| *error < 1e-11), "{ranks} ranks: {errors:?}");
    }
}

#[test]
fn large_matrices_are_estimated() {
    // Just above the size of the dense path, and the same with a looser grid below it.
    let deck = |h: &str| {
        let run = ghost(&COARSE, 1).set("conditioning.displacement=[0.01, 0.0]");
        run.set(format!("grid.h={h}")).set("method.basis=\"mpm\"").results()
    };
    let fine = deck("0.0125");
    assert!(fine.count("cells_populated") > 600);
    let kappa = fine.history("kappa_mass_ghost")[0];
    let coarse = deck("0.025").history("kappa_mass_ghost")[0];
    assert!(kappa > 0.1 * coarse && kappa < 10.0 * coarse, "{kappa} {coarse}");
}

fn assert_figure_10(resolution: &Resolution, steps: usize) {
    let run = ghost(resolution, steps).results();
    let errors = run.history("velocity_error_ghost");
    assert_eq!(errors.len(), steps);
    assert!(errors.iter().all(|error| *error < 1e-11));
    let unstabilised = run.history("velocity_error").into_iter().fold(0.0, f64::max);
    assert!(unstabilised > 1e-6, "{unstabilised}");
}

#[test]
fn figure_10_at_some_positions() {
    assert_figure_10(&COARSE, 50);
}

#[test]
#[ignore = "a minute"]
fn figure_10_at_all_positions() {
    assert_figure_10(&COARSE, 1000);
}

#[test]
#[ignore = "minutes"]
fn table_2() {
    for (resolution, printed) in [(COARSE, 4.33e5), (MEDIUM, 3.12e5), (FINE, 2.97e5)] {
        let kappa = largest(&ghost(&resolution, 1000).results(), "kappa_mass_ghost", 2.0);
        assert!(kappa > printed / 2.0 && kappa < printed * 2.0, "{kappa} {printed}");
    }
    let at = |factor: &str| {
        let run = ghost(&COARSE, 100).set(format!("ghost.mass_factor={factor}"));
        largest(&run.results(), "kappa_mass_ghost", 2.0)
    };
    let ratio = at("0.025") / at("0.25");
    assert!((9.0..11.0).contains(&ratio), "{ratio}");
}
