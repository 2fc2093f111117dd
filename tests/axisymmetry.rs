//! Bodies of revolution: uniform states, the tangent against differences, closed forms of spheres,
//! columns and rings in statics and dynamics, ranks, frames, and what is refused.

mod common;

use std::f64::consts::{PI, TAU};
use std::path::Path;

use common::on_ranks;
use common::run::{Results, Run, relative_difference};
use mpi::traits::Communicator;
use mpm_par::deck;
use mpm_par::deck::model::Frame;
use mpm_par::error::Result;
use mpm_par::parallel::World;
use mpm_par::petsc::Session;
use mpm_par::points::Points;
use mpm_par::run::setup;
use mpm_par::system::model::Model;
use mpm_par::system::plain;
use mpm_par::system::scatter::BlockMatrix;
use mpm_par::system::step_system::Discretisation;
use mpm_par::system::terms::pressure::PressureTerm;
use mpm_par::system::terms::stress;
use mpm_par::system::terms::term::{At, Part};
use mpm_par::transfer::update;

const RUBBER: &str = "model = \"hencky\"\nyoung = 1e6\npoisson = 0.3";
const METAL: &str = "model = \"von-mises\"\nyoung = 1e6\npoisson = 0.3\nyield = 2e4";
const SAND: &str = "model = \"drucker-prager\"\nyoung = 1e6\npoisson = 0.3\nfriction = 30.0\n\
                    dilation = 10.0\ncohesion = 1e4";

/// A block from the axis on whose points lie anywhere in the cells: domains of gimp are cut by them.
fn block_text(basis: &str, locking: &str, material: &str) -> String {
    format!(
        "[analysis]\ntype = \"quasi-static\"\nsymmetry = \"axisymmetric\"\nsteps = 1\n\
         [method]\nbasis = \"{basis}\"\nlocking = \"{locking}\"\n\
         [grid]\ntype = \"lattice\"\norigin = [0.0, -1.0]\nsize = [6.0, 6.0]\nh = 1.0\n\
         [material.m]\n{material}\n\
         [[body]]\nname = \"block\"\nmaterial = \"m\"\ndensity = 1.0\n\
         shape = {{ box = {{ min = [0, 0], max = [4, 4] }} }}\n\
         lattice = {{ spacing = 0.4, offset = [0.2, 0.29] }}\n\
         [[boundary]]\nname = \"low\"\nwhere = {{ side = \"bottom\" }}\nfix = [\"y\"]\n\
         [[load]]\npressure = {{ value = \"1e5*(5-y) + 2e4*x*x\" }}\n\
         [output]\nevery = 1\nfields = [\"stress\"]\n"
    )
}

fn block(
    world: &World,
    basis: &str,
    locking: &str,
    material: &str,
) -> Result<(Model<2>, Points<2>)> {
    let text = block_text(basis, locking, material);
    setup::prepare(world, deck::read(Path::new("block.toml"), &text, &[])?)
}

/// Values at the local nodes, zero along the radius on the axis.
fn field(
    model: &Model<2>,
    mesh: &Discretisation<2>,
    of: impl Fn([f64; 2], usize) -> [f64; 2],
) -> Vec<f64> {
    let nodal = |&node: &usize| {
        let x = model.grid.node_position(node);
        let [u, v] = of(x, node);
        [if x[0] == 0.0 { 0.0 } else { u }, v]
    };
    mesh.numbering.nodes.iter().flat_map(nodal).collect()
}

/// Increments that no cell can represent, up to `size`.
fn rough(model: &Model<2>, mesh: &Discretisation<2>, size: f64, seed: f64) -> Vec<f64> {
    field(model, mesh, |_, node| {
        let of = |i: usize| size * (seed + 12.9898 * node as f64 + 78.233 * i as f64).sin();
        [of(0), of(1)]
    })
}

fn apply(model: &Model<2>, mesh: &Discretisation<2>, points: &mut Points<2>, by: &[f64]) {
    let made = update::increments(mesh.step_points(points, &model.materials), by);
    update::stretch(&made.deformation, points, None);
    update::respond(&model.materials, made.straining(), points, None);
}

type Block = BlockMatrix<2>;

fn force(
    mesh: &Discretisation<2>,
    model: &Model<2>,
    points: &Points<2>,
    frame: Frame,
    displacement: &[f64],
) -> Vec<f64> {
    let step = mesh.step_points(points, &model.materials);
    let mut force = vec![0.0; displacement.len()];
    let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);
    let none = None::<&mut Block>;
    stress::assemble(step, frame, numbering, pattern, displacement, &mut force, none);
    force
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

/// K times `along` at the owned nodes.
fn product(mesh: &Discretisation<2>, matrix: &Block, along: &[f64]) -> Vec<f64> {
    let pattern = &mesh.pattern;
    let mut products = vec![0.0; along.len()];
    for row in 0..mesh.numbering.owned {
        let (start, end) = (pattern.offsets[row], pattern.offsets[row + 1]);
        let width = (end - start) * 2;
        for i in 0..2 {
            let line = &matrix.values[4 * start + i * width..][..width];
            for (position, &node) in pattern.columns[start..end].iter().enumerate() {
                for k in 0..2 {
                    products[row * 2 + i] += line[position * 2 + k] * along[node as usize * 2 + k];
                }
            }
        }
    }
    products
}

fn assert_is_derivative(
    what: &str,
    products: &[f64],
    at: &[f64],
    along: &[f64],
    force: impl Fn(&[f64]) -> Vec<f64>,
) {
    let by = 1e-6;
    let shifted = |by: f64| -> Vec<f64> {
        force(&at.iter().zip(along).map(|(u, a)| u + by * a).collect::<Vec<f64>>())
    };
    let (more, less) = (shifted(by), shifted(-by));
    let scale = largest(products);
    for ((more, less), product) in more.iter().zip(&less).zip(products) {
        let difference = (more - less) / (2.0 * by);
        let off = (difference - product).abs() / scale;
        assert!(off < 1e-6, "{what}: {difference:e} by differences, {product:e}");
    }
}

fn tangent(world: &World, basis: &str, locking: &str, material: &str) -> Result<()> {
    let (model, mut points) = block(world, basis, locking, material)?;
    let mesh = Discretisation::new(world, &model, &points)?;
    let first = rough(&model, &mesh, 0.03, 0.4);
    apply(&model, &mesh, &mut points, &first);
    let mesh = Discretisation::new(world, &model, &points)?;
    let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);
    let at = rough(&model, &mesh, 0.04, 1.7);
    let along = rough(&model, &mesh, 1.0, 3.1);
    let step = mesh.step_points(&points, &model.materials);
    let reference = force(&mesh, &model, &points, Frame::Previous, &at);
    for frame in [Frame::Previous, Frame::Updated, Frame::Total] {
        let what = format!("{basis}, {locking}, {material}, {frame:?}");
        let zeros = vec![0.0; at.len()];
        let (mut fast, mut slow) = (zeros.clone(), zeros);
        let (mut tiled, mut formulas) = (Block::zeros(pattern), Block::zeros(pattern));
        stress::assemble(step, frame, numbering, pattern, &at, &mut fast, Some(&mut tiled));
        plain::assemble(step, frame, numbering, pattern, &at, &mut slow, &mut formulas);
        let off = relative_difference(&tiled.values, &formulas.values);
        assert!(off < 1e-13, "{what}: tiled against plain {off:e}");
        assert!(relative_difference(&fast, &slow) < 1e-13, "{what}: forces");
        assert!(relative_difference(&fast, &reference) < 1e-12, "{what}: another frame");
        let products = product(&mesh, &tiled, &along);
        assert_is_derivative(&what, &products, &at, &along, |u| {
            force(&mesh, &model, &points, frame, u)
        });
    }
    Ok(())
}

/// Elastic and flowing, with and without F-bar, in the three frames.
#[test]
fn the_tangent_is_the_derivative_of_the_force() {
    on_ranks("the_tangent_is_the_derivative_of_the_force", &[1], |universe| {
        let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
        let world = World::new(universe.world().duplicate());
        for basis in ["mpm", "gimp"] {
            for locking in ["none", "f-bar"] {
                for material in [RUBBER, METAL, SAND] {
                    tangent(&world, basis, locking, material).expect("it runs");
                }
            }
        }
    });
}

fn pressure(world: &World, basis: &str) -> Result<()> {
    let (model, points) = block(world, basis, "none", RUBBER)?;
    let mesh = Discretisation::new(world, &model, &points)?;
    let term = PressureTerm::new(&model, deck::When { stage: 0, factor: 1.0, time: 0.0 })
        .expect("the deck has one");
    let at = rough(&model, &mesh, 0.04, 1.7);
    let along = rough(&model, &mesh, 1.0, 3.1);
    let step = mesh.step_points(&points, &model.materials);
    let evaluate = |u: &[f64], mut rows: Option<&mut Block>| -> Vec<f64> {
        let mut force = vec![0.0; u.len()];
        for part in [Part::Reaching, Part::Inner] {
            let at = At { pattern: &mesh.pattern, displacement: u };
            term.add_shares(step, part, at, &mut force, rows.as_deref_mut());
        }
        force
    };
    let mut matrix = Block::zeros(&mesh.pattern);
    evaluate(&at, Some(&mut matrix));
    // The tangent is that of the negative force.
    let products = product(&mesh, &matrix, &along);
    assert_is_derivative(&format!("pressure, {basis}"), &products, &at, &along, |u| {
        evaluate(u, None).iter().map(|f| -f).collect()
    });
    Ok(())
}

#[test]
fn the_tangent_of_pressures_is_the_derivative_of_their_force() {
    on_ranks("the_tangent_of_pressures_is_the_derivative_of_their_force", &[1], |universe| {
        let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
        let world = World::new(universe.world().duplicate());
        for basis in ["mpm", "gimp"] {
            pressure(&world, basis).expect("it runs");
        }
    });
}

/// u_r = a r, u_y = b y + c: dF, the hoop and the places are exact, and a uniform stress gives no force at
/// inner nodes with gimp, wherever the cells cut the domains.
fn uniform(world: &World, basis: &str, locking: &str) -> Result<()> {
    let (model, mut points) = block(world, basis, locking, RUBBER)?;
    let mesh = Discretisation::new(world, &model, &points)?;
    let (a, b, c) = (0.07, -0.11, 0.3);
    let nodal = field(&model, &mesh, |x, _| [a * x[0], b * x[1] + c]);
    let made = update::increments(mesh.step_points(&points, &model.materials), &nodal);
    for strain in [&made.deformation, made.straining()] {
        for (block, hoop) in strain.blocks.iter().zip(&strain.hoops) {
            let exact = [a, 0.0, 0.0, b];
            for (value, exact) in block.as_flattened().iter().zip(exact) {
                assert!((value - exact).abs() < 1e-14, "{basis} {locking}: {value:e} for {exact}");
            }
            assert!((hoop - a).abs() < 1e-14, "{basis} {locking}: hoop {hoop:e}");
        }
    }
    for (x, moved) in points.position.iter().zip(&made.displacement) {
        let off = (moved[0] - a * x[0]).abs().max((moved[1] - b * x[1] - c).abs());
        assert!(off < 1e-14, "{basis}: {x:?} moves by {moved:?}");
    }
    if basis == "gimp" {
        // Equal in all directions: with u = a x.
        let nodal = field(&model, &mesh, |x, _| [a * x[0], a * x[1]]);
        apply(&model, &mesh, &mut points, &nodal);
        let still = vec![0.0; nodal.len()];
        let force = force(&mesh, &model, &points, Frame::Updated, &still);
        let scale = largest(&force);
        let mut inner = 0;
        for (local, &node) in mesh.numbering.nodes.iter().enumerate() {
            let x = model.grid.node_position(node);
            if x[0] <= 2.5 && (1.5..=2.5).contains(&x[1]) {
                inner += 1;
                let here = &force[2 * local..2 * local + 2];
                // On the axis the radial component is held.
                let size = if x[0] == 0.0 { here[1].abs() } else { largest(here) };
                assert!(size < 1e-12 * scale, "{x:?}: {here:?} beside {scale}");
            }
        }
        assert!(inner >= 3);
    }
    Ok(())
}

#[test]
fn uniform_states_are_exact() {
    on_ranks("uniform_states_are_exact", &[1], |universe| {
        let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
        let world = World::new(universe.world().duplicate());
        for basis in ["mpm", "gimp"] {
            for locking in ["none", "f-bar"] {
                uniform(&world, basis, locking).expect("it runs");
            }
        }
    });
}

/// Stress -p to 1e-10 on each basis, in each frame, on one to three ranks; the volume is that of the ball.
#[test]
fn a_ball_under_uniform_pressure_is_hydrostatic() {
    let ball = || Run::of("pressure-ball");
    let cases = [
        ("gimp", ball().ranks(2)),
        ("gimp with F-bar", ball().set("method.locking=\"f-bar\"").ranks(3)),
        ("mpm", ball().set("method.basis=\"mpm\"").set("method.frame=\"updated\"")),
        ("total", ball().set("method.frame=\"total\"")),
        ("without Ghost", ball().set("ghost=\"off\"").set("load.0.pressure.value=\"1e5*s\"")),
    ];
    for (name, run) in cases {
        let results = run.results();
        for stress in ["stress_xx", "stress_yy", "stress_zz", "stress_xy"] {
            let error = results.verify(stress);
            assert!(error < 1e-10, "{name}: {stress} {error:e}");
        }
        let (volume, mass) = (4.0 / 3.0 * PI * 1.3f64.powi(3), results.number("bodies.ball.mass"));
        assert!((mass / (1000.0 * volume) - 1.0).abs() < 1e-6, "{name}: mass {mass}");
        // Hencky: ln J = -3 p J (1 - 2 nu) / E.
        let j = results.number("bodies.ball.volume") / volume;
        let law = j.ln() + 3.0 * 1e5 * j * 0.4 / 1e6;
        assert!(law.abs() < 1e-6, "{name}: J = {j}");
    }
}

const COLUMN: &str = r#"
[analysis]
type = "quasi-static"
symmetry = "axisymmetric"
steps = 5
tolerance = 1e-11
[method]
basis = "gimp"
domain_update = "stretch"
[grid]
type = "lattice"
size = [1.5, 3.0]
h = 0.25
[material.soil]
model = "hencky"
young = 1e6
poisson = 0.3
[[body]]
name = "column"
material = "soil"
density = 1000.0
shape = { box = { min = [0, 0], max = [1.5, 2] } }
points_per_cell = [2, 2]
[[boundary]]
name = "floor"
where = { side = "bottom" }
fix = ["y"]
[[boundary]]
name = "wall"
where = { side = "right" }
fix = ["x"]
[[load]]
gravity = [0, -40]
[output]
every = 5
fields = ["displacement", "stress"]
"#;

/// A confined cylinder settles under its weight as a confined slab does, at every radius: the mass, the
/// gradients and the Ghost faces are weighted alike. The floor carries the weight of the whole turn.
#[test]
fn a_confined_cylinder_settles_like_a_slab() {
    let plane = "analysis.symmetry=\"plane-strain\"";
    // The points of mpm weigh gradients and masses alike, but the Ghost faces not like them.
    for (basis, locking, tolerance) in
        [("gimp", "none", 1e-8), ("mpm", "none", 1e-5), ("gimp", "f-bar", 1e-8)]
    {
        let run = || {
            Run::text(COLUMN)
                .set(format!("method.basis=\"{basis}\""))
                .set(format!("method.locking=\"{locking}\""))
        };
        let cylinder = run().ranks(2).results();
        // In plane strain the axis is a wall, too.
        let wall = "boundary.1.where={box={min=[0,0],max=[1.5,3]}}";
        let slab = run().set(plane).set(wall).results();
        let heights = |results: &Results| results.points(5).component("displacement", 1);
        let off = relative_difference(&heights(&cylinder), &heights(&slab));
        assert!(off < tolerance, "{basis}, {locking}: {off:e}");
        let weight = 1000.0 * 40.0 * PI * 1.5f64.powi(2) * 2.0;
        let carried = *cylinder.history("reaction.floor.y").last().expect("a row");
        assert!((carried / weight - 1.0).abs() < 1e-8, "{carried} for {weight}");
    }
}

/// Lamé's thick cylinder between planes, a 1 m, b 2 m, pressed by the wall's displacement, small strains: second
/// order in h with the mesh of finite elements, and the pressure of the closed form.
#[test]
fn a_thick_cylinder_has_the_pressure_of_lame() {
    let (a, b, young, nu, u) = (1.0f64, 2.0f64, 1e6, 0.3, 1e-6);
    // u_a = (1 + nu) p a / E ((1 - 2 nu) a^2 + b^2) / (b^2 - a^2)
    let exact = u * young * (b * b - a * a) / ((1.0 + nu) * a * ((1.0 - 2.0 * nu) * a * a + b * b));
    let off = |cells: usize| {
        let deck = format!(
            "[analysis]\ntype = \"quasi-static\"\nsymmetry = \"axisymmetric\"\nsteps = 1\n\
             [method]\nbasis = \"mpm\"\n\
             [grid]\ntype = \"lattice\"\norigin = [1.0, 0.0]\ncells = [{}, 1]\nh = [{}, 0.5]\n\
             [material.m]\nmodel = \"hencky\"\nyoung = {young}\npoisson = {nu}\n\
             [[body]]\nname = \"ring\"\nmaterial = \"m\"\n\
             shape = {{ box = {{ min = [1, 0], max = [2, 0.5] }} }}\npoints_per_cell = [2, 2]\n\
             [[boundary]]\nname = \"inner\"\nwhere = {{ side = \"left\" }}\n\
             displacement = {{ x = {u} }}\n\
             [[boundary]]\nname = \"planes\"\nwhere = {{ box = {{ min = [0, 0], max = [3, 1] }} }}\n\
             fix = [\"y\"]\n",
            cells + 1,
            1.0 / cells as f64
        );
        let results = Run::text(&deck).results();
        let reaction = *results.history("reaction.inner.x").last().expect("a row");
        reaction / (TAU * a * 0.5) / exact - 1.0
    };
    let (coarse, fine) = (off(8), off(16));
    assert!(fine.abs() < 2e-3, "{fine:e}");
    assert!(coarse / fine > 3.5, "{coarse:e}, {fine:e}");
}

/// Pressure on the inner wall at radius `a` and height `h` where the load factor is `at`.
fn pressure_at(results: &Results, boundary: &str, at: f64, a: f64, h: f64) -> f64 {
    let factors = results.history("load_factor");
    let row = factors.iter().position(|s| (s - at).abs() < 1e-9).expect("a step ends there");
    results.history(&format!("reaction.{boundary}.x"))[row] / (TAU * a * h)
}

/// formulations.md C.2: an independent one-dimensional solution.
#[test]
fn a_cavity_in_sand_has_the_pressures_of_the_series() {
    let results = Run::of("cavity").ranks(2).results();
    for (a, wanted) in
        [(1.01, 84.72), (1.05, 195.39), (1.1, 291.2), (1.2, 457.1), (1.5, 906.6), (2.0, 1616.5)]
    {
        let found = pressure_at(&results, "cavity", a - 1.0, a, 0.25) / 1e3;
        assert!((found / wanted - 1.0).abs() < 2e-3, "a = {a}: {found} kPa for {wanted}");
    }
    assert!(results.count("newton_iterations.max") <= 6);
}

/// Yu and Houlsby (1991) for an endless medium under 100 kPa all round without cohesion: p / p_0 at a / a_0
/// (formulations.md C.2), the outer radius 600 times the cavity's.
#[test]
fn a_cavity_in_endless_sand_has_the_pressures_of_yu_and_houlsby() {
    let results = Run::of("cavity")
        .set("grid.generate.box={spacing=[[[1, 0.05], [3, 0.1], [600, 40]], [[0, 0.25], [0.25, 0.25]]]}")
        .set("body.0.shape={box={min=[1, 0], max=[600, 0.25]}}")
        .set("body.0.initial_stress={xx=-1e5, yy=-1e5, zz=-1e5}")
        .set("boundary.0.displacement.x=2.0")
        .set("boundary.2.where={box={min=[0, 0], max=[700, 1]}}")
        .set("material.sand.cohesion=0.0")
        .set("analysis.steps=200")
        .results();
    let table = [
        (1.01, 2.3471),
        (1.05, 4.0087),
        (1.1, 5.0347),
        (1.2, 6.2294),
        (1.5, 7.8728),
        (2.0, 8.9156),
        (3.0, 9.6183),
    ];
    for (a, wanted) in table {
        let found = pressure_at(&results, "cavity", (a - 1.0) / 2.0, a, 0.25) / 100e3;
        let tolerance = if a < 2.5 { 1e-3 } else { 5e-3 };
        assert!((found / wanted - 1.0).abs() < tolerance, "a = {a}: {found} for {wanted}");
    }
}

#[test]
fn a_plastic_tube_has_the_pressures_of_hill() {
    for ranks in [1, 3] {
        let results = Run::of("thick-cylinder").ranks(ranks).results();
        let (a, b, young, nu, k) = (100.0f64, 200.0f64, 210e6, 0.3f64, 240.0 / 3f64.sqrt());
        let mut judged = 0;
        for step in [10, 15, 20] {
            let points = results.points(step);
            let (x, u) = (points.component("position", 0), points.component("displacement", 0));
            let last = (0..x.len()).max_by(|&i, &j| x[i].total_cmp(&x[j])).expect("points");
            // Beyond the front u is a multiple of (1 - 2 nu) r + b^2 / r.
            let form = |r: f64| (1.0 - 2.0 * nu) * r + b * b / r;
            let outer = u[last] * form(b) / form(x[last] - u[last]);
            let c = (outer * young * b / (2.0 * k * (1.0 - nu * nu))).sqrt();
            assert!(a < c && c < b, "front at {c}");
            let wanted = k * (1.0 - c * c / (b * b) + 2.0 * (c / a).ln());
            let found = pressure_at(&results, "inner", step as f64 / 30.0, a, 5.0);
            assert!((found / wanted - 1.0).abs() < 3e-3, "front at {c} mm: {found} for {wanted}");
            judged += 1;
        }
        assert_eq!(judged, 3);
    }
}

const CELL: &str = r#"
[analysis]
type = "quasi-static"
symmetry = "axisymmetric"
steps = 100
tolerance = 1e-11
[method]
basis = "gimp"
domain_update = "stretch"
[grid]
type = "lattice"
size = [2, 1]
h = 1.0
[material.sand]
model = "mohr-coulomb"
young = 100e6
poisson = 0.3
friction = 30.0
dilation = 10.0
cohesion = 10e3
[[body]]
name = "sample"
material = "sand"
shape = { box = { min = [0, 0], max = [1, 1] } }
points_per_cell = [2, 2]
[[boundary]]
name = "base"
where = { side = "bottom" }
fix = ["y"]
[[boundary]]
name = "platen"
where = { side = "top" }
displacement = { y = "100*(exp(-0.001)-1)*s" }
[output]
every = 100
fields = ["stress", "J"]
"#;

/// A sample between a base and a platen: unconfined it does what one point does in an element test, of every model; and
/// under a pressure all round it fails at sigma_1 = N sigma_3 + 2 (c/J) N^(1/2), N = 3.
#[test]
fn a_triaxial_sample_of_one_cell_is_an_element_test() {
    let soil = "friction=30.0, dilation=10.0, cohesion=10e3";
    let models = [
        format!("model=\"mohr-coulomb\", {soil}"),
        format!("model=\"drucker-prager\", fit=\"outer\", {soil}"),
        format!("model=\"drucker-prager\", hardening=1e6, {soil}"),
        format!(
            "model=\"mohr-coulomb\", {soil}, softening={{ strain=0.2, friction=20.0, cohesion=5e3, \
             dilation=0.0, length=1.0 }}"
        ),
        "model=\"tresca\", shear_strength=10e3".into(),
        "model=\"von-mises\", yield_stress=20e3, hardening=1e6".into(),
        "model=\"neo-hookean\"".into(),
    ];
    let mut strengths = Vec::new();
    for model in &models {
        let model = format!("material.sand={{ young=100e6, poisson=0.3, {model} }}");
        let test = Run::of("triaxial").set("element_test.confining=0.0").set(&model).results();
        let last = test.text("element.csv");
        let last = last.lines().last().expect("rows").split(',').map(|word| word.parse::<f64>());
        let alone: Vec<f64> = last.map(|number| number.expect("a number")).collect();
        for basis in ["gimp", "mpm"] {
            let run = Run::text(CELL).set(format!("method.basis=\"{basis}\"")).set(&model);
            let sample = run.ranks(2).results().points(100);
            let scale = alone[4].abs();
            for (component, of_test) in [(3, 4), (0, 5), (5, 6)] {
                for stress in sample.component("stress", component) {
                    let off = (stress - alone[of_test]).abs() / scale;
                    assert!(
                        off < 1e-8,
                        "{model}, {basis}: {stress} for {} ({off:e})",
                        alone[of_test]
                    );
                }
            }
        }
        strengths.push(alone[4]);
    }
    // The outer cone is the pyramid where the two smaller pressures are equal.
    assert!((strengths[1] / strengths[0] - 1.0).abs() < 1e-9, "{strengths:?}");
    for basis in ["gimp", "mpm"] {
        let run = || Run::text(CELL).set(format!("method.basis=\"{basis}\""));
        // The platen's reaction is what the pressure leaves of sigma_1.
        let load = "load=[{pressure={value=\"100e3*min(1,20*s)\"}}]";
        let confined = run().set(load).results();
        let points = confined.points(100);
        let (axial, j) = (points.component("stress", 3), points.field("J").to_vec());
        for (axial, j) in axial.iter().zip(&j) {
            let wanted = -(3.0 * 100e3 + 2.0 * 10e3 / j * 3f64.sqrt());
            assert!((axial / wanted - 1.0).abs() < 1e-8, "{basis}: {axial} for {wanted}");
        }
    }
}

/// A pressure on the inner surface of a tube between planes, wherever its wall lies in the cells: Lamé's displacement,
/// and quadratic steps where it is large.
#[test]
fn a_tube_under_inner_pressure_widens_by_lame() {
    let deck = |pressure: f64| {
        format!(
            "[analysis]\ntype = \"quasi-static\"\nsymmetry = \"axisymmetric\"\nsteps = 2\n\
             [method]\nbasis = \"gimp\"\ndomain_update = \"stretch\"\n\
             [grid]\ntype = \"lattice\"\norigin = [0.6, 0.0]\nsize = [2.1, 0.3]\nh = 0.1\n\
             [material.m]\nmodel = \"hencky\"\nyoung = 1e6\npoisson = 0.3\n\
             [[body]]\nname = \"tube\"\nmaterial = \"m\"\n\
             shape = {{ box = {{ min = [1.03, 0], max = [2.03, 0.3] }} }}\n\
             points_per_cell = [2, 2]\n\
             [[boundary]]\nname = \"planes\"\nwhere = {{ box = {{ min = [0, 0], max = [3, 1] }} }}\n\
             fix = [\"y\"]\n\
             [[load]]\npressure = {{ value = {pressure}, surface = {{ side = \"left\" }} }}\n\
             [output]\nevery = 2\nfields = [\"displacement\"]\n"
        )
    };
    let results = Run::text(&deck(10.0)).ranks(2).results();
    let points = results.points(2);
    let (x, u) = (points.component("position", 0), points.component("displacement", 0));
    let (a, b, nu) = (1.03f64, 2.03f64, 0.3);
    for (x, u) in x.iter().zip(&u) {
        let r = x - u;
        let factor = (1.0 + nu) * 10.0 * a * a / (1e6 * (b * b - a * a));
        let exact = factor * ((1.0 - 2.0 * nu) * r + b * b / r);
        assert!((u / exact - 1.0).abs() < 0.01, "r = {r}: {u:e} for {exact:e}");
    }
    let large = Run::text(&deck(5e4)).results();
    assert!(large.count("newton_iterations.max") <= 7);
}

/// A thin ring that is thrown outwards breathes with omega = (E / rho)^(1/2) / R and keeps its energy: after half
/// a period it comes back inwards as fast.
fn breathing(analysis: &str, method: &str) -> String {
    let (radius, wave) = (10.25, 100.0);
    let half = PI * radius / wave;
    format!(
        "[analysis]\n{analysis}\nduration = {half}\nsymmetry = \"axisymmetric\"\n[method]\n{method}\n\
         [grid]\ntype = \"lattice\"\norigin = [9.0, -0.5]\nsize = [2.5, 1.5]\nh = 0.25\n\
         [material.m]\nmodel = \"hencky\"\nyoung = 1e7\npoisson = 0.0\n\
         [[body]]\nname = \"ring\"\nmaterial = \"m\"\ndensity = 1000.0\n\
         shape = {{ box = {{ min = [10, 0], max = [10.5, 0.5] }} }}\npoints_per_cell = [2, 2]\n\
         velocity = [0.1, 0.0]\n[output]\nevery = 1000000\nfields = [\"velocity\", \"displacement\"]\n"
    )
}

#[test]
fn a_thin_ring_breathes_with_the_wave_speed_over_its_radius() {
    let explicit = "type = \"explicit\"\ncfl = 0.4";
    let implicit = "type = \"implicit-dynamic\"\nsteps = 100";
    for (analysis, method) in [
        (explicit, "basis = \"gimp\"\nmass = \"consistent\""),
        (explicit, "basis = \"gimp\"\nmass = \"lumped\"\nlocking = \"f-bar\""),
        (explicit, "basis = \"mpm\"\nmass = \"lumped\"\nstress_update = \"usf\""),
        (implicit, "basis = \"gimp\""),
        (implicit, "basis = \"mpm\"\nframe = \"updated\""),
    ] {
        let results = Run::text(&breathing(analysis, method)).ranks(2).results();
        let column = |name: &str| results.history(name);
        let (mass, momentum) = (results.number("bodies.ring.mass"), column("momentum_x"));
        let exact = 1000.0 * TAU * 10.25 * 0.25;
        assert!((mass / exact - 1.0).abs() < 1e-12, "{mass} for {exact}");
        let back = momentum.last().expect("a row") / (0.1 * mass);
        assert!((back + 1.0).abs() < 5e-3, "{method}: {back} of the velocity");
        let sums = ["energy_kinetic", "energy_strain", "energy_ghost"].map(column);
        let whole: Vec<f64> = (0..sums[0].len()).map(|i| sums.iter().map(|s| s[i]).sum()).collect();
        let start = 0.5 * mass * 0.01;
        let (low, high) = whole.iter().fold((f64::MAX, 0.0f64), |(l, h), e| (l.min(*e), h.max(*e)));
        assert!(low > 0.98 * start && high < 1.01 * start, "{method}: {low} to {high}, {start}");
        // The ring has swung out by v / omega on the way.
        let strain = column("energy_strain").iter().fold(0.0, |m: f64, e| m.max(*e));
        assert!((strain / start - 1.0).abs() < 0.02, "{method}: {strain} of {start}");
    }
}

/// Length, radius of the foot, both in mm, and the sum of the energies over the impact's, at its worst.
fn taylor(results: &Results) -> [f64; 3] {
    let impact = 0.5 * results.number("bodies.bar.mass") * 227f64.powi(2);
    let sums = ["energy_kinetic", "energy_strain", "energy_plastic", "energy_ghost"]
        .map(|name| results.history(name));
    let off = |row: usize| sums.iter().map(|sum| sum[row]).sum::<f64>() / impact - 1.0;
    let worst = (0..sums[0].len()).map(|row| off(row).abs()).fold(0.0, f64::max);
    let extent = |axis: usize| 1e3 * results.number(&format!("bodies.bar.extent_max.{axis}"));
    [extent(1), extent(0), worst]
}

/// The published range, 21.3 to 21.7 mm and 6.8 to 7.2 mm, with 1 % and 3 %, and the energy of the impact to
/// 1 %, with F-bar too.
#[test]
fn a_taylor_bar_has_the_published_shape() {
    let bars: [&[&str]; 4] = [
        &[],
        &["method.locking=\"f-bar\""],
        &["method.locking=\"f-bar\"", "method.mass=\"consistent\""],
        &["method.locking=\"f-bar\"", "method.basis=\"mpm\""],
    ];
    for sets in bars {
        let run = sets.iter().fold(Run::of("taylor-bar"), |run, set| run.set(*set));
        let results = run.ranks(2).results();
        let [length, radius, energy] = taylor(&results);
        assert!((21.3 * 0.99..21.7 * 1.01).contains(&length), "{sets:?}: {length} mm");
        assert!((6.8 * 0.97..7.2 * 1.03).contains(&radius), "{sets:?}: {radius} mm");
        assert!(energy < 1e-2, "{sets:?}: {energy}");
        let strain = results.points(results.count("steps_completed"));
        let strain = (2.0f64 / 3.0).sqrt() * largest(strain.field("plastic_strain"));
        assert!((2.5..3.2).contains(&strain), "{sets:?}: {strain}");
    }
}

/// A quarter of the bar in space.
#[test]
#[ignore = "minutes"]
fn a_quarter_of_a_taylor_bar_in_space_is_the_axisymmetric_one() {
    let shape = "{intersection=[{where=\"x*x+z*z<3.2e-3*3.2e-3\"},\
                 {box={min=[0,0,0],max=[3.2e-3,32.4e-3,3.2e-3]}}]}";
    let space = Run::of("taylor-bar")
        .set("analysis.symmetry=\"plane-strain\"")
        .set("grid.size=[9.6e-3,36e-3,9.6e-3]")
        .set(format!("body.0.shape={shape}"))
        .set("body.0.points_per_cell=[2,2,2]")
        .set("body.0.velocity=[0,-227,0]")
        .set(
            "boundary=[{name=\"wall\",where={side=\"bottom\"},fix=[\"y\"]},\
             {where={side=\"left\"},fix=[\"x\"]},{where={side=\"back\"},fix=[\"z\"]}]",
        )
        .ranks(2)
        .results();
    let ([length, radius, energy], turned) =
        (taylor(&space), taylor(&Run::of("taylor-bar").results()));
    let mass = space.number("bodies.bar.mass");
    let exact = 8930.0 * PI / 4.0 * 3.2e-3f64.powi(2) * 32.4e-3;
    assert!((mass / exact - 1.0).abs() < 1e-3, "{mass} for {exact}");
    assert!((length / turned[0] - 1.0).abs() < 0.01, "{length} beside {} mm", turned[0]);
    assert!((radius / turned[1] - 1.0).abs() < 0.05, "{radius} beside {} mm", turned[1]);
    assert!(energy < 1e-2, "{energy}");
}

/// A body that flies along the axis keeps its velocity and has no stress.
#[test]
fn flight_along_the_axis_makes_nothing() {
    let analyses = ["type = \"explicit\"\nsteps = 40", "type = \"implicit-dynamic\"\nsteps = 4"];
    for (analysis, basis) in analyses.iter().flat_map(|a| ["gimp", "mpm"].map(|b| (a, b))) {
        let deck = format!(
            "[analysis]\n{analysis}\nduration = 0.04\nsymmetry = \"axisymmetric\"\n\
             [method]\nbasis = \"{basis}\"\n\
             [grid]\ntype = \"lattice\"\nsize = [2.0, 5.0]\nh = 0.5\n\
             [material.m]\nmodel = \"hencky\"\nyoung = 1e5\npoisson = 0.3\n\
             [[body]]\nname = \"ball\"\nmaterial = \"m\"\ndensity = 1000.0\n\
             shape = {{ intersection = [{{ disc = {{ centre = [0, 1.6], radius = 1.3 }} }}, \
             {{ box = {{ min = [0, 0], max = [2, 5] }} }}] }}\n\
             points_per_cell = [2, 2]\nvelocity = [0.0, 30.0]\n\
             [output]\nevery = 1000\nfields = [\"velocity\", \"stress\"]\n"
        );
        let results = Run::text(&deck).results();
        let points = results.points(results.count("steps_completed"));
        assert!(largest(points.field("stress")) < 1e-6, "{basis} {analysis}");
        let off = points.component("velocity", 1).iter().map(|v| v - 30.0).collect::<Vec<f64>>();
        assert!(largest(&off) < 1e-10, "{basis} {analysis}: {}", largest(&off));
        assert!(largest(&points.component("velocity", 0)) < 1e-10);
    }
}

/// A traction on the side of a cylinder and one on its top act on the areas of the whole turn.
#[test]
fn tractions_act_on_the_areas_of_the_turn() {
    for (side, axis, area) in [("top", 1, PI * 1.5 * 1.5), ("right", 0, TAU * 1.5 * 2.0)] {
        let value = if axis == 1 { "[0, -1e3]" } else { "[-1e3, 0]" };
        let results = Run::text(COLUMN)
            .set("analysis={type=\"explicit\",symmetry=\"axisymmetric\",steps=1,duration=1e-4}")
            .set("method={basis=\"gimp\",domain_update=\"stretch\",mass=\"lumped\"}")
            .set("boundary=[]")
            .set(format!("load.0={{traction={{side=\"{side}\",value={value}}}}}"))
            .set("output.every=1")
            .set("grid.size=[2.0,3.0]")
            .results();
        let name = ["momentum_x", "momentum_y"][axis];
        let momentum = *results.history(name).last().expect("a row");
        let exact = -1e3 * area * 1e-4;
        assert!((momentum / exact - 1.0).abs() < 1e-9, "{side}: {momentum} for {exact}");
    }
}

#[test]
fn what_a_body_of_revolution_cannot_have_is_refused() {
    let cases = [
        ("grid.origin=[-0.5,0.0]", "x is the radius"),
        ("method={basis=\"cpdi1\"}", "not derived for rings"),
        ("method.gimp_edge=\"published\"", "loses weight at the axis"),
        ("boundary.1={where={side=\"right\"},rotation={degrees=3.0}}", "turns the section"),
        ("load.0={manufactured=[\"0\",\"0\"]}", "plane strain or space"),
        ("boundary.0={where={side=\"left\"},fix=[\"y\"],displacement={x=0.1}}", "off the axis"),
        ("boundary=[]", "holds y"),
    ];
    for (change, words) in cases {
        let outcome = Run::text(COLUMN).set(change).attempt();
        assert_eq!(outcome.code, 2, "{change}: {}", outcome.stderr);
        assert!(outcome.said().contains(words), "{change}: {}", outcome.said());
    }
    let deep = COLUMN.replace("min = [0, 0], max = [1.5, 2]", "min = [-0.5, 0], max = [1.5, 2]");
    let outcome = Run::text(&deep).attempt();
    assert!(outcome.code == 2 && outcome.said().contains("beyond the axis"), "{}", outcome.said());
}
