//! Multigrid's levels: what they must keep, a second route to their numbers, and that they are the
//! same on any number of ranks.

mod common;

use common::on_ranks;
use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;
use mpm_par::amg;
use mpm_par::amg::level::{BlockRows, Nodes};
use mpm_par::error::Result;
use mpm_par::parallel::{HaloPlan, World};
use mpm_par::petsc::{
    BlockProduct, CoarsestRows, Hierarchy, Matrix, NewtonProblem, Session, Snes, Verdict,
};
use nalgebra::{DMatrix, SymmetricEigen};

/// A block of `cells` bilinear or trilinear elements of side 1, E = 1, nu = 0.3.
#[derive(Clone, Copy)]
struct Block<const D: usize> {
    cells: [usize; D],
    /// All of its nodes with x = 0 are held, or none.
    held: bool,
}

/// This rank's share of its equations.
struct Share<const D: usize> {
    nodes: Nodes,
    rows: BlockRows<D>,
}

impl<const D: usize> Block<D> {
    fn count(&self) -> usize {
        self.cells.iter().map(|n| n + 1).product()
    }

    fn place(&self, mut node: usize) -> [usize; D] {
        self.cells.map(|n| {
            let index = node % (n + 1);
            node /= n + 1;
            index
        })
    }

    /// Nodes around one, itself included, ascending.
    fn around(&self, node: usize) -> Vec<usize> {
        let place = self.place(node);
        let mut nodes = vec![0];
        for axis in (0..D).rev() {
            let range = place[axis].saturating_sub(1)..=(place[axis] + 1).min(self.cells[axis]);
            nodes = nodes
                .iter()
                .flat_map(|&n| range.clone().map(move |k| n * (self.cells[axis] + 1) + k))
                .collect();
        }
        nodes
    }

    /// K_ab of two nodes: the sum over the elements that have both.
    fn stiffness(&self, a: usize, b: usize) -> [[f64; D]; D] {
        let (lambda, mu) = (0.3 / (1.3 * 0.4), 1.0 / 2.6);
        let (p, q) = (self.place(a), self.place(b));
        let mut block = [[0.0; D]; D];
        for cell in 0..1 << D {
            // The element's lower corner, seen from a.
            let corner: [isize; D] =
                std::array::from_fn(|k| p[k] as isize - ((cell >> k) & 1) as isize);
            let inside = |k: usize| (0..self.cells[k] as isize).contains(&corner[k]);
            let local = |place: &[usize; D]| -> Option<[usize; D]> {
                let offset: [isize; D] = std::array::from_fn(|k| place[k] as isize - corner[k]);
                let fits = offset.iter().all(|k| (0..2).contains(k));
                fits.then(|| offset.map(|k| k as usize))
            };
            let (Some(i), Some(j), true) = (local(&p), local(&q), (0..D).all(inside)) else {
                continue;
            };
            for point in 0..1 << D {
                let x: [f64; D] = std::array::from_fn(|k| {
                    0.5 + (((point >> k) & 1) as f64 - 0.5) / 3.0f64.sqrt()
                });
                let (da, db) = (gradient(i, x), gradient(j, x));
                let dot: f64 = (0..D).map(|k| da[k] * db[k]).sum();
                for r in 0..D {
                    for s in 0..D {
                        let term = lambda * da[r] * db[s] + mu * da[s] * db[r];
                        let same = if r == s { mu * dot } else { 0.0 };
                        block[r][s] += (term + same) / f64::from(1u32 << D);
                    }
                }
            }
        }
        if self.held && (p[0] == 0 || q[0] == 0) {
            let one = if a == b { 1.0 } else { 0.0 };
            block =
                std::array::from_fn(|r| std::array::from_fn(|s| if r == s { one } else { 0.0 }));
        }
        block
    }

    /// Nodes in consecutive shares; of more than two ranks the second has none.
    fn share(&self, world: &World) -> Share<D> {
        let workers: Vec<usize> =
            (0..world.size()).filter(|&rank| world.size() < 3 || rank != 1).collect();
        let begin = |rank: usize| {
            let before = workers.iter().filter(|&&worker| worker < rank).count();
            self.count() * before / workers.len()
        };
        let own = begin(world.rank())..begin(world.rank() + 1);
        let owner = |node: usize| {
            *workers.iter().find(|&&rank| node < begin(rank + 1)).expect("a node of the block")
        };
        let mut ghosts: Vec<(usize, usize)> = own
            .clone()
            .flat_map(|node| self.around(node))
            .filter(|node| !own.contains(node))
            .map(|node| (owner(node), node))
            .collect();
        ghosts.sort_unstable();
        ghosts.dedup();
        let global: Vec<i32> =
            own.clone().chain(ghosts.iter().map(|g| g.1)).map(|node| node as i32).collect();
        let local = |node: usize| {
            let ghost = || own.len() + ghosts.partition_point(|g| g.1 < node);
            if own.contains(&node) { node - own.start } else { ghost() }
        };
        let mut rows = BlockRows { offsets: vec![0], columns: Vec::new(), values: Vec::new() };
        for node in own.clone() {
            for other in self.around(node) {
                rows.columns.push(local(other) as u32);
                rows.values.push(self.stiffness(node, other));
            }
            rows.offsets.push(rows.columns.len());
        }
        let halo = HaloPlan::build(world, own.len(), &ghosts, |node| {
            own.contains(&node).then(|| node - own.start)
        });
        let position = |&node: &i32| {
            let place = self.place(node as usize);
            std::array::from_fn(|k| place.get(k).map_or(0.0, |&n| n as f64))
        };
        let key = |&node: &i32| (f64::from(node) * 0.618_033_988_749_895).fract() + 1e-9;
        let nodes = Nodes {
            owned: own.len(),
            position: global.iter().map(position).collect(),
            key: global.iter().map(key).collect(),
            global,
            halo: halo.unwrap(),
        };
        Share { nodes, rows }
    }
}

/// Gradient of the shape function of an element's corner.
fn gradient<const D: usize>(corner: [usize; D], x: [f64; D]) -> [f64; D] {
    let value = |k: usize| if corner[k] == 1 { x[k] } else { 1.0 - x[k] };
    std::array::from_fn(|axis| {
        let sign = if corner[axis] == 1 { 1.0 } else { -1.0 };
        (0..D).filter(|&k| k != axis).map(value).product::<f64>() * sign
    })
}

fn build<const D: usize>(world: &World, share: &Share<D>) -> Hierarchy {
    let made = match D {
        2 => amg::build::<D, 3>(world, &share.nodes, &share.rows),
        _ => amg::build::<D, 6>(world, &share.nodes, &share.rows),
    };
    made.unwrap().expect("the nodes are coupled")
}

fn alone() -> World {
    World::new(SimpleCommunicator::self_comm())
}

fn dense(rows: &CoarsestRows) -> DMatrix<f64> {
    let n = rows.offsets.len() - 1;
    let mut matrix = DMatrix::zeros(n, n);
    for row in 0..n {
        for k in rows.offsets[row] as usize..rows.offsets[row + 1] as usize {
            matrix[(row, rows.columns[k] as usize)] = rows.values[k];
        }
    }
    matrix
}

#[test]
fn rigid_motions_pass_all_levels_without_energy() {
    on_ranks("rigid_motions_pass_all_levels_without_energy", &[1], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = alone();
        let plane = build(&world, &Block { cells: [110, 41], held: false }.share(&world));
        let space = build(&world, &Block { cells: [24, 15, 20], held: false }.share(&world));
        for (modes, hierarchy) in [(3, plane), (6, space)] {
            assert!(hierarchy.levels.len() > 1);
            let matrix = dense(&hierarchy.coarsest);
            assert!((&matrix - matrix.transpose()).amax() < 1e-12 * matrix.amax());
            let mut values: Vec<f64> =
                SymmetricEigen::new(matrix).eigenvalues.iter().copied().collect();
            values.sort_by(f64::total_cmp);
            let largest = values[values.len() - 1];
            // The trace that keeps the last level regular is 1e-9 of the diagonal.
            assert!(values[modes - 1] < 2e-9 * largest, "{:?}", &values[..modes + 2]);
            assert!(
                values[0] > 0.0 && values[modes] > 1e-4 * largest,
                "{:?}",
                &values[..modes + 2]
            );
        }
    });
}

#[test]
fn coarse_operators_are_galerkins() {
    on_ranks("coarse_operators_are_galerkins", &[1], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = alone();
        let plane = build(&world, &Block { cells: [60, 41], held: true }.share(&world));
        let space = build(&world, &Block { cells: [16, 13, 15], held: true }.share(&world));
        for hierarchy in [plane, space] {
            let last = dense(&hierarchy.coarsest);
            let products: Vec<&BlockProduct<f32>> =
                hierarchy.levels.iter().map(|level| &level.product).collect();
            let sizes: Vec<usize> =
                hierarchy.levels.iter().map(|level| level.product.rows()).collect();
            for (k, level) in hierarchy.levels.iter().enumerate() {
                let coarse = *sizes.get(k + 1).unwrap_or(&last.nrows());
                let [x, y] = [0.37, 0.61].map(|step| -> Vec<f64> {
                    (0..coarse).map(|row| (row as f64 * step).sin()).collect()
                });
                // y P^T A P x against y A_c x.
                let fine = |x: &[f64]| {
                    let mut fine = vec![0.0; sizes[k]];
                    level.transfer.multiply_local(x, &mut fine);
                    fine
                };
                let (px, py) = (fine(&x), fine(&y));
                let mut apx = vec![0.0; sizes[k]];
                level.product.multiply_local(&px, &mut apx);
                let mut ax = vec![0.0; coarse];
                match products.get(k + 1) {
                    Some(product) => product.multiply_local(&x, &mut ax),
                    None => {
                        let product = &last * DMatrix::from_column_slice(coarse, 1, &x);
                        ax.copy_from_slice(product.as_slice());
                    }
                }
                let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                let size = dot(&apx, &apx).sqrt() * dot(&py, &py).sqrt();
                let gap = (dot(&py, &apx) - dot(&y, &ax)).abs();
                assert!(gap < 1e-7 * size, "level {k}: {gap:e} of {size:e}");
            }
        }
    });
}

#[test]
fn the_largest_eigenvalue_is_just_underrated() {
    on_ranks("the_largest_eigenvalue_is_just_underrated", &[1], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = alone();
        let share = Block { cells: [21, 12], held: true }.share(&world);
        let n = share.nodes.owned * 2;
        let mut matrix = DMatrix::zeros(n, n);
        for row in 0..share.nodes.owned {
            for k in share.rows.offsets[row]..share.rows.offsets[row + 1] {
                let column = share.rows.columns[k] as usize;
                for (r, line) in share.rows.values[k].iter().enumerate() {
                    for (s, &value) in line.iter().enumerate() {
                        matrix[(2 * row + r, 2 * column + s)] = value;
                    }
                }
            }
        }
        let scale: Vec<f64> = matrix.diagonal().iter().map(|d| 1.0 / d.sqrt()).collect();
        let scaled = DMatrix::from_fn(n, n, |i, j| scale[i] * matrix[(i, j)] * scale[j]);
        let exact = SymmetricEigen::new(scaled).eigenvalues.max();
        let found = build(&world, &share).levels[0].largest;
        assert!((0.93..1.000_001).contains(&(found / exact)), "{found} {exact}");
    });
}

#[test]
fn levels_do_not_depend_on_the_ranks() {
    on_ranks("levels_do_not_depend_on_the_ranks", &[1, 2, 3, 4], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = World::new(universe.world().duplicate());
        same_levels(&world, Block { cells: [57, 34], held: true });
        same_levels(&world, Block { cells: [15, 12, 17], held: true });
    });
}

#[test]
fn coarse_levels_gather_on_fewer_ranks() {
    on_ranks("coarse_levels_gather_on_fewer_ranks", &[1, 2, 3, 4], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = World::new(universe.world().duplicate());
        let block = Block { cells: [150, 101], held: true };
        same_levels(&world, block);
        let hierarchy = build(&world, &block.share(&world));
        let mut rows: Vec<usize> =
            hierarchy.levels.iter().map(|level| level.product.rows()).collect();
        rows.push(hierarchy.coarsest.offsets.len() - 1);
        let nodes: Vec<usize> = rows[1..].iter().map(|&rows| world.sum_usize(rows) / 3).collect();
        let holders: Vec<usize> =
            rows[1..].iter().map(|&rows| world.sum_usize(usize::from(rows > 0))).collect();
        // Of more than two ranks the second has no nodes.
        let workers = if world.size() < 3 { world.size() } else { world.size() - 1 };
        assert!(nodes[0] > 100 * world.size() && nodes[1] < 300 && nodes[2] < 100, "{nodes:?}");
        assert_eq!(holders, [workers, workers.min(2), 1], "{nodes:?}");
    });
}

/// Nodes of each level, largest eigenvalues, trace and norm of the last matrix, against one rank.
fn same_levels<const D: usize>(world: &World, block: Block<D>) {
    let numbers = |world: &World| {
        let hierarchy = build(world, &block.share(world));
        let sizes: Vec<usize> =
            hierarchy.levels.iter().map(|level| world.sum_usize(level.product.rows())).collect();
        let largest: Vec<f64> = hierarchy.levels.iter().map(|level| level.largest).collect();
        let rows = &hierarchy.coarsest;
        let count = rows.offsets.len() - 1;
        let first = world.exclusive_sum(count) as i32;
        let trace: f64 = (0..count)
            .flat_map(|row| {
                let range = rows.offsets[row] as usize..rows.offsets[row + 1] as usize;
                range.filter(move |&k| rows.columns[k] == first + row as i32)
            })
            .map(|k| rows.values[k])
            .sum();
        let norm: f64 = rows.values.iter().map(|v| v * v).sum();
        (sizes, largest, [world.sum(count as f64), world.sum(trace), world.sum(norm)])
    };
    let (many, one) = (numbers(world), numbers(&alone()));
    assert_eq!(many.0, one.0);
    let close = |a: &f64, b: &f64| (a - b).abs() <= 1e-10 * b.abs();
    assert!(many.1.iter().zip(&one.1).all(|(a, b)| close(a, b)), "{many:?} {one:?}");
    assert!(many.2.iter().zip(&one.2).all(|(a, b)| close(a, b)), "{many:?} {one:?}");
}

/// c of [`Hardening`].
const HARDENING: f64 = 1e-3;

/// A x + c x^3 = c with the block's A.
struct Hardening<'a, const D: usize> {
    world: &'a World,
    share: Share<D>,
    levels: bool,
    /// Hierarchies made, and renewals of the finest matrix.
    made: [usize; 2],
    residual: f64,
}

impl<const D: usize> Hardening<'_, D> {
    fn tangent(&self, x: &[f64]) -> BlockRows<D> {
        let BlockRows { offsets, columns, values } = &self.share.rows;
        let mut values = values.clone();
        for row in 0..self.share.nodes.owned {
            for k in offsets[row]..offsets[row + 1] {
                if columns[k] as usize == row {
                    for axis in 0..D {
                        values[k][axis][axis] += 3.0 * HARDENING * x[row * D + axis].powi(2);
                    }
                }
            }
        }
        BlockRows { offsets: offsets.clone(), columns: columns.clone(), values }
    }

    /// Scalar rows of blocks: offsets, global columns, values.
    fn scalars(&self, rows: &BlockRows<D>) -> (Vec<i32>, Vec<i32>, Vec<f64>) {
        let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        for row in 0..self.share.nodes.owned {
            let range = rows.offsets[row]..rows.offsets[row + 1];
            let mut order: Vec<usize> = range.collect();
            let number = |k: usize| self.share.nodes.global[rows.columns[k] as usize];
            order.sort_unstable_by_key(|&k| number(k));
            for r in 0..D {
                for &k in &order {
                    columns.extend((0..D as i32).map(|s| number(k) * D as i32 + s));
                    values.extend_from_slice(&rows.values[k][r]);
                }
                offsets.push(columns.len() as i32);
            }
        }
        (offsets, columns, values)
    }

    fn of_matrix(&self, matrix: &mut Matrix) -> Result<BlockRows<D>> {
        // From the matrix and not from x: what is in it is what counts.
        let BlockRows { offsets, columns, .. } = &self.share.rows;
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
        Ok(BlockRows { offsets: offsets.clone(), columns: columns.clone(), values })
    }
}

impl<const D: usize> NewtonProblem for Hardening<'_, D> {
    fn residual(&mut self, x: &[f64], f: &mut [f64], _: &mut Matrix) -> Result<bool> {
        let mut all = x.to_vec();
        all.resize(self.share.nodes.local() * D, 0.0);
        self.share.nodes.halo.forward(self.world, &mut all, D)?;
        let BlockRows { offsets, columns, values } = &self.share.rows;
        for row in 0..self.share.nodes.owned {
            for r in 0..D {
                let terms = (offsets[row]..offsets[row + 1]).flat_map(|k| {
                    let x = &all[columns[k] as usize * D..];
                    (0..D).map(move |s| values[k][r][s] * x[s])
                });
                f[row * D + r] = terms.sum::<f64>() + HARDENING * (x[row * D + r].powi(3) - 1.0);
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

    fn hierarchy(&mut self, matrix: &mut Matrix) -> Result<Option<Hierarchy>> {
        if !self.levels {
            return Ok(None);
        }
        self.made[0] += 1;
        let rows = self.of_matrix(matrix)?;
        match D {
            2 => amg::build::<D, 3>(self.world, &self.share.nodes, &rows),
            _ => amg::build::<D, 6>(self.world, &self.share.nodes, &rows),
        }
    }

    fn fill(&mut self, matrix: &mut Matrix, exact: &mut BlockProduct<f64>) -> Result<()> {
        self.made[1] += 1;
        amg::fill::<_, D>(&self.of_matrix(matrix)?, exact);
        Ok(())
    }
}

/// How a solve went: linear iterations, Newton's, hierarchies and renewals, the sum of x^2.
struct Solved {
    linear: usize,
    newton: usize,
    made: [usize; 2],
    x: Vec<f64>,
    square: f64,
}

fn solve<const D: usize>(
    world: &World,
    block: Block<D>,
    prefix: &str,
    options: &[(&str, &str)],
    levels: bool,
) -> Result<Solved> {
    let share = block.share(world);
    let mut problem = Hardening { world, share, levels, made: [0; 2], residual: f64::NAN };
    let (offsets, columns, values) = problem.scalars(&problem.share.rows);
    let rows = problem.share.nodes.owned * D;
    let mut matrix = Matrix::from_csr(world.comm(), D, rows, &offsets, &columns, &values).unwrap();
    matrix.set_symmetric(true).unwrap();
    let mut snes = Snes::new(world.comm(), prefix, 30).unwrap();
    snes.set_defaults(&[
        ("ksp_type", "cg"),
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

#[test]
fn smoothers_that_need_entries_are_refused() {
    on_ranks("smoothers_that_need_entries_are_refused", &[1, 2], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = World::new(universe.world().duplicate());
        let block = Block { cells: [12, 9], held: true };
        for kind in ["sor", "eisenstat"] {
            let options = [("mg_levels_pc_type", kind)];
            let refused = solve(&world, block, &format!("{kind}_"), &options, true);
            let text = refused.err().expect("an error").to_string();
            assert!(text.contains("pc_type gamg"), "{text}");
        }
        // The next solver is not harmed.
        solve(&world, block, "next_", &[], true).unwrap();
    });
}

#[test]
fn newton_takes_the_same_iterations_on_any_number_of_ranks() {
    const NAME: &str = "newton_takes_the_same_iterations_on_any_number_of_ranks";
    on_ranks(NAME, &[1, 2, 3, 4], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = World::new(universe.world().duplicate());
        same_iterations(&world, Block { cells: [44, 27], held: true });
        same_iterations(&world, Block { cells: [11, 13, 9], held: true });
    });
}

fn same_iterations<const D: usize>(world: &World, block: Block<D>) {
    let exact = solve(world, block, "lu_", &[("mg_coarse_ksp_rtol", "1e-12")], false).unwrap();
    assert_eq!(exact.made, [0; 2], "one level, solved directly");
    let kept = solve(world, block, "kept_", &[], true).unwrap();
    let one = solve(&alone(), block, "one_", &[], true).unwrap();
    let again = solve(world, block, "again_", &[], true).unwrap();
    let new = solve(world, block, "new_", &[("snes_lag_preconditioner", "1")], true).unwrap();
    assert_eq!(kept.newton, one.newton);
    // A norm may fall to either side of the tolerance by round-off.
    assert!(kept.linear.abs_diff(one.linear) <= 2, "{} {}", kept.linear, one.linear);
    assert_eq!(kept.x, again.x, "the same bits");
    assert_eq!(kept.made[0], 1);
    assert!(kept.made[1] >= kept.newton - 1, "{:?}", kept.made);
    assert_eq!(new.made[0], new.newton);
    assert!(new.linear <= kept.linear, "{} {}", new.linear, kept.linear);
    for solved in [&kept, &one, &new] {
        assert!((solved.square / exact.square - 1.0).abs() < 1e-9);
    }
    let gap = kept.x.iter().zip(&exact.x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(world.max(gap) < 1e-9, "{gap:e}");
}
