//! Steps whose residual meets the round-off of its own terms: stiff bodies under small loads, states
//! without force, and any unit of stress or length.

use crate::common::run::{Results, Run, relative_difference};

/// A block of two layers under its own weight between a smooth wall and a floor.
struct Block {
    lower: f64,
    upper: f64,
    density: f64,
    size: f64,
    steps: usize,
}

const STEEL: Block = Block { lower: 2e11, upper: 2e11, density: 7800.0, size: 1.0, steps: 1 };

impl Block {
    fn run(&self) -> Run {
        let Block { lower, upper, density, size, steps } = self;
        let (half, height, h) = (0.5 * size, 1.25 * size, 0.125 * size);
        Run::text(&format!(
            "ghost = \"off\"\n[analysis]\ntype = \"quasi-static\"\nsteps = {steps}\n\
             [method]\nbasis = \"mpm\"\n\
             [grid]\ntype = \"lattice\"\nsize = [{size:e}, {height:e}]\nh = {h:e}\n\
             [material.lower]\nmodel = \"hencky\"\nyoung = {lower:e}\npoisson = 0.3\n\
             [material.upper]\nmodel = \"hencky\"\nyoung = {upper:e}\npoisson = 0.3\n\
             [[body]]\nmaterial = \"lower\"\ndensity = {density:e}\n\
             shape = {{ box = {{ min = [0, 0], max = [{size:e}, {half:e}] }} }}\n\
             [[body]]\nmaterial = \"upper\"\ndensity = {density:e}\n\
             shape = {{ box = {{ min = [0, {half:e}], max = [{size:e}, {size:e}] }} }}\n\
             [[boundary]]\nwhere = {{ side = \"left\" }}\nfix = [\"x\"]\n\
             [[boundary]]\nname = \"floor\"\nwhere = {{ side = \"bottom\" }}\nfix = [\"y\"]\n\
             [[load]]\ngravity = [0, -10]\n\
             [output]\nfields = [\"stress\", \"displacement\"]\n"
        ))
    }

    /// Runs and compares what the floor bears with the weight; returns the results.
    fn stands(&self, ranks: usize) -> Results {
        self.stands_by(self.run().ranks(ranks))
    }

    /// [`Self::stands`] of a run of this block.
    fn stands_by(&self, run: Run) -> Results {
        let results = run.results();
        let weight = 10.0 * self.density * self.size * self.size;
        let floor = *results.history("reaction.floor.y").last().expect("rows");
        assert!((floor / weight - 1.0).abs() < 1e-9, "{floor} {weight}");
        results
    }
}

fn warned(results: &Results) -> bool {
    results.summary["warnings"]
        .as_array()
        .expect("a list")
        .iter()
        .any(|warning| warning.as_str().is_some_and(|text| text.contains("round-off")))
}

/// Strains of 4e-7 keep their digits: the tolerance is met, not excused.
#[test]
fn a_steel_block_stands_under_its_own_weight() {
    for ranks in [1, 3] {
        let results = STEEL.stands(ranks);
        let residuals = results.residuals(1);
        assert!(*residuals.last().expect("evaluations") < 1e-12, "{residuals:?}");
        assert!(!warned(&results));
    }
    let many = Block { steps: 50, ..STEEL }.stands(1);
    assert!(many.history("residual").iter().all(|&residual| residual < 1e-9));
}

#[test]
fn default_settings_serve_any_stiffness_and_size() {
    for young in [1e3, 2e11] {
        for size in [1e-9, 1.0, 1e6] {
            // At most a tenth of the stiffness in pressure, at most steel's density.
            let density = f64::min(7800.0, 0.01 * young / size);
            Block { lower: young, upper: young, density, size, steps: 1 }.stands(1);
        }
    }
}

#[test]
fn stiffnesses_of_a_contrast_of_1e8_stand_on_each_other() {
    for (lower, upper) in [(2e11, 2e3), (2e3, 2e11)] {
        for ranks in [1, 2] {
            Block { lower, upper, density: 20.0, size: 1.0, steps: 1 }.stands(ranks);
        }
    }
}

/// Another unit of stress is another power of two: no number of the program may be a stress.
#[test]
fn the_unit_of_stress_changes_nothing() {
    let results = |factor: f64, solver: &str| {
        let Block { lower, upper, density, .. } = STEEL;
        let (lower, upper) = (lower * factor, upper * factor);
        let block = Block { lower, upper, density: density * factor, ..STEEL };
        block.stands_by(block.run().set(format!("petsc={{{solver}}}")))
    };
    // PETSc's own factors, and those of the coarsest level, know a zero pivot by zero alone.
    let solvers = [
        ("", &[-100, 100][..]),
        ("qs_pc_factor_mat_solver_type=\"petsc\"", &[-100, 100]),
        ("qs_pc_type=\"mg\"", &[-90]),
    ];
    for (solver, powers) in solvers {
        let steel = results(1.0, solver);
        let (moved, evaluations) = (steel.points(1), steel.history("newton_iterations"));
        for factor in powers.iter().map(|&power| 2f64.powi(power)) {
            let other = results(factor, solver);
            assert_eq!(other.history("newton_iterations"), evaluations, "{solver} {factor:e}");
            let ours = other.points(1);
            let difference =
                relative_difference(ours.field("displacement"), moved.field("displacement"));
            assert!(difference < 1e-12, "{solver} {factor:e}: {difference:e}");
            let stress: Vec<f64> = ours.field("stress").iter().map(|s| s / factor).collect();
            let difference = relative_difference(&stress, moved.field("stress"));
            assert!(difference < 1e-12, "{solver} {factor:e}: {difference:e}");
        }
    }
}

/// An unloaded block carried about by its foot, without or with Ghost stiffness.
fn carried(motion: &str, foot: f64, ghost: bool) -> Run {
    let ghost = if ghost { "ghost = { stiffness_factor = 0.1 }\n" } else { "ghost = \"off\"\n" };
    Run::text(&format!(
        "{ghost}[analysis]\ntype = \"quasi-static\"\nsteps = 5\n[method]\nbasis = \"mpm\"\n\
         [grid]\ntype = \"lattice\"\norigin = [-1.0, -1.0]\nsize = [3.0, 3.0]\nh = 0.25\n\
         [material.m]\nmodel = \"hencky\"\nyoung = 1e6\npoisson = 0.3\n\
         [[body]]\nmaterial = \"m\"\ndensity = 1000.0\npoints_per_cell = [3, 3]\n\
         shape = {{ box = {{ min = [0, 0], max = [1, 1] }} }}\n\
         [[boundary]]\nname = \"foot\"\n\
         where = {{ box = {{ min = [-1, -1], max = [2, {foot}] }} }}\n{motion}\n\
         [output]\nfields = [\"position\", \"position_initial\", \"stress\"]\n"
    ))
}

#[test]
fn a_state_without_force_is_solved() {
    let shift = "displacement = { x = 0.7, y = 0.0 }";
    let turn = "rotation = { centre = [0.5, 0.0], degrees = 20 }";
    let (sin, cos) = 20f64.to_radians().sin_cos();
    for (motion, foot) in [(shift, 0.0), (turn, 0.3)] {
        for (ranks, ghost) in [(1, false), (2, false), (1, true)] {
            if motion == turn && ghost {
                // Ghost forces resist a rotation of finite angle.
                continue;
            }
            let results = carried(motion, foot, ghost).ranks(ranks).results();
            assert!(warned(&results), "{motion}");
            let points = results.points(5);
            let (now, start) = (points.field("position"), points.field("position_initial"));
            for (x, from) in now.chunks_exact(3).zip(start.chunks_exact(3)) {
                let (a, b) = (from[0] - 0.5, from[1]);
                let exact = match motion == turn {
                    true => [0.5 + cos * a - sin * b, sin * a + cos * b],
                    false => [from[0] + 0.7, from[1]],
                };
                assert!(
                    (x[0] - exact[0]).hypot(x[1] - exact[1]) < 1e-9,
                    "{motion} {x:?} {exact:?}"
                );
            }
            assert!(points.field("stress").iter().all(|stress| stress.abs() < 1e-4));
        }
    }
}

/// E' A strain: the reaction of a bar at a strain of 1e-7, to a tolerance of 1e-10.
#[test]
fn a_bar_at_a_small_strain_meets_a_small_tolerance() {
    let bar = "ghost = \"off\"\n[analysis]\ntype = \"quasi-static\"\nsteps = 3\ntolerance = 1e-10\n\
         [method]\nbasis = \"mpm\"\n\
         [grid]\ntype = \"lattice\"\nsize = [4.5, 1.0]\nh = 0.5\n\
         [material.m]\nmodel = \"hencky\"\nyoung = 2e11\npoisson = 0.3\n\
         [[body]]\nmaterial = \"m\"\nshape = { box = { min = [0, 0], max = [4, 1] } }\n\
         [[boundary]]\nwhere = { side = \"left\" }\nfix = [\"x\"]\n\
         [[boundary]]\nwhere = { side = \"bottom\" }\nfix = [\"y\"]\n\
         [[boundary]]\nname = \"pull\"\nwhere = { box = { min = [4, 0], max = [4, 1] } }\n\
         displacement = { x = 4e-7 }\n";
    for ranks in [1, 2] {
        let results = Run::text(bar).ranks(ranks).results();
        let pull = *results.history("reaction.pull.x").last().expect("rows");
        let exact = 2e11 / (1.0 - 0.09) * 1e-7;
        // The logarithm and the narrower section are of the second order.
        assert!((pull / exact - 1.0).abs() < 4e-7, "{pull} {exact}");
        assert!(!warned(&results));
    }
}
