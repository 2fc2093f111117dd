//! Frames of the points, of the grid and of rigid bodies.

use mpi::topology::Communicator;

use crate::contact::pose::Pose;
use crate::deck::model::Every;
use crate::error::Result;
use crate::grid::Grid;
use crate::output::series::grid_file::GridFrame;
use crate::parallel::World;
use crate::points::Points;
use crate::record::contact::surfaces;
use crate::record::step::Solved;
use crate::system::model::Model;

use super::Recorder;

impl Recorder {
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
        self.points.write((step, time), points, world.comm())
    }

    /// Writes the surfaces of the rigid bodies in their `poses`.
    pub fn rigid_frame<const D: usize>(
        &mut self,
        world: &World,
        model: &Model<D>,
        poses: &[Pose<D>],
        (step, time): (usize, f64),
    ) -> Result<()> {
        let Some(series) = &mut self.rigid else { return Ok(()) };
        let frame = surfaces(model, poses, self.stage);
        series.write((step, time), &frame.shown(world.is_root()), world.comm())
    }

    /// Writes the active grid of the step just solved, on the `grid` that it was solved on.
    pub fn grid_frame<const D: usize>(
        &mut self,
        world: &World,
        grid: &Grid<D>,
        solved: &Solved<D>,
        step: usize,
        time: f64,
    ) -> Result<()> {
        let Solved { mesh, displacement, reaction, .. } = solved;
        let numbering = &mesh.numbering;
        let per_node = |values: &[f64]| -> Vec<[f64; D]> {
            values.chunks_exact(D).map(|v| std::array::from_fn(|a| v[a])).collect()
        };
        let owned = numbering.owned;
        let coordinates: Vec<[f64; D]> =
            numbering.nodes[..owned].iter().map(|&node| grid.node_position(node)).collect();
        let mut cells = Vec::new();
        let mut connectivity = Vec::new();
        let mut nodes = Vec::new();
        let on_face: std::collections::BTreeSet<usize> = mesh.ghost_cells.iter().copied().collect();
        // A cell once for each velocity field in it.
        let fields = &mesh.numbering.fields;
        for (cell, field) in mesh.populated.in_fields(fields) {
            nodes.clear();
            grid.cell_nodes(cell, &mut nodes);
            // A cell whose nodes this rank does not all know is written by nobody: it cannot
            // happen, as owners of populated cells reach their nodes.
            let numbers: Option<Vec<usize>> = nodes
                .iter()
                .map(|&node| {
                    numbering.local(fields.at(field, node)).map(|l| numbering.global[l] as usize)
                })
                .collect();
            if let Some(numbers) = numbers {
                connectivity.extend(numbers);
                cells.push(on_face.contains(&cell));
            }
        }
        let weights = mesh.node_weights(world)?;
        let frame = GridFrame {
            element: grid.element(),
            coordinates: &coordinates,
            connectivity: &connectivity,
            displacement_increment: &per_node(&displacement[..owned * D]),
            reaction: &per_node(reaction),
            node_fields: &[("weight", &weights[..owned])],
            ghost_boundary: &cells,
            cell_fields: &[],
        };
        self.grid.write((step, time), &frame.shown(world.comm().rank()), world.comm())
    }
}
