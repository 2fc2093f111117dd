//! P^-1 = S L_1^-T .. T_D^-1 .. L_1^-1 S with T_a = L_a L_a^T the tridiagonal part of S M S along
//! the grid lines of axis a and S = diag(M)^-1/2: a preconditioner for the mass on a lattice.
//!
//! On a full box the mass is the Kronecker product of one such matrix per axis, and P = M; where
//! cells are cut, or points lie unevenly, P is still near. Lines end where a node is missing or
//! belongs to another rank. On a mesh there are no lines, and P is the diagonal.

use crate::grid::Grid;

use super::{BlockMatrix, Numbering, Pattern};

/// Along a line the next pivot is at least this share of the diagonal; a coupling that would
/// leave less is dropped.
const LEAST_PIVOT: f64 = 0.05;
/// No node before this one on its line.
const NONE: u32 = u32::MAX;

/// The factors of one rank's nodes.
pub struct Lines {
    /// 1/sqrt(M_ii); zero where there is no mass.
    scale: Vec<f64>,
    axes: Vec<Axis>,
}

/// T = L L^T along the lines of one axis.
struct Axis {
    /// The node before each on its line, with the entry of L.
    before: Vec<(u32, f64)>,
    /// One over the diagonal of L.
    weight: Vec<f64>,
}

impl Lines {
    /// `diagonal`: of the owned rows of `matrix`.
    pub fn factor<const D: usize>(
        grid: &Grid<D>,
        numbering: &Numbering,
        pattern: &Pattern,
        matrix: &BlockMatrix<1>,
        diagonal: &[f64],
    ) -> Self {
        let scale: Vec<f64> = diagonal
            .iter()
            .map(|&value| if value > 0.0 { 1.0 / value.sqrt() } else { 0.0 })
            .collect();
        let mut axes = Vec::new();
        if let Grid::Lattice(lattice) = grid {
            let mut stride = 1;
            for count in lattice.nodes() {
                let of_previous = |row: usize| -> Option<(usize, f64)> {
                    let node = numbering.nodes[row].checked_sub(stride)?;
                    let previous = numbering.local(node).filter(|&local| local < row)?;
                    let entry = pattern.find(numbering, row, previous)?;
                    Some((previous, matrix.values[entry] * scale[row] * scale[previous]))
                };
                axes.push(Axis::factor(diagonal.len(), of_previous));
                stride *= count;
            }
        }
        Lines { scale, axes }
    }

    /// z = P^-1 r where `free`, else zero. `z` may be longer than `r`.
    pub fn apply<const D: usize>(&self, r: &[f64], free: &[bool], z: &mut [f64]) {
        let (z, _) = z[..r.len()].as_chunks_mut::<D>();
        let (r, _) = r.as_chunks::<D>();
        for ((z, r), scale) in z.iter_mut().zip(r).zip(&self.scale) {
            *z = r.map(|r| r * scale);
        }
        for axis in &self.axes {
            axis.forward(z);
        }
        for axis in self.axes.iter().rev() {
            axis.backward(z);
        }
        let (free, _) = free.as_chunks::<D>();
        for ((z, scale), free) in z.iter_mut().zip(&self.scale).zip(free) {
            for k in 0..D {
                z[k] = if free[k] { z[k] * scale } else { 0.0 };
            }
        }
    }
}

impl Axis {
    /// `of_previous`: the node before row r and their entry of S M S.
    fn factor(rows: usize, of_previous: impl Fn(usize) -> Option<(usize, f64)>) -> Self {
        let mut before = Vec::with_capacity(rows);
        let mut weight: Vec<f64> = Vec::with_capacity(rows);
        for row in 0..rows {
            let linked = of_previous(row).and_then(|(previous, entry)| {
                let factor = entry * weight[previous];
                let pivot = 1.0 - factor * factor;
                (pivot > LEAST_PIVOT).then_some((previous as u32, factor, pivot))
            });
            let (previous, factor, pivot) = linked.unwrap_or((NONE, 0.0, 1.0));
            before.push((previous, factor));
            weight.push(1.0 / pivot.sqrt());
        }
        Axis { before, weight }
    }

    /// z = L^-1 z
    fn forward<const D: usize>(&self, z: &mut [[f64; D]]) {
        for (row, (&(previous, factor), weight)) in self.before.iter().zip(&self.weight).enumerate()
        {
            let mut sum = z[row];
            if previous != NONE {
                let carried = z[previous as usize];
                for k in 0..D {
                    sum[k] -= factor * carried[k];
                }
            }
            z[row] = sum.map(|sum| sum * weight);
        }
    }

    /// z = L^-T z
    fn backward<const D: usize>(&self, z: &mut [[f64; D]]) {
        for (row, (&(previous, factor), weight)) in
            self.before.iter().zip(&self.weight).enumerate().rev()
        {
            let solved = z[row].map(|z| z * weight);
            z[row] = solved;
            if previous != NONE {
                let target = &mut z[previous as usize];
                for k in 0..D {
                    target[k] -= factor * solved[k];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Axis, NONE};

    #[test]
    fn sweeps_invert_the_tridiagonal_lines() {
        // Two lines of three and two nodes, interleaved; one coupling too strong is dropped.
        let links = [None, None, Some((0, 0.3)), Some((1, -0.4)), Some((2, 0.45)), Some((3, 0.99))];
        let axis = Axis::factor(links.len(), |row| links[row]);
        assert_eq!(axis.before[5].0, NONE);
        let x: Vec<[f64; 2]> = (0..6).map(|i| [1.0 + i as f64, (i as f64).cos()]).collect();
        let mut z = x.clone();
        for (row, link) in links.iter().enumerate().take(5) {
            if let Some((previous, entry)) = link {
                for k in 0..2 {
                    z[row][k] += entry * x[*previous][k];
                    z[*previous][k] += entry * x[row][k];
                }
            }
        }
        axis.forward(&mut z);
        axis.backward(&mut z);
        for (z, x) in z.as_flattened().iter().zip(x.as_flattened()) {
            assert!((z - x).abs() < 1e-14, "{z} {x}");
        }
    }
}
