//! `summary.json`: the outcome of a run in one small file, written whether it succeeds or fails.

use std::collections::BTreeMap;

use mpi::topology::SimpleCommunicator;
use serde::Serialize;

use super::agreement::on_root;
use super::directory::{ResultsDirectory, SUMMARY};
use super::whole_file::write_whole;
use crate::error::{Error, Result};
use crate::parallel::World;
use crate::parallel::balance::BalanceReport;
use crate::parallel::traffic::Traffic;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    Completed,
    /// Ended early in good order: a signal, or a deck that says stop.
    Stopped,
    #[default]
    Failed,
}

/// Everything in the file, in its order.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Summary {
    pub title: String,
    pub status: Status,
    /// Why it stopped or failed; empty if it completed.
    pub reason: String,
    pub steps_completed: usize,
    pub steps_requested: usize,
    pub newton_iterations: Count,
    pub linear_iterations: Count,
    pub points: usize,
    pub cells_populated: usize,
    pub ranks: usize,
    pub wall_seconds: PhaseSeconds,
    pub peak_memory_bytes: PeakMemory,
    /// Largest cost of a rank over the mean, at the end.
    pub imbalance: f64,
    pub balance: BalanceReport,
    pub communication: Communication,
    /// Figures of merit of the deck's `[[verify]]`.
    pub verify: BTreeMap<String, f64>,
    pub bodies: BTreeMap<String, BodySummary>,
    /// Of a strength reduction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strength_factor: Option<f64>,
    /// Of a deck that names stages, in their order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stages: Vec<StageSummary>,
    pub versions: BTreeMap<String, String>,
    /// What the user should know of a run that went on, in the order of the first times.
    pub warnings: Vec<String>,
}

/// How far a stage has come.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct StageSummary {
    pub name: String,
    /// Nominal steps finished.
    pub steps_completed: usize,
    /// The stage is over.
    pub completed: bool,
}

/// Over the run, and in the worst step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Count {
    pub total: usize,
    pub max: usize,
}

impl Count {
    /// Counts one more step.
    pub fn add(&mut self, iterations: usize) {
        self.total += iterations;
        self.max = self.max.max(iterations);
    }
}

/// What a rank sends in a step, on average over the steps of this process, set-up not counted.
/// Without the linear solvers, which keep their own counts (`-log_view`).
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Communication {
    /// Messages of the busiest rank, and of the average one.
    pub messages_max: f64,
    pub messages_mean: f64,
    /// The same in bytes.
    pub bytes_max: f64,
    pub bytes_mean: f64,
    /// Reductions, scans, broadcasts and barriers, equal on all ranks.
    pub reductions: f64,
    /// Bytes that every rank holds for the whole grid: the table of owners, and on a mesh its
    /// adjacency.
    pub replicated_bytes: usize,
}

impl Communication {
    /// What the ranks sent in `steps` steps, and what each holds of the whole. Collective.
    pub fn of(world: &World, traffic: Traffic, steps: usize, replicated_bytes: usize) -> Self {
        let per_step = 1.0 / steps.max(1) as f64;
        let own = [traffic.messages as f64 * per_step, traffic.bytes as f64 * per_step];
        let (largest, sum) = (world.max_slice(&own), world.sum_slice(&own));
        let mean = |k: usize| sum[k] / world.size() as f64;
        Communication {
            messages_max: largest[0],
            messages_mean: mean(0),
            bytes_max: largest[1],
            bytes_mean: mean(1),
            reductions: traffic.reductions as f64 * per_step,
            replicated_bytes,
        }
    }
}

/// Wall time by phase, s: the largest of all ranks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct PhaseSeconds {
    pub total: f64,
    pub setup: f64,
    pub locate: f64,
    pub assemble: f64,
    pub solve: f64,
    pub update: f64,
    pub migrate: f64,
    pub output: f64,
}

impl PhaseSeconds {
    /// Name and time of each phase, without the total.
    pub fn phases(&self) -> [(&'static str, f64); 7] {
        [
            ("setup", self.setup),
            ("locate", self.locate),
            ("assemble", self.assemble),
            ("solve", self.solve),
            ("update", self.update),
            ("migrate", self.migrate),
            ("output", self.output),
        ]
    }
}

/// Largest resident size so far, bytes: of one rank, and of all ranks together.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct PeakMemory {
    pub max: u64,
    pub sum: u64,
}

/// Where a body is. Vectors have the dimension of the problem.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct BodySummary {
    /// Over the point positions, m.
    pub min: Vec<f64>,
    pub max: Vec<f64>,
    /// Over the positions -/+ the half lengths l_p, m.
    pub extent_min: Vec<f64>,
    pub extent_max: Vec<f64>,
    /// kg
    pub mass: f64,
    /// m3, current
    pub volume: f64,
}

impl Summary {
    /// Replaces `summary.json`. Numbers that are not finite become `null`.
    pub fn write(&self, directory: &ResultsDirectory, comm: &SimpleCommunicator) -> Result<()> {
        on_root(comm, || self.write_here(directory))
    }

    /// The same without a word to other ranks: for a rank that ends the run because of a failure
    /// that the others do not know of.
    pub fn write_here(&self, directory: &ResultsDirectory) -> Result<()> {
        let mut text = serde_json::to_string_pretty(self)
            .map_err(|reason| Error::File(format!("cannot compose {SUMMARY}: {reason}")))?;
        text.push('\n');
        write_whole(&directory.file(SUMMARY), text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_keys_are_those_of_the_contract() {
        let mut summary = Summary { status: Status::Stopped, ..Default::default() };
        summary.newton_iterations.add(5);
        summary.newton_iterations.add(3);
        summary.bodies.insert("beam".into(), BodySummary::default());
        summary.verify.insert("error".into(), f64::NAN);
        let value: serde_json::Value =
            serde_json::from_str(&serde_json::to_string(&summary).unwrap()).unwrap();
        let keys = |value: &serde_json::Value| {
            let mut keys: Vec<_> = value.as_object().unwrap().keys().cloned().collect();
            keys.sort();
            keys.join(" ")
        };
        assert_eq!(
            keys(&value),
            "balance bodies cells_populated communication imbalance linear_iterations \
             newton_iterations peak_memory_bytes points ranks reason status steps_completed steps_requested title \
             verify versions wall_seconds warnings"
        );
        assert_eq!(value["status"], "stopped");
        assert_eq!(value["newton_iterations"], serde_json::json!({"total": 8, "max": 5}));
        assert_eq!(
            keys(&value["wall_seconds"]),
            "assemble locate migrate output setup solve total update"
        );
        assert_eq!(keys(&value["bodies"]["beam"]), "extent_max extent_min mass max min volume");
        assert_eq!(keys(&value["peak_memory_bytes"]), "max sum");
        assert!(value["verify"]["error"].is_null());
    }
}
