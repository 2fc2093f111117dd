//! Connected components of the material, called pieces here: populated cells that share a node, or that a Ghost face ties,
//! hold each other.

use crate::error::Result;
use crate::ghost::FaceStencil;
use crate::grid::Grid;
use crate::parallel::{World, exchange};
use crate::system::numbering::Numbering;
use crate::system::populated::Populated;

/// Label of the piece at each local node: the smallest grid node of that piece on any rank.
/// `numbering` holds the nodes of the populated cells and the faces owned here. Pieces are joined
/// on each rank; then labels pass between neighbours until none changes. Collective.
pub fn labels<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    populated: &Populated,
    faces: &[FaceStencil],
    numbering: &Numbering,
) -> Result<Vec<u64>> {
    let mut sets = Sets((0..numbering.len() as u32).collect());
    let mut nodes = Vec::new();
    for &(cell, _) in &populated.owned {
        nodes.clear();
        grid.cell_nodes(cell, &mut nodes);
        sets.join(numbering, &nodes);
    }
    for face in faces.iter().filter(|face| face.stiffness > 0.0) {
        sets.join(numbering, &face.nodes);
    }
    let roots: Vec<usize> = (0..numbering.len()).map(|local| sets.root(local)).collect();
    let mut label: Vec<u64> = numbering.nodes.iter().map(|&node| node as u64).collect();
    for local in 0..roots.len() {
        label[roots[local]] = label[roots[local]].min(label[local]);
    }
    loop {
        let mut changed = false;
        let mut lower = |local: usize, other: u64, label: &mut [u64]| {
            let own = &mut label[roots[local]];
            changed |= other < *own;
            *own = other.min(*own);
        };
        // Node numbers are whole as floats, too (`MOST_NODES` of the deck).
        let mut at: Vec<f64> = roots.iter().map(|&root| label[root] as f64).collect();
        numbering.halo.forward(world, &mut at, 1)?;
        for (local, &other) in at.iter().enumerate().skip(numbering.owned) {
            lower(local, other as u64, &mut label);
        }
        let outgoing = numbering.halo.ghosts().map(|(rank, ghosts)| {
            (rank, ghosts.map(|ghost| label[roots[ghost]]).collect::<Vec<u64>>())
        });
        let arrived = exchange(world, outgoing.collect())?;
        for (rank, locals) in numbering.halo.copies() {
            let Some((_, others)) = arrived.iter().find(|(source, _)| *source == rank) else {
                continue;
            };
            for (&local, &other) in locals.iter().zip(others) {
                lower(local as usize, other, &mut label);
            }
        }
        if !world.any(changed) {
            return Ok(roots.iter().map(|&root| label[root]).collect());
        }
    }
}

/// Disjoint sets of local nodes, each node pointing towards the root of its set.
struct Sets(Vec<u32>);

impl Sets {
    fn root(&mut self, mut node: usize) -> usize {
        while self.0[node] as usize != node {
            // Halves the way for the next one.
            self.0[node] = self.0[self.0[node] as usize];
            node = self.0[node] as usize;
        }
        node
    }

    fn join(&mut self, numbering: &Numbering, nodes: &[usize]) {
        let mut first = None;
        for local in nodes.iter().filter_map(|&node| numbering.local(node)) {
            let root = self.root(local);
            match first {
                None => first = Some(root),
                Some(lowest) if root < lowest => {
                    self.0[lowest] = root as u32;
                    first = Some(root);
                }
                Some(lowest) => self.0[root] = lowest as u32,
            }
        }
    }
}
