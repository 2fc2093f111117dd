//! Momentum, angular momentum and energy (Ghost §5.2, 5.3).

use super::ghosts::{collision, contact};
use crate::common::run::{Results, Run};

/// Mass of both ghosts, kg/m; their speed, m/s; size of the unit square, m.
const MASS: f64 = 214.726;
const SPEED: f64 = 0.1414;

/// Largest change of a column over the run.
fn drift(run: &Results, column: &str) -> f64 {
    let values = run.history(column);
    values.iter().map(|v| (v - values[0]).abs()).fold(0.0, f64::max)
}

#[test]
fn linear_momentum_is_kept_by_all_methods() {
    for update in ["usf", "usl", "musl"] {
        for mass in ["consistent", "lumped"] {
            let run = contact(100)
                .set(format!("method.stress_update=\"{update}\""))
                .set(format!("method.mass=\"{mass}\""))
                .results();
            for axis in ["momentum_x", "momentum_y"] {
                let change = drift(&run, axis) / (MASS * SPEED);
                assert!(change < 1e-12, "{update}, {mass}: {axis} {change:e}");
            }
        }
    }
}

#[test]
fn angular_momentum_is_kept_through_contact_by_the_stabilised_mass_and_pic() {
    let run = contact(150)
        .set("method.stress_update=\"usl\"")
        .set("method.velocity_update=\"pic\"")
        .results();
    assert!(run.history("energy_strain").last() > Some(&1e-3), "there was contact");
    let change = drift(&run, "angular_momentum_z") / (MASS * SPEED);
    assert!(change < 1e-12, "{change:e}");
}

/// Without the Ghost share flip keeps it too, and so does the lumped mass not.
#[test]
fn angular_momentum_is_kept_through_contact_by_the_consistent_mass_and_flip() {
    let blocks = |mass: &str| Run::text(&BLOCKS.replace("MASS", mass)).results();
    let size = 2.0 * 10.0 * 4.0;
    let run = blocks("consistent");
    assert!(run.history("energy_strain").last() > Some(&1e-4), "there was contact");
    let change = drift(&run, "angular_momentum_z") / size;
    assert!(change < 1e-12, "{change:e}");
    let lumped = drift(&blocks("lumped"), "angular_momentum_z") / size;
    assert!(lumped > 1e-6, "{lumped:e}");
}

/// Two blocks in neighbouring cells that shear past each other, well inside their cells.
const BLOCKS: &str = r#"
title = "Blocks"
[analysis]
type = "explicit"
steps = 60
duration = 0.03
[method]
basis = "mpm"
mass = "MASS"
stress_update = "usl"
[grid]
type = "lattice"
size = [8, 8]
h = 1.0
[material.soft]
model = "hencky"
young = 1000
poisson = 0.3
[[body]]
name = "left"
material = "soft"
density = 10
shape = { box = { min = [2, 2], max = [4, 4] } }
points_per_cell = [4, 4]
velocity = ["0.5 + 0.2*Y", "0.5 - 0.1*X"]
[[body]]
name = "right"
material = "soft"
density = 10
shape = { box = { min = [4, 3], max = [6, 5] } }
points_per_cell = [4, 4]
velocity = ["-1 + 0.1*Y", "-0.5"]
[output]
every = 1000
"#;

#[test]
fn everything_is_kept_in_free_flight() {
    for mass in ["consistent", "lumped"] {
        let run = collision()
            .set("analysis.steps=100")
            .set("analysis.duration=0.35")
            .set(format!("method.mass=\"{mass}\""))
            .results();
        for (column, size) in [
            ("momentum_x", MASS * SPEED),
            ("angular_momentum_z", MASS * SPEED),
            ("energy_kinetic", 2.14726),
        ] {
            let change = drift(&run, column) / size;
            assert!(change < 1e-12, "{mass}: {column} {change:e}");
        }
        assert!((run.history("energy_kinetic")[0] - 2.14726).abs() < 5e-6);
    }
}

#[test]
fn the_ledger_closes_under_gravity_and_a_driven_boundary() {
    // A block falls freely: the work of gravity is its kinetic energy.
    let fall =
        Run::text(&DRIVEN.replace("BOUNDARY", "").replace("LOAD", "[[load]]\ngravity = [0, -10]"))
            .results();
    let last = |run: &Results, name: &str| *run.history(name).last().unwrap();
    let (work, kinetic) = (last(&fall, "work_external"), last(&fall, "energy_kinetic"));
    // 20 kg/m at (0.2 s * 10 m/s2)^2 / 2.
    assert!((kinetic - 40.0).abs() < 1e-9, "{kinetic}");
    assert!((work / kinetic - 1.0).abs() < 0.01, "{work} {kinetic}");
    assert!((last(&fall, "momentum_y") + 40.0).abs() < 1e-9);

    // One side is pulled away, the other held: what the boundary puts in is stored.
    let boundary = r#"
[[boundary]]
name = "wall"
where = { side = "left" }
fix = ["x"]
[[boundary]]
name = "puller"
where = { box = { min = [2, 0], max = [2, 3] } }
displacement = { x = "0.02*t/0.2" }
"#;
    let pull = Run::text(
        &DRIVEN
            .replace("BOUNDARY", boundary)
            .replace("LOAD", "")
            .replace("min = [1, 1]", "min = [0, 1]")
            .replace("max = [3, 2]", "max = [2, 2]"),
    )
    .results();
    let stored = last(&pull, "energy_kinetic") + last(&pull, "energy_strain");
    let work = last(&pull, "work_external");
    assert!(stored > 0.1 && (work / stored - 1.0).abs() < 0.02, "{work} {stored}");
    assert!(last(&pull, "reaction.puller.x") > 0.0 && last(&pull, "reaction.wall.x") < 0.0);
}

const DRIVEN: &str = r#"
title = "Driven"
[analysis]
type = "explicit"
steps = 2000
duration = 0.2
[method]
basis = "gimp"
domain_update = "stretch"
[ghost]
mass_factor = 0.25
[grid]
type = "lattice"
origin = [0, -1]
size = [4, 4]
h = 0.5
[material.soft]
model = "hencky"
young = 1000
poisson = 0.0
[[body]]
name = "block"
material = "soft"
density = 10
shape = { box = { min = [1, 1], max = [3, 2] } }
BOUNDARY
LOAD
[output]
every = 10000
"#;

#[test]
fn figure_14_dissipation_begins_at_contact_and_the_ledger_closes() {
    let run = Run::of("ghost-collision-plastic").set("output.every=100000").results();
    let time = run.history("time");
    let column = |name: &str| run.history(name);
    let (kinetic, strain, plastic) =
        (column("energy_kinetic"), column("energy_strain"), column("energy_plastic"));
    let start = 2.14726;
    for k in 0..time.len() {
        let total = kinetic[k] + strain[k] + plastic[k];
        assert!((total / start - 1.0).abs() < 0.01, "t = {}: {total}", time[k]);
    }
    let at = |t: f64| time.iter().position(|time| *time >= t).unwrap();
    assert!(plastic[at(1.2)] < 1e-12, "nothing flows before contact");
    assert!(plastic[at(2.5)] > 0.1 * start, "{}", plastic[at(2.5)]);
    let begins = time[plastic.iter().position(|p| *p > 1e-4 * start).unwrap()];
    assert!((1.3..1.7).contains(&begins), "{begins}");
    assert!(plastic.windows(2).all(|pair| pair[1] >= pair[0] * (1.0 - 1e-12)));
    assert!(*strain.last().unwrap() > 1e-3, "strain energy stays trapped");
}
