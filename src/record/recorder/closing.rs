//! How a run ended, its summary and its report.

use crate::deck::{Deck, Stage};
use crate::error::Result;
use crate::output::extent::{body_summaries, peak_memory};
use crate::output::report;
use crate::output::summary::{Communication, StageSummary, Status, Summary};
use crate::parallel::World;
use crate::points::Points;
use crate::record::clock::Clock;
use std::collections::BTreeMap;

use super::Recorder;

/// Contents of the summary beside those that the recorder has.
pub struct Closing<'a> {
    pub communication: Communication,
    /// Figures of merit.
    pub verify: BTreeMap<String, f64>,
    pub ending: &'a Ending,
}

/// How a run ended.
#[derive(Debug, Clone)]
pub struct Ending {
    pub status: Status,
    pub reason: String,
    /// A signal asked for it.
    pub on_request: bool,
}

impl Ending {
    pub fn completed() -> Self {
        Ending { status: Status::Completed, reason: String::new(), on_request: false }
    }

    /// The run could not go on but keeps what it has.
    pub fn stopped(reason: String) -> Self {
        Ending { status: Status::Stopped, reason, on_request: false }
    }

    pub fn failed(reason: String) -> Self {
        Ending { status: Status::Failed, reason, on_request: false }
    }
}

impl Recorder {
    /// Writes `report.html`. That it could not be written is said, and no fault of the run.
    pub fn write_report(&mut self, world: &World) {
        if world.is_root()
            && let Err(error) = report::write(self.directory.path())
        {
            self.log.say(&format!("warning: no report: {error}"));
        }
    }

    /// How far each stage of a deck that names them has come.
    fn stages_of(&self, deck: &Deck, all: bool) -> Vec<StageSummary> {
        let of_stage = |(index, (stage, &done)): (usize, (&Stage, &usize))| StageSummary {
            name: stage.name.clone(),
            steps_completed: done,
            completed: all || index < self.stage || stage.steps == Some(done),
        };
        let stages = deck.stages.iter().zip(&self.stages).enumerate();
        stages.map(of_stage).filter(|_| self.staged).collect()
    }

    /// The summary, and whether it could be written. Collective.
    pub fn finish<const D: usize>(
        &mut self,
        world: &World,
        deck: &Deck,
        points: &Points<D>,
        clock: &Clock,
        closing: Closing<'_>,
    ) -> (Summary, Result<()>) {
        let Closing { communication, verify, ending } = closing;
        let kind = (deck.method.basis, deck.analysis.symmetry);
        let bodies = body_summaries(points, deck.bodies.len(), kind, world.comm());
        let summary = Summary {
            title: deck.title.clone(),
            status: ending.status,
            reason: ending.reason.clone(),
            steps_completed: self.steps_completed,
            steps_requested: self.steps.unwrap_or(self.steps_completed),
            newton_iterations: self.newton,
            linear_iterations: self.linear,
            points: world.sum_usize(points.len()),
            cells_populated: self.populated_cells,
            ranks: world.size(),
            wall_seconds: clock.phases(),
            peak_memory_bytes: peak_memory(world.comm()),
            imbalance: self.imbalance,
            balance: self.balance,
            communication,
            verify,
            bodies: deck.bodies.iter().map(|body| body.name.clone()).zip(bodies).collect(),
            strength_factor: self.strength_factor,
            stages: self.stages_of(deck, ending.status == Status::Completed),
            versions: self.versions.clone(),
            warnings: self.log.warnings(),
        };
        let mut written = summary.write(&self.directory, world.comm());
        if ending.status == Status::Completed {
            written = written.and_then(|()| self.checkpointer.remove_superseded(world));
        }
        (summary, written)
    }
}
