//! Column under its own weight: Lagrangian §7.1 (Figure 7, 8), Ghost §5.4 (Table 4).

use crate::common::run::Run;
use crate::common::validation::record;

/// The deck on a grid of 2^k cells, one cell wide.
fn column(deck: &str, k: u32) -> Run {
    let h = 50.0 / f64::from(1u32 << k);
    Run::of(deck)
        .set(format!("grid.h={h:?}"))
        .set(format!("grid.size=[{h:?},50.0]"))
        .set("output.every=1000")
}

fn gimp(update: &str, k: u32) -> Run {
    column("column", k).set(format!("method.domain_update=\"{update}\""))
}

fn gimp_error(update: &str, k: u32) -> f64 {
    gimp(update, k).results().verify("stress_error")
}

fn mpm_error(per_cell: usize, k: u32) -> f64 {
    column("column", k)
        .set("method.basis=\"mpm\"")
        .set(format!("body.0.points_per_cell=[2,{per_cell}]"))
        .results()
        .verify("stress_error")
}

/// Falls between the first and the last grid at a mean rate between 1 and 2, and on each grid.
#[track_caller]
fn assert_converges(errors: &[f64], halvings: u32) {
    let rate = (errors[0] / errors[errors.len() - 1]).log2() / f64::from(halvings);
    assert!((1.0..=2.0).contains(&rate), "rate {rate}: {errors:?}");
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
}

#[test]
fn sound_domain_updates_converge_to_the_finest_grid() {
    let errors: Vec<f64> = (2..=9).map(|k| gimp_error("normal", k)).collect();
    assert_converges(&errors, 7);
    let row = |k: usize| vec![format!("50/2^{}", k + 2), format!("{:.3e}", errors[k])];
    record("column", &["h [m]", "error (eq. 42)"], &(0..8).map(row).collect::<Vec<_>>());
    // In a one-dimensional state the three updates are the same thing.
    for update in ["stretch", "corners"] {
        for (k, error) in [(5, errors[3]), (9, errors[7])] {
            let other = gimp_error(update, k);
            assert!((other / error - 1.0).abs() < 1e-6, "{update}, 2^{k} cells: {other} {error}");
        }
    }
}

#[test]
fn domains_that_ignore_or_spread_the_compression_stop_converging() {
    let errors = |update| [7, 8, 9].map(|k| gimp_error(update, k));
    let sound = gimp_error("normal", 9);
    let (none, det) = (errors("none"), errors("det"));
    // No update stagnates first, and on a higher level.
    assert!(none[2] > 0.98 * none[1] && none[1] > 0.98 * none[0], "{none:?}");
    assert!(det[2] > 0.98 * det[1], "{det:?}");
    assert!(det[2] > 10.0 * sound && none[2] > 1.5 * det[2], "{none:?} {det:?} {sound}");
}

/// Lagrangian Figure 7: with the volumes of the domains `none` fails to converge beyond the third
/// analysis and `det` beyond the sixth, the first being that of 2^2 cells.
#[test]
fn domains_that_are_volumes_stop_converging_where_the_paper_says() {
    for (update, last) in [("none", 4), ("det", 7)] {
        let errors: Vec<f64> = (2..=9)
            .map(|k| {
                let run = gimp(update, k).set("method.point_volume=\"domain\"");
                run.results().verify("stress_error")
            })
            .collect();
        for (pair, k) in errors.windows(2).zip(3..) {
            let rate = (pair[0] / pair[1]).log2();
            assert_eq!(rate > 0.7, k <= last, "{update}, 2^{k} cells: rate {rate}, {errors:?}");
        }
    }
}

#[test]
fn standard_points_need_many_to_converge() {
    let few: Vec<f64> = [4, 5, 6, 7].map(|k| mpm_error(2, k)).to_vec();
    assert!(few.windows(2).all(|pair| pair[1] > 0.97 * pair[0]), "{few:?}");
    let many: Vec<f64> = [3, 4, 5].map(|k| mpm_error(64, k)).to_vec();
    assert_converges(&many, 2);
    assert!(many[2] < few[1] / 4.0, "{many:?} {few:?}");
}

/// Figure 8: E = 10 kPa, h = 1.5625 m.
#[test]
fn soft_column_halves_and_converges() {
    let soft = |k| column("column", k).set("material.soil.young=10e3").results();
    let run = soft(5);
    let top = run.number("bodies.column.extent_max.1");
    assert!((top - 24.04).abs() < 5e-3, "top at {top}");
    let errors = vec![
        run.verify("stress_error"),
        soft(7).verify("stress_error"),
        soft(9).verify("stress_error"),
    ];
    // The paper's rate refers to 1 MPa; here the last grids fall with h.
    let rate = (errors[0] / errors[2]).log2() / 4.0;
    assert!((0.95..=2.0).contains(&rate), "{errors:?}");
}

/// Ghost Table 4: (gamma_K / E, printed at h = 50/2^5, at 50/2^9).
const TABLE_4: [(&str, f64, f64); 5] = [
    ("1e-6", 1.049e-3, 4.938e-5),
    ("1e-3", 1.042e-3, 4.938e-5),
    ("1.0", 8.912e-4, 4.938e-5),
    ("1e3", 1.208e-3, 4.926e-5),
    ("1e6", 1.210e-3, 4.962e-5),
];

#[test]
fn ghost_table_4() {
    let mut table = Vec::new();
    for (factor, coarse, fine) in TABLE_4 {
        for (k, printed) in [(5, coarse), (9, fine)] {
            let run = column("column-ghost", k).set(format!("ghost.stiffness_factor={factor}"));
            let error = run.results().verify("stress_error");
            let off = (error / printed - 1.0).abs();
            assert!(
                off < 3e-3,
                "gamma_K = {factor} E, h = 50/2^{k}: {error:e}, printed {printed:e}"
            );
            table.push(vec![
                factor.to_string(),
                format!("50/2^{k}"),
                format!("{printed:.3e}"),
                format!("{error:.4e}"),
            ]);
        }
    }
    record("ghost-4", &["gamma_K / E", "h [m]", "printed", "here"], &table);
}

/// The default scale of the Ghost matrix leaves the accuracy of the fine grid alone as well.
#[test]
fn scale_free_ghost_keeps_the_error() {
    let error = |scaling: &str, k| {
        column("column-ghost", k)
            .set(format!("ghost.scaling=\"{scaling}\""))
            .results()
            .verify("stress_error")
    };
    for k in [5, 7] {
        let ratio = error("scale-free", k) / error("published", k);
        assert!((0.5..1.5).contains(&ratio), "{ratio}");
    }
}
