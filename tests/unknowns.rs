//! Unknowns per node apart from the dimension of space: one (heat) and three (made-up blocks) on the
//! active nodes of a plane problem, through the program's numbering, sparsity, rows in the solver's
//! memory, conditions and Ghost faces; and through boundaries, a step's equations and the driver of Newton's method: one,
//! and one more than there are axes, in the plane and in space, by the program's multigrid.

mod common;

use std::path::Path;

use common::on_ranks;
use mpi::environment::Universe;
use mpi::traits::*;
use mpm_par::analysis::equilibrium::StepEquations;
use mpm_par::analysis::newton::{Attempt, System};
use mpm_par::analysis::solver::{self, Linear, Trials};
use mpm_par::deck::expression::Expression;
use mpm_par::deck::model::{Boundary, Place, Rotation};
use mpm_par::deck::{self, Presence};
use mpm_par::parallel::World;
use mpm_par::petsc::{Ksp, Session};
use mpm_par::points::Points;
use mpm_par::run::setup;
use mpm_par::system::conditions::{Conditions, StepSpan};
use mpm_par::system::held::Held;
use mpm_par::system::in_place::{InPlace, RowAddresses};
use mpm_par::system::model::Model;
use mpm_par::system::scatter::{BlockMatrix, BlockRows, add_support};
use mpm_par::system::step_points::StepPoints;
use mpm_par::system::step_system::Discretisation;
use mpm_par::system::terms::block::add_block;
use mpm_par::system::terms::ghost::{Ghost, ghost_matrix};
use mpm_par::system::terms::term::{At, Health, Part, Term};
use mpm_par::system::unknowns::Unknowns;

/// The points fill whole cells, four each, so that linear fields are exact at inner nodes.
const PLATE: &str = r#"
[analysis]
type = "implicit-dynamic"
steps = 1
duration = 1
tolerance = 1e-11
max_iterations = 12
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

/// Σ_p V k(g) ∇S · g with g = ∇T and k = 1 + |g|²: conduction that depends on the gradient.
struct Conduction<'a> {
    step: StepPoints<'a, 2>,
}

impl Term<1> for Conduction<'_> {
    fn add_shares(
        &self,
        part: Part,
        at: At<'_>,
        force: &mut [f64],
        mut rows: Option<&mut InPlace<'_, 1>>,
    ) -> Health {
        let step = self.step;
        let which = match part {
            Part::Reaching => &step.border.reaching,
            Part::Inner => &step.border.inner,
        };
        for group in which.iter().cloned().flatten() {
            let nodes = step.nodes_of_group(group);
            let mut block = vec![0.0; nodes.len() * nodes.len()];
            for &p in step.groups.points(group) {
                let (slopes, volume) = (
                    &step.influences.gradients[step.influences.row(p)],
                    step.points.volume_initial[p],
                );
                let mut g = [0.0; 2];
                for (&node, slope) in nodes.iter().zip(slopes) {
                    g[0] += slope[0] * at.displacement[node as usize];
                    g[1] += slope[1] * at.displacement[node as usize];
                }
                let k = 1.0 + g[0] * g[0] + g[1] * g[1];
                let along = |slope: &[f64; 2]| slope[0] * g[0] + slope[1] * g[1];
                for (a, s) in slopes.iter().enumerate() {
                    force[nodes[a] as usize] += volume * k * along(s);
                    for (b, q) in slopes.iter().enumerate() {
                        let dot = s[0] * q[0] + s[1] * q[1];
                        block[a * nodes.len() + b] +=
                            volume * (k * dot + 2.0 * along(s) * along(q));
                    }
                }
            }
            if let Some(rows) = rows.as_deref_mut() {
                add_block::<1, _>(at.pattern, group, nodes, &block, rows);
            }
        }
        Health::default()
    }
}

/// The left edge is held, a flux q = k g enters at the right one: the field is linear, with g (1 + g²) = q.
fn heat_by_newton(universe: &Universe) {
    const SLOPE: f64 = 0.7;
    let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
    let world = &World::new(universe.world().duplicate());
    let deck = deck::read(Path::new("plate.toml"), PLATE, &[]).expect("a sound deck");
    let (model, points) = setup::prepare::<2>(world, deck).expect("a sound problem");
    let mesh = Discretisation::new(world, &model, &points).expect("a system");
    let step = mesh.step_points(&points, &model.materials);
    let numbering = &mesh.numbering;

    let places: Vec<[f64; 2]> =
        numbering.nodes.iter().map(|&node| model.grid.node_position(node)).collect();
    let exact: Vec<f64> = places.iter().map(|x| 1.0 + SLOPE * x[0]).collect();
    // Of an edge's node: the half cells beside it.
    let entering = |x: &[f64; 2]| match (x[0] >= 4.0, x[1] <= 0.0 || x[1] >= 2.0) {
        (true, true) => 0.25 * SLOPE * (1.0 + SLOPE * SLOPE),
        (true, false) => 0.5 * SLOPE * (1.0 + SLOPE * SLOPE),
        (false, _) => 0.0,
    };
    let external = places[..numbering.owned].iter().map(entering).collect();
    let fields = Unknowns::fields(["temperature"]);
    let of = (&model, &points, &mesh);
    let term = Box::new(Conduction { step });
    let Attempt { errors, .. } = solve_step(world, of, fields, (&exact, external), (term, 1e-10));
    assert!(errors.len() >= 4, "{errors:?}");
    // Quadratic: the last errors square, down to round-off.
    let late = errors.windows(2).find(|pair| pair[0] < 1e-2).expect("an error below 1e-2");
    assert!(late[1] < 100.0 * late[0] * late[0] + 1e-13, "{errors:?}");
}

#[test]
fn one_unknown_by_newtons_method() {
    on_ranks("one_unknown_by_newtons_method", &[1, 2, 3], heat_by_newton);
}

/// Solves a step of a `term` and of Ghost faces by the program's driver of Newton's method, for fields that a
/// boundary holds at one where x = 0, and asserts that they are `exact` everywhere, to the bound. `external`: of the
/// owned unknowns.
fn solve_step<const D: usize, const N: usize>(
    world: &World,
    (model, points, mesh): (&Model<D>, &Points<D>, &Discretisation<D>),
    unknowns: Unknowns<N>,
    (exact, external): (&[f64], Vec<f64>),
    (term, bound): (Box<dyn Term<N> + '_>, f64),
) -> Attempt {
    let one = || Expression::parse("1.0").expect("a number");
    let boundary = Boundary {
        name: "end".into(),
        place: Place::Box { min: vec![-1.0; D], max: [vec![0.0], vec![9.0; D - 1]].concat() },
        fix: Vec::new(),
        displacement: (0..N).map(|k| (k, one())).collect(),
        rotation: None,
        presence: Presence::default(),
    };
    let span =
        StepSpan { stage: 0, factor_start: 0.0, factor_end: 1.0, time_start: 0.0, time_end: 1.0 };
    let (basis, by) = (model.deck.method.basis, (std::slice::from_ref(&boundary), unknowns));
    let conditions =
        Conditions::evaluate(world, &model.grid, basis, &mesh.numbering, points, by, span)
            .expect("a sound boundary");
    let ghost = Ghost::new(world, mesh).expect("faces").expect("there are Ghost faces");
    let equations = StepEquations {
        unknowns,
        conditions: &conditions,
        left_out: &vec![false; mesh.numbering.len()],
        external_owned: external,
        terms: vec![term, Box::new(ghost)],
        following: None,
    };
    let system = System::new(world, model, mesh, equations).expect("equations");
    let attempt = system.solve(world, points, &mut Trials::default()).expect("a solve");
    let solved = attempt.end.as_ref().expect("converged");
    for (dof, value) in solved.displacement.iter().enumerate() {
        assert!((value - exact[dof]).abs() < bound, "{dof}: {value} {}", exact[dof]);
    }
    attempt
}

/// Σ_p V A ∇S · ∇u: fields that are conducted together.
struct Together<'a, const D: usize, const N: usize> {
    step: StepPoints<'a, D>,
    coupling: [[f64; N]; N],
}

impl<const D: usize, const N: usize> Term<N> for Together<'_, D, N> {
    fn add_shares(
        &self,
        part: Part,
        at: At<'_>,
        force: &mut [f64],
        mut rows: Option<&mut InPlace<'_, N>>,
    ) -> Health {
        let step = self.step;
        let which = match part {
            Part::Reaching => &step.border.reaching,
            Part::Inner => &step.border.inner,
        };
        for group in which.iter().cloned().flatten() {
            let nodes = step.nodes_of_group(group);
            let width = N * nodes.len();
            let mut block = vec![0.0; width * width];
            for &p in step.groups.points(group) {
                let slopes = &step.influences.gradients[step.influences.row(p)];
                for (a, s) in slopes.iter().enumerate() {
                    for (b, q) in slopes.iter().enumerate() {
                        let dot: f64 = s.iter().zip(q).map(|(s, q)| s * q).sum();
                        for (i, line) in self.coupling.iter().enumerate() {
                            for (j, share) in line.iter().enumerate() {
                                block[(N * a + i) * width + N * b + j] +=
                                    step.points.volume_initial[p] * share * dot;
                            }
                        }
                    }
                }
            }
            let place = |k: usize| nodes[k / N] as usize * N + k % N;
            for (row, line) in block.chunks_exact(width).enumerate() {
                let values = line.iter().enumerate();
                force[place(row)] +=
                    values.map(|(c, entry)| entry * at.displacement[place(c)]).sum::<f64>();
            }
            if let Some(rows) = rows.as_deref_mut() {
                add_block::<N, _>(at.pattern, group, nodes, &block, rows);
            }
        }
        Health::default()
    }
}

/// Iterations of the linear solver where the end x = 0 of a bar is held and the flux A s enters at the other
/// one, so that the fields are linear in x with the slopes s. `size`: of the bar in `text`, m.
fn iterations<const D: usize, const N: usize>(
    world: &World,
    (text, size, h): (&str, [f64; D], f64),
    coupling: [[f64; N]; N],
) -> usize {
    let slopes: [f64; N] = std::array::from_fn(|k| 0.7 - 0.6 * k as f64);
    let deck = deck::read(Path::new("bar.toml"), text, &[]).expect("a sound deck");
    let (model, points) = setup::prepare::<D>(world, deck).expect("a sound problem");
    let mesh = Discretisation::new(world, &model, &points).expect("a system");
    let step = mesh.step_points(&points, &model.materials);
    let numbering = &mesh.numbering;

    let places: Vec<[f64; D]> =
        numbering.nodes.iter().map(|&node| model.grid.node_position(node)).collect();
    let exact: Vec<f64> =
        places.iter().flat_map(|x| slopes.map(|slope| 1.0 + slope * x[0])).collect();
    // An inner node of the end bears the flux of a whole cell, one on an edge that of half a one.
    let entering = |x: &[f64; D]| {
        let across = (1..D).map(|a| if x[a] <= 0.0 || x[a] >= size[a] { 0.5 * h } else { h });
        let area = if x[0] >= size[0] { across.product() } else { 0.0 };
        coupling.map(|line| {
            area * line.iter().zip(slopes).map(|(share, slope)| share * slope).sum::<f64>()
        })
    };
    let external = places[..numbering.owned].iter().flat_map(entering).collect();
    let fields = Unknowns::fields(["field"; N]);
    let term = Box::new(Together { step, coupling });
    solve_step(world, (&model, &points, &mesh), fields, (&exact, external), (term, 1e-8))
        .most_linear_iterations
}

/// One more unknown than axes, with the program's multigrid. Levels of constants take hardly more iterations on cells of half the size.
fn more_by_multigrid(universe: &Universe) {
    let _session =
        Session::start(universe, &[("qs_pc_type".into(), "mg".into())], &[]).expect("PETSc starts");
    let world = &World::new(universe.world().duplicate());
    let coupling = [[2.0, 0.5, 0.0], [0.5, 3.0, 1.0], [0.0, 1.0, 2.0]];
    let [coarse, fine] = [0.125, 0.0625].map(|h| {
        let text = PLATE.replace("h = 0.5", &format!("h = {h}"));
        iterations::<2, 3>(world, (&text, [4.0, 2.0], h), coupling)
    });
    assert!(coarse <= 25 && fine <= coarse + 5, "{coarse} {fine}");

    let text = PLATE
        .replace("h = 0.5", "h = 0.25")
        .replace("[-1, -1]", "[-1, -1, -1]")
        .replace("size = [6, 4]", "size = [4, 3, 3]")
        .replace("min = [0, 0], max = [4, 2]", "min = [0, 0, 0], max = [2, 1, 1]")
        .replace("[2, 2]", "[2, 2, 2]");
    let coupling =
        [[2.0, 0.5, 0.0, 0.1], [0.5, 3.0, 1.0, 0.0], [0.0, 1.0, 2.0, 0.2], [0.1, 0.0, 0.2, 1.0]];
    let count = iterations::<3, 4>(world, (&text, [2.0, 1.0, 1.0], 0.25), coupling);
    assert!(count <= 25, "{count}");
}

#[test]
fn one_more_unknown_than_axes_by_multigrid() {
    on_ranks("one_more_unknown_than_axes_by_multigrid", &[1, 2, 3], more_by_multigrid);
}

/// So many equations of one unknown per node get PETSc's multigrid by default, as the program's has no levels for them.
fn heat_by_multigrid(universe: &Universe) {
    let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
    let world = &World::new(universe.world().duplicate());
    let text = PLATE.replace("h = 0.5", "h = 0.025");
    let count = iterations::<2, 1>(world, (&text, [4.0, 2.0], 0.025), [[2.0]]);
    assert!((2..=40).contains(&count), "{count}");
}

#[test]
fn one_unknown_by_multigrid() {
    on_ranks("one_unknown_by_multigrid", &[2], heat_by_multigrid);
}

/// Boundaries speak of the unknowns by their names, and what is no displacement does not rotate.
fn refused_boundaries(universe: &Universe) {
    let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
    let world = &World::new(universe.world().duplicate());
    let deck = deck::read(Path::new("plate.toml"), PLATE, &[]).expect("a sound deck");
    let (model, points) = setup::prepare::<2>(world, deck).expect("a sound problem");
    let mesh = Discretisation::new(world, &model, &points).expect("a system");
    let span =
        StepSpan { stage: 0, factor_start: 0.0, factor_end: 1.0, time_start: 0.0, time_end: 1.0 };
    let fields = Unknowns::fields(["x displacement", "y displacement", "water pressure"]);
    let refusal = |displacement, rotation| {
        let boundary = Boundary {
            name: "rim".into(),
            place: Place::Box { min: vec![-1.0; 2], max: vec![9.0; 2] },
            fix: Vec::new(),
            displacement,
            rotation,
            presence: Presence::default(),
        };
        let (basis, by) = (model.deck.method.basis, (&[boundary][..], fields));
        let of = &mesh.numbering;
        let found = Conditions::evaluate(world, &model.grid, basis, of, &points, by, span);
        found.expect_err("refused").to_string()
    };
    let text = refusal(vec![(2, Expression::parse("1/(X-X)").expect("valid"))], None);
    assert!(text.contains("water pressure") && text.contains("finite"), "{text}");
    let text = refusal(Vec::new(), Some(Rotation { centre: vec![0.0; 2], degrees: 1.0 }));
    assert!(text.contains("rotates") && text.contains("water pressure"), "{text}");
}

#[test]
fn boundaries_of_other_unknowns_are_checked() {
    on_ranks("boundaries_of_other_unknowns_are_checked", &[1, 2], refused_boundaries);
}
