//! Points that touch the same nodes: the assembly accumulates one dense block for each group
//! and adds it to the system once (Lagrangian eq. 27, sum over points).

use rustc_hash::FxHashMap;

use super::Influences;

/// Points grouped by identical node lists. Groups are numbered as they are first met and list
/// their points in ascending order, so the result depends on nothing but the influences.
#[derive(Debug, Clone, Default)]
pub struct Groups {
    /// Group of each point.
    pub group_of_point: Vec<usize>,
    /// Nodes of group g are `nodes[node_offsets[g]..node_offsets[g + 1]]`, ascending.
    pub node_offsets: Vec<usize>,
    /// Nodes of each group, ascending, one group after the other.
    pub nodes: Vec<usize>,
    /// Points of group g are `points[point_offsets[g]..point_offsets[g + 1]]`.
    pub point_offsets: Vec<usize>,
    /// Points of each group, one group after the other.
    pub points: Vec<usize>,
}

impl Groups {
    /// Groups the rows of `influences`.
    pub fn new<const D: usize>(influences: &Influences<D>) -> Self {
        Self::of_rows(&influences.offsets, &influences.nodes)
    }

    /// Groups rows whose nodes are others than those of the grid: `node` of a point and a node of the
    /// grid, ascending with it.
    pub fn renamed<const D: usize>(
        influences: &Influences<D>,
        node: impl Fn(usize, usize) -> usize,
    ) -> Self {
        let rows = 0..influences.len();
        let of = |p: usize| influences.nodes[influences.row(p)].iter().map(move |&n| (p, n));
        let nodes: Vec<usize> = rows.flat_map(of).map(|(p, n)| node(p, n)).collect();
        Self::of_rows(&influences.offsets, &nodes)
    }

    /// Row p is `nodes[offsets[p]..offsets[p + 1]]`.
    fn of_rows(offsets: &[usize], nodes: &[usize]) -> Self {
        let count = offsets.len().saturating_sub(1);
        let mut groups = Groups { node_offsets: vec![0], ..Groups::default() };
        groups.group_of_point.reserve(count);
        // Few rows share their first node; those that do are chained.
        let mut first_with: FxHashMap<usize, usize> =
            FxHashMap::with_capacity_and_hasher(count / 4, Default::default());
        let mut next_with: Vec<Option<usize>> = Vec::new();
        let mut sizes: Vec<usize> = Vec::new();
        for p in 0..count {
            let row = &nodes[offsets[p]..offsets[p + 1]];
            // Sorted points mostly repeat their predecessor's row.
            let before = groups.group_of_point.last().copied();
            let group = match before.filter(|&g| same(groups.nodes(g), row)) {
                Some(same) => same,
                None => {
                    let key = row.first().copied().unwrap_or(usize::MAX);
                    let head = first_with.get(&key).copied();
                    let mut found = head;
                    while let Some(g) = found.filter(|&g| !same(groups.nodes(g), row)) {
                        found = next_with[g];
                    }
                    found.unwrap_or_else(|| {
                        let new = groups.len();
                        groups.nodes.extend_from_slice(row);
                        groups.node_offsets.push(groups.nodes.len());
                        next_with.push(head);
                        sizes.push(0);
                        first_with.insert(key, new);
                        new
                    })
                }
            };
            sizes[group] += 1;
            groups.group_of_point.push(group);
        }
        groups.sort_points(&sizes);
        groups
    }

    /// Number of groups.
    pub fn len(&self) -> usize {
        self.node_offsets.len().saturating_sub(1)
    }

    /// Whether there is no group.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Nodes of a group, ascending.
    #[inline]
    pub fn nodes(&self, group: usize) -> &[usize] {
        &self.nodes[self.node_offsets[group]..self.node_offsets[group + 1]]
    }

    /// Points of a group, ascending.
    #[inline]
    pub fn points(&self, group: usize) -> &[usize] {
        &self.points[self.point_offsets[group]..self.point_offsets[group + 1]]
    }

    fn sort_points(&mut self, sizes: &[usize]) {
        self.point_offsets.push(0);
        let mut sum = 0;
        let mut cursor = Vec::with_capacity(sizes.len());
        for size in sizes {
            cursor.push(sum);
            sum += size;
            self.point_offsets.push(sum);
        }
        self.points.resize(sum, 0);
        for (p, &group) in self.group_of_point.iter().enumerate() {
            self.points[cursor[group]] = p;
            cursor[group] += 1;
        }
    }
}

/// Rows are too short for the call that comparing slices would make.
#[inline]
fn same(a: &[usize], b: &[usize]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a == b)
}
