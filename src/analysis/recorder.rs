//! What a running analysis leaves behind: rows, frames, progress and the summary.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::assembly::Numbering;
use crate::deck::Deck;
use crate::deck::model::Every;
use crate::error::Result;
use crate::output::extent::{body_summaries, peak_memory};
use crate::output::history::{HistoryRow, Layout};
use crate::output::log::Log;
use crate::output::progress::{NewtonReport, Progress, StepReport};
use crate::output::summary::{Count, Status};
use crate::output::{
    GridFrame, GridSeries, History, PointField, PointsSeries, Residuals, ResultsDirectory, Summary,
};
use crate::parallel::World;
use crate::points::Points;

use super::clock::Clock;
use super::discretise::{Discretisation, Model};

/// Open files and running totals of one run.
pub struct Recorder {
    pub log: Log,
    directory: ResultsDirectory,
    history: History,
    residuals: Residuals,
    points: PointsSeries,
    grid: GridSeries,
    progress: Progress,
    every: Every,
    last_frame: f64,
    steps: Option<usize>,
    pub newton: Count,
    pub linear: Count,
    pub steps_completed: usize,
    /// Load factor and time (s) reached so far.
    pub reached: (f64, f64),
    pub versions: BTreeMap<String, String>,
    populated_cells: usize,
    imbalance: f64,
}

/// How a run ended.
#[derive(Debug, Clone)]
pub struct Ending {
    pub status: Status,
    pub reason: String,
}

impl Recorder {
    /// Opens the files in a fresh results directory.
    pub fn create(
        world: &World,
        deck: &Deck,
        directory: ResultsDirectory,
        log: Log,
        versions: BTreeMap<String, String>,
        conditioning: bool,
    ) -> Result<Self> {
        let comm = world.comm();
        let layout = Layout {
            dimension: deck.dimension,
            boundaries: deck.boundaries.iter().map(|boundary| boundary.name.clone()).collect(),
            conditioning,
        };
        let fields = PointField::parse_list(&deck.output.fields)?;
        Ok(Recorder {
            log,
            history: History::create(&directory, layout, comm)?,
            residuals: Residuals::create(&directory, comm)?,
            points: PointsSeries::create(&directory, &fields, deck.method.basis, deck.dimension),
            grid: GridSeries::create(&directory),
            directory,
            progress: Progress::default(),
            every: deck.output.every,
            last_frame: 0.0,
            steps: deck.analysis.steps,
            newton: Count::default(),
            linear: Count::default(),
            steps_completed: 0,
            reached: (0.0, 0.0),
            versions,
            populated_cells: 0,
            imbalance: 1.0,
        })
    }

    pub fn directory(&self) -> PathBuf {
        self.directory.path().to_path_buf()
    }

    /// Records one accepted step (or part of one): a row and a line.
    pub fn step(&mut self, world: &World, row: &HistoryRow, with_newton: bool) -> Result<()> {
        self.history.push(row, world.comm())?;
        self.reached = (row.load_factor, row.time);
        self.populated_cells = row.populated_cells;
        self.imbalance = row.imbalance;
        let newton = with_newton.then_some(NewtonReport {
            iterations: row.newton_iterations,
            residual: row.residual,
            linear_iterations: row.linear_iterations,
            cuts: row.cuts,
        });
        let report = StepReport {
            step: row.step,
            steps: self.steps,
            share: row.load_factor,
            time: (row.time > 0.0).then_some(row.time),
            newton,
            elapsed: row.wall_seconds,
        };
        self.progress.step(&mut self.log, &report);
        Ok(())
    }

    /// Residuals of a step's evaluations.
    pub fn iterations(&mut self, world: &World, step: usize, errors: &[f64]) -> Result<()> {
        self.residuals.push_step(step, errors, world.comm())
    }

    /// True if the deck wants a frame at the end of this step.
    pub fn wants_frame(&mut self, step: usize, time: f64, last: bool) -> bool {
        match self.every {
            Every::Steps(every) => last || step.is_multiple_of(every.max(1)),
            Every::Seconds(seconds) => {
                let due = last || time >= self.last_frame + seconds * (1.0 - 1e-9);
                if due {
                    self.last_frame = time;
                }
                due
            }
        }
    }

    /// Writes the points.
    pub fn frame<const D: usize>(
        &mut self,
        world: &World,
        step: usize,
        time: f64,
        points: &Points<D>,
    ) -> Result<()> {
        self.points.write(step, time, points, world.comm())
    }

    /// Writes the active grid of the step just solved; vectors are per owned degree of freedom.
    #[allow(clippy::too_many_arguments)]
    pub fn grid_frame<const D: usize>(
        &mut self,
        world: &World,
        model: &Model<D>,
        mesh: &Discretisation<D>,
        step: usize,
        time: f64,
        displacement: &[f64],
        reaction: &[f64],
    ) -> Result<()> {
        let numbering: &Numbering = &mesh.numbering;
        let per_node = |values: &[f64]| -> Vec<[f64; D]> {
            values.chunks_exact(D).map(|v| std::array::from_fn(|a| v[a])).collect()
        };
        let owned = numbering.owned;
        let coordinates: Vec<[f64; D]> =
            numbering.nodes[..owned].iter().map(|&node| model.grid.node_position(node)).collect();
        let mut cells = Vec::new();
        let mut connectivity = Vec::new();
        let mut nodes = Vec::new();
        let on_face: std::collections::BTreeSet<usize> = mesh.ghost_cells.iter().copied().collect();
        for &(cell, _) in &mesh.populated.owned {
            nodes.clear();
            model.grid.cell_nodes(cell, &mut nodes);
            // A cell whose nodes this rank does not all know is written by nobody: it cannot
            // happen, as owners of populated cells reach their nodes.
            let numbers: Option<Vec<usize>> = nodes
                .iter()
                .map(|&node| numbering.local(node).map(|l| numbering.global[l] as usize))
                .collect();
            if let Some(numbers) = numbers {
                connectivity.extend(numbers);
                cells.push(on_face.contains(&cell));
            }
        }
        let frame = GridFrame {
            element: model.grid.element(),
            coordinates: &coordinates,
            connectivity: &connectivity,
            displacement_increment: &per_node(&displacement[..owned * D]),
            reaction: &per_node(reaction),
            node_fields: &[("weight", &mesh.node_weight[..owned])],
            ghost_boundary: &cells,
            cell_fields: &[],
        };
        self.grid.write(step, time, &frame, world.comm())
    }

    /// Writes the summary and returns it. Collective.
    #[allow(clippy::too_many_arguments)]
    pub fn finish<const D: usize>(
        &mut self,
        world: &World,
        deck: &Deck,
        points: &Points<D>,
        clock: &Clock,
        verify: BTreeMap<String, f64>,
        ending: &Ending,
    ) -> Result<Summary> {
        let bodies = body_summaries(points, deck.bodies.len(), deck.method.basis, world.comm());
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
            verify,
            bodies: deck.bodies.iter().map(|body| body.name.clone()).zip(bodies).collect(),
            versions: self.versions.clone(),
        };
        summary.write(&self.directory, world.comm())?;
        Ok(summary)
    }
}
