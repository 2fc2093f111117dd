//! M x = b (Ghost eq. 6, 10) for all components at once, with values prescribed at some nodes.
//!
//! Small systems of one rank are factored; larger ones are solved by conjugate gradients
//! preconditioned along grid lines ([`super::lines`]), all components in lockstep over one sweep of the scalar matrix and
//! one reduction. With any PETSc option `-mass_...` the system goes to PETSc instead (default
//! there: `cg`, `jacobi`, relative tolerance 1e-14), component by component.

use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::parallel::World;
use crate::petsc::{Ksp, Matrix, options};

use super::envelope::{self, Envelope};
use super::lines::Lines;
use super::{BlockMatrix, Numbering, Pattern, mass};

/// Relative residual of the iteration, in the norm of the preconditioner.
const TOLERANCE: f64 = 1e-14;
/// Where round-off stops the iteration above [`TOLERANCE`], this much is accepted.
const ACCEPTABLE: f64 = 1e-10;
/// Iterations; the worst well-posed systems take a few hundred.
const MOST_ITERATIONS: usize = 5000;
/// Factoring wins while its operations per stored entry stay below this.
const FACTOR_BELOW: f64 = 60.0;

/// A mass matrix ready to be inverted. `D` components, each with its own held nodes.
pub struct MassInverse<'a, const D: usize> {
    world: &'a World,
    numbering: &'a Numbering,
    pattern: &'a Pattern,
    matrix: &'a BlockMatrix<1>,
    /// Per owned degree of freedom: to be solved for.
    free: Vec<bool>,
    method: Method<D>,
    /// Iterations so far, over all components (the largest of them where they run together).
    pub iterations: usize,
}

enum Method<const D: usize> {
    /// A factor, and which one serves each component.
    Direct(Vec<Envelope>, [usize; D]),
    Iterative(Box<Start>),
    Petsc(Box<Ksp>),
}

struct Start {
    lines: Lines,
    /// The lumped mass, per owned node: where the iteration starts. For a constant field that is
    /// the solution. Zero where there is no mass.
    inverse_row_sum: Vec<f64>,
}

impl<'a, const D: usize> MassInverse<'a, D> {
    /// `held`: per local degree of freedom, prescribed by a condition. Nodes without any mass
    /// are held at zero. Collective. Error: a factor that does not exist, with its node.
    pub fn new(
        world: &'a World,
        grid: &Grid<D>,
        numbering: &'a Numbering,
        pattern: &'a Pattern,
        matrix: &'a BlockMatrix<1>,
        held: &[bool],
    ) -> Result<Self> {
        let rows = numbering.owned;
        let diagonal: Vec<f64> = (0..rows)
            .map(|row| pattern.find(numbering, row, row).map_or(0.0, |entry| matrix.values[entry]))
            .collect();
        let free: Vec<bool> =
            (0..rows * D).map(|dof| !held[dof] && diagonal[dof / D] != 0.0).collect();
        let method = if options::any_set("mass_")? {
            Method::Petsc(Box::new(petsc_solver(world)?))
        } else if world.size() == 1
            && envelope::cost(pattern, rows) < FACTOR_BELOW * pattern.ghost_start as f64
        {
            let (factors, which) = factors::<D>(matrix, pattern, &free).map_err(|row| {
                Error::Run(format!(
                    "the consistent mass matrix is not positive definite: the node at {:?} m \
                     hardly carries any mass; stabilise it ([ghost] mass_factor = 0.25) or use \
                     method.mass = \"lumped\"",
                    grid.node_position(numbering.nodes[row])
                ))
            })?;
            Method::Direct(factors, which)
        } else {
            let one_over = |value: &f64| if *value == 0.0 { 0.0 } else { 1.0 / value };
            Method::Iterative(Box::new(Start {
                lines: Lines::factor(grid, numbering, pattern, matrix, &diagonal),
                inverse_row_sum: mass::row_sums(matrix, pattern, rows)
                    .iter()
                    .map(one_over)
                    .collect(),
            }))
        };
        Ok(MassInverse { world, numbering, pattern, matrix, free, method, iterations: 0 })
    }

    /// Solves for the free values. `rhs`: owned degrees of freedom; `prescribed`: local ones,
    /// read where held. Returns local values, ghosts included. Collective. Error: a right-hand
    /// side that is not finite, or no convergence.
    pub fn solve(&mut self, rhs: &[f64], prescribed: &[f64]) -> Result<Vec<f64>> {
        self.solve_from(rhs, prescribed, None)
    }

    /// [`Self::solve`] with local values `guess` near the solution, where an iteration may start.
    pub fn solve_from(
        &mut self,
        rhs: &[f64],
        prescribed: &[f64],
        guess: Option<&[f64]>,
    ) -> Result<Vec<f64>> {
        let owned = self.numbering.owned * D;
        let mut x = vec![0.0; self.numbering.len() * D];
        let mut moved = false;
        for dof in 0..owned {
            if !self.free[dof] && prescribed[dof] != 0.0 {
                x[dof] = prescribed[dof];
                moved = true;
            }
        }
        let mut b = rhs.to_vec();
        let bad = rhs.iter().any(|b| !b.is_finite());
        let marks = [f64::from(u8::from(moved)), f64::from(u8::from(bad))];
        let marks = self.world.sum_slice(&marks);
        if marks[1] > 0.0 {
            return Err(Error::Run("momentum or force at the nodes is not finite".into()));
        }
        if marks[0] > 0.0 {
            self.numbering.halo.forward(self.world, &mut x, D)?;
            let mut share = vec![0.0; owned];
            mass::multiply::<D>(self.matrix, self.pattern, &x, &mut share);
            for (b, s) in b.iter_mut().zip(share) {
                *b -= s;
            }
        }
        for (b, free) in b.iter_mut().zip(&self.free) {
            if !free {
                *b = 0.0;
            }
        }
        let solution = match &self.method {
            Method::Direct(factors, which) => {
                for (k, &factor) in which.iter().enumerate() {
                    factors[factor].solve(&mut b, D, k);
                }
                b
            }
            Method::Iterative(_) => self.conjugate_gradients(&b, guess)?,
            Method::Petsc(_) => self.by_petsc(&b)?,
        };
        for (dof, value) in solution.into_iter().enumerate() {
            if self.free[dof] {
                x[dof] = value;
            }
        }
        self.numbering.halo.forward(self.world, &mut x, D)?;
        Ok(x)
    }

    fn conjugate_gradients(&mut self, b: &[f64], guess: Option<&[f64]>) -> Result<Vec<f64>> {
        let Method::Iterative(start) = &self.method else { return Ok(b.to_vec()) };
        let (world, owned) = (self.world, b.len());
        let precondition = |r: &[f64], z: &mut [f64]| start.lines.apply::<D>(r, &self.free, z);
        // Local: the product reads ghosts.
        let mut p = vec![0.0; self.numbering.len() * D];
        let mut product = vec![0.0; owned];
        for (dof, b) in b.iter().enumerate() {
            p[dof] = match guess {
                Some(guess) if self.free[dof] => guess[dof],
                Some(_) => 0.0,
                None => b * start.inverse_row_sum[dof / D],
            };
        }
        let mut x = p[..owned].to_vec();
        self.numbering.halo.forward(world, &mut p, D)?;
        self.multiply_free(&p, &mut product);
        let mut r: Vec<f64> = b.iter().zip(&product).map(|(b, p)| b - p).collect();
        p.fill(0.0);
        let mut z = vec![0.0; owned];
        let dot = |a: &[f64], b: &[f64]| -> Vec<f64> {
            let mut sums = [0.0; D];
            for (a, b) in a.chunks_exact(D).zip(b.chunks_exact(D)) {
                for k in 0..D {
                    sums[k] += a[k] * b[k];
                }
            }
            world.sum_slice(&sums)
        };
        precondition(b, &mut z);
        let whole = dot(b, &z);
        precondition(&r, &mut z);
        let mut size = dot(&r, &z);
        // Accelerations of nearly empty nodes are no place to start from.
        let restart: [bool; D] = std::array::from_fn(|k| !(size[k] < whole[k]));
        if restart.contains(&true) {
            for dof in (0..owned).filter(|dof| restart[dof % D]) {
                (x[dof], r[dof]) = (0.0, b[dof]);
            }
            precondition(&r, &mut z);
            size = dot(&r, &z);
        }
        let mut factor = [0.0; D];
        let mut iteration = 0;
        loop {
            let active: [bool; D] =
                std::array::from_fn(|k| size[k] > TOLERANCE * TOLERANCE * whole[k]);
            if !active.contains(&true) {
                break;
            }
            if iteration == MOST_ITERATIONS || size.iter().any(|s| !s.is_finite()) {
                let worst = size.iter().zip(&whole).map(|(s, t)| s / t).fold(0.0, f64::max).sqrt();
                if worst <= ACCEPTABLE {
                    break;
                }
                return Err(Error::Run(format!(
                    "the iteration for the consistent mass stands at a relative residual of \
                     {worst:.1e} after {iteration} iterations: the matrix is near singular; \
                     stabilise it ([ghost] mass_factor = 0.25) or use method.mass = \"lumped\""
                )));
            }
            for (p, z) in p.chunks_exact_mut(D).zip(z.chunks_exact(D)) {
                for k in 0..D {
                    p[k] = z[k] + factor[k] * p[k];
                }
            }
            self.numbering.halo.forward(world, &mut p, D)?;
            self.multiply_free(&p, &mut product);
            let curvature = dot(&p[..owned], &product);
            if (0..D).any(|k| active[k] && curvature[k] <= 0.0) {
                return Err(Error::Run(
                    "the consistent mass matrix is not positive definite; stabilise it ([ghost] \
                     mass_factor = 0.25) or use method.mass = \"lumped\""
                        .into(),
                ));
            }
            let length: [f64; D] =
                std::array::from_fn(|k| if active[k] { size[k] / curvature[k] } else { 0.0 });
            let updated = x.chunks_exact_mut(D).zip(r.chunks_exact_mut(D));
            for ((x, r), (p, product)) in
                updated.zip(p.chunks_exact(D).zip(product.chunks_exact(D)))
            {
                for k in 0..D {
                    x[k] += length[k] * p[k];
                    r[k] -= length[k] * product[k];
                }
            }
            precondition(&r, &mut z);
            let next = dot(&r, &z);
            for k in 0..D {
                factor[k] = if active[k] { next[k] / size[k] } else { 0.0 };
                if active[k] {
                    size[k] = next[k];
                }
            }
            iteration += 1;
        }
        self.iterations += iteration;
        Ok(x)
    }

    /// Rows of free degrees of freedom; zero in the others. `x` is zero there too.
    fn multiply_free(&self, x: &[f64], product: &mut [f64]) {
        mass::multiply::<D>(self.matrix, self.pattern, x, product);
        for (value, free) in product.iter_mut().zip(&self.free) {
            if !free {
                *value = 0.0;
            }
        }
    }

    fn by_petsc(&mut self, b: &[f64]) -> Result<Vec<f64>> {
        let mut x = b.to_vec();
        let mut offsets = vec![0i32];
        let mut columns = Vec::new();
        for row in 0..self.numbering.owned {
            let range = self.pattern.offsets[row]..self.pattern.offsets[row + 1];
            columns.extend(
                self.pattern.columns[range].iter().map(|&c| self.numbering.global[c as usize]),
            );
            offsets.push(columns.len() as i32);
        }
        for k in 0..D {
            let values = self.constrained(k)?;
            let comm = self.world.comm();
            let mut matrix =
                Matrix::from_csr(comm, 1, self.numbering.owned, &offsets, &columns, &values)?;
            matrix.set_spd(true)?;
            let (mut right, mut left) = (matrix.vector()?, matrix.vector()?);
            for (value, b) in right.values_mut()?.iter_mut().zip(b.iter().skip(k).step_by(D)) {
                *value = *b;
            }
            let Method::Petsc(ksp) = &mut self.method else { break };
            ksp.set_operators(&matrix)?;
            let outcome = ksp.solve(&right, &mut left)?.require("the consistent mass")?;
            self.iterations += outcome.iterations;
            for (value, solved) in x.iter_mut().skip(k).step_by(D).zip(left.values()?.iter()) {
                *value = *solved;
            }
        }
        Ok(x)
    }

    /// Values with the rows and columns held in component `k` replaced by the identity.
    fn constrained(&self, k: usize) -> Result<Vec<f64>> {
        let mut free = vec![0.0; self.numbering.len()];
        for (node, mark) in free.iter_mut().enumerate().take(self.numbering.owned) {
            *mark = f64::from(u8::from(self.free[node * D + k]));
        }
        self.numbering.halo.forward(self.world, &mut free, 1)?;
        let mut values = self.matrix.values[..self.pattern.ghost_start].to_vec();
        for row in 0..self.numbering.owned {
            for entry in self.pattern.offsets[row]..self.pattern.offsets[row + 1] {
                let column = self.pattern.columns[entry] as usize;
                if free[row] == 0.0 || free[column] == 0.0 {
                    values[entry] = if column == row { 1.0 } else { 0.0 };
                }
            }
        }
        Ok(values)
    }
}

fn petsc_solver(world: &World) -> Result<Ksp> {
    let mut ksp = Ksp::new(world.comm(), "mass_")?;
    ksp.set_defaults(&[
        ("ksp_type", "cg"),
        ("pc_type", "jacobi"),
        ("ksp_rtol", "1e-14"),
        ("ksp_max_it", "5000"),
    ])?;
    ksp.set_from_options()?;
    Ok(ksp)
}

/// One factor per distinct set of held nodes. Error: the row without a pivot.
fn factors<const D: usize>(
    matrix: &BlockMatrix<1>,
    pattern: &Pattern,
    free: &[bool],
) -> std::result::Result<(Vec<Envelope>, [usize; D]), usize> {
    let mut masks: Vec<Vec<bool>> = Vec::new();
    let mut made = Vec::new();
    let mut which = [0; D];
    for (k, slot) in which.iter_mut().enumerate() {
        let mask: Vec<bool> = free.iter().skip(k).step_by(D).copied().collect();
        *slot = match masks.iter().position(|other| *other == mask) {
            Some(same) => same,
            None => {
                made.push(Envelope::factor(matrix, pattern, &mask)?);
                masks.push(mask);
                made.len() - 1
            }
        };
    }
    Ok((made, which))
}
