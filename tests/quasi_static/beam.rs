//! Cantilever with a large rotation: Lagrangian §7.3 (Tables 3, 4), Ghost §5.5 (Table 5).

use crate::common::run::{Results, Run, assert_prints};
use crate::common::validation::record;

fn beam(deck: &str, h: f64, per_cell: usize) -> Run {
    Run::of(deck)
        .set(format!("grid.h={h:?}"))
        .set(format!("body.0.points_per_cell=[{per_cell},{per_cell}]"))
        .set("output.every=1000")
}

/// As in the tables of evaluations: tolerance 1e-6.
fn unstabilised(h: f64, per_cell: usize) -> Run {
    beam("beam-lagrangian", h, per_cell).set("analysis.tolerance=1e-6")
}

/// Ghost Table 5, stabilised: Newton evaluations for 2 x 2 ... 6 x 6 points.
const TABLE_5: [(f64, [usize; 5]); 3] = [
    (0.5, [205, 204, 204, 204, 204]),
    (0.25, [203, 204, 204, 203, 204]),
    (0.125, [205, 203, 201, 202, 202]),
];

/// Unstabilised entries that fail whatever the round-off: (h, points per cell and axis).
const FAILURES: [(f64, usize); 6] =
    [(0.5, 2), (0.5, 4), (0.5, 6), (0.25, 2), (0.125, 2), (0.125, 3)];

/// Asserts the totals; returns rows of the table to print.
fn check_table_5(rows: &[(f64, [usize; 5])]) -> Vec<Vec<String>> {
    let mut table = Vec::new();
    for (h, printed) in rows {
        for (per_cell, printed) in (2..).zip(printed) {
            let results = beam("beam", *h, per_cell).results();
            let total = results.count("newton_iterations.total");
            assert_eq!(total, *printed, "h = {h}, {per_cell} x {per_cell}");
            assert!(results.count("newton_iterations.max") <= 6);
            table.push(vec![
                format!("{h}"),
                format!("{per_cell} x {per_cell}"),
                printed.to_string(),
                total.to_string(),
            ]);
        }
    }
    table
}

#[test]
fn ghost_table_5_coarse_and_medium_grids() {
    check_table_5(&TABLE_5[..2]);
}

#[test]
#[ignore = "long: make validate"]
fn ghost_table_5() {
    let table = check_table_5(&TABLE_5);
    record("ghost-5", &["h [m]", "points per cell", "printed", "here"], &table);
}

#[test]
fn without_ghost_the_robust_failures_fail() {
    let mut table = Vec::new();
    for (h, per_cell) in FAILURES {
        let outcome = unstabilised(h, per_cell)
            .set("method.domain_update=\"stretch\"")
            .set("analysis.max_iterations=10")
            .attempt();
        assert_eq!(outcome.code, 1, "h = {h}, {per_cell} x {per_cell}: {}", outcome.stdout);
        let results = outcome.results();
        assert_eq!(results.summary["status"], "stopped");
        let last = results.count("steps_completed");
        assert!(last < 50 && results.history("step").len() == last);
        table.push(vec![format!("{h}"), format!("{per_cell} x {per_cell}"), last.to_string()]);
    }
    record("ghost-5-failures", &["h [m]", "points per cell", "last step here"], &table);
}

/// Lagrangian Table 4: (h, mpm evaluations, the printed count).
#[test]
fn lagrangian_table_4() {
    let mut table = Vec::new();
    for (h, printed, gimp_printed) in [(0.5, 210, 214), (0.25, 210, 218), (0.125, 215, 227)] {
        let total = |run: Run| run.results().count("newton_iterations.total");
        let mpm = total(unstabilised(h, 6).set("method.basis=\"mpm\""));
        assert!(mpm.abs_diff(printed) <= 2, "mpm, h = {h}: {mpm} evaluations, printed {printed}");
        let update = if h == 0.5 { "stretch" } else { "normal-corrected" };
        let gimp = unstabilised(h, 6).set(format!("method.domain_update=\"{update}\"")).attempt();
        let done = gimp.code == 0;
        // On the finest grid small overlaps decide, and so round-off, whether the run comes to its end.
        assert!(done || h == 0.125, "gimp, h = {h}: {}", gimp.stderr);
        let gimp = gimp.results();
        let evaluations = gimp.count("newton_iterations.total");
        // The paper does not state its update; the count moves with it.
        assert!(!done || (200..=230).contains(&evaluations), "gimp, h = {h}: {evaluations}");
        let gimp = match done {
            true => evaluations.to_string(),
            false => format!("ends after step {}", gimp.count("steps_completed")),
        };
        table.push(
            [h].iter()
                .map(f64::to_string)
                .chain([
                    printed.to_string(),
                    mpm.to_string(),
                    gimp_printed.to_string(),
                    format!("{gimp} ({update})"),
                ])
                .collect(),
        );
    }
    let header = ["h [m]", "mpm printed", "mpm here", "gimp printed", "gimp here"];
    record("lagrangian-4", &header, &table);
}

/// Lagrangian Table 3, normal-corrected domains, tolerance 1e-9.
#[test]
fn lagrangian_table_3() {
    let results = Run::of("beam-lagrangian").set("output.every=1000").results();
    let printed = [
        (10, vec!["1.622e1", "1.242e-1", "2.436e-4", "5.524e-5", "1.470e-10"]),
        (20, vec!["1.107e1", "1.699e-2", "1.366e-5", "3.660e-7", "9.912e-15"]),
        (40, vec!["8.740e0", "1.731e-3", "2.890e-6", "1.131e-10"]),
        (49, vec!["6.774e0", "1.509e-3", "1.072e-5", "1.089e-9", "3.250e-15"]),
        (50, vec!["6.901e0", "9.246e-4", "2.112e-6", "5.012e-11"]),
    ];
    let mut table = Vec::new();
    for (step, column) in &printed {
        let residuals = results.residuals(*step);
        for (iteration, printed) in column.iter().enumerate() {
            table.push(vec![
                step.to_string(),
                iteration.to_string(),
                printed.to_string(),
                residuals.get(iteration).map_or("-".into(), |r| format!("{r:.3e}")),
            ]);
        }
    }
    record("lagrangian-3", &["step", "iteration", "printed", "here"], &table);

    let step_10 = results.residuals(10);
    assert_eq!(step_10.len(), 5);
    for (residual, printed) in step_10.iter().zip(&printed[0].1[..3]) {
        assert_prints(*residual, printed);
    }
    // The two smallest hang on the fourth digit of everything before.
    assert!((step_10[3] / 5.524e-5 - 1.0).abs() < 1e-3, "{:e}", step_10[3]);
    assert!((step_10[4] / 1.470e-10 - 1.0).abs() < 3e-3, "{:e}", step_10[4]);
    let step_20 = results.residuals(20);
    for (residual, printed) in step_20.iter().zip([1.107e1, 1.699e-2, 1.366e-5, 3.660e-7]) {
        assert!((residual / printed - 1.0).abs() < 0.03, "{residual:e}, printed {printed:e}");
    }
    // Quadratic at the end of the steps: the order from the last three residuals, unless the last
    // one is round-off. In step 28 one node has so little weight that round-off decides how the
    // step ends.
    for step in (2..=50).filter(|&step| step != 28) {
        assert_quadratic(&results.residuals(step), step);
    }
    for (residual, found) in results.residuals(28).iter().zip([1.1005e1, 6.014e-3, 4.820e-5]) {
        assert!((residual / found - 1.0).abs() < 1e-3, "{residual:e}, found {found:e}");
    }
}

/// Step 20 of Table 3 with no node left out. Later steps are not asked for: in step 28 one node has so
/// little weight that round-off decides whether Newton's method ends there.
#[test]
fn with_no_node_left_out_step_20_comes_nearer_to_table_3() {
    let run = Run::of("beam-lagrangian").set("method.drop_below=0.0").set("output.every=1000");
    let residuals = run.attempt().results().residuals(20);
    for (residual, printed) in residuals.iter().zip([1.107e1, 1.699e-2, 1.366e-5, 3.660e-7]) {
        assert!((residual / printed - 1.0).abs() < 0.007, "{residual:e}, printed {printed:e}");
    }
}

/// The last drop squares the one before, within a generous factor.
#[track_caller]
pub fn assert_quadratic(residuals: &[f64], step: usize) {
    let [.., before, last] = residuals else { panic!("step {step}: {residuals:?}") };
    assert!(
        *last < 1e-12 || *last < 100.0 * before * before || before / last > 1e3,
        "step {step}: {residuals:?}"
    );
}

/// Lagrangian Figure 15 b: with `normal` domains, which turn and shrink, and their volumes the run
/// fails beyond step 19.
#[test]
fn domains_that_shrink_as_they_turn_fail_beyond_step_19() {
    let run = beam("beam-lagrangian", 0.5, 6)
        .set("method.domain_update=\"normal\"")
        .set("method.point_volume=\"domain\"");
    let outcome = run.attempt();
    assert_eq!(outcome.code, 1, "{}", outcome.stderr);
    assert!(outcome.stderr.contains("the last finished step is 19"), "{}", outcome.stderr);
}

/// Tip displacement over the length (down-ward and inward): mean over the last sections of
/// points, carried on to the end face. The loaded points themselves sink in.
fn tip(results: &Results, step: usize) -> [f64; 2] {
    let points = results.points(step);
    let column = |field: &str, c| points.component(field, c);
    let (x, ux, uy) = (column("position", 0), column("displacement", 0), column("displacement", 1));
    let initial: Vec<f64> = x.iter().zip(&ux).map(|(x, u)| x - u).collect();
    let last = initial.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let spacing = 2.0 * (10.0 - last);
    let section = |place: f64| {
        let members = || (0..x.len()).filter(|&p| (initial[p] - place).abs() < 0.1 * spacing);
        let mean = |u: &[f64]| members().map(|p| u[p]).sum::<f64>() / members().count() as f64;
        [mean(&ux), mean(&uy)]
    };
    let (end, before) = (section(last), section(last - spacing));
    [0, 1].map(|c| -(end[c] + 0.5 * (end[c] - before[c])) / 10.0)
}

/// Inextensible elastica of a cantilever under a dead end load: theta'' = -a cos(theta) over
/// unit length, theta(0) = 0, theta'(1) = 0; returns the tip's movement inward and sideways.
fn elastica(a: f64) -> [f64; 2] {
    let shoot = |curvature: f64| {
        let steps = 2000;
        let ds = 1.0 / f64::from(steps);
        let slope = |s: [f64; 4]| [s[1], -a * s[0].cos(), s[0].cos(), s[0].sin()];
        let ahead = |s: [f64; 4], k: [f64; 4], d: f64| std::array::from_fn(|i| s[i] + d * k[i]);
        let mut s = [0.0, curvature, 0.0, 0.0];
        for _ in 0..steps {
            let k1 = slope(s);
            let k2 = slope(ahead(s, k1, 0.5 * ds));
            let k3 = slope(ahead(s, k2, 0.5 * ds));
            let k4 = slope(ahead(s, k3, ds));
            s = std::array::from_fn(|i| s[i] + ds / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        }
        s
    };
    let (mut low, mut high) = (0.0, a + 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if shoot(middle)[1] > 0.0 { high = middle } else { low = middle }
    }
    let end = shoot(low);
    [1.0 - end[2], end[3]]
}

#[test]
fn tip_converges_near_the_elastica() {
    // P L^2 / (E' I) with E' = E / (1 - nu^2), I = 1/12; known: a = 1 gives 0.3017 sideways.
    assert!((elastica(1.0)[1] - 0.3017).abs() < 1e-4);
    let exact = elastica(100e3 * 100.0 / (12e6 / 0.96 / 12.0));
    let tips = [0.5, 0.25, 0.125].map(|h| tip(&beam("beam", h, 4).results(), 50));
    for c in 0..2 {
        // The elastica neither stretches nor shears: 0.8 % and more of the length.
        assert!((tips[2][c] / exact[c] - 1.0).abs() < 0.03, "{tips:?}, elastica {exact:?}");
        let steps = [tips[1][c] - tips[0][c], tips[2][c] - tips[1][c]];
        assert!(steps[1].abs() < 0.6 * steps[0].abs(), "{tips:?}");
    }
    let row = |name: &str, tip: [f64; 2]| {
        vec![name.to_string(), format!("{:.4}", tip[0]), format!("{:.4}", tip[1])]
    };
    record(
        "beam-tip",
        &["", "inward / L", "downward / L"],
        &[
            row("elastica", exact),
            row("h = 0.5", tips[0]),
            row("h = 0.25", tips[1]),
            row("h = 0.125", tips[2]),
        ],
    );
}
