//! From grid nodes to small indices: a table where the nodes lie close together, as a rank's
//! share of a grid does, a hash map where they do not.

use rustc_hash::FxHashMap;

/// A table may have this many places per node; a hash map needs as much.
const SPREAD: usize = 6;

/// Index of each node of a set.
#[derive(Debug, Clone)]
pub enum NodeIndex {
    /// Places for the nodes from `first` on; `u32::MAX` where there is none.
    Table {
        first: usize,
        places: Vec<u32>,
    },
    Map(FxHashMap<usize, u32>),
}

impl NodeIndex {
    /// Numbers `nodes`, which are distinct, in their order.
    pub fn new(nodes: impl Iterator<Item = usize> + Clone) -> Self {
        let (mut count, mut low, mut high) = (0, usize::MAX, 0);
        for node in nodes.clone() {
            (count, low, high) = (count + 1, low.min(node), high.max(node));
        }
        if count == 0 {
            return NodeIndex::Table { first: 0, places: Vec::new() };
        }
        if (high - low) / SPREAD < count {
            let mut places = vec![u32::MAX; high - low + 1];
            for (i, node) in nodes.enumerate() {
                places[node - low] = i as u32;
            }
            return NodeIndex::Table { first: low, places };
        }
        NodeIndex::Map(nodes.enumerate().map(|(i, node)| (node, i as u32)).collect())
    }

    /// Index of a node, if it is in the set.
    #[inline]
    pub fn get(&self, node: usize) -> Option<u32> {
        match self {
            NodeIndex::Table { first, places } => {
                places.get(node.wrapping_sub(*first)).copied().filter(|&i| i != u32::MAX)
            }
            NodeIndex::Map(map) => map.get(&node).copied(),
        }
    }
}

impl std::ops::Index<usize> for NodeIndex {
    type Output = u32;

    /// Panics if the node is not in the set.
    #[inline]
    fn index(&self, node: usize) -> &u32 {
        match self {
            NodeIndex::Table { first, places } => {
                let place = &places[node.wrapping_sub(*first)];
                assert!(*place != u32::MAX, "node {node} has no index");
                place
            }
            NodeIndex::Map(map) => &map[&node],
        }
    }
}

/// Sorts and drops duplicates: by marks where the nodes lie close together.
pub fn sort_distinct(nodes: &mut Vec<usize>) {
    let (Some(&low), Some(&high)) = (nodes.iter().min(), nodes.iter().max()) else { return };
    if (high - low) / 64 > nodes.len() {
        nodes.sort_unstable();
        nodes.dedup();
        return;
    }
    let mut marks = vec![0u64; (high - low) / 64 + 1];
    for node in nodes.drain(..) {
        marks[(node - low) / 64] |= 1 << ((node - low) % 64);
    }
    for (word, &mark) in marks.iter().enumerate() {
        let mut rest = mark;
        while rest != 0 {
            nodes.push(low + word * 64 + rest.trailing_zeros() as usize);
            rest &= rest - 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_and_map_agree() {
        let close = [7usize, 3, 12, 5];
        let far = [7usize, 3, 1 << 40, 5];
        for nodes in [close, far] {
            let index = NodeIndex::new(nodes.iter().copied());
            assert_eq!(matches!(index, NodeIndex::Table { .. }), nodes == close);
            for (i, &node) in nodes.iter().enumerate() {
                assert_eq!(index.get(node), Some(i as u32));
                assert_eq!(index[node], i as u32);
            }
            for absent in [0, 4, 6, 13, 1 << 50] {
                assert_eq!(index.get(absent), None);
            }
        }
        assert_eq!(NodeIndex::new(std::iter::empty()).get(0), None);
    }

    #[test]
    fn marks_and_sorting_agree() {
        for scale in [1usize, 50, 1 << 30] {
            let nodes: Vec<usize> = (0..200).map(|k| (k * k % 97) * scale + 11).collect();
            let (mut fast, mut plain) = (nodes.clone(), nodes);
            sort_distinct(&mut fast);
            plain.sort_unstable();
            plain.dedup();
            assert_eq!(fast, plain);
        }
        sort_distinct(&mut Vec::new());
    }
}
