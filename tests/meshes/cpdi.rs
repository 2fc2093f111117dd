//! CPDI on lattices: Lagrangian §7.1 to 7.5, Tables 4 and 7, and the FEM column of Table 4.

use crate::common::run::{Run, assert_prints};

#[test]
fn the_column_converges() {
    for basis in ["cpdi1", "cpdi2"] {
        let errors = [4, 5, 6, 7, 8].map(|k| {
            let h = 50.0 / f64::from(1 << k);
            Run::of("column")
                .set(format!("method.basis=\"{basis}\""))
                .set(format!("grid.h={h:?}"))
                .set(format!("grid.size=[{h:?}, 50.0]"))
                .results()
                .verify("stress_error")
        });
        let rate = (errors[0] / errors[4]).log2() / 4.0;
        assert!((1.0..=2.0).contains(&rate), "{basis}: {errors:?}");
        assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{basis}: {errors:?}");
    }
}

#[test]
fn simple_shear_is_exact() {
    for basis in ["cpdi1", "cpdi2"] {
        let results = Run::of("shear").set(format!("method.basis=\"{basis}\"")).results();
        for name in ["shear_stress", "normal_stress"] {
            assert!(results.verify(name) < 1e-11, "{basis} {name}");
        }
    }
}

/// Newton evaluations of the beam. Overlaps far below round-off leave rows without meaning, so
/// nodes of tiny weight are dropped.
fn beam(h: f64, drop_below: f64) -> f64 {
    Run::of("beam-lagrangian")
        .set("method.basis=\"cpdi2\"")
        .set("analysis.tolerance=1e-6")
        .set(format!("method.drop_below={drop_below:e}"))
        .set(format!("grid.h={h:?}"))
        .results()
        .number("newton_iterations.total")
}

#[test]
fn the_beam_takes_the_iterations_of_table_4() {
    for (h, drop_below, printed) in [(0.5, 1e-4, 205.0), (0.25, 1e-5, 202.0)] {
        let total = beam(h, drop_below);
        assert!((total / printed - 1.0f64).abs() < 0.02, "h = {h}: {total} {printed}");
    }
}

#[test]
#[ignore = "long: make validate"]
fn the_fine_beam_takes_the_iterations_of_table_4() {
    let total = beam(0.125, 1e-4);
    assert!((total / 202.0 - 1.0).abs() < 0.02, "{total}");
}

fn finite_elements(along: usize) -> f64 {
    let total = Run::of("beam-fem")
        .set(format!("grid.generate.box.cells=[{along}, {}]", along / 10))
        .results()
        .number("newton_iterations.total");
    // The printed numbers leave out the evaluation at zero displacement of each of 50 steps.
    total - 50.0
}

#[test]
fn the_finite_element_beam_takes_the_iterations_of_table_4() {
    assert_eq!([20, 40].map(finite_elements), [157.0, 155.0]);
}

#[test]
#[ignore = "long: make validate"]
fn the_fine_finite_element_beam_takes_the_iterations_of_table_4() {
    assert_eq!(finite_elements(80), 154.0);
}

/// Table 7, column CPDI2: extent 13.780, height 6.292.
#[test]
fn the_collapse_has_the_size_of_table_7() {
    let results =
        Run::of("collapse").set("method.basis=\"cpdi2\"").set("method.drop_below=1e-5").results();
    assert_prints(results.number("bodies.block.extent_max.0"), "13.780");
    // 6.2927 here: the last printed digit seems to be cut off, not rounded.
    let height = results.number("bodies.block.extent_max.1");
    assert!((height - 6.292).abs() < 1e-3, "{height}");
}
