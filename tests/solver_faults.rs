//! Solvers that fail on one rank, and options that PETSc cannot work with: the same message and
//! exit code on any number of ranks, and no rank that waits for another for ever (the time limit of
//! a run ends it).

mod common;

use common::at_once::at_once;
use common::left;
use common::run::Run;

/// A soft block on smooth ground under its own weight, without Ghost stiffness.
fn block() -> Run {
    Run::text(include_str!("decks/block.toml")).set("ghost=off")
}

fn with(words: &str) -> Run {
    words.split_whitespace().fold(block(), |run, word| run.word(word))
}

/// Refused as bad input with this message, on `ranks`, and nothing is left.
#[track_caller]
fn refused_on(ranks: &[usize], run: &Run, message: &str) {
    for &ranks in ranks {
        let outcome = run.clone().ranks(ranks).attempt();
        assert_eq!(outcome.said(), message, "on {ranks} ranks");
        assert_eq!(outcome.code, 2, "on {ranks} ranks: {message}");
        assert_eq!(outcome.files(), ["deck.toml"], "on {ranks} ranks: {message}");
    }
}

#[track_caller]
fn refused(run: &Run, message: &str) {
    refused_on(&[1, 2, 3], run, message);
}

/// A piece of the body that may turn about the one node by which it hangs, which is not seen before
/// solving.
fn loose_piece() -> Run {
    block().set("method.basis=mpm").set("body.0.points_per_cell=1").set(
        "body.0.shape={ union = [{ box = { min = [0, 0], max = [1, 1] } }, \
         { box = { min = [1, 1], max = [1.5, 1.5] } }] }",
    )
}

const SINGULAR: &str =
    "error: step 1 of 2 could not be solved: Newton's method failed (the linear \
solver ended with DIVERGED_PC_FAILED (zero pivot: the matrix is singular) after 0 iterations); the \
last finished step is 0
    try: stabilise small overlaps: leave out ghost = \"off\"
    try: let steps be cut: analysis.on_failure = \"cut\"
    try: more, smaller steps: analysis.steps
results: out, good up to step 0";

/// The factors are one rank's, and only that rank sees that they do not exist.
#[test]
fn a_singular_system_ends_all_ranks_with_one_message() {
    for ranks in [1, 2, 3] {
        let outcome = loose_piece().ranks(ranks).attempt();
        assert_eq!(outcome.said(), SINGULAR, "on {ranks} ranks");
        assert_eq!(outcome.code, 1, "on {ranks} ranks");
    }
}

/// The failed solve leaves nothing behind that the next try would stumble over.
#[test]
fn a_singular_system_is_tried_again_in_smaller_steps() {
    for ranks in [1, 2, 3] {
        let run = loose_piece().set("analysis.on_failure=\"cut\"").ranks(ranks);
        let outcome = run.set("analysis.smallest_step=0.2").attempt();
        assert_eq!(outcome.code, 1, "{}", outcome.stderr);
        assert_eq!(outcome.stdout.matches("step 1 refused").count(), 3, "{}", outcome.stdout);
        assert_eq!(outcome.results().summary["status"], "stopped");
    }
}

/// Solvers inside solvers that run on some ranks only. The last level of multigrid has factors for this
/// matrix, and the iteration runs away.
#[test]
fn a_singular_system_fails_in_blocks_and_under_multigrid_too() {
    let run_away = SINGULAR.replace(
        "DIVERGED_PC_FAILED (zero pivot: the matrix is singular) after 0 iterations",
        "DIVERGED_DTOL after 1 iterations",
    );
    let cases = [
        ("-qs_ksp_type preonly -qs_pc_type bjacobi -qs_sub_pc_type lu", SINGULAR),
        ("-qs_ksp_type cg -qs_pc_type bjacobi -qs_sub_pc_type lu", SINGULAR),
        ("-qs_ksp_type preonly -qs_pc_type redundant", SINGULAR),
        ("-qs_ksp_type cg -qs_pc_type mg -qs_ksp_max_it 40", &run_away),
    ];
    at_once(cases, |(words, message)| {
        for ranks in [2, 3] {
            let run = words.split(' ').fold(loose_piece(), |run, word| run.word(word));
            let outcome = run.ranks(ranks).attempt();
            assert_eq!(outcome.said(), message, "{words} on {ranks} ranks");
            assert_eq!(outcome.code, 1, "{words} on {ranks} ranks");
        }
    });
}

#[test]
fn nonlinear_solvers_that_do_not_suit() {
    at_once(["ksponly", "qn", "aspin", "nrichardson"], |kind| {
        let message = format!(
            "error: -qs_snes_type {kind}: the equations are solved by newtonls or newtontr"
        );
        refused_on(&[1, 2], &with(&format!("-qs_snes_type {kind}")), &message);
    });
    refused(
        &block().set("petsc={ qs_snes_type = \"qn\" }"),
        "error: -qs_snes_type qn: the equations are solved by newtonls or newtontr",
    );
    refused_on(
        &[1, 2],
        &with("-qs_snes_lag_jacobian 2"),
        "error: -qs_snes_lag_jacobian 2: the tangent is assembled with every residual",
    );
    for kind in ["newtonls", "newtontr"] {
        with(&format!("-qs_snes_type {kind}")).ranks(2).results();
    }
}

/// A line search that ends the iteration by a measure of its own has not met the tolerance.
#[test]
fn a_line_search_does_not_judge_the_step() {
    let run = with("-qs_snes_linesearch_type cp -qs_snes_linesearch_atol 1e300");
    for ranks in [1, 2] {
        let outcome = run.clone().ranks(ranks).attempt();
        let said = outcome.said();
        assert_eq!(outcome.code, 1, "{said}");
        assert!(said.contains("the line search ended the iteration above the tolerance"), "{said}");
    }
}

#[test]
fn values_that_petsc_refuses() {
    let message =
        "error: PETSc does not accept -qs_ksp_rtol abc: Input string abc has no numeric value";
    // Read by the run, or by none of its solvers; from the command line, or from the deck.
    refused(&with("-qs_ksp_type cg -qs_pc_type jacobi -qs_ksp_rtol abc"), message);
    refused_on(&[1, 2], &with("-qs_ksp_rtol abc"), message);
    refused_on(&[1, 2], &block().set("petsc={ qs_ksp_rtol = \"abc\" }"), message);
    refused_on(
        &[1, 2],
        &with("-qs_ksp_max_it -5"),
        "error: -qs_ksp_max_it -5: expected a number >= 0",
    );
    for (ranks, matrix) in [(1, "seqaij"), (2, "mpiaij")] {
        refused_on(
            &[ranks],
            &with("-qs_pc_type lu -qs_pc_factor_mat_solver_type foo"),
            &format!(
                "error: PETSc does not accept -qs_pc_factor_mat_solver_type foo -qs_pc_type lu: \
                 Could not locate solver type foo for factorization type LU and matrix type \
                 {matrix}. Perhaps you must ./configure with --download-foo"
            ),
        );
    }
}

#[test]
fn preconditioners_that_the_ranks_cannot_have() {
    let words = "-qs_ksp_type gmres -qs_pc_type ilu";
    refused_on(
        &[2, 3],
        &with(words),
        "error: PETSc does not accept -qs_ksp_type gmres -qs_pc_type ilu: Could not locate a solver \
         type for factorization type ILU and matrix type mpiaij.",
    );
    with(words).ranks(1).set("ghost.stiffness_factor=1.0").results();
}

#[test]
fn files_of_options_that_cannot_be_read() {
    refused(
        &with("-options_file nowhere"),
        "error: -options_file nowhere: cannot be read: No such file or directory (os error 2)",
    );
}

#[test]
fn files_that_viewers_cannot_write() {
    for name in ["-log_view", "-qs_ksp_view", "-qs_ksp_monitor"] {
        refused_on(
            &[1, 2],
            &with(&format!("{name} :nowhere/x")),
            &format!(
                "error: {name} :nowhere/x: cannot be written: No such file or directory (os error 2)"
            ),
        );
    }
    for ranks in [1, 2] {
        let outcome = with("-log_view :profile -qs_ksp_view :solver").ranks(ranks).attempt();
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        let files = outcome.files();
        assert!(files.contains(&"profile".into()) && files.contains(&"solver".into()), "{files:?}");
    }
}

/// Those of the run are looked at, and named.
#[test]
fn options_that_go_well_together_pass() {
    for words in [
        "-qs_ksp_type cg -qs_pc_type gamg",
        "-qs_ksp_type gmres -qs_ksp_pc_side right -qs_pc_type asm -qs_sub_pc_type lu",
        "-qs_pc_type cholesky -qs_mat_mumps_icntl_14 50 -mass_ksp_rtol 1e-10",
    ] {
        with(words).set("ghost.stiffness_factor=1.0").ranks(2).results();
    }
    refused_on(
        &[1, 2],
        &with("-qs_ksp_type cg -qs_pc_type mg -qs_mg_levels_pc_type sor"),
        "error: PETSc does not accept -qs_ksp_type cg -qs_mg_levels_pc_type sor -qs_pc_type mg: SOR \
         and Eisenstat's form of it need the entries of the matrix, and the levels of multigrid \
         (pc_type mg) have only products: use mg_levels_pc_type jacobi, or pc_type gamg",
    );
}

/// What the trial of a file cannot foresee: one line, and all ranks end.
#[test]
fn files_that_fail_at_the_start_and_at_the_end() {
    let at_the_end = "could not be ended in order: Cannot open PetscViewer file: link";
    for (words, kind, message, code) in [
        ("-info link", "error", "could not be started: Unable to open file link.0", 4),
        // The run is complete.
        ("-log_view :link", "warning", at_the_end, 0),
    ] {
        for ranks in [1, 2, 3] {
            let folder = tempfile::tempdir().unwrap();
            for link in ["link", "link.0"] {
                std::os::unix::fs::symlink("nowhere/x", folder.path().join(link)).unwrap();
            }
            let outcome = with(words).ranks(ranks).attempt_in(folder);
            // mpirun may add words of its own on how hard it is to stop all.
            let text = outcome.said();
            let first = text.lines().next();
            let expected = format!("{kind}: PETSc {message}");
            assert_eq!(first, Some(&expected[..]), "{words} on {ranks} ranks: {text}");
            assert_eq!(text.matches(": PETSc ").count(), 1, "{words} on {ranks} ranks: {text}");
            assert_eq!(outcome.code, code, "{words} on {ranks} ranks");
        }
    }
}

/// PETSc opens a file on one rank only, and the others go on to an exchange with it.
#[test]
fn files_that_fail_in_a_step() {
    let words = ["-qs_snes_monitor :link", "-qs_ksp_converged_reason :link"];
    at_once(words, |words| {
        at_once([1, 2, 3], |ranks| {
            let folder = tempfile::tempdir().unwrap();
            std::os::unix::fs::symlink("nowhere/x", folder.path().join("link")).unwrap();
            let outcome = with(words).ranks(ranks).attempt_in(folder);
            let text = outcome.said();
            let expected = "Cannot open PetscViewer file: link";
            let first = text.lines().next().unwrap_or_default();
            assert!(first.contains(expected), "{words} on {ranks} ranks: {text}");
            assert_eq!(text.matches(expected).count(), 1, "{words} on {ranks} ranks: {text}");
            assert_eq!(outcome.code, 4, "{words} on {ranks} ranks");
        });
    });
}

/// A step whose residual is round-off of its own terms ends as converged, and says so where the
/// tolerance is below that; one that runs out of iterations does not.
#[test]
fn a_residual_at_round_off_ends_a_step() {
    for ranks in [1, 2] {
        for (set, code, said) in [
            ("analysis.tolerance=1e-30", 0, "all of it round-off"),
            ("load.0.gravity=[0, -1e-4]", 0, "completed"),
            ("analysis.max_iterations=2", 1, "smaller steps"),
        ] {
            let outcome = block().set(set).ranks(ranks).attempt();
            let text = format!("{}\n{}", outcome.stdout, outcome.stderr);
            assert_eq!(outcome.code, code, "{text}");
            assert!(text.contains(said), "{text}");
        }
    }
}

/// The generic kernel of OpenBLAS is told, any other is not; nothing is said of another BLAS.
#[test]
fn a_generic_blas_is_told() {
    let program = env!("CARGO_BIN_EXE_mpm-par");
    let libraries = std::process::Command::new("ldd").arg(program).output().expect("ldd");
    let is_openblas = String::from_utf8_lossy(&libraries.stdout).contains("openblas");
    println!("the BLAS here is {}OpenBLAS", if is_openblas { "" } else { "not " });
    let said = |kernel: &str| {
        let run = block().set("ghost=").set("analysis.steps=1").env("OPENBLAS_CORETYPE", kernel);
        let outcome = run.attempt();
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        outcome.stdout.contains("note: OpenBLAS runs its generic kernel (Prescott)")
    };
    assert_eq!(said("Prescott"), is_openblas);
    assert!(!said("Nehalem"));
}

/// Options at which PETSc would crash, wait for ever or leave its own exit code.
#[test]
fn options_that_petsc_does_not_survive_are_refused() {
    let levels = "the levels of multigrid are made as the system needs them; \
                  pc_gamg_coarse_eq_limit bounds those of gamg";
    for words in ["-qs_pc_type mg -qs_pc_mg_levels 50", "-qs_pc_mg_levels 50"] {
        let message = format!("error: -qs_pc_mg_levels 50: {levels}");
        refused_on(&[1, 2], &with(words), &message);
    }
    refused_on(
        &[1, 2],
        &with("-qs_ksp_type chebyshev -qs_pc_type jacobi"),
        "error: -qs_ksp_type chebyshev: PETSc frees a vector of it twice when it fails: use cg, and \
         chebyshev in the levels of multigrid (mg_levels_ksp_type)",
    );
    refused_on(
        &[1, 2],
        &with("-qs_pc_type gamg -qs_pc_gamg_type classical"),
        "error: -qs_pc_gamg_type classical: it waits for ever on several ranks: use agg, which is \
         the default",
    );
    for name in ["-history", "-info", "-log", "-log_trace", "-malloc_view"] {
        refused_on(
            &[1, 2],
            &with(&format!("{name} nowhere/x")),
            &format!(
                "error: {name} nowhere/x: cannot be written: No such file or directory (os error 2)"
            ),
        );
    }
}

/// The folder of a profile goes while the run is under way: a completed run is a completed one.
#[test]
fn what_fails_in_petscs_end_does_not_fail_the_run() {
    for ranks in [1, 2] {
        let folder = tempfile::tempdir().unwrap();
        let profiles = folder.path().join("profiles");
        std::fs::create_dir(&profiles).unwrap();
        let gone = std::thread::spawn({
            let (profiles, out) = (profiles.clone(), folder.path().join("out/points-000001.h5"));
            move || {
                while !out.exists() {
                    std::thread::sleep(std::time::Duration::from_millis(1));
                }
                std::fs::remove_dir(&profiles).unwrap();
            }
        });
        let run = with("-malloc_view profiles/x").set("analysis.steps=30");
        let outcome = run.ranks(ranks).attempt_in(folder);
        gone.join().unwrap();
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        let warning = "warning: PETSc could not be ended in order: ";
        assert!(outcome.stderr.contains(warning), "{}", outcome.stderr);
        assert_eq!(left::summary(&outcome.folder.path().join("out"))["status"], "completed");
    }
}

/// The banner tells that MUMPS is missing where PETSc has none, and only there.
#[test]
fn the_banner_tells_of_mumps_what_petsc_has() {
    let plain = block().attempt();
    assert_eq!(plain.code, 0, "{}", plain.stderr);
    let words = "-qs_ksp_type preonly -qs_pc_type lu -qs_pc_factor_mat_solver_type mumps";
    let asked = with(words).attempt();
    let missing = plain.stdout.contains("built without MUMPS");
    assert_eq!(asked.code == 0, !missing, "{}\n{}", plain.stdout, asked.stderr);
}
