//! Bad input and faults of a run: the message word for word, the exit code, and what is left.

mod common;
#[path = "common/program.rs"]
mod program;

use std::fs;

use common::run::{PointTable, Run};
use program::{Running, wait_until};

/// A soft block on smooth ground under its own weight.
const BLOCK: &str = include_str!("decks/block.toml");

fn block() -> Run {
    Run::text(BLOCK)
}

/// The block with one piece of its deck replaced.
fn replaced(from: &str, to: &str) -> Run {
    assert!(BLOCK.contains(from), "{from}");
    Run::text(&BLOCK.replacen(from, to, 1))
}

/// The same message and code on one and two ranks, and no file but those that were there.
#[track_caller]
fn refused(run: &Run, code: i32, message: &str) {
    for ranks in [1, 2] {
        let outcome = run.clone().ranks(ranks).attempt();
        assert_eq!(outcome.said(), message, "on {ranks} ranks");
        assert_eq!(outcome.code, code, "on {ranks} ranks: {message}");
        let left = outcome.files();
        assert!(left.is_empty() || left == ["deck.toml"], "half-written: {left:?}");
    }
}

#[test]
fn decks_that_cannot_be_read() {
    refused(
        &Run::file("nowhere.toml"),
        2,
        "error: cannot read the deck nowhere.toml: No such file or directory (os error 2)",
    );
    refused(
        &replaced("steps = 2", "steps = = 2"),
        2,
        "error: deck.toml:5:9: not valid TOML: extra `=`, expected nothing
   |
 5 | steps = = 2
   |         ^",
    );
    refused(
        &block().set("analysis.stepz=3"),
        2,
        "error: --set analysis.stepz=3: analysis.stepz: unknown key \"stepz\"
   = did you mean \"steps\"?
   = known keys of [analysis]: type, symmetry, steps, duration, cfl, tolerance, max_iterations, on_failure, \
smallest_step, inverted_iterates, tangent, newmark_beta, newmark_gamma, hht_alpha, strength_tolerance, damping",
    );
    refused(
        &block().set("analysis.steps=\"many\""),
        2,
        "error: --set analysis.steps=\"many\": analysis.steps: expected a whole number >= 1, \
found the string \"many\"",
    );
    refused(
        &block().set("material.soil.poisson=0.5"),
        2,
        "error: --set material.soil.poisson=0.5: material.soil.poisson: expected a number > -1 \
and < 0.5, found 0.5",
    );
}

#[test]
fn bodies_that_do_not_fit() {
    let shape = "box = { min = [0, 0], max = [4, 3] }";
    refused(
        &replaced("points_per_cell = [2, 2]", "lattice = { spacing = 0.5, offset = [0.2, 0.2] }")
            .set("body.0.shape={ box = { min = [0, 0], max = [0.1, 0.1] } }"),
        2,
        "error: body \"block\" has no points: its shape holds no point of its seeding inside the \
grid; check shape, units and points_per_cell",
    );
    refused(
        &replaced(shape, "box = { min = [7, 0], max = [9, 3] }"),
        2,
        "error: deck.toml:29:9: body.0.shape: the body lies outside the grid: x from 7 to 9 m, \
the grid from 0 to 6 m
    |
 29 | shape = { box = { min = [7, 0], max = [9, 3] } }
    |         ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^",
    );
    refused(
        &replaced(shape, "box = { min = [3, 0], max = [7, 3] }"),
        2,
        "error: body \"block\" reaches outside the grid: its shape holds [6.125, 0.125], the grid \
goes from [0.0, 0.0] to [6.0, 4.0]; enlarge the grid, or move or cut the body",
    );
    // A shape without bounds ends at the grid.
    let outcome = replaced(shape, "where = \"y < 1\"").word("--check").attempt();
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    // Seeded by a lattice of its own: the point is named.
    let run = replaced("points_per_cell = [2, 2]", "lattice = { spacing = 0.5 }")
        .set("body.0.shape={ box = { min = [3, 1], max = [7, 2] } }");
    refused(
        &run,
        2,
        "error: body \"block\": point 19 at [6.5, 1.0] lies outside the grid; enlarge the grid or \
move the body",
    );
    let far = "{ box = { min = [0, 0], max = [1, 1e300] } }, { where = \"y < 1\" }";
    let run = replaced("points_per_cell = [2, 2]", "lattice = { spacing = 0.5 }")
        .set(format!("body.0.shape={{ intersection = [{far}] }}"));
    let outcome = run.attempt();
    assert_eq!(outcome.code, 2, "{}", outcome.stderr);
    assert!(outcome.stderr.contains("more places than can be numbered"), "{}", outcome.stderr);
    // The point is inside, a corner of its domain is not.
    let part =
        "{ box = { min = [1, 1], max = [3, 2] } }, { box = { min = [0, 0], max = [1, 0.1] } }";
    let run = replaced("points_per_cell = [2, 2]", "lattice = { spacing = 1.2, offset = [0, 0] }")
        .set(format!("body.0.shape={{ union = [{part}] }}"))
        .set("method.basis=\"cpdi2\"");
    refused(
        &run,
        2,
        "error: at the start corner 1 of point 0 is outside the grid at [-0.6, -0.6] m (the point is \
at [0.0, 0.0] m); enlarge the grid, or let the mesh follow the body",
    );
}

#[test]
fn domains_larger_than_a_cell() {
    refused(
        &replaced("points_per_cell = [2, 2]", "lattice = { spacing = 0.6, offset = [0.3, 0.3] }"),
        2,
        "error: deck.toml:30:23: body.0.lattice.spacing: expected at most the cell size 0.5 m: \
with basis = \"gimp\" a domain may not be larger than a cell, found 0.6 m
    |
 30 | lattice = { spacing = 0.6, offset = [0.3, 0.3] }
    |                       ^^^",
    );
}

/// As [`refused`], with a file of points beside the deck.
#[track_caller]
fn points_refused(content: &str, message: &str) {
    for ranks in [1, 2] {
        let outcome = with_points().ranks(ranks).attempt_in(beside(content));
        assert_eq!(outcome.said(), message, "on {ranks} ranks");
        assert_eq!(outcome.code, 2, "on {ranks} ranks: {message}");
        assert_eq!(outcome.files(), ["deck.toml", "points.csv"], "half-written");
    }
}

/// The block made of the points of a file.
fn with_points() -> Run {
    block().replaced(|deck| {
        let deck = deck.replace("shape = { box = { min = [0, 0], max = [4, 3] } }", POINTS);
        deck.replace("points_per_cell = [2, 2]\n", "")
    })
}

const POINTS: &str = "shape = { points = \"points.csv\" }";

fn beside(content: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("points.csv"), content).unwrap();
    folder
}

/// A file of points with these columns, on a grid of `n` by `n` squares of a quarter.
fn squares(n: usize, header: &str, rest: &str) -> String {
    let rows = (0..n * n).map(|k| {
        let at = |i: usize| 0.125 + 0.25 * i as f64;
        format!("{},{},0.0625{rest}\n", at(k % n), at(k / n))
    });
    format!("{header}\n{}", rows.collect::<String>())
}

#[test]
fn points_files_that_are_wrong() {
    let expected = "the header must read x,y,volume and may add vx,vy (points of body \"block\")";
    points_refused(
        "x,y,volume\n1,1,0.25\n# a comment\n2,1,0.36\n",
        "error: points.csv:4: volume 0.36 is that of a domain of width 0.6 m, expected at most the \
cell size 0.5 m: with basis = \"gimp\" a domain may not be larger than a cell (points of body \
\"block\")",
    );
    points_refused(
        "x,y,z,volume\n1,1,0,0.25\n",
        &format!("error: points.csv:1: unknown column \"z\" (the problem is 2D); {expected}"),
    );
    points_refused(
        "x,y,volume,velocity_x\n1,1,0.25,3\n",
        &format!(
            "error: points.csv:1: unknown column \"velocity_x\", did you mean \"vx\"?; {expected}"
        ),
    );
    points_refused(
        "x,y,volumes\n1,1,0.25\n",
        &format!(
            "error: points.csv:1: unknown column \"volumes\", did you mean \"volume\"?; {expected}"
        ),
    );
    points_refused(
        "x,y,x,volume\n1,1,1,0.25\n",
        &format!("error: points.csv:1: column \"x\" is there twice; {expected}"),
    );
    points_refused(
        "x,y,volume\n1,1,0.25\n2,1,0.25\n\n1.0,1e0,0.2\n",
        "error: points.csv:5: a second point at [1.0, 1.0] m, after that of line 2, whose mass would \
count twice (points of body \"block\")",
    );
    points_refused("x,y\n1,1\n", &format!("error: points.csv:1: no column \"volume\"; {expected}"));
    points_refused(
        "x,y,volume\n",
        "error: points.csv:1: a header and no points (points of body \"block\")",
    );
    refused(
        &with_points(),
        2,
        "error: deck.toml:29:20: body.0.shape.points: cannot read points.csv: No such file or \
directory (os error 2)
    |
 29 | shape = { points = \"points.csv\" }
    |                    ^^^^^^^^^^^^",
    );
    // Six digits of a third are not a wrong deck.
    let third = with_points().set("grid.h=0.333333333333333333").word("--check");
    let outcome = third.attempt_in(beside("x,y,volume\n0.2,0.1,0.111111\n0.5,0.1,0.111112\n"));
    assert!(!outcome.said().contains("domain"), "{}", outcome.stderr);
}

/// The velocities of a file of points are theirs, unless the deck gives the body one.
#[test]
fn points_keep_the_velocities_of_their_file() {
    let content = squares(8, "x,y,volume,vx,vy", ",0.5,0.25");
    let run = with_points()
        .set("analysis={ type = \"explicit\", steps = 1, duration = 1e-6 }")
        .set("ghost.stiffness_factor=")
        .set("ghost.mass_factor=0.25")
        .set("boundary=[]")
        .set("load=[]")
        .set("output.fields=[\"velocity\"]")
        .ranks(2);
    for (run, expected) in
        [(run.clone(), [0.5, 0.25]), (run.set("body.0.velocity=[\"1\", \"0.125\"]"), [1.0, 0.125])]
    {
        let outcome = run.attempt_in(beside(&content));
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        let points = outcome.results().points(0);
        for (component, expected) in expected.into_iter().enumerate() {
            assert!(points.component("velocity", component).iter().all(|v| *v == expected));
        }
    }
}

#[test]
fn formulas_without_a_value_at_the_start() {
    refused(
        &replaced("gravity = [0, -20]", "body_force = [\"1/0\", \"0\"]"),
        2,
        "error: deck.toml:43:14: load.0.body_force: x is inf N/m3 at point 0 at [0.125, 0.125] m, s \
= 0: the expression is not finite there
    |
 43 | body_force = [\"1/0\", \"0\"]
    |              ^^^^^^^^^^^^",
    );
    // First seen at the end of the first step, on the rank that holds the other end of the block.
    refused(
        &replaced("gravity = [0, -20]", "body_force = [0, \"if(s > 0 && x > 3.8, sqrt(-1), 0)\"]"),
        2,
        "error: deck.toml:43:14: load.0.body_force: y is NaN N/m3 at point 29 at [3.875, 0.125] m, s \
= 0.5: the expression is not finite there
    |
 43 | body_force = [0, \"if(s > 0 && x > 3.8, sqrt(-1), 0)\"]
    |              ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^",
    );
    // A formula of s alone, and a force whose formula has a value where its derivatives have none.
    let point = "point = { body = \"block\", nearest = [[3.9, 0.1]], force = [0, \"1/s\"] }";
    let outcome = replaced("gravity = [0, -20]", point).attempt();
    assert_eq!(outcome.code, 2, "{}", outcome.stderr);
    for words in ["load.0.point.force: y is inf N at point ", "not finite", "\n 43 | point = "] {
        assert!(outcome.stderr.contains(words), "{}", outcome.stderr);
    }
    let made = "manufactured = [\"0.001*sqrt(X - 0.125)\", \"0\"]";
    let outcome = replaced("gravity = [0, -20]", made).attempt();
    assert_eq!(outcome.code, 2, "{}", outcome.stderr);
    for words in ["load.0.manufactured: ", "\n 43 | manufactured = "] {
        assert!(outcome.stderr.contains(words), "{}", outcome.stderr);
    }
    // The key is told once.
    assert!(!outcome.stderr.contains("load.manufactured"), "{}", outcome.stderr);
    // A run that ends before the formula has no value; its first step follows the stability limit.
    let short = replaced("gravity = [0, -20]", "gravity = [0, \"-20*sqrt(0.5 - t)\"]")
        .set("analysis={ type = \"explicit\", cfl = 0.5, duration = 1e-3 }");
    let outcome = short.word("--check").attempt();
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let explicit = block().set("analysis={ type = \"explicit\", steps = 10, duration = 1e-3 }");
    refused(
        &explicit.set("body.0.velocity=[0, \"ln(0.5 - X)\"]"),
        2,
        "error: --set body.0.velocity=[0, \"ln(0.5 - X)\"]: body.0.velocity: y is NaN m/s at point 4 \
at [0.625, 0.125] m: the expression is not finite there",
    );
    refused(
        &replaced("fix = [\"x\"]", "displacement = { x = \"if(Y > 2.9, 1/0, 0)\" }"),
        2,
        "error: deck.toml:40:16: boundary.1.displacement: boundary \"symmetry\" moves x of the node \
at [0.0, 3.0] by inf: its expression is not finite there
    |
 40 | displacement = { x = \"if(Y > 2.9, 1/0, 0)\" }
    |                ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^",
    );
}

/// Pieces are found across ranks, and only those that nothing holds are refused.
#[test]
fn pieces_that_nothing_holds() {
    let boxes = |list: &str| format!("body.0.shape={{ union = [{list}] }}");
    let beside = "{ box = { min = [0, 0], max = [2, 1] } }";
    let away = boxes(&format!("{beside}, {{ box = {{ min = [4, 2], max = [5, 3] }} }}"));
    refused(
        &block().set(&away),
        2,
        "error: a piece of body \"block\" that shares no grid node with the rest, the one with \
point 32 at [4.125, 2.125] m, can move along x freely: no boundary holds the nodes around it \
against this, so that the quasi-static system is singular; check the places and components of \
[[boundary]]",
    );
    // On the ground the second piece can still slide; the first is held.
    let slides = boxes(&format!("{beside}, {{ box = {{ min = [4, 0], max = [5, 1] }} }}"));
    let outcome = block().set(&slides).ranks(2).attempt();
    assert_eq!(outcome.code, 2, "{}", outcome.stderr);
    assert!(outcome.said().contains("point 16 at [4.125, 0.125] m, can move along x freely"));
    // Rough ground holds both; so does a touch at one node, as far as can be seen.
    let rough = block().set(&slides).set("boundary.0.fix=[\"x\", \"y\"]").word("--check");
    let touching = boxes(&format!("{beside}, {{ box = {{ min = [2, 1], max = [3, 2] }} }}"));
    let touching = block().set(&touching).word("--check");
    for run in [rough, touching] {
        for ranks in [1, 2] {
            let outcome = run.clone().ranks(ranks).attempt();
            assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        }
    }
    // Two bodies, one upon the other: only the lower one stands on the ground.
    let second = |min: f64| {
        let top = min + 1.0;
        format!(
            "\n[[body]]\nname = \"upper\"\nmaterial = \"soil\"\ndensity = 1000.0\nshape = {{ box = {{ \
             min = [0, {min}], max = [2, {top}] }} }}\n"
        )
    };
    let stack =
        |min| Run::text(&(BLOCK.replace("max = [4, 3]", "max = [4, 1]") + &second(min))).ranks(2);
    assert_eq!(stack(1.0).word("--check").attempt().code, 0);
    let apart = stack(2.0).attempt();
    assert_eq!(apart.code, 2);
    assert!(apart.said().starts_with("error: body \"upper\" can move along y freely: "));
}

/// A strip that goes up and down through slabs of the grid: each rank sees several pieces of what
/// is one, along the slabs and across them. With a link left out it is two.
#[test]
fn pieces_that_other_ranks_join() {
    let strip = |links: &[usize], upright: bool| {
        let part = |x: [f64; 2], y: [f64; 2]| {
            let (x, y) = if upright { (y, x) } else { (x, y) };
            format!("{{ box = {{ min = [{}, {}], max = [{}, {}] }} }}", x[0], y[0], x[1], y[1])
        };
        let posts = (0..5).map(|k| 2.0 * k as f64).map(|x| part([x, x + 0.5], [0.0, 4.0]));
        let links = links.iter().map(|&k| {
            let x = 2.0 * k as f64;
            part([x, x + 2.5], if k % 2 == 0 { [0.0, 0.5] } else { [3.5, 4.0] })
        });
        let parts: Vec<String> = posts.chain(links).collect();
        let (size, side) = if upright { ("[4, 9]", "bottom") } else { ("[9, 4]", "left") };
        block()
            .set(format!("grid.size={size}"))
            .set("parallel={ brick = 1, initial = \"slabs\" }")
            .set(format!("body.0.shape={{ union = [{}] }}", parts.join(", ")))
            .set(format!("boundary=[{{ where = {{ side = \"{side}\" }}, fix = [\"x\", \"y\"] }}]"))
            .word("--check")
    };
    for (upright, far) in [(false, "[6.125, 0.125]"), (true, "[0.125, 6.125]")] {
        for ranks in [1, 2, 3] {
            let whole = strip(&[0, 1, 2, 3], upright).ranks(ranks).attempt();
            assert_eq!(whole.code, 0, "{ranks} ranks: {}", whole.stderr);
            let parted = strip(&[0, 1, 3], upright).ranks(ranks).attempt();
            assert_eq!(parted.code, 2, "{ranks} ranks: {}", parted.stdout);
            let text = parted.said();
            assert!(text.starts_with("error: a piece of body \"block\" that shares no"), "{text}");
            assert!(text.contains(&format!(" at {far} m, can move along x freely")), "{text}");
        }
    }
}

#[test]
fn conditions_on_nothing() {
    refused(
        &replaced("side = \"left\"", "box = { min = [5.1, 3.1], max = [5.2, 3.2] }"),
        2,
        "error: deck.toml:39:17: boundary.1.where.box: holds no node of the grid: none has x from \
5.1 to 5.2 m; nearest: 5 and 5.5 m
    |
 39 | where = { box = { min = [5.1, 3.1], max = [5.2, 3.2] } }
    |                 ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^",
    );
    refused(
        &replaced("gravity = [0, -20]", "point = { nearest = [[4, 3], [50, 3]], force = [0, -1] }"),
        2,
        "error: deck.toml:43:21: load.0.point.nearest: [50.0, 3.0] m is 46.13 m away from the nearest \
point of body \"block\", which is at [3.875, 2.875] m; expected a place within a cell of it (0.8839 m)
    |
 43 | point = { nearest = [[4, 3], [50, 3]], force = [0, -1] }
    |                     ^^^^^^^^^^^^^^^^^",
    );
    // A wall ahead of the body may be meant.
    let wall = "\n[[boundary]]\nname = \"wall\"\nwhere = { side = \"right\" }\nfix = [\"x\"]\n";
    for ranks in [1, 2] {
        let outcome = Run::text(&format!("{BLOCK}{wall}")).ranks(ranks).attempt();
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        let warnings = |text: &str| text.matches("warning: ").count();
        let log = outcome.results().text("log.txt");
        assert_eq!(warnings(&log), 1, "{log}");
        assert!(log.contains("warning: boundary \"wall\" acts on nothing at the start"), "{log}");
    }
}

/// The run is as good without the figure.
#[test]
fn figures_of_merit_without_a_value() {
    for norm in ["max", "volume-l1", "volume-l2"] {
        for ranks in [1, 2] {
            let results = block()
                .set(format!(
                    "verify=[{{ name = \"e\", field = \"stress.yy\", norm = \"{norm}\", exact = \
                     \"if(X < 1, sqrt(-1), 0)\" }}, {{ name = \"d\", field = \"J\", norm = \"max\", \
                     exact = \"1\" }}]"
                ))
                .ranks(ranks)
                .results();
            assert!(results.summary["verify"]["e"].is_null(), "{norm} on {ranks} ranks");
            assert!(results.verify("d") > 0.0);
            let log = results.text("log.txt");
            assert!(log.contains("warning: verify \"e\" has no value (at point 0, [0.1"), "{log}");
            assert!(log.contains("against [NaN]): summary.json says null"), "{log}");
            assert_eq!(log.matches("warning: ").count(), 1, "{log}");
        }
    }
}

#[test]
fn problems_larger_than_the_machine() {
    let run = block()
        .set("grid.size=[60000, 40000]")
        .set("body.0.shape={ box = { min = [0, 0], max = [40000, 30000] } }");
    let mesh = "grid={ type = \"mesh\", generate = { box = { min = [0, 0], max = [1, 1], cells = \
                [3000000, 3000000] } } }";
    let mesh = block().set(mesh).set("method.basis=mpm").set("body.0.shape={ cells = \"all\" }");
    let mesh = mesh.set("boundary=[{ where = { tag = \"left\" }, fix = [\"x\", \"y\"] }]");
    for (run, size) in [
        (run.clone(), "about 1.9e10 points and 4.8e9 active nodes need 21.0 TB on this machine, "),
        (run.word("--check"), "about 1.9e10 points and 4.8e9 active nodes need 21.0 TB"),
        (mesh, "about 3.6e13 points and 9.0e12 active nodes in a mesh of 9.0e12 cells need "),
    ] {
        for ranks in [1, 2] {
            let outcome = run.clone().ranks(ranks).attempt();
            let text = outcome.said();
            assert_eq!(outcome.code, 2, "{text}");
            let start = format!("error: the problem is too large: {size}");
            assert!(text.starts_with(&start), "{text}");
            assert_eq!(outcome.files(), ["deck.toml"]);
        }
    }
}

#[test]
fn systems_that_nothing_holds() {
    let begin = BLOCK.find("[[boundary]]").unwrap();
    let end = BLOCK.find("[[load]]").unwrap();
    refused(
        &Run::text(&format!("{}{}", &BLOCK[..begin], &BLOCK[end..])),
        2,
        "error: deck.toml: boundary: no [[boundary]]: nothing holds the bodies, so that the \
quasi-static system is singular (any rigid motion solves it)
   = for example a [[boundary]] with fix = [\"x\", \"y\"]",
    );
    refused(
        &replaced("fix = [\"x\"]", "fix = [\"y\"]"),
        2,
        "error: deck.toml: boundary: no [[boundary]] holds x: the bodies can move rigidly along \
it, so that the quasi-static system is singular
   = for example a [[boundary]] with fix = [\"x\"]",
    );
    // Named, but nothing of the body is there.
    let away = block().set("boundary.1.where={ box = { min = [5, 0], max = [6, 4] } }");
    refused(
        &away,
        2,
        "error: body \"block\" can move along x freely: no boundary holds the nodes around it \
against this, so that the quasi-static system is singular; check the places and components of \
[[boundary]]",
    );
    // One node held: the body can turn about it.
    let hinge = block()
        .set("boundary.0.where={ box = { min = [0, 0], max = [0, 0] } }")
        .set("boundary.0.fix=[\"x\", \"y\"]")
        .set("boundary.1.where={ box = { min = [0, 0], max = [0, 0] } }");
    refused(
        &hinge,
        2,
        "error: body \"block\" can turn freely: no boundary holds the nodes around it against \
this, so that the quasi-static system is singular; check the places and components of [[boundary]]",
    );
}

#[test]
fn options_that_the_solver_does_not_know() {
    let message = "error: unknown PETSc option -qs_ksp_tipe; did you mean -qs_ksp_type?";
    refused(&block().word("-qs_ksp_tipe").word("cg"), 2, message);
    refused(&block().set("petsc={ qs_ksp_tipe = \"cg\" }"), 2, message);
    refused(&block().env("PETSC_OPTIONS", "-qs_ksp_tipe cg"), 2, message);
    refused(
        &block().word("--forse"),
        2,
        "error: unexpected argument '--forse' found

  tip: a similar argument exists: '--force'

Usage: mpirun -n N mpm-par INPUT.toml [--set KEY=VALUE]... [--out DIR] [--check] \
[--restart FILE|last] [--force] [--quiet|--verbose] [PETSc options]

For more information, try '--help'.",
    );
}

#[test]
fn results_that_are_in_the_way() {
    for ranks in [1, 2] {
        let run = block().ranks(ranks);
        let first = run.attempt();
        assert_eq!(first.code, 0, "{}", first.stderr);
        let before = program::contents(&first.folder.path().join("out"));
        let second = run.attempt_in(first.folder);
        assert_eq!(second.code, 2);
        assert_eq!(
            second.said(),
            format!(
                "error: out already holds results ({} files): give --force to replace them, --out \
                 DIR to write elsewhere, or --restart last to continue\n    --force replaces: \
                 domains.xdmf, grid-000001.h5, grid-000002.h5, grid.xdmf, history.csv, log.txt, \
                 points-000000.h5 to points-000002.h5 (3 files), points.xdmf, \
                 report.html, residuals.csv, resolved.toml, summary.json",
                // The copy of the deck is that of this run already.
                before.len() - 1
            )
        );
        assert!(program::contents(&second.folder.path().join("out")) == before);
        // --check looks at nothing but the deck, and --force replaces the results.
        let check = run.clone().word("--check").attempt_in(second.folder);
        assert_eq!(check.code, 0, "{}", check.stderr);
        assert!(program::contents(&check.folder.path().join("out")) == before);
        let mine = check.folder.path().join("out/notes.md");
        fs::write(&mine, "mine").unwrap();
        let forced = run.clone().word("--force").set("analysis.steps=1").attempt_in(check.folder);
        assert_eq!(forced.code, 0, "{}", forced.stderr);
        assert_eq!(fs::read_to_string(&mine).unwrap(), "mine", "another's file");
        assert!(!forced.folder.path().join("out/points-000002.h5").exists(), "an old file");
    }
}

#[test]
fn places_that_cannot_be_written() {
    // A file where the directory should be; a directory that nobody may make.
    refused(
        &block().word("--out").word("deck.toml"),
        3,
        "error: cannot create the results directory deck.toml: File exists (os error 17)",
    );
    refused(
        &block().word("--out").word("/proc/nothing/here"),
        3,
        "error: cannot create the results directory /proc/nothing/here: No such file or \
directory (os error 2)",
    );
}

/// One rank cannot go on: all end, with its message, once.
#[test]
fn one_rank_that_fails_ends_all() {
    for ranks in [1, 2, 3] {
        // Not a number where x > 3.5: no other rank than the one that holds this end sees it.
        let outcome = replaced(
            "gravity = [0, -20]",
            "body_force = [\"0\", \"if(x > 3.6 && s > 0.5, sqrt(-1), -2e4)\"]",
        )
        .ranks(ranks)
        .attempt();
        assert_eq!(outcome.code, 1, "{}", outcome.stderr);
        let text = outcome.said();
        assert_eq!(text.matches("error: ").count(), 1, "{text}");
        assert!(text.starts_with("error: step 2: the load on point "), "{text}");
        assert!(text.contains("is not finite ([0.0, NaN] N at s = 1)"), "{text}");
        assert!(text.ends_with("results: out, good up to step 1"), "{text}");
        // No numerics heals a formula.
        assert!(!text.contains("try"), "{text}");
        assert_eq!(outcome.results().summary["status"], "failed");
    }
}

/// A formula that loses its value on the way, in dynamics: no advice, and the last state is there.
#[test]
fn formulas_that_lose_their_value_later() {
    for (kind, step) in [
        ("explicit", "step 12 (to t = 1.200000e-2 s): "),
        ("implicit-dynamic", "step 11 of 20 (t = 1.100000e-2 s): "),
    ] {
        let run = block()
            .set(format!("analysis.type=\"{kind}\""))
            .set("ghost={ mass_factor = 0.25 }")
            .set("analysis.steps=20")
            .set("analysis.duration=0.02")
            .set("load=[{ body_force = [\"0\", \"if(t > 0.0105, sqrt(-1), -2e4)\"] }]");
        for ranks in [1, 2] {
            let outcome = run.clone().ranks(ranks).attempt();
            let text = outcome.said();
            assert_eq!(outcome.code, 1, "{text}");
            assert!(text.starts_with(&format!("error: {step}the load on point ")), "{text}");
            assert!(text.contains("check the expressions of [[load]]"), "{text}");
            assert!(!text.contains("try"), "{text}");
            assert_eq!(outcome.results().summary["status"], "failed");
        }
    }
}

/// A step refused once and halved is bit by bit two steps of half the size, and the next one is
/// whole again.
#[test]
fn cut_steps_restore_the_state_exactly_and_grow_back() {
    for ranks in [1, 2] {
        let strict = |steps: usize, policy: &str| {
            // All of the load comes in the first half.
            replaced("gravity = [0, -20]", "body_force = [\"0\", \"-1.2e5 * min(1, 2 * s)\"]")
                .set("analysis.max_iterations=5")
                .set(format!("analysis.steps={steps}"))
                .set(format!("analysis.on_failure=\"{policy}\""))
                .ranks(ranks)
        };
        let stopped = strict(2, "stop").attempt();
        assert_eq!(stopped.code, 1, "{}", stopped.stderr);
        assert_eq!(stopped.results().count("steps_completed"), 0);
        let cut = strict(2, "cut").results();
        assert_eq!(cut.history("load_factor"), [0.25, 0.5, 1.0]);
        assert_eq!(cut.history("cuts"), [1.0, 1.0, 1.0]);
        assert_eq!(cut.count("steps_completed"), 2);
        let quarters = strict(4, "stop").results();
        for field in ["displacement", "stress"] {
            assert_eq!(cut.points(1).field(field), quarters.points(2).field(field), "{field}");
        }
    }
}

/// The deck with every default, run again, gives the same bits.
#[test]
fn the_resolved_deck_runs_to_the_same_results() {
    let first = block().set("body.0.points_per_cell=[3, 2]").ranks(2).results();
    let again = Run::file(first.directory.join("resolved.toml")).ranks(2).results();
    let last = [first.points(2), again.points(2)];
    for field in ["displacement", "stress"] {
        assert_eq!(last[0].field(field), last[1].field(field), "{field}");
    }
    assert_eq!(first.text("resolved.toml"), again.text("resolved.toml"));
    assert_eq!(first.text("residuals.csv"), again.text("residuals.csv"));
}

/// PETSc's profile is asked for in the deck, and comes.
#[test]
fn petsc_options_of_the_deck_are_there_before_petsc_starts() {
    for run in [block().set("petsc={ log_view = true }"), block().word("-log_view")] {
        let outcome = run.ranks(2).attempt();
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        assert!(outcome.stdout.contains("Event Stage 0"), "{}", outcome.stdout);
        assert!(outcome.stdout.contains("SNESSolve"), "{}", outcome.stdout);
    }
}

/// Everything written before a kill -9 can be read: each file that the series names is whole.
#[test]
fn a_killed_run_is_readable() {
    let folder = tempfile::tempdir().unwrap();
    let (deck, out) = (folder.path().join("deck.toml"), folder.path().join("out"));
    fs::write(&deck, BLOCK.replacen("steps = 2", "steps = 5000", 1)).unwrap();
    let mut run = Running::start(2, &deck, &out, &[]);
    wait_until(|| out.join("points-000003.h5").exists());
    run.kill();
    let series = fs::read_to_string(out.join("points.xdmf")).unwrap();
    let mut frames = 0;
    for name in series.split(['>', '<', ':', '\n']).map(str::trim) {
        if name.ends_with(".h5") {
            let table = PointTable::read(&out.join(name));
            assert_eq!(table.id.len(), 192, "{name}");
            assert!(table.field("displacement").iter().all(|u| u.is_finite()));
            frames += 1;
        }
    }
    assert!(frames >= 3, "{frames} frames\n{series}");
    let rows = fs::read_to_string(out.join("history.csv")).unwrap();
    let width = rows.lines().next().unwrap().split(',').count();
    assert!(rows.lines().count() >= 3);
    assert!(rows.lines().all(|row| row.split(',').count() == width), "a torn row");
}
