//! Collapse loads of soils beside limit analysis, and Newton's order in flow of each model.

mod common;

use common::run::{Results, Run};

fn bearing_factors(results: &Results) -> Vec<f64> {
    results.history("reaction.footing.y").iter().map(|force| -force / 100e3).collect()
}

/// The header of inputs/footing-friction.toml.
#[test]
fn footings_on_friction_have_the_capacity_of_prandtl() {
    for (friction, depth) in [(10.0f64, -5e-5), (20.0, -8e-5), (25.0, -10e-5)] {
        let phi = friction.to_radians();
        let surcharge = (std::f64::consts::PI * phi.tan()).exp()
            * (0.25 * std::f64::consts::PI + 0.5 * phi).tan().powi(2);
        let exact = (surcharge - 1.0) / phi.tan();
        let run = Run::of("footing-friction")
            .set(format!("material.soil.friction={friction:?}"))
            .set(format!("material.soil.dilation={friction:?}"))
            .set(format!("boundary.0.displacement.y={depth:?}"));
        let factors = bearing_factors(&run.ranks(2).results());
        let [.., before, last] = factors[..] else { panic!("{factors:?}") };
        assert!(last > exact && last < 1.03 * exact, "{friction}: {last} for {exact}");
        assert!((last / before - 1.0).abs() < 3e-3, "{friction}: no plateau, {before}, {last}");
    }
}

/// The header of inputs/footing-deep.toml.
#[test]
fn a_footing_can_be_pushed_by_its_width() {
    let factors = bearing_factors(&Run::of("footing-deep").ranks(2).results());
    let last = &factors[factors.len() * 9 / 10..];
    let mean = last.iter().sum::<f64>() / last.len() as f64;
    let shallow = 2.0 + std::f64::consts::PI;
    assert!(mean > 0.98 * 1.27 * shallow && mean < 1.02 * 1.4 * shallow, "{mean}");
}

/// The header of inputs/vertical-cut.toml: gamma H / s_u, whatever the elasticity.
#[test]
fn a_vertical_cut_stands_up_to_the_number_of_limit_analysis() {
    for young in [100e6, 1e9] {
        let run = Run::of("vertical-cut").set(format!("material.clay.young={young:?}"));
        let number = 2.5 * run.results().number("strength_factor");
        assert!(number > 3.776 && number < 1.02 * 3.776, "E = {young}: {number}");
    }
}

/// A block whose top is moved sideways and down, or far sideways where it stays elastic.
const BLOCK: &str = r#"
[analysis]
type = "quasi-static"
steps = 3
tolerance = 1e-13
max_iterations = 30
[method]
basis = "gimp"
[grid]
type = "lattice"
size = [3.5, 3.5]
h = 0.5
[material.m]
MODEL
[[body]]
name = "block"
material = "m"
shape = { box = { min = [0, 0], max = [2, 2] } }
points_per_cell = 2
[[boundary]]
where = { side = "bottom" }
fix = ["x", "y"]
[[boundary]]
where = { box = { min = [0, 2], max = [2, 2] } }
displacement = TOP
[output]
every = 100
fields = ["plastic_strain"]
"#;

/// ln(r_c / r_b) / ln(r_b / r_a) of a step's last residuals above round-off, which leaves 1e-15.
fn order(residuals: &[f64]) -> f64 {
    let near: Vec<f64> = residuals.iter().copied().filter(|r| *r > 1e-14).collect();
    let [.., a, b, c] = near[..] else { panic!("{residuals:?}") };
    (c / b).ln() / (b / a).ln()
}

/// docs/evidence/materials.md has the residuals.
#[test]
fn newton_is_quadratic_with_every_model() {
    let elastic = "young = 1e6\npoisson = 0.3";
    let soil = "friction = 30.0\ndilation = 10.0\ncohesion = 1e4";
    let [sheared, far] = ["{ x = 0.15, y = -0.09 }", "{ x = 0.9, y = -0.4 }"];
    let cases = [
        (format!("model = \"hencky\"\n{elastic}"), far, 1),
        (format!("model = \"neo-hookean\"\n{elastic}"), far, 1),
        (
            format!("model = \"von-mises\"\n{elastic}\nyield_stress = 1e4\nhardening = 1e5"),
            "{ x = 0.2, y = -0.1 }",
            2,
        ),
        (
            format!(
                "model = \"von-mises\"\n{elastic}\nyield_stress = 1e4\n\
                 saturation = {{ stress = 3e4, rate = 20.0 }}"
            ),
            sheared,
            3,
        ),
        (format!("model = \"tresca\"\n{elastic}\nshear_strength = 1e4"), sheared, 3),
        (format!("model = \"mohr-coulomb\"\n{elastic}\n{soil}"), sheared, 3),
        (format!("model = \"drucker-prager\"\n{elastic}\n{soil}"), sheared, 3),
        (
            "model = \"cam-clay\"\nyoung = 7.5e6\npoisson = 0.25\nslope = 1.0\ncompression = 0.1\n\
             swelling = 0.02\npreconsolidation = 150e3"
                .to_string(),
            sheared,
            3,
        ),
    ];
    for (material, top, steps) in cases {
        let deck = BLOCK.replace("MODEL", &material).replace("TOP", top);
        let results = Run::text(&deck).set(format!("analysis.steps={steps}")).results();
        let residuals = results.residuals(steps);
        let found = order(&residuals);
        assert!(found >= 1.9, "order {found} of {residuals:?} with {material}");
        let flows = results.history("energy_plastic").last().is_some_and(|spent| *spent > 0.0);
        assert_eq!(flows, top != far, "{material}");
    }
}
