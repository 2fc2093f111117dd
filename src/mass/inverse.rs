//! M x = b (Ghost eq. 6, 10) for all components at once, with values prescribed at some nodes.
//!
//! Small systems of one rank are factored; larger ones are solved by conjugate gradients
//! ([`crate::mass::iteration`]) with an incomplete factor as preconditioner, all components in lockstep.
//! With any PETSc option `-mass_...` the system goes to PETSc instead (default there: `cg`,
//! `jacobi`, relative tolerance 1e-14), component by component.

use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::parallel::World;
use crate::petsc::{Ksp, Matrix, options};

use super::elimination::Order;
use super::envelope::{self, Envelope};
use super::incomplete::Incomplete;
use super::iteration::Iteration;
use super::matrix;
use crate::system::border::Border;
use crate::system::numbering::Numbering;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockMatrix;

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
    preconditioner: Incomplete,
    inverse_row_sum: Vec<f64>,
    rows: Border,
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
            .map(|row| pattern.diagonal(row).map_or(0.0, |entry| matrix.values[entry]))
            .collect();
        let free: Vec<bool> =
            (0..rows * D).map(|dof| !held[dof] && diagonal[dof / D] != 0.0).collect();
        let method = if options::any_set(PREFIX)? {
            Method::Petsc(Box::new(petsc_solver(world, PREFIX)?))
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
            let border = pattern.border(rows);
            let order = Order::new(grid, numbering, pattern, &border);
            Method::Iterative(Box::new(Start {
                preconditioner: Incomplete::factor(
                    world, order, matrix, numbering, pattern, &diagonal,
                ),
                inverse_row_sum: matrix::row_sums(matrix, pattern, rows)
                    .iter()
                    .map(one_over)
                    .collect(),
                rows: border,
            }))
        };
        Ok(MassInverse { world, numbering, pattern, matrix, free, method, iterations: 0 })
    }

    /// Solves for the free values. `rhs`: owned degrees of freedom; `prescribed`: local ones,
    /// read where held. Returns local values, ghosts included. Collective. Error: a right-hand
    /// side that is not finite, or no convergence.
    pub fn solve(&mut self, rhs: &[f64], prescribed: &[f64]) -> Result<Vec<f64>> {
        let mut x = self.solve_from(rhs, prescribed, None)?;
        self.numbering.halo.forward(self.world, &mut x, D)?;
        Ok(x)
    }

    /// [`Self::solve`] with local values `guess` near the solution, where an iteration may start.
    /// The ghosts are left without their values.
    pub fn solve_from(
        &mut self,
        rhs: &[f64],
        prescribed: &[f64],
        guess: Option<&[f64]>,
    ) -> Result<Vec<f64>> {
        let [prepared] = self.prepare([rhs], [prescribed])?;
        let solution = match &self.method {
            Method::Iterative(start) => {
                let guess = guess.map(|guess| self.freed(guess));
                let guess = guess.as_ref().map(|guess| guess.as_chunks::<D>().0);
                let (b, free) = (prepared.b.as_chunks::<D>().0, self.free.as_chunks::<D>().0);
                let (x, iterations) = self.iteration(start).solve(b, free, guess)?;
                self.iterations += iterations;
                x.into_flattened()
            }
            Method::Direct(factors, which) => {
                let mut b = prepared.b;
                for (k, &factor) in which.iter().enumerate() {
                    factors[factor].solve(&mut b, D, k);
                }
                b
            }
            Method::Petsc(_) => self.by_petsc(&prepared.b)?,
        };
        Ok(self.complete(solution, prepared.x))
    }

    /// [`Self::solve_from`] for two right-hand sides, in one iteration where there is one.
    pub fn solve_two(
        &mut self,
        rhs: [&[f64]; 2],
        prescribed: [&[f64]; 2],
    ) -> Result<[Vec<f64>; 2]> {
        let Method::Iterative(start) = &self.method else {
            let first = self.solve_from(rhs[0], prescribed[0], None)?;
            return Ok([first, self.solve_from(rhs[1], prescribed[1], None)?]);
        };
        let [first, second] = self.prepare(rhs, prescribed)?;
        let iteration = self.iteration(start);
        // Twice D is not a constant that the language can compute from D.
        let (solutions, iterations) = match D {
            2 => side_by_side::<D, 4>(&iteration, [&first.b, &second.b], &self.free)?,
            _ => side_by_side::<D, 6>(&iteration, [&first.b, &second.b], &self.free)?,
        };
        self.iterations += iterations;
        let [one, two] = solutions;
        Ok([self.complete(one, first.x), self.complete(two, second.x)])
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

    fn iteration<'b>(&'b self, start: &'b Start) -> Iteration<'b> {
        Iteration {
            world: self.world,
            numbering: self.numbering,
            pattern: self.pattern,
            matrix: self.matrix,
            preconditioner: &start.preconditioner,
            inverse_row_sum: &start.inverse_row_sum,
            rows: &start.rows,
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

/// Two right-hand sides of `D` values per node as one of `C` = 2 `D`.
fn side_by_side<const D: usize, const C: usize>(
    iteration: &Iteration<'_>,
    rhs: [&[f64]; 2],
    free: &[bool],
) -> Result<([Vec<f64>; 2], usize)> {
    let joined = |k: usize, node: usize| rhs[k / D][node * D + k % D];
    let nodes = free.len() / D;
    let b: Vec<[f64; C]> =
        (0..nodes).map(|node| std::array::from_fn(|k| joined(k, node))).collect();
    let free: Vec<[bool; C]> =
        (0..nodes).map(|node| std::array::from_fn(|k| free[node * D + k % D])).collect();
    let (x, iterations) = iteration.solve(&b, &free, None)?;
    let part = |side: usize| -> Vec<f64> {
        x.iter().flat_map(|x| x[side * D..side * D + D].iter().copied()).collect()
    };
    Ok(([part(0), part(1)], iterations))
}

/// Of the options that hand the system to PETSc.
pub const PREFIX: &str = "mass_";

/// PETSc's solver with options of this prefix.
pub fn petsc_solver(world: &World, prefix: &str) -> Result<Ksp> {
    let mut ksp = Ksp::new(world.comm(), prefix)?;
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
