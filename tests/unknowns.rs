//! Unknowns per node apart from the dimension of space: one (heat) and three (made-up blocks) on the
//! active nodes of a plane problem, through the program's numbering, sparsity, rows in the solver's
//! memory, conditions and Ghost faces.

mod common;

use std::path::Path;

use common::on_ranks;
use mpi::environment::Universe;
use mpi::traits::*;
use mpm_par::analysis::solver::{self, Linear};
use mpm_par::deck;
use mpm_par::parallel::World;
use mpm_par::petsc::{Ksp, Session};
use mpm_par::run::setup;
use mpm_par::system::held::Held;
use mpm_par::system::in_place::{InPlace, RowAddresses};
use mpm_par::system::scatter::{BlockMatrix, BlockRows, add_support};
use mpm_par::system::step_system::Discretisation;
use mpm_par::system::terms::ghost::ghost_matrix;
use mpm_par::system::terms::stress::StepPoints;

/// The points fill whole cells, four each, so that linear fields are exact at inner nodes.
const PLATE: &str = r#"
[analysis]
type = "implicit-dynamic"
steps = 1
duration = 1
[method]
basis = "mpm"
[ghost]
stiffness_factor = 1.0
[grid]
type = "lattice"
origin = [-1, -1]
size = [6, 4]
h = 0.5
[material.m]
model = "hencky"
young = 1.0
poisson = 0.3
[[body]]
name = "plate"
material = "m"
density = 1.0
shape = { box = { min = [0, 0], max = [4, 2] } }
points_per_cell = [2, 2]
"#;

/// Σ_p V ∇S · ∇S + J: conduction with Ghost faces, in its owners' rows. Collective.
fn conduction(world: &World, mesh: &Discretisation<2>, step: StepPoints<'_, 2>) -> BlockMatrix<1> {
    let mut matrix = BlockMatrix::zeros(&mesh.pattern);
    for group in 0..step.groups.len() {
        let count = step.nodes_of_group(group).len();
        let mut block = vec![0.0; count * count];
        for &p in step.groups.points(group) {
            let gradients = &step.influences.gradients[step.influences.row(p)];
            for (a, g) in gradients.iter().enumerate() {
                for (b, h) in gradients.iter().enumerate() {
                    block[a * count + b] +=
                        step.points.volume_initial[p] * (g[0] * h[0] + g[1] * h[1]);
                }
            }
        }
        add_support(&mut matrix, &mesh.pattern, group, &block);
    }
    matrix.reduce(world, &mesh.pattern);
    let ghost = ghost_matrix(world, mesh, |face| face.stiffness).expect("faces");
    let ghost = ghost.expect("the plate has Ghost faces");
    for (value, share) in matrix.values.iter_mut().zip(&ghost.values) {
        *value += share;
    }
    matrix
}

/// Solves (K ⊗ A) u = 0 with K the conduction and u given on the edge of the plate; the solution is
/// linear. `options`: of the linear solver.
fn solve<const N: usize>(
    world: &World,
    coupling: [[f64; N]; N],
    options: &[(&'static str, String)],
) {
    let deck = deck::read(Path::new("plate.toml"), PLATE, &[]).expect("a sound deck");
    let (model, points) = setup::prepare::<2>(world, deck).expect("a sound problem");
    let mesh = Discretisation::new(world, &model, &points).expect("a system");
    let step = mesh.step_points(&points, &model.materials);
    let scalar = conduction(world, &mesh, step);
    let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);

    let places: Vec<[f64; 2]> =
        numbering.nodes.iter().map(|&node| model.grid.node_position(node)).collect();
    let exact: Vec<f64> = places
        .iter()
        .flat_map(|x| {
            std::array::from_fn::<f64, N, _>(|k| {
                1.0 + k as f64 + (2.0 - k as f64) * x[0] - 3.0 * x[1]
            })
        })
        .collect();
    let on_edge = |x: &[f64; 2]| x[0] <= 0.0 || x[0] >= 4.0 || x[1] <= 0.0 || x[1] >= 2.0;
    let fixed: Vec<bool> = places.iter().flat_map(|x| [on_edge(x); N]).collect();

    let addresses = RowAddresses::<N>::new(numbering, pattern);
    let mut held =
        Held::new::<N>(numbering, pattern, fixed.clone(), &fixed, |row| addresses.start(row));
    let mut matrix = solver::block_matrix::<N>(world, numbering, pattern).expect("a matrix");
    let mut beside = vec![0.0; addresses.len_beside()];
    let scale = 2.0;
    {
        let (mut main, mut other) = matrix.storage().expect("the solver's values");
        let mut rows = InPlace::new(&addresses, &mut main, &mut beside, None).expect("rows");
        for row in 0..numbering.owned {
            rows.touch(pattern, row);
            let entries = pattern.offsets[row]..pattern.offsets[row + 1];
            let width = N * entries.len();
            let start = rows.start(pattern, row);
            for (i, line) in coupling.iter().enumerate() {
                let values = rows.values(start + i * width, width);
                for (block, entry) in values.chunks_exact_mut(N).zip(entries.clone()) {
                    for (value, share) in block.iter_mut().zip(line) {
                        *value = share * scalar.values[entry];
                    }
                }
            }
        }
        held.constrain::<N, _>(pattern, scale, &mut rows);
        rows.hand_over(other.as_deref_mut().unwrap_or(&mut [])).expect("rows at the border");
    }
    matrix.changed().expect("assembled");

    let (mut right, mut left) = (matrix.vector().expect("b"), matrix.vector().expect("x"));
    {
        let mut b = right.values_mut().expect("values");
        held.move_columns(&exact, &mut b);
        for dof in (0..b.len()).filter(|&dof| fixed[dof]) {
            b[dof] = scale * exact[dof];
        }
    }
    let mut ksp = Ksp::new(world.comm(), "test_").expect("a solver");
    ksp.set_defaults(options).expect("options");
    ksp.set_from_options().expect("options");
    ksp.set_operators(&matrix).expect("a matrix");
    ksp.solve(&right, &mut left).expect("a solve").require("the plate").expect("converged");
    let found = left.values().expect("values");
    let inner = (0..found.len()).filter(|&dof| !fixed[dof]).count();
    assert_eq!(world.sum_usize(inner), 7 * 3 * N);
    for (dof, value) in found.iter().enumerate() {
        assert!((value - exact[dof]).abs() < 1e-9, "{dof}: {value} {}", exact[dof]);
    }
}

fn heat(universe: &Universe) {
    let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
    let world = World::new(universe.world().duplicate());
    let options = [("ksp_type", "cg"), ("pc_type", "gamg"), ("ksp_rtol", "1e-13")];
    solve::<1>(&world, [[1.0]], &options.map(|(name, value)| (name, value.to_string())));
}

#[test]
fn one_unknown_per_node() {
    on_ranks("one_unknown_per_node", &[1, 2, 3], heat);
}

fn blocks(universe: &Universe) {
    let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
    let world = World::new(universe.world().duplicate());
    let options = Linear::DirectOnOne.options(world.size(), false);
    solve::<3>(&world, [[2.0, 1.0, 0.0], [0.0, 3.0, 1.0], [1.0, 0.5, 2.0]], &options);
}

#[test]
fn one_more_unknown_than_axes() {
    on_ranks("one_more_unknown_than_axes", &[1, 2, 3], blocks);
}
