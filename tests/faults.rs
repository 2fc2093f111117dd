//! Bad input and faults of a run: the message word for word, the exit code, and what is left.

mod common;
#[path = "common/program.rs"]
mod program;

use std::fs;

use common::run::{Outcome, PointTable, Run};
use program::{Running, wait_until};

/// A soft block on smooth ground under its own weight.
const BLOCK: &str = r#"title = "Block"

[analysis]
type = "quasi-static"
steps = 2
tolerance = 1e-9

[method]
basis = "gimp"
domain_update = "stretch"

[ghost]
stiffness_factor = 1.0

[grid]
type = "lattice"
size = [6, 4]
h = 0.5

[material.soil]
model = "hencky"
young = 1e6
poisson = 0.3

[[body]]
name = "block"
material = "soil"
density = 1000.0
shape = { box = { min = [0, 0], max = [4, 3] } }
points_per_cell = [2, 2]

[[boundary]]
name = "ground"
where = { side = "bottom" }
fix = ["y"]

[[boundary]]
name = "symmetry"
where = { side = "left" }
fix = ["x"]

[[load]]
gravity = [0, -20]
"#;

fn block() -> Run {
    Run::text(BLOCK)
}

/// The block with one piece of its deck replaced.
fn replaced(from: &str, to: &str) -> Run {
    assert!(BLOCK.contains(from), "{from}");
    Run::text(&BLOCK.replacen(from, to, 1))
}

/// What the program said on its error channel, without what mpirun adds.
fn said(outcome: &Outcome) -> String {
    let text = outcome.stderr.split("-----").next().unwrap_or_default();
    let scratch = format!("{}/", outcome.folder.path().display());
    text.trim_end().replace(&scratch, "")
}

/// The same message and code on one and two ranks, and no file but those that were there.
#[track_caller]
fn refused(run: &Run, code: i32, message: &str) {
    for ranks in [1, 2] {
        let outcome = run.clone().ranks(ranks).attempt();
        assert_eq!(said(&outcome), message, "on {ranks} ranks");
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
   = known keys of [analysis]: type, steps, duration, cfl, tolerance, max_iterations, on_failure, \
smallest_step, inverted_iterates, newmark_beta, newmark_gamma, hht_alpha",
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
        &replaced(shape, "box = { min = [0, 0], max = [0.1, 0.1] }"),
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
[--restart FILE|last] [--force] [PETSc options]

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
            said(&second),
            format!(
                "error: out already holds results ({} files, e.g. domains.xdmf): give --force to \
                 replace them, --out DIR to write elsewhere, or --restart last to continue",
                before.len()
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
        let text = said(&outcome);
        assert_eq!(text.matches("error: ").count(), 1, "{text}");
        assert!(text.starts_with("error: step 2: the load on point "), "{text}");
        assert!(text.contains("is not finite ([0.0, NaN] N at s = 1)"), "{text}");
        assert!(text.ends_with("results: out, good up to step 1"), "{text}");
        assert_eq!(outcome.results().summary["status"], "failed");
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
