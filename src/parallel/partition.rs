//! Owner of every unit, and so of every cell and node: populated units by METIS, weighted by
//! cost; the empty ones with the nearest populated one.
//!
//! The table of owners is the only thing that every rank holds for the whole grid.

use std::collections::VecDeque;

use bytemuck::{Pod, Zeroable};
use rustc_hash::{FxHashMap, FxHashSet};

use super::bricks::{self, Bricks};
use super::cells::CellGraph;
use super::metis::{self, Graph};
use super::{World, diffuse, exchange};
use crate::error::Result;
use crate::grid::Grid;
use crate::points::Points;

/// What is dealt out as a whole.
#[derive(Debug, Clone)]
enum Units<const D: usize> {
    Bricks(Bricks<D>),
    Cells(CellGraph),
}

/// Who owns what; the same on all ranks.
#[derive(Debug, Clone)]
pub struct Partition<const D: usize> {
    units: Units<D>,
    /// Rank of each unit.
    owner: Vec<u32>,
}

/// One rank's cost of one unit, on its way to the root.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct UnitCost {
    unit: u64,
    cost: f64,
}

const NOBODY: u32 = u32::MAX;
/// Handing over stops at this max/mean: what is left is less than bricks can level.
const LEVEL_ENOUGH: f64 = 1.03;
/// Handing over may lengthen the cut by this factor over METIS's; its messages cost every step,
/// a migration once.
const FRAYED: f64 = 1.25;

impl<const D: usize> Partition<D> {
    /// Partitions the grid for points lying anywhere (each counted on the rank that holds it).
    /// `brick`: cells per side of a lattice's bricks, `None`: by size. `costs`: of each point,
    /// `None`: equal. Collective. Errors: a point outside the grid; METIS refused.
    pub fn build(
        world: &World,
        grid: &Grid<D>,
        brick: Option<usize>,
        points: &Points<D>,
        costs: Option<&[f64]>,
    ) -> Result<Self> {
        Self::for_cells(world, grid, brick, &super::migrate::locate(world, grid, points)?, costs)
    }

    /// As [`Self::build`] for points known to be in these cells. Collective.
    pub fn for_cells(
        world: &World,
        grid: &Grid<D>,
        brick: Option<usize>,
        cells: &[usize],
        costs: Option<&[f64]>,
    ) -> Result<Self> {
        #[allow(unreachable_patterns)]
        let units = match grid {
            Grid::Lattice(lattice) => {
                let populated: FxHashSet<usize> = cells.iter().copied().collect();
                let populated = world.sum_usize(populated.len());
                let side = brick
                    .unwrap_or_else(|| Bricks::automatic_side(lattice, populated, world.size()));
                Units::Bricks(Bricks::new(lattice, side))
            }
            _ => Units::Cells(CellGraph::of(grid)),
        };
        let mut partition = Partition { units, owner: Vec::new() };
        partition.assign(world, grid, cells, costs)?;
        Ok(partition)
    }

    /// Equal slices of the grid, wherever the points are: along x on a lattice, by the numbers
    /// of its cells on a mesh. Where to start from to see a run balance itself. Collective.
    /// Errors: as [`Self::for_cells`].
    pub fn slabs(
        world: &World,
        grid: &Grid<D>,
        brick: Option<usize>,
        cells: &[usize],
    ) -> Result<Self> {
        let mut partition = Self::for_cells(world, grid, brick, cells, None)?;
        let (units, ranks) = (partition.unit_count(), world.size());
        partition.owner = (0..units)
            .map(|unit| match &partition.units {
                Units::Bricks(bricks) => bricks.along_x(unit),
                Units::Cells(_) => (unit, units),
            })
            .map(|(place, places)| (place * ranks / places) as u32)
            .collect();
        Ok(partition)
    }

    /// A new partition into the same units for where the points are now. Few points move: units
    /// are handed over between neighbours, or, if that levels badly or frays the parts, dealt
    /// out anew with each part kept by the rank that holds most of it. Collective. Errors as in
    /// [`Self::build`].
    pub fn rebuild(
        &self,
        world: &World,
        grid: &Grid<D>,
        points: &Points<D>,
        costs: Option<&[f64]>,
    ) -> Result<Self> {
        let cells = super::migrate::locate(world, grid, points)?;
        let mut partition = self.clone();
        partition.assign(world, grid, &cells, costs)?;
        Ok(partition)
    }

    /// The same partition in bricks of half the side; `None` where they cannot be smaller.
    pub fn refined(&self, grid: &Grid<D>) -> Option<Self> {
        let (Units::Bricks(bricks), Grid::Lattice(lattice)) = (&self.units, grid) else {
            return None;
        };
        let finer = Bricks::new(lattice, bricks.side() / 2);
        if bricks.side() < 2 || finer.count() > bricks::LARGEST_TABLE {
            return None;
        }
        let owner = (0..finer.count())
            .map(|unit| self.owner[bricks.of_cell(finer.first_cell(unit))])
            .collect();
        Some(Partition { units: Units::Bricks(finer), owner })
    }

    /// A partition as it was: bricks of `brick` cells a side, or the cells of a mesh, with their
    /// owners. `None` if they do not fit the grid or `ranks`.
    pub fn restore(
        grid: &Grid<D>,
        brick: Option<usize>,
        owner: Vec<u32>,
        ranks: usize,
    ) -> Option<Self> {
        let units = match (grid, brick) {
            (Grid::Lattice(lattice), Some(side)) => Units::Bricks(Bricks::new(lattice, side)),
            (Grid::Mesh(_), None) => Units::Cells(CellGraph::of(grid)),
            _ => return None,
        };
        let partition = Partition { units, owner };
        let fits = partition.owner.len() == partition.unit_count()
            && partition.owner.iter().all(|&rank| (rank as usize) < ranks);
        fits.then_some(partition)
    }

    /// Cells per side of the bricks; `None` on a mesh.
    pub fn brick(&self) -> Option<usize> {
        match &self.units {
            Units::Bricks(bricks) => Some(bricks.side()),
            Units::Cells(_) => None,
        }
    }

    /// Rank that owns a cell.
    pub fn owner_of_cell(&self, grid: &Grid<D>, cell: usize) -> usize {
        self.owner[self.unit_of_cell(grid, cell)] as usize
    }

    /// On a lattice the owner of the cell with the node's index (the last one at upper edges);
    /// on a mesh that of the lowest-numbered cell at the node.
    pub fn owner_of_node(&self, grid: &Grid<D>, node: usize) -> usize {
        let unit = match (&self.units, grid) {
            (Units::Bricks(bricks), Grid::Lattice(lattice)) => {
                bricks.of_node(lattice.node_index(node))
            }
            (Units::Cells(graph), _) => graph.of_node(node),
            #[allow(unreachable_patterns)]
            _ => unreachable!("bricks are made for lattices only"),
        };
        self.owner[unit] as usize
    }

    /// Number of the brick, or of the cell on a mesh, that a cell belongs to.
    pub fn unit_of_cell(&self, grid: &Grid<D>, cell: usize) -> usize {
        match (&self.units, grid) {
            (Units::Bricks(bricks), Grid::Lattice(lattice)) => {
                bricks.of_cell(lattice.cell_index(cell))
            }
            _ => cell,
        }
    }

    /// Rank of each unit.
    pub fn owners(&self) -> &[u32] {
        &self.owner
    }

    /// For the report: "1536 bricks of 8 cells a side", "640 cells".
    pub fn describe(&self) -> String {
        match &self.units {
            Units::Bricks(b) => format!("{} bricks of {} cells a side", b.count(), b.side()),
            Units::Cells(graph) => format!("{} cells", graph.count()),
        }
    }

    /// Bytes held on every rank.
    pub fn replicated_bytes(&self) -> usize {
        let units = match &self.units {
            Units::Bricks(_) => 0,
            Units::Cells(graph) => graph.bytes(),
        };
        4 * self.owner.len() + units
    }

    fn unit_count(&self) -> usize {
        match &self.units {
            Units::Bricks(bricks) => bricks.count(),
            Units::Cells(graph) => graph.count(),
        }
    }

    fn neighbours(&self, unit: usize, visit: impl FnMut(usize, usize)) {
        match &self.units {
            Units::Bricks(bricks) => bricks.neighbours(unit, visit),
            Units::Cells(graph) => graph.neighbours(unit, visit),
        }
    }

    /// Fills the table: costs to the root, METIS there, the table to everybody.
    fn assign(
        &mut self,
        world: &World,
        grid: &Grid<D>,
        cells: &[usize],
        costs: Option<&[f64]>,
    ) -> Result<()> {
        let mut load: FxHashMap<u64, f64> = FxHashMap::default();
        for (p, &cell) in cells.iter().enumerate() {
            let cost = costs.map_or(1.0, |costs| costs[p]);
            *load.entry(self.unit_of_cell(grid, cell) as u64).or_default() += cost;
        }
        let mut load: Vec<UnitCost> =
            load.into_iter().map(|(unit, cost)| UnitCost { unit, cost }).collect();
        load.sort_unstable_by_key(|entry| entry.unit);
        let gathered = exchange(world, vec![(0, load)])?;

        let mut table = Vec::new();
        let mut outcome = Ok(());
        if world.is_root() {
            let (all, holders) = joined(gathered);
            match self.deal(&all, &holders, world.size()) {
                Ok(owners) => table = owners,
                Err(error) => outcome = Err(error),
            }
        }
        world.fail_together(outcome)?;
        let mut bytes: Vec<u8> = bytemuck::cast_slice(&table).to_vec();
        world.broadcast_bytes(0, &mut bytes);
        self.owner = bytes
            .chunks_exact(size_of::<u32>())
            .map(|word| u32::from_ne_bytes(word.try_into().expect("four bytes")))
            .collect();
        Ok(())
    }

    /// The table of owners, from the costs of the populated units in ascending order and, for a
    /// first partition, the ranks that hold most of them.
    fn deal(&self, load: &[UnitCost], holders: &[u32], ranks: usize) -> Result<Vec<u32>> {
        let mut graph = Graph { offsets: vec![0], ..Graph::default() };
        let mut place = vec![NOBODY; self.unit_count()];
        for (k, entry) in load.iter().enumerate() {
            place[entry.unit as usize] = k as u32;
        }
        for entry in load {
            self.neighbours(entry.unit as usize, |other, weight| {
                if place[other] != NOBODY {
                    graph.neighbours.push(place[other] as i32);
                    graph.contacts.push(weight as i32);
                }
            });
            graph.offsets.push(graph.neighbours.len() as i32);
            graph.costs.push(entry.cost.max(f64::MIN_POSITIVE));
        }
        let mut part = metis::split(&graph, ranks)?;
        if self.owner.is_empty() {
            relabel(&mut part, holders, &graph.costs, ranks);
        } else if !load.is_empty() {
            let old: Vec<u32> = load.iter().map(|e| self.owner[e.unit as usize]).collect();
            relabel(&mut part, &old, &graph.costs, ranks);
            let mut near = old;
            let reached = diffuse::level(&graph, &mut near, ranks, LEVEL_ENOUGH);
            let goal = LEVEL_ENOUGH.max(largest_over_mean(&graph.costs, &part, ranks));
            let frayed =
                diffuse::cut(&graph, &near) as f64 > FRAYED * diffuse::cut(&graph, &part) as f64;
            if reached <= goal && !frayed {
                part = near;
            }
        }
        let mut owner = vec![NOBODY; self.unit_count()];
        for (entry, &rank) in load.iter().zip(&part) {
            owner[entry.unit as usize] = rank;
        }
        self.spread(&mut owner);
        Ok(owner)
    }

    /// Gives empty units the owner of the nearest populated one, counted in steps between
    /// neighbours; of equally near ones the one reached first from the lowest-numbered units.
    fn spread(&self, owner: &mut [u32]) {
        let mut front: VecDeque<usize> =
            (0..owner.len()).filter(|&unit| owner[unit] != NOBODY).collect();
        while let Some(unit) = front.pop_front() {
            let rank = owner[unit];
            self.neighbours(unit, |other, _| {
                if owner[other] == NOBODY {
                    owner[other] = rank;
                    front.push_back(other);
                }
            });
        }
        // No points at all, or parts of a mesh that hang together with none of them.
        owner.iter_mut().filter(|rank| **rank == NOBODY).for_each(|rank| *rank = 0);
    }
}

/// Sums over what the ranks (ascending) have sent of their units: the costs added up, ascending by unit, and the
/// rank that holds most of each.
fn joined(gathered: Vec<(usize, Vec<UnitCost>)>) -> (Vec<UnitCost>, Vec<u32>) {
    let mut all: Vec<(UnitCost, usize)> = gathered
        .into_iter()
        .flat_map(|(rank, list)| list.into_iter().map(move |entry| (entry, rank)))
        .collect();
    // Stable: costs of one unit are added in the order of the ranks.
    all.sort_by_key(|(entry, _)| entry.unit);
    let (mut load, mut holders): (Vec<UnitCost>, Vec<u32>) = Default::default();
    let mut most = 0.0;
    for (entry, rank) in all {
        match (load.last_mut(), holders.last_mut()) {
            (Some(sum), Some(holder)) if sum.unit == entry.unit => {
                sum.cost += entry.cost;
                if entry.cost > most {
                    (most, *holder) = (entry.cost, rank as u32);
                }
            }
            _ => {
                load.push(entry);
                holders.push(rank as u32);
                most = entry.cost;
            }
        }
    }
    (load, holders)
}

fn largest_over_mean(costs: &[f64], part: &[u32], parts: usize) -> f64 {
    let mut load = vec![0.0; parts];
    part.iter().zip(costs).for_each(|(&p, cost)| load[p as usize] += cost);
    load.iter().copied().fold(0.0, f64::max) * parts as f64 / costs.iter().sum::<f64>()
}

/// Renames parts so that as much cost as possible stays with its old owner: the largest overlaps
/// first. `part`, `old` and `cost` are per unit.
pub fn relabel(part: &mut [u32], old: &[u32], cost: &[f64], parts: usize) {
    let mut overlap: FxHashMap<(u32, u32), f64> = FxHashMap::default();
    for ((&part, &old), cost) in part.iter().zip(old).zip(cost) {
        *overlap.entry((part, old)).or_default() += cost;
    }
    let mut pairs: Vec<((u32, u32), f64)> = overlap.into_iter().collect();
    pairs.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let mut name = vec![NOBODY; parts];
    let mut taken = vec![false; parts];
    for ((part, old), _) in pairs {
        if name[part as usize] == NOBODY && !taken[old as usize] {
            name[part as usize] = old;
            taken[old as usize] = true;
        }
    }
    let mut free = (0..parts as u32).filter(|&rank| !taken[rank as usize]);
    for name in name.iter_mut().filter(|name| **name == NOBODY) {
        *name = free.next().expect("as many names as parts");
    }
    part.iter_mut().for_each(|part| *part = name[*part as usize]);
}

/// Largest over mean of the ranks' costs; 1 where there is none. Collective.
pub fn imbalance(world: &World, cost: f64) -> f64 {
    let mean = world.sum(cost) / world.size() as f64;
    let largest = world.max(cost);
    if mean > 0.0 { largest / mean } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Lattice;

    fn bricks(cells: [usize; 2], side: usize) -> Partition<2> {
        let lattice = Lattice { origin: [0.0; 2], spacing: [1.0; 2], cells };
        Partition { units: Units::Bricks(Bricks::new(&lattice, side)), owner: Vec::new() }
    }

    fn load(units: impl IntoIterator<Item = u64>) -> Vec<UnitCost> {
        units.into_iter().map(|unit| UnitCost { unit, cost: 1.0 }).collect()
    }

    #[test]
    fn every_unit_gets_an_owner() {
        let partition = bricks([40, 30], 2);
        for ranks in [1, 2, 5, 9] {
            // The lowest three rows of bricks are populated.
            let owner = partition.deal(&load(0..60), &[0; 60], ranks).unwrap();
            assert_eq!(owner.len(), 20 * 15);
            assert!(owner.iter().all(|&rank| (rank as usize) < ranks));
            assert_eq!(owner, partition.deal(&load(0..60), &[0; 60], ranks).unwrap());
            // An empty brick takes an owner from the populated row below, one column aside at
            // most per row of distance.
            for unit in 60..300 {
                let (i, j) = (unit % 20, unit / 20);
                let near = (0..20usize).filter(|k| k.abs_diff(i) <= j - 2);
                assert!(near.map(|k| owner[40 + k]).any(|rank| rank == owner[unit]));
            }
        }
    }

    #[test]
    fn few_or_no_populated_units_leave_ranks_empty() {
        let partition = bricks([8, 8], 4);
        assert_eq!(partition.deal(&load([]), &[], 3).unwrap(), [0; 4]);
        let owner = partition.deal(&load([1, 2]), &[0, 1], 7).unwrap();
        assert_eq!((owner[1], owner[2]), (0, 1));
        assert!(owner.iter().all(|&rank| rank < 2));
    }

    #[test]
    fn a_first_partition_leaves_units_where_most_of_them_is() {
        let partition = bricks([40, 40], 2);
        let held = |unit: u64| if unit % 20 < 10 { 1 } else { 0 };
        let of = |rank: u32| -> Vec<UnitCost> {
            // A tenth of each unit lies on the other rank.
            let share = |unit| if held(unit) == rank { 0.9 } else { 0.1 };
            (0..400).map(|unit| UnitCost { unit, cost: share(unit) }).collect()
        };
        let (load, holders) = joined(vec![(0, of(0)), (1, of(1))]);
        assert!(load.iter().zip(0..400).all(|(entry, k)| entry.unit == k && entry.cost == 1.0));
        assert!(holders.iter().zip(0..400).all(|(&rank, unit)| rank == held(unit)));
        let owner = partition.deal(&load, &holders, 2).unwrap();
        let stay = owner.iter().zip(&holders).filter(|(owner, holder)| owner == holder).count();
        assert!(stay >= 200, "{stay} of 400");
    }

    #[test]
    fn parts_keep_their_owners_where_they_can() {
        let mut part = vec![0, 0, 1, 1, 2, 2];
        relabel(&mut part, &[2, 2, 0, 1, 1, 1], &[1.0; 6], 3);
        assert_eq!(part, [2, 2, 0, 0, 1, 1]);
        // One unit changes hands, not all.
        let mut partition = bricks([40, 40], 2);
        partition.owner = partition.deal(&load(0..400), &[0; 400], 4).unwrap();
        let again = partition.deal(&load(0..400), &[], 4).unwrap();
        assert_eq!(again, partition.owner);
        // A part nobody held before takes a free name.
        let mut part = vec![1, 0, 2];
        relabel(&mut part, &[0, 0, 0], &[3.0, 2.0, 1.0], 3);
        assert_eq!(part, [0, 1, 2]);
    }
}
