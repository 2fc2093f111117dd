//! Extreme eigenvalues of the reduced matrices (Ghost §2.6, 3.5): rows and columns of held
//! degrees of freedom are left out.
//!
//! Up to [`DENSE_UP_TO`] degrees of freedom the matrix is gathered on every rank and all of its
//! eigenvalues are computed; beyond, they are the Ritz values of conjugate gradients (Lanczos'
//! method) from PETSc. The smallest eigenvalue carries an error of about 1e-16 times the
//! largest, so a ratio beyond 1/eps says no more than that; where the smallest comes out as
//! zero or negative the ratio is infinite.

use nalgebra::DMatrix;

use crate::assembly::inverse::MassInverse;
use crate::assembly::{BlockMatrix, Numbering, Pattern};
use crate::error::Result;
use crate::parallel::World;
use crate::petsc::{Ksp, Matrix};

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

/// Of a symmetric matrix of `B x B` blocks; `free` per owned row. Collective.
pub fn of_matrix<const B: usize>(
    world: &World,
    numbering: &Numbering,
    pattern: &Pattern,
    matrix: &BlockMatrix<B>,
    free: &[bool],
) -> Result<Extremes> {
    let count = world.sum_usize(free.iter().filter(|free| **free).count());
    if count == 0 {
        return Ok(Extremes::NONE);
    }
    if count <= DENSE_UP_TO {
        return Ok(dense(world, numbering, pattern, matrix, free, count));
    }
    estimate(world, numbering, pattern, matrix, free)
}

/// Number of each free row among those of all ranks; `None` where held. Local rows (ghosts
/// included).
fn reduced_numbers<const B: usize>(
    world: &World,
    numbering: &Numbering,
    free: &[bool],
) -> Vec<Option<usize>> {
    let mut next = world.exclusive_sum(free.iter().filter(|free| **free).count());
    let mut numbers = vec![-1.0; numbering.len() * B];
    for (number, free) in numbers.iter_mut().zip(free) {
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

fn dense<const B: usize>(
    world: &World,
    numbering: &Numbering,
    pattern: &Pattern,
    matrix: &BlockMatrix<B>,
    free: &[bool],
    count: usize,
) -> Extremes {
    let numbers = reduced_numbers::<B>(world, numbering, free);
    let mut entries = vec![0.0; count * count];
    for_each_entry(pattern, numbering.owned, matrix, |row, column, value| {
        if let (Some(i), Some(j)) = (numbers[row], numbers[column]) {
            entries[i * count + j] = value;
        }
    });
    // Each entry comes from one rank, so the sum is exact and the same everywhere.
    let entries = if world.size() > 1 { world.sum_slice(&entries) } else { entries };
    let values = DMatrix::from_vec(count, count, entries).symmetric_eigenvalues();
    values.iter().fold(Extremes::NONE, |all, &v| all.united(Extremes { smallest: v, largest: v }))
}

/// Visits (local row, local column, value) of the owned rows.
fn for_each_entry<const B: usize>(
    pattern: &Pattern,
    owned: usize,
    matrix: &BlockMatrix<B>,
    mut visit: impl FnMut(usize, usize, f64),
) {
    for row in 0..owned {
        let range = pattern.offsets[row]..pattern.offsets[row + 1];
        for i in 0..B {
            let start = B * B * range.start + i * range.len() * B;
            for (position, &column) in pattern.columns[range.clone()].iter().enumerate() {
                for k in 0..B {
                    let value = matrix.values[start + position * B + k];
                    visit(row * B + i, column as usize * B + k, value);
                }
            }
        }
    }
}

/// A start that depends on the node's number alone and favours no eigenvector.
fn noise(number: usize) -> f64 {
    let mixed = (number as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (mixed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}

fn estimate<const B: usize>(
    world: &World,
    numbering: &Numbering,
    pattern: &Pattern,
    matrix: &BlockMatrix<B>,
    free: &[bool],
) -> Result<Extremes> {
    // Held rows decouple and the start is zero there: the iteration never sees them.
    let rows = numbering.owned * B;
    let numbers = reduced_numbers::<B>(world, numbering, free);
    let (mut offsets, mut columns, mut values) = (vec![0i32], Vec::new(), Vec::new());
    let mut last = 0;
    for_each_entry(pattern, numbering.owned, matrix, |row, column, value| {
        if row != last {
            offsets.push(columns.len() as i32);
            last = row;
        }
        let global = numbering.global[column / B] * B as i32 + (column % B) as i32;
        columns.push(global);
        let inside = numbers[row].is_some() && numbers[column].is_some();
        values.push(if inside { value } else { f64::from(u8::from(row == column)) });
    });
    offsets.resize(rows + 1, columns.len() as i32);
    let matrix = Matrix::from_csr(world.comm(), B, rows, &offsets, &columns, &values)?;
    let (mut right, mut left) = (matrix.vector()?, matrix.vector()?);
    for (dof, value) in right.values_mut()?.iter_mut().enumerate() {
        *value = if free[dof] { noise(numbering.offset * B + dof) } else { 0.0 };
    }
    let mut ksp = Ksp::new(world.comm(), "kappa_")?;
    ksp.set_defaults(&[
        ("ksp_type", "cg"),
        ("pc_type", "none"),
        ("ksp_rtol", "1e-10"),
        ("ksp_max_it", "5000"),
    ])?;
    ksp.set_compute_singular_values()?;
    ksp.set_from_options()?;
    ksp.set_operators(&matrix)?;
    ksp.solve(&right, &mut left)?;
    let (smallest, largest) = ksp.extreme_singular_values()?;
    Ok(Extremes { smallest, largest })
}

/// Largest eigenvalue of K x = lambda M x (Ghost §3.5) by Lanczos' method in the inner product
/// of M, to ten digits. Collective.
pub fn largest_generalised<const D: usize>(
    world: &World,
    numbering: &Numbering,
    pattern: &Pattern,
    stiffness: &BlockMatrix<D>,
    mass: &mut MassInverse<'_, D>,
    free: &[bool],
) -> Result<f64> {
    let owned = numbering.owned * D;
    let zero = vec![0.0; numbering.len() * D];
    let dot = |a: &[f64], b: &[f64]| -> f64 {
        world.sum(a.iter().zip(b).take(owned).map(|(a, b)| a * b).sum())
    };
    let mut weighted: Vec<f64> = (0..owned)
        .map(|dof| if free[dof] { noise(numbering.offset * D + dof) } else { 0.0 })
        .collect();
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
        for_each_entry(pattern, numbering.owned, stiffness, |row, column, value| {
            next[row] += value * vector[column];
        });
        for (value, free) in next.iter_mut().zip(free) {
            *value *= f64::from(u8::from(*free));
        }
        let alpha = dot(&next, &vector);
        for dof in 0..owned {
            next[dof] -=
                alpha * weighted[dof] + norm * weighted_before[dof] * f64::from(u8::from(step > 0));
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
