//! Ghost stabilisation when the deck says nothing of it: docs/evidence/ghost-factors.md.

use crate::common::run::Run;

/// A cantilever two cells thick, `shift` cells above a line of the grid, under an end load.
fn thin_beam(shift: f64) -> Run {
    Run::text(&format!(
        r#"
title = "A beam two cells thick"
[analysis]
type = "quasi-static"
steps = 5
tolerance = 1e-8
[method]
basis = "gimp"
[grid]
type = "lattice"
origin = [0.0, {:?}]
size = [5.0, 4.0]
h = 0.25
[material.m]
model = "hencky"
young = 1e6
poisson = 0.2
[[body]]
name = "beam"
material = "m"
density = 0.0
shape = {{ box = {{ min = [0, -0.25], max = [4, 0.25] }} }}
lattice = {{ spacing = 0.08333333333333333, offset = [0.041666666666666664, 0.041666666666666664] }}
[[boundary]]
name = "root"
where = {{ side = "left" }}
fix = ["x", "y"]
[[load]]
point = {{ nearest = [[3.98, -0.01], [3.98, 0.01]], force = [0, -600.0] }}
[[verify]]
name = "tip"
field = "displacement.y"
exact = 0
norm = "max"
[output]
every = 5
"#,
        -2.0 - 0.25 * shift
    ))
}

/// Its tip sinks by 1.0541 m without Ghost where the beam lies on grid lines. A factor of 1 takes
/// 15 % from that, 0.1 takes 1.8 %; without Ghost iterations depend on the place.
#[test]
fn the_default_costs_less_than_a_per_cent_wherever_the_body_lies() {
    let tip = |run: Run| {
        let results = run.results();
        let tip = results.summary["verify"]["tip"].as_f64().expect("a number");
        (tip, results.summary["newton_iterations"]["total"].as_u64().expect("a count"))
    };
    let (on_lines, _) = tip(thin_beam(0.0).set("ghost=off"));
    assert!((on_lines - 1.0541).abs() < 1e-3, "{on_lines}");
    for shift in [0.0, 0.1, 0.5, 0.95] {
        let (here, evaluations) = tip(thin_beam(shift));
        assert!((here / on_lines - 1.0).abs() < 0.01, "shift {shift}: {here} for {on_lines}");
        assert_eq!(evaluations, 25, "shift {shift}");
        let (stiff, _) = tip(thin_beam(shift).set("ghost.stiffness_factor=1.0"));
        assert!(stiff / on_lines < 0.88, "shift {shift}: {stiff}");
    }
}

/// A cube under its own weight that lies on lines of the grid, one cell from the grid's edges, on a
/// base that is held.
fn cube(origin: [f64; 3], size: [f64; 3]) -> Run {
    Run::text(&format!(
        r#"
[analysis]
type = "quasi-static"
steps = 3
tolerance = 1e-10
[method]
basis = "gimp"
[grid]
type = "lattice"
origin = {origin:?}
size = {size:?}
h = 0.5
[material.m]
model = "hencky"
young = 1e6
poisson = 0.2
[[body]]
name = "cube"
material = "m"
density = 1e4
shape = {{ box = {{ min = [0, 0, 0], max = [1, 1, 1] }} }}
[[boundary]]
name = "base"
where = {{ box = {{ min = [-0.5, -0.5, 0], max = [1.5, 1.5, 0] }} }}
fix = ["x", "y", "z"]
[[load]]
gravity = [0, 0, -1]
"#
    ))
}

/// From the second step on its domains reach by little into 40 cells around it. Nobody reaches the
/// cells beyond them, whether there are any or not: a wider grid has to give equal energies. Without
/// faces at the cells on the grid's edge the second step has no solution to be found.
#[test]
fn cells_at_the_edge_of_the_grid_are_held_like_others() {
    let energies = |run: Run| -> Vec<[f64; 2]> {
        let results = run.results();
        let strain = results.history("energy_strain");
        strain.into_iter().zip(results.history("energy_ghost")).map(|(s, g)| [s, g]).collect()
    };
    let wide = energies(cube([-1.0; 3], [3.0; 3]));
    assert_eq!(wide.len(), 3);
    for ranks in [1, 3] {
        let close = energies(cube([-0.5; 3], [2.0; 3]).ranks(ranks));
        assert_eq!(close.len(), 3, "{ranks} ranks");
        for (close, wide) in close.iter().flatten().zip(wide.iter().flatten()) {
            assert!((close / wide - 1.0).abs() < 1e-9, "{ranks} ranks: {close} for {wide}");
        }
    }
}
