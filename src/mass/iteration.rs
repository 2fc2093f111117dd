//! Conjugate gradients on M X = B for several right-hand sides in lockstep: one sweep over the
//! scalar matrix and one reduction serve them all; each has its own steps and its own end.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::parallel::World;

use super::incomplete::Incomplete;
use super::matrix;
use crate::system::border::Border;
use crate::system::numbering::Numbering;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockMatrix;

/// Relative residual of the iteration, in the norm of the preconditioner. That underrates the
/// error where the factor is poor, at nearly empty nodes most; and what is left of each step adds
/// up: with `pic`, in J, with the square of the steps.
const TOLERANCE: f64 = 5e-16;
/// Where round-off stops the iteration above [`TOLERANCE`], this much is accepted.
const ACCEPTABLE: f64 = 1e-10;
/// Iterations; the worst well-posed systems take a few hundred.
const MOST_ITERATIONS: usize = 5000;

/// The system, without its right-hand sides.
#[derive(Clone, Copy)]
pub struct Iteration<'a> {
    pub world: &'a World,
    pub numbering: &'a Numbering,
    pub pattern: &'a Pattern,
    pub matrix: &'a BlockMatrix<1>,
    pub preconditioner: &'a Incomplete,
    /// One over the lumped mass, per owned node: where the iteration starts without a guess. For
    /// a constant field that is the solution. Zero where there is no mass.
    pub inverse_row_sum: &'a [f64],
    /// The owned rows by whether they have columns of other ranks.
    pub rows: &'a Border,
}

impl Iteration<'_> {
    /// The solution at the owned nodes and the number of iterations. `free`: the values to be
    /// solved for, the others stay zero, as they are in `b` and `guess`, the place to start from.
    /// Collective. Error: no convergence.
    pub fn solve<const C: usize>(
        &self,
        b: &[[f64; C]],
        free: &[[bool; C]],
        guess: Option<&[[f64; C]]>,
    ) -> Result<(Vec<[f64; C]>, usize)> {
        let (world, owned) = (self.world, b.len());
        let all = |sums: [f64; C]| -> [f64; C] {
            let sums = world.sum_slice(&sums);
            std::array::from_fn(|k| sums[k])
        };
        let precondition = |r: &[[f64; C]], z: &mut [[f64; C]]| -> Result<[f64; C]> {
            Ok(all(self.preconditioner.apply(world, self.numbering, r, free, z)?))
        };
        // Local: the product reads ghosts.
        let mut p = vec![[0.0; C]; self.numbering.len()];
        match guess {
            Some(guess) => p[..owned].copy_from_slice(guess),
            None => {
                for ((p, b), inverse) in p.iter_mut().zip(b).zip(self.inverse_row_sum) {
                    *p = b.map(|b| b * inverse);
                }
            }
        }
        let mut x = p[..owned].to_vec();
        let mut product = vec![[0.0; C]; owned];
        self.multiply(&mut p, free, &mut product);
        let mut r: Vec<[f64; C]> =
            b.iter().zip(&product).map(|(b, p)| std::array::from_fn(|k| b[k] - p[k])).collect();
        p.fill([0.0; C]);
        let mut z = vec![[0.0; C]; self.numbering.len()];
        let mut apply =
            |r: &[[f64; C]]| self.preconditioner.apply(world, self.numbering, r, free, &mut z);
        let sizes = world.sum_slice([apply(b)?, apply(&r)?].as_flattened());
        let whole: [f64; C] = std::array::from_fn(|k| sizes[k]);
        let mut size: [f64; C] = std::array::from_fn(|k| sizes[C + k]);
        // Accelerations of nearly empty nodes are no place to start from.
        let restart: [bool; C] = std::array::from_fn(|k| !(size[k] < whole[k]));
        if restart.contains(&true) {
            for row in 0..owned {
                for k in (0..C).filter(|&k| restart[k]) {
                    (x[row][k], r[row][k]) = (0.0, b[row][k]);
                }
            }
            size = precondition(&r, &mut z)?;
        }
        let mut factor = [0.0; C];
        let mut iteration = 0;
        loop {
            // The negation is true for what is not a number.
            let active: [bool; C] =
                std::array::from_fn(|k| !(size[k] <= TOLERANCE * TOLERANCE * whole[k]));
            if !active.contains(&true) {
                break;
            }
            let broken = size.iter().any(|size| !size.is_finite());
            if iteration == MOST_ITERATIONS || broken {
                let left = (0..C).filter(|&k| active[k]).map(|k| (size[k] / whole[k]).sqrt());
                let worst = left.fold(0.0, f64::max);
                if worst <= ACCEPTABLE && !broken {
                    break;
                }
                return Err(Error::Run(format!(
                    "the iteration for the consistent mass stands at a relative residual of \
                     {worst:.1e} after {iteration} iterations: the matrix is near singular; \
                     stabilise it ([ghost] mass_factor = 0.25) or use method.mass = \"lumped\""
                )));
            }
            for (p, z) in p.iter_mut().zip(&z[..owned]) {
                for k in 0..C {
                    p[k] = z[k] + factor[k] * p[k];
                }
            }
            let curvature = all(self.multiply(&mut p, free, &mut product));
            if (0..C).any(|k| active[k] && curvature[k] <= 0.0) {
                return Err(Error::Run(
                    "the consistent mass matrix is not positive definite; stabilise it ([ghost] \
                     mass_factor = 0.25) or use method.mass = \"lumped\""
                        .into(),
                ));
            }
            let length: [f64; C] =
                std::array::from_fn(|k| if active[k] { size[k] / curvature[k] } else { 0.0 });
            for ((x, r), (p, product)) in x.iter_mut().zip(&mut r).zip(p.iter().zip(&product)) {
                for k in 0..C {
                    x[k] += length[k] * p[k];
                    r[k] -= length[k] * product[k];
                }
            }
            let next = precondition(&r, &mut z)?;
            for k in 0..C {
                factor[k] = if active[k] { next[k] / size[k] } else { 0.0 };
                if active[k] {
                    size[k] = next[k];
                }
            }
            iteration += 1;
        }
        Ok((x, iteration))
    }

    /// M x at free values, zero in the others, where x (local) is zero too; returns x·M x of each
    /// over this rank's rows. The ghosts of x come while inner rows are multiplied.
    fn multiply<const C: usize>(
        &self,
        x: &mut [[f64; C]],
        free: &[[bool; C]],
        product: &mut [[f64; C]],
    ) -> [f64; C] {
        let mut rows = |runs: &[Range<usize>], x: &[f64]| {
            for run in runs {
                let out = product.as_flattened_mut();
                matrix::multiply_rows::<C>(self.matrix, self.pattern, run.clone(), x, out);
            }
        };
        let flat = x.as_flattened_mut();
        self.numbering.halo.forward_while(self.world, [flat], C, |[x]| rows(&self.rows.inner, x));
        rows(&self.rows.reaching, x.as_flattened());
        let mut products = [0.0; C];
        for ((out, free), x) in product.iter_mut().zip(free).zip(x) {
            for k in 0..C {
                out[k] = if free[k] { out[k] } else { 0.0 };
                products[k] += out[k] * x[k];
            }
        }
        products
    }
}
