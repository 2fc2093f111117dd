//! Domains that lie in several cells, for F-bar: the share of each cell and the cell's rows.
//!
//! The volume of such a domain is that of its parts, det dF_0 = Σ_c w_c det dF_c: what shortens one way only has it
//! as its own det dF. The determinant of the mean Σ_c w_c dF_c, which would need one row only, differs from it by
//! -w_1 w_2 det(dF_1 - dF_2) for two cells in the plane: a change of volume that neither cell has, of second order in the
//! strain of a step, on which a nearly incompressible body's pressure works.

/// The part of a domain that lies in a cell.
#[derive(Debug, Clone, Copy)]
pub struct CellPart<const D: usize> {
    /// w_c, of the domain
    pub share: f64,
    /// Places of the cell's nodes in the point's row: bit a of the index is set at the upper end of axis a.
    pub entries: [u16; 8],
    /// ∇N of these nodes, the mean over the material in the cell, 1/m
    pub gradients: [[f64; D]; 8],
    /// Of rings the mean hoop rows, else zero, 1/m
    pub hoops: [f64; 8],
}

impl<const D: usize> CellPart<D> {
    /// Nodes of a cell
    pub const NODES: usize = 1 << D;

    /// Place in the point's row, gradient and hoop row of each node.
    #[inline]
    pub fn nodes(&self) -> impl Iterator<Item = (usize, &[f64; D], f64)> {
        let places = self.entries[..Self::NODES].iter().map(|&entry| usize::from(entry));
        places.zip(&self.gradients).zip(self.hoops).map(|((place, row), hoop)| (place, row, hoop))
    }
}

/// Parts of the domains that lie in several cells, in compressed rows.
#[derive(Debug, Clone, Default)]
pub struct CellParts<const D: usize> {
    /// End of each point's row; empty where no point has parts.
    ends: Vec<usize>,
    parts: Vec<CellPart<D>>,
}

impl<const D: usize> CellParts<D> {
    /// Those of point `p`; none for a point in one cell.
    #[inline]
    pub fn of(&self, p: usize) -> &[CellPart<D>] {
        let Some(&end) = self.ends.get(p) else { return &[] };
        let start = if p == 0 { 0 } else { self.ends[p - 1] };
        &self.parts[start..end]
    }

    /// Adds the next point's parts; one alone is not kept.
    pub(super) fn push(&mut self, parts: &[CellPart<D>]) {
        if parts.len() > 1 {
            self.parts.extend_from_slice(parts);
        }
        self.ends.push(self.parts.len());
    }
}
