//! A geometry is what the deck says: masses, edges and places of bodies, whatever the grid.

mod common;

use common::run::Run;

/// A deck of boxes on a floor, cells of 0.5 m; `bodies` are its [[body]] tables.
fn deck(bodies: &str) -> String {
    format!(
        "[analysis]\ntype = \"quasi-static\"\nsteps = 1\n[method]\nbasis = \"gimp\"\n\
         [grid]\ntype = \"lattice\"\nsize = [4, 4]\nh = 0.5\n\
         [material.m]\nmodel = \"hencky\"\nyoung = 1e6\npoisson = 0.3\n{bodies}\
         [[boundary]]\nname = \"floor\"\nwhere = {{ side = \"bottom\" }}\nfix = [\"x\", \"y\"]\n\
         [[load]]\ngravity = [0, -1]\n"
    )
}

fn body(name: &str, shape: &str) -> String {
    format!(
        "[[body]]\nname = \"{name}\"\nmaterial = \"m\"\ndensity = 1000\nshape = {{ {shape} }}\n"
    )
}

fn rectangle(name: &str, min: [f64; 2], max: [f64; 2]) -> String {
    body(name, &format!("box = {{ min = {min:?}, max = {max:?} }}"))
}

#[track_caller]
fn near(found: f64, exact: f64, tolerance: f64) {
    assert!((found / exact - 1.0).abs() < tolerance, "{found}, exact {exact}");
}

/// 1.1 m high on cells of 0.5 m with two points each way: the floor bears 2200 N. The sub-cells'
/// centres made it 1.0 m and 2000 N.
#[test]
fn a_box_is_as_high_as_the_deck_says() {
    for ranks in [1, 2, 3] {
        let run = Run::text(&deck(&rectangle("b", [0.0, 0.0], [2.0, 1.1]))).ranks(ranks);
        let results = run.results();
        near(results.number("bodies.b.mass"), 2200.0, 1e-12);
        assert_eq!(results.count("points"), 8 * 5);
        near(results.history("reaction.floor.y")[0], 2200.0, 1e-6);
        // The fifth layer is 0.1 m high.
        let run = run.set("analysis={ type = \"explicit\", steps = 1, duration = 1e-9 }");
        let top = run.results().summary["bodies"]["b"]["max"][1].as_f64().expect("a number");
        near(top, 1.05, 1e-6);
    }
}

#[test]
fn a_body_above_the_floor_stays_above_it() {
    let bodies = rectangle("b", [0.0, 0.05], [2.0, 1.05]);
    let run = Run::text(&deck(&bodies))
        .set("analysis={ type = \"explicit\", steps = 1, duration = 1e-9 }");
    let results = run.results();
    near(results.number("bodies.b.mass"), 2000.0, 1e-12);
    let edge = |name: &str| results.summary["bodies"]["b"][name][1].as_f64().expect("a number");
    near(edge("extent_min"), 0.05, 1e-6);
    near(edge("extent_max"), 1.05, 1e-6);
}

#[test]
fn a_disc_has_its_area_on_any_number_of_ranks() {
    let bodies = body("b", "disc = { centre = [1.03, 1.07], radius = 0.9 }");
    let mut first = None;
    for ranks in [1, 3] {
        let run = Run::text(&deck(&bodies)).ranks(ranks);
        let run = run.set("analysis={ type = \"explicit\", steps = 1, duration = 1e-9 }");
        let results = run.set("output.fields=[\"position_initial\"]").results();
        near(results.number("bodies.b.mass"), 1000.0 * std::f64::consts::PI * 0.81, 1e-6);
        let points = results.points(0);
        let made = (points.id.clone(), points.field("position_initial").to_vec());
        assert_eq!(first.get_or_insert(made.clone()), &made, "{ranks} ranks");
    }
}

#[test]
fn bodies_in_one_place_are_refused() {
    let (a, b) = (rectangle("a", [0.0, 0.0], [2.0, 2.0]), rectangle("b", [1.0, 0.0], [3.0, 2.0]));
    let both = deck(&format!("{a}{b}"));
    for ranks in [1, 2] {
        let outcome = Run::text(&both).ranks(ranks).attempt();
        assert_eq!(outcome.code, 2, "{}", outcome.stderr);
        let said = outcome.said();
        assert!(said.contains("bodies \"a\" and \"b\" overlap: both hold ["), "{said}");
        assert!(said.contains("body.1.shape") && said.contains("overlap = \"allow\""), "{said}");
    }
    let allowed = Run::text(&both).set("body.1.overlap=\"allow\"").word("--check").attempt();
    assert_eq!(allowed.code, 0, "{}", allowed.stderr);
    // One inside the other, and a corner in it.
    for b in [rectangle("b", [0.9, 0.9], [1.1, 1.1]), rectangle("b", [1.95, 1.95], [3.0, 3.0])] {
        let outcome = Run::text(&deck(&format!("{a}{b}"))).attempt();
        assert_eq!(outcome.code, 2, "{}", outcome.stderr);
    }
    // Along an edge, in a shared cell, round ones that touch.
    let disc =
        |name: &str, x: f64| body(name, &format!("disc = {{ centre = [{x}, 2.0], radius = 0.8 }}"));
    for bodies in [
        format!("{a}{}", rectangle("b", [2.0, 0.0], [3.0, 2.0])),
        format!(
            "{}{}",
            rectangle("a", [0.0, 0.0], [1.1, 2.0]),
            rectangle("b", [1.2, 0.0], [2.0, 2.0])
        ),
        format!("{}{}", disc("a", 1.0), disc("b", 2.6)),
    ] {
        let outcome = Run::text(&deck(&bodies))
            .set("boundary.0.where={ box = { min = [0, 0], max = [4, 4] } }")
            .word("--check")
            .attempt();
        assert_eq!(outcome.code, 0, "{bodies}{}", outcome.stderr);
    }
}

/// Bodies of one cell each, the last beside the first: no two cells are of one body, so that there is no
/// Ghost face. Body 65 was taken for the first.
#[test]
fn any_number_of_bodies_keep_their_own_cells() {
    for count in [64, 65, 66, 130] {
        let mut bodies = String::new();
        for k in 0..count {
            let x = if k + 1 == count { 2.0 } else { 1.0 + 4.0 * k as f64 };
            bodies += &rectangle(&format!("b{k}"), [x, 1.0], [x + 1.0, 2.0]);
        }
        // A body of two cells in the second group has its one face.
        bodies += &rectangle("wide", [600.0, 1.0], [602.0, 2.0]);
        let text = deck(&bodies).replace("size = [4, 4]\nh = 0.5", "size = [640, 4]\nh = 1.0");
        let end = text.find("[[boundary]]").expect("a boundary");
        let conditioning = "[conditioning]\ndisplacement = [0.0, 0.0]\n[ghost]\nstiffness_factor = 1.0\nmass_factor = 0.25\n";
        let text = format!("{}{conditioning}", &text[..end])
            .replace("quasi-static", "conditioning")
            .replace("\"gimp\"", "\"mpm\"");
        let results = Run::text(&text).ranks(1 + count % 2).results();
        assert_eq!(results.history("ghost_faces")[0], 1.0, "{count} bodies");
    }
}

/// Along each edge of a triangle there are as many parts, so that [3, 2] meant 3.
#[test]
fn triangles_take_one_number_of_points() {
    let text = deck(&body("b", "cells = \"all\"")).replace(
        "type = \"lattice\"\nsize = [4, 4]\nh = 0.5",
        "type = \"mesh\"\ngenerate = { box = { min = [0, 0], max = [2, 2], cells = [2, 2], element = \"tri3\" } }",
    );
    let text = text.replace("side = \"bottom\"", "tag = \"bottom\"").replace("\"gimp\"", "\"mpm\"");
    let run = Run::text(&text).set("body.0.points_per_cell=[3, 2]");
    let outcome = run.attempt();
    assert_eq!(outcome.code, 2, "{}", outcome.stderr);
    let said = outcome.said();
    assert!(said.contains("body.0.points_per_cell: expected one number, found [3, 2]"), "{said}");
    let good = Run::text(&text).set("body.0.points_per_cell=[3, 3]").word("--check").attempt();
    assert_eq!(good.code, 0, "{}", good.stderr);
}

/// Young's modulus in MPa in place of Pa, a density in place of it: ratios without a unit tell.
#[test]
fn slips_of_units_are_warned_of() {
    let said = |set: &str| {
        let run = Run::text(&deck(&rectangle("b", [0.0, 0.0], [2.0, 1.0]))).set(set);
        let outcome = run.word("--check").attempt();
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        outcome.stdout
    };
    // 1000 kg/m3 x 1 m/s2 x 1 m over 1 MPa.
    let good = said("material.m.young=1e6");
    assert!(good.contains("rho g H / E = 0.001 with H = 1 m"), "{good}");
    assert!(!good.contains("check the units"), "{good}");
    let slip = said("material.m.young=1.0");
    assert!(slip.contains("rho g H / E = 1000 is far from usual values"), "{slip}");
    let slip = said(
        "material.m={ model = \"von-mises\", young = 1e6, poisson = 0.3, yield_stress = 10.0 }",
    );
    assert!(slip.contains("rho g H / strength = 122.5 is far from usual values"), "{slip}");
    let soil = |cohesion: &str, friction: &str| {
        said(&format!(
            "material.m={{ model = \"mohr-coulomb\", young = 1e6, poisson = 0.3, cohesion = {cohesion}, \
             friction = {friction}, dilation = 0.0 }}"
        ))
    };
    let good = soil("100.0", "30.0");
    assert!(good.contains("rho g H / cohesion = 10"), "{good}");
    assert!(!good.contains("far from usual") && !good.contains("in degrees"), "{good}");
    let slip = soil("0.1", "30.0");
    assert!(slip.contains("rho g H / cohesion = 10000 is far from usual values"), "{slip}");
    let slip = soil("100.0", "0.5236");
    assert!(slip.contains("is taken in degrees; as radians it would be 30 degrees"), "{slip}");
}

/// 1.9 t/m3 in place of 1900 kg/m3, where gravity and stiffness are in SI units.
#[test]
fn a_density_in_tonnes_is_warned_of() {
    let said = |density: &str| {
        let run = Run::text(&deck(&rectangle("b", [0.0, 0.0], [2.0, 1.0])))
            .set("load.0={ gravity = [0.0, -9.81] }")
            .set("material.m.young=1e7")
            .set(format!("body.0.density={density}"));
        let outcome = run.word("--check").attempt();
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        outcome.stdout
    };
    assert!(!said("1900.0").contains("that of foam"));
    let slip = said("1.9");
    assert!(slip.contains("density = 1.9 kg/m3 is that of foam"), "{slip}");
}

/// A corner that one boundary holds and another drives: 0 and 0.01 m are asked of one component.
#[test]
fn nodes_held_by_one_boundary_and_moved_by_another_are_told() {
    let text = deck(&rectangle("b", [0.0, 0.0], [2.0, 1.0]))
        + "[[boundary]]\nname = \"pulled\"\nwhere = { side = \"bottom\" }\n\
           displacement = { y = 0.01 }\n";
    let outcome = Run::text(&text).word("--check").attempt();
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let said = outcome.stdout;
    assert!(said.contains("boundary \"pulled\" moves it; it moves"), "{said}");
    assert!(said.contains("holds y of the node at [0.0, 0.0] m"), "{said}");
}

/// c = sqrt(E (1 - nu) / (1 + nu) / (1 - 2 nu) / rho) = 36.69 m/s; the lumped limit is h / c.
#[test]
fn a_check_with_cfl_tells_the_steps() {
    let run = Run::text(&deck(&rectangle("b", [0.0, 0.0], [2.0, 1.0])))
        .set("analysis={ type = \"explicit\", cfl = 0.5, duration = 10.0 }")
        .set("method.mass=\"lumped\"");
    let outcome = run.clone().word("--check").attempt();
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let said = outcome.stdout;
    assert!(
        said.contains("about 1468 steps") && said.contains("0.006812 s at the start"),
        "{said}"
    );
    let much = run.set("analysis.duration=1e9").word("--check").attempt().stdout;
    assert!(much.contains("choose a longer interval (output.every"), "{much}");
}

/// A deck on standard input, and the words that ask for help before PETSc hears them.
#[test]
fn standard_input_and_short_options() {
    use std::io::Write as _;
    use std::process::{Command, Stdio};
    let start = |words: &[&str]| {
        let mut job = Command::new(env!("CARGO_BIN_EXE_mpm-par"));
        job.args(words).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        job.spawn().expect("the program starts")
    };
    let mut job = start(&["-", "--check"]);
    let text = deck(&rectangle("b", [0.0, 0.0], [2.0, 1.0]));
    job.stdin.take().expect("a pipe").write_all(text.as_bytes()).expect("it reads");
    let output = job.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && said.contains("The deck is good"), "{said}");
    for (word, part) in [("-h", "Usage: mpirun"), ("-V", "mpm-par ")] {
        let output = start(&[word]).wait_with_output().expect("it ends");
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success() && said.contains(part), "{word}: {said}");
    }
}
/// A block that its weight drives out of the grid: the message told to take smaller steps.
#[test]
fn a_side_that_nothing_holds_is_named() {
    let text = deck(&rectangle("b", [1.0, 0.5], [2.0, 1.5])).replace("[\"x\", \"y\"]", "[\"x\"]");
    let run = Run::text(&text)
        .set("analysis={ type = \"explicit\", steps = 400, duration = 3.0 }")
        .set("output.every=1000")
        .set("method.mass=\"lumped\"");
    for ranks in [1, 2] {
        let outcome = run.clone().ranks(ranks).attempt();
        assert_eq!(outcome.code, 1, "{}", outcome.stderr);
        let said = format!("{}{}", outcome.stdout, outcome.said());
        for part in [
            "leaves the grid through its bottom side (y = 0 m), as no boundary holds that side",
            "where = { side = \"bottom\" } and fix = [\"y\"] makes it a wall",
            "body \"b\" can move along y freely under gravity",
        ] {
            assert!(said.contains(part), "no \"{part}\" in\n{said}");
        }
        assert!(!said.contains("smaller steps"), "{said}");
    }
}
