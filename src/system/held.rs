//! Degrees of freedom that a condition holds, in the assembled rows. Their rows and columns become
//! those of the identity, scaled like the other diagonal entries so that smoothers see one scale. The
//! overwritten values are kept: those of the rows give the reactions (Lagrangian §6.3), those of the
//! columns move prescribed displacements to the right-hand side.

use super::numbering::Numbering;
use super::pattern::Pattern;
use super::scatter::BlockRows;

/// Held degrees of freedom of one rank and the entries they own.
#[derive(Debug, Default)]
pub struct Held {
    /// Per local degree of freedom.
    held: Vec<bool>,
    /// Held rows of this rank.
    rows: Vec<HeldRow>,
    /// Entries of the other rows in held columns, row by row.
    columns: Vec<HeldEntry>,
    /// Values of fixed rows and of `columns` at the last [`Self::constrain`].
    saved_rows: Vec<f64>,
    saved_columns: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct HeldRow {
    dof: u32,
    /// By a condition: it has a reaction.
    fixed: bool,
}

#[derive(Debug, Clone, Copy)]
struct HeldEntry {
    address: usize,
    row: u32,
    column: u32,
}

impl Held {
    /// `held`: per local degree of freedom; `fixed`: which of them a condition holds; `start` gives
    /// the address of a block row.
    pub fn new<const D: usize>(
        numbering: &Numbering,
        pattern: &Pattern,
        held: Vec<bool>,
        fixed: &[bool],
        start: impl Fn(usize) -> usize,
    ) -> Self {
        let owned = numbering.owned * D;
        let rows = (0..owned)
            .filter(|&dof| held[dof])
            .map(|dof| HeldRow { dof: dof as u32, fixed: fixed[dof] })
            .collect();
        let nodes: Vec<bool> = held.chunks_exact(D).map(|node| node.contains(&true)).collect();
        let mut columns = Vec::new();
        if nodes.contains(&true) {
            for row in 0..numbering.owned {
                let range = pattern.offsets[row]..pattern.offsets[row + 1];
                let nodes_of_row = &pattern.columns[range];
                if !nodes_of_row.iter().any(|&node| nodes[node as usize]) {
                    continue;
                }
                let width = nodes_of_row.len();
                for i in (0..D).filter(|i| !held[row * D + i]) {
                    for (position, &node) in nodes_of_row.iter().enumerate() {
                        for column in (node as usize * D..).take(D).filter(|&c| held[c]) {
                            let place = (i * width + position) * D + column % D;
                            columns.push(HeldEntry {
                                address: start(row) + place,
                                row: (row * D + i) as u32,
                                column: column as u32,
                            });
                        }
                    }
                }
            }
        }
        Held { held, rows, columns, ..Held::default() }
    }

    /// Whether a local degree of freedom is held.
    #[inline]
    pub fn holds(&self, dof: usize) -> bool {
        self.held[dof]
    }

    /// Puts the identity times `scale` into the assembled rows and keeps what it overwrites.
    pub fn constrain<const D: usize, R: BlockRows<D>>(
        &mut self,
        pattern: &Pattern,
        scale: f64,
        rows: &mut R,
    ) {
        self.saved_rows.clear();
        for HeldRow { dof, fixed } in &self.rows {
            let (row, i) = (*dof as usize / D, *dof as usize % D);
            let width = D * (pattern.offsets[row + 1] - pattern.offsets[row]);
            let start = rows.start(pattern, row) + i * width;
            let values = rows.values(start, width);
            if *fixed {
                self.saved_rows.extend_from_slice(values);
            }
            values.fill(0.0);
            if let Some(entry) = pattern.diagonal(row) {
                values[(entry - pattern.offsets[row]) * D + i] = scale;
            }
        }
        self.saved_columns.clear();
        for entry in &self.columns {
            let value = &mut rows.values(entry.address, 1)[0];
            self.saved_columns.push(std::mem::take(value));
        }
    }

    /// K `change` in the rows of the fixed degrees of freedom, pairs (dof, sum); `change` is local.
    pub fn reactions<const D: usize>(
        &self,
        pattern: &Pattern,
        change: &[f64],
    ) -> impl Iterator<Item = (usize, f64)> {
        let mut entry = 0;
        self.rows.iter().filter(|row| row.fixed).map(move |row| {
            let dof = row.dof as usize;
            let nodes = pattern.offsets[dof / D]..pattern.offsets[dof / D + 1];
            let mut sum = 0.0;
            for &node in &pattern.columns[nodes] {
                for k in 0..D {
                    sum += self.saved_rows[entry] * change[node as usize * D + k];
                    entry += 1;
                }
            }
            (dof, sum)
        })
    }

    /// Takes the columns of the held ones times `prescribed` (local) off the right-hand side.
    pub fn move_columns(&self, prescribed: &[f64], rhs: &mut [f64]) {
        for (entry, value) in self.columns.iter().zip(&self.saved_columns) {
            rhs[entry.row as usize] -= value * prescribed[entry.column as usize];
        }
    }

    /// Degrees of freedom of this rank that a condition fixes, ascending.
    pub fn fixed(&self) -> impl Iterator<Item = usize> {
        self.rows.iter().filter(|row| row.fixed).map(|row| row.dof as usize)
    }
}
