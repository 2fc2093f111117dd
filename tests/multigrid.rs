//! Multigrid's levels: what they must keep, a second route to their numbers, and that they are the
//! same on any number of ranks.

#[path = "common/block.rs"]
mod block;
mod common;
#[path = "common/hardening.rs"]
mod hardening;

use block::{Block, Share};
use common::on_ranks;
use hardening::solve;
use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;
use mpm_par::amg;
use mpm_par::amg::tied::Ties;
use mpm_par::amg::{CoarsestRows, Hierarchy};
use mpm_par::blocks::BlockProduct;
use mpm_par::parallel::World;
use mpm_par::petsc::Index;
use mpm_par::petsc::Session;
use nalgebra::{DMatrix, SymmetricEigen};

fn build<const D: usize>(world: &World, share: &Share<D>) -> Hierarchy {
    let made = match D {
        2 => amg::build::<D, 3>(world, &share.nodes, &share.rows, &Ties::default()),
        _ => amg::build::<D, 6>(world, &share.nodes, &share.rows, &Ties::default()),
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
        let plane =
            build(&world, &Block { cells: [110, 41], held: false, flow: false }.share(&world));
        let space =
            build(&world, &Block { cells: [24, 15, 20], held: false, flow: false }.share(&world));
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
        let plane =
            build(&world, &Block { cells: [60, 41], held: true, flow: false }.share(&world));
        let space =
            build(&world, &Block { cells: [16, 13, 15], held: true, flow: false }.share(&world));
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
        let share = Block { cells: [21, 12], held: true, flow: false }.share(&world);
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
        same_levels(&world, Block { cells: [57, 34], held: true, flow: false });
        same_levels(&world, Block { cells: [15, 12, 17], held: true, flow: false });
    });
}

#[test]
fn coarse_levels_gather_on_fewer_ranks() {
    on_ranks("coarse_levels_gather_on_fewer_ranks", &[1, 2, 3, 4], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = World::new(universe.world().duplicate());
        let block = Block { cells: [150, 101], held: true, flow: false };
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
        let first = world.exclusive_sum(count) as Index;
        let trace: f64 = (0..count)
            .flat_map(|row| {
                let range = rows.offsets[row] as usize..rows.offsets[row + 1] as usize;
                range.filter(move |&k| rows.columns[k] == first + row as Index)
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

#[test]
fn smoothers_that_need_entries_are_refused() {
    on_ranks("smoothers_that_need_entries_are_refused", &[1, 2], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = World::new(universe.world().duplicate());
        let block = Block { cells: [12, 9], held: true, flow: false };
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
        same_iterations(&world, Block { cells: [44, 27], held: true, flow: false });
        same_iterations(&world, Block { cells: [11, 13, 9], held: true, flow: false });
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
