//! Contacts and rigid bodies that come and go with stages, and what contact tells at the points.

mod common;
#[path = "common/program.rs"]
mod program;

use common::run::{Run, last, relative_difference};

/// A block on a floor, a plate that presses it, and a stage after that.
const STAGED: &str = r#"
[analysis]
type = "quasi-static"
max_iterations = 30
[[stage]]
name = "first"
steps = 4
[[stage]]
name = "second"
steps = 4
[method]
basis = "gimp"
[grid]
type = "lattice"
origin = [-1.0, -1.0]
size = [4.0, 4.0]
h = 0.5
[material.rubber]
model = "hencky"
young = 1e6
poisson = 0.0
[[body]]
name = "block"
material = "rubber"
shape = { box = { min = [0.0, 0.1], max = [1.5, 1.6] } }
[[rigid]]
name = "floor"
shape = { half_space = { point = [0, 0.1], normal = [0, 1] } }
[[rigid]]
name = "plate"
shape = { box = { min = [-0.5, 1.6], max = [2.0, 2.0] } }
motion = { displacement = [0.0, -0.06] }
[[contact]]
between = ["floor", "block"]
friction = 0.2
[[contact]]
between = ["block", "plate"]
friction = "rough"
"#;

/// The forces of a contact that goes fall to nothing over its last stage, and the block springs back.
#[test]
fn what_a_contact_that_goes_has_held_is_released() {
    let results = Run::text(STAGED).set("contact.1.until=\"second\"").results();
    let force = results.history("reaction.plate.y");
    assert!(force[3] < -1e3 && force[7].abs() < 1e-6 * force[3].abs(), "{force:?}");
    assert!(force.windows(2).skip(3).all(|pair| pair[0] < pair[1]), "{force:?}");
    let energy = results.history("energy_strain");
    assert!(energy[7] < 1e-6 * energy[3], "{energy:?}");
    assert!(last(&results, "contact.block-plate.slip") < 1e-12);
}

/// A rigid body that comes with a stage moves with s of that stage, from its place in the deck.
#[test]
fn a_rigid_body_that_comes_later_does_what_it_does_at_once() {
    let later = Run::text(STAGED).set("rigid.1.from=\"second\"").results();
    let stage = "[[stage]]\nname = \"second\"\nsteps = 4\n";
    let at_once = Run::text(&STAGED.replace(stage, "")).results();
    let (late, soon) = (later.history("reaction.plate.y"), at_once.history("reaction.plate.y"));
    assert!(late[..4].iter().all(|force| *force == 0.0), "{late:?}");
    // Without a load the first stage leaves the block as it is.
    assert!(relative_difference(&late[4..], &soon) < 1e-9, "{late:?} {soon:?}");
    // A contact that comes where the plate has gone to already is told, once the run is there.
    let outcome = Run::text(STAGED).set("contact.1.from=\"second\"").attempt();
    let said = outcome.said();
    assert_eq!(outcome.code, 1, "{said}");
    for part in ["overlaps the rigid body \"plate\" by 6.000e-2 m", "stage \"second\" begins"] {
        assert!(said.contains(part), "{said}");
    }
}

const FALLING: &str = r#"
[analysis]
type = "explicit"
cfl = 0.4
[[stage]]
name = "wait"
duration = 0.05
[[stage]]
name = "push"
duration = 0.1
[method]
basis = "gimp"
mass = "lumped"
domain_update = "stretch"
[grid]
type = "lattice"
origin = [-1.0, -1.0]
size = [4.0, 4.0]
h = 0.5
[material.rubber]
model = "hencky"
young = 1e6
poisson = 0.0
[[body]]
name = "block"
material = "rubber"
density = 1000.0
shape = { box = { min = [0.0, 0.0], max = [1.0, 1.0] } }
[[rigid]]
name = "plate"
shape = { box = { min = [-0.5, 1.02], max = [2.0, 2.0] } }
motion = { velocity = [0.0, -1.0] }
from = "push"
[[contact]]
between = ["block", "plate"]
"#;

/// The way of a velocity begins with the stage: a gap of 0.02 m is closed 0.02 s after it. The run goes
/// on from a checkpoint of either stage bit by bit.
#[test]
fn the_way_of_a_velocity_begins_with_its_stage() {
    let results = Run::text(FALLING).results();
    let (time, force) = (results.history("time"), results.history("reaction.plate.y"));
    let first = force.iter().position(|force| *force < 0.0).expect("a contact");
    let step = time[first] - time[first - 1];
    assert!((time[first] - 0.07).abs() < 2.5 * step, "{} {step}", time[first]);
    let folder = tempfile::tempdir().expect("a scratch folder");
    let deck = folder.path().join("deck.toml");
    let text = format!(
        "{FALLING}[output]\nfields = [\"contact_force\", \"contact_slip\"]\ncheckpoint = {{ every = 5, keep = 100 }}\n"
    );
    std::fs::write(&deck, text).unwrap();
    for ranks in [1, 2] {
        let at = |name: &str| folder.path().join(format!("{name}-{ranks}"));
        program::run_well(ranks, &deck, &at("whole"), &[]);
        for step in [5, 15] {
            let middle = at("whole").join(format!("checkpoint-{step:06}.h5")).display().to_string();
            let part = at(&format!("part-{step}"));
            program::run_well(ranks, &deck, &part, &["--restart", &middle]);
            assert_eq!(program::history(&part)[..], program::history(&at("whole"))[step..]);
        }
    }
}

const DROPPED: &str = r#"
[[stage]]
name = "drop"
duration = 0.1
[[body]]
name = "drop"
from = "drop"
material = "rubber"
density = 1000.0
shape = { box = { min = [1.5, 0.0], max = [2.0, 0.5] } }
velocity = [0.0, -1.0]
[[contact]]
between = ["drop", "floor"]
[[foundation]]
body = "drop"
axis = "x"
stiffness = 1e3
"#;

/// A body that comes with a stage touches what it has a contact with: a gap of 0.02 m is closed 0.02 s after the stage's
/// start. The run goes on from before that bit by bit.
#[test]
fn a_body_that_comes_brings_its_contacts() {
    let (before, _) = FALLING.split_once("[[rigid]]").expect("a rigid body");
    let text = before.replace("[[stage]]\nname = \"push\"\nduration = 0.1\n", "")
        + "[[rigid]]\nname = \"floor\"\n\
           shape = { half_space = { point = [0, -0.02], normal = [0, 1] } }\n";
    let output = "[output]\ncheckpoint = { every = 5, keep = 100 }\n";
    let folder = tempfile::tempdir().expect("a scratch folder");
    let deck = folder.path().join("deck.toml");
    std::fs::write(&deck, format!("{text}{DROPPED}{output}")).unwrap();
    for ranks in [1, 2] {
        let at = |name: &str| folder.path().join(format!("{name}-{ranks}"));
        program::run_well(ranks, &deck, &at("whole"), &[]);
        let middle = at("whole").join("checkpoint-000005.h5").display().to_string();
        program::run_well(ranks, &deck, &at("rest"), &["--restart", &middle]);
        assert_eq!(program::history(&at("rest"))[..], program::history(&at("whole"))[5..]);
        let [time, force] =
            ["time", "reaction.floor.y"].map(|name| program::column(&at("whole"), name));
        let first = force.iter().position(|force| *force > 0.0).expect("a contact");
        let step = time[first] - time[first - 1];
        assert!((time[first] - 0.07).abs() < 2.5 * step, "{} {step}", time[first]);
    }
}

/// Two bodies that touch in the first stage alone slip in that one.
#[test]
fn bodies_slip_while_their_contact_is_there() {
    let text = std::fs::read_to_string(common::run::input("sliding-block")).expect("a deck");
    let stages = "\n[[stage]]\nname = \"slide\"\nduration = 0.1\n\n[[stage]]\nname = \"hold\"\n\
                  duration = 0.1\n\n[method]";
    let text = text.replace("duration = 0.5\n", "").replace("\n[method]", stages);
    let text = text.split("[[verify]]").next().expect("text").to_string();
    let results = Run::text(&text.replace("friction = 0.3", "friction = 0.3\nuntil = \"slide\""))
        .set("output.fields=[\"displacement\",\"position_initial\"]")
        .results();
    let (slip, stage) = (results.history("contact.ground-block.slip"), results.history("stage"));
    let begun = stage.iter().position(|stage| *stage == 2.0).expect("a second stage");
    assert!(slip[begun - 1] > 0.04, "{slip:?}");
    assert!(slip[begun..].iter().all(|now| *now == 0.0 || *now == slip[begun - 1]), "{slip:?}");
    // Joined with the ground, the block comes to rest but for the waves.
    let step = results.history("step").len();
    let points = results.points(step);
    let (x, y) = (points.component("displacement", 0), points.component("position_initial", 1));
    let block: Vec<f64> = x.iter().zip(&y).filter(|(_, y)| **y > 0.0).map(|(x, _)| *x).collect();
    let way = block.iter().sum::<f64>() / block.len() as f64;
    assert!((way - slip[begun - 1]).abs() < 0.01, "{way} {}", slip[begun - 1]);
}

/// The forces at the points are those of the rigid bodies, their gap the deepest.
#[test]
fn points_tell_what_rigid_bodies_do_to_them() {
    let fields = "[output]\nfields = [\"contact_force\", \"contact_gap\", \"contact_slip\", \
                  \"contact_status\"]\n";
    let once = STAGED.replace("[[stage]]\nname = \"second\"\nsteps = 4\n", "");
    let run = Run::text(&format!("{once}{fields}"))
        .set("rigid.1.motion.displacement=[\"0.1*s\",\"-0.06*s\"]");
    let results = run.results();
    let points = results.points(4);
    for (axis, name) in ["x", "y"].iter().enumerate() {
        let told: f64 = points.component("contact_force", axis).iter().sum();
        let acting = last(&results, &format!("reaction.floor.{name}"))
            + last(&results, &format!("reaction.plate.{name}"));
        let size = last(&results, "reaction.floor.y");
        assert!((told - acting).abs() < 1e-8 * size, "{name}: {told} {acting}");
    }
    let top: f64 = points.component("contact_force", 1).iter().filter(|f| **f < 0.0).sum();
    assert!((top / last(&results, "reaction.plate.y") - 1.0).abs() < 1e-9, "{top}");
    let gap = points.field("contact_gap").iter().fold(0.0f64, |m, g| m.min(*g));
    let deepest = last(&results, "contact.floor-block.gap_max")
        .max(last(&results, "contact.block-plate.gap_max"));
    assert!((gap + deepest).abs() < 1e-12, "{gap} {deepest}");
    let status = points.field("contact_status");
    assert!(status.contains(&0.0) && status.contains(&2.0), "the floor lets it slide");
    let more = run.clone().set("parallel.brick=1").ranks(3).results();
    for field in ["contact_force", "contact_gap", "contact_slip", "contact_status"] {
        let wrong = relative_difference(more.points(4).field(field), points.field(field));
        assert!(wrong < 1e-8, "{field}: {wrong:e}");
    }
}

#[test]
fn faults_of_stages_of_contacts_are_told_with_their_cure() {
    for (text, sets, expected) in [
        (
            FALLING,
            &["contact.0.until=\"wait\""][..],
            &["never there together", "from and until"][..],
        ),
        (STAGED, &["contact.1.from=\"initial\""], &["comes with a stage"]),
        (STAGED, &["contact.1.from=\"secnd\""], &["secnd", "did you mean \"second\"?"]),
        (STAGED, &["rigid.1.from=\"second\"", "rigid.1.until=\"first\""], &["before it comes"]),
        (STAGED, &["contact.1.until=\"first\""], &["is never there in full"]),
    ] {
        let run = sets.iter().fold(Run::text(text), |run, set| run.set(*set));
        let outcome = run.attempt();
        let said = outcome.said();
        assert_eq!(outcome.code, 2, "{said}");
        assert!(expected.iter().all(|part| said.contains(part)), "{sets:?}:\n{said}");
    }
}
