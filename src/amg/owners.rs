//! Who owns the nodes of a coarse level: the ranks of their roots while each has plenty of nodes, then one of
//! every 2, 4, 8, ... ranks. With a few nodes on each of many ranks all time would go into messages.

use crate::petsc::Index;
use std::ops::Range;

use crate::error::Result;
use crate::parallel::{World, exchange};

use super::aggregate::Aggregates;
use super::level::Nodes;

/// Nodes of a level, on average, that a rank should have.
const ENOUGH: usize = 100;

/// First coarse node of each rank. Those without nodes begin where the next one does.
pub struct Owners {
    first: Vec<usize>,
    /// So many ranks have given their nodes to one of them.
    together: usize,
    rank: usize,
    total: usize,
}

impl Owners {
    /// Collective.
    pub fn of(world: &World, aggregates: &Aggregates) -> Self {
        let total = aggregates.total;
        let first = world.gather(aggregates.first as u64);
        let mut first: Vec<usize> = first.into_iter().map(|first| first as usize).collect();
        let together = together(first.len(), total);
        for begin in (0..first.len()).step_by(together) {
            let end = first.len().min(begin + together);
            let (from, to) = (first[begin], first.get(end).copied().unwrap_or(total));
            // The middle one: another for each size of groups, so that nobody serves on two levels.
            let owner = (begin + together / 2).min(end - 1);
            first[begin..=owner].fill(from);
            first[owner + 1..end].fill(to);
        }
        Owners { first, together, rank: world.rank(), total }
    }

    /// Of this rank.
    pub fn owned(&self) -> Range<usize> {
        let end = self.first.get(self.rank + 1).copied().unwrap_or(self.total);
        self.first[self.rank]..end
    }

    pub fn of_number(&self, number: Index) -> usize {
        self.first.partition_point(|&first| first <= number as usize) - 1
    }

    /// Key and position of the roots behind the owned nodes, four numbers each. Collective.
    pub fn roots(&self, world: &World, fine: &Nodes, aggregates: &Aggregates) -> Result<Vec<f64>> {
        let mut values = Vec::with_capacity(aggregates.roots.len() * 4);
        for &root in &aggregates.roots {
            values.push(fine.key[root as usize]);
            values.extend(fine.position[root as usize]);
        }
        if self.together == 1 {
            return Ok(values);
        }
        // They are consecutive, and those of all members of a group go to the same rank.
        let outgoing = match aggregates.roots.len() {
            0 => Vec::new(),
            _ => vec![(self.of_number(aggregates.first as Index), values)],
        };
        // In ascending order of the ranks, as the nodes are.
        Ok(exchange(world, outgoing)?.into_iter().flat_map(|(_, values)| values).collect())
    }
}

/// How many ranks give their nodes to one of them.
fn together(ranks: usize, nodes: usize) -> usize {
    let mut together = 1;
    while together < ranks && nodes < ENOUGH * ranks.div_ceil(together) {
        together *= 2;
    }
    together
}

#[cfg(test)]
mod tests {
    use super::together;

    #[test]
    fn ranks_give_their_nodes_away_when_they_have_few() {
        assert_eq!([1, 2, 3, 64].map(|ranks| together(ranks, 0)), [1, 2, 4, 64]);
        assert_eq!([100, 99, 50, 25, 1].map(|each| together(64, 64 * each)), [1, 2, 2, 4, 64]);
        // Five ranks: 3 groups of two, 2 of four.
        assert_eq!([500, 499, 300, 299, 200, 199].map(|all| together(5, all)), [1, 2, 2, 4, 4, 8]);
    }
}
