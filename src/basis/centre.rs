//! Gradients at the centres of cells, for F-bar (de Souza Neto et al. 1996, IJSS 33:3277; Coombs et
//! al. 2018, CMAME 333:1 for material points).
//!
//! The change of volume that a point's stress sees is taken where a cell's functions can represent a
//! constant one: at its centre. For `mpm` that is the centre of the point's cell: one volumetric
//! constraint in each cell, however many points it holds. For `gimp` it is the mean over the centres
//! of all cells that the domain overlaps, each weighted by its share of the domain. Both reproduce
//! the gradient of linear fields exactly, so that a uniform deformation stays what it is.

use super::Influences;
use crate::error::{Error, Result};
use crate::grid::{Grid, Lattice};

/// One gradient for each entry of rows that are those of a cell, 1/m. Error: a cell of a mesh
/// without volume.
pub(super) fn of_cells<const D: usize>(
    grid: &Grid<D>,
    influences: &Influences<D>,
) -> Result<Vec<[f64; D]>> {
    match grid {
        Grid::Lattice(lattice) => Ok(on_lattice(lattice, influences)),
        Grid::Mesh(_) => on_mesh(grid, influences),
    }
}

/// All cells are alike, and a row's entries are the corners of one, first axis fastest.
fn on_lattice<const D: usize>(lattice: &Lattice<D>, influences: &Influences<D>) -> Vec<[f64; D]> {
    let factor = 0.5f64.powi(D as i32 - 1);
    let of_corner = |corner: usize| -> [f64; D] {
        std::array::from_fn(|axis| {
            let sign = if corner >> axis & 1 == 1 { factor } else { -factor };
            sign / lattice.spacing[axis]
        })
    };
    let cell: Vec<[f64; D]> = (0..1 << D).map(of_corner).collect();
    cell.iter().copied().cycle().take(influences.nodes.len()).collect()
}

/// Neighbours in the list mostly share their cell.
fn on_mesh<const D: usize>(grid: &Grid<D>, influences: &Influences<D>) -> Result<Vec<[f64; D]>> {
    let mut made = Vec::with_capacity(influences.nodes.len());
    let mut before: Option<(usize, Vec<[f64; D]>)> = None;
    for p in 0..influences.len() {
        let cell = influences.cells.of(p).and_then(<[usize]>::first).copied();
        let nodes = &influences.nodes[influences.row(p)];
        let cell = cell.ok_or_else(|| Error::Run(format!("the row of point {p} has no cell")))?;
        if before.as_ref().is_none_or(|(known, _)| *known != cell) {
            before = Some((cell, of_cell(grid, cell, nodes)?));
        }
        made.extend(before.iter().flat_map(|(_, gradients)| gradients));
    }
    Ok(made)
}

/// At the mean of the cell's nodes, the image of its reference centre; in the order of `nodes`.
fn of_cell<const D: usize>(grid: &Grid<D>, cell: usize, nodes: &[usize]) -> Result<Vec<[f64; D]>> {
    let mut centre = [0.0; D];
    for &node in nodes {
        let x = grid.node_position(node);
        for axis in 0..D {
            centre[axis] += x[axis] / nodes.len() as f64;
        }
    }
    let at = grid
        .interpolate_in(cell, &centre)
        .ok_or_else(|| Error::Run(format!("cell {cell} at {centre:?} m has no volume")))?;
    let of_node = |node: &usize| {
        let known = at.values.nodes[..at.values.count].iter().position(|known| known == node);
        known.map_or([0.0; D], |a| at.gradients[a])
    };
    Ok(nodes.iter().map(of_node).collect())
}
