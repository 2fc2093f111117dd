//! Levels under a solver: when they are made, how long they serve, what they multiply by.
//!
//! Smoothers, residuals and transfers multiply by matrices in single precision: they stream from
//! memory, and have less than half the bytes. The iteration outside keeps the exact matrix, so the
//! answer does not change. The levels are symmetric. Under an unsymmetric matrix A they are those of
//! (A + A^T) / 2 but for the products of the finest one, which are A's ([`super`] has the exception): docs/evidence/unsymmetric.md.

use super::block_smoother::BlockSmoother;
use super::flow::Flow;
use crate::blocks::BlockProduct;
use crate::error::{Error, Result};
use crate::petsc::abort::unless_shared;
use crate::petsc::multigrid::{self, Level};
use crate::petsc::product_matrix::ProductMatrix;
use crate::petsc::{Index, Ksp, Matrix, agree};

/// Levels from the finest to the last but one, and the last.
pub struct Hierarchy {
    /// The matrix A itself. That of the finest level is A or its symmetric part, rounded.
    pub exact: BlockProduct<f64>,
    /// From the finest to the last but one.
    pub levels: Vec<Smoothed>,
    /// The last.
    pub coarsest: CoarsestRows,
    /// Share of the nodes that flow, where the finest smoother knows them.
    pub flow: Option<f64>,
}

/// A level with a smoother.
pub struct Smoothed {
    /// Its matrix A.
    pub product: BlockProduct<f32>,
    /// Largest eigenvalue of D^-1 A, with what smooths for D.
    pub largest: f64,
    /// P, from the next level to this one.
    pub transfer: BlockProduct<f32>,
    /// What stands in the place of D where nodes are solved together.
    pub smoother: Option<BlockSmoother>,
}

/// This rank's rows of the last level, compressed: global columns, ascending.
#[derive(Debug, Default)]
pub struct CoarsestRows {
    /// Unknowns per node.
    pub block: usize,
    /// Row r is `offsets[r]..offsets[r + 1]`.
    pub offsets: Vec<Index>,
    /// Global scalar columns.
    pub columns: Vec<Index>,
    /// Entry by entry.
    pub values: Vec<f64>,
}

/// A problem whose solver may have a preconditioner of type `mg`.
pub trait Levelled {
    /// Those under its solver.
    fn levels(&mut self) -> &mut Levels;

    /// Levels for the values that the matrix has. `None`: there are none for it.
    fn hierarchy(&mut self, matrix: &mut Matrix) -> Result<Option<Hierarchy>>;

    /// The values that the matrix has now, into what [`Self::hierarchy`] gave as exact, and into the matrix of
    /// its finest level, their symmetric part if that one is symmetric.
    fn fill(
        &mut self,
        matrix: &mut Matrix,
        exact: &mut BlockProduct<f64>,
        finest: &mut BlockProduct<f32>,
    ) -> Result<()>;

    /// The nodes that flow by the values that the matrix has now; `None` where they do not matter. It is
    /// asked after [`Self::hierarchy`] gave a share of them.
    fn flow(&mut self, _matrix: &mut Matrix) -> Result<Option<Flow>> {
        Ok(None)
    }

    /// Gives the smoother of the finest level the values that the matrix has now, where
    /// [`Self::hierarchy`] made one that solves nodes together; `flow`: of [`Self::flow`].
    fn follow(
        &mut self,
        _matrix: &mut Matrix,
        _flow: Option<&Flow>,
        _smoother: &mut BlockSmoother,
    ) -> Result<()> {
        Ok(())
    }
}

/// Chebyshev's smoother takes care of the eigenvalues between these shares of the largest: further
/// down than PETSc's own multigrid goes, as the groups of the finest level are large.
const SMOOTHED: [f64; 2] = [0.06, 1.1];

/// New levels cost about as much as so many iterations (measured: 20 in the plane, 40 in space).
const WORTH: f64 = 25.0;

/// The levels under the solver of one problem.
#[derive(Default)]
pub struct Levels(Option<Installed>);

/// A hierarchy in use.
struct Installed {
    /// States of the matrix that the levels were made for, and that the products hold.
    made: u64,
    filled: u64,
    exact: ProductMatrix<BlockProduct<f64>>,
    /// From the finest on.
    levels: Vec<Level<BlockProduct<f32>>>,
    /// Iterations per digit of the first solve.
    pace: Option<f64>,
    slow: bool,
    /// [`Hierarchy::flow`].
    flow: Option<f64>,
}

impl Levels {
    /// Before a linear solve: makes levels for the matrix as it is, or where those there are shall
    /// serve on, renews what the finest multiplies by. Nothing is done where the preconditioner is
    /// another. `earlier`: solves with these equations before. Collective.
    pub fn prepare(
        problem: &mut impl Levelled,
        solver: &Ksp,
        matrix: &mut Matrix,
        earlier: usize,
    ) -> Result<()> {
        let mut levels = std::mem::take(problem.levels());
        let outcome = levels.renew(problem, solver, matrix, earlier);
        *problem.levels() = levels;
        outcome
    }

    fn renew(
        &mut self,
        problem: &mut impl Levelled,
        solver: &Ksp,
        matrix: &mut Matrix,
        earlier: usize,
    ) -> Result<()> {
        if earlier == 0 {
            self.0 = None;
        }
        if !multigrid::is_wanted(solver)? {
            return Ok(());
        }
        let (kept, state) = (multigrid::is_kept(solver)?, matrix.state()?);
        let serving = self.0.as_ref().filter(|levels| levels.serves(state, kept));
        let known = serving.filter(|levels| !levels.hold(state)).and_then(|levels| levels.flow);
        let flow = match known {
            Some(_) => agree(solver.comm(), problem.flow(matrix))?,
            None => None,
        };
        let begins = flow.as_ref().zip(known).is_some_and(|(flow, then)| flow.has_changed(then));
        if serving.is_none() || begins {
            let made = agree(solver.comm(), problem.hierarchy(matrix))?;
            let installed = made.map(|made| Installed::new(solver, state, made)).transpose();
            self.0 = installed.map_err(|error| unless_shared(solver.comm(), error))?;
        }
        let Some(levels) = &mut self.0 else { return Ok(()) };
        if !levels.hold(state) {
            // Ranks write their rows together: an error on one must not leave the others waiting.
            levels.follow(state, |exact, finest| {
                agree(solver.comm(), problem.fill(matrix, exact, finest))
            })?;
            multigrid::renew_finest_smoother(solver, |smoother: &mut BlockSmoother| {
                agree(solver.comm(), problem.follow(matrix, flow.as_ref(), smoother))
            })?;
        }
        multigrid::multiply_by(solver, &levels.exact, matrix)
    }

    /// After a linear solve: levels that have become slow are not kept.
    pub fn record_solve(&mut self, iterations: usize, tolerance: f64) {
        let Some(levels) = &mut self.0 else { return };
        let (iterations, digits) = (iterations as f64, -tolerance.log10());
        match levels.pace {
            None => levels.pace = Some(iterations / digits),
            Some(pace) => levels.slow = iterations - pace * digits > WORTH,
        }
    }
}

impl Installed {
    /// Collective.
    fn new(solver: &Ksp, state: u64, hierarchy: Hierarchy) -> Result<Self> {
        let Hierarchy { exact, levels, coarsest, flow } = hierarchy;
        let comm = solver.comm();
        let mut smoothers = Vec::new();
        let level = |Smoothed { product, largest, transfer, smoother }| -> Result<_> {
            smoothers.push(smoother);
            Ok(Level {
                matrix: ProductMatrix::new(comm, product)?,
                transfer: ProductMatrix::new(comm, transfer)?,
                smoothed: SMOOTHED.map(|share| share * largest),
            })
        };
        let levels = levels.into_iter().map(level).collect::<Result<Vec<_>>>()?;
        if levels.is_empty() {
            return Err(Error::Environment("a hierarchy without levels".into()));
        }
        let CoarsestRows { block, offsets, columns, values } = coarsest;
        let rows = offsets.len() - 1;
        let coarsest = Matrix::from_csr(comm, block, rows, &offsets, &columns, &values)?;
        multigrid::install(solver, &levels, smoothers, &coarsest)?;
        let exact = ProductMatrix::new(comm, exact)?;
        Ok(Installed { made: state, filled: state, exact, levels, pace: None, slow: false, flow })
    }

    /// Whether the levels shall serve for the matrix of `state`; `kept`: the user's lag says so.
    fn serves(&self, state: u64, kept: bool) -> bool {
        self.made == state || (kept && !self.slow)
    }

    /// Whether the values of `state` are in the matrices.
    fn hold(&self, state: u64) -> bool {
        self.filled == state
    }

    /// Lets `fill` write the values of `state` into the exact matrix and the finest level's; the finest
    /// smoother is to follow, the other levels stay.
    fn follow(
        &mut self,
        state: u64,
        fill: impl FnOnce(&mut BlockProduct<f64>, &mut BlockProduct<f32>) -> Result<()>,
    ) -> Result<()> {
        self.filled = state;
        let finest = &mut self.levels[0].matrix;
        self.exact.change(|exact| finest.change(|rounded| fill(exact, rounded)))
    }
}
