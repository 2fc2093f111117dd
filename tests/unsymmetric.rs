//! Systems whose tangent is not symmetric: their products, their multigrid, their line search, and
//! that a symmetric problem gets its own answer from the general path.

#[path = "common/block.rs"]
mod block;
mod common;
#[path = "common/hardening.rs"]
mod hardening;

use block::Block;
use common::on_ranks;
use common::run::{Results, Run};
use hardening::{Solved, solve, solve_as};
use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;
use mpm_par::amg::symmetric_part as part;
use mpm_par::parallel::World;
use mpm_par::petsc::Session;

const PLANE: Block<2> = Block { cells: [44, 27], held: true, flow: true };
const SPACE: Block<3> = Block { cells: [11, 13, 9], held: true, flow: true };

#[test]
fn the_symmetric_part_is_half_the_sum_with_the_transposed() {
    const NAME: &str = "the_symmetric_part_is_half_the_sum_with_the_transposed";
    on_ranks(NAME, &[1, 2, 3, 4], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = World::new(universe.world().duplicate());
        symmetric_part(&world, PLANE);
        symmetric_part(&world, SPACE);
        symmetric_part(&world, Block { flow: false, ..PLANE });
    });
}

fn symmetric_part<const D: usize>(world: &World, block: Block<D>) {
    let share = block.share(world);
    let nodes = &share.nodes;
    let found = part::symmetric_part(world, nodes.owned, &nodes.global, &nodes.halo, &share.rows);
    let found = found.unwrap();
    assert_eq!(found.columns, share.rows.columns);
    let mut differ = false;
    for row in 0..nodes.owned {
        for k in found.offsets[row]..found.offsets[row + 1] {
            let [a, b] = [row, found.columns[k] as usize].map(|local| nodes.global[local] as usize);
            let (here, there) = (block.stiffness(a, b), block.stiffness(b, a));
            for r in 0..D {
                for s in 0..D {
                    differ |= (here[r][s] - there[s][r]).abs() > 1e-12;
                    let half = 0.5 * (here[r][s] + there[s][r]);
                    assert!((found.values[k][r][s] - half).abs() < 1e-15, "{a} {b} {r} {s}");
                }
            }
        }
    }
    let differ = world.sum_usize(usize::from(differ)) > 0;
    assert_eq!(differ, block.flow, "the block is unsymmetric where it flows");
}

#[test]
fn unsymmetric_systems_take_the_same_iterations_on_any_number_of_ranks() {
    const NAME: &str = "unsymmetric_systems_take_the_same_iterations_on_any_number_of_ranks";
    on_ranks(NAME, &[1, 2, 3, 4], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = World::new(universe.world().duplicate());
        same_iterations(&world, PLANE);
        same_iterations(&world, SPACE);
    });
}

fn same_iterations<const D: usize>(world: &World, block: Block<D>) {
    let alone = World::new(SimpleCommunicator::self_comm());
    let exact = [
        ("ksp_type", "preonly"),
        ("pc_type", "lu"),
        ("pc_factor_mat_solver_type", "mumps"),
        ("snes_lag_preconditioner", "1"),
    ];
    let exact = solve(world, block, "lu_", &exact, false).unwrap();
    let one = solve(&alone, block, "one_", &[], true).unwrap();
    let kept = solve(world, block, "kept_", &[], true).unwrap();
    let again = solve(world, block, "again_", &[], true).unwrap();
    let stabilised = solve(world, block, "bcgsl_", &[("ksp_type", "bcgsl")], true).unwrap();
    assert_eq!(kept.newton, one.newton);
    // A norm may fall to either side of the tolerance by round-off.
    assert!(kept.linear.abs_diff(one.linear) <= 2, "{} {}", kept.linear, one.linear);
    assert_eq!(kept.x, again.x, "the same bits");
    assert_eq!(kept.made[0], 1, "one hierarchy serves the whole solve");
    for solved in [&kept, &stabilised] {
        let gap = solved.x.iter().zip(&exact.x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(world.max(gap) < 1e-9, "{gap:e}");
    }
}

#[test]
fn fgmres_takes_at_most_half_more_iterations_than_conjugate_gradients() {
    const NAME: &str = "fgmres_takes_at_most_half_more_iterations_than_conjugate_gradients";
    on_ranks(NAME, &[1, 3], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = World::new(universe.world().duplicate());
        compare(&world, PLANE);
        compare(&world, SPACE);
    });
}

fn compare<const D: usize>(world: &World, block: Block<D>) {
    // An outer tolerance that no forcing term loosens.
    let options = [("ksp_rtol", "1e-8")];
    let elastic = Block { flow: false, ..block };
    let of = |prefix: &str, block: Block<D>, symmetric: bool| -> Solved {
        solve_as(world, block, prefix, &options, true, symmetric).unwrap()
    };
    let conjugate = of("cg_", elastic, true);
    let general = of("fgmres_", elastic, false);
    assert_eq!(general.newton, conjugate.newton);
    let (most, found) = (1.5 * conjugate.linear as f64, general.linear as f64);
    assert!(found <= most, "{found} {most}");
    let gap = general.x.iter().zip(&conjugate.x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(world.max(gap) < 1e-9, "{gap:e}");
}

/// A soft block under its weight, in two steps.
fn soft() -> Run {
    let deck = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/decks/disk.toml");
    Run::file(deck).set("grid.h=0.25").set("analysis.steps=2")
}

/// An elasto-plastic collapse, held by Ghost stiffness.
fn collapse() -> Run {
    Run::of("collapse-gimp").set("body.0.points_per_cell=[3,3]").set("ghost={stiffness_factor=0.1}")
}

fn general(run: Run) -> Run {
    run.set("analysis.tangent=\"unsymmetric\"")
}

/// Residuals of all iterations, relative to the forces, agree to 1e-12.
#[track_caller]
fn assert_same_history(a: &Results, b: &Results, steps: usize) {
    for step in 1..=steps {
        let (a, b) = (a.residuals(step), b.residuals(step));
        assert_eq!(a.len(), b.len(), "iterations of step {step}");
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() <= 1e-12 * a.max(1.0), "step {step}: {a:e} {b:e}");
        }
    }
}

#[test]
fn an_equal_problem_repeats_the_residuals_of_the_symmetric_path() {
    for (run, steps) in [(soft(), 2), (collapse().set("analysis.steps=16"), 16)] {
        let symmetric = run.clone().results();
        for ranks in [1, 2, 3, 4] {
            assert_same_history(&general(run.clone()).ranks(ranks).results(), &symmetric, steps);
        }
    }
}

#[test]
fn so_it_does_with_multigrid() {
    let tight = |run: Run| {
        ["-qs_pc_type", "mg", "-qs_ksp_rtol", "1e-14", "-qs_ksp_max_it", "300"]
            .iter()
            .fold(run, |run, word| run.word(*word))
    };
    let symmetric = tight(soft()).word("-qs_ksp_type").word("cg").results();
    for method in ["fgmres", "gmres", "bcgsl"] {
        for ranks in [1, 3] {
            let run = tight(general(soft())).word("-qs_ksp_type").word(method).ranks(ranks);
            assert_same_history(&run.results(), &symmetric, 2);
        }
    }
}

/// The whole weight in one step: Newton's full steps end outside the reach of the solution.
#[test]
fn the_line_search_solves_what_full_steps_do_not() {
    let run = general(collapse().set("analysis.steps=1").set("analysis.max_iterations=60"));
    let full = run.clone().word("-qs_snes_linesearch_type").word("basic").attempt();
    assert_eq!(full.code, 1, "{}", full.said());
    let results = run.results();
    let residuals = results.residuals(1);
    assert!(residuals[residuals.len() - 1] <= 1e-9, "{residuals:?}");
    // It is full steps that solve a bend: they let the residual grow, and so does the search.
    let bend = || {
        ["grid.h=0.5", "analysis.steps=12", "output.every=12", "analysis.max_iterations=40"]
            .iter()
            .fold(Run::of("beam"), |run, key| run.set(*key))
    };
    let (plain, searched) = (bend().results(), general(bend()).results());
    let tip = |results: &Results| results.points(12).field("position").to_vec();
    let off = common::run::relative_difference(&tip(&searched), &tip(&plain));
    assert!(off < 1e-7, "{off:e}");
}

/// All nodes are held: the residual is zero to the last bit before the reactions are known.
#[test]
fn a_residual_of_zero_is_no_failed_search() {
    let run = Run::of("shear").set("analysis.steps=5");
    let (plain, searched) = (run.clone().results(), general(run).results());
    assert_same_history(&searched, &plain, 5);
    assert!(searched.verify("shear_stress") < 1e-12);
}
