//! Contact of two deformable bodies in explicit runs: rebound, Coulomb's law, what is kept, ranks, restart.

mod common;
#[path = "common/program.rs"]
mod program;

use common::run::{Results, Run, input, last, relative_difference};

fn impulse(results: &Results, column: &str) -> f64 {
    let steps = results.history("dt");
    results.history(column).iter().zip(&steps).map(|(force, dt)| force * dt).sum()
}

fn energy(results: &Results, row: usize) -> f64 {
    ["energy_kinetic", "energy_strain"].iter().map(|name| results.history(name)[row]).sum()
}

/// Either disc does what it does against a smooth wall in the middle.
#[test]
fn two_discs_bounce_off_each_other_as_off_a_wall() {
    let text = std::fs::read_to_string(input("two-discs")).expect("a deck");
    let results = Run::text(&text).results();
    let rows = results.history("dt").len();
    let (before, after) = (energy(&results, 0), energy(&results, rows - 1));
    assert!((after / before - 1.0).abs() < 0.01, "{before} {after}");
    let size = 1000.0 * 0.04 * std::f64::consts::PI;
    for column in ["momentum_x", "momentum_y"] {
        let most = results.history(column).iter().fold(0.0f64, |m, p| m.max(p.abs()));
        assert!(most < 1e-12 * size, "{column}: {most:e}");
    }
    let turn = last(&results, "angular_momentum_z").abs();
    assert!(turn < 1e-9 * size, "angular momentum {turn:e}");
    let push = impulse(&results, "contact.left-right.x");

    let (start, end) =
        (text.find("[[body]]\nname = \"right\"").unwrap(), text.find("[[contact]]").unwrap());
    let plane = "[[rigid]]\nname = \"wall\"\n\
                 shape = { half_space = { point = [0, 0], normal = [-1, 0] } }\n\n";
    let wall = format!("{}{plane}{}", &text[..start], text[end..].replace("right", "wall"));
    let off_wall = -impulse(&Run::text(&wall).results(), "reaction.wall.x");
    assert!((push / off_wall - 1.0).abs() < 0.02, "{push} {off_wall}");
    // They part faster than at nine tenths of the speed of their approach.
    assert!(push > 1.8 * size, "{push}");
}

/// Every basis keeps momentum and, within a few per cent, energy: corners of CPDI domains follow the
/// field of their own body.
#[test]
fn discs_bounce_with_every_basis() {
    for basis in ["cpdi1", "cpdi2", "mpm"] {
        let results = Run::of("two-discs").set(format!("method.basis=\"{basis}\"")).results();
        let rows = results.history("dt").len();
        let ratio = energy(&results, rows - 1) / energy(&results, 0);
        assert!((ratio - 1.0).abs() < 0.03, "{basis}: {ratio}");
        let push = impulse(&results, "contact.left-right.x");
        assert!((push / 238.6 - 1.0).abs() < 0.02, "{basis}: {push}");
        assert!(last(&results, "momentum_x").abs() < 1e-10 * push, "{basis}");
    }
}

/// x = v t + a t^2 / 2 with a = g (sin t - mu cos t), and T = mu N; friction takes T times the slip.
#[test]
fn a_block_slides_on_deformable_ground() {
    let results = Run::of("sliding-block").results();
    assert!(results.verify("slid") < 0.01, "{}", results.verify("slid"));
    let (along, down) =
        (impulse(&results, "contact.ground-block.x"), impulse(&results, "contact.ground-block.y"));
    assert!((-along / down / 0.3 - 1.0).abs() < 5e-3, "{along} {down}");
    let weight = 0.5 * 500.0 * 8.49571;
    assert!((down / weight - 1.0).abs() < 0.01, "{down} {weight}");
    let lost = last(&results, "dissipation_friction");
    let expected = 0.3 * 500.0 * 8.49571 * last(&results, "contact.ground-block.slip");
    assert!((lost / expected - 1.0).abs() < 0.02, "{lost} {expected}");
}

/// With mu >= tan t, with adhesion, and rough it does not slip.
#[test]
fn a_block_sticks_on_deformable_ground() {
    let run = Run::of("sliding-block")
        .set("body.0.velocity=")
        .set("verify=")
        .set("load.0.gravity=[\"4.905*min(1,5*t)\",\"-8.49571*min(1,5*t)\"]");
    let way = |run: &Run| last(&run.results(), "contact.ground-block.slip");
    for stick in ["friction=0.7", "friction=\"rough\"", "adhesion=1e5"] {
        let slip = way(&run.clone().set(format!("contact.0.{stick}")));
        assert!(slip < 3e-3, "{stick}: {slip}");
    }
    // Adhesion of a tenth of what the weight asks for in the end, or a limit as low, lets it slide
    // once that is exceeded, at 0.02 s.
    let free = way(&run.clone().set("contact.0.friction=0.0"));
    // g sin 30 (t^2 / 2 - t_0 t / 2 + t_0^2 / 6), t_0 the time in which it rises.
    let expected = 4.905 * (0.5 * 0.25 - 0.5 * 0.2 * 0.5 + 0.04 / 6.0);
    assert!((free / expected - 1.0).abs() < 0.02, "{free} {expected}");
    let held = 0.1 * 500.0 * 4.905;
    for slow in [format!("adhesion={held}"), format!("max_shear={held}")] {
        let mut run = run.clone().set(format!("contact.0.{slow}"));
        if slow.starts_with("adhesion") {
            run = run.set("contact.0.friction=0.0");
        }
        let slip = way(&run);
        let (ramp, drag) = (4.905 / 0.2, 0.1 * 4.905);
        let (speed, way) = (ramp * 0.18f64.powi(2) / 2.0, ramp * 0.18f64.powi(3) / 6.0);
        let expected = way + speed * 0.3 + 0.5 * (4.905 - drag) * 0.09;
        assert!((slip / expected - 1.0).abs() < 0.03, "{slow}: {slip} {expected}");
    }
}

/// Rank boundaries go through the bodies and the nodes that they share.
#[test]
fn ranks_agree_in_contact() {
    for deck in ["two-discs", "sliding-block"] {
        let run = Run::of(deck).set("parallel.brick=1").set("analysis.duration=0.12");
        let one = run.results();
        let columns: Vec<String> = one
            .text("history.csv")
            .lines()
            .next()
            .expect("a header")
            .split(',')
            .filter_map(|name| name.split(' ').next())
            .filter(|name| name.starts_with("contact.") || name.starts_with("energy"))
            .map(String::from)
            .collect();
        assert!(columns.len() > 6, "{columns:?}");
        for ranks in [2, 3] {
            let more = run.clone().ranks(ranks).results();
            for column in &columns {
                let (a, b) = (more.history(column), one.history(column));
                if b.iter().all(|v| v.abs() < 1e-6) {
                    continue;
                }
                let wrong = relative_difference(&a, &b);
                assert!(wrong < 1e-8, "{deck} on {ranks} ranks, {column}: {wrong:e}");
            }
        }
    }
}

/// A run in contact goes on from a checkpoint bit by bit.
#[test]
fn a_restart_of_bodies_in_contact_is_bitwise() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let deck = folder.path().join("deck.toml");
    let text = std::fs::read_to_string(input("sliding-block")).expect("a deck");
    let text = text.replace("duration = 0.5", "duration = 0.05");
    std::fs::write(&deck, format!("{text}\n[output]\ncheckpoint = {{ every = 20 }}\n")).unwrap();
    for ranks in [1, 2] {
        let at = |name: &str| folder.path().join(format!("{name}-{ranks}"));
        program::run_well(ranks, &deck, &at("whole"), &[]);
        let middle = at("whole").join("checkpoint-000020.h5").display().to_string();
        program::run_well(ranks, &deck, &at("part"), &["--restart", &middle]);
        assert_eq!(program::history(&at("part"))[..], program::history(&at("whole"))[20..]);
    }
}

/// Points tell what acts on them: the forces of either body add up to those between them.
#[test]
fn points_tell_what_bodies_in_contact_do_to_them() {
    let deck = Run::of("sliding-block")
        .set("analysis.duration=0.1")
        .set("parallel.brick=1")
        .set("verify=")
        .set("output={ fields = [\"contact_force\", \"contact_gap\", \"contact_slip\", \"contact_status\", \"body\"] }");
    let one = deck.results();
    let step = one.history("step").len();
    let points = one.points(step);
    let bodies = points.field("body").to_vec();
    let sum = |name: &str, component: usize, body: f64| -> f64 {
        let values = points.component(name, component);
        values.iter().zip(&bodies).filter(|(_, own)| **own == body).map(|(value, _)| value).sum()
    };
    for (axis, name) in ["x", "y"].iter().enumerate() {
        let force = last(&one, &format!("contact.ground-block.{name}"));
        let (block, ground) = (sum("contact_force", axis, 0.0), sum("contact_force", axis, 1.0));
        assert!((block - force).abs() < 1e-9 * force.abs().max(1.0), "{name}: {block} {force}");
        assert!((block + ground).abs() < 1e-9 * force.abs().max(1.0), "{name}: {block} {ground}");
    }
    let status = points.field("contact_status");
    assert!(status.contains(&0.0) && status.contains(&2.0));
    // Points of the block that bear much have slid as the block has.
    let (slid, down) = (points.field("contact_slip"), points.component("contact_force", 1));
    let bearing = slid.iter().zip(&down).filter(|(_, force)| **force > 100.0);
    let slid: Vec<f64> = bearing.map(|(slid, _)| *slid).collect();
    let (slid, mean) =
        (slid.iter().sum::<f64>() / slid.len() as f64, last(&one, "contact.ground-block.slip"));
    assert!((slid / mean - 1.0).abs() < 0.1, "{slid} {mean}");
    let more = deck.clone().ranks(2).results();
    for field in ["contact_force", "contact_gap", "contact_slip", "contact_status"] {
        let wrong = relative_difference(more.points(step).field(field), points.field(field));
        assert!(wrong < 1e-8, "{field}: {wrong:e}");
    }
}

/// In space, obliquely: momentum is kept, friction and adhesion act against the slip.
#[test]
fn cubes_meet_in_space() {
    let results = Run::text(CUBES).results();
    let momentum = results.history("momentum_x");
    assert!(momentum.iter().all(|p| (p / momentum[0] - 1.0).abs() < 1e-12));
    let force: Vec<Vec<f64>> =
        ["x", "y", "z"].map(|axis| results.history(&format!("contact.low-high.{axis}"))).into();
    let pressed = force[2].iter().filter(|f| **f > 0.0).count();
    assert!(pressed > 5 && force[2].iter().all(|f| *f >= 0.0), "{force:?}");
    assert!(impulse(&results, "contact.low-high.x") < 0.0);
    assert!(last(&results, "dissipation_friction") > 0.0);
    // Before the lower cube tilts, on a quarter of a square metre.
    let area = results.history("contact.low-high.area")[4];
    assert!((area / 0.25 - 1.0).abs() < 0.02, "{area}");
}

const CUBES: &str = r#"
[analysis]
type = "explicit"
duration = 0.1
cfl = 0.4
[method]
basis = "gimp"
mass = "lumped"
domain_update = "stretch"
[grid]
type = "lattice"
origin = [-0.5, -0.5, -0.25]
size = [2.0, 1.75, 1.75]
h = 0.25
[material.rubber]
model = "hencky"
young = 1e5
poisson = 0.2
[[body]]
name = "low"
material = "rubber"
density = 1000.0
shape = { box = { min = [0.0, 0.0, 0.0], max = [1.0, 0.75, 0.5] } }
[[body]]
name = "high"
material = "rubber"
density = 1000.0
shape = { box = { min = [0.1, 0.1, 0.55], max = [0.6, 0.6, 1.05] } }
velocity = [0.5, 0.0, -2.0]
[[contact]]
between = ["low", "high"]
friction = 0.1
adhesion = 10.0
"#;

/// Bodies in different fields that no contact names together do not slip on each other, as if there
/// were one field: the block rests on the ground while both touch a third body, or might.
#[test]
fn bodies_without_a_contact_are_joined() {
    let third = "[[body]]\nname = \"far\"\nmaterial = \"rubber\"\ndensity = 1000.0\n\
                 shape = { box = { min = [1.75, 0.75], max = [2.0, 1.0] } }\n\n[[contact]]\n\
                 between = [\"far\", \"block\"]\n\n[[contact]]";
    let text = std::fs::read_to_string(input("sliding-block")).expect("a deck");
    let text = text.replace("velocity = [0.5, 0.0]\n", "").replacen("[[contact]]", third, 1);
    let text = text.replace("[\"ground\", \"block\"]", "[\"far\", \"ground\"]");
    let text = text.replace("duration = 0.5\ncfl = 0.5", "duration = 0.1\nsteps = 100");
    let shift = |results: &Results| {
        let step = results.history("step").len();
        let points = results.points(step);
        let (x, body) = (points.component("displacement", 0), points.field("body"));
        let own: Vec<f64> =
            x.iter().zip(body).filter(|(_, body)| **body == 0.0).map(|(x, _)| *x).collect();
        own.iter().sum::<f64>() / own.len() as f64
    };
    let joined = shift(&Run::text(&text).set("verify=").results());
    let (bodies, rest) = text.split_once("[[contact]]").expect("a contact");
    let loads = rest.split_once("[[load]]").expect("a load").1;
    let alone = format!("{bodies}[[load]]{loads}");
    let native = shift(&Run::text(&alone).set("verify=").results());
    // Its slip would be 0.0118 m.
    assert!(native.abs() < 2e-3 && (joined / native - 1.0).abs() < 1e-9, "{joined} {native}");
}

#[test]
fn what_two_bodies_cannot_do_is_told_with_the_cure() {
    for (set, expected) in [
        ("method.mass=\"consistent\"", &["takes a lumped mass", "method.mass = \"lumped\""][..]),
        ("contact.0.penalty=20", &["has no effect between two bodies"]),
        ("contact.0.between=[\"block\",\"block\"]", &["does not touch itself"]),
        ("contact.0.between=[\"blok\",\"block\"]", &["did you mean \"block\"?"]),
    ] {
        let outcome = Run::of("sliding-block").set(set).attempt();
        let said = outcome.said();
        assert_eq!(outcome.code, 2, "{said}");
        assert!(expected.iter().all(|part| said.contains(part)), "{set:?}:\n{said}");
    }
}

/// At rest nothing bears the part of the weight that friction does not.
#[test]
fn a_block_that_slides_without_rest_is_explained() {
    let outcome = Run::of("sliding-block")
        .set("analysis={ type = \"quasi-static\", steps = 1 }")
        .set("method.mass=")
        .attempt();
    let said = outcome.said();
    assert_eq!(outcome.code, 1, "{said}");
    assert!(said.contains("contacts alone hold has no state of rest once it slides"), "{said}");
}
