//! The points of a step with their basis functions, as the equations see them.

use crate::basis::{Groups, Influences};
use crate::deck::model::PointVolume;
use crate::material::Material;
use crate::points::Points;

use super::border::{Border, Part};

/// What a step's points look like to the equations: fixed while the step is solved.
#[derive(Clone, Copy)]
pub struct StepPoints<'a, const D: usize> {
    /// At the start of the step.
    pub points: &'a Points<D>,
    /// One material per body.
    pub materials: &'a [Material],
    /// Their basis functions.
    pub influences: &'a Influences<D>,
    /// Points that touch the same nodes.
    pub groups: &'a Groups,
    /// Local node index of each entry of `groups.nodes`.
    pub group_nodes: &'a [u32],
    /// Groups that touch nodes of other ranks, and the others.
    pub border: &'a Border,
    /// What stresses are integrated over.
    pub volume: PointVolume,
}

impl<'a, const D: usize> StepPoints<'a, D> {
    /// Local nodes of a group of points.
    #[inline]
    pub fn nodes_of_group(&self, group: usize) -> &'a [u32] {
        let offsets = &self.groups.node_offsets;
        &self.group_nodes[offsets[group]..offsets[group + 1]]
    }

    /// Groups of a part of the work.
    pub fn groups_of(&self, part: Part) -> impl Iterator<Item = usize> + use<'a, D> {
        self.border.of(part).iter().cloned().flatten()
    }

    /// Local nodes of point `p`, in the order of its influences.
    #[inline]
    pub fn nodes_of(&self, p: usize) -> &'a [u32] {
        self.nodes_of_group(self.groups.group_of_point[p])
    }
}
