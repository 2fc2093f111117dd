//! Extreme eigenvalues of the reduced matrices (Ghost §2.6, 3.5): rows and columns of held
//! degrees of freedom are left out.
//!
//! Up to [`DENSE_UP_TO`] degrees of freedom the matrix is gathered on every rank and all of its
//! eigenvalues are computed; beyond, they are the Ritz values of conjugate gradients (Lanczos'
//! method) from PETSc. The smallest eigenvalue carries an error of about 1e-16 times the
//! largest, so a ratio beyond 1/eps says no more than that; where the smallest comes out as
//! zero or negative the ratio is infinite.

use nalgebra::DMatrix;

use crate::error::Result;
use crate::mass::inverse::MassInverse;
use crate::parallel::World;
use crate::petsc::{Index, Ksp, Matrix};
use crate::system::numbering::Numbering;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockMatrix;

/// Degrees of freedom up to which all eigenvalues are computed.
pub const DENSE_UP_TO: usize = 1500;
/// Steps of Lanczos' method for the generalised problem.
const MOST_STEPS: usize = 300;

/// Smallest and largest eigenvalue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    pub smallest: f64,
    pub largest: f64,
}

impl Extremes {
    /// Nothing yet: to be united with others.
    pub const NONE: Extremes = Extremes { smallest: f64::INFINITY, largest: f64::NEG_INFINITY };

    /// Extremes of both spectra together.
    pub fn united(self, other: Extremes) -> Self {
        Extremes {
            smallest: self.smallest.min(other.smallest),
            largest: self.largest.max(other.largest),
        }
    }

    /// Condition number.
    pub fn ratio(self) -> f64 {
        if self.smallest > 0.0 { self.largest / self.smallest } else { f64::INFINITY }
    }
}

/// A symmetric matrix of `B x B` blocks without its held degrees of freedom.
pub struct Reduced<'a, const B: usize> {
    pub world: &'a World,
    pub numbering: &'a Numbering,
    pub pattern: &'a Pattern,
    pub matrix: &'a BlockMatrix<B>,
    /// One per owned row.
    pub free: &'a [bool],
}

impl<const B: usize> Reduced<'_, B> {
    /// Smallest and largest eigenvalue. Collective.
    pub fn extremes(&self) -> Result<Extremes> {
        let count = self.world.sum_usize(self.free.iter().filter(|free| **free).count());
        if count == 0 {
            return Ok(Extremes::NONE);
        }
        let numbers = self.numbers();
        if count <= DENSE_UP_TO { Ok(self.dense(&numbers, count)) } else { self.estimate(&numbers) }
    }

    /// Number of each free row among those of all ranks; `None` where held. Local rows (ghosts
    /// included).
    fn numbers(&self) -> Vec<Option<usize>> {
        let (world, numbering) = (self.world, self.numbering);
        let mut next = world.exclusive_sum(self.free.iter().filter(|free| **free).count());
        let mut numbers = vec![-1.0; numbering.len() * B];
        for (number, free) in numbers.iter_mut().zip(self.free) {
            if *free {
                *number = next as f64;
                next += 1;
            }
        }
        // Only fails on a broken communicator, which nothing below would survive either.
        let forwarded = numbering.halo.forward(world, &mut numbers, B);
        debug_assert!(forwarded.is_ok());
        numbers.into_iter().map(|n| (n >= 0.0).then_some(n as usize)).collect()
    }

    /// Visits (local row, local column, value) of the owned rows.
    fn for_each_entry(&self, mut visit: impl FnMut(usize, usize, f64)) {
        let pattern = self.pattern;
        for row in 0..self.numbering.owned {
            let range = pattern.offsets[row]..pattern.offsets[row + 1];
            for i in 0..B {
                let start = B * B * range.start + i * range.len() * B;
                for (position, &column) in pattern.columns[range.clone()].iter().enumerate() {
                    for k in 0..B {
                        let value = self.matrix.values[start + position * B + k];
                        visit(row * B + i, column as usize * B + k, value);
                    }
                }
            }
        }
    }

    fn dense(&self, numbers: &[Option<usize>], count: usize) -> Extremes {
        let mut entries = vec![0.0; count * count];
        self.for_each_entry(|row, column, value| {
            if let (Some(i), Some(j)) = (numbers[row], numbers[column]) {
                entries[i * count + j] = value;
            }
        });
        // Each entry comes from one rank, so the sum is exact and the same everywhere.
        let world = self.world;
        let entries = if world.size() > 1 { world.sum_slice(&entries) } else { entries };
        let values = DMatrix::from_vec(count, count, entries).symmetric_eigenvalues();
        let one = |value: &f64| Extremes { smallest: *value, largest: *value };
        values.iter().map(one).fold(Extremes::NONE, Extremes::united)
    }

    fn estimate(&self, numbers: &[Option<usize>]) -> Result<Extremes> {
        // Held rows decouple and the start is zero there: the iteration never sees them.
        let numbering = self.numbering;
        let rows = numbering.owned * B;
        let (mut offsets, mut columns, mut values) = (vec![0 as Index], Vec::new(), Vec::new());
        let mut last = 0;
        self.for_each_entry(|row, column, value| {
            if row != last {
                offsets.push(columns.len() as Index);
                last = row;
            }
            let global = numbering.global[column / B] * B as Index + (column % B) as Index;
            columns.push(global);
            let inside = numbers[row].is_some() && numbers[column].is_some();
            values.push(if inside { value } else { f64::from(u8::from(row == column)) });
        });
        offsets.resize(rows + 1, columns.len() as Index);
        let comm = self.world.comm();
        let matrix = Matrix::from_csr(comm, B, rows, &offsets, &columns, &values)?;
        let (mut right, mut left) = (matrix.vector()?, matrix.vector()?);
        right.values_mut()?.copy_from_slice(&self.start());
        let mut ksp = petsc_solver(self.world, PREFIX)?;
        ksp.set_operators(&matrix)?;
        ksp.solve(&right, &mut left)?;
        let (smallest, largest) = ksp.extreme_singular_values()?;
        Ok(Extremes { smallest, largest })
    }

    /// Favours no eigenvector; owned rows, zero where held.
    fn start(&self) -> Vec<f64> {
        let first = self.numbering.offset * B;
        let at = |dof: usize| if self.free[dof] { noise(first + dof) } else { 0.0 };
        (0..self.numbering.owned * B).map(at).collect()
    }

    /// Largest eigenvalue of K x = lambda M x (Ghost §3.5), K this matrix, by Lanczos' method in
    /// the inner product of M, to ten digits. Collective.
    pub fn largest_generalised(&self, mass: &mut MassInverse<'_, B>) -> Result<f64> {
        let owned = self.numbering.owned * B;
        let zero = vec![0.0; self.numbering.len() * B];
        let dot = |a: &[f64], b: &[f64]| -> f64 {
            self.world.sum(a.iter().zip(b).take(owned).map(|(a, b)| a * b).sum())
        };
        let mut weighted = self.start();
        let mut weighted_before = vec![0.0; owned];
        let mut vector = mass.solve(&weighted, &zero)?;
        let mut norm = dot(&vector, &weighted).sqrt();
        if !(norm > 0.0) {
            return Ok(0.0);
        }
        let (mut diagonal, mut side) = (Vec::new(), Vec::new());
        let mut found = 0.0;
        for step in 0..MOST_STEPS {
            for value in vector.iter_mut().chain(&mut weighted) {
                *value /= norm;
            }
            let mut next = vec![0.0; owned];
            self.for_each_entry(|row, column, value| next[row] += value * vector[column]);
            for (value, free) in next.iter_mut().zip(self.free) {
                *value *= f64::from(u8::from(*free));
            }
            let alpha = dot(&next, &vector);
            let back = if step > 0 { norm } else { 0.0 };
            for dof in 0..owned {
                next[dof] -= alpha * weighted[dof] + back * weighted_before[dof];
            }
            diagonal.push(alpha);
            let now = largest_of_tridiagonal(&diagonal, &side);
            let settled = step > 4 && (now - found).abs() <= 1e-11 * now.abs();
            found = now;
            vector = mass.solve(&next, &zero)?;
            norm = dot(&vector, &next).max(0.0).sqrt();
            if settled || !(norm > 1e-13 * found.abs()) {
                break;
            }
            side.push(norm);
            weighted_before = std::mem::replace(&mut weighted, next);
        }
        Ok(found)
    }
}

/// A number that depends on the node's alone.
fn noise(number: usize) -> f64 {
    let mixed = (number as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (mixed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}

/// By bisection on the sign count of the shifted factorisation.
fn largest_of_tridiagonal(diagonal: &[f64], side: &[f64]) -> f64 {
    let reach = |i: usize| {
        let left = if i > 0 { side[i - 1].abs() } else { 0.0 };
        left + side.get(i).map_or(0.0, |s| s.abs())
    };
    let bound = |sign: f64| {
        (0..diagonal.len()).map(|i| sign * diagonal[i] + reach(i)).fold(f64::MIN, f64::max)
    };
    let (mut low, mut high) = (-bound(-1.0), bound(1.0));
    let all_below = |shift: f64| {
        let mut pivot = diagonal[0] - shift;
        for i in 1..diagonal.len() {
            if pivot >= 0.0 {
                return false;
            }
            pivot = diagonal[i] - shift - side[i - 1] * side[i - 1] / pivot;
        }
        pivot < 0.0
    };
    for _ in 0..120 {
        let middle = 0.5 * (low + high);
        if all_below(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// Of the options of the solver that eigenvalues are estimated by.
pub const PREFIX: &str = "kappa_";

/// That solver with options of this prefix.
pub fn petsc_solver(world: &World, prefix: &str) -> Result<Ksp> {
    let mut ksp = Ksp::new(world.comm(), prefix)?;
    ksp.set_defaults(&[
        ("ksp_type", "cg"),
        ("pc_type", "none"),
        ("ksp_rtol", "1e-10"),
        ("ksp_max_it", "5000"),
    ])?;
    ksp.set_compute_singular_values()?;
    ksp.set_from_options()?;
    Ok(ksp)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_eigenvalue_of_a_tridiagonal_matrix() {
        // Second differences of n points: 2 + 2 cos(pi / (n + 1)).
        for n in [1usize, 2, 7, 40] {
            let exact = 2.0 + 2.0 * (std::f64::consts::PI / (n + 1) as f64).cos();
            let found = largest_of_tridiagonal(&vec![2.0; n], &vec![-1.0; n - 1]);
            assert!((found - exact).abs() < 1e-14, "{n}: {found} {exact}");
        }
    }

    #[test]
    fn a_spectrum_that_touches_zero_has_no_condition() {
        let good = Extremes { smallest: 0.5, largest: 4.0 };
        assert_eq!(good.ratio(), 8.0);
        let bad = good.united(Extremes { smallest: -1e-18, largest: 1.0 });
        assert_eq!(bad.ratio(), f64::INFINITY);
    }
}
