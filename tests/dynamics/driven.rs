//! Boundaries that move from the first explicit step on.

use super::blocks::blocks;
use crate::common::run::Run;

/// A bar of 4 m held on the left and pulled at its right end; sound crosses a cell in 0.09 s.
fn pulled(duration: f64, metres: f64) -> Run {
    blocks(&["shape = { box = { min = [0, 2], max = [4, 4] } }"])
        .set(format!("analysis.duration={duration:?}"))
        .set("ghost={ mass_factor = 0.25 }")
        .set(format!(
            "boundary=[{{ where = {{ side = \"left\" }}, fix = [\"x\", \"y\"] }}, \
             {{ where = {{ box = {{ min = [4, 0], max = [8, 8] }} }}, \
             displacement = {{ x = {metres:?} }} }}]"
        ))
}

/// The strain of the first step is there before the reaction that does its work: no fault of the
/// time step. Over the whole pull work and energy agree, but for what PIC loses: points that are
/// caught by moving nodes take twice the energy that they keep.
#[test]
fn a_boundary_that_starts_to_move_makes_no_energy() {
    for (update, velocity, mass, ranks, kept) in [
        ("musl", "\"flip\"", "consistent", 1, 0.8..1.2),
        ("usl", "\"flip\"", "lumped", 2, 0.8..1.2),
        ("usf", "0.5", "consistent", 1, 0.8..1.2),
        ("musl", "\"pic\"", "lumped", 1, 0.5..1.0),
    ] {
        let run = pulled(0.6, 0.05)
            .ranks(ranks)
            .set(format!("method.stress_update=\"{update}\""))
            .set(format!("method.velocity_update={velocity}"))
            .set(format!("method.mass=\"{mass}\""))
            .results();
        let last = |name: &str| *run.history(name).last().expect("rows");
        let (work, energy) =
            (last("work_external"), last("energy_strain") + last("energy_kinetic"));
        assert!(kept.contains(&(energy / work)), "{update} {velocity} {mass}: {energy} {work}");
    }
}

/// Nor is it one of an implicit step, where PIC gives the points that velocity at once.
#[test]
fn a_boundary_that_starts_to_move_is_no_fault_of_an_implicit_step() {
    let run = pulled(0.6, 0.05)
        .set("analysis={ type = \"implicit-dynamic\", steps = 20, duration = 0.6 }")
        .set("method.velocity_update=\"pic\"");
    assert_eq!(run.results().count("steps_completed"), 20);
}

/// What is granted to a moving boundary is soon less than what an unstable step brings.
#[test]
fn a_time_step_over_the_limit_is_named_where_a_boundary_moves() {
    let outcome = pulled(60.0, 0.5).attempt();
    assert_eq!(outcome.code, 1, "{}", outcome.stdout);
    assert!(outcome.stderr.contains("energy has grown"), "{}", outcome.stderr);
}

/// The series of XPIC adds nothing where a boundary prescribes the velocity.
#[test]
fn xpic_moves_boundaries_as_prescribed() {
    for order in [1, 2, 5] {
        let run = blocks(&["shape = { box = { min = [1, 2], max = [4, 4] } }"])
            .set("method.velocity_update=\"xpic\"")
            .set(format!("method.xpic_order={order}"))
            .set(
                "boundary=[{ where = { box = { min = [0, 0], max = [8, 8] } }, \
                 displacement = { x = 0.02, y = -0.01 } }]",
            )
            .results();
        let points = run.points(60);
        for (component, exact) in [0.02, -0.01].into_iter().enumerate() {
            for u in points.component("displacement", component) {
                assert!((u - exact).abs() < 1e-12, "order {order}: {u}");
            }
        }
    }
}

/// A PIC share gives the points the nodes' velocity, which boundaries prescribe where they hold:
/// the impulse of that, too, is in the reaction.
#[test]
fn reactions_make_up_for_the_change_of_momentum() {
    for (update, velocity, order, mass, ranks) in [
        ("usl", "\"flip\"", None, "consistent", 1),
        ("usl", "0.6", None, "consistent", 2),
        ("musl", "\"pic\"", None, "lumped", 1),
        ("usf", "0.3", None, "consistent", 1),
        ("usf", "\"pic\"", None, "lumped", 3),
        ("usl", "\"xpic\"", Some(1), "lumped", 1),
        ("usl", "\"xpic\"", Some(2), "lumped", 2),
        ("musl", "\"xpic\"", Some(5), "lumped", 1),
    ] {
        let mut run = blocks(&["shape = { box = { min = [0, 2], max = [4, 4] } }\n\
                                velocity = [-0.4, \"0.3 * X\"]"])
        .ranks(ranks)
        .set("ghost={ mass_factor = 0.25 }")
        .set(
            "boundary=[{ name = \"wall\", where = { box = { min = [0, 0], max = [1, 8] } }, \
             fix = [\"x\", \"y\"] }, { name = \"head\", \
             where = { box = { min = [4, 0], max = [8, 8] } }, displacement = { x = 0.02 } }]",
        )
        .set(format!("method.stress_update=\"{update}\""))
        .set(format!("method.velocity_update={velocity}"))
        .set(format!("method.mass=\"{mass}\""));
        if let Some(order) = order {
            run = run.set(format!("method.xpic_order={order}"));
        }
        let run = run.results();
        let dt = run.history("dt");
        for axis in ["x", "y"] {
            let momentum = run.history(&format!("momentum_{axis}"));
            let [wall, head] =
                ["wall", "head"].map(|name| run.history(&format!("reaction.{name}.{axis}")));
            let scale = momentum.iter().fold(0.0f64, |scale, p| scale.max(p.abs()));
            assert!(scale > 0.0);
            for k in 1..momentum.len() {
                let gained = momentum[k] - momentum[k - 1];
                let given = (wall[k] + head[k]) * dt[k];
                assert!(
                    (gained - given).abs() < 1e-11 * scale,
                    "{update} {velocity} {order:?} {mass}, {axis}, row {k}: {gained} {given}"
                );
            }
        }
    }
}
