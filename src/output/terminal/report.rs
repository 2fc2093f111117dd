//! The text of the terminal: banner, plan, closing table, failure. Data in, text out.

use std::fmt::Write as _;
use std::path::PathBuf;

use crate::output::summary::{Status, Summary};

/// What is known before a deck is read.
#[derive(Debug, Clone, Default)]
pub struct Banner {
    pub version: String,
    pub ranks: usize,
    /// Library and version: `("PETSc", "3.18.5")`.
    pub libraries: Vec<(String, String)>,
}

pub fn banner(banner: &Banner) -> String {
    let libraries: Vec<_> =
        banner.libraries.iter().map(|(name, version)| format!("{name} {version}")).collect();
    format!(
        "mpm-par {}: material point method on {}\n{}",
        banner.version,
        count(banner.ranks, "rank"),
        libraries.join(", ")
    )
}

/// The problem, and how it is dealt out.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    pub title: String,
    /// Pairs of a word and its meaning, in order: `("analysis", "quasi-static, 50 steps")`.
    pub facts: Vec<(String, String)>,
    /// Figures that point at a slip.
    pub warnings: Vec<String>,
    pub points: usize,
    pub cells_populated: usize,
    pub active_nodes: usize,
    pub equations: usize,
    /// Points of each rank.
    pub points_per_rank: Vec<usize>,
    /// Largest cost of a rank over the mean.
    pub imbalance: f64,
    /// Bytes, of all ranks.
    pub estimated_memory: Option<u64>,
    /// Bytes, of all result files.
    pub estimated_output: Option<u64>,
}

pub fn plan(plan: &Plan) -> String {
    let mut rows = plan.facts.clone();
    let mut row = |name: &str, value: String| rows.push((name.into(), value));
    row(
        "problem",
        format!(
            "{} in {}, {} active, {}",
            count(plan.points, "point"),
            count(plan.cells_populated, "cell"),
            count(plan.active_nodes, "node"),
            count(plan.equations, "equation")
        ),
    );
    let least = plan.points_per_rank.iter().min().copied().unwrap_or(0);
    let most = plan.points_per_rank.iter().max().copied().unwrap_or(0);
    let empty = plan.points_per_rank.iter().filter(|&&points| points == 0).count();
    let mut partition = format!(
        "{}, {least} to {most} points each, imbalance {:.2}",
        count(plan.points_per_rank.len(), "rank"),
        plan.imbalance
    );
    if empty > 0 {
        let _ = write!(partition, ", {} without points", count(empty, "rank"));
    }
    row("partition", partition);
    if let Some(memory) = plan.estimated_memory {
        row("memory", format!("about {} in all", bytes(memory)));
    }
    if let Some(output) = plan.estimated_output {
        row("output", format!("about {} in all", bytes(output)));
    }
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let mut text = format!("\n{}\n", plan.title);
    for (name, value) in &rows {
        let _ = writeln!(text, "  {name:width$}  {value}");
    }
    text
}

/// A run that goes on from a checkpoint.
pub fn restart(path: &std::path::Path, step: usize, wrote: usize, ranks: usize) -> String {
    let how = if wrote == ranks {
        "the same as now: the run goes on bit by bit".to_string()
    } else {
        format!("now {ranks}: dealt out anew")
    };
    format!(
        "restart: from {} after step {step}, written by {}, {how}",
        path.display(),
        count(wrote, "rank")
    )
}

/// Where the time went, what it took, where the results are.
pub fn closing(summary: &Summary, results: &std::path::Path) -> String {
    let seconds = &summary.wall_seconds;
    let mut rows: Vec<(&str, f64)> = seconds.phases().to_vec();
    rows.sort_by(|a, b| b.1.total_cmp(&a.1));
    let other = seconds.total - rows.iter().map(|row| row.1).sum::<f64>();
    rows.push(("other", other.max(0.0)));
    rows.push(("total", seconds.total));

    let mut text = format!("\n{:<12}{:>10}{:>8}\n", "phase", "time [s]", "share");
    for (name, time) in rows {
        let share = if seconds.total > 0.0 { 100.0 * time / seconds.total } else { 0.0 };
        let _ = writeln!(text, "{name:<12}{time:>10.3}{share:>6.1} %");
    }
    let outcome = match summary.status {
        Status::Completed => "completed",
        Status::Stopped => "stopped",
        Status::Failed => "failed",
    };
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<20}{value}");
    };
    row("", String::new());
    row("steps", format!("{} of {} ({outcome})", summary.steps_completed, summary.steps_requested));
    for (name, iterations) in [
        ("newton iterations", summary.newton_iterations),
        ("linear iterations", summary.linear_iterations),
    ] {
        if iterations.total > 0 {
            row(name, format!("{} (at most {} in a step)", iterations.total, iterations.max));
        }
    }
    row("imbalance", format!("{:.2} (largest cost of a rank over the mean)", summary.imbalance));
    let balance = summary.balance;
    if balance.rebalanced > 0 {
        row(
            "rebalanced",
            format!(
                "{} times, {:.0} % of the points moved for it, imbalance at most {:.2}",
                balance.rebalanced,
                100.0 * balance.moved_share,
                balance.largest_imbalance
            ),
        );
    }
    let memory = summary.peak_memory_bytes;
    row("peak memory", format!("{} ({} on one rank)", bytes(memory.sum), bytes(memory.max)));
    for (name, value) in &summary.verify {
        row("verify", format!("{name} = {value:.6e}"));
    }
    for warning in &summary.warnings {
        row("warning", warning.clone());
    }
    row("results", results.display().to_string());
    // The row without a name is the empty line between the tables.
    text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

/// A run that could not go on.
#[derive(Debug, Clone, Default)]
pub struct Failure {
    /// What went wrong, in one sentence.
    pub what: String,
    pub step: Option<usize>,
    /// The last step whose results are complete.
    pub last_good_step: Option<usize>,
    pub point: Option<FailedPoint>,
    pub advice: Vec<String>,
    pub results: Option<PathBuf>,
}

/// Where it went wrong.
#[derive(Debug, Clone, Default)]
pub struct FailedPoint {
    pub id: u64,
    pub position: Vec<f64>,
    pub body: String,
    pub model: String,
}

pub fn failure(failure: &Failure) -> String {
    let mut text = format!("{}\n", failure.what);
    if let Some(step) = failure.step {
        let _ = write!(text, "  where: step {step}");
        if let Some(point) = &failure.point {
            let position: Vec<_> = point.position.iter().map(|x| format!("{x:.6}")).collect();
            let _ = write!(
                text,
                ", point {} of body `{}` ({}) at ({}) m",
                point.id,
                point.body,
                point.model,
                position.join(", ")
            );
        }
        text.push('\n');
    }
    for advice in &failure.advice {
        let _ = writeln!(text, "    try: {advice}");
    }
    if let Some(results) = &failure.results {
        let good = match failure.last_good_step {
            Some(step) => format!(", good up to step {step}"),
            None => String::new(),
        };
        let _ = writeln!(text, "results: {}{good}", results.display());
    }
    text
}

/// `1 rank`, `12 ranks`.
fn count(number: usize, word: &str) -> String {
    let ending = if number == 1 { "" } else { "s" };
    format!("{number} {word}{ending}")
}

/// `1.5 GB`, in steps of 1000.
pub fn bytes(number: u64) -> String {
    let units = ["kB", "MB", "GB", "TB"];
    if number < 1000 {
        return format!("{number} B");
    }
    let mut value = number as f64 / 1000.0;
    let mut unit = 0;
    while value >= 999.95 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    format!("{value:.1} {}", units[unit])
}

/// `0.25 s`, `12.0 s`, `1m30s`, `2h05m`, `3d04h`.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match seconds {
        s if s < 9.995 => format!("{s:.2} s"),
        s if s < 59.95 => format!("{s:.1} s"),
        _ if whole < 3600 => format!("{}m{:02}s", whole / 60, whole % 60),
        _ if whole < 86400 => format!("{}h{:02}m", whole / 3600, whole % 3600 / 60),
        _ => format!("{}d{:02}h", whole / 86400, whole % 86400 / 3600),
    }
}

/// A number with four figures and an exponent of two: `1.250e-02`.
pub fn fixed_width(value: f64) -> String {
    let text = format!("{value:.3e}");
    match text.split_once('e') {
        Some((digits, exponent)) => {
            let (sign, figures) = match exponent.strip_prefix('-') {
                Some(figures) => ('-', figures),
                None => ('+', exponent),
            };
            format!("{digits}e{sign}{figures:0>2}")
        }
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::output::summary::{Count, PeakMemory, PhaseSeconds};

    #[test]
    fn the_plan_names_empty_ranks() {
        let text = plan(&Plan {
            title: "Beam".into(),
            facts: vec![("analysis".into(), "quasi-static, 50 steps".into())],
            warnings: Vec::new(),
            points: 80,
            cells_populated: 20,
            active_nodes: 33,
            equations: 66,
            points_per_rank: vec![44, 36, 0],
            imbalance: 1.65,
            estimated_memory: Some(1_500_000),
            estimated_output: None,
        });
        assert_eq!(
            text,
            "\nBeam\n  analysis   quasi-static, 50 steps\n  \
             problem    80 points in 20 cells, 33 nodes active, 66 equations\n  \
             partition  3 ranks, 0 to 44 points each, imbalance 1.65, 1 rank without points\n  \
             memory     about 1.5 MB in all\n"
        );
    }

    #[test]
    fn the_closing_table_adds_up() {
        let summary = Summary {
            status: Status::Completed,
            steps_completed: 50,
            steps_requested: 50,
            newton_iterations: Count { total: 203, max: 6 },
            wall_seconds: PhaseSeconds {
                total: 2.0,
                assemble: 0.5,
                solve: 1.0,
                output: 0.25,
                ..Default::default()
            },
            peak_memory_bytes: PeakMemory { max: 60_000_000, sum: 110_000_000 },
            imbalance: 1.1,
            ..Default::default()
        };
        assert_eq!(
            closing(&summary, Path::new("out/beam")),
            "
phase         time [s]   share
solve            1.000  50.0 %
assemble         0.500  25.0 %
output           0.250  12.5 %
setup            0.000   0.0 %
locate           0.000   0.0 %
update           0.000   0.0 %
migrate          0.000   0.0 %
other            0.250  12.5 %
total            2.000 100.0 %

steps               50 of 50 (completed)
newton iterations   203 (at most 6 in a step)
imbalance           1.10 (largest cost of a rank over the mean)
peak memory         110.0 MB (60.0 MB on one rank)
results             out/beam
"
        );
    }

    #[test]
    fn a_failure_says_what_where_and_what_to_try() {
        let text = failure(&Failure {
            what: "the point is inverted (det F = -0.1)".into(),
            step: Some(7),
            last_good_step: Some(6),
            point: Some(FailedPoint {
                id: 12,
                position: vec![1.0, 2.5],
                body: "beam".into(),
                model: "hencky".into(),
            }),
            advice: vec!["more steps".into(), "analysis.on_failure = \"cut\"".into()],
            results: Some("out/beam".into()),
        });
        assert_eq!(
            text,
            "the point is inverted (det F = -0.1)
  where: step 7, point 12 of body `beam` (hencky) at (1.000000, 2.500000) m
    try: more steps
    try: analysis.on_failure = \"cut\"
results: out/beam, good up to step 6
"
        );
    }

    #[test]
    fn sizes_and_times() {
        assert_eq!(
            [999, 1000, 999_949, 999_950].map(bytes),
            ["999 B", "1.0 kB", "999.9 kB", "1.0 MB"]
        );
        let times = [0.25, 9.999, 90.0, 3599.4, 7500.0, 273_600.0];
        assert_eq!(times.map(duration), ["0.25 s", "10.0 s", "1m30s", "59m59s", "2h05m", "3d04h"]);
        assert_eq!([0.0125, 1e100, 0.0].map(fixed_width), ["1.250e-02", "1.000e+100", "0.000e+00"]);
        assert_eq!(
            banner(&Banner {
                version: "0.1.0".into(),
                ranks: 1,
                libraries: vec![("PETSc".into(), "3.18.5".into())]
            }),
            "mpm-par 0.1.0: material point method on 1 rank\nPETSc 3.18.5"
        );
    }
}
