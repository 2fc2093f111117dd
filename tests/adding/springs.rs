//! The term of docs/develop/adding-a-term.md through the program: the key of its deck switches it on, and all analyses
//! know it.

use std::path::Path;

use super::common::run::{Results, Run, last, probed, relative_difference};
use mpm_par::deck;

/// Density over stiffness is such that all points together swing with the angular frequency 5 / s.
const SWING: &str = r#"
[analysis]
type = "explicit"
steps = 40
duration = 0.8
[method]
mass = "lumped"
basis = "gimp"
[grid]
type = "lattice"
size = [6, 6]
h = 0.5
[material.soil]
model = "hencky"
young = 1e5
poisson = 0.3
[[body]]
name = "block"
material = "soil"
density = 2000.0
shape = { box = { min = [2, 2], max = [4, 3] } }
velocity = [0.5, 0.25]
[[foundation]]
axis = "x"
stiffness = 5e4
[[probe]]
name = "block"
body = "block"
fields = ["displacement"]
[output]
every = 40
"#;

/// Displacement of the block along x after each step, m.
fn swings(results: &Results) -> Vec<f64> {
    let text = results.text("probes.csv");
    let mut rows = text.lines().map(|row| row.split(','));
    let header = rows.next().expect("names");
    let column = header.into_iter().position(|name| name.starts_with("block.displacement.x"));
    let column = column.expect("a column");
    rows.map(|mut row| row.nth(column).expect("a cell").parse().expect("a number")).collect()
}

/// v -= dt w^2 x, x += dt v: all forces act on the points' mass, and no point deforms.
#[test]
fn an_explicit_step_takes_the_force_of_its_start() {
    let (dt, squared) = (0.02, 25.0);
    let wanted: Vec<f64> = (0..40)
        .scan((0.0, 0.5), |(x, v), _| {
            *v -= dt * squared * *x;
            *x += dt * *v;
            Some(*x)
        })
        .collect();
    for ranks in [1, 2] {
        for update in ["usl", "usf", "musl"] {
            let run = Run::text(SWING).ranks(ranks).set(format!("method.stress_update={update}"));
            let results = run.results();
            let found = swings(&results);
            assert!(relative_difference(&found, &wanted) < 1e-11, "{update}, {ranks}: {found:?}");
            // The springs, 1e5 N/m in all, have taken k x^2 / 2, with the x of both ends of the step at whose middle the
            // velocity is: no energy is lost.
            let before = [0.0].iter().chain(&found);
            let taken: Vec<f64> = found.iter().zip(before).map(|(x, y)| -5e4 * x * y).collect();
            let (work, kinetic) =
                (results.history("work_external"), results.history("energy_kinetic"));
            assert!(relative_difference(&work, &taken) < 1e-11, "{update}, {ranks}: {work:?}");
            let kept =
                kinetic.iter().zip(&work).all(|(k, w)| ((k - w) / 625.0 - 1.0).abs() < 1e-11);
            assert!(kept, "{update}, {ranks}: {kinetic:?} {work:?}");
        }
    }
}

/// With the trapezoidal rule x_n = v / w sin(n p), tan(p / 2) = w dt / 2; energy goes to the springs as work and comes
/// back.
#[test]
fn implicit_dynamics_swing_by_the_trapezoidal_rule() {
    let (dt, frequency): (f64, f64) = (0.05, 5.0);
    let phase = 2.0 * (frequency * dt / 2.0).atan();
    let wanted: Vec<f64> =
        (1..=40).map(|n| 0.5 / frequency * (f64::from(n) * phase).sin()).collect();
    for (ranks, mass) in [(1, "lumped"), (2, "consistent")] {
        let run = Run::text(SWING)
            .ranks(ranks)
            .set("analysis.type=implicit-dynamic")
            .set("analysis.duration=2.0")
            .set("analysis.tolerance=1e-12")
            .set("analysis.newmark_beta=0.25")
            .set("analysis.newmark_gamma=0.5")
            .set(format!("method.mass={mass}"));
        let results = run.results();
        let found = swings(&results);
        assert!(relative_difference(&found, &wanted) < 1e-9, "{mass}: {found:?} {wanted:?}");
        let first = 0.5 * 2000.0 * 2.0 * (0.25 + 0.0625);
        for (kinetic, work) in
            results.history("energy_kinetic").iter().zip(results.history("work_external"))
        {
            assert!(((kinetic - work) / first - 1.0).abs() < 1e-9, "{kinetic} {work}");
        }
    }
}

/// Springs stiffer than the material shorten the steps that follow the stability limit: 2 / w of the springs alone is
/// 0.02 s, h / c of the material 0.6 s. Leapfrog with the step dt swings by v / w (1 - (w dt / 2)^2)^(-1/2).
#[test]
fn the_stability_limit_knows_the_springs() {
    let results = Run::text(SWING)
        .set("analysis.steps=")
        .set("analysis.cfl=0.5")
        .set("analysis.duration=2")
        .set("material.soil.young=1e3")
        .set("foundation.0.stiffness=2e7")
        .results();
    let most = swings(&results).iter().fold(0.0f64, |most, x| most.max(x.abs()));
    assert!(most < 1.2 * 0.5 / 100.0, "{most}");
    let longest = results.history("dt").iter().fold(0.0f64, |most, dt| most.max(*dt));
    assert!(longest < 0.01 && longest > 0.009, "{longest}");
}

/// The block of a quasi-static run sinks by rho g H / k_s, under loads that grow; what the weight does is half its force
/// times the way, all of it strain or work on the springs.
#[test]
fn a_block_rests_on_springs() {
    let deck = "ghost = \"off\"".to_string() + SWING;
    // The surface that sinks stays within its cells: no other nodes join.
    let deck = deck
        .replace("size = [6, 6]", "origin = [0, -0.25]\nsize = [6, 6]")
        .replace("type = \"explicit\"", "type = \"quasi-static\"")
        .replace("duration = 0.8\n", "tolerance = 1e-11\n")
        .replace("steps = 40", "steps = 4")
        .replace("mass = \"lumped\"\n", "")
        .replace("velocity = [0.5, 0.25]\n", "")
        .replace("axis = \"x\"\nstiffness = 5e4", "axis = \"y\"\nstiffness = \"1e6 * (Y < 2.25)\"")
        + r#"
[[boundary]]
where = { box = { min = [0, 0], max = [6, 6] } }
fix = ["x"]
[[load]]
gravity = [0, -0.1]
[[probe]]
name = "layer"
near = [2.1, 2.1]
fields = ["displacement"]
"#;
    for ranks in [1, 2] {
        let results = Run::text(&deck).ranks(ranks).results();
        let (sunk, wanted) =
            (probed(&results, "layer.displacement.y"), -0.1 * 2000.0 / (1e6 * 0.25));
        assert!((sunk / wanted - 1.0).abs() < 1e-9, "{sunk} {wanted}");
        // What the block holds is what its weight and the springs have done, but for the steps' length (1e-4 / steps).
        let (strain, work) = (last(&results, "energy_strain"), last(&results, "work_external"));
        assert!((strain / work - 1.0).abs() < 1e-4, "{strain} {work}");
    }
    let loose = Run::text(&deck).set("boundary=").attempt();
    assert!(
        loose.code == 2 && loose.stderr.contains("no [[boundary]] holds x: "),
        "{}",
        loose.stderr
    );
}

const DUG: &str = r#"
ghost = "off"
[analysis]
type = "quasi-static"
tolerance = 1e-10
[method]
basis = "gimp"
[grid]
type = "lattice"
origin = [0, -0.25]
size = [6, 6]
h = 0.5
[material.soil]
model = "hencky"
young = 1e5
poisson = 0.3
[[body]]
name = "low"
material = "soil"
density = 2000.0
shape = { box = { min = [2, 2], max = [4, 2.75] } }
[[body]]
name = "high"
material = "soil"
density = 2000.0
shape = { box = { min = [2, 2.75], max = [4, 3.25] } }
until = "dig"
[[foundation]]
body = "low"
axis = "y"
stiffness = "1e6 * (Y < 2.25)"
[[boundary]]
where = { box = { min = [0, -1], max = [6, 6] } }
fix = ["x"]
[[load]]
gravity = [0, -0.1]
[[stage]]
name = "load"
steps = 2
[[stage]]
name = "dig"
steps = 3
[[probe]]
name = "layer"
near = [2.1, 2.1]
fields = ["displacement"]
"#;

/// A body that goes takes its weight off the springs, over the stage in which it goes.
#[test]
fn what_is_dug_off_springs_lets_them_rise() {
    for ranks in [1, 2] {
        let results = Run::text(DUG).ranks(ranks).results();
        let text = results.text("probes.csv");
        let sunk = text.lines().skip(1).map(|row| row.rsplit(',').next().expect("a cell"));
        let sunk: Vec<f64> = sunk.map(|u| u.parse().expect("a number")).collect();
        let loads = [0.5, 1.0, 0.6 + 0.4 * 2.0 / 3.0, 0.6 + 0.4 / 3.0, 0.6];
        let wanted = loads.map(|share| -share * 1.25 * 0.1 * 2000.0 / (1e6 * 0.25));
        assert!(relative_difference(&sunk, &wanted) < 1e-8, "{ranks}: {sunk:?} {wanted:?}");
    }
}

/// w(x) of the beam of inputs/winkler-beam.toml with a^2 = d / 2 + c / 4, b^2 = d / 2 - c / 4 (the inverse Fourier transform
/// of Timoshenko's equation).
#[test]
fn a_beam_on_springs_bends_by_the_closed_form() {
    let (young, k, load) = (1e7f64, 8.533333333333334e4, 2000.0);
    let (bending, shear) = (young / 12.0, 5.0 / 6.0 * young / 2.0);
    let (c, d) = (k / shear, (k / bending).sqrt());
    let (a, b) = ((d / 2.0 + c / 4.0).sqrt(), (d / 2.0 - c / 4.0).sqrt());
    let exact = |x: f64| {
        let (cos, sin) = ((b * x).cos(), (b * x).sin());
        let sum = (b * cos + a * sin) / d + bending / shear * (b * cos - a * sin);
        -load / (4.0 * bending * a * b) * (-a * x).exp() * sum
    };
    let results = Run::of("winkler-beam").ranks(2).results();
    for (name, x, tolerance) in [("middle", 0.03125, 0.01), ("uplift", 7.84375, 0.1)] {
        let found = probed(&results, &format!("{name}.displacement.y"));
        assert!((found / exact(x) - 1.0).abs() < tolerance, "{name}: {found} {}", exact(x));
    }
    assert!(exact(7.84375) > 0.0);
}

/// What is wrong is told before anything is written, with the key.
#[test]
fn its_key_is_read_as_all_others() {
    let said = |set: &[&str]| {
        let run = set.iter().fold(Run::text(SWING), |run, set| run.set(*set));
        let outcome = run.attempt();
        assert_eq!(
            (outcome.code, outcome.folder.path().join("out").exists()),
            (2, false),
            "{set:?}"
        );
        outcome.said()
    };
    for (set, words) in [
        ("foundation.0.stiffness=-1", "expected a number >= 0"),
        (
            "foundation.0.stiffness=\"1 / (X - X)\"",
            "foundation.0: its stiffness is inf N/m at point 0",
        ),
        ("foundation.0.stiffness=\"X < 0\"", "acts on no point"),
        ("foundation.0.stiffnes=1", "did you mean \"stiffness\"?"),
        ("foundation.0.axis=z", "foundation.0.axis"),
        ("foundation.0.body=blok", "did you mean \"block\"?"),
        ("fondation=[{ axis = \"x\", stiffness = 1 }]", "did you mean \"foundation\"?"),
    ] {
        let said = said(&[set]);
        assert!(said.contains(words), "{set}: {said}");
    }
    let rings = SWING.replace("steps = 40", "steps = 40\nsymmetry = \"axisymmetric\"");
    let told = deck::read(Path::new("deck.toml"), &rings, &[]).expect_err("no rings on springs");
    let words = "foundation: has no effect: only analysis.symmetry = \"plane-strain\" reads it";
    assert!(told.to_string().contains(words), "{told}");
    let deck = deck::read(Path::new("deck.toml"), SWING, &[]).expect("a deck");
    let text = deck::resolved(&deck);
    assert!(text.contains("[[foundation]]\nbody = \"block\"\naxis = \"x\"\n"), "{text}");
    assert_eq!(deck::read(Path::new("again"), &text, &[]).expect("again").terms, deck.terms);
    assert!(text.contains("stiffness = 50000.0  # N/m4\n"), "{text}");
}
