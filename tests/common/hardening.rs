//! A x + c x^3 = c on a made-up block, solved by Newton's method with multigrid.
#![allow(dead_code)]

use mpm_par::amg::flow::Flow;
use mpm_par::amg::level::BlockCsr;
use mpm_par::amg::symmetric_part::symmetric_part;
use mpm_par::amg::tied::Ties;
use mpm_par::amg::{self, BlockSmoother, Hierarchy, Levelled, Levels};
use mpm_par::blocks::BlockProduct;
use mpm_par::error::Result;
use mpm_par::parallel::World;
use mpm_par::petsc::{Index, Ksp, Matrix, NewtonProblem, Snes, Verdict};

use super::block::{Block, Share};

/// c of [`Hardening`].
const HARDENING: f64 = 1e-3;

/// A x + c x^3 = c with the block's A.
pub struct Hardening<'a, const D: usize> {
    world: &'a World,
    share: Share<D>,
    levels: bool,
    symmetric: bool,
    /// c
    load: f64,
    /// Hierarchies made, and renewals of the finest matrix.
    made: [usize; 2],
    residual: f64,
    installed: Levels,
}

impl<const D: usize> Hardening<'_, D> {
    fn tangent(&self, x: &[f64]) -> BlockCsr<D> {
        let BlockCsr { offsets, columns, values } = &self.share.rows;
        let mut values = values.clone();
        for row in 0..self.share.nodes.owned {
            for k in offsets[row]..offsets[row + 1] {
                if columns[k] as usize == row {
                    for axis in 0..D {
                        values[k][axis][axis] += 3.0 * self.load * x[row * D + axis].powi(2);
                    }
                }
            }
        }
        BlockCsr { offsets: offsets.clone(), columns: columns.clone(), values }
    }

    /// Scalar rows of blocks: offsets, global columns, values.
    fn scalars(&self, rows: &BlockCsr<D>) -> (Vec<Index>, Vec<Index>, Vec<f64>) {
        let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        for row in 0..self.share.nodes.owned {
            let range = rows.offsets[row]..rows.offsets[row + 1];
            let mut order: Vec<usize> = range.collect();
            let number = |k: usize| self.share.nodes.global[rows.columns[k] as usize];
            order.sort_unstable_by_key(|&k| number(k));
            for r in 0..D {
                for &k in &order {
                    columns.extend((0..D as Index).map(|s| number(k) * D as Index + s));
                    values.extend_from_slice(&rows.values[k][r]);
                }
                offsets.push(columns.len() as Index);
            }
        }
        (offsets, columns, values)
    }

    fn of_matrix(&self, matrix: &mut Matrix) -> Result<BlockCsr<D>> {
        // From the matrix and not from x: what is in it is what counts.
        let BlockCsr { offsets, columns, .. } = &self.share.rows;
        let (own, other) = matrix.storage()?;
        let other = other.as_deref().unwrap_or(&[]);
        let (mut inside, mut outside) = (own.iter(), other.iter());
        let mut values = vec![[[0.0; D]; D]; columns.len()];
        for row in 0..self.share.nodes.owned {
            let number = |k: usize| self.share.nodes.global[columns[k] as usize];
            let mut order: Vec<usize> = (offsets[row]..offsets[row + 1]).collect();
            order.sort_unstable_by_key(|&k| number(k));
            for r in 0..D {
                for &k in &order {
                    let here = (columns[k] as usize) < self.share.nodes.owned;
                    for s in 0..D {
                        let next = if here { inside.next() } else { outside.next() };
                        values[k][r][s] = *next.expect("an entry of the pattern");
                    }
                }
            }
        }
        Ok(BlockCsr { offsets: offsets.clone(), columns: columns.clone(), values })
    }
}

impl<const D: usize> NewtonProblem for Hardening<'_, D> {
    fn residual(&mut self, x: &[f64], f: &mut [f64], _: &mut Matrix) -> Result<bool> {
        let mut all = x.to_vec();
        all.resize(self.share.nodes.local() * D, 0.0);
        self.share.nodes.halo.forward(self.world, &mut all, D)?;
        let BlockCsr { offsets, columns, values } = &self.share.rows;
        for row in 0..self.share.nodes.owned {
            for r in 0..D {
                let terms = (offsets[row]..offsets[row + 1]).flat_map(|k| {
                    let x = &all[columns[k] as usize * D..];
                    (0..D).map(move |s| values[k][r][s] * x[s])
                });
                f[row * D + r] = terms.sum::<f64>() + self.load * (x[row * D + r].powi(3) - 1.0);
            }
        }
        self.residual = self.world.sum(f.iter().map(|f| f * f).sum()).sqrt();
        Ok(true)
    }

    fn jacobian(&mut self, x: &[f64], matrix: &mut Matrix) -> Result<()> {
        matrix.update(&self.scalars(&self.tangent(x)).2)
    }

    fn before_solve(&mut self, _: &mut [f64]) -> Result<()> {
        Ok(())
    }

    fn assess(&mut self, _: usize, _: &[f64], _: &[f64]) -> Result<Verdict> {
        Ok(if self.residual < 1e-12 { Verdict::Converged } else { Verdict::Continue })
    }

    fn prepare_solver(&mut self, solver: &Ksp, matrix: &mut Matrix, earlier: usize) -> Result<()> {
        Levels::prepare(self, solver, matrix, earlier)
    }

    fn record_solve(&mut self, iterations: usize, tolerance: f64) {
        self.installed.record_solve(iterations, tolerance);
    }
}

impl<const D: usize> Levelled for Hardening<'_, D> {
    fn flow(&mut self, matrix: &mut Matrix) -> Result<Option<Flow>> {
        let (rows, nodes) = (self.of_matrix(matrix)?, &self.share.nodes);
        let part = symmetric_part(self.world, nodes.owned, &nodes.global, &nodes.halo, &rows)?;
        Ok(Some(Flow::of(self.world, nodes, &rows, &part)))
    }

    fn follow(
        &mut self,
        matrix: &mut Matrix,
        flow: Option<&Flow>,
        smoother: &mut BlockSmoother,
    ) -> Result<()> {
        let rows = self.of_matrix(matrix)?;
        if let Some(flow) = flow {
            *smoother = flow.smoother(self.world, &self.share.nodes, &rows)?;
        }
        Ok(())
    }

    fn levels(&mut self) -> &mut Levels {
        &mut self.installed
    }

    fn hierarchy(&mut self, matrix: &mut Matrix) -> Result<Option<Hierarchy>> {
        if !self.levels {
            return Ok(None);
        }
        self.made[0] += 1;
        let rows = self.of_matrix(matrix)?;
        let (world, nodes) = (self.world, &self.share.nodes);
        match (D, self.symmetric) {
            (2, true) => amg::build::<D, 3>(world, nodes, &rows, &Ties::default()),
            (2, false) => {
                amg::build_unsymmetric::<D, 3>(world, nodes, &rows, &Ties::default(), true)
            }
            (_, true) => amg::build::<D, 6>(world, nodes, &rows, &Ties::default()),
            (_, false) => {
                amg::build_unsymmetric::<D, 6>(world, nodes, &rows, &Ties::default(), true)
            }
        }
    }

    fn fill(
        &mut self,
        matrix: &mut Matrix,
        exact: &mut BlockProduct<f64>,
        finest: &mut BlockProduct<f32>,
    ) -> Result<()> {
        self.made[1] += 1;
        let rows = self.of_matrix(matrix)?;
        amg::fill::<_, D>(&rows, exact);
        exact.round_into(finest);
        Ok(())
    }
}

/// How a solve went: linear iterations, Newton's, hierarchies and renewals, the sum of x^2.
pub struct Solved {
    pub linear: usize,
    pub newton: usize,
    pub made: [usize; 2],
    pub x: Vec<f64>,
    pub square: f64,
}

pub fn solve<const D: usize>(
    world: &World,
    block: Block<D>,
    prefix: &str,
    options: &[(&str, &str)],
    levels: bool,
) -> Result<Solved> {
    solve_as(world, block, prefix, options, levels, !block.flow)
}

/// The same on the path of symmetric or of unsymmetric matrices.
pub fn solve_as<const D: usize>(
    world: &World,
    block: Block<D>,
    prefix: &str,
    options: &[(&str, &str)],
    levels: bool,
    symmetric: bool,
) -> Result<Solved> {
    solve_under(world, block, prefix, options, levels, symmetric, HARDENING)
}

/// The same with another c.
pub fn solve_under<const D: usize>(
    world: &World,
    block: Block<D>,
    prefix: &str,
    options: &[(&str, &str)],
    levels: bool,
    symmetric: bool,
    load: f64,
) -> Result<Solved> {
    let share = block.share(world);
    let mut problem = Hardening {
        world,
        share,
        levels,
        symmetric,
        load,
        made: [0; 2],
        residual: f64::NAN,
        installed: Levels::default(),
    };
    let (offsets, columns, values) = problem.scalars(&problem.share.rows);
    let rows = problem.share.nodes.owned * D;
    let mut matrix = Matrix::from_csr(world.comm(), D, rows, &offsets, &columns, &values).unwrap();
    matrix.set_symmetric(symmetric).unwrap();
    let mut snes = Snes::new(world.comm(), prefix, 30).unwrap();
    snes.set_defaults(&[
        ("ksp_type", if symmetric { "cg" } else { "fgmres" }),
        ("pc_type", "mg"),
        ("snes_lag_preconditioner", "1000"),
    ])
    .unwrap();
    snes.set_defaults(options).unwrap();
    snes.set_from_options().unwrap();
    let mut x = matrix.vector().unwrap();
    let outcome = snes.solve(&mut problem, &mut matrix, &mut x)?;
    assert!(outcome.converged, "{prefix} {outcome:?}");
    let x = x.values().unwrap().to_vec();
    Ok(Solved {
        linear: outcome.linear_iterations_total,
        newton: outcome.iterations,
        made: problem.made,
        square: world.sum(x.iter().map(|x| x * x).sum()),
        x,
    })
}
