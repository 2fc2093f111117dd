//! `rigid-000005.h5` per output step and `rigid.xdmf`: the surfaces of rigid bodies where they are.

use super::frame::{Array, Frame, Topology};

/// Surfaces of all rigid bodies, the same on every rank.
#[derive(Debug, Clone, Default)]
pub struct RigidFrame<const D: usize> {
    /// m
    pub corners: Vec<[f64; D]>,
    /// Segments (2D) or triangles.
    pub facets: Vec<[usize; D]>,
    /// Number of each facet's rigid body in the deck, from zero.
    pub body: Vec<i64>,
}

impl<const D: usize> RigidFrame<D> {
    /// What the files show of it: the first rank, for which `writes` holds, writes what all have.
    pub fn shown(&self, writes: bool) -> Frame<'_> {
        let (corners, facets) = match writes {
            true => (&self.corners[..], &self.facets[..]),
            false => (&[][..], &[][..]),
        };
        let bodies = move || self.body[..facets.len()].to_vec();
        Frame {
            topology: if D == 2 { Topology::Segment } else { Topology::Triangle },
            points: corners.len(),
            cells: facets.len(),
            places: Array::vectors("coordinates", corners),
            nodes: "connectivity",
            connectivity: Some(facets.as_flattened()),
            point_data: Vec::new(),
            cell_data: vec![Array::integers("rigid", bodies)],
        }
    }
}
