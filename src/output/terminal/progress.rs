//! Lines for steps: where the run is, how the solver did, how fast it is, how long it will still take.

use super::log::Log;
use super::report::{duration, fixed_width};

/// Shortest time between two lines that stay on a terminal, s.
const LINE_EVERY: f64 = 1.0;
/// Shortest time between two changes of the line that moves, s.
const CHANGE_EVERY: f64 = 0.05;

/// A finished step.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepReport {
    pub step: usize,
    /// Steps of the whole analysis, if it is known.
    pub steps: Option<usize>,
    /// Share of the analysis that is done, 0 to 1.
    pub share: f64,
    /// s, in dynamics
    pub time: Option<f64>,
    /// `None` in explicit dynamics.
    pub newton: Option<NewtonReport>,
    /// s since the start of the run.
    pub elapsed: f64,
    /// The last one, or one that ends the run.
    pub last: bool,
}

/// How the solution of a step went.
#[derive(Debug, Clone, Copy, Default)]
pub struct NewtonReport {
    pub iterations: usize,
    pub residual: f64,
    pub linear_iterations: usize,
    /// Times that this step was halved.
    pub cuts: usize,
}

/// Which steps have a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Interval {
    Steps(usize),
    /// s of wall time
    Seconds(f64),
}

/// Prints the steps at an interval, the first and the last one in any case; on a terminal no more
/// than a reader can follow.
#[derive(Debug)]
pub struct Progress {
    interval: Interval,
    /// s at the last step with a line.
    last_due: Option<f64>,
    started: Option<(f64, f64)>,
    last_line: Option<f64>,
    last_change: f64,
    /// Step and s of the last line anywhere.
    last_report: Option<(usize, f64)>,
    headed: bool,
}

impl Progress {
    /// `share` and `elapsed` (s) of the run at the first step: not zero after a restart.
    pub fn new(interval: Interval, share: f64, elapsed: f64) -> Self {
        Self {
            interval,
            last_due: None,
            started: Some((share, elapsed)),
            last_line: None,
            last_change: 0.0,
            last_report: None,
            headed: false,
        }
    }

    /// Whether the step has a line in the log.
    fn due(&self, report: &StepReport) -> bool {
        let Some(last) = self.last_due else { return true };
        report.last
            || match self.interval {
                Interval::Steps(steps) => report.step.is_multiple_of(steps.max(1)),
                Interval::Seconds(seconds) => report.elapsed - last >= seconds,
            }
    }

    pub fn step(&mut self, log: &mut Log, report: &StepReport) {
        if !std::mem::replace(&mut self.headed, true) {
            log.say(&heading(report));
        }
        let line = line(report, self.rate(report), self.left(report));
        let due = self.due(report);
        if due {
            log.note(&line);
            self.last_due = Some(report.elapsed);
            self.last_report = Some((report.step, report.elapsed));
        }
        let quiet_for = report.elapsed - self.last_line.unwrap_or(f64::NEG_INFINITY);
        if due && (!log.on_terminal() || quiet_for >= LINE_EVERY || report.last) {
            log.show(&line);
            self.last_line = Some(report.elapsed);
            self.last_change = report.elapsed;
        } else if log.on_terminal() && report.elapsed - self.last_change >= CHANGE_EVERY {
            log.show_briefly(&line);
            self.last_change = report.elapsed;
        }
    }

    /// Steps a second since the last line of the log.
    fn rate(&self, report: &StepReport) -> Option<f64> {
        let start = self.started.map_or(0.0, |(_, elapsed)| elapsed);
        let (step, elapsed) = self.last_report.unwrap_or((report.step.saturating_sub(1), start));
        let rate = report.step.saturating_sub(step) as f64 / (report.elapsed - elapsed);
        (rate.is_finite() && rate > 0.0).then_some(rate)
    }

    /// Seconds to go, if the rest is like the part done so far.
    fn left(&self, report: &StepReport) -> Option<f64> {
        let (share, elapsed) = self.started.unwrap_or_default();
        let done = report.share - share;
        let left = (1.0 - report.share) * (report.elapsed - elapsed) / done;
        (done > 0.0 && left.is_finite()).then_some(left.max(0.0))
    }
}

fn heading(report: &StepReport) -> String {
    let place = if report.time.is_some() { "   time [s]" } else { "       load" };
    let solver = if report.newton.is_some() { "  newton   residual  linear" } else { "" };
    format!("\n{:>13}{place}{solver}   steps/s   elapsed      left", "step")
}

/// Three digits of a rate.
fn three_digits(rate: f64) -> String {
    match rate {
        rate if rate >= 99.95 => format!("{rate:.0}"),
        rate if rate >= 9.995 => format!("{rate:.1}"),
        rate if rate >= 0.01 => format!("{rate:.2}"),
        rate => format!("{rate:.1e}"),
    }
}

fn line(report: &StepReport, rate: Option<f64>, left: Option<f64>) -> String {
    let step = match report.steps {
        Some(steps) => format!("{}/{steps}", report.step),
        None => report.step.to_string(),
    };
    let place = match report.time {
        Some(time) => fixed_width(time),
        None => format!("{:.4}", report.share),
    };
    let mut line = format!("{step:>13}{place:>11}");
    if let Some(newton) = &report.newton {
        line += &format!(
            "{:>8}{:>11}{:>8}",
            newton.iterations,
            format!("{:.2e}", newton.residual),
            newton.linear_iterations
        );
    }
    line += &format!("{:>10}", rate.map_or("-".into(), three_digits));
    line += &format!("{:>10}{:>10}", duration(report.elapsed), left.map_or("-".into(), duration));
    match report.newton.map_or(0, |newton| newton.cuts) {
        0 => {}
        1 => line += "  (cut once)",
        cuts => line += &format!("  (cut {cuts} times)"),
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_stand_under_the_heading() {
        let newton =
            NewtonReport { iterations: 4, residual: 3.21e-10, linear_iterations: 57, cuts: 2 };
        let report = StepReport {
            step: 5,
            steps: Some(50),
            share: 0.1,
            time: None,
            newton: Some(newton),
            elapsed: 12.0,
            last: false,
        };
        let left = Progress::new(Interval::Steps(1), 0.0, 2.0).left(&report);
        assert_eq!(left, Some(90.0), "10 s for a tenth");
        assert_eq!(
            format!("{}\n{}", heading(&report), line(&report, Some(0.4567), left)),
            "\n         step       load  newton   residual  linear   steps/s   elapsed      left\n         \
             5/50     0.1000       4   3.21e-10      57      0.46    12.0 s     1m30s  (cut 2 times)"
        );
        let report = StepReport { time: Some(0.0125), newton: None, steps: None, ..report };
        assert_eq!(
            format!("{}\n{}", heading(&report), line(&report, None, None)),
            "\n         step   time [s]   steps/s   elapsed      left\n            \
             5  1.250e-02         -    12.0 s         -"
        );
        assert_eq!(
            [1234.4, 99.9, 9.99, 0.5, 0.00123].map(three_digits),
            ["1234", "99.9", "9.99", "0.50", "1.2e-3"]
        );
    }

    #[test]
    fn the_rate_is_that_since_the_last_line() {
        let mut progress = Progress::new(Interval::Steps(1), 0.0, 2.0);
        let report = StepReport { step: 11, elapsed: 2.25, ..Default::default() };
        assert_eq!(progress.rate(&report), Some(4.0), "one step since the start");
        progress.last_report = Some((11, 2.25));
        let report = StepReport { step: 21, elapsed: 3.25, ..Default::default() };
        assert_eq!(progress.rate(&report), Some(10.0));
        progress.last_report = Some((21, 3.25));
        assert_eq!(progress.rate(&report), None, "no time has passed");
    }

    #[test]
    fn a_restart_does_not_count_what_others_did() {
        let report = StepReport { share: 0.6, elapsed: 30.0, ..Default::default() };
        // a tenth took 20 s, four are left
        let left = Progress::new(Interval::Steps(1), 0.5, 10.0).left(&report).unwrap();
        approx::assert_relative_eq!(left, 80.0, max_relative = 1e-12);
        assert_eq!(Progress::new(Interval::Steps(1), 0.6, 30.0).left(&report), None);
    }

    #[test]
    fn the_interval_bounds_the_lines() {
        // Steps of 1/64 s, which are exact.
        let lines = |interval| {
            let (mut progress, mut due) = (Progress::new(interval, 0.0, 0.0), Vec::new());
            for step in 1..=200 {
                let elapsed = step as f64 / 64.0;
                let report = StepReport { step, elapsed, last: step == 200, ..Default::default() };
                if progress.due(&report) {
                    due.push(step);
                    progress.last_due = Some(elapsed);
                }
            }
            due
        };
        assert_eq!(lines(Interval::Seconds(1.0)), [1, 65, 129, 193, 200]);
        assert_eq!(lines(Interval::Steps(90)), [1, 90, 180, 200]);
        assert_eq!(lines(Interval::Steps(1)).len(), 200);
    }
}
