//! The number of ranks is not seen in the answer.

use super::blocks::blocks;
use super::ghosts::contact;
use crate::common::at_once::at_once;
use crate::common::run::{Results, Run, relative_difference};

#[track_caller]
fn assert_same(one: &Results, other: &Results, step: usize, tolerance: f64) {
    for column in ["energy_kinetic", "energy_strain", "energy_plastic", "ghost_faces"] {
        let difference = relative_difference(&other.history(column), &one.history(column));
        assert!(difference <= tolerance, "{column}: {difference:e}");
    }
    let (a, b) = (one.points(step), other.points(step));
    assert_eq!(a.id, b.id);
    for field in ["displacement", "velocity", "stress"] {
        let difference = relative_difference(b.field(field), a.field(field));
        assert!(difference <= tolerance, "{field}: {difference:e}");
    }
}

fn on_all_ranks(run: &Run, step: usize) {
    let one = run.results();
    for ranks in [2, 3, 4] {
        assert_same(&one, &run.clone().ranks(ranks).results(), step, 1e-9);
    }
}

#[test]
fn explicit_consistent() {
    on_all_ranks(&contact(40), 40);
}

#[test]
fn explicit_lumped_plastic() {
    let run = contact(60)
        .set("method.mass=\"lumped\"")
        .set("method.stress_update=\"musl\"")
        .set("material.soft.model=\"von-mises\"")
        .set("material.soft.yield=5");
    on_all_ranks(&run, 60);
}

/// Slices of the grid one cell wide: some ranks hold points of which every one touches nodes of
/// another rank, some none of that kind, some no points at all.
#[test]
fn explicit_with_ranks_all_border_and_without_points() {
    let body = "name = \"block\"\nshape = { box = { min = [1.1, 1.1], max = [3.2, 4.3] } }\n\
                points_per_cell = [2, 2]\nvelocity = ['0.3*Y', '0.2*sin(X)']";
    let cases = [
        ("mpm", "lumped", "usl"),
        ("gimp", "lumped", "usf"),
        ("mpm", "consistent", "musl"),
        ("cpdi2", "consistent", "usl"),
    ];
    at_once(cases, |(basis, mass, update)| {
        let run = blocks(&[body])
            .set(format!("method.basis=\"{basis}\""))
            .set(format!("method.mass=\"{mass}\""))
            .set(format!("method.stress_update=\"{update}\""))
            .set("ghost.mass_factor=0.25")
            .set("grid.size=[4, 8]")
            .set("parallel.initial=\"slabs\"")
            .set("parallel.brick=1")
            .set("analysis.steps=30")
            .set("analysis.duration=0.015");
        let one = run.results();
        for ranks in [2, 3, 4] {
            let other = run.clone().ranks(ranks).results();
            for field in ["displacement", "velocity"] {
                let (a, b) = (one.points(30), other.points(30));
                let difference = relative_difference(b.field(field), a.field(field));
                assert!(difference < 1e-12, "{basis} {mass} {ranks}: {field} {difference:e}");
            }
        }
    });
}

#[test]
fn implicit() {
    let run = contact(5)
        .set("analysis.type=\"implicit-dynamic\"")
        .set("ghost.stiffness_factor=0.1")
        .set("analysis.tolerance=1e-11");
    on_all_ranks(&run, 5);
}

#[test]
fn the_mass_by_petsc_options() {
    let run = contact(10);
    let one = run.results();
    for ranks in [1, 2] {
        let other = run.clone().ranks(ranks).word("-mass_ksp_type").word("cg").results();
        assert_same(&one, &other, 10, 1e-9);
    }
}

/// On one rank a small mass has a complete factor: one application leaves round-off. PETSc's monitor acts on it.
#[test]
fn a_small_mass_takes_one_application() {
    let told = contact(10).word("-mass_ksp_monitor").attempt();
    assert_eq!(told.code, 0, "{}", told.stderr);
    let norms: Vec<(usize, f64)> = told
        .stdout
        .lines()
        .filter_map(|line| {
            let (iteration, norm) = line.split_once(" KSP Residual norm ")?;
            Some((iteration.trim().parse().ok()?, norm.trim().parse().ok()?))
        })
        .collect();
    // Velocity and acceleration in each of ten steps.
    assert_eq!(norms.len(), 2 * 20, "{norms:?}");
    for pair in norms.chunks_exact(2) {
        let [(0, before), (1, after)] = pair else { panic!("{pair:?}") };
        assert!(*after <= 1e-12 * before, "{pair:?}");
    }
}

#[test]
fn collision_in_space() {
    let run = Run::of("ghost-collision-3d")
        .set("body.1.shape.translate=[0.3, 0.36, 0.3]")
        .set("analysis.steps=20")
        .set("analysis.duration=0.1")
        .set("output.every=20");
    let one = run.results();
    assert_same(&one, &run.ranks(3).results(), 20, 1e-9);
}

/// On three ranks one has nodes of another in its cells that none of its points adds mass to: an
/// empty message went to a rank that did not wait for it, and was taken for the next one.
#[test]
fn explicit_with_nodes_of_other_ranks_that_get_no_mass() {
    let run = blocks(&["shape = { box = { min = [2, 0.5], max = [7.90961, 2.90248] } }"])
        .set("analysis.steps=6")
        .set("method.basis=\"cpdi2\"")
        .set("ghost.mass_factor=0.25")
        .set("grid={ type = \"lattice\", cells = [5, 9], h = [2.0, 0.5] }")
        .set("boundary=[{ where = { side = \"left\" }, fix = [\"x\", \"y\"] }]")
        .set("load=[{ gravity = [-0.6293, -22.22] }]")
        .set("output.fields=[\"displacement\", \"velocity\", \"stress\"]");
    on_all_ranks(&run, 6);
}
