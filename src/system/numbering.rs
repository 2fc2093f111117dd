//! Equations over active nodes: those of populated cells. Each node belongs to one rank; a
//! rank's equations are contiguous and ascend with the node number.

use crate::contact::fields::Fields;
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::parallel::{HaloPlan, Partition, World, exchange};
use crate::petsc::Index;

use super::node_index::{NodeIndex, sort_distinct};

/// Local view of the active nodes: owned ones first (ascending), then ghosts.
#[derive(Debug)]
pub struct Numbering {
    /// Number of nodes owned here.
    pub owned: usize,
    /// Global number of the first one.
    pub offset: usize,
    /// Active nodes of all ranks.
    pub total: usize,
    /// Local index -> grid node.
    pub nodes: Vec<usize>,
    /// Whose nodes they are. Nodes of several fields lie at the same node of the grid.
    pub fields: Fields,
    /// Local index -> node of a field; empty with a single field, where `nodes` says it.
    pub keys: Vec<usize>,
    /// Local index -> global equation number of the node.
    pub global: Vec<Index>,
    /// Node of a field -> local index.
    pub index: NodeIndex,
    /// Owner <-> ghost exchange of nodal values.
    pub halo: HaloPlan,
}

/// Nodes that this rank contributes to, before they are numbered.
#[derive(Debug, Clone)]
pub struct Touched {
    /// Active nodes owned here, ascending: own ones and those that other ranks reach.
    pub owned: Vec<usize>,
    /// (owner, node) of the nodes reached here but owned elsewhere, ascending.
    pub foreign: Vec<(usize, usize)>,
}

impl Touched {
    /// Assigns to their owners the nodes in `reached` (any order, duplicates allowed). Collective.
    pub fn assign<const D: usize>(
        world: &World,
        grid: &Grid<D>,
        partition: &Partition<D>,
        reached: Vec<usize>,
    ) -> Result<Self> {
        Self::assign_by(world, |node| partition.owner_of_node(grid, node), reached)
    }

    /// [`Self::assign`] where `owner_of` gives the rank of a node. Collective.
    pub fn assign_by(
        world: &World,
        owner_of: impl Fn(usize) -> usize,
        mut reached: Vec<usize>,
    ) -> Result<Self> {
        sort_distinct(&mut reached);
        let here = world.rank();
        let mut owned = Vec::with_capacity(reached.len());
        let mut foreign = Vec::new();
        for node in reached {
            match owner_of(node) {
                owner if owner == here => owned.push(node),
                owner => foreign.push((owner, node)),
            }
        }
        foreign.sort_unstable();
        let mut outgoing: Vec<(usize, Vec<u64>)> = Vec::new();
        for &(owner, node) in &foreign {
            match outgoing.last_mut() {
                Some((rank, list)) if *rank == owner => list.push(node as u64),
                _ => outgoing.push((owner, vec![node as u64])),
            }
        }
        for (_, nodes) in exchange(world, outgoing)? {
            owned.extend(nodes.iter().map(|&node| node as usize));
        }
        owned.sort_unstable();
        owned.dedup();
        Ok(Touched { owned, foreign })
    }
}

impl Numbering {
    /// Numbers the owned nodes and fetches the numbers of `ghosts`, pairs (owner, node) without
    /// duplicates in ascending order. Collective.
    pub fn build(world: &World, owned: Vec<usize>, ghosts: &[(usize, usize)]) -> Result<Self> {
        let count = owned.len();
        let offset = world.exclusive_sum(count);
        let total = world.sum_usize(count);
        if total > Index::MAX as usize / 3 {
            return Err(Error::Run(format!(
                "{total} active nodes need more equations than the indices of this PETSc can number; \
                 use a coarser grid or a PETSc with 64-bit indices"
            )));
        }
        let mut nodes = owned;
        nodes.extend(ghosts.iter().map(|&(_, node)| node));
        let index = NodeIndex::new(nodes.iter().copied());
        let halo = HaloPlan::build(world, count, ghosts, |node| {
            index.get(node).map(|i| i as usize).filter(|&i| i < count)
        })?;
        let mut numbers: Vec<f64> =
            (0..nodes.len()).map(|i| if i < count { (offset + i) as f64 } else { -1.0 }).collect();
        halo.forward(world, &mut numbers, 1)?;
        Ok(Numbering {
            owned: count,
            offset,
            total,
            nodes,
            fields: Fields::default(),
            keys: Vec::new(),
            global: numbers.into_iter().map(|number| number as Index).collect(),
            index,
            halo,
        })
    }

    /// The same nodes, taken as those of `fields`.
    pub fn in_fields(mut self, fields: &Fields) -> Self {
        if !fields.is_single() {
            self.keys.clone_from(&self.nodes);
            self.nodes.iter_mut().for_each(|node| *node = fields.place(*node));
            self.fields = fields.clone();
        }
        self
    }

    /// Owned and ghost nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether this rank knows no node.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Local index of the node of a field that is active here; of a grid node with a single field.
    pub fn local(&self, node: usize) -> Option<usize> {
        self.index.get(node).map(|i| i as usize)
    }

    /// What [`Self::local`] finds a local node by.
    pub fn key(&self, local: usize) -> usize {
        self.keys.get(local).copied().unwrap_or(self.nodes[local])
    }

    /// Local index at a grid node of the field that a body moves in.
    pub fn local_of(&self, body: usize, node: usize) -> Option<usize> {
        self.local(self.fields.node(body, node))
    }
}
