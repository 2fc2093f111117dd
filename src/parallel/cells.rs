//! Units of partition on a mesh: its cells. Joined across faces; a node goes with the
//! lowest-numbered of its cells.
//!
//! Replicated memory: about 4 bytes per node and 4 per cell plus 8 per face and 4 per owner.

use crate::grid::Grid;

/// Adjacency of the cells of any grid.
#[derive(Debug, Clone)]
pub struct CellGraph {
    /// Neighbours of cell c: `neighbours[offsets[c]..offsets[c + 1]]`, ascending.
    offsets: Vec<u32>,
    neighbours: Vec<u32>,
    /// Lowest-numbered cell at each node; `u32::MAX` for a node without cells.
    cell_of_node: Vec<u32>,
}

impl CellGraph {
    pub fn of<const D: usize>(grid: &Grid<D>) -> Self {
        let mut offsets = vec![0];
        let mut neighbours = Vec::new();
        let mut cell_of_node = vec![u32::MAX; grid.node_count()];
        let mut list = Vec::new();
        for cell in 0..grid.cell_count() {
            list.clear();
            grid.face_neighbours(cell, &mut list);
            list.sort_unstable();
            neighbours.extend(list.iter().map(|&n| n as u32));
            offsets.push(neighbours.len() as u32);
            list.clear();
            grid.cell_nodes(cell, &mut list);
            for &node in &list {
                cell_of_node[node] = cell_of_node[node].min(cell as u32);
            }
        }
        CellGraph { offsets, neighbours, cell_of_node }
    }

    pub fn count(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The cell a node goes with; cell 0 for a node that no cell uses.
    pub fn of_node(&self, node: usize) -> usize {
        match self.cell_of_node[node] {
            u32::MAX => 0,
            cell => cell as usize,
        }
    }

    /// Calls `visit` with each neighbour and the weight 1.
    pub fn neighbours(&self, cell: usize, mut visit: impl FnMut(usize, usize)) {
        let range = self.offsets[cell] as usize..self.offsets[cell + 1] as usize;
        for &other in &self.neighbours[range] {
            visit(other as usize, 1);
        }
    }

    /// Replicated bytes.
    pub fn bytes(&self) -> usize {
        4 * (self.offsets.len() + self.neighbours.len() + self.cell_of_node.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Lattice;

    #[test]
    fn faces_join_cells_and_nodes_go_with_the_lowest() {
        let lattice = Lattice { origin: [0.0; 2], spacing: [1.0; 2], cells: [3, 2] };
        let graph = CellGraph::of(&Grid::Lattice(lattice));
        assert_eq!(graph.count(), 6);
        let mut list = Vec::new();
        graph.neighbours(1, |other, weight| list.push((other, weight)));
        assert_eq!(list, [(0, 1), (2, 1), (4, 1)]);
        // Nodes 4 a row: node 5 touches cells 0, 1, 3, 4; node 11 only the last cell.
        assert_eq!((graph.of_node(5), graph.of_node(11)), (0, 5));
    }
}
