//! F-bar: its tangent against differences, tiled against plain, uniform states, frames, ranks and
//! explicit steps; and what it is for, Cook's membrane and an undrained slope.

mod common;

use std::path::Path;

use common::on_ranks;
use common::run::{Results, Run, relative_difference};
use mpi::traits::Communicator;
use mpm_par::deck;
use mpm_par::deck::model::Frame;
use mpm_par::error::Result;
use mpm_par::parallel::{World, migrate};
use mpm_par::petsc::Session;
use mpm_par::points::Points;
use mpm_par::run::setup;
use mpm_par::system::model::Model;
use mpm_par::system::plain;
use mpm_par::system::scatter::BlockMatrix;
use mpm_par::system::step_system::Discretisation;
use mpm_par::system::terms::stress;
use mpm_par::transfer::update;

/// A block whose points lie off the middles of the cells, `per_cell` of them a side.
fn block_text(dimension: usize, basis: &str, per_cell: usize, model: &str) -> String {
    let list = |value: f64| format!("{:?}", vec![value; dimension]);
    let cells = if dimension == 2 { 3.0 } else { 2.0 };
    format!(
        "[analysis]\ntype = \"quasi-static\"\nsteps = 1\n\
         [method]\nbasis = \"{basis}\"\nlocking = \"f-bar\"\n\
         [grid]\ntype = \"lattice\"\norigin = {}\nsize = {}\nh = 1.0\n\
         [material.m]\n{model}\n\
         [[body]]\nname = \"block\"\nmaterial = \"m\"\ndensity = 1.0\n\
         shape = {{ box = {{ min = {}, max = {} }} }}\npoints_per_cell = {:?}\n\
         [[boundary]]\nname = \"low\"\nwhere = {{ side = \"bottom\" }}\nfix = {}\n\
         [output]\nevery = 1\nfields = [\"stress\"]\n",
        list(-1.0),
        list(cells + 3.0),
        list(0.0),
        list(cells),
        vec![per_cell; dimension],
        if dimension == 2 { "[\"x\", \"y\"]" } else { "[\"x\", \"y\", \"z\"]" },
    )
}

const RUBBER: &str = "model = \"hencky\"\nyoung = 1e6\npoisson = 0.49";
const METAL: &str = "model = \"von-mises\"\nyoung = 1e6\npoisson = 0.3\nyield = 2e4";
/// Non-associated: dtau for an expansion is no multiple of the unit tensor.
const SAND: &str = "model = \"drucker-prager\"\nyoung = 1e6\npoisson = 0.3\nfriction = 30.0\n\
                    dilation = 10.0\ncohesion = 1e4";

fn block<const D: usize>(
    world: &World,
    basis: &str,
    per_cell: usize,
    model: &str,
) -> Result<(Model<D>, Points<D>)> {
    let text = block_text(D, basis, per_cell, model);
    let deck = deck::read(Path::new("block.toml"), &text, &[])?;
    let (model, mut points): (Model<D>, _) = setup::prepare(world, deck)?;
    for x in &mut points.position {
        for (axis, x) in x.iter_mut().enumerate() {
            *x += 0.11 + 0.05 * axis as f64;
        }
    }
    migrate(world, &model.partition, &model.grid, &mut points)?;
    Ok((model, points))
}

/// Increments of the local nodes that no cell can represent, up to `size` of a cell.
fn field<const D: usize>(mesh: &Discretisation<D>, size: f64, seed: f64) -> Vec<f64> {
    let of =
        |node: usize, i: usize| size * (seed + 12.9898 * node as f64 + 78.233 * i as f64).sin();
    mesh.numbering
        .nodes
        .iter()
        .flat_map(|&node| std::array::from_fn::<f64, D, _>(|i| of(node, i)))
        .collect()
}

/// A state with stress, deformation and history: one increment behind it.
fn strained<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &mut Points<D>,
) -> Result<Discretisation<D>> {
    let mesh = Discretisation::new(world, model, points)?;
    let first = field(&mesh, 0.03, 0.4);
    let made = update::increments(mesh.step_points(points, &model.materials), &first);
    assert!(!made.averaged.blocks.is_empty());
    update::stretch(&made.deformation, points, None);
    update::respond(&model.materials, made.straining(), points, None);
    Discretisation::new(world, model, points)
}

fn force<const D: usize>(
    mesh: &Discretisation<D>,
    model: &Model<D>,
    points: &Points<D>,
    frame: Frame,
    displacement: &[f64],
) -> Vec<f64> {
    let step = mesh.step_points(points, &model.materials);
    let mut force = vec![0.0; displacement.len()];
    let none = None::<&mut BlockMatrix<D>>;
    let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);
    let health = stress::assemble(step, frame, numbering, pattern, displacement, &mut force, none);
    assert!(health.is_sound() && health.inverted.is_none());
    force
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

fn tangent<const D: usize>(
    world: &World,
    basis: &str,
    per_cell: usize,
    material: &str,
) -> Result<()> {
    let (model, mut points) = block::<D>(world, basis, per_cell, material)?;
    let mesh = strained(world, &model, &mut points)?;
    // Sand flows with less dilation than friction.
    assert_eq!(model.symmetric(), material != SAND);
    let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);
    let at = field::<D>(&mesh, 0.04, 1.7);
    let along = field::<D>(&mesh, 1.0, 3.1);
    let step = mesh.step_points(&points, &model.materials);
    let reference = force(&mesh, &model, &points, Frame::Previous, &at);
    for frame in [Frame::Previous, Frame::Updated, Frame::Total] {
        let what = format!("{D}D, {basis}, {per_cell} a side, {material}, {frame:?}");
        let zeros = vec![0.0; at.len()];
        let (mut fast, mut slow) = (zeros.clone(), zeros);
        let mut tiled = BlockMatrix::<D>::zeros(pattern);
        let mut formulas = tiled.clone();
        stress::assemble(step, frame, numbering, pattern, &at, &mut fast, Some(&mut tiled));
        plain::assemble(step, frame, numbering, pattern, &at, &mut slow, &mut formulas);
        let off = relative_difference(&tiled.values, &formulas.values);
        assert!(off < 1e-13, "{what}: tiled against plain {off:e}");
        assert!(relative_difference(&fast, &slow) < 1e-13, "{what}: forces");
        assert!(relative_difference(&fast, &reference) < 1e-12, "{what}: another frame");

        let shifted = |by: f64| -> Vec<f64> {
            let u: Vec<f64> = at.iter().zip(&along).map(|(u, a)| u + by * a).collect();
            force(&mesh, &model, &points, frame, &u)
        };
        let by = 1e-6;
        let (more, less) = (shifted(by), shifted(-by));
        let mut products = vec![0.0; at.len()];
        for row in 0..numbering.owned {
            let (start, end) = (pattern.offsets[row], pattern.offsets[row + 1]);
            let width = (end - start) * D;
            for i in 0..D {
                let line = &tiled.values[D * D * start + i * width..][..width];
                for (position, &node) in pattern.columns[start..end].iter().enumerate() {
                    for k in 0..D {
                        products[row * D + i] +=
                            line[position * D + k] * along[node as usize * D + k];
                    }
                }
            }
        }
        let scale = largest(&products);
        for ((more, less), product) in more.iter().zip(&less).zip(&products) {
            let difference = (more - less) / (2.0 * by);
            let off = (difference - product).abs() / scale;
            assert!(off < 1e-6, "{what}: {difference:e} by differences, {product:e}");
        }
    }
    if material == RUBBER {
        let work: f64 = reference.iter().zip(&along).map(|(f, u)| f * u).sum();
        let stored = |by: f64| -> f64 {
            let u: Vec<f64> = at.iter().zip(&along).map(|(u, a)| u + by * a).collect();
            let made = update::increments(step, &u);
            let mut after = points.clone();
            update::respond(&model.materials, made.straining(), &mut after, None).strain
        };
        let by = 1e-4;
        let slope = (stored(by) - stored(-by)) / (2.0 * by);
        let size: f64 = reference.iter().zip(&along).map(|(f, u)| (f * u).abs()).sum();
        let off = (slope - work).abs() / size;
        assert!(off < 1e-7, "{basis}, {per_cell}: {work:e} against {slope:e} of the energy");
    }
    Ok(())
}

/// Also that the force is the derivative of the stored energy; 4 and 9 points a cell (8 and 27 in space), elastic and flowing, in the three frames.
#[test]
fn the_tangent_is_the_derivative_of_the_force() {
    on_ranks("the_tangent_is_the_derivative_of_the_force", &[1], |universe| {
        let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
        let world = World::new(universe.world().duplicate());
        for basis in ["mpm", "gimp", "cpdi1", "cpdi2"] {
            for material in [RUBBER, METAL, SAND] {
                for per_cell in [2, 3] {
                    tangent::<2>(&world, basis, per_cell, material).expect("2D runs");
                }
                tangent::<3>(&world, basis, 2, material).expect("3D runs");
            }
        }
    });
}

/// A uniform dilation and a uniform shear are represented at the centres, too: dF_bar is dF.
fn uniform<const D: usize>(world: &World, basis: &str) -> Result<()> {
    let (model, points) = block::<D>(world, basis, 3, RUBBER)?;
    let mesh = Discretisation::new(world, &model, &points)?;
    for gradient in [[0.2, 0.0], [0.0, 0.7], [-0.1, 0.3]] {
        let nodal: Vec<f64> = mesh
            .numbering
            .nodes
            .iter()
            .flat_map(|&node| {
                let x = model.grid.node_position(node);
                let of = |i: usize| gradient[0] * x[i] + gradient[1] * x[(i + 1) % D];
                std::array::from_fn::<f64, D, _>(of)
            })
            .collect();
        let made = update::increments(mesh.step_points(&points, &model.materials), &nodal);
        for (own, averaged) in made.deformation.blocks.iter().zip(&made.averaged.blocks) {
            for (own, averaged) in own.as_flattened().iter().zip(averaged.as_flattened()) {
                assert!((own - averaged).abs() < 1e-14, "{basis} {D}D: {own:e}, {averaged:e}");
            }
        }
    }
    Ok(())
}

#[test]
fn uniform_states_stay_exact() {
    on_ranks("uniform_states_stay_exact", &[1], |universe| {
        let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
        let world = World::new(universe.world().duplicate());
        for basis in ["mpm", "gimp", "cpdi1", "cpdi2"] {
            uniform::<2>(&world, basis).expect("2D runs");
            uniform::<3>(&world, basis).expect("3D runs");
        }
    });
}

/// The deck in inputs/, coarser and tight, for what must agree.
fn coarse_cook() -> Run {
    Run::of("cook")
        .set("grid.h=4.0")
        .set("grid.size=[56.0, 80.0]")
        .set("material.rubber.poisson=0.49")
        .set("analysis.steps=5")
        .set("analysis.tolerance=1e-11")
        .set("output.every=5")
}

#[test]
fn frames_and_ranks_agree() {
    let reference = coarse_cook().results();
    let alike = |other: &Results, what: &str| {
        let (a, b) = (other.points(5), reference.points(5));
        assert_eq!(a.id, b.id, "{what}: other points");
        for field in ["position", "stress"] {
            let off = relative_difference(a.field(field), b.field(field));
            assert!(off < 1e-8, "{what}: {field} differ by {off:e}");
        }
    };
    for frame in ["updated", "total"] {
        alike(&coarse_cook().set(format!("method.frame=\"{frame}\"")).results(), frame);
    }
    for ranks in [2, 3] {
        let many = coarse_cook().set("parallel.brick=1").ranks(ranks).results();
        alike(&many, &format!("{ranks} ranks"));
    }
}

/// Displacement of the point whose first place is nearest to `place`, component `axis`.
fn displacement_near(results: &Results, step: usize, place: [f64; 2], axis: usize) -> f64 {
    let points = results.points(step);
    let [x, y] = [0, 1].map(|a| points.component("position", a));
    let [u, v] = [0, 1].map(|a| points.component("displacement", a));
    let distance = |p: usize| (x[p] - u[p] - place[0]).hypot(y[p] - v[p] - place[1]);
    let nearest = (0..x.len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
    [u, v][axis][nearest.expect("there are points")]
}

/// The numbers in the header of inputs/cook.toml, and Newton's order.
#[test]
fn cooks_membrane_does_not_lock() {
    let free = Run::of("cook").results();
    let locked = Run::of("cook").set("method.locking=\"none\"").results();
    for (place, wanted) in [([48.0, 60.0], 6.92), ([48.0, 52.0], 6.95)] {
        let of = |results: &Results| displacement_near(results, 10, place, 1) / wanted - 1.0;
        assert!(of(&free).abs() < 0.02, "{place:?}: {} off", of(&free));
        assert!(of(&locked) < -0.15, "{place:?}: {} off when locked", of(&locked));
    }
    let pressures = |results: &Results| {
        let points = results.points(10);
        let pressure = points.field("pressure");
        let (low, high) =
            pressure.iter().fold((0.0f64, 0.0f64), |(l, h), p| (l.min(*p), h.max(*p)));
        high - low
    };
    assert!(pressures(&locked) > 5.0 * pressures(&free));
}

/// Largest bearing capacity factor of a run of inputs/footing.toml, and that at its end.
fn capacity(run: Run) -> [f64; 2] {
    let factors: Vec<f64> =
        run.results().history("reaction.footing.y").iter().map(|f| -f / 100e3).collect();
    [factors.iter().copied().fold(0.0, f64::max), *factors.last().expect("rows")]
}

/// Grid lines of inputs/footing.toml with all distances times `factor`.
fn footing_lines(factor: f64) -> String {
    let axis = |stations: &[[f64; 2]]| {
        let pair = |[at, h]: &[f64; 2]| format!("[{at:?}, {:?}]", h * factor);
        format!("[{}]", stations.iter().map(pair).collect::<Vec<_>>().join(", "))
    };
    let x = axis(&[[0.0, 0.4], [1.0, 0.02], [6.0, 1.0]]);
    let y = axis(&[[0.0, 0.6], [3.0, 0.02], [3.1, 0.1]]);
    format!("grid.generate.box.spacing=[{x}, {y}]")
}

/// Prandtl's 2 + pi, from above as h falls, 2 % with eight cells in the half width; without F-bar there is
/// no plateau.
#[test]
fn a_footing_on_clay_has_the_capacity_of_prandtl() {
    let exact = 2.0 + std::f64::consts::PI;
    let [coarse, fine] = [2.0, 1.0].map(|factor| {
        let [most, end] = capacity(Run::of("footing").set(footing_lines(factor)).ranks(2));
        assert!((end / most - 1.0).abs() < 5e-3, "{factor}: no plateau, {most} and {end}");
        assert!(most > exact, "{factor}: {most}");
        most
    });
    assert!(fine < 1.02 * exact, "{fine}");
    assert!(fine < coarse, "{coarse}, {fine}");
    let smooth = "boundary.0={ name = \"footing\", where = { box = { min = [0, 3], max = [1, 3] } }, \
                  displacement = { y = -3e-3 } }";
    let [most, _] = capacity(Run::of("footing").set(smooth).ranks(2));
    assert!(most > 0.99 * exact && most < 1.02 * exact, "smooth: {most}");
    let [locked, _] = capacity(Run::of("footing").set("method.locking=\"none\"").ranks(2));
    assert!(locked > 1.35 * exact, "{locked}");
}

/// On equal cells the last held node's motion fades over the cell beside it: the excess is that of about
/// 0.4 cells, and halves with h.
#[test]
fn equal_cells_make_a_footing_wider() {
    let exact = 2.0 + std::f64::consts::PI;
    let on_lattice = |h: f64| {
        let grid = format!("grid={{ type = \"lattice\", size = [6.0, 3.5], h = {h} }}");
        let tagged = ["left", "right", "bottom"]
            .iter()
            .enumerate()
            .map(|(k, side)| format!("boundary.{}.where={{ side = \"{side}\" }}", k + 1));
        tagged.fold(Run::of("footing").set(grid), Run::set).ranks(2)
    };
    let [coarse, fine] = [0.25, 0.125].map(|h| capacity(on_lattice(h))[0]);
    let ratio = (coarse - exact) / (fine - exact);
    assert!((1.6..2.4).contains(&ratio), "{coarse}, {fine}");
    let cells = (fine / exact - 1.0) / 0.125;
    assert!((0.3..0.5).contains(&cells), "{fine}: {cells} cells");
}

/// r_(k+1) = C r_k^q near the end, above what rounding leaves.
#[test]
fn newton_converges_quadratically() {
    let residuals = coarse_cook().results().residuals(5);
    let near: Vec<f64> = residuals.iter().copied().filter(|r| *r > 1e-11).collect();
    let [.., a, b, c] = near[..] else { panic!("{residuals:?}") };
    let order = (c / b).ln() / (b / a).ln();
    assert!(order > 1.9, "order {order} of {residuals:?}");
}

/// The bounds in the header of inputs/clay-slope.toml: what the weight can press is not exceeded.
#[test]
fn pressures_of_an_undrained_slope_are_those_of_its_weight() {
    let weight = 1835.0 * 9.81 * 10.0;
    let extremes = |results: &Results| {
        let points = results.points(5);
        let pressure = points.field("pressure");
        pressure.iter().fold((0.0f64, 0.0f64), |(l, h), p| (l.min(*p), h.max(*p)))
    };
    for basis in ["mpm", "gimp", "cpdi1"] {
        let free = Run::of("clay-slope").set(format!("method.basis=\"{basis}\"")).results();
        let (low, high) = extremes(&free);
        let bounds = -0.3 * weight..weight;
        assert!(bounds.contains(&low) && bounds.contains(&high), "{basis}: {low:e} to {high:e} Pa");
    }
    let locked = Run::of("clay-slope").set("method.locking=\"none\"").results();
    let (low, high) = extremes(&locked);
    assert!(high > 1.5 * weight || low < -weight, "from {low:e} to {high:e} Pa");
}

/// A run that locks is told which key helps, once; one with it is not.
#[test]
fn runs_that_lock_are_warned() {
    let quick = || {
        Run::of("cook")
            .set("grid.h=8.0")
            .set("grid.size=[56.0, 80.0]")
            .set("analysis.steps=1")
            .word("--check")
    };
    for (set, warned) in [("method.locking=\"none\"", true), ("method.locking=\"f-bar\"", false)] {
        let said = quick().set(set).attempt();
        let text = format!("{}{}", said.stdout, said.stderr);
        assert_eq!(text.contains("locking = \"f-bar\""), warned, "{text}");
    }
    let mild = quick().set("method.locking=\"none\"").set("material.rubber.poisson=0.3").attempt();
    assert!(!mild.stdout.contains("f-bar"), "{}", mild.stdout);
}

/// Cells of a mesh are no boxes: domains with corners have no means over them.
#[test]
fn cpdi_on_a_mesh_is_refused_by_the_names_of_what_works() {
    let mesh = "grid={ type = \"mesh\", generate = { box = { min = [0.0, 0.0], max = [54.0, 76.0], cells = [27, 38] } } }";
    for basis in ["cpdi1", "cpdi2"] {
        let run = Run::of("cook").set(format!("method.basis=\"{basis}\"")).set(mesh);
        let run = run.set("boundary.0.where={ tag = \"left\" }");
        let outcome = run.attempt();
        assert_eq!(outcome.code, 2, "{}", outcome.stderr);
        for word in ["locking", "\"mpm\"", "lattice", basis] {
            assert!(outcome.stderr.contains(word), "{}", outcome.stderr);
        }
    }
}

/// Cook's membrane with domains that have corners: as `gimp`, whose means these are where domains are not
/// turned; and on three ranks.
#[test]
fn cpdi_does_not_lock() {
    let cook = |basis: &str| Run::of("cook").set(format!("method.basis=\"{basis}\""));
    let places = [([48.0, 60.0], 6.92), ([48.0, 52.0], 6.95)];
    let upright = cook("gimp").results();
    for basis in ["cpdi1", "cpdi2"] {
        let free = cook(basis).results();
        for (place, wanted) in places {
            let [of_gimp, found] = [&upright, &free].map(|r| displacement_near(r, 10, place, 1));
            assert!((found / wanted - 1.0).abs() < 0.02, "{basis}, {place:?}: {found}");
            assert!((found / of_gimp - 1.0).abs() < 2e-3, "{basis}, {place:?}: {found}, {of_gimp}");
        }
        let many = cook(basis).ranks(3).set("parallel.brick=1").results();
        let (a, b) = (free.points(10), many.points(10));
        let off = relative_difference(a.field("displacement"), b.field("displacement"));
        assert!(off < 1e-6, "{basis}: {off:e} on three ranks");
    }
}

/// Explicit steps of the three stress updates run with F-bar, and to another, softer answer.
#[test]
fn explicit_steps_take_f_bar() {
    for (update, basis) in [("usf", "mpm"), ("usl", "mpm"), ("musl", "mpm"), ("usf", "cpdi1")] {
        let run = Run::of("cook")
            .set(format!("method.basis=\"{basis}\""))
            .set("grid.h=4.0")
            .set("grid.size=[56.0, 80.0]")
            .set("analysis={type=\"explicit\", duration=2.5, cfl=0.3}")
            .set(format!("method.stress_update=\"{update}\""))
            .set("body.0.density=1.0")
            .set("material.rubber.poisson=0.49")
            .set("output.every=100000");
        let free = run.clone().results();
        let locked = run.set("method.locking=\"none\"").results();
        let stored = |results: &Results| *results.history("energy_strain").last().expect("rows");
        let work = |results: &Results| *results.history("work_external").last().expect("rows");
        assert!(stored(&free) > 0.0, "{update}");
        let (free, locked) = (work(&free), work(&locked));
        assert!(free > locked * (1.0 + 1e-6), "{update}: the load's work {free:e}, {locked:e}");
    }
}
