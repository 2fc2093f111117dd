//! Groups of nodes that become one node of the next level: around each root the nodes strongly
//! coupled to it, then those two couplings away.
//!
//! Roots are a maximal set of nodes more than one or two strong couplings apart (Bell, Dalton and
//! Olson, SIAM J. Sci. Comput. 34 (2012) C123): the node with the highest key among all within that
//! distance becomes one. Keys belong to nodes, so that the groups are the same on any number of
//! ranks.

use crate::error::Result;
use crate::parallel::World;
use crate::petsc::Index;

use super::level::Nodes;
use super::strength::Strong;

/// The group of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Group {
    /// Global number of the coarse node.
    pub number: Index,
    /// Key and position of the root.
    pub key: f64,
    pub root: [f64; 3],
}

/// Groups of a level's nodes.
pub struct Aggregates {
    /// Per local node; `None` for nodes without strong couplings, which the smoother solves.
    pub group: Vec<Option<Group>>,
    /// Owned nodes that are roots, in the order of their coarse nodes.
    pub roots: Vec<u32>,
    /// Global number of the first of them.
    pub first: usize,
    /// Coarse nodes of all ranks.
    pub total: usize,
}

/// States of a node while roots are looked for; a candidate has its key, between the two.
const OUT: f64 = 0.0;
const ROOT: f64 = 2.0;

impl Aggregates {
    /// Roots are more than `distance` strong couplings apart, one or two. Collective.
    pub fn find(world: &World, nodes: &Nodes, strong: &Strong, distance: usize) -> Result<Self> {
        let state = roots(world, nodes, strong, distance)?;
        let roots: Vec<u32> =
            (0..nodes.owned as u32).filter(|&node| state[node as usize] == ROOT).collect();
        let (first, total) = (world.exclusive_sum(roots.len()), world.sum_usize(roots.len()));
        let mut group = vec![None; nodes.local()];
        for (k, &root) in roots.iter().enumerate() {
            let (key, position) = (nodes.key[root as usize], nodes.position[root as usize]);
            group[root as usize] =
                Some(Group { number: (first + k) as Index, key, root: position });
        }
        let mut aggregates = Aggregates { group, roots, first, total };
        // Next to several roots, or two couplings away from them, a node has to choose.
        for _ in 0..2 {
            aggregates.share(world, nodes)?;
            aggregates.grow(nodes.owned, strong);
        }
        aggregates.share(world, nodes)?;
        Ok(aggregates)
    }

    /// Nodes next to a group join the one that they are coupled to most.
    fn grow(&mut self, owned: usize, strong: &Strong) {
        let mut sums: Vec<(Group, f32)> = Vec::new();
        let free = (0..owned).filter(|&node| self.group[node].is_none());
        let joins = free.filter_map(|node| {
            sums.clear();
            for &(other, share) in strong.of_node(node) {
                let Some(group) = self.group[other as usize] else { continue };
                match sums.iter_mut().find(|(known, _)| known.number == group.number) {
                    Some((_, sum)) => *sum += share.sqrt(),
                    None => sums.push((group, share.sqrt())),
                }
            }
            let better = |a: &(Group, f32), b: &(Group, f32)| {
                // Equal but for round-off on a lattice: the key decides.
                let even = (a.1 - b.1).abs() <= 1e-4 * a.1.max(b.1);
                if even { a.0.key > b.0.key } else { a.1 > b.1 }
            };
            let best = sums.iter().copied().reduce(|a, b| if better(&b, &a) { b } else { a });
            best.map(|(group, _)| (node, group))
        });
        for (node, group) in joins.collect::<Vec<_>>() {
            self.group[node] = Some(group);
        }
    }

    /// Tells other ranks about the groups of their ghosts.
    fn share(&mut self, world: &World, nodes: &Nodes) -> Result<()> {
        const VALUES: usize = 5;
        let mut values = vec![-1.0; nodes.local() * VALUES];
        let owned = self.group[..nodes.owned].iter().zip(values.chunks_exact_mut(VALUES));
        for (group, values) in owned.filter_map(|(group, values)| Some((group.as_ref()?, values))) {
            let [x, y, z] = group.root;
            values.copy_from_slice(&[group.number as f64, group.key, x, y, z]);
        }
        nodes.halo.forward(world, &mut values, VALUES)?;
        let ghosts = values.chunks_exact(VALUES).zip(&mut self.group).skip(nodes.owned);
        for (values, group) in ghosts {
            *group = (values[0] >= 0.0).then(|| Group {
                number: values[0] as Index,
                key: values[1],
                root: [values[2], values[3], values[4]],
            });
        }
        Ok(())
    }
}

/// The state of each local node: [`ROOT`] or [`OUT`].
fn roots(world: &World, nodes: &Nodes, strong: &Strong, distance: usize) -> Result<Vec<f64>> {
    let mut state = nodes.key.clone();
    for (node, state) in state.iter_mut().enumerate().take(nodes.owned) {
        if strong.of_node(node).is_empty() {
            *state = OUT;
        }
    }
    let highest = |state: &[f64], node: usize| {
        let around = strong.of_node(node).iter().map(|&(other, _)| state[other as usize]);
        around.fold(state[node], f64::max)
    };
    nodes.halo.forward(world, &mut state, 1)?;
    let mut near = vec![OUT; nodes.local()];
    let candidate = |state: f64| state != OUT && state != ROOT;
    while world.any(state[..nodes.owned].iter().any(|&state| candidate(state))) {
        for (node, near) in near.iter_mut().enumerate().take(nodes.owned) {
            *near = if distance == 1 { state[node] } else { highest(&state, node) };
        }
        nodes.halo.forward(world, &mut near, 1)?;
        for node in 0..nodes.owned {
            if candidate(state[node]) {
                let best = highest(&near, node);
                if best == state[node] {
                    state[node] = ROOT;
                } else if best == ROOT {
                    state[node] = OUT;
                }
            }
        }
        nodes.halo.forward(world, &mut state, 1)?;
    }
    Ok(state)
}
