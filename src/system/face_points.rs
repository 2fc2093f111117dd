//! Which cell the functions of a point on a face are taken from, where the mass decides it.
//!
//! S_v = N_v(x_p) is continuous over a face, its gradient is not: it is that of one of the cells
//! at the face. Their nodes off the face have the weight zero. Where no other point gives such a
//! node mass, its velocity is not defined, and the gradient of a rigid motion would not vanish.
//! So the gradients are taken from a cell whose nodes all carry mass: they then differentiate a
//! field that is known everywhere in the cell. Weights, and with them the mass of every node, do
//! not depend on the choice.
//!
//! Several such cells: the one that [`Grid::locate`] names, else the first of a fixed order, the
//! same on any number of ranks. None (points on one line, and nothing beside it): the located one.

use crate::basis::Influences;
use crate::error::Result;
use crate::grid::Grid;
use crate::parallel::{Partition, World};
use crate::points::Points;

use super::numbering::{Numbering, Touched};

/// Weights up to this are those of nodes off a face, if the point lies on one: above the round-off
/// that decides whether a place is on a face.
const NEAR: f64 = 1e-8;

/// A point on a face, and the cells that hold it.
struct FacePoint {
    point: usize,
    cells: Vec<usize>,
}

/// Chooses the cells of the `mpm` rows of points on faces, for analyses with a mass. Collective.
pub fn choose_cells<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    partition: &Partition<D>,
    points: &Points<D>,
    influences: &mut Influences<D>,
) -> Result<()> {
    let places = on_faces(grid, points, influences);
    if !world.any(!places.is_empty()) {
        return Ok(());
    }
    // Nodes off the face have a weight of exactly zero from here on.
    for FacePoint { point, cells } in &places {
        influences.replace_row(grid, *point, &points.position[*point], cells[0]);
    }
    let mut reached: Vec<usize> = Vec::new();
    let mut before = 0..0;
    for p in 0..influences.len() {
        let row = influences.row(p);
        if influences.nodes[row.clone()] != influences.nodes[before] {
            reached.extend_from_slice(&influences.nodes[row.clone()]);
        }
        before = row;
    }
    for cell in places.iter().flat_map(|place| &place.cells) {
        grid.cell_nodes(*cell, &mut reached);
    }
    let touched = Touched::assign(world, grid, partition, reached)?;
    let numbering = Numbering::build(world, touched.owned, &touched.foreign)?;
    let mut carried = vec![0.0; numbering.len()];
    let mut on_face = vec![false; points.len()];
    places.iter().for_each(|place| on_face[place.point] = true);
    for (p, &on_face) in on_face.iter().enumerate() {
        let least = if on_face { NEAR } else { 0.0 };
        for entry in influences.row(p) {
            if influences.weights[entry] > least
                && let Some(node) = numbering.local(influences.nodes[entry])
            {
                carried[node] = 1.0;
            }
        }
    }
    numbering.halo.reverse_add(world, &mut carried, 1)?;
    numbering.halo.forward(world, &mut carried, 1)?;

    let mut nodes = Vec::new();
    let mut whole = |cell: usize| {
        nodes.clear();
        grid.cell_nodes(cell, &mut nodes);
        nodes.iter().all(|&node| numbering.local(node).is_some_and(|node| carried[node] > 0.0))
    };
    for FacePoint { point, cells } in &places {
        if let Some(&cell) = cells.iter().find(|&&cell| whole(cell))
            && cell != cells[0]
        {
            influences.replace_row(grid, *point, &points.position[*point], cell);
        }
    }
    Ok(())
}

/// Points on faces between cells, and those that round-off puts outside the grid.
fn on_faces<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
    influences: &Influences<D>,
) -> Vec<FacePoint> {
    let mut places = Vec::new();
    for p in 0..influences.len() {
        let weights = &influences.weights[influences.row(p)];
        if weights.iter().all(|weight| *weight > NEAR) {
            continue;
        }
        let mut cells = Vec::new();
        grid.cells_at(&points.position[p], &mut cells);
        let outside = cells.len() == 1 && weights.iter().any(|weight| *weight < 0.0);
        if cells.len() > 1 || outside {
            places.push(FacePoint { point: p, cells });
        }
    }
    places
}
