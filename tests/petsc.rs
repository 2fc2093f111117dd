//! The PETSc wrappers on one to four ranks, ranks without rows among them.

mod common;

use common::{on_ranks, on_ranks_with};
use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;
use mpm_par::blocks::{Blocks, Half, Stored};
use mpm_par::error::{Error, Result};
use mpm_par::petsc::Index;
use mpm_par::petsc::{self, Ksp, Matrix, NewtonProblem, Session, Snes, Vector, Verdict};

/// This rank's rows of a system of `n` rows in blocks of `block`; rank 1 gets none.
fn share(comm: &SimpleCommunicator, n: usize, block: usize) -> std::ops::Range<usize> {
    let (rank, size) = (comm.rank() as usize, comm.size() as usize);
    let workers = if size > 2 { size - 1 } else { size };
    let place = match (size > 2, rank) {
        (true, 0) => 0,
        (true, 1) => return cut(n, block, workers, 1)..cut(n, block, workers, 1),
        (true, r) => r - 1,
        (false, r) => r,
    };
    cut(n, block, workers, place)..cut(n, block, workers, place + 1)
}

fn cut(n: usize, block: usize, workers: usize, place: usize) -> usize {
    n / block * place / workers * block
}

/// Rows `own` of the tridiagonal matrix (-1, 2 + shift, -1), plus entries in the far corners.
fn tridiagonal(
    own: &std::ops::Range<usize>,
    n: usize,
    shift: f64,
) -> (Vec<Index>, Vec<Index>, Vec<f64>) {
    let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for row in own.clone() {
        let mut entries: Vec<(usize, f64)> = vec![(row, 2.0 + shift)];
        if row > 0 {
            entries.push((row - 1, -1.0));
        }
        if row + 1 < n {
            entries.push((row + 1, -1.0));
        }
        if row == 0 {
            entries.push((n - 1, -0.25));
        }
        if row == n - 1 {
            entries.push((0, -0.25));
        }
        entries.sort_by_key(|e| e.0);
        columns.extend(entries.iter().map(|e| e.0 as Index));
        values.extend(entries.iter().map(|e| e.1));
        offsets.push(columns.len() as Index);
    }
    (offsets, columns, values)
}

fn product(row: usize, n: usize, shift: f64, x: impl Fn(usize) -> f64) -> f64 {
    let (_, columns, values) = tridiagonal(&(row..row + 1), n, shift);
    columns.iter().zip(&values).map(|(&c, v)| v * x(c as usize)).sum()
}

#[test]
fn vectors_hold_and_reduce_values() {
    on_ranks("vectors_hold_and_reduce_values", &[1, 2, 4], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = universe.world();
        let own = share(&world, 12, 2);
        let mut v = Vector::new(&world, own.len(), 2).unwrap();
        assert_eq!(v.first_row().unwrap(), own.start);
        for (value, row) in v.values_mut().unwrap().iter_mut().zip(own.clone()) {
            *value = row as f64;
        }
        let mut w = v.duplicate().unwrap();
        assert_eq!(w.norm().unwrap(), 0.0);
        w.set(2.0).unwrap();
        assert_eq!(v.dot(&w).unwrap(), 2.0 * 66.0);
        assert_eq!(v.norm_max().unwrap(), 11.0);
        w.copy_from(&v).unwrap();
        w.axpy(-1.0, &v).unwrap();
        assert_eq!(w.norm().unwrap(), 0.0);
        assert_eq!(v.values().unwrap().len(), own.len());
    });
}

#[test]
fn matrix_multiplies_updates_and_refuses() {
    on_ranks("matrix_multiplies_updates_and_refuses", &[1, 2, 3, 4], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = universe.world();
        let n = 20;
        let own = share(&world, n, 2);
        let (offsets, columns, values) = tridiagonal(&own, n, 0.0);
        let mut a = Matrix::from_csr(&world, 2, own.len(), &offsets, &columns, &values).unwrap();
        a.set_symmetric(true).unwrap();
        let mut x = a.vector().unwrap();
        let mut y = x.duplicate().unwrap();
        for (value, row) in x.values_mut().unwrap().iter_mut().zip(own.clone()) {
            *value = (row * row) as f64;
        }
        for shift in [0.0, 1.5, -3.0] {
            let (_, _, values) = tridiagonal(&own, n, shift);
            a.update(&values).unwrap();
            a.mult(&x, &mut y).unwrap();
            for (y, row) in y.values().unwrap().iter().zip(own.clone()) {
                let expected = product(row, n, shift, |c| (c * c) as f64);
                assert!((y - expected).abs() < 1e-12, "row {row}: {y} for {expected}");
            }
        }
        assert!(a.update(&[0.0]).is_err());

        // One rank's bad column is every rank's error, with that rank's text.
        let mut bad = columns.clone();
        if own.contains(&0) {
            bad.swap(0, 1);
        }
        let error = Matrix::from_csr(&world, 2, own.len(), &offsets, &bad, &values).unwrap_err();
        assert!(error.to_string().contains("row 0"), "{error}");
        assert!(matches!(error, Error::Environment(_)));
    });
}

#[test]
fn linear_solver_follows_the_matrix() {
    on_ranks("linear_solver_follows_the_matrix", &[1, 2, 3, 4], |universe| {
        let table = [("a_ksp_rtol".to_string(), "1e-12".to_string())];
        let session = Session::start(universe, &table, &[]).unwrap();
        let world = universe.world();
        let size = world.size().to_string();
        let methods: [&[(&str, &str)]; 4] = [
            &[("ksp_type", "cg"), ("pc_type", "jacobi"), ("ksp_rtol", "1")],
            &[("ksp_type", "preonly"), ("pc_type", "lu"), ("pc_factor_mat_solver_type", "mumps")],
            &[("ksp_type", "cg"), ("pc_type", "gamg")],
            &[
                ("ksp_type", "preonly"),
                ("pc_type", "telescope"),
                ("pc_telescope_reduction_factor", &size),
                ("telescope_ksp_type", "preonly"),
                ("telescope_pc_type", "lu"),
                ("telescope_pc_factor_mat_solver_type", "mumps"),
            ],
        ];
        for (method, options) in methods.iter().enumerate() {
            let mut ksp = Ksp::new(&world, "a_").unwrap();
            ksp.set_defaults(options).unwrap();
            ksp.set_from_options().unwrap();
            // Sizes differ: the solver must forget the matrix before.
            for n in [24, 60] {
                let own = share(&world, n, 1);
                let (offsets, columns, values) = tridiagonal(&own, n, 0.5);
                let mut a =
                    Matrix::from_csr(&world, 1, own.len(), &offsets, &columns, &values).unwrap();
                a.set_spd(true).unwrap();
                let mut b = a.vector().unwrap();
                let mut x = a.vector().unwrap();
                for shift in [0.5, 2.0] {
                    let (_, _, values) = tridiagonal(&own, n, shift);
                    a.update(&values).unwrap();
                    for (b, row) in b.values_mut().unwrap().iter_mut().zip(own.clone()) {
                        *b = product(row, n, shift, |c| 1.0 + c as f64);
                    }
                    ksp.set_operators(&a).unwrap();
                    let outcome = ksp.solve(&b, &mut x).unwrap().require("a test").unwrap();
                    assert_eq!(outcome.iterations == 1, method % 2 == 1, "{outcome:?}");
                    for (x, row) in x.values().unwrap().iter().zip(own.clone()) {
                        assert!((x - 1.0 - row as f64).abs() < 1e-8, "{method}: {row}: {x}");
                    }
                }
            }
        }
        assert!(session.unused_options().unwrap().is_empty());

        // A singular matrix is an outcome with a readable reason.
        let own = share(&world, 6, 1);
        let offsets: Vec<Index> = (0..=own.len() as Index).collect();
        let columns: Vec<Index> = own.clone().map(|r| r as Index).collect();
        let values: Vec<f64> = own.clone().map(|r| if r == 3 { 0.0 } else { 1.0 }).collect();
        let a = Matrix::from_csr(&world, 1, own.len(), &offsets, &columns, &values).unwrap();
        let mut ksp = Ksp::new(&world, "s_").unwrap();
        let mumps = ("pc_factor_mat_solver_type", "mumps");
        ksp.set_defaults(&[("ksp_type", "preonly"), ("pc_type", "lu"), mumps]).unwrap();
        ksp.set_from_options().unwrap();
        ksp.set_operators(&a).unwrap();
        let (b, mut x) = (a.vector().unwrap(), a.vector().unwrap());
        let outcome = ksp.solve(&b, &mut x).unwrap();
        assert!(!outcome.converged && outcome.reason.contains("pivot"), "{outcome:?}");
        assert!(matches!(outcome.require("the test"), Err(Error::Run(_))));
    });
}

/// x_i^3 + (T x)_i = that of x_i = 1 + i/n; row 0 is prescribed through an identity row.
struct Cubic<'a> {
    comm: &'a SimpleCommunicator,
    own: std::ops::Range<usize>,
    n: usize,
    fail_in: &'static str,
    log: Vec<String>,
}

impl Cubic<'_> {
    fn exact(&self, row: usize) -> f64 {
        1.0 + row as f64 / self.n as f64
    }

    fn fail<T>(&self, place: &str, value: T) -> Result<T> {
        if self.fail_in == place && self.comm.rank() == self.comm.size() - 1 {
            return Err(Error::Run(format!("{place} failed on the last rank")));
        }
        Ok(value)
    }
}

/// The diagonal part only couples through neighbours' values of the exact solution: rows are
/// independent but for the matrix, which is what the tests are about.
impl NewtonProblem for Cubic<'_> {
    fn residual(&mut self, x: &[f64], f: &mut [f64], _: &mut Matrix) -> Result<bool> {
        for (k, row) in self.own.clone().enumerate() {
            f[k] = if row == 0 { 0.0 } else { x[k].powi(3) - self.exact(row).powi(3) };
        }
        if self.fail_in == "domain" && self.comm.rank() == self.comm.size() - 1 {
            return Ok(self.log.is_empty());
        }
        self.fail("residual", true)
    }

    fn jacobian(&mut self, x: &[f64], matrix: &mut Matrix) -> Result<()> {
        let values: Vec<f64> = self
            .own
            .clone()
            .enumerate()
            .map(|(k, row)| if row == 0 { 1.0 } else { 3.0 * x[k] * x[k] })
            .collect();
        matrix.update(&values)?;
        self.fail("jacobian", ())
    }

    fn before_solve(&mut self, rhs: &mut [f64]) -> Result<()> {
        // The prescribed row starts at 3 and has to reach its value in the first step.
        if self.own.contains(&0) && self.log.len() == 1 {
            rhs[0] = 3.0 - self.exact(0);
        }
        self.fail("before_solve", ())
    }

    fn assess(&mut self, iteration: usize, _x: &[f64], f: &[f64]) -> Result<Verdict> {
        let largest = f.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        self.log.push(format!("{iteration}"));
        self.fail("assess", ())?;
        if self.fail_in == "verdict" && self.comm.rank() == 0 && iteration == 2 {
            return Ok(Verdict::Diverged("the test gave up".into()));
        }
        Ok(if largest < 1e-10 { Verdict::Converged } else { Verdict::Continue })
    }
}

#[test]
fn newton_solves_and_stops_together() {
    on_ranks("newton_solves_and_stops_together", &[1, 2, 3, 4], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = universe.world();
        let mut snes = Snes::new(&world, "qs_", 20).unwrap();
        snes.set_defaults(&[("ksp_type", "gmres"), ("pc_type", "jacobi")]).unwrap();
        snes.set_from_options().unwrap();
        assert_eq!(snes.ksp().describe().unwrap(), "gmres + jacobi");

        let mut run = |n: usize, fail_in: &'static str, start: f64| {
            let own = share(&world, n, 1);
            let offsets: Vec<Index> = (0..=own.len() as Index).collect();
            let columns: Vec<Index> = own.clone().map(|r| r as Index).collect();
            let ones = vec![1.0; own.len()];
            let mut a = Matrix::from_csr(&world, 1, own.len(), &offsets, &columns, &ones).unwrap();
            let mut x = a.vector().unwrap();
            x.set(start).unwrap();
            let mut problem = Cubic { comm: &world, own: own.clone(), n, fail_in, log: vec![] };
            let outcome = snes.solve(&mut problem, &mut a, &mut x);
            let error = own
                .clone()
                .zip(x.values().unwrap().iter())
                .fold(0.0, |m: f64, (r, v)| m.max((v - problem.exact(r)).abs()));
            (outcome, error, problem.log)
        };

        // Three sizes with one solver, and errors in between that must leave it usable.
        for (n, place) in [(8, "residual"), (30, "jacobian"), (12, "before_solve"), (9, "assess")] {
            let (outcome, error, log) = run(n, "", 3.0);
            let outcome = outcome.unwrap();
            assert!(outcome.converged && outcome.reason == "converged", "{outcome:?}");
            assert!(error < 1e-10, "{error}");
            assert_eq!(log.len(), outcome.iterations + 1);
            assert_eq!(outcome.linear_iterations_total, outcome.iterations);
            assert_eq!(outcome.linear_iterations_max, 1);
            let (outcome, _, _) = run(n, place, 3.0);
            let text = outcome.unwrap_err().to_string();
            assert_eq!(text, format!("{place} failed on the last rank"));
        }

        let outcome = run(8, "verdict", 3.0).0.unwrap();
        assert!(!outcome.converged && outcome.iterations == 2, "{outcome:?}");
        if world.rank() == 0 {
            assert_eq!(outcome.reason, "the test gave up");
        }
        let outcome = run(8, "domain", 3.0).0.unwrap();
        assert!(!outcome.converged && outcome.reason.contains("DOMAIN"), "{outcome:?}");
        let (outcome, _, log) = run(8, "", 3.0);
        assert!(outcome.unwrap().converged && log.len() > 3);
        snes.set_max_solves(2).unwrap();
    });
}

/// x_i^3 + (T x)_i = n of the tridiagonal T: rows are coupled, and conjugate gradients need many
/// iterations.
struct Chain<'a> {
    comm: &'a SimpleCommunicator,
    own: std::ops::Range<usize>,
    n: usize,
    product: (Matrix, Vector, Vector),
    /// |b| of each linear solve, and the errors of the iterates.
    norms: Vec<f64>,
    errors: Vec<f64>,
}

/// Largest residual that is enough.
const ENOUGH: f64 = 1e-9;

impl NewtonProblem for Chain<'_> {
    fn residual(&mut self, x: &[f64], f: &mut [f64], _: &mut Matrix) -> Result<bool> {
        let (matrix, place, product) = &mut self.product;
        place.values_mut()?.copy_from_slice(x);
        matrix.mult(place, product)?;
        for ((f, x), t) in f.iter_mut().zip(x).zip(product.values()?.iter()) {
            *f = x.powi(3) + t - self.n as f64;
        }
        Ok(true)
    }

    fn jacobian(&mut self, x: &[f64], matrix: &mut Matrix) -> Result<()> {
        let mut values = Vec::new();
        for (row, x) in self.own.clone().zip(x) {
            values.extend(tridiagonal(&(row..row + 1), self.n, 3.0 * x * x).2);
        }
        matrix.update(&values)
    }

    fn before_solve(&mut self, rhs: &mut [f64]) -> Result<()> {
        self.norms.push(norm(self.comm, rhs));
        Ok(())
    }

    fn assess(&mut self, _iteration: usize, _x: &[f64], f: &[f64]) -> Result<Verdict> {
        let error = norm(self.comm, f);
        self.errors.push(error);
        Ok(if error < ENOUGH { Verdict::Converged } else { Verdict::Continue })
    }

    fn error_over_tolerance(&self) -> f64 {
        self.errors.last().unwrap() / ENOUGH
    }
}

fn norm(comm: &SimpleCommunicator, values: &[f64]) -> f64 {
    let mut vector = Vector::new(comm, values.len(), 1).unwrap();
    vector.values_mut().unwrap().copy_from_slice(values);
    vector.norm().unwrap()
}

#[test]
fn linear_tolerances_follow_the_nonlinear_residual() {
    const NAME: &str = "linear_tolerances_follow_the_nonlinear_residual";
    on_ranks(NAME, &[1, 2, 4], |universe| {
        // What a user would give, each under a prefix of its own.
        let table = [
            ("b_ksp_rtol", "1e-10"),
            ("c_snes_ksp_ew_gamma", "0.5"),
            ("c_snes_ksp_ew_alpha", "1.5"),
            ("c_snes_ksp_ew_rtol0", "0.2"),
            ("c_snes_ksp_ew_rtolmax", "0.4"),
            ("c_snes_ksp_ew_threshold", "0.05"),
            ("d_snes_ksp_ew", "false"),
            ("e_ksp_rtol", "1e-6"),
            ("e_snes_ksp_ew", "true"),
            ("f_snes_ksp_ew_version", "3"),
            ("g_pc_type", "lu"),
            ("g_ksp_type", "preonly"),
        ]
        .map(|(name, value)| (name.to_string(), value.to_string()));
        let session = Session::start(universe, &table, &[]).unwrap();
        let world = universe.world();
        let n = 200;
        let own = share(&world, n, 1);
        let (offsets, columns, values) = tridiagonal(&own, n, 0.0);
        let new = || Matrix::from_csr(&world, 1, own.len(), &offsets, &columns, &values).unwrap();
        let solver = |prefix: &str| -> Result<Snes> {
            let mut snes = Snes::new(&world, prefix, 30)?;
            let package = if world.size() > 1 { "mumps" } else { "petsc" };
            snes.set_defaults(&[
                ("ksp_type", "cg"),
                ("ksp_rtol", "1e-10"),
                ("ksp_max_it", "1000"),
                ("pc_type", "jacobi"),
                ("pc_factor_mat_solver_type", package),
            ])?;
            snes.set_from_options()?;
            Ok(snes)
        };
        let solve = |prefix: &str| {
            let mut snes = solver(prefix).unwrap();
            let linear = new();
            let product = (linear.vector().unwrap(), linear.vector().unwrap());
            let product = (linear, product.0, product.1);
            let (norms, errors) = (vec![], vec![]);
            let own = own.clone();
            let mut problem = Chain { comm: &world, own, n, product, norms, errors };
            let mut a = new();
            a.set_symmetric(true).unwrap();
            let mut x = a.vector().unwrap();
            x.set(60.0).unwrap();
            let outcome = snes.solve(&mut problem, &mut a, &mut x).unwrap();
            assert!(outcome.converged && outcome.linear_tolerances.len() == outcome.iterations);
            (outcome, problem.norms, problem.errors, x)
        };
        let follows =
            |prefix: &str, smallest: f64, [first, largest, gamma, alpha, kept]: [f64; 5]| {
                let (outcome, norms, errors, x) = solve(prefix);
                let mut before = None;
                for (k, &eta) in outcome.linear_tolerances.iter().enumerate() {
                    let expected = match before {
                        None => first,
                        Some(eta) => {
                            let rule = gamma * (norms[k] / norms[k - 1]).powf(alpha);
                            let old: f64 = gamma * f64::powf(eta, alpha);
                            let rule = if old > kept { rule.max(old) } else { rule };
                            rule.max(1e-2 * ENOUGH / errors[k]).min(largest).max(smallest)
                        }
                    };
                    assert!((eta / expected - 1.0).abs() < 1e-10, "{prefix} {k}: {eta} {expected}");
                    before = Some(eta);
                }
                (outcome, x)
            };
        let (fixed, _, _, exact) = solve("b_");
        assert!(fixed.linear_tolerances.iter().all(|&eta| eta == 1e-10));
        let defaults = [1e-3, 1e-3, 1e-2, 2.0, 0.1];
        let (forced, mut x) = follows("a_", 1e-10, defaults);
        assert_eq!(forced.iterations, fixed.iterations);
        let (few, many) = (forced.linear_iterations_total, fixed.linear_iterations_total);
        assert!(2 * few < many, "{few} iterations instead of {many}");
        assert!(forced.linear_tolerances.iter().any(|&eta| eta < 1e-4));
        x.axpy(-1.0, &exact).unwrap();
        assert!(x.norm_max().unwrap() < ENOUGH);
        let (own_rule, mut x) = follows("c_", 1e-10, [0.2, 0.4, 0.5, 1.5, 0.05]);
        assert!(own_rule.linear_iterations_total < few);
        x.axpy(-1.0, &exact).unwrap();
        assert!(x.norm_max().unwrap() < ENOUGH);
        follows("e_", 1e-6, defaults);
        for prefix in ["d_", "g_"] {
            let all = solve(prefix).0.linear_tolerances;
            assert!(all.iter().all(|&eta| eta == all[0]), "{prefix}: {all:?}");
        }
        let refused = solver("f_").map(|_| ()).unwrap_err();
        assert!(matches!(refused, Error::Input(_)), "{refused}");
        assert!(refused.to_string().contains("-f_snes_ksp_ew_version 3"), "{refused}");
        assert!(session.unused_options().unwrap().is_empty());
    });
}

/// Rows `own` of a grid of `n` x `n` nodes with `block` unknowns each: coupled to the nodes around,
/// `shift` per row of `own` more on the diagonal.
fn membrane(
    own: &std::ops::Range<usize>,
    n: usize,
    block: usize,
    shift: impl Fn(usize) -> f64,
) -> (Vec<Index>, Vec<Index>, Vec<f64>) {
    let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for row in own.clone() {
        let (node, axis) = (row / block, row % block);
        let (i, j) = (node % n, node / n);
        for b in j.saturating_sub(1)..=(j + 1).min(n - 1) {
            for a in i.saturating_sub(1)..=(i + 1).min(n - 1) {
                let other = b * n + a;
                for other_axis in 0..block {
                    let coupling = if axis == other_axis { 1.0 } else { 0.1 };
                    let own_share = if other == node { 8.3 } else { -1.0 };
                    let more = if other * block + other_axis == row { shift(row) } else { 0.0 };
                    columns.push((other * block + other_axis) as Index);
                    values.push(coupling * own_share + more);
                }
            }
        }
        offsets.push(columns.len() as Index);
    }
    (offsets, columns, values)
}

/// Block row `row` of compressed rows in blocks of `R` x `C`.
fn block_row<const R: usize, const C: usize>(
    row: usize,
    (offsets, columns, values): (&[Index], &[Index], &[f64]),
) -> Vec<(usize, [[f64; C]; R])> {
    let start = |r: usize| offsets[row * R + r] as usize;
    let count = (offsets[row * R + 1] as usize - start(0)) / C;
    (0..count)
        .map(|k| {
            let value = |r: usize, c: usize| values[start(r) + k * C + c];
            let block = std::array::from_fn(|r| std::array::from_fn(|c| value(r, c)));
            (columns[start(0) + k * C] as usize / C, block)
        })
        .collect()
}

fn blocks<T: Stored, const R: usize, const C: usize>(
    rows: (&[Index], &[Index], &[f64]),
) -> Blocks<T> {
    let mut growing = Blocks::growing([R, C], 0).unwrap();
    (0..(rows.0.len() - 1) / R).for_each(|row| growing.push(&block_row::<R, C>(row, rows)));
    growing.finish()
}

fn half<T: Stored, const K: usize>(rows: (&[Index], &[Index], &[f64])) -> Half<T> {
    let mut half = Half::growing(K, 0).unwrap();
    // Twice: what was there before leaves no trace.
    for _ in 0..2 {
        half.clear();
        (0..(rows.0.len() - 1) / K).for_each(|row| half.push(&block_row::<K, K>(row, rows)));
    }
    half
}

/// The value as `T` keeps it.
fn kept<T: Stored>(value: f64) -> f64 {
    T::rounded(value).into()
}

#[test]
fn blocks_multiply_like_the_rows_they_come_from() {
    blocks_multiply::<f32, 2>();
    blocks_multiply::<f32, 3>();
    blocks_multiply::<f32, 4>();
    blocks_multiply::<f32, 6>();
    blocks_multiply::<f64, 2>();
    blocks_multiply::<f64, 3>();
    blocks_multiply::<f64, 4>();
    assert!(Blocks::<f32>::growing([1, 1], 0).is_none());
    assert!(Half::<f32>::growing(5, 0).is_none());
}

fn blocks_multiply<T: Stored, const K: usize>() {
    let n = 13;
    let rows = n * n * K;
    let (offsets, columns, mut values) = membrane(&(0..rows), n, K, |_| 0.0);
    for (k, value) in values.iter_mut().enumerate() {
        *value *= 1.0 + (k as f64 * 0.7).sin() / 3.0;
    }
    let whole = blocks::<T, K, K>((&offsets, &columns, &values));
    let x: Vec<f64> = (0..rows).map(|k| (k as f64 * 1.3).cos()).collect();
    let (mut fast, mut plain, mut sum) = (vec![f64::NAN; rows], vec![7.0; rows], x.clone());
    whole.multiply(&x, &mut fast);
    whole.multiply_plain(&x, &mut plain);
    whole.multiply_add(&x, &mut sum);
    for r in 0..rows {
        let row = offsets[r] as usize..offsets[r + 1] as usize;
        let terms = row.map(|k| kept::<T>(values[k]) * x[columns[k] as usize]);
        let (exact, size) = terms.fold((0.0, 0.0), |(s, t), v: f64| (s + v, t + v.abs()));
        let tolerance = 1e-15 * size;
        assert!((fast[r] - exact).abs() < tolerance, "{K}, {r}: {} {exact}", fast[r]);
        assert!((plain[r] - exact).abs() < tolerance, "{K}, {r}: {} {exact}", plain[r]);
        assert!((sum[r] - x[r] - exact).abs() < tolerance + 1e-15, "{K}, {r}");
    }
    // Rows without entries, at the end too.
    let empty: Vec<Index> = std::iter::repeat_n(0, 2 * K)
        .chain(offsets.iter().copied())
        .chain(std::iter::repeat_n(offsets[rows], K))
        .collect();
    let with_empty = blocks::<T, K, K>((&empty, &columns, &values));
    let mut shifted = vec![f64::NAN; rows + 3 * K];
    with_empty.multiply(&x, &mut shifted);
    assert_eq!(shifted[2 * K..2 * K + rows], fast);
    assert!(shifted[..2 * K].iter().chain(&shifted[2 * K + rows..]).all(|&v| v == 0.0));
}

#[test]
fn oblong_blocks_multiply_both_ways() {
    // 5 block rows of 2 on 4 block columns of 3; the fourth row is empty.
    let pattern: [&[usize]; 5] = [&[0, 2], &[1], &[0, 1, 2, 3], &[], &[3]];
    let (mut offsets, mut columns) = (vec![0], Vec::new());
    for row in pattern {
        for _ in 0..2 {
            columns
                .extend(row.iter().flat_map(|&block| (0..3).map(move |c| 3 * block as Index + c)));
            offsets.push(columns.len() as Index);
        }
    }
    let values: Vec<f64> = (0..columns.len()).map(|k| (k as f64 * 0.9).sin()).collect();
    let single = |k: usize| f64::from(values[k] as f32);
    let blocks = blocks::<f32, 2, 3>((&offsets, &columns, &values));
    let (down, up): (Vec<f64>, Vec<f64>) =
        ((0..12).map(|k| (k as f64).cos()).collect(), (0..10).map(|k| (k as f64).sin()).collect());
    let (mut y, mut z) = (vec![0.0; 10], vec![0.0; 12]);
    for r in 0..10 {
        for k in offsets[r] as usize..offsets[r + 1] as usize {
            y[r] += single(k) * down[columns[k] as usize];
            z[columns[k] as usize] += single(k) * up[r];
        }
    }
    let close = |a: &[f64], b: &[f64]| {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14), "{a:?} {b:?}");
    };
    let (mut product, mut transposed) = (vec![f64::NAN; 10], vec![f64::NAN; 12]);
    blocks.multiply(&down, &mut product);
    close(&product, &y);
    blocks.multiply_plain(&down, &mut product);
    close(&product, &y);
    blocks.multiply_transposed(&up, &mut transposed);
    close(&transposed, &z);
}

/// Compressed rows of a symmetric pattern of blocks: `pairs` of block rows, mirrored.
fn mirrored(block: usize, rows: usize, pairs: &[(usize, usize)]) -> (Vec<Index>, Vec<Index>) {
    let (mut offsets, mut columns) = (vec![0], Vec::new());
    for row in 0..rows {
        let other = |&(i, j): &(usize, usize)| {
            if i == row { Some(j) } else { (j == row).then_some(i) }
        };
        let blocks: std::collections::BTreeSet<usize> = pairs.iter().filter_map(other).collect();
        for _ in 0..block {
            columns.extend(
                blocks.iter().flat_map(|&j| (block * j..block * (j + 1)).map(|c| c as Index)),
            );
            offsets.push(columns.len() as Index);
        }
    }
    (offsets, columns)
}

/// Values of the mirrored entries that differ by rounding, as sums in another order do.
fn nearly_symmetric(offsets: &[Index], columns: &[Index]) -> Vec<f64> {
    let mut values = Vec::new();
    for (row, range) in offsets.windows(2).enumerate() {
        for &column in &columns[range[0] as usize..range[1] as usize] {
            let (low, high) = (row.min(column as usize), row.max(column as usize));
            let noise = if low == row { 1.0 + 1e-14 } else { 1.0 };
            values.push(noise * (1.7 * low as f64 + 0.3 * (high * high) as f64).sin());
        }
    }
    values
}

/// A x with the values as `T`, of each mirrored pair the lower; and sum |A x|.
fn lower_product<T: Stored>(
    offsets: &[Index],
    columns: &[Index],
    values: &[f64],
    x: &[f64],
) -> Vec<(f64, f64)> {
    let mut sums = vec![(0.0, 0.0); x.len()];
    let mut add = |row: usize, term: f64| {
        sums[row].0 += term;
        sums[row].1 += term.abs();
    };
    for (row, range) in offsets.windows(2).enumerate() {
        for k in range[0] as usize..range[1] as usize {
            let (column, value) = (columns[k] as usize, kept::<T>(values[k]));
            if column <= row {
                add(row, value * x[column]);
            }
            if column < row {
                add(column, value * x[row]);
            }
        }
    }
    sums
}

#[test]
fn half_of_a_symmetric_matrix_multiplies_like_the_whole() {
    // Lattices of neighbours, arrow, rows without entries, without a diagonal block, none at all.
    let line = |n: usize, reach: usize| -> Vec<(usize, usize)> {
        (0..n).flat_map(|i| (i..n.min(i + reach + 1)).map(move |j| (i, j))).collect()
    };
    let mut state = 7u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % below
    };
    let mut patterns = vec![
        (40, line(40, 3)),
        (9, (0..9).map(|i| (i, 8)).chain((0..9).map(|i| (i, i))).collect()),
        (6, vec![(1, 1), (4, 1), (4, 4)]),
        (5, vec![(0, 3), (3, 4)]),
        (1, vec![(0, 0)]),
        (3, Vec::new()),
        (0, Vec::new()),
    ];
    for _ in 0..40 {
        let rows = 1 + random(30);
        let count = random(4 * rows);
        patterns.push((rows, (0..count).map(|_| (random(rows), random(rows))).collect()));
    }
    for (rows, pairs) in &patterns {
        half_multiplies::<f32, 2>(*rows, pairs);
        half_multiplies::<f32, 3>(*rows, pairs);
        half_multiplies::<f32, 4>(*rows, pairs);
        half_multiplies::<f32, 6>(*rows, pairs);
        half_multiplies::<f64, 2>(*rows, pairs);
        half_multiplies::<f64, 3>(*rows, pairs);
    }
    stays_symmetric::<2>(&line(40, 5));
    stays_symmetric::<3>(&line(40, 5));
}

fn half_multiplies<T: Stored, const K: usize>(rows: usize, pairs: &[(usize, usize)]) {
    let (offsets, columns) = mirrored(K, rows, pairs);
    let values = nearly_symmetric(&offsets, &columns);
    let half = half::<T, K>((&offsets, &columns, &values));
    let n = K * rows;
    let x: Vec<f64> = (0..n).map(|k| (k as f64 * 1.3).cos()).collect();
    let (mut fast, mut plain, mut sum) = (vec![f64::NAN; n], vec![f64::NAN; n], x.clone());
    half.multiply(&x, &mut fast);
    half.multiply_plain(&x, &mut plain);
    half.multiply_add(&x, &mut sum);
    let exact = lower_product::<T>(&offsets, &columns, &values, &x);
    for (r, (exact, size)) in exact.into_iter().enumerate() {
        let tolerance = 1e-15 * (size + 1e-3);
        assert!((fast[r] - exact).abs() < tolerance, "{K}, {r}: {} {exact}", fast[r]);
        assert!((plain[r] - exact).abs() < tolerance, "{K}, {r}: {} {exact}", plain[r]);
        assert!((sum[r] - x[r] - exact).abs() < tolerance + 1e-15, "{K}, {r}");
    }
    // The whole, where mirrored values may round apart.
    let mut whole = vec![0.0; n];
    blocks::<T, K, K>((&offsets, &columns, &values)).multiply(&x, &mut whole);
    assert!(whole.iter().zip(&fast).all(|(a, b)| (a - b).abs() < 2e-5), "{rows} {pairs:?}");
}

/// x^T A y = y^T A x to the rounding of the sums, whatever was given above the diagonal.
fn stays_symmetric<const K: usize>(pairs: &[(usize, usize)]) {
    let (offsets, columns) = mirrored(K, 40, pairs);
    let values: Vec<f64> = (0..columns.len()).map(|k| (k as f64 * 0.7).sin()).collect();
    let half = half::<f32, K>((&offsets, &columns, &values));
    let n = 40 * K;
    let x: Vec<f64> = (0..n).map(|k| (k as f64 * 1.3).cos()).collect();
    let y: Vec<f64> = (0..n).map(|k| (k as f64 * 0.4).sin()).collect();
    let (mut ax, mut ay) = (vec![0.0; n], vec![0.0; n]);
    half.multiply(&x, &mut ax);
    half.multiply(&y, &mut ay);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    assert!((dot(&y, &ax) - dot(&x, &ay)).abs() < 1e-12);
}

#[test]
fn later_options_win() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join(".petscrc"),
        "-t_a rc\n-t_b rc\n-t_c rc\n-t_d rc\n-t_unread 1\n",
    )
    .unwrap();
    let home = folder.path().to_str().unwrap();
    let env = [("HOME", home), ("PETSC_OPTIONS", "-t_c env -t_d env -qs_nonsense 3")];
    on_ranks_with("later_options_win", &[1, 2], &env, |universe| {
        let table = [
            ("t_b".to_string(), "table".to_string()),
            ("t_c".to_string(), "table".to_string()),
            ("t_d".to_string(), "table".to_string()),
            ("log_view".to_string(), format!(":{}/log.txt", std::env::var("HOME").unwrap())),
        ];
        let words = ["-t_d", "words", "-t_flag"].map(String::from);
        let session = Session::start(universe, &table, &words).unwrap();
        for (name, expected) in
            [("t_a", "rc"), ("t_b", "table"), ("t_c", "env"), ("t_d", "words"), ("t_e", "built-in")]
        {
            session.set_default_option(name, "built-in").unwrap();
            assert_eq!(petsc::options::get(name).unwrap().as_deref(), Some(expected));
        }
        assert_eq!(petsc::options::get("t_flag").unwrap().as_deref(), Some(""));
        assert_eq!(petsc::options::get("t_none").unwrap(), None);
        session.set_default_option("t_quiet", "1").unwrap();
        assert_eq!(session.unused_options().unwrap(), ["-qs_nonsense 3", "-t_unread 1"]);
        let stages = petsc::log::Stages::register().unwrap();
        let outer = stages.enter(petsc::log::Phase::Solve).unwrap();
        drop(stages.enter(petsc::log::Phase::Assemble).unwrap());
        drop(outer);
        drop(session);
        let text = std::fs::read_to_string(format!("{}/log.txt", std::env::var("HOME").unwrap()));
        if universe.world().rank() == 0 {
            let text = text.unwrap();
            assert!(text.contains("assemble:") && text.contains("solve:"), "{text}");
        }
        assert!(Vector::new(&universe.world(), 1, 1).is_err());
    });
}

#[test]
fn a_panic_on_one_rank_ends_all() {
    const NAME: &str = "a_panic_on_one_rank_ends_all";
    let program = std::env::current_exe().unwrap();
    if std::env::var("PANIC_HERE").is_ok() {
        let universe = mpi::initialize().unwrap();
        let _session = Session::start(&universe, &[], &[]).unwrap();
        assert!(universe.world().rank() != 1, "on purpose");
        let v = Vector::new(&universe.world(), 1, 1).unwrap();
        v.norm().unwrap();
        return;
    }
    let command = [program.to_str().unwrap(), "--exact", NAME, "--nocapture"];
    let output = common::mpirun(2, &command, &[("PANIC_HERE", "1")]);
    assert_eq!(output.status.code(), Some(101));
}
