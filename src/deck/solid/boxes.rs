//! A tree of boxes around triangles: only those whose boxes are wanted are looked at.

use super::Place;

/// Triangles in a leaf at most.
const LEAF: usize = 4;

#[derive(Debug)]
pub struct Boxes {
    nodes: Vec<Node>,
    /// Triangles in the order of the leaves.
    order: Vec<u32>,
}

#[derive(Debug)]
struct Node {
    min: Place,
    max: Place,
    /// Of `order`, in a leaf; else empty.
    from: u32,
    to: u32,
    /// The second child; the first is the next node.
    second: u32,
}

impl Node {
    /// Square of the distance of a place outside, m2.
    fn beyond(&self, x: &Place) -> f64 {
        let along = |a: usize| (self.min[a] - x[a]).max(x[a] - self.max[a]).max(0.0);
        (0..3).map(|a| along(a).powi(2)).sum()
    }
}

impl Boxes {
    pub fn new(triangles: &[[Place; 3]]) -> Self {
        let mut boxes = Boxes { nodes: Vec::new(), order: (0..triangles.len() as u32).collect() };
        let count = triangles.len();
        boxes.build(triangles, 0, count);
        boxes
    }

    /// Splits at the median of the middles along the longest side; returns the node.
    fn build(&mut self, triangles: &[[Place; 3]], from: usize, to: usize) -> usize {
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for &index in &self.order[from..to] {
            for x in &triangles[index as usize] {
                for a in 0..3 {
                    (min[a], max[a]) = (min[a].min(x[a]), max[a].max(x[a]));
                }
            }
        }
        let node = self.nodes.len();
        let leaf = to - from <= LEAF;
        let range = if leaf { (from as u32, to as u32) } else { (0, 0) };
        self.nodes.push(Node { min, max, from: range.0, to: range.1, second: 0 });
        if leaf {
            return node;
        }
        let length = |a: usize| max[a] - min[a];
        let axis = (0..3).max_by(|&a, &b| length(a).total_cmp(&length(b))).unwrap_or(0);
        let middle = |index: &u32| triangles[*index as usize].iter().map(|x| x[axis]).sum::<f64>();
        let half = (to - from) / 2;
        self.order[from..to]
            .select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
        self.build(triangles, from, from + half);
        let second = self.build(triangles, from + half, to);
        self.nodes[node].second = second as u32;
        node
    }

    /// Around everything.
    pub fn bounds(&self) -> (Place, Place) {
        self.nodes.first().map_or(([0.0; 3], [0.0; 3]), |node| (node.min, node.max))
    }

    /// Calls `distance`, which gives the square of the distance from `x`, with several triangles; the
    /// nearest one is among them.
    pub fn nearest(&self, x: &Place, mut distance: impl FnMut(usize) -> f64) {
        let mut best = f64::INFINITY;
        let mut stack = vec![0usize];
        while let Some(index) = stack.pop() {
            let Some(node) = self.nodes.get(index) else { continue };
            if node.beyond(x) >= best {
                continue;
            }
            if node.second == 0 {
                for &triangle in &self.order[node.from as usize..node.to as usize] {
                    best = best.min(distance(triangle as usize));
                }
                continue;
            }
            let children = [index + 1, node.second as usize];
            let far =
                children.map(|child| self.nodes.get(child).map_or(0.0, |node| node.beyond(x)));
            // The nearer one is looked at first.
            let [first, last] =
                if far[0] <= far[1] { children } else { [children[1], children[0]] };
            stack.extend([last, first]);
        }
    }

    /// Calls `act` with the triangles in leaves that are `wanted` by their corners.
    pub fn visit(&self, wanted: impl Fn(&Place, &Place) -> bool, mut act: impl FnMut(usize)) {
        let mut stack = vec![0usize];
        while let Some(index) = stack.pop() {
            let Some(node) = self.nodes.get(index) else { continue };
            if !wanted(&node.min, &node.max) {
                continue;
            }
            if node.second == 0 {
                let leaf = &self.order[node.from as usize..node.to as usize];
                leaf.iter().for_each(|&triangle| act(triangle as usize));
            } else {
                stack.extend([node.second as usize, index + 1]);
            }
        }
    }
}
