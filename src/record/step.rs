//! A finished step as the record sees it.

use crate::contact::pose::Pose;
use crate::grid::Grid;
use crate::output::tables::history::HistoryRow;
use crate::parallel::World;
use crate::parallel::balance::imbalance;
use crate::points::Points;
use crate::system::step_system::Discretisation;

/// Where a time loop stands after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// Inside a nominal step that was cut.
    PartOfStep,
    Step,
    /// Nothing is left to do.
    End,
}

/// A solved step: its row, and the grid as it was solved.
pub struct Solved<const D: usize> {
    pub row: HistoryRow,
    pub mesh: Discretisation<D>,
    /// Of local nodes, m.
    pub displacement: Vec<f64>,
    /// Of the owned degrees of freedom, N.
    pub reaction: Vec<f64>,
    /// The mesh where it goes after the step, if it moves.
    pub moved_grid: Option<Grid<D>>,
    /// Of the rigid bodies at the end.
    pub poses: Vec<Pose<D>>,
}

/// What a history row says of the grid side, the rest of the row at its defaults. Collective.
pub fn grid_side<const D: usize>(
    world: &World,
    mesh: &Discretisation<D>,
    points: &Points<D>,
) -> HistoryRow {
    HistoryRow {
        ghost_faces: world.sum_usize(mesh.faces.len()),
        populated_cells: world.sum_usize(mesh.populated.owned.len()),
        imbalance: imbalance(world, points.len()),
        ..HistoryRow::default()
    }
}
