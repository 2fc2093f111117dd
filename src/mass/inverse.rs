//! M x = b (Ghost eq. 6, 10) for all components at once, with values prescribed at some nodes.
//!
//! PETSc's KSP solves for all components of all right-hand sides as one vector. A small mass on one rank has a
//! complete factor, which it applies once (`preonly`). Elsewhere it takes conjugate gradients with an
//! incomplete factor that spans the ranks, or what options `-mass_...` say. An iteration
//! solves for what a first guess lacks, M d = b - M x0, with each column scaled to a right-hand side
//! near one: columns of different size (momentum beside force) share the iteration and its end.

use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::parallel::World;
use crate::petsc::KspOutcome;

use super::elimination::Order;
use super::envelope::Complete;
use super::incomplete::Incomplete;
use super::matrix;
use super::solver::{MassSolver, Way};
use super::system::{Factor, Product, System};
use crate::system::border::Border;
use crate::system::numbering::Numbering;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockMatrix;

/// Where round-off stops the iteration before its tolerance, this relative residual is accepted.
const ACCEPTABLE: f64 = 1e-10;

/// A mass matrix ready to be inverted. `D` components, each with its own held nodes.
pub struct MassInverse<'a, const D: usize> {
    world: &'a World,
    grid: &'a Grid<D>,
    numbering: &'a Numbering,
    pattern: &'a Pattern,
    matrix: &'a BlockMatrix<1>,
    solver: &'a mut MassSolver,
    /// The preconditioner, unless the user has named another.
    factor: Option<Factor>,
    way: Way,
    rows: Border,
    /// Per owned degree of freedom: to be solved for.
    free: Vec<bool>,
    /// One over the lumped mass, per owned node: where the iteration starts without a guess. For
    /// a constant field that is the solution. Zero where there is no mass.
    inverse_row_sum: Vec<f64>,
    /// Iterations so far.
    pub iterations: usize,
}

/// A right-hand side with what is prescribed taken to it, and what is prescribed.
struct Prepared {
    /// Owned degrees of freedom, zero where held.
    b: Vec<f64>,
    /// Local ones, zero where free.
    x: Vec<f64>,
}

impl<'a, const D: usize> MassInverse<'a, D> {
    /// `held`: per local degree of freedom, prescribed by a condition. Nodes without any mass
    /// are held at zero. `solver` serves any number of matrices, one after the other. Collective.
    pub fn new(
        world: &'a World,
        grid: &'a Grid<D>,
        numbering: &'a Numbering,
        pattern: &'a Pattern,
        matrix: &'a BlockMatrix<1>,
        held: &[bool],
        solver: &'a mut MassSolver,
    ) -> Result<Self> {
        let owned = numbering.owned;
        let diagonal: Vec<f64> = (0..owned)
            .map(|row| pattern.diagonal(row).map_or(0.0, |entry| matrix.values[entry]))
            .collect();
        let free: Vec<bool> =
            (0..owned * D).map(|dof| !held[dof] && diagonal[dof / D] != 0.0).collect();
        solver.forget(world)?;
        let rows = pattern.border(owned);
        let ours = solver.of(world, 1, Way::Iterate)?.preconditions_by_ours();
        let complete = (ours && world.size() == 1)
            .then(|| Complete::factor(matrix, pattern, (&free, D)))
            .flatten();
        let way = match &complete {
            Some(factor) if factor.is_sound() && solver.may_apply_once()? => Way::ApplyOnce,
            _ => Way::Iterate,
        };
        let incomplete = || {
            let order = Order::new(grid, numbering, pattern, &rows);
            Incomplete::factor(world, order, matrix, numbering, pattern, &diagonal)
        };
        let factor = match complete {
            Some(factor) => Some(Factor::Complete(factor)),
            None => ours.then(|| Factor::Incomplete(incomplete())),
        };
        let one_over = |value: &f64| if *value == 0.0 { 0.0 } else { 1.0 / value };
        let sums = matrix::row_sums(matrix, pattern, owned);
        let inverse_row_sum = sums.iter().map(one_over).collect();
        Ok(MassInverse {
            world,
            grid,
            numbering,
            pattern,
            matrix,
            solver,
            factor,
            way,
            rows,
            free,
            inverse_row_sum,
            iterations: 0,
        })
    }

    /// Solves for the free values. `rhs`: owned degrees of freedom; `prescribed`: local ones,
    /// read where held. Returns local values, ghosts included. Collective. Error: a right-hand
    /// side that is not finite, or no convergence.
    pub fn solve(&mut self, rhs: &[f64], prescribed: &[f64]) -> Result<Vec<f64>> {
        let mut x = self.solve_from(rhs, prescribed, None)?;
        self.numbering.halo.forward(self.world, &mut x, D)?;
        Ok(x)
    }

    /// [`Self::solve`] with local values `guess` near the solution, where the iteration may start.
    /// The ghosts are left without their values.
    pub fn solve_from(
        &mut self,
        rhs: &[f64],
        prescribed: &[f64],
        guess: Option<&[f64]>,
    ) -> Result<Vec<f64>> {
        let [prepared] = self.prepare([rhs], [prescribed])?;
        let guess = guess.map(|guess| self.freed(guess));
        let guess = guess.as_ref().map(|guess| guess.as_chunks::<D>().0);
        let free = self.free.clone();
        let (b, free) = (prepared.b.as_chunks::<D>().0, free.as_chunks::<D>().0);
        let solution = self.solve_columns(1, b, free, guess)?.into_flattened();
        Ok(self.complete(solution, prepared.x))
    }

    /// [`Self::solve_from`] for two right-hand sides in one iteration.
    pub fn solve_two(
        &mut self,
        rhs: [&[f64]; 2],
        prescribed: [&[f64]; 2],
    ) -> Result<[Vec<f64>; 2]> {
        let [first, second] = self.prepare(rhs, prescribed)?;
        // Twice D is not a constant that the language can compute from D.
        let solutions = match D {
            2 => self.side_by_side::<4>([&first.b, &second.b])?,
            _ => self.side_by_side::<6>([&first.b, &second.b])?,
        };
        let [one, two] = solutions;
        Ok([self.complete(one, first.x), self.complete(two, second.x)])
    }

    /// Two right-hand sides of `D` values per node as one of `C` = 2 `D`.
    fn side_by_side<const C: usize>(&mut self, rhs: [&[f64]; 2]) -> Result<[Vec<f64>; 2]> {
        let joined = |k: usize, node: usize| rhs[k / D][node * D + k % D];
        let nodes = self.numbering.owned;
        let b: Vec<[f64; C]> =
            (0..nodes).map(|node| std::array::from_fn(|k| joined(k, node))).collect();
        let free: Vec<[bool; C]> =
            (0..nodes).map(|node| std::array::from_fn(|k| self.free[node * D + k % D])).collect();
        let x = self.solve_columns(2, &b, &free, None)?;
        let part = |side: usize| -> Vec<f64> {
            x.iter().flat_map(|x| x[side * D..side * D + D].iter().copied()).collect()
        };
        Ok([part(0), part(1)])
    }

    /// The solution at the owned nodes. `free`: the values to be solved for, the others stay zero,
    /// as they are in `b` and `guess`, the place to start from. Collective.
    fn solve_columns<const C: usize>(
        &mut self,
        sides: usize,
        b: &[[f64; C]],
        free: &[[bool; C]],
        guess: Option<&[[f64; C]]>,
    ) -> Result<Vec<[f64; C]>> {
        let MassInverse { world, numbering, pattern, matrix, rows, solver, factor, .. } = self;
        let product = Product { world, numbering, pattern, matrix, rows };
        if self.way == Way::ApplyOnce {
            let mut x = vec![[0.0; C]; b.len()];
            let mut system = System::new(product, factor.as_ref(), free);
            let (right, left) = (b.as_flattened(), x.as_flattened_mut());
            let solver = solver.of(world, sides, Way::ApplyOnce)?;
            let outcome = solver.solve(world.comm(), &mut system, right, left)?;
            self.iterations += outcome.iterations;
            self.require(outcome)?;
            return Ok(x);
        }
        let mut x = vec![[0.0; C]; numbering.len()];
        match guess {
            Some(guess) => x[..b.len()].copy_from_slice(guess),
            None => {
                for ((x, b), inverse) in x.iter_mut().zip(b).zip(&self.inverse_row_sum) {
                    *x = b.map(|b| b * inverse);
                }
            }
        }
        let mut r = vec![[0.0; C]; b.len()];
        product.multiply(&mut x, &mut r);
        let mut sizes = [[0.0; C]; 2];
        for (row, inverse) in self.inverse_row_sum.iter().map(|inverse| inverse.abs()).enumerate() {
            for k in 0..C {
                r[row][k] = if free[row][k] { b[row][k] - r[row][k] } else { 0.0 };
                sizes[0][k] += b[row][k] * b[row][k] * inverse;
                sizes[1][k] += r[row][k] * r[row][k] * inverse;
            }
        }
        let sums = world.sum_slice(sizes.as_flattened());
        // Powers of two leave the digits as they are.
        let scale: [f64; C] = std::array::from_fn(|k| match sums[k].sqrt() {
            size if size.is_normal() => size.log2().round().exp2(),
            _ => 1.0,
        });
        // Accelerations of nearly empty nodes are no place to start from.
        let restart: [bool; C] = std::array::from_fn(|k| !(sums[C + k] < sums[k]));
        x.truncate(b.len());
        for (row, (x, r)) in x.iter_mut().zip(&mut r).enumerate() {
            for k in 0..C {
                if restart[k] {
                    (x[k], r[k]) = (0.0, b[row][k]);
                }
                r[k] /= scale[k];
            }
        }
        let mut found = vec![[0.0; C]; b.len()];
        let mut system = System::new(product, factor.as_ref(), free);
        let (right, left) = (r.as_flattened(), found.as_flattened_mut());
        let solver = solver.of(world, sides, Way::Iterate)?;
        let outcome = solver.solve(world.comm(), &mut system, right, left)?;
        self.iterations += outcome.iterations;
        self.require(outcome)?;
        for (x, found) in x.iter_mut().zip(&found) {
            for k in 0..C {
                x[k] += scale[k] * found[k];
            }
        }
        Ok(x)
    }

    /// Error: the solve failed, with the node that has the least mass. Collective if it did.
    fn require(&self, outcome: KspOutcome) -> Result<()> {
        // The right-hand sides are about one.
        if outcome.converged || outcome.residual_norm <= ACCEPTABLE {
            return Ok(());
        }
        let mass = |row: usize| self.pattern.diagonal(row).map(|entry| self.matrix.values[entry]);
        let lightest = (0..self.numbering.owned)
            .filter_map(|row| Some((mass(row).filter(|mass| *mass != 0.0)?, row)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let least = self.world.min(lightest.map_or(f64::INFINITY, |(mass, _)| mass));
        let mine = lightest
            .filter(|(mass, _)| *mass <= least)
            .map(|(_, row)| format!("{:?}", self.grid.node_position(self.numbering.nodes[row])));
        let place = self.world.first_message(mine).unwrap_or_default();
        Err(Error::Run(format!(
            "the consistent mass cannot be inverted: its solver ended with {} after {} iterations \
             (relative residual {:.1e}); the matrix is near singular, and the node at {place} m \
             hardly carries any mass; stabilise it ([ghost] mass_factor = 0.25) or use \
             method.mass = \"lumped\"",
            outcome.reason, outcome.iterations, outcome.residual_norm
        )))
    }

    /// Collective. Error: a right-hand side that is not finite.
    fn prepare<const N: usize>(
        &self,
        rhs: [&[f64]; N],
        prescribed: [&[f64]; N],
    ) -> Result<[Prepared; N]> {
        let owned = self.numbering.owned * D;
        let mark = |mark: bool| f64::from(u8::from(mark));
        let mut x = [(); N].map(|()| vec![0.0; self.numbering.len() * D]);
        // What moves, then whether there are bad values.
        let mut marks = vec![0.0; N + 1];
        for (k, x) in x.iter_mut().enumerate() {
            for dof in (0..owned).filter(|&dof| !self.free[dof]) {
                x[dof] = prescribed[k][dof];
                marks[k] += mark(x[dof] != 0.0);
            }
        }
        marks[N] = mark(rhs.iter().any(|b| b.iter().any(|b| !b.is_finite())));
        let marks = self.world.sum_slice(&marks);
        if marks[N] > 0.0 {
            return Err(Error::Run("momentum or force at the nodes is not finite".into()));
        }
        if marks.iter().any(|&mark| mark > 0.0) {
            let fields = x.each_mut().map(|x| &mut x[..]);
            self.numbering.halo.forward_while(self.world, fields, D, |_| ());
        }
        Ok(std::array::from_fn(|k| {
            let (mut b, x) = (rhs[k].to_vec(), std::mem::take(&mut x[k]));
            if marks[k] > 0.0 {
                let mut share = vec![0.0; owned];
                matrix::multiply::<D>(self.matrix, self.pattern, &x, &mut share);
                for (b, s) in b.iter_mut().zip(share) {
                    *b -= s;
                }
            }
            for (b, free) in b.iter_mut().zip(&self.free) {
                if !free {
                    *b = 0.0;
                }
            }
            Prepared { b, x }
        }))
    }

    /// The free values of `solution` put into `x`.
    fn complete(&self, solution: Vec<f64>, mut x: Vec<f64>) -> Vec<f64> {
        for (dof, value) in solution.into_iter().enumerate() {
            if self.free[dof] {
                x[dof] = value;
            }
        }
        x
    }

    fn freed(&self, values: &[f64]) -> Vec<f64> {
        values.iter().zip(&self.free).map(|(v, free)| if *free { *v } else { 0.0 }).collect()
    }
}
