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

/// T = L diag(pivot) L^T along the lines of one axis.
struct Axis {
    /// The node before each on its line, with the entry of L.
    before: Vec<(u32, f64)>,
    /// 1/sqrt(pivot), 1/pivot on the last axis.
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
            for (axis, count) in lattice.nodes().into_iter().enumerate() {
                let of_previous = |row: usize| -> Option<(usize, f64)> {
                    let node = numbering.nodes[row].checked_sub(stride)?;
                    let previous = numbering.local(node).filter(|&local| local < row)?;
                    let entry = pattern.find(numbering, row, previous)?;
                    Some((previous, matrix.values[entry] * scale[row] * scale[previous]))
                };
                axes.push(Axis::factor(diagonal.len(), axis + 1 == D, of_previous));
                stride *= count;
            }
        }
        Lines { scale, axes }
    }

    /// z = P^-1 r where `free`, else zero. `z` may be longer than `r`.
    pub fn apply<const D: usize>(&self, r: &[f64], free: &[bool], z: &mut [f64]) {
        let (z, _) = z[..r.len()].as_chunks_mut::<D>();
        let (r, _) = r.as_chunks::<D>();
        let Some((last, first)) = self.axes.split_last() else {
            for ((z, r), scale) in z.iter_mut().zip(r).zip(&self.scale) {
                *z = r.map(|r| r * scale * scale);
            }
            return hold(z, free);
        };
        for ((z, r), scale) in z.iter_mut().zip(r).zip(&self.scale) {
            *z = r.map(|r| r * scale);
        }
        for axis in first {
            axis.forward(z);
        }
        last.forward(z);
        last.backward(z, false);
        for axis in first.iter().rev() {
            axis.backward(z, true);
        }
        for (z, scale) in z.iter_mut().zip(&self.scale) {
            *z = z.map(|z| z * scale);
        }
        hold(z, free);
    }
}

fn hold<const D: usize>(z: &mut [[f64; D]], free: &[bool]) {
    for (z, free) in z.as_flattened_mut().iter_mut().zip(free) {
        if !free {
            *z = 0.0;
        }
    }
}

impl Axis {
    /// `of_previous`: the node before row r and their entry of S M S.
    fn factor(
        rows: usize,
        whole: bool,
        of_previous: impl Fn(usize) -> Option<(usize, f64)>,
    ) -> Self {
        let mut before = Vec::with_capacity(rows);
        let mut pivots: Vec<f64> = Vec::with_capacity(rows);
        for row in 0..rows {
            let linked = of_previous(row).and_then(|(previous, entry)| {
                let factor = entry / pivots[previous];
                let pivot = 1.0 - factor * entry;
                (pivot > LEAST_PIVOT).then_some((previous as u32, factor, pivot))
            });
            let (previous, factor, pivot) = linked.unwrap_or((NONE, 0.0, 1.0));
            before.push((previous, factor));
            pivots.push(pivot);
        }
        let weight = |pivot: f64| if whole { 1.0 / pivot } else { 1.0 / pivot.sqrt() };
        Axis { before, weight: pivots.into_iter().map(weight).collect() }
    }

    /// z = weight L^-1 z
    fn forward<const D: usize>(&self, z: &mut [[f64; D]]) {
        for (row, &(previous, factor)) in self.before.iter().enumerate() {
            if previous != NONE {
                let carried = z[previous as usize];
                for k in 0..D {
                    z[row][k] -= factor * carried[k];
                }
            }
        }
        for (z, weight) in z.iter_mut().zip(&self.weight) {
            *z = z.map(|z| z * weight);
        }
    }

    /// z = L^-T z, of weight z where `weighted`.
    fn backward<const D: usize>(&self, z: &mut [[f64; D]], weighted: bool) {
        if weighted {
            for (z, weight) in z.iter_mut().zip(&self.weight) {
                *z = z.map(|z| z * weight);
            }
        }
        for (row, &(previous, factor)) in self.before.iter().enumerate().rev() {
            if previous != NONE {
                let carried = z[row];
                for k in 0..D {
                    z[previous as usize][k] -= factor * carried[k];
                }
            }
        }
    }
}
