//! Cells around the boundaries of bodies: which bodies populate them, on this rank and its neighbours.

use rustc_hash::FxHashMap;

use crate::grid::FacePair;

/// A face, or a tie of two simplices as if they shared one, with its bodies, one bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoundaryFace {
    pub pair: FacePair,
    pub bodies: u64,
}

/// The bodies of a cell, which is sent to neighbour ranks.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Cell {
    /// Bodies that populate the cell, one bit each.
    pub populated: u64,
    /// Bodies for which it is a boundary cell.
    pub boundary: u64,
    /// Bodies for which it is an empty simplex between two populated ones.
    pub bridge: u64,
}

impl Cell {
    /// Its number and its bodies, as a message has them.
    pub fn record(self, cell: u64) -> [u64; 4] {
        [cell, self.populated, self.boundary, self.bridge]
    }
}

/// The populated cells of this rank, ascending, and those that other ranks have sent.
pub(crate) struct KnownCells {
    first: usize,
    /// Index in `own` of each cell from number `first` on; empty where the numbers lie far apart.
    table: Vec<u32>,
    pub numbers: Vec<usize>,
    /// Of the populated ones of this rank.
    pub own: Vec<Cell>,
    /// Those of other ranks, and empty ones of this rank.
    pub others: FxHashMap<usize, Cell>,
}

impl KnownCells {
    pub fn new(populated: &[(usize, u64)]) -> Self {
        let first = populated.first().map_or(0, |own| own.0);
        let range = populated.last().map_or(0, |own| own.0 + 1 - first);
        let mut table = Vec::new();
        if range / 16 <= populated.len() {
            table.resize(range, u32::MAX);
            for (at, (cell, _)) in populated.iter().enumerate() {
                table[cell - first] = at as u32;
            }
        }
        let own =
            populated.iter().map(|own| Cell { populated: own.1, ..Cell::default() }).collect();
        let numbers = populated.iter().map(|own| own.0).collect();
        KnownCells { first, table, numbers, own, others: FxHashMap::default() }
    }

    #[inline]
    pub fn get(&self, cell: usize) -> Option<&Cell> {
        self.place(cell).map(|at| &self.own[at]).or_else(|| self.others.get(&cell))
    }

    pub fn entry(&mut self, cell: usize) -> &mut Cell {
        match self.place(cell) {
            Some(at) => &mut self.own[at],
            None => self.others.entry(cell).or_default(),
        }
    }

    /// Takes in the [`Cell::record`]s of cells of other ranks.
    pub fn insert_records(&mut self, records: &[u64]) {
        for record in records.chunks_exact(4) {
            let state = Cell { populated: record[1], boundary: record[2], bridge: record[3] };
            self.others.insert(record[0] as usize, state);
        }
    }

    /// Index of a populated cell of this rank.
    #[inline]
    fn place(&self, cell: usize) -> Option<usize> {
        if self.table.is_empty() {
            return self.numbers.binary_search(&cell).ok();
        }
        let place = self.table.get(cell.wrapping_sub(self.first));
        place.filter(|&&at| at != u32::MAX).map(|&at| at as usize)
    }
}
