//! Which linear solver a body without Ghost stiffness gets: multigrid where it converges, the
//! direct one where it does not, and that one at once for some steps then.

use crate::common::run::{Run, relative_difference};

/// A block under its weight off the grid lines, 20 808 equations: beyond the direct solver's limit.
const BLOCK: &str = r#"
ghost = "off"
[analysis]
type = "quasi-static"
steps = 2
[method]
basis = "gimp"
[grid]
type = "lattice"
origin = [0, 0]
cells = [103, 103]
h = 0.01
[material.m]
model = "hencky"
young = 1e6
poisson = 0.3
[[body]]
name = "block"
material = "m"
density = 1000
shape = { box = { min = [0.003, 0.003], max = [1.003, 1.003] } }
points_per_cell = [2, 2]
[[boundary]]
name = "base"
where = { side = "bottom" }
fix = ["x", "y"]
[[load]]
gravity = [0, -10]
[output]
every = 100
fields = ["displacement", "stress"]
"#;

const FAILED: &str = "multigrid failed; solved again with";

fn block(steps: usize) -> Run {
    Run::text(BLOCK).set(format!("analysis.steps={steps}"))
}

#[test]
fn multigrid_is_tried_and_gives_what_the_direct_solver_gives() {
    let tried = block(2).ranks(2).results();
    let solves = tried.number("newton_iterations.total") - 2.0;
    let each = tried.number("linear_iterations.total") / solves;
    assert!(each > 2.0 && each < 30.0, "{each} iterations a solve");
    assert!(!tried.text("log.txt").contains(FAILED));
    let direct = block(2)
        .set("petsc.qs_ksp_type=\"preonly\"")
        .set("petsc.qs_pc_type=\"lu\"")
        .set("petsc.qs_pc_factor_mat_solver_type=\"mumps\"")
        .results();
    let solves = direct.number("newton_iterations.total") - 2.0;
    assert_eq!(direct.number("linear_iterations.total"), solves);
    let (a, b) = (tried.points(2), direct.points(2));
    for (field, most) in [("displacement", 1e-9), ("stress", 1e-8)] {
        let error = relative_difference(a.field(field), b.field(field));
        assert!(error < most, "{field} differs by {error:e}");
    }
}

/// A solver of the user's is neither cut off after the iterations of a trial nor given a
/// preconditioner of an earlier iterate.
#[test]
fn a_solver_of_the_users_is_not_on_trial() {
    let own = |method: &str, preconditioner: &str| {
        block(1)
            .set(format!("petsc.qs_ksp_type=\"{method}\""))
            .set(format!("petsc.qs_pc_type=\"{preconditioner}\""))
            .results()
    };
    let [slow, direct, levels] = [own("cg", "jacobi"), own("preonly", "lu"), own("cg", "mg")];
    let evaluations = slow.count("newton_iterations.total");
    assert!(slow.count("linear_iterations.total") > 100 * (evaluations - 1));
    for other in [direct, levels] {
        assert_eq!(other.count("newton_iterations.total"), evaluations);
    }
}

/// Three iterations are too few: steps 1 and 12 try and fail, those between do not try. A restart
/// remembers.
#[test]
fn a_failed_trial_is_not_repeated_at_once() {
    let starved = |steps| block(steps).set("petsc.qs_ksp_max_it=3").set("load.0.gravity=[0,-1]");
    let failed_in = |log: &str| -> Vec<usize> {
        let lines = log.lines().filter(|line| line.contains(FAILED));
        let step = |line: &str| line.split("step ").nth(1)?.split(':').next()?.parse().ok();
        lines.map(|line| step(line).unwrap_or_else(|| panic!("no step in: {line}"))).collect()
    };
    let whole = starved(13).set("output.checkpoint={every=6}").results();
    assert_eq!(failed_in(&whole.text("log.txt")), [1, 12]);
    // One iteration a solve: the direct solver.
    let (evaluations, linear) =
        (whole.history("newton_iterations"), whole.history("linear_iterations"));
    for step in 1..=11 {
        assert_eq!(linear[step - 1], evaluations[step - 1] - 1.0, "step {step}");
    }
    let middle = whole.directory.join("checkpoint-000006.h5").display().to_string();
    let part =
        starved(13).set("output.checkpoint={every=6}").word("--restart").word(middle).results();
    assert_eq!(failed_in(&part.text("log.txt")), [12]);
    let (a, b) = (whole.points(13), part.points(13));
    assert_eq!(relative_difference(a.field("stress"), b.field("stress")), 0.0);
}
