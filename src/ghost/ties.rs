//! Populated simplices that hold together by a node only, with two or more empty ones between them
//! on either side: no path of faces joins them there (see [`super::faces`]). They are tied
//! directly, as if they shared a face: J_G with the jump of the whole gradient, which is what the
//! jump of the normal derivative is for two linear simplices with a common face. It brings in no
//! node that the cells do not have.
//!
//! Found node by node: the cells around it that a body populates fall into groups joined by faces
//! and bridges; each further group is tied to the largest.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use crate::error::Result;
use crate::grid::{FacePair, Grid};
use crate::parallel::{Partition, World, exchange};

use super::cells::{BoundaryFace, Cell, KnownCells};

/// The ties whose lower cell this rank owns, in ascending order. `boundary` lists its boundary
/// cells; `cells` knows all cells with a face at them. Collective.
pub(crate) fn ties<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    partition: &Partition<D>,
    cells: &mut KnownCells,
    boundary: &[(usize, u64)],
) -> Result<Vec<BoundaryFace>> {
    let mut patches: FxHashMap<usize, (Patch, u64)> = FxHashMap::default();
    let mut nodes = Vec::new();
    for &(cell, bodies) in boundary {
        nodes.clear();
        grid.cell_nodes(cell, &mut nodes);
        for &node in &nodes {
            patches.entry(node).or_insert_with(|| (Patch::around(grid, cell, node), 0)).1 |= bodies;
        }
    }
    fetch(world, grid, partition, cells, patches.values().map(|(patch, _)| patch))?;
    let here = world.rank();
    let mut found: BTreeMap<(usize, usize), u64> = BTreeMap::new();
    for (patch, bodies) in patches.values() {
        for body in (0..u64::BITS).filter(|body| bodies >> body & 1 == 1) {
            for pair in patch.tie_groups(cells, 1 << body) {
                if partition.owner_of_cell(grid, pair.lower) == here {
                    *found.entry((pair.lower, pair.upper)).or_default() |= 1 << body;
                }
            }
        }
    }
    let tie = |((lower, upper), bodies)| BoundaryFace { pair: FacePair { lower, upper }, bodies };
    Ok(found.into_iter().map(tie).collect())
}

/// The cells around a node, ascending, and those pairs of them, by their places, that share a face.
struct Patch {
    cells: Vec<usize>,
    faces: Vec<(usize, usize)>,
}

impl Patch {
    /// Walks from one of the cells across faces that hold the node.
    fn around<const D: usize>(grid: &Grid<D>, start: usize, node: usize) -> Self {
        let mut cells = vec![start];
        let mut pairs = Vec::new();
        let (mut neighbours, mut nodes) = (Vec::new(), Vec::new());
        let mut next = 0;
        while let Some(&cell) = cells.get(next) {
            next += 1;
            neighbours.clear();
            grid.face_neighbours(cell, &mut neighbours);
            for &other in &neighbours {
                nodes.clear();
                grid.cell_nodes(other, &mut nodes);
                if nodes.contains(&node) {
                    pairs.push((cell, other));
                    if !cells.contains(&other) {
                        cells.push(other);
                    }
                }
            }
        }
        cells.sort_unstable();
        let place = |cell: usize| cells.partition_point(|&c| c < cell);
        let faces = pairs.iter().filter(|(a, b)| a < b).map(|&(a, b)| (place(a), place(b)));
        let faces = faces.collect();
        Patch { cells, faces }
    }

    /// Pairs that tie the groups of one body's cells to the largest of them.
    fn tie_groups(&self, cells: &KnownCells, body: u64) -> Vec<FacePair> {
        let state: Vec<Cell> =
            self.cells.iter().map(|&cell| cells.get(cell).copied().unwrap_or_default()).collect();
        let filled = |at: usize| state[at].populated & body != 0;
        // Group of each cell: the lowest place in it.
        let mut group: Vec<usize> = (0..state.len()).collect();
        let joins = |a: usize, b: usize| {
            let held = |at: usize| filled(at) || state[at].bridge & body != 0;
            held(a) && held(b) && (filled(a) || filled(b))
        };
        loop {
            let before = group.clone();
            for &(a, b) in self.faces.iter().filter(|&&(a, b)| joins(a, b)) {
                let low = group[a].min(group[b]);
                (group[a], group[b]) = (low, low);
            }
            if group == before {
                break;
            }
        }
        // Groups with their cell to tie, the lowest at the body's boundary, largest first.
        let mut groups: Vec<(usize, usize)> = Vec::new();
        for first in 0..state.len() {
            let members = || (0..state.len()).filter(|&at| group[at] == first && filled(at));
            let tied = members().find(|&at| state[at].boundary & body != 0);
            if let Some(tied) = tied {
                groups.push((members().count(), self.cells[tied]));
            }
        }
        groups.sort_unstable_by_key(|&(count, cell)| (std::cmp::Reverse(count), cell));
        let Some((&(_, hub), others)) = groups.split_first() else { return Vec::new() };
        let pair =
            |&(_, cell): &(usize, usize)| FacePair { lower: hub.min(cell), upper: hub.max(cell) };
        others.iter().map(pair).collect()
    }
}

/// Asks other ranks for the state of their cells in the patches. Collective.
fn fetch<'a, const D: usize>(
    world: &World,
    grid: &Grid<D>,
    partition: &Partition<D>,
    cells: &mut KnownCells,
    patches: impl Iterator<Item = &'a Patch>,
) -> Result<()> {
    if world.size() == 1 {
        return Ok(());
    }
    let mut wanted: Vec<usize> = patches.flat_map(|patch| patch.cells.iter().copied()).collect();
    wanted.sort_unstable();
    wanted.dedup();
    let mut requests: FxHashMap<usize, Vec<u64>> = FxHashMap::default();
    for cell in wanted {
        let owner = partition.owner_of_cell(grid, cell);
        if owner != world.rank() {
            requests.entry(owner).or_default().push(cell as u64);
        }
    }
    let mut answers = Vec::new();
    for (rank, asked) in exchange(world, requests.into_iter().collect())? {
        // Empty cells need no answer.
        let known = asked.iter().filter_map(|&cell| Some(cells.get(cell as usize)?.record(cell)));
        answers.push((rank, known.flatten().collect()));
    }
    for (_, words) in exchange(world, answers)? {
        cells.insert_records(&words);
    }
    Ok(())
}
