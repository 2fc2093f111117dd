//! The user's options tried on a small system, so that what PETSc refuses ends a run before it has
//! begun. Many values are looked at only when a solver is set up: factorisations that a kind of
//! matrix does not have, methods and preconditioners that do not go together.
//!
//! The options are copied to a prefix of their own: those of the run stay unread.

use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;

use crate::amg::{CoarsestRows, Hierarchy, Levelled, Levels, Smoothed};
use crate::blocks::{BlockProduct, Row};
use crate::error::{Error, Result};
use crate::petsc::check::essence;
use crate::petsc::known::without_nesting;
use crate::petsc::{Index, Ksp, Matrix, NewtonProblem, Snes, Verdict, agree, options};

/// Stands for the prefix of the solver.
const PREFIX: &str = "rehearsal_";
/// Beginnings of the names that print or write.
const LOUD: [&str; 9] = [
    "ksp_view",
    "ksp_converged",
    "ksp_monitor",
    "ksp_compute_eigen",
    "snes_view",
    "snes_converged",
    "snes_monitor",
    "snes_linesearch_monitor",
    "mat_mumps_icntl_4",
];
/// Blocks of the small system on each rank.
const BLOCKS: usize = 32;

/// A user's options for the solver of one prefix.
pub struct Rehearsal {
    /// As the user gave them.
    given: Vec<String>,
}

impl Rehearsal {
    /// `None`: the user has none with this prefix (without the dash) that have not been read yet.
    pub fn new(prefix: &str) -> Result<Option<Self>> {
        let begin = format!("-{prefix}");
        let given: Vec<String> =
            options::unused()?.into_iter().filter(|option| option.starts_with(&begin)).collect();
        for option in &given {
            let (name, value) = option.split_once(' ').unwrap_or((option, ""));
            let own = &name[begin.len()..];
            // The program's own preconditioner, which the small system does not have.
            if own == "pc_type" && value == "shell" {
                continue;
            }
            if !LOUD.iter().any(|word| without_nesting(own).starts_with(word)) {
                options::set(&format!("{PREFIX}{own}"), value)?;
            }
        }
        Ok((!given.is_empty()).then_some(Rehearsal { given }))
    }

    /// Solves the small system in blocks of size `D` by what `make` returns for a prefix.
    /// Whether it converges does not matter. Collective.
    ///
    /// # Errors
    /// `Input`, the same on all ranks: PETSc cannot work with the options.
    pub fn newton<const D: usize>(
        self,
        comm: &SimpleCommunicator,
        make: impl FnOnce(&str) -> Result<Snes>,
    ) -> Result<()> {
        let outcome = make(PREFIX).and_then(|mut snes| {
            let mut matrix = chain::<D>(comm)?;
            let mut x = matrix.vector()?;
            let first = comm.rank() as usize * BLOCKS;
            snes.solve(&mut Chain::<D> { first, levels: Levels::default() }, &mut matrix, &mut x)
        });
        self.end(comm, outcome.map(drop))
    }

    /// The same for a linear solver.
    pub fn linear<const D: usize>(
        self,
        comm: &SimpleCommunicator,
        make: impl FnOnce(&str) -> Result<Ksp>,
    ) -> Result<()> {
        let outcome = make(PREFIX).and_then(|mut ksp| {
            let matrix = chain::<D>(comm)?;
            let (mut b, mut x) = (matrix.vector()?, matrix.vector()?);
            b.set(1.0)?;
            ksp.set_operators(&matrix)?;
            ksp.solve(&b, &mut x)
        });
        self.end(comm, outcome.map(drop))
    }

    fn end(self, comm: &SimpleCommunicator, outcome: Result<()>) -> Result<()> {
        options::clear_all(PREFIX)?;
        agree(comm, outcome).map_err(|error| {
            let why = match &error {
                Error::Environment(_) => essence(&error),
                _ => error.to_string(),
            };
            Error::Input(format!("PETSc does not accept {}: {why}", self.given.join(" ")))
        })
    }
}

/// Blocks in a row on each rank, 4 I on the diagonal and -I beside it.
fn entries(block: usize) -> impl Iterator<Item = (usize, f64)> {
    let beside = |other: Option<usize>| other.filter(|&k| k < BLOCKS).map(|k| (k, -1.0));
    [beside(block.checked_sub(1)), Some((block, 4.0)), beside(Some(block + 1))]
        .into_iter()
        .flatten()
}

fn push<const D: usize>(block: usize, row: &mut Row<D, D>) {
    let scaled =
        |v: f64| std::array::from_fn(|i| std::array::from_fn(|j| if i == j { v } else { 0.0 }));
    row.extend(entries(block).map(|(column, value)| (column, scaled(value))));
}

/// The same row by row, `first` the number of this rank's first block.
fn rows<const D: usize>(first: usize) -> CoarsestRows {
    let mut rows = CoarsestRows { block: D, offsets: vec![0], ..CoarsestRows::default() };
    for dof in 0..BLOCKS * D {
        for (column, value) in entries(dof / D) {
            for i in 0..D {
                rows.columns.push(((first + column) * D + i) as Index);
                rows.values.push(if i == dof % D { value } else { 0.0 });
            }
        }
        rows.offsets.push(rows.columns.len() as Index);
    }
    rows
}

fn chain<const D: usize>(comm: &SimpleCommunicator) -> Result<Matrix> {
    let first = comm.rank() as usize * BLOCKS;
    let rows = rows::<D>(first);
    let count = BLOCKS * D;
    let mut matrix = Matrix::from_csr(comm, D, count, &rows.offsets, &rows.columns, &rows.values)?;
    matrix.set_symmetric(true)?;
    if D == 1 {
        return Ok(matrix);
    }
    let places = (first..first + BLOCKS).flat_map(|k| [k as f64, 0.0, 0.0].into_iter().take(D));
    matrix.set_rigid_body_near_null_space(&places.collect::<Vec<_>>())?;
    Ok(matrix)
}

/// K x = 1.
struct Chain<const D: usize> {
    /// Number of this rank's first block.
    first: usize,
    levels: Levels,
}

impl<const D: usize> NewtonProblem for Chain<D> {
    fn residual(&mut self, x: &[f64], f: &mut [f64], _matrix: &mut Matrix) -> Result<bool> {
        for dof in 0..f.len() {
            let sum: f64 =
                entries(dof / D).map(|(block, value)| value * x[block * D + dof % D]).sum();
            f[dof] = sum - 1.0;
        }
        Ok(true)
    }

    fn jacobian(&mut self, _x: &[f64], matrix: &mut Matrix) -> Result<()> {
        matrix.changed()
    }

    fn before_solve(&mut self, _rhs: &mut [f64]) -> Result<()> {
        Ok(())
    }

    fn assess(&mut self, _iteration: usize, _x: &[f64], f: &[f64]) -> Result<Verdict> {
        let small = f.iter().all(|f| f.abs() < 1e-6);
        Ok(if small { Verdict::Converged } else { Verdict::Continue })
    }

    fn prepare_solver(&mut self, solver: &Ksp, matrix: &mut Matrix, earlier: usize) -> Result<()> {
        Levels::prepare(self, solver, matrix, earlier)
    }

    fn record_solve(&mut self, iterations: usize, tolerance: f64) {
        self.levels.record_solve(iterations, tolerance);
    }
}

impl<const D: usize> Levelled for Chain<D> {
    fn levels(&mut self) -> &mut Levels {
        &mut self.levels
    }

    fn hierarchy(&mut self, _matrix: &mut Matrix) -> Result<Option<Hierarchy>> {
        let mut exact = BlockProduct::symmetric::<D>(BLOCKS, Vec::new(), 3 * BLOCKS);
        exact.fill::<D>(push::<D>);
        let mut product = BlockProduct::symmetric::<D>(BLOCKS, Vec::new(), 3 * BLOCKS);
        exact.round_into(&mut product);
        // Each block is a group of its own.
        let unit = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
        let transfer =
            BlockProduct::collect::<D, D>(BLOCKS, BLOCKS, Vec::new(), BLOCKS, |k, row| {
                row.push((k, unit));
            });
        let levels = vec![Smoothed { product, largest: 1.5, transfer, smoother: None }];
        Ok(Some(Hierarchy { exact, levels, coarsest: rows::<D>(self.first), flow: None }))
    }

    fn fill(
        &mut self,
        _matrix: &mut Matrix,
        exact: &mut BlockProduct<f64>,
        finest: &mut BlockProduct<f32>,
    ) -> Result<()> {
        exact.fill::<D>(push::<D>);
        exact.round_into(finest);
        Ok(())
    }
}
