//! Smooth modes that smoothed aggregation has to keep: how the nodes of a group move with their coarse node.
//!
//! Displacements have the rigid-body modes, displacement of the root and rotation about it: a node of a
//! coarser level has three degrees of freedom in the plane and six in space. Other unknowns have constants, one
//! degree of freedom each.

use crate::tensor::fused::Block;

/// What the values of a node are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Modes {
    /// Displacements, and on coarser levels rotations.
    #[default]
    RigidMotions,
    /// Unknowns that are smooth where each is constant.
    Constants,
}

/// Each value of the coarse node is that of all nodes of its group.
pub fn constant<const K: usize, const C: usize>() -> Block<K, C> {
    std::array::from_fn(|k| std::array::from_fn(|c| if k == c { 1.0 } else { 0.0 }))
}

/// What a motion of the coarse node does to a node at `offset` (m) from its root: u = t + w x r, with
/// rotations in units of one over `length`. `ratio`: that length of the finer level over this one's,
/// for nodes that rotate themselves.
pub fn carried<const K: usize, const C: usize>(
    offset: [f64; 3],
    length: f64,
    ratio: f64,
) -> Block<K, C> {
    let [x, y, z] = offset.map(|value| value / length);
    let mut motion = [[0.0; C]; K];
    let dimension = if C == 3 { 2 } else { 3 };
    for axis in 0..dimension {
        motion[axis][axis] = 1.0;
    }
    if dimension == 2 {
        motion[0][2] = -y;
        motion[1][2] = x;
    } else {
        (motion[0][4], motion[0][5]) = (z, -y);
        (motion[1][3], motion[1][5]) = (-z, x);
        (motion[2][3], motion[2][4]) = (y, -x);
    }
    for k in dimension..K {
        motion[k][k] = ratio;
    }
    motion
}
