//! Momentum, angular momentum and energy.

use super::blocks::blocks;
use super::ghosts::{collision, contact};
use crate::common::at_once::at_once;
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

/// Two bodies that turn, oblique to the grid, and graze each other; with `AWAY` they fly and
/// swing alone. [`Tumble::run`] fills in the words with an @.
const TUMBLE: &str = r#"
title = "Tumbling bodies"
[analysis]
type = "explicit"
steps = @steps
duration = @duration
[method]
basis = "@basis"
@domains
mass = "consistent"
stress_update = "@update"
velocity_update = @share
[ghost]
mass_factor = 0.25
[grid]
type = "lattice"
origin = @origin
size = @size
h = 1.0
[material.soft]
model = "hencky"
young = 1000
poisson = 0.3
[[body]]
name = "left"
material = "soft"
density = 10
shape = { @shape = { centre = @left, radius = 1.43 } }
lattice = @lattice
velocity = @turning
[[body]]
name = "right"
material = "soft"
density = 10
shape = { @shape = { centre = @right, radius = 1.21 } }
lattice = @lattice
velocity = @coming
[output]
every = 100000
fields = ["velocity", "body"]
"#;

/// One way to compute the tumbling bodies.
#[derive(Clone, Copy)]
struct Tumble {
    dimension: usize,
    basis: &'static str,
    update: &'static str,
    velocity: &'static str,
    /// The bodies meet at once; else they stay apart.
    contact: bool,
}

impl Tumble {
    fn run(self) -> Run {
        let plane = self.dimension == 2;
        let choose = |two: &str, three: &str| if plane { two } else { three }.to_string();
        let domains = if self.basis == "gimp" { "domain_update = \"stretch\"" } else { "" };
        let gap = if self.contact { 2.5 } else { 5.7 };
        let words = [
            ("@steps", choose("60", "20")),
            ("@duration", choose("0.12", "0.04")),
            ("@basis", self.basis.into()),
            ("@domains", domains.into()),
            ("@share", self.velocity.into()),
            ("@update", self.update.into()),
            ("@origin", choose("[-4, -4]", "[-4, -4, -4]")),
            ("@size", choose("[12, 8]", "[12, 8, 8]")),
            ("@shape", choose("disc", "ball")),
            ("@left", choose("[-0.13, 0.21]", "[-0.13, 0.21, 0.17]")),
            ("@right", format!("[{gap:?}, 0.87{}]", choose("", ", -0.38"))),
            // Points of equal mass, so that a body's mean velocity is that of its points.
            (
                "@lattice",
                choose(
                    "{ spacing = 0.3333333333333333, offset = [0.16666666666666666, 0.16666666666666666] }",
                    "{ spacing = 0.5, offset = [0.25, 0.25, 0.25] }",
                ),
            ),
            (
                "@turning",
                choose(
                    r#"["2 - 3*Y + X", "1 + 3*X - 0.5*Y + 0.3*X*Y"]"#,
                    r#"["2 - 3*Y + X", "1 + 3*X - 0.5*Y + 0.3*X*Y", "X - 0.7*Z*Y"]"#,
                ),
            ),
            (
                "@coming",
                choose(r#"["-3 + 2*Y", "0.5 - X"]"#, r#"["-3 + 2*Y", "0.5 - X + Z", "0.4 + Y*Y"]"#),
            ),
        ];
        let fill = |text: String, (key, value): &(&str, String)| text.replace(key, value);
        Run::text(&words.iter().fold(TUMBLE.to_string(), fill))
    }

    /// Largest drift of linear and angular momentum relative to Σ m |v| and Σ m |x| |v|, both
    /// at the start.
    fn drifts(self, results: &Results) -> (f64, f64) {
        let points = results.points(0);
        let (x, v) = (points.field("position"), points.field("velocity"));
        let length = |row: &[f64]| row.iter().map(|c| c * c).sum::<f64>().sqrt();
        let count = points.id.len();
        let width = |field: &[f64]| field.len() / count;
        let (wx, wv) = (width(x), width(v));
        let mass = (results.number("bodies.left.mass") + results.number("bodies.right.mass"))
            / count as f64;
        let (mut sum, mut moment) = (0.0, 0.0);
        for (x, v) in x.chunks_exact(wx).zip(v.chunks_exact(wv)) {
            sum += mass * length(v);
            moment += mass * length(x) * length(v);
        }
        let largest = |kind: &str| {
            ["x", "y", "z"]
                .map(|a| drift(results, &format!("{kind}_{a}")))
                .into_iter()
                .fold(0.0, f64::max)
        };
        (largest("momentum") / sum, largest("angular_momentum") / moment)
    }

    /// Change of the mean velocity of the first body along x, m/s.
    fn gained(self, results: &Results) -> f64 {
        let mean = |step: usize| {
            let points = results.points(step);
            let (velocity, body) = (points.component("velocity", 0), points.field("body"));
            let own = || velocity.iter().zip(body).filter(|(_, body)| **body == 0.0);
            own().map(|(v, _)| v).sum::<f64>() / own().count() as f64
        };
        (mean(results.count("steps_completed")) - mean(0)).abs()
    }

    #[track_caller]
    fn keeps_both(self, ranks: usize) {
        let results = self.run().ranks(ranks).results();
        let (linear, angular) = self.drifts(&results);
        let Tumble { dimension, basis, update, velocity, contact } = self;
        let what =
            format!("{dimension}D {basis} {update} {velocity} contact {contact} {ranks} ranks");
        let gained = self.gained(&results);
        assert!(if contact { gained > 0.02 } else { gained < 1e-12 }, "{what}: pushed {gained:e}");
        assert!(linear < 1e-12, "{what}: momentum {linear:e}");
        assert!(angular < 1e-12, "{what}: angular momentum {angular:e}");
    }
}

/// Nothing of the scheme is free to leak: every order of the stress update, every mix of FLIP
/// and PIC, with the Ghost mass and through contact.
#[test]
fn angular_momentum_is_kept_by_the_stabilised_mass() {
    let mut cases = Vec::new();
    for update in ["usf", "usl", "musl"] {
        for velocity in ["\"flip\"", "\"pic\"", "0.7"] {
            for (contact, basis, ranks) in [(false, "gimp", 1), (true, "gimp", 3), (true, "mpm", 1)]
            {
                cases.push((Tumble { update, velocity, contact, basis, dimension: 2 }, ranks));
            }
        }
    }
    at_once(cases, |(case, ranks)| case.keeps_both(ranks));
}

#[test]
fn angular_momentum_is_kept_in_space() {
    for (update, velocity, contact, basis, ranks) in [
        ("usf", "\"flip\"", true, "gimp", 3),
        ("usl", "\"flip\"", true, "mpm", 1),
        ("usl", "0.7", false, "gimp", 1),
        ("musl", "\"pic\"", true, "mpm", 3),
        ("usf", "0.7", false, "mpm", 1),
    ] {
        let case = Tumble { dimension: 3, update, velocity, contact, basis };
        case.keeps_both(ranks);
    }
}

/// Without the Ghost share it is kept too, by the lumped mass not.
#[test]
fn angular_momentum_is_kept_through_contact_by_the_plain_consistent_mass() {
    // Two blocks in neighbouring cells that shear past each other, well inside their cells.
    let shearing = |mass: &str, update: &str| {
        blocks(&[
            r#"
shape = { box = { min = [2, 2], max = [4, 4] } }
points_per_cell = [4, 4]
velocity = ["0.5 + 0.2*Y", "0.5 - 0.1*X"]"#,
            r#"
shape = { box = { min = [4, 3], max = [6, 5] } }
points_per_cell = [4, 4]
velocity = ["-1 + 0.1*Y", "-0.5"]"#,
        ])
        .set(format!("method.mass=\"{mass}\""))
        .set(format!("method.stress_update=\"{update}\""))
        .results()
    };
    let size = 2.0 * 10.0 * 4.0;
    for update in ["usf", "usl", "musl"] {
        let run = shearing("consistent", update);
        assert!(run.history("energy_strain").last() > Some(&1e-4), "there was contact");
        let change = drift(&run, "angular_momentum_z") / size;
        assert!(change < 1e-12, "{update}: {change:e}");
    }
    let lumped = drift(&shearing("lumped", "usl"), "angular_momentum_z") / size;
    assert!(lumped > 1e-6, "{lumped:e}");
}

/// The ghosts of the deck, through their contact: the velocity that is chosen for it keeps their
/// angular momentum; Ghost eq. 9 as printed does not.
#[test]
fn angular_momentum_of_the_ghosts_is_kept() {
    for (update, basis, published) in
        [("usf", "gimp", 1.6e-5), ("usl", "gimp", 9.4e-8), ("usl", "mpm", 6.8e-8)]
    {
        let change = |position: &str| {
            let run = contact(100)
                .set(format!("method.stress_update=\"{update}\""))
                .set(format!("method.position_update=\"{position}\""))
                .set(format!("method.basis=\"{basis}\""))
                .results();
            assert!(run.history("energy_strain").last() > Some(&1e-3), "there was contact");
            // Σ m |x| |v|: the bodies fly along the diagonal, half a metre from the origin.
            drift(&run, "angular_momentum_z") / (0.5 * MASS * SPEED)
        };
        let kept = change("momentum");
        assert!(kept < 1e-12, "{update} {basis}: {kept:e}");
        let lost = change("published") / published;
        assert!((0.7..1.4).contains(&lost), "{update} {basis}: {lost} of {published:e}");
    }
}

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
    let block = |from: f64| {
        blocks(&[&format!(
            "shape = {{ box = {{ min = [{from:?}, 1], max = [{:?}, 2] }} }}",
            from + 2.0
        )])
        .set("analysis.steps=2000")
        .set("analysis.duration=0.2")
        .set("method.basis=\"gimp\"")
        .set("method.domain_update=\"stretch\"")
        .set("ghost={ mass_factor = 0.25 }")
        .set("grid.origin=[0, -1]")
        .set("grid.size=[4, 4]")
        .set("grid.h=0.5")
        .set("material.soft.poisson=0.0")
    };
    // A block falls freely: the work of gravity is its kinetic energy.
    let fall = block(1.0).set("load=[{ gravity = [0, -10] }]").results();
    let last = |run: &Results, name: &str| *run.history(name).last().unwrap();
    let (work, kinetic) = (last(&fall, "work_external"), last(&fall, "energy_kinetic"));
    // 20 kg/m at (0.2 s * 10 m/s2)^2 / 2.
    assert!((kinetic - 40.0).abs() < 1e-9, "{kinetic}");
    assert!((work / kinetic - 1.0).abs() < 0.01, "{work} {kinetic}");
    assert!((last(&fall, "momentum_y") + 40.0).abs() < 1e-9);

    // One side is pulled away, the other held: what the boundary puts in is stored.
    let wall = "{ name = \"wall\", where = { side = \"left\" }, fix = [\"x\"] }";
    let puller = "{ name = \"puller\", where = { box = { min = [2, 0], max = [2, 3] } }, \
                  displacement = { x = \"0.02*t/0.2\" } }";
    let pull = block(0.0).set(format!("boundary=[{wall}, {puller}]")).results();
    let stored = last(&pull, "energy_kinetic") + last(&pull, "energy_strain");
    let work = last(&pull, "work_external");
    assert!(stored > 0.1 && (work / stored - 1.0).abs() < 0.02, "{work} {stored}");
    assert!(last(&pull, "reaction.puller.x") > 0.0 && last(&pull, "reaction.wall.x") < 0.0);
}
