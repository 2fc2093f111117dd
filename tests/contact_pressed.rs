//! Contact of two deformable bodies in implicit runs: Hertz, tangent, what is kept, ranks, restart.

mod common;
#[path = "common/program.rs"]
mod program;

use std::path::Path;

use common::on_ranks;
use common::product::product;
use common::run::{Results, Run, last, probed, relative_difference};
use mpi::environment::Universe;
use mpi::traits::*;
use mpm_par::deck;
use mpm_par::parallel::World;
use mpm_par::run::setup;
use mpm_par::system::scatter::BlockMatrix;
use mpm_par::system::step_system::Discretisation;
use mpm_par::system::terms::facing::FacingTerm;
use mpm_par::system::terms::term::{At, Part};

/// Halves of two equal cylinders (axisymmetric: balls) of radius 2, of which the upper one is driven.
fn round(h: f64) -> String {
    format!(
        r#"
[analysis]
type = "quasi-static"
steps = 3
max_iterations = 25
[method]
basis = "gimp"
domain_update = "stretch"
[grid]
type = "lattice"
origin = [0.0, -1.05]
size = [1.05, 2.1]
h = {h}
[material.rubber]
model = "hencky"
young = 1e6
poisson = 0.3
[[body]]
name = "low"
material = "rubber"
shape.intersection = [
  {{ disc = {{ centre = [0, -2], radius = 2 }} }},
  {{ box = {{ min = [0, -1.05], max = [1.05, 0] }} }},
]
[[body]]
name = "high"
material = "rubber"
shape.intersection = [
  {{ disc = {{ centre = [0, 2], radius = 2 }} }},
  {{ box = {{ min = [0, 0], max = [1.05, 1.05] }} }},
]
[[boundary]]
name = "base"
where = {{ side = "bottom" }}
fix = ["x", "y"]
[[boundary]]
name = "symmetry"
where = {{ side = "left" }}
fix = ["x"]
[[boundary]]
name = "top"
where = {{ box = {{ min = [0, 0.99], max = [1.05, 1.05] }} }}
fix = ["x"]
displacement = {{ y = -0.025 }}
[[contact]]
between = ["low", "high"]
[[probe]]
name = "low"
near = [0, -0.001]
fields = ["stress"]
[[probe]]
name = "high"
near = [0, 0.001]
fields = ["stress"]
"#
    )
}

/// Two equal cylinders: 1/R = 1/2 + 1/2, E* = E / (2 (1 - nu^2)), a = sqrt(4 F R / (pi E*)),
/// p_max = 2 F / (pi a). The half width is counted in elements, each 5 % of it.
#[test]
fn two_cylinders_press_as_hertz_says() {
    let results = Run::text(&round(0.015)).results();
    let force = 2.0 * last(&results, "contact.low-high.y");
    let pi = std::f64::consts::PI;
    let width = (4.0 * force / (pi * 1e6 / 1.82)).sqrt();
    let peak = 2.0 * force / (pi * width);
    let found = last(&results, "contact.low-high.area");
    assert!((found / width - 1.0).abs() < 0.05, "half width {found}, Hertz {width}");
    for side in ["low", "high"] {
        let found = -probed(&results, &format!("{side}.stress.yy"));
        assert!((found / peak - 1.0).abs() < 0.03, "{side}: p_max {found}, Hertz {peak}");
    }
    // Action is reaction, and both are those of the boundaries.
    for name in ["reaction.base.y", "reaction.top.y"] {
        let reaction = 2.0 * last(&results, name).abs();
        assert!((reaction / force - 1.0).abs() < 1e-9, "{name}: {reaction} {force}");
    }
    require_newtons_order(&results);
}

/// Two equal balls, in axisymmetry: a^3 = 3 F R / (4 E*), p_max = 3 F / (2 pi a^2).
#[test]
fn two_balls_press_as_hertz_says() {
    let text = round(0.021).replace("steps = 3", "steps = 3\nsymmetry = \"axisymmetric\"");
    let (start, end) = (
        text.find("[[boundary]]\nname = \"symmetry\"").unwrap(),
        text.find("[[boundary]]\nname = \"top\"").unwrap(),
    );
    let results = Run::text(&format!("{}{}", &text[..start], &text[end..])).results();
    let force = last(&results, "contact.low-high.y");
    let pi = std::f64::consts::PI;
    let radius = (0.75 * force / (1e6 / 1.82)).cbrt();
    let peak = 1.5 * force / (pi * radius * radius);
    let found = (last(&results, "contact.low-high.area") / pi).sqrt();
    assert!((found / radius - 1.0).abs() < 0.03, "radius {found}, Hertz {radius}");
    let pressed = -probed(&results, "low.stress.yy");
    assert!((pressed / peak - 1.0).abs() < 0.03, "p_max {pressed}, Hertz {peak}");
    let reaction = last(&results, "reaction.base.y");
    assert!((reaction / force - 1.0).abs() < 1e-9, "{reaction} {force}");
}

/// In each step the last residuals above round-off, once the elements that touch stay: the error is at
/// least raised to the power 1.8.
fn require_newtons_order(results: &Results) {
    let text = results.text("residuals.csv");
    let mut steps: Vec<Vec<f64>> = Vec::new();
    for row in text.lines().skip(1) {
        let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().expect("a number")).collect();
        if cells[1] == 0.0 || steps.is_empty() {
            steps.push(Vec::new());
        }
        steps.last_mut().expect("a step").push(cells[2]);
    }
    for errors in steps {
        let [.., before, end] = errors[..] else { panic!("{errors:?}") };
        // Above 1e-6 the order can be seen before round-off ends it at about 1e-13.
        let order = end.max(1e-13).ln() / before.ln();
        assert!(order > 1.8 || before < 1e-6, "order {order}: {errors:?}");
    }
}

/// A soft block under a hard one, joined nowhere on a grid line: the springs L / E of both and that of
/// the penalty, h / (f E), bear one pressure (small strains), which both bodies have everywhere.
#[test]
fn blocks_of_two_materials_bear_one_pressure() {
    let text = r#"
[analysis]
type = "quasi-static"
steps = 1
[method]
basis = "gimp"
[grid]
type = "lattice"
size = [1.0, 2.5]
h = 0.25
[material.rubber]
model = "hencky"
young = 1e6
poisson = 0.0
[material.hard]
model = "hencky"
young = 4e6
poisson = 0.0
[[body]]
name = "low"
material = "rubber"
shape = { box = { min = [0, 0], max = [1.0, 1.1] } }
[[body]]
name = "high"
material = "hard"
shape = { box = { min = [0, 1.1], max = [1.0, 2.0] } }
[[boundary]]
name = "base"
where = { side = "bottom" }
fix = ["y"]
[[boundary]]
name = "left"
where = { side = "left" }
fix = ["x"]
[[boundary]]
name = "top"
where = { box = { min = [0, 2.0], max = [1.0, 2.0] } }
displacement = { y = -1e-4 }
[[contact]]
between = ["low", "high"]
[output]
fields = ["stress", "contact_force"]
"#;
    let results = Run::text(text).results();
    let pressure = 1e-4 / (1.1 / 1e6 + 0.9 / 4e6 + 0.25 / (10.0 * 1e6));
    let force = last(&results, "contact.low-high.y");
    assert!((force / pressure - 1.0).abs() < 2e-3, "{force} {pressure}");
    let points = results.points(1);
    for stress in points.component("stress", 3) {
        assert!((-stress / pressure - 1.0).abs() < 0.02, "{stress} {pressure}");
    }
    // What the points of either body are told is the force as their own elements see it.
    let told = points.component("contact_force", 1);
    let (up, down): (f64, f64) =
        (told.iter().filter(|f| **f > 0.0).sum(), told.iter().filter(|f| **f < 0.0).sum());
    assert!((up / force - 1.0).abs() < 1e-3 && (down / force + 1.0).abs() < 1e-3, "{up} {down}");
}

/// Discs bounce off each other in implicit steps as either does off a smooth wall in the middle; momenta
/// are kept to round-off.
#[test]
fn discs_bounce_in_implicit_steps() {
    let text = std::fs::read_to_string(common::run::input("two-discs")).expect("a deck");
    let text = text
        .replace("type = \"explicit\"", "type = \"implicit-dynamic\"")
        .replace("cfl = 0.4", "steps = 80")
        .replace("mass = \"lumped\"\n", "");
    let results = Run::text(&text).results();
    let size = 1000.0 * 0.04 * std::f64::consts::PI;
    for column in ["momentum_x", "momentum_y", "angular_momentum_z"] {
        let most = results.history(column).iter().fold(0.0f64, |m, p| m.max(p.abs()));
        assert!(most < 1e-11 * size, "{column}: {most:e}");
    }
    let energy = |row: usize| -> f64 {
        let parts = ["energy_kinetic", "energy_strain", "energy_contact"];
        parts.iter().map(|name| results.history(name)[row]).sum()
    };
    let ratio = energy(results.history("dt").len() - 1) / energy(0);
    assert!((0.98..1.001).contains(&ratio), "{ratio}");
    let impulse = |results: &Results, column: &str| -> f64 {
        let steps = results.history("dt");
        results.history(column).iter().zip(&steps).map(|(force, dt)| force * dt).sum()
    };
    let push = impulse(&results, "contact.left-right.x");
    let (start, end) =
        (text.find("[[body]]\nname = \"right\"").unwrap(), text.find("[[contact]]").unwrap());
    let plane = "[[rigid]]\nname = \"wall\"\n\
                 shape = { half_space = { point = [0, 0], normal = [-1, 0] } }\n\n";
    let wall = format!("{}{plane}{}", &text[..start], text[end..].replace("right", "wall"));
    let off_wall = -impulse(&Run::text(&wall).results(), "reaction.wall.x");
    assert!((push / off_wall - 1.0).abs() < 0.02, "{push} {off_wall}");
}

/// Coulomb's law: as soon as all of the surface slips, the shear is mu N; before, with a rough surface, it is
/// that of one body on one grid.
#[test]
fn pushed_blocks_stick_and_slip() {
    let run = Run::of("pushed-blocks");
    let results = run.results();
    let (shear, down) =
        (-last(&results, "contact.low-high.x"), last(&results, "contact.low-high.y"));
    assert!(down > 0.0 && (shear / down / 0.3 - 1.0).abs() < 1e-3, "{shear} {down}");
    for (name, force) in [("reaction.base.x", -shear), ("reaction.base.y", down)] {
        let reaction = last(&results, name);
        assert!((reaction / force - 1.0).abs() < 1e-8, "{name}: {reaction} {force}");
    }
    // What friction takes is the shear times the way that was slid, up to what slid before all of it did.
    let (lost, slid) =
        (last(&results, "dissipation_friction"), last(&results, "contact.low-high.slip"));
    assert!((lost / (shear * slid) - 1.0).abs() < 0.05, "{lost} {shear} {slid}");
    let pushed = |run: Run| last(&run.results(), "reaction.base.x");
    let rough = run.set("contact.0.friction=\"rough\"").set("contact.0.penalty=100");
    let text = std::fs::read_to_string(common::run::input("pushed-blocks")).expect("a deck");
    let joined = Run::text(&text[..text.find("[[contact]]").expect("a contact")]);
    let (rough, joined) = (pushed(rough), pushed(joined));
    assert!((rough / joined - 1.0).abs() < 0.02, "{rough} {joined}");
}

/// The deck of explicit runs in implicit steps: the block comes as far as Coulomb's law says.
#[test]
fn a_block_slides_down_in_implicit_steps() {
    let text = std::fs::read_to_string(common::run::input("sliding-block")).expect("a deck");
    let text = text
        .replace("type = \"explicit\"", "type = \"implicit-dynamic\"\nhht_alpha = -0.1")
        .replace("cfl = 0.5", "steps = 50")
        .replace("mass = \"lumped\"\n", "")
        .replace("velocity_update = 0.95 ", "#");
    let slid = Run::text(&text).results().verify("slid");
    assert!(slid < 0.01, "{slid}");
}

/// Rank boundaries go through the bodies that touch, and a restart repeats the run bit by bit.
#[test]
fn ranks_agree_and_a_restart_is_bitwise() {
    let keeping = "[output]\ncheckpoint = { every = 1, keep = 20 }\n[[contact]]";
    let rubbing = std::fs::read_to_string(common::run::input("pushed-blocks")).expect("a deck");
    for (text, columns, middle) in [
        (round(0.05), &["contact.low-high.y", "contact.low-high.area"][..], 2),
        (rubbing, &["contact.low-high.y", "contact.low-high.x", "dissipation_friction"], 6),
    ] {
        let text = text.replace("[[contact]]", keeping);
        ranks_agree(&text, columns);
        restart_is_bitwise(&text, middle);
    }
}

fn ranks_agree(text: &str, columns: &[&str]) {
    let run = Run::text(text).set("parallel.brick=1");
    let one = run.results();
    for ranks in [2, 3] {
        let more = run.clone().ranks(ranks).results();
        for column in columns.iter().copied().chain(["energy_contact", "energy_strain"]) {
            let wrong = relative_difference(&more.history(column), &one.history(column));
            assert!(wrong < 1e-8, "{ranks} ranks, {column}: {wrong:e}");
        }
    }
}

fn restart_is_bitwise(text: &str, middle: usize) {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let deck = folder.path().join("deck.toml");
    std::fs::write(&deck, text).expect("a deck");
    for ranks in [1, 2] {
        let at = |name: &str| folder.path().join(format!("{name}-{ranks}"));
        program::run_well(ranks, &deck, &at("whole"), &[]);
        let from = at("whole").join(format!("checkpoint-{middle:06}.h5")).display().to_string();
        program::run_well(ranks, &deck, &at("part"), &["--restart", &from]);
        assert_eq!(program::history(&at("part"))[..], program::history(&at("whole"))[middle..]);
    }
}

fn tangents(universe: &Universe) {
    let world = World::new(universe.world().duplicate());
    for friction in ["0.0", "0.05", "0.4", "\"rough\""] {
        for basis in ["gimp", "mpm", "cpdi2"] {
            tangent::<2>(&world, basis, friction);
        }
        tangent::<3>(&world, "gimp", friction);
    }
}

/// The tangent times a direction is the central difference of the force, and the forces on both bodies
/// are opposite, in sum and in moment.
fn tangent<const D: usize>(world: &World, basis: &str, friction: &str) {
    let list = |value: f64| format!("{:?}", vec![value; D]);
    let (mut top, mut bottom) = (vec![2.9; D], vec![0.4; D]);
    (top[D - 1], bottom[D - 1]) = (1.4, 1.4);
    let text = format!(
        "[analysis]\ntype = \"quasi-static\"\nsteps = 1\n[method]\nbasis = \"{basis}\"\n\
         [grid]\ntype = \"lattice\"\norigin = {}\nsize = {}\nh = 1.0\n\
         [material.m]\nmodel = \"hencky\"\nyoung = 1e6\npoisson = 0.3\n\
         [[body]]\nname = \"a\"\nmaterial = \"m\"\nshape = {{ box = {{ min = {}, max = {top:?} }} }}\n\
         [[body]]\nname = \"b\"\nmaterial = \"m\"\nshape = {{ box = {{ min = {bottom:?}, max = {} }} }}\n\
         [[contact]]\nbetween = [\"a\", \"b\"]\nfriction = {friction}\n",
        list(-1.0),
        list(5.0),
        list(0.2),
        list(2.7),
    );
    let deck = deck::read(Path::new("blocks.toml"), &text, &[]).expect("a deck");
    let (model, points) = setup::prepare::<D>(world, deck).expect("a model");
    let mesh = Discretisation::new(world, &model, &points).expect("a grid side");
    let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);
    let count = numbering.len() * D;
    let v: Vec<f64> = (0..count).map(|i| (1.1 + 1.7 * i as f64).sin()).collect();
    let at = |size: f64| -> Vec<f64> {
        let of = |i: usize| {
            let field = numbering.fields.of_node(numbering.key(i / D));
            // Body a upwards into b.
            let into = if i % D == D - 1 && field == 0 { 0.1 } else { 0.0 };
            into + 0.02 * (0.3 + 1.7 * i as f64).sin() + size * v[i]
        };
        (0..count).map(of).collect()
    };
    let term = FacingTerm::new(&model, &mesh, &points).expect("bodies that face each other");
    let force = |u: &[f64], mut matrix: Option<&mut BlockMatrix<D>>| {
        let mut force = vec![0.0; count];
        for part in [Part::Reaching, Part::Inner] {
            term.add(part, At { pattern, displacement: u }, &mut force, matrix.as_deref_mut());
        }
        force
    };
    let mut matrix = BlockMatrix::<D>::zeros(pattern);
    let now = force(&at(0.0), Some(&mut matrix));
    let size = now.iter().map(|f| f.abs()).sum::<f64>();
    assert!(size > 0.0, "{basis}: nothing touches");
    let mut sums = [0.0; 6];
    for (node, f) in now.chunks_exact(D).enumerate() {
        let x = model.grid.node_position(numbering.nodes[node]);
        for i in 0..D {
            let j = (i + 1) % D;
            sums[i] += f[i];
            sums[3 + i] += x[i] * f[j] - x[j] * f[i];
        }
    }
    assert!(
        sums.iter().all(|sum| sum.abs() < 1e-12 * size),
        "{D}D {basis}, friction {friction}: {sums:?} of {size}"
    );
    let along = product(pattern, &matrix, &v);
    let (more, less) = (force(&at(1e-7), None), force(&at(-1e-7), None));
    let size = along.iter().fold(0.0f64, |m, k| m.max(k.abs()));
    for dof in 0..count {
        let error = ((more[dof] - less[dof]) / 2e-7 - along[dof]).abs() / size;
        assert!(error < 1e-6, "{D}D {basis}, friction {friction}: {error:e}");
    }
}

#[test]
fn the_tangent_of_two_bodies_is_that_of_their_forces() {
    on_ranks("the_tangent_of_two_bodies_is_that_of_their_forces", &[1], tangents);
}

#[test]
fn what_two_bodies_cannot_do_in_implicit_runs_is_told_with_the_cure() {
    let third = "[[body]]\nname = \"third\"\nmaterial = \"rubber\"\n\
                 shape = { box = { min = [0.5, 0.7], max = [0.6, 0.8] } }\noverlap = \"allow\"\n\
                 [[contact]]";
    for (from, to, expected) in [
        ("[[contact]]", third, &["by way of \"third\"", "name it in contacts"][..]),
        (
            "{ disc = { centre = [0, 2], radius = 2 } }",
            "{ where = \"x^2 + (y-2)^2 < 4\" }",
            &["of which no surface is known"],
        ),
    ] {
        let text = round(0.05).replacen(from, to, 1);
        let outcome = Run::text(&text).attempt();
        let said = outcome.said();
        assert_eq!(outcome.code, 2, "{said}");
        assert!(expected.iter().all(|part| said.contains(part)), "{to}:\n{said}");
        assert!(!outcome.folder.path().join("out").exists(), "{to}");
    }
}

/// A block that only rests on another body is named before anything is solved: without friction it can slide, and a
/// gap lets it fall. Friction holds it.
#[test]
fn a_block_that_only_rests_on_another_body_is_named() {
    let text = |bottom: f64, friction: &str| {
        format!(
            "[analysis]\ntype = \"quasi-static\"\nsteps = 1\n[method]\nbasis = \"gimp\"\n\
             [grid]\ntype = \"lattice\"\norigin = [-0.5, -0.5]\nsize = [2.0, 2.0]\nh = 0.25\n\
             [material.m]\nmodel = \"hencky\"\nyoung = 1e6\npoisson = 0.3\n\
             [[body]]\nname = \"ground\"\nmaterial = \"m\"\ndensity = 1000.0\n\
             shape = {{ box = {{ min = [-0.25, -0.25], max = [1.25, 0.25] }} }}\n\
             [[body]]\nname = \"block\"\nmaterial = \"m\"\ndensity = 1000.0\n\
             shape = {{ box = {{ min = [0.1, {bottom}], max = [0.85, 0.8] }} }}\n\
             [[boundary]]\nname = \"base\"\n\
             where = {{ box = {{ min = [-0.25, -0.25], max = [1.25, -0.25] }} }}\n\
             fix = [\"x\", \"y\"]\n\
             [[load]]\ngravity = [0, -1]\n\
             [[contact]]\nbetween = [\"block\", \"ground\"]\nfriction = {friction}\n"
        )
    };
    for (bottom, friction, expected) in [
        (0.25, "0.0", &["body \"block\" can move along x freely", "a body that it touches"][..]),
        (0.3, "0.5", &["body \"block\" can", "freely"]),
    ] {
        let outcome = Run::text(&text(bottom, friction)).ranks(2).attempt();
        let said = outcome.said();
        assert_eq!(outcome.code, 2, "{said}");
        assert!(expected.iter().all(|part| said.contains(part)), "{bottom} {friction}:\n{said}");
        assert!(!outcome.folder.path().join("out").exists());
    }
    let results = Run::text(&text(0.25, "0.5")).results();
    let weight = 1000.0 * (1.5 * 0.5 + 0.75 * 0.55);
    let force = last(&results, "reaction.base.y");
    assert!((force / weight - 1.0).abs() < 1e-6, "{force} {weight}");
}
