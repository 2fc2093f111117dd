//! Ghost §5.1.2: a body without stiffness keeps a linear velocity field.

use crate::common::run::{Results, Run};

fn stretch(mass: &str, velocity: &str) -> Results {
    Run::of("stretching-ghost")
        .set(format!("method.mass=\"{mass}\""))
        .set(format!("method.velocity_update=\"{velocity}\""))
        .set("output.every=1000")
        .results()
}

#[test]
fn the_stabilised_mass_moves_points_exactly() {
    for velocity in ["flip", "pic"] {
        let run = stretch("consistent", velocity);
        assert!(run.verify("displacement_error") < 1e-12, "{velocity}");
        assert!(run.verify("volume_ratio_error") < 1e-11, "{velocity}");
        // F = 2 at the end, without shear.
        let points = run.points(1000);
        let gradients = points.field("deformation_gradient");
        for gradient in gradients.chunks_exact(9) {
            for (entry, exact) in gradient.iter().zip([2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0])
            {
                assert!((entry - exact).abs() < 1e-11, "{velocity}: {gradient:?}");
            }
        }
    }
}

#[test]
fn the_lumped_mass_does_not() {
    let flip = stretch("lumped", "flip").verify("displacement_error");
    assert!((2.5e-2..4.5e-2).contains(&flip), "{flip}");
    let pic = stretch("lumped", "pic").verify("displacement_error");
    assert!((0.1..0.4).contains(&pic), "{pic}");
}

#[test]
fn exact_in_space_on_one_rank_and_two() {
    for ranks in [1, 2] {
        let run = Run::of("stretching-ghost-3d")
            .ranks(ranks)
            .set("analysis.steps=60")
            .set("output.every=1000")
            .results();
        assert!(run.verify("displacement_error") < 1e-12, "{ranks} ranks");
        assert!(run.verify("volume_ratio_error") < 1e-11, "{ranks} ranks");
    }
}

#[test]
fn the_order_of_the_stress_update_is_immaterial_without_stress() {
    for update in ["usf", "musl"] {
        let run = Run::of("stretching-ghost")
            .set(format!("method.stress_update=\"{update}\""))
            .set("analysis.steps=100")
            .set("output.every=1000")
            .results();
        assert!(run.verify("displacement_error") < 1e-12, "{update}");
    }
}
