//! Elasto-plastic collapse: Lagrangian §7.5 (Tables 6, 7, 8).

use crate::common::run::{Results, Run, assert_prints};
use crate::common::validation::record;

/// Lagrangian Table 6: points per cell and axis, then (extent, height) for h = 2, 1, 0.5, 0.25.
const TABLE_6: [(usize, [(&str, &str); 4]); 3] = [
    (3, [("13.343", "6.357"), ("13.662", "6.245"), ("13.731", "6.245"), ("13.787", "6.234")]),
    (6, [("13.359", "6.437"), ("13.735", "6.277"), ("13.797", "6.251"), ("13.847", "6.231")]),
    (9, [("13.380", "6.452"), ("13.750", "6.289"), ("13.812", "6.255"), ("13.863", "6.226")]),
];
const SPACINGS: [f64; 4] = [2.0, 1.0, 0.5, 0.25];

fn extents(results: &Results) -> [f64; 2] {
    [0, 1].map(|axis| results.number(&format!("bodies.block.extent_max.{axis}")))
}

/// With four decimals, as the papers' program displays numbers. One of the 24 shows it: 6.24446
/// is printed as 6.245, which it is by way of 6.2445.
fn displayed(x: f64) -> f64 {
    (x * 1e4).round() / 1e4
}

/// Asserts the numbers; returns rows of the table to print.
fn check_table_6(grids: &[usize]) -> Vec<Vec<String>> {
    let mut table = Vec::new();
    for (per_cell, row) in TABLE_6 {
        for &g in grids {
            let h = SPACINGS[g];
            let results = Run::of("collapse")
                .set(format!("grid.h={h:?}"))
                .set(format!("body.0.points_per_cell=[{per_cell},{per_cell}]"))
                .set("output.every=1000")
                .results();
            let [extent, height] = extents(&results);
            assert_prints(displayed(extent), row[g].0);
            assert_prints(displayed(height), row[g].1);
            table.push(vec![
                format!("{per_cell} x {per_cell}"),
                format!("{h}"),
                format!("{} / {}", row[g].0, row[g].1),
                format!("{extent:.4} / {height:.4}"),
            ]);
        }
    }
    table
}

#[test]
fn lagrangian_table_6_coarse_grids() {
    check_table_6(&[0, 1]);
}

#[test]
#[ignore = "long: make validate"]
fn lagrangian_table_6() {
    let table = check_table_6(&[0, 1, 2, 3]);
    let header = ["points per cell", "h [m]", "printed extent / height [m]", "here"];
    record("lagrangian-6", &header, &table);
}

fn gimp(update: &str, volume: &str) -> Results {
    Run::of("collapse-gimp")
        .set(format!("method.domain_update=\"{update}\""))
        .set(format!("method.point_volume=\"{volume}\""))
        .set("output.every=1000")
        .results()
}

/// Update, printed extent and height, and those of the volume det F V0 where they are others.
type Row7 = (&'static str, [&'static str; 2], Option<[f64; 2]>);

const TABLE_7: [Row7; 6] = [
    ("det", ["13.645", "6.316"], None),
    ("normal-corrected", ["13.769", "6.257"], None),
    ("normal-incremental", ["13.769", "6.257"], None),
    ("corners", ["13.769", "6.392"], None),
    ("normal", ["14.415", "5.546"], Some([13.7674, 6.2459])),
    ("stretch", ["13.425", "6.441"], Some([13.7727, 6.2562])),
];

/// The height with `corners` hangs on which small overlaps count, and so on round-off: it is about
/// `by_corners`, found from 6.187 to 6.268 with the volumes of the domains and from 6.252 to 6.316
/// with det F V0. The extent, printed 13.769, is found from 13.76843 to 13.76852.
#[track_caller]
fn assert_printed(update: &str, values: [f64; 2], printed: [&str; 2], by_corners: f64) {
    if update == "corners" {
        assert!((values[0] - 13.7685).abs() < 1e-3, "{values:?}");
        assert!((values[1] - by_corners).abs() < 0.08, "{values:?}");
    } else {
        assert_prints(values[0], printed[0]);
        assert_prints(values[1], printed[1]);
    }
}

#[test]
fn lagrangian_table_7() {
    let mut table = Vec::new();
    for (update, printed, other) in TABLE_7 {
        let [domain, deformation] =
            ["domain", "deformation"].map(|volume| extents(&gimp(update, volume)));
        assert_printed(update, domain, printed, 6.25);
        match other {
            None => assert_printed(update, deformation, printed, 6.277),
            Some(other) => (0..2).for_each(|i| {
                assert!((deformation[i] - other[i]).abs() < 1e-3, "{update}: {deformation:?}");
            }),
        }
        let pair = |[extent, height]: [f64; 2]| format!("{extent:.4} / {height:.4}");
        table.push(vec![
            update.to_string(),
            printed.join(" / "),
            pair(domain),
            pair(deformation),
            if update == "corners" { "extent".into() } else { "yes".into() },
        ]);
    }
    let header = [
        "update",
        "printed extent / height [m]",
        "volume of the domain",
        "volume det F V0",
        "reproduced",
    ];
    record("lagrangian-7", &header, &table);
}

/// Lagrangian Table 8: residuals of steps 10, 20, 30, 40.
const TABLE_8: [(usize, &[&str]); 4] = [
    (10, &["2.656e0", "2.697e-4", "1.626e-9"]),
    (20, &["2.794e0", "3.088e-2", "2.410e-2", "2.568e-3", "3.910e-5", "6.949e-10"]),
    (30, &["2.701e0", "2.380e-2", "4.626e-2", "6.193e-3", "2.225e-4", "1.356e-7"]),
    (40, &["2.410e0", "1.759e-2", "3.049e-2", "5.156e-3", "1.497e-4", "1.944e-7"]),
];

#[test]
fn lagrangian_table_8() {
    let results = gimp("normal-corrected", "deformation");
    assert_eq!(results.count("newton_iterations.total"), 225);
    let mut table = Vec::new();
    for ((step, printed), evaluations) in TABLE_8.iter().zip([4, 6, 7, 7]) {
        let residuals = results.residuals(*step);
        assert_eq!(residuals.len(), evaluations, "step {step}");
        for (i, (residual, printed)) in residuals.iter().zip(*printed).enumerate() {
            assert_prints(*residual, printed);
            let here = format!("{residual:.3e}");
            table.push(vec![step.to_string(), i.to_string(), printed.to_string(), here]);
        }
        // What the table shows beyond this is round-off (6.1e-15, 6.7e-14, 3.2e-13).
        for rest in &residuals[printed.len()..] {
            assert!(*rest < 1e-12, "step {step}: {residuals:?}");
        }
    }
    record("lagrangian-8", &["step", "iteration", "printed", "here"], &table);
}
