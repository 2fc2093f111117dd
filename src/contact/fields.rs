//! Velocity fields: bodies that touch each other by a law have velocities of their own at the nodes that
//! they share (Bardenhagen et al. 2001). All other bodies move in field 0 together.
//!
//! Field f has the nodes `node + f * nodes`, so that everything that numbers and sums over nodes works on
//! fields as it does on a grid of as many sheets.

/// The field of each body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Fields {
    /// Empty: all are in field 0.
    of_body: Vec<usize>,
    /// Of the grid.
    nodes: usize,
}

impl Fields {
    /// A field for each of the bodies that are `touching` (in any order, also repeated).
    pub fn of_bodies(
        bodies: usize,
        touching: impl IntoIterator<Item = usize>,
        nodes: usize,
    ) -> Self {
        let mut marks = vec![false; bodies];
        touching.into_iter().for_each(|body| marks[body] = true);
        if !marks.contains(&true) {
            return Fields::default();
        }
        let mut last = 0;
        let field = |own| {
            last += usize::from(own);
            if own { last } else { 0 }
        };
        Fields { of_body: marks.into_iter().map(field).collect(), nodes }
    }

    /// A field for each class of bodies that move together; `classes`: any numbers, one per body.
    pub fn of_classes(classes: &[usize], nodes: usize) -> Self {
        let mut known = classes.to_vec();
        known.sort_unstable();
        known.dedup();
        if known.len() < 2 {
            return Fields::default();
        }
        let field = |class: &usize| known.partition_point(|other| other < class);
        Fields { of_body: classes.iter().map(field).collect(), nodes }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.of_body.iter().max().map_or(1, |last| last + 1)
    }

    /// All bodies move together.
    pub fn is_single(&self) -> bool {
        self.of_body.is_empty()
    }

    pub fn of_body(&self, body: usize) -> usize {
        self.of_body.get(body).copied().unwrap_or(0)
    }

    /// The node of a body's field at a node of the grid.
    pub fn node(&self, body: usize, node: usize) -> usize {
        self.at(self.of_body(body), node)
    }

    /// The node of a field at a node of the grid.
    pub fn at(&self, field: usize, node: usize) -> usize {
        field * self.nodes + node
    }

    /// The node of the grid below that of a field.
    pub fn place(&self, node: usize) -> usize {
        if self.is_single() { node } else { node % self.nodes }
    }

    /// The field of a node.
    pub fn of_node(&self, node: usize) -> usize {
        if self.is_single() { 0 } else { node / self.nodes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_that_touch_get_fields_of_their_own() {
        let fields = Fields::of_bodies(4, [3, 1, 3], 100);
        assert_eq!([0, 1, 2, 3].map(|body| fields.of_body(body)), [0, 1, 0, 2]);
        assert_eq!((fields.node(3, 7), fields.count()), (207, 3));
        assert_eq!((fields.place(207), fields.of_node(207)), (7, 2));
        let single = Fields::of_bodies(4, [], 100);
        assert!(single.is_single() && single.count() == 1);
        assert_eq!((single.node(3, 7), single.place(207), single.of_node(207)), (7, 207, 0));
    }
}
