//! Does the problem fit into the machine? Judged from the deck, before anything large is made.

use mpi::traits::*;

use crate::deck::model::{
    AnalysisType, Body, BodySource, Deck, Element, Grid, LatticeGrid, MeshSource, Seeding,
};
use crate::deck::shape::Bounds;
use crate::error::{Error, Result};
use crate::output::terminal::report::bytes;
use crate::parallel::World;

use super::free_memory::FreeMemory;
use crate::run::plan;

/// Places per axis at which a shape is sampled.
const SAMPLES: [usize; 2] = [48, 16];
/// A mesh is held by every rank: coordinates, connectivity and faces of a cell at least, bytes.
const MESH_CELL: f64 = 150.0;

/// Error, the same on all ranks: the points, the equations and the mesh that the deck describes
/// need more memory than is free here. The estimate is a low one, and what the deck does not tell
/// (a file's mesh or points) is left out. Collective.
pub fn require<const D: usize>(world: &World, deck: &Deck) -> Result<()> {
    let size = Size::of::<D>(deck);
    let mesh = MESH_CELL * size.mesh_cells;
    let shared = plan::memory::<D>(deck.method.basis, size.points, size.nodes);
    let own = shared / world.size() as f64 + mesh;
    let on_node = own * world.comm().split_shared(world.rank() as i32).size() as f64;
    let free = FreeMemory::read();
    let short = match free {
        FreeMemory { machine: Some(free), .. } if on_node > free => {
            Some(format!("{} on this machine, which has {} available", text(on_node), text(free)))
        }
        FreeMemory { group: Some(free), .. } if on_node > free => Some(format!(
            "{} on this machine, where the job may take {} more (memory limit of its control group)",
            text(on_node),
            text(free)
        )),
        FreeMemory { process: Some(limit), .. } if own > limit => {
            Some(format!("{} on a rank, which may take {} (ulimit -v)", text(own), text(limit)))
        }
        _ => None,
    };
    let message = short.map(|short| {
        let cells = match size.mesh_cells {
            0.0 => String::new(),
            cells => format!(" in a mesh of {cells:.1e} cells"),
        };
        format!(
            "the problem is too large: about {:.1e} points and {:.1e} active nodes{cells} need \
             {short}; use a larger h, fewer points per cell, or more machines",
            size.points, size.nodes
        )
    });
    world.refuse(Error::Input, message)
}

fn text(amount: f64) -> String {
    // More than any machine has, and all that fits into the number.
    bytes(amount.min(1e18) as u64)
}

/// What a deck describes; counts may be beyond all whole numbers.
#[derive(Default)]
struct Size {
    points: f64,
    /// With equations that need a matrix.
    nodes: f64,
    mesh_cells: f64,
}

impl Size {
    fn of<const D: usize>(deck: &Deck) -> Self {
        let mesh_cells = match &deck.grid {
            Grid::Lattice(_) => 0.0,
            Grid::Mesh(mesh) => cells_of(&mesh.source),
        };
        let mut size = Size { mesh_cells, ..Size::default() };
        for body in &deck.bodies {
            let (points, cells) = match &deck.grid {
                Grid::Lattice(lattice) => on_lattice(body, lattice),
                Grid::Mesh(_) => on_mesh(body, mesh_cells, D),
            };
            size.points += points;
            // An explicit step has no matrix to speak of.
            if deck.analysis.kind != AnalysisType::Explicit {
                size.nodes += cells;
            }
        }
        size
    }
}

/// Cells of a mesh that is made here.
fn cells_of(source: &MeshSource) -> f64 {
    match source {
        MeshSource::File(_) => 0.0,
        MeshSource::Annulus { radial, around, element, .. } => {
            let parts = if *element == Element::Tri3 { 2.0 } else { 1.0 };
            parts * *radial as f64 * *around as f64
        }
        MeshSource::Box { cells, element, .. } => {
            let parts = match element {
                Element::Tri3 => 2.0,
                Element::Tet4 => 5.0,
                _ => 1.0,
            };
            parts * cells.iter().map(|&n| n as f64).product::<f64>()
        }
    }
}

/// Points of a body, and cells that it fills.
fn on_lattice(body: &Body, lattice: &LatticeGrid) -> (f64, f64) {
    let BodySource::Shape { shape, seeding } = &body.source else { return (0.0, 0.0) };
    let cell: f64 = lattice.spacing.iter().product();
    if let Seeding::Lattice { spacing, .. } = seeding {
        let Some(bounds) = shape.local_bounds() else { return (0.0, 0.0) };
        let volume = filled(&bounds, |x| shape.contains_local(x));
        let point = spacing.powi(lattice.cells.len() as i32);
        return (volume / point, volume / cell);
    }
    let axes = 0..lattice.cells.len();
    let end = |a: usize| lattice.origin[a] + lattice.spacing[a] * lattice.cells[a] as f64;
    let whole = (lattice.origin.clone(), axes.clone().map(end).collect::<Vec<f64>>());
    let (low, high) = shape.bounds().unwrap_or_else(|| whole.clone());
    let low = axes.clone().map(|a| low[a].max(whole.0[a])).collect();
    let high = axes.map(|a| high[a].min(whole.1[a])).collect();
    let cells = filled(&(low, high), |x| shape.contains(x)) / cell;
    let each: f64 = match seeding {
        Seeding::PerCell(counts) => counts.iter().map(|&n| n as f64).product(),
        Seeding::Gauss(order) => (*order as f64).powi(lattice.cells.len() as i32),
        Seeding::Lattice { .. } => 0.0,
    };
    (each * cells, cells)
}

/// The same on a mesh. A tag or a shape may leave out any part of it.
fn on_mesh(body: &Body, cells: f64, dimension: usize) -> (f64, f64) {
    let BodySource::MeshCells { tag: None, seeding } = &body.source else { return (0.0, 0.0) };
    let per_axis = match seeding {
        Seeding::PerCell(counts) => counts.iter().copied().min().unwrap_or(1),
        Seeding::Gauss(order) => *order,
        Seeding::Lattice { .. } => return (0.0, 0.0),
    };
    (cells * (per_axis as f64).powi(dimension as i32), cells)
}

/// Volume of a shape by samples of the box around it.
fn filled((low, high): &Bounds, contains: impl Fn(&[f64]) -> bool) -> f64 {
    let dimension = low.len();
    let lengths: Vec<f64> = (0..dimension).map(|a| (high[a] - low[a]).max(0.0)).collect();
    let n = SAMPLES[dimension - 2];
    let all = n.pow(dimension as u32);
    let inside = (0..all).filter(|&sample| {
        let mut rest = sample;
        let x: Vec<f64> = (0..dimension)
            .map(|a| {
                let at = ((rest % n) as f64 + 0.5) / n as f64;
                rest /= n;
                low[a] + at * lengths[a]
            })
            .collect();
        contains(&x)
    });
    lengths.iter().product::<f64>() * (inside.count() as f64 / all as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck;
    use std::path::Path;

    fn size(sets: &[&str]) -> Size {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_string()).collect();
        let text = include_str!("../../deck/example.toml");
        Size::of::<2>(&deck::read(Path::new("deck.toml"), text, &sets).expect("a good deck"))
    }

    #[test]
    fn points_are_estimated_from_shapes() {
        let beam = size(&[]);
        assert!((beam.points - 160.0).abs() < 1e-9 && (beam.nodes - 40.0).abs() < 1e-9);
        let seeded = size(&["body.0.points_per_cell=", "body.0.lattice={ spacing = 0.1 }"]);
        assert!((seeded.points - 1000.0).abs() < 1e-9, "{}", seeded.points);
        let disc = "body.0.shape={ disc = { centre = [5, 5], radius = 4 } }";
        let expected = 16.0 * std::f64::consts::PI / 0.25 * 4.0;
        assert!((size(&[disc]).points / expected - 1.0).abs() < 0.02);
        // Half of the disc lies outside the grid.
        let cut = "body.0.shape={ disc = { centre = [0, 5], radius = 4 } }";
        assert!((size(&[cut]).points / expected - 0.5).abs() < 0.02);
        let open = size(&["body.0.shape={ where = \"x < 5.5\" }"]);
        assert!((open.points - 880.0).abs() < 20.0, "{}", open.points);
    }
}
