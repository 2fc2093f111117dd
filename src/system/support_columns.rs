//! Where the dense block of each support lies in the sparse rows, found once per pattern so
//! that assembling is adding. Neighbouring equations fill neighbouring columns: a support is
//! taken apart into runs of them, and only the first of each run is stored.

use crate::error::{Error, Result};
use crate::petsc::Index;

use super::graph::Lists;

/// Columns of all supports of a pattern.
#[derive(Debug, Clone, Default)]
pub struct SupportColumns {
    /// Nodes per run of each support, all of its runs alike: 1, 2 or 3.
    runs: Vec<u8>,
    /// First position of each support.
    starts: Vec<usize>,
    /// (node, run): column of the run's first node within the node's row.
    positions: Vec<u16>,
}

/// Columns of one support.
#[derive(Clone, Copy)]
pub struct ColumnRuns<'a> {
    /// Nodes per run.
    pub run: usize,
    /// See [`SupportColumns`].
    pub positions: &'a [u16],
}

impl SupportColumns {
    /// `supports`: local nodes of each support; `touched`: the local nodes that have rows, each
    /// with its row and the supports that hold it; `rows`: local nodes of each row, ascending by
    /// equation number `global`.
    pub fn find<'a>(
        supports: &Lists,
        touched: impl Iterator<Item = (u32, usize, &'a [u32])>,
        rows: &Lists,
        global: &[Index],
    ) -> Result<Self> {
        let count = supports.len();
        let mut found = SupportColumns {
            runs: Vec::with_capacity(count),
            starts: Vec::with_capacity(count + 1),
            positions: Vec::new(),
        };
        let mut total = 0;
        for s in 0..count {
            let nodes = supports.list(s);
            let run = run_length(nodes, global);
            found.runs.push(run as u8);
            found.starts.push(total);
            total += nodes.len() * (nodes.len() / run);
        }
        found.starts.push(total);
        found.positions = vec![0; total];

        let mut position_of = vec![0u16; global.len()];
        let mut seen = vec![0u16; count];
        for (local, row, holders) in touched {
            let row = rows.list(row);
            if row.len() > usize::from(u16::MAX) {
                return Err(Error::Run(format!(
                    "a node meets {} others: domains of points span far too many cells",
                    row.len()
                )));
            }
            for (position, &column) in row.iter().enumerate() {
                position_of[column as usize] = position as u16;
            }
            for &s in holders {
                let s = s as usize;
                let nodes = supports.list(s);
                let run = usize::from(found.runs[s]);
                // Rows mostly come in the order of the support's nodes.
                let next = usize::from(seen[s]);
                let a = match nodes.get(next) == Some(&local) {
                    true => next,
                    false => nodes.iter().position(|&n| n == local).expect("s holds the node"),
                };
                seen[s] = a as u16 + 1;
                let width = nodes.len() / run;
                let start = found.starts[s] + a * width;
                let target = &mut found.positions[start..start + width];
                for (place, node) in target.iter_mut().zip(nodes.iter().step_by(run)) {
                    *place = position_of[*node as usize];
                }
            }
        }
        Ok(found)
    }

    /// Stored positions.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    #[inline]
    pub fn of(&self, support: usize) -> ColumnRuns<'_> {
        ColumnRuns {
            run: usize::from(self.runs[support]),
            positions: &self.positions[self.starts[support]..self.starts[support + 1]],
        }
    }
}

/// The longest run, up to three, that the whole support consists of.
fn run_length(nodes: &[u32], global: &[Index]) -> usize {
    [3, 2]
        .into_iter()
        .find(|&run| {
            nodes.len().is_multiple_of(run)
                && nodes.chunks_exact(run).all(|chunk| {
                    chunk
                        .windows(2)
                        .all(|pair| global[pair[1] as usize] == global[pair[0] as usize] + 1)
                })
        })
        .unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::run_length;

    #[test]
    fn runs_are_whole() {
        let global: Vec<crate::petsc::Index> = vec![0, 1, 2, 10, 11, 12, 30, 31];
        assert_eq!(run_length(&[0, 1, 2, 3, 4, 5], &global), 3);
        assert_eq!(run_length(&[0, 1, 3, 4, 6, 7], &global), 2);
        assert_eq!(run_length(&[0, 1, 3, 5], &global), 1);
        assert_eq!(run_length(&[1, 0], &global), 1);
        assert_eq!(run_length(&[4], &global), 1);
    }
}
