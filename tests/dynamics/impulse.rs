//! What the reactions of `history.csv` hold in implicit dynamics: the impulse that changes the momentum.

use crate::common::run::Run;

/// A block driven at an angle into a wall that holds it.
fn driven_into_a_wall() -> Run {
    Run::text(
        "[analysis]\ntype = \"implicit-dynamic\"\nsteps = 25\nduration = 0.2\ntolerance = 1e-12\n\
         [method]\nbasis = \"mpm\"\n\
         [grid]\ntype = \"lattice\"\nsize = [4, 2]\nh = 0.25\n\
         [material.a]\nmodel = \"hencky\"\nyoung = 1e5\npoisson = 0.3\n\
         [[body]]\nmaterial = \"a\"\ndensity = 1000\nvelocity = [-0.5, 0.1]\n\
         shape = { box = { min = [0, 0.5], max = [2, 1.5] } }\n\
         [[boundary]]\nname = \"wall\"\nwhere = { side = \"left\" }\nfix = [\"x\", \"y\"]\n\
         [ghost]\nmass_factor = 0.25\n\
         [output]\nevery = 100\n",
    )
}

/// Largest difference in a step between the change of momentum and the impulse of the wall and of
/// `gravity` (N), over the largest momentum that the wall gives in a step.
fn missing(run: &Run, gravity: f64) -> f64 {
    let results = run.results();
    let dt = results.history("dt");
    let (mut worst, mut largest) = (0.0f64, 0.0f64);
    for (axis, weight) in [("x", 0.0), ("y", gravity)] {
        let momentum = results.history(&format!("momentum_{axis}"));
        let reaction = results.history(&format!("reaction.wall.{axis}"));
        for step in 1..momentum.len() {
            let impulse = dt[step] * (reaction[step] + weight);
            worst = worst.max((momentum[step] - momentum[step - 1] - impulse).abs());
            largest = largest.max((dt[step] * reaction[step]).abs());
        }
    }
    worst / largest
}

#[test]
fn reactions_hold_the_change_of_momentum() {
    for mass in ["consistent", "lumped"] {
        for ranks in [1, 2, 3] {
            let run = driven_into_a_wall().set(format!("method.mass=\"{mass}\"")).ranks(ranks);
            let missing = missing(&run, 0.0);
            assert!(missing < 1e-10, "{mass} on {ranks} ranks: {missing:e}");
        }
    }
}

#[test]
fn also_beside_loads_with_other_numbers_of_the_method_and_a_share_of_pic() {
    let changes = [
        "method.velocity_update=0.7",
        "method.velocity_update=\"pic\"",
        "analysis.newmark_gamma=0.6",
    ];
    for change in changes {
        let mut run = driven_into_a_wall().set(change);
        if change.contains("gamma") {
            run = run.set("analysis.newmark_beta=0.3025");
        }
        let missing = missing(&run.set("load=[{ gravity = [0, -3.0] }]"), -3.0 * 2000.0);
        assert!(missing < 1e-10, "{change}: {missing:e}");
    }
}
