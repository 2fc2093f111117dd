//! `grid-000005.h5` per output step and its lists: the active part of the background grid.

use super::frame::{Array, Frame, Topology};
use crate::deck::model::Element;

/// One rank's share of the active grid. Active nodes are numbered over all ranks, contiguous by
/// rank: the nodes given here are the next ones after those of the lower ranks.
#[derive(Debug, Clone, Copy)]
pub struct GridFrame<'a, const D: usize> {
    pub element: Element,
    /// Owned active nodes, m.
    pub coordinates: &'a [[f64; D]],
    /// Owned active cells: the element's node numbers per cell, row by row.
    pub connectivity: &'a [usize],
    /// Displacement over the last step, m, per owned node.
    pub displacement_increment: &'a [[f64; D]],
    /// Force held by the constraints, N, per owned node; zero where the node is free.
    pub reaction: &'a [[f64; D]],
    /// More numbers per owned node: name and values.
    pub node_fields: &'a [(&'a str, &'a [f64])],
    /// Per owned cell: has a face that carries Ghost stabilisation.
    pub ghost_boundary: &'a [bool],
    /// More numbers per owned cell: name and values.
    pub cell_fields: &'a [(&'a str, &'a [f64])],
}

impl<const D: usize> GridFrame<'_, D> {
    /// What the files show of it.
    pub fn shown(&self, rank: i32) -> Frame<'_> {
        let topology = match self.element {
            Element::Tri3 => Topology::Triangle,
            Element::Quad4 => Topology::Quadrilateral,
            Element::Tet4 => Topology::Tetrahedron,
            Element::Hex8 => Topology::Hexahedron,
        };
        let nodes = self.coordinates.len();
        let cells = self.connectivity.len() / topology.points_per_cell();
        let rank_of = |name, count| Array::integers(name, move || vec![i64::from(rank); count]);
        let flags = || self.ghost_boundary.iter().map(|&flag| i64::from(flag)).collect();
        let mut point_data = vec![
            Array::vectors("displacement_increment", self.displacement_increment)
                .described("m", "over the step"),
            Array::vectors("reaction", self.reaction)
                .described("N", "force held by the constraints"),
        ];
        point_data.extend(more(self.node_fields));
        point_data.push(rank_of("node_rank", nodes));
        let mut cell_data =
            vec![rank_of("cell_rank", cells), Array::integers("ghost_boundary", flags)];
        cell_data.extend(more(self.cell_fields));
        Frame {
            topology,
            points: nodes,
            cells,
            places: Array::vectors("coordinates", self.coordinates)
                .described("m", "nodes, where the step was solved"),
            nodes: "connectivity",
            connectivity: Some(self.connectivity),
            point_data,
            cell_data,
        }
    }
}

fn more<'a>(fields: &'a [(&'a str, &'a [f64])]) -> impl Iterator<Item = Array<'a>> {
    fields.iter().map(|(name, values)| Array::floats(name, || values.to_vec()))
}
