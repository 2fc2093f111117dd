//! Affine transfers: a block that turns freely keeps its angular momentum.

use crate::common::run::{Results, Run};

/// Side of the block, m; its density, kg/m3; cells, m; its angular velocity, 1/s.
const SIDE: f64 = 1.0;
const DENSITY: f64 = 1000.0;
const CELL: f64 = 0.2;
const SPIN: f64 = 0.6;

/// Ten turns, oblique to the grid.
fn turning(velocity: &str) -> Run {
    Run::text(&format!(
        r#"
[analysis]
type = "explicit"
steps = 3200
duration = {duration:?}
[method]
basis = "gimp"
domain_update = "stretch"
mass = "lumped"
velocity_update = "{velocity}"
[grid]
type = "lattice"
origin = [-1.0, -1.0]
size = [2.0, 2.0]
h = {CELL}
[material.m]
model = "hencky"
young = 10000.0
poisson = 0.3
[[body]]
material = "m"
density = {DENSITY}
shape = {{ box = {{ min = [-0.5, -0.5], max = [0.5, 0.5] }}, translate = [0.013, 0.027] }}
lattice = {{ spacing = {spacing:?}, offset = [0, 0] }}
velocity = ["-{SPIN} * (Y - 0.027)", "{SPIN} * (X - 0.013)"]
[output]
every = 100000
"#,
        duration = 20.0 * std::f64::consts::PI / SPIN,
        spacing = CELL / 3.0,
    ))
}

/// First angular momentum, its largest change relative to the first, and the largest linear momentum
/// over Σ m |v|, about m L ω / 3.
fn kept(results: &Results) -> [f64; 3] {
    let spin = results.history("angular_momentum_z");
    let change = spin.iter().map(|j| (j / spin[0] - 1.0).abs()).fold(0.0, f64::max);
    let sum = ["momentum_x", "momentum_y"]
        .iter()
        .flat_map(|axis| results.history(axis))
        .map(f64::abs)
        .fold(0.0, f64::max);
    [spin[0], change, sum / (DENSITY * SIDE.powi(3) * SPIN / 3.0)]
}

/// The nodes hold the block with its mass spread by the hat functions, whose variance is h^2/6 along
/// each axis on the mean over a cell: J = m ω (L^2/6 + h^2/3). FLIP, whose points hold it at their
/// places, loses far more than a third of it.
#[test]
fn a_turning_block_keeps_its_angular_momentum() {
    let mass = DENSITY * SIDE * SIDE;
    let exact = mass * SPIN * (SIDE * SIDE / 6.0 + CELL * CELL / 3.0);
    for update in ["musl", "usl"] {
        let run = turning("apic").set(format!("method.stress_update=\"{update}\""));
        let results = run.results();
        let [spin, change, sum] = kept(&results);
        assert!((spin / exact - 1.0).abs() < 1e-11, "{update}: {spin} for {exact}");
        assert!(change < 1e-10 && sum < 1e-11, "{update}: {change:e} {sum:e}");
        let energy = results.history("energy_kinetic");
        let lost = 1.0 - energy.last().expect("steps") / energy[0];
        assert!(lost.abs() < 0.02, "{update}: {lost}");
    }
    // D goes up and down, but not for good.
    let [spin, change, sum] = kept(&turning("tpic").results());
    assert!((spin / exact - 1.0).abs() < 1e-2, "tpic: {spin} for {exact}");
    assert!(change < 1e-2 && sum < 1e-11, "tpic: {change:e} {sum:e}");
    let [_, change, _] = kept(&turning("flip").results());
    assert!(change > 0.1, "flip: {change}");
}

#[test]
fn on_any_number_of_ranks() {
    let end = |ranks: usize| {
        let run =
            turning("apic").set("analysis.steps=160").set("analysis.duration=5.2").ranks(ranks);
        let results = run.results();
        let last = |column: &str| *results.history(column).last().expect("steps");
        ["energy_kinetic", "energy_strain", "angular_momentum_z"].map(last)
    };
    let one = end(1);
    for ranks in [2, 3] {
        for (a, b) in one.iter().zip(end(ranks)) {
            assert!((a / b - 1.0).abs() < 1e-9, "{ranks} ranks: {a} {b}");
        }
    }
}

/// What the held nodes take and give is the impulse of the reactions.
#[test]
fn reactions_hold_the_change_of_momentum() {
    let run = turning("apic")
        .set("analysis.steps=60")
        .set("analysis.duration=1.0")
        .set("body.0.shape.translate=[-0.5, 0.027]")
        .set("boundary=[{ name = \"wall\", where = { side = \"left\" }, fix = [\"x\", \"y\"] }]")
        .set("body.0.velocity=[-0.5, 0.1]");
    let results = run.results();
    let dt = results.history("dt");
    for axis in ["x", "y"] {
        let momentum = results.history(&format!("momentum_{axis}"));
        let reaction = results.history(&format!("reaction.wall.{axis}"));
        let scale = momentum.iter().map(|p| p.abs()).fold(0.0, f64::max);
        for step in 1..momentum.len() {
            let missing = momentum[step] - momentum[step - 1] - dt[step] * reaction[step];
            assert!(missing.abs() < 1e-11 * scale, "{axis}, step {step}: {missing:e} of {scale:e}");
        }
    }
}
