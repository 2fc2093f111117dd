//! The examples of docs/develop/adding-a-....md: compiled here, checked against closed forms, and
//! equal to what the pages show.

#[path = "../common/mod.rs"]
mod common;
mod spline;
mod springs;
mod swift;
mod wind;

use std::path::Path;

use common::on_ranks;
use mpi::environment::Universe;
use mpi::traits::*;
use mpm_par::analysis::equilibrium::{StepEquations, motion};
use mpm_par::analysis::newton::System;
use mpm_par::analysis::solver::Trials;
use mpm_par::basis::contract::Basis;
use mpm_par::basis::{self, of_deck};
use mpm_par::deck::expression::Expression;
use mpm_par::deck::model::{self, AnalysisType, Frame, GimpEdge};
use mpm_par::deck::{self, When};
use mpm_par::error;
use mpm_par::grid::{self, Grid, Lattice};
use mpm_par::loads::{self, Declaration, Found, Start};
use mpm_par::material::{self, Model as _};
use mpm_par::parallel::World;
use mpm_par::petsc::Session;
use mpm_par::points::{self, Points};
use mpm_par::run::setup;
use mpm_par::system::conditions::{Conditions, StepSpan};
use mpm_par::system::model::Model;
use mpm_par::system::step_system::{Coupling, Discretisation};
use mpm_par::system::terms::declaration::Context;
use mpm_par::system::unknowns::Unknowns;

use spline::Spline;
use swift::Swift;
use wind::Wind;

#[test]
fn pages_show_the_files() {
    for (page, file) in [
        ("adding-a-material.md", "tests/adding/swift.rs"),
        ("adding-a-term.md", "src/system/terms/foundation.rs"),
        ("adding-a-load.md", "tests/adding/wind.rs"),
        ("adding-a-basis.md", "tests/adding/spline.rs"),
    ] {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let read = |path: &str| std::fs::read_to_string(root.join(path)).expect(path);
        let (page_text, code) = (read(&format!("docs/develop/{page}")), read(file));
        assert!(
            page_text.contains(&format!("```rust\n{code}```\n")),
            "docs/develop/{page} does not show {file} word for word"
        );
    }
}

/// A strain that is loaded radially: 2 mu |e| = rho(alpha) + 2 mu sqrt(3/2) alpha gives back alpha.
#[test]
fn the_material_hardens_by_its_formula() {
    let (young, poisson, first, scale, power) = (200e9, 0.3, 250e6, 0.002, 0.2);
    let model = Swift::new(&[young, poisson, first, scale, power]);
    let (mu, root) = (model.elasticity.mu, (1.5_f64).sqrt());
    let direction = [2.0 / 6.0_f64.sqrt(), -1.0 / 6.0_f64.sqrt(), -1.0 / 6.0_f64.sqrt()];
    for (before, alpha) in [(0.0, 1e-6), (0.0, 0.3), (0.05, 0.06)] {
        let stress = first * (1.0_f64 + alpha / scale).powf(power);
        // What is plastic before the step is not in the trial strain.
        let norm = stress / root / (2.0 * mu) + root * (alpha - before);
        let trial = direction.map(|n| 0.01 + n * norm);
        let response = model.respond(trial, &[before]);
        assert!((response.state[0] / alpha - 1.0).abs() < 1e-9, "{}", response.state[0]);
        let uniaxial = response.stress[0] - response.stress[1];
        assert!((uniaxial / stress - 1.0).abs() < 1e-12, "{uniaxial} {stress}");
        // The tangent is that of the algorithm.
        for b in 0..3 {
            let h = 1e-7 * norm;
            let at = |sign: f64| {
                let mut moved = trial;
                moved[b] += sign * h;
                model.respond(moved, &[before]).stress
            };
            let (up, down) = (at(1.0), at(-1.0));
            for a in 0..3 {
                let slope = (up[a] - down[a]) / (2.0 * h);
                let error = (slope - response.tangent[a][b]).abs();
                assert!(error < 1e-5 * young, "{a}{b}: {slope} {}", response.tangent[a][b]);
            }
        }
    }
}

/// A block that rests on nothing but what a test gives it; it cannot move sideways.
const BLOCK: &str = r#"
ghost = "off"
[analysis]
type = "implicit-dynamic"
steps = 1
duration = 1
tolerance = 1e-11
[method]
basis = "mpm"
[grid]
type = "lattice"
origin = [0, -1]
size = [2, 5]
h = 0.5
[material.soil]
model = "hencky"
young = 1e6
poisson = 0.3
[[body]]
name = "block"
material = "soil"
density = 2000.0
shape = { box = { min = [0, 0], max = [2, 3] } }
points_per_cell = [2, 2]
[[boundary]]
name = "sides"
where = { box = { min = [0, -1], max = [2, 4] } }
fix = ["x"]
[[load]]
gravity = [0, -10]
[[foundation]]
axis = "y"
stiffness = "2e6 / 0.25 * (Y < 0.25)"
"#;

/// Of the layer of points on springs: a stiffness per volume times its thickness, N/m3.
const SUBGRADE: f64 = 2e6;

fn block(world: &World) -> (Model<2>, Points<2>) {
    let deck = deck::read(Path::new("block.toml"), BLOCK, &[]).expect("a sound deck");
    setup::prepare(world, deck).expect("a sound problem")
}

/// Length of the left side, m.
const HEIGHT: f64 = 3.0;

/// The block sinks until its springs hold its weight: by rho g H / k_s at the layer of springs,
/// whatever its stiffness.
fn rest_on_springs(world: &World, basis: &dyn Basis<2>) {
    let (model, points) = block(world);
    let mesh = Discretisation::with_basis(world, &model, &points, Coupling::Matrix, basis)
        .expect("a system");
    // All nodes are held along x.
    let held = (0..mesh.numbering.len() * 2).map(|dof| dof % 2 == 0).collect();
    let conditions = Conditions {
        fixed: held,
        increment: vec![0.0; mesh.numbering.len() * 2],
        ..Conditions::default()
    };
    let step = mesh.step_points(&points, &model.materials);
    let numbering = &mesh.numbering;
    let weights = model
        .point_forces(world, &points, When { stage: 0, factor: 1.0, time: 1.0 })
        .expect("gravity");
    let mut external = vec![0.0; numbering.len() * 2];
    for (p, force) in weights.iter().enumerate() {
        let shares = &step.influences.weights[step.influences.row(p)];
        for (&node, share) in step.nodes_of(p).iter().zip(shares) {
            for i in 0..2 {
                external[node as usize * 2 + i] += share * force[i];
            }
        }
    }
    numbering.halo.reverse_add(world, &mut external, 2).expect("sums");
    external.truncate(numbering.owned * 2);

    let kind = (Frame::Previous, true);
    let span = StepSpan::first_of(&model.deck.stages, 0);
    let of = Context::new(world, &model, (&mesh, &points), span);
    let equations = StepEquations {
        unknowns: Unknowns::displacements(),
        conditions: &conditions,
        left_out: &vec![false; numbering.len()],
        external_owned: external,
        terms: motion::terms(of, kind, Vec::new()).expect("terms"),
        following: None,
    };
    let system = System::new(world, &model, &mesh, equations).expect("equations");
    let attempt = system.solve(world, &points, &mut Trials::default()).expect("a solve");
    let solved = attempt.end.expect("converged");
    assert!(solved.evaluations <= 6, "{:?}", attempt.errors);
    let u = &solved.displacement;
    let wanted = -2000.0 * 10.0 * 3.0 / SUBGRADE;
    for p in (0..points.len()).filter(|&p| points.position_initial[p][1] < 0.25) {
        let shares = &step.influences.weights[step.influences.row(p)];
        let moved: f64 = step
            .nodes_of(p)
            .iter()
            .zip(shares)
            .map(|(&node, s)| s * u[node as usize * 2 + 1])
            .sum();
        assert!((moved / wanted - 1.0).abs() < 1e-9, "{moved} {wanted}");
    }
}

fn rest_on_linear_functions(universe: &Universe) {
    let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
    let world = World::new(universe.world().duplicate());
    rest_on_springs(&world, &*of_deck(model::Basis::Mpm, GimpEdge::Continued));
}

#[test]
fn the_term_holds_the_weight() {
    on_ranks("the_term_holds_the_weight", &[1, 2], rest_on_linear_functions);
}

/// Its rows reach beyond the cells of their points, and are numbered all the same.
fn rest_on_splines(universe: &Universe) {
    let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
    let world = World::new(universe.world().duplicate());
    rest_on_springs(&world, &Spline);
}

#[test]
fn the_basis_carries_the_block() {
    on_ranks("the_basis_carries_the_block", &[1, 2, 3], rest_on_splines);
}

/// Sums of S, of S x and of the gradients at points anywhere in the grid, and the gradients as
/// differences of the weights.
#[test]
fn the_basis_reproduces_linear_fields() {
    let grid = Grid::Lattice(Lattice { origin: [1.0, -2.0], spacing: [0.5, 0.25], cells: [4, 3] });
    let place = |s: f64| [1.0 + 2.0 * (0.5 + 0.5 * (7.0 * s).sin()), -2.0 + 0.75 * s];
    let mut points = Points::<2>::default();
    for k in 0..200 {
        let x = place((f64::from(k) + 0.5) / 200.0);
        points.push_unstrained(k as u64, 0, x, 1.0, 1.0, [0.1; 2]);
    }
    let rows = Spline.map_points(&grid, &points).expect("inside");
    for p in 0..points.len() {
        let (mut sum, mut place, mut slopes) = (0.0, [0.0; 2], [[0.0; 2]; 2]);
        let mut changes = [0.0; 2];
        for at in rows.row(p) {
            let node = grid.node_position(rows.nodes[at]);
            sum += rows.weights[at];
            for i in 0..2 {
                place[i] += rows.weights[at] * node[i];
                changes[i] += rows.gradients[at][i];
                for j in 0..2 {
                    slopes[i][j] += rows.gradients[at][j] * node[i];
                }
            }
        }
        assert!((sum - 1.0).abs() < 1e-14, "{p}: {sum}");
        for i in 0..2 {
            assert!((place[i] - points.position[p][i]).abs() < 1e-14, "{p}: {place:?}");
            assert!(changes[i].abs() < 1e-12, "{p}: {changes:?}");
            for j in 0..2 {
                let wanted = if i == j { 1.0 } else { 0.0 };
                assert!((slopes[i][j] - wanted).abs() < 1e-12, "{p}: {slopes:?}");
            }
        }
    }
}

/// Patch test: a uniform stress gives no force at nodes whose function lies in the body. 2 x 2 points a
/// cell integrate the gradients, linear in each half cell, exactly.
#[test]
fn the_basis_passes_the_patch_test() {
    let lattice = Lattice { origin: [0.0; 2], spacing: [0.5; 2], cells: [8, 7] };
    let grid = Grid::Lattice(lattice);
    let mut points = Points::<2>::default();
    // The body leaves a cell free all around.
    for k in 0..12 * 10 {
        let x = [0.5 + 0.25 * (f64::from(k % 12) + 0.5), 0.5 + 0.25 * (f64::from(k / 12) + 0.5)];
        points.push_unstrained(k as u64, 0, x, 0.0625, 1.0, [0.125; 2]);
    }
    let rows = Spline.map_points(&grid, &points).expect("inside");
    let mut force: std::collections::BTreeMap<usize, [f64; 2]> = Default::default();
    for p in 0..points.len() {
        for at in rows.row(p) {
            let sum = force.entry(rows.nodes[at]).or_default();
            for i in 0..2 {
                sum[i] += points.volume_initial[p] * rows.gradients[at][i];
            }
        }
    }
    let mut inner = 0;
    for (&node, force) in &force {
        let x = grid.node_position(node);
        let inside = (0..2).all(|i| x[i] - 0.75 >= 0.5 && x[i] + 0.75 <= [3.5, 3.0][i]);
        if inside {
            inner += 1;
            assert!(force.iter().all(|f| f.abs() < 1e-13), "{x:?}: {force:?}");
        }
    }
    assert_eq!(inner, 3 * 2);
}

/// With a = 1/2 the pressure is linear in the height, and the sum over the points is exact:
/// c rho v_10^2 H^2 / (4 · 10 m).
fn blow(universe: &Universe) {
    let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
    let world = World::new(universe.world().duplicate());
    let (model, points) = block(&world);
    let wind = Wind {
        side: 0.0,
        area: HEIGHT,
        density: 1.25,
        speed: Expression::parse("25").expect("valid"),
        exponent: 0.5,
        coefficient: 0.8,
    };
    let start = Start { world: &world, points: &points, found: Found::default(), cell: 1.0 };
    let all = vec![wind.make(start).expect("a load")];
    let when = When { stage: 0, factor: 0.5, time: 0.5 };
    // Half of the load at half of the steps.
    let mut deck = model.deck.clone();
    deck.analysis.kind = AnalysisType::QuasiStatic;
    let forces = loads::on_points(&points, &model.materials, &all, &deck, when).expect("forces");
    let total = world.sum(forces.iter().map(|f| f[0]).sum());
    let wanted = 0.5 * (0.8 * 1.25 * 25.0 * 25.0 * 3.0 * 3.0 / 40.0);
    assert!((total / wanted - 1.0).abs() < 1e-12, "{total} {wanted}");
    assert!(forces.iter().all(|f| f[1] == 0.0));
}

#[test]
fn the_load_sums_to_its_integral() {
    on_ranks("the_load_sums_to_its_integral", &[1, 2], blow);
}
