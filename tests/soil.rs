//! Collapse loads of soils beside limit analysis, and Newton's order in flow of each model.

mod common;

use common::run::{Results, Run};

fn bearing_factors(results: &Results) -> Vec<f64> {
    results.history("reaction.footing.y").iter().map(|force| -force / 100e3).collect()
}

/// inputs/footing-friction.toml on 12 m by 5 m of soil: at 30 degrees the fan reaches to 9.6 m and 3.2 m deep.
fn on_more_soil(run: Run) -> Run {
    run.set("grid.generate.box.spacing=[[[0, 0.4], [1, 0.02], [12, 1.2]], [[0, 0.8], [5, 0.02], [5.1, 0.1]]]")
        .set("body.0.shape={ box = { min = [0, 0], max = [12, 5] } }")
        .set("boundary.0.where={ box = { min = [0, 5], max = [1, 5] } }")
}

/// The header of inputs/footing-friction.toml.
#[test]
fn footings_on_friction_have_the_capacity_of_prandtl() {
    for (friction, depth) in [(10.0f64, -5e-5), (20.0, -8e-5), (25.0, -10e-5), (30.0, -14e-5)] {
        let phi = friction.to_radians();
        let surcharge = (std::f64::consts::PI * phi.tan()).exp()
            * (0.25 * std::f64::consts::PI + 0.5 * phi).tan().powi(2);
        let exact = (surcharge - 1.0) / phi.tan();
        let run = Run::of("footing-friction")
            .set(format!("material.soil.friction={friction:?}"))
            .set(format!("material.soil.dilation={friction:?}"))
            .set(format!("boundary.0.displacement.y={depth:?}"));
        let run = if friction < 30.0 { run } else { on_more_soil(run) };
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

/// Ground of Mohr-Coulomb soil on a floor.
const GROUND: &str = r#"
[analysis]
type = "quasi-static"
steps = 2
[method]
basis = "mpm"
locking = "f-bar"
[grid]
type = "lattice"
size = [3.0, 3.0]
h = 1.0
[material.soil]
model = "mohr-coulomb"
young = 1e7
poisson = 0.3
friction = 30.0
dilation = 5.0
cohesion = 1e4
[[body]]
name = "ground"
material = "soil"
density = 2000.0
shape = { box = { min = [0, 0], max = [3, 2] } }
[[boundary]]
where = { side = "bottom" }
fix = ["x", "y"]
[[load]]
gravity = [0, -10]
[output]
every = 9
"#;

/// The deck with three stages, the weight over time.
fn in_stages(deck: &str) -> String {
    let stages: String =
        (0..3).map(|k| format!("[[stage]]\nname = \"s{k}\"\nsteps = 1\n")).collect();
    deck.replacen("steps = 2\n", "", 1)
        .replace("gravity = [0, -10]", "gravity = [\"0\", \"-10*t\"]")
        .replace("[output]", &format!("{stages}[output]"))
}

/// Each wrong deck is refused by a message that names the key or the place, and the cure.
#[test]
fn what_soils_and_stages_cannot_have_is_named() {
    let with = |from: &str, to: &str| {
        assert!(GROUND.contains(from), "{from}");
        GROUND.replacen(from, to, 1)
    };
    let cam_clay = "model = \"cam-clay\"\nslope = 1.0\ncompression = 0.1\nswelling = 0.02\nocr = 0.5\n\
                    young = 1e7\npoisson = 0.3\n";
    let (start, end) = (GROUND.find("model =").unwrap(), GROUND.find("[[body]]").unwrap());
    let clay = format!("{}{cam_clay}{}", &GROUND[..start], &GROUND[end..]);
    let box_end = "max = [3, 2] } }";
    let on_top = "[[body]]\nname = \"top\"\nmaterial = \"soil\"\ndensity = 2000.0\n\
                  shape = { box = { min = [0, 2], max = [1, 3] } }\n[[boundary]]";
    let gone = in_stages(&with(box_end, "max = [3, 2] } }\nuntil = \"s1\""));
    let cases: [(&str, String, &[&str]); 14] = [
        (
            "no strength",
            with(
                "friction = 30.0\ndilation = 5.0\ncohesion = 1e4",
                "friction = 0.0\ncohesion = 0.0",
            ),
            &["material.soil.cohesion", "expected cohesion > 0 Pa or friction > 0 degrees"],
        ),
        (
            "psi > phi",
            with("dilation = 5.0", "dilation = 35.0"),
            &["material.soil.dilation", "35 degrees exceeds friction = 30", "dilation <= friction"],
        ),
        (
            "psi > phi somewhere",
            with("dilation = 5.0", "dilation = \"20*Y\""),
            &["material.soil.dilation: at point", "X = [", "dilation <= friction"],
        ),
        (
            "tension beyond the apex",
            with("cohesion = 1e4", "cohesion = 1e4\ntension = 5e4"),
            &["material.soil.tension", "apex c cot phi = 17320.5", "or leave it out"],
        ),
        (
            "tension below zero",
            with("cohesion = 1e4", "cohesion = 1e4\ntension = -1e3"),
            &["material.soil.tension", "expected a number >= 0 (Pa)"],
        ),
        ("OCR < 1", clay, &["material.soil.ocr", "expected a number >= 1, found 0.5"]),
        (
            "K0 outside the yield surface",
            with(
                box_end,
                "max = [3, 2] } }\ninitial_stress = { k0 = 0.05, surface = 2.0, unit_weight = 60e3 }",
            ),
            &["body.0.initial_stress: at point", "outside the yield surface", "K0 nearer to one"],
        ),
        (
            "softening without a length",
            with("cohesion = 1e4", "cohesion = 1e4\nsoftening = { strain = 0.1, cohesion = 1e3 }"),
            &["material.soil.softening.length: missing", "Width of the band"],
        ),
        (
            "cohesion below zero somewhere",
            with("cohesion = 1e4", "cohesion = \"1e4*(Y-1)\""),
            &[
                "material.soil.cohesion: at point",
                "X = [",
                "expected a number >= 0 (Pa), found -7500",
            ],
        ),
        (
            "stiffness below zero somewhere",
            with("young = 1e7", "young = \"1e7*(Y-1)\""),
            &["material.soil.young: at point", "expected a number > 0 (Pa)"],
        ),
        (
            "a stage without supports",
            in_stages(&with("fix = [\"x\", \"y\"]", "fix = [\"x\", \"y\"]\nuntil = \"s0\"")),
            &["until", "stage \"s0\"", "let it come with an earlier stage, or go with a later one"],
        ),
        (
            "a later stage without supports",
            in_stages(&with("fix = [\"x\", \"y\"]", "fix = [\"x\", \"y\"]\nuntil = \"s1\"")),
            &["no [[boundary]] holds x and y in stage \"s1\"", "for example a [[boundary]]"],
        ),
        (
            "a body that another hangs on goes",
            gone.replacen("[[boundary]]", on_top, 1),
            &["in stage \"s1\"", "body \"top\" can move along", "check the places"],
        ),
        ("all bodies go", gone.clone(), &["stage \"s1\" holds no body", "see from and until of"]),
    ];
    for (what, deck, words) in cases {
        let outcome = Run::text(&deck).attempt();
        let said = outcome.said();
        assert_eq!(outcome.code, 2, "{what}: {said}");
        for word in words {
            assert!(said.contains(word), "{what}: no {word:?} in\n{said}");
        }
        assert!(!outcome.files().iter().any(|file| file.starts_with("out")), "{what}: files");
    }
    // A friction of zero is Tresca, a cohesion of zero is dry sand: both run.
    let tresca = with("friction = 30.0\ndilation = 5.0", "friction = 0.0\ndilation = 0.0");
    let sand = with("cohesion = 1e4", "cohesion = 0.0");
    let walls = ["left", "right"]
        .map(|side| format!("[[boundary]]\nwhere = {{ side = \"{side}\" }}\nfix = [\"x\"]\n"));
    for deck in [tresca, sand] {
        Run::text(&(deck + &walls.concat())).results();
    }
}

/// A footing goes on from the middle of its plateau, F-bar with points at the edges of the yield surface, and a
/// pressed cylinder from its middle: bit by bit on as many ranks.
#[test]
fn runs_go_on_from_the_middle_of_plastic_flow() {
    let keep = "output.checkpoint={ every = 1, keep = 40 }";
    let pressed = GROUND
        .replace("type = \"quasi-static\"", "type = \"quasi-static\"\nsymmetry = \"axisymmetric\"")
        .replace("steps = 2", "steps = 6")
        .replace("basis = \"mpm\"", "basis = \"gimp\"")
        .replace("size = [3.0, 3.0]\nh = 1.0", "size = [4.0, 3.0]\nh = 0.5")
        .replace("[[load]]\ngravity = [0, -10]", "[[boundary]]\nwhere = { box = { min = [0, 2], max = [3, 2] } }\ndisplacement = { y = -0.1 }")
        .replace("every = 9", "every = 6\nfields = [\"stress\", \"plastic_strain\"]");
    let footing = std::fs::read_to_string(common::run::input("footing")).expect("a deck");
    let footing = footing
        .replace("[[0, 0.4], [1, 0.02], [6, 1.0]]", "[[0, 0.8], [1, 0.1], [6, 2.0]]")
        .replace("[[0, 0.6], [3, 0.02], [3.1, 0.1]]", "[[0, 1.2], [3, 0.1], [3.1, 0.2]]")
        .replace("steps = 20", "steps = 8")
        .replace("on_failure = \"cut\"", "on_failure = \"stop\"\nmax_iterations = 40")
        .replace("every = 10", "every = 8");
    for (deck, last, middle) in [(pressed, 6, 3), (footing, 8, 6)] {
        for ranks in [1, 2] {
            let whole = Run::text(&deck).ranks(ranks).set(keep).results();
            let end = whole.points(last);
            assert!(end.field("plastic_strain").iter().any(|strain| *strain > 1e-5));
            let file = whole.directory.join(format!("checkpoint-{middle:06}.h5"));
            let words = file.display().to_string();
            let part =
                Run::text(&deck).ranks(ranks).set(keep).word("--restart").word(words).results();
            for field in ["stress", "plastic_strain"] {
                let part = part.points(last);
                assert!(end.field(field) == part.field(field), "{ranks} ranks: {field}");
            }
        }
    }
}
