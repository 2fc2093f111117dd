//! Typical mistakes of people who begin, in the templates that they begin with: each leads to the right exit
//! code, to the key, and to words of cause and cure.

mod common;

use common::run::{Run, probed};
use mpm_par::deck::templates::template_of;

/// Template; what is replaced in it; by what; exit code of `--check`; words that are said.
type Mistake = (&'static str, &'static str, &'static str, i32, &'static [&'static str]);

const MISTAKES: [Mistake; 38] = [
    // Slips of the pen.
    (
        "beam",
        "young = 12e6",
        "yuong = 12e6",
        2,
        &["material.rubber", "yuong", "did you mean \"young\""],
    ),
    ("slope", "[[load]]", "[[laod]]", 2, &["laod", "did you mean \"load\""]),
    ("slope", "material = \"clay\"", "material = \"cley\"", 2, &["body.0.material", "\"clay\""]),
    (
        "slope",
        "\"displacement\", \"stress\"",
        "\"displacment\"",
        2,
        &["output.fields", "\"displacement\""],
    ),
    (
        "slope",
        "size = [35.0, 12.0]",
        "size = [35.0 12.0]",
        2,
        &["slope.toml:20:", "not valid TOML"],
    ),
    // Units.
    ("slope", "young = 10e6", "young = 10e3", 0, &["rho g H / E", "units of density (kg/m3)"]),
    ("slope", "density = 1835.0", "density = 1.835", 0, &["1.835 kg/m3", "soil has 1500 to 2200"]),
    ("column-collapse", "friction = 31.0", "friction = 0.54", 0, &["degrees", "radians"]),
    // Geometry.
    (
        "slope",
        "size = [35.0, 12.0]",
        "size = [35.0, 9.0]",
        2,
        &["body \"slope\"", "outside the grid", "enlarge"],
    ),
    ("slope", "h = 1.0", "h = 2.3", 2, &["grid.size", "whole cells", "nearest: 34.5 or 36.8 m"]),
    (
        "beam",
        "[10, 9.499], [10, 9.501]",
        "[12, 9.5]",
        2,
        &["load.0.point.nearest", "away from the nearest point"],
    ),
    (
        "footing",
        "min = [0, 4], max = [1, 4]",
        "min = [0, 4.1], max = [1, 4.2]",
        2,
        &["boundary.3.where", "no"],
    ),
    // Physics.
    (
        "slope",
        "where = { side = \"bottom\" }\nfix = [\"x\", \"y\"]",
        "where = { side = \"bottom\" }\nfix = [\"x\"]",
        2,
        &["no [[boundary]] holds y", "fix = [\"y\"]"],
    ),
    ("footing", "poisson = 0.49", "poisson = 0.5", 2, &["material.clay.poisson", "< 0.5"]),
    ("column-collapse", "cfl = 0.4", "steps = 100", 0, &["stability limit", "analysis.cfl = 0.5"]),
    (
        "column-collapse",
        "duration = 0.6",
        "",
        2,
        &["analysis.duration", "type = \"explicit\" needs it"],
    ),
    (
        "collision",
        "mass = \"lumped\"",
        "mass = \"lumped\"\nlocking = \"fbar\"",
        2,
        &["method.locking", "\"f-bar\""],
    ),
    ("footing", "locking = \"f-bar\"", "locking = \"none\"", 0, &["locking", "f-bar"]),
    // The stress of a soil of another weight, and of a surface that is not there.
    (
        "excavation",
        "density = 1800.0  ",
        "density = 2200.0  ",
        0,
        &["out of balance", "unit_weight"],
    ),
    (
        "excavation",
        "surface = 10.0",
        "surface = 12.0",
        0,
        &["out of balance", "most at [1.0, 6.0] m"],
    ),
    // Habits of other programs.
    ("beam", "young = 12e6", "E = 12e6", 2, &["unknown key \"E\"", "here it is called \"young\""]),
    ("beam", "poisson", "nu", 2, &["unknown key \"nu\"", "here it is called \"poisson\""]),
    (
        "column-collapse",
        "friction = 31.0",
        "phi = 31.0",
        2,
        &["unknown key \"phi\"", "here it is called \"friction\""],
    ),
    (
        "column-collapse",
        "duration = 0.6",
        "duration = 0.6\ndt = 1e-4",
        2,
        &["unknown key \"dt\"", "duration over steps", "cfl"],
    ),
    ("slope", "h = 1.0", "cell_size = 1.0", 2, &["grid.h", "here it is called \"h\""]),
    (
        "beam",
        "model = \"hencky\"",
        "model = \"linear-elastic\"",
        2,
        &["material.rubber.model", "here it is called \"hencky\""],
    ),
    ("slope", "\"stress\"", "\"sigma\"", 2, &["output.fields", "here it is called \"stress\""]),
    (
        "slope",
        "side = \"bottom\"",
        "side = \"base\"",
        2,
        &["boundary.0.where.side", "here it is called \"bottom\""],
    ),
    // Numbers.
    ("slope", "young = 10e6", "young = 10 MPa", 2, &["slope.toml:25", "carry no unit", "10e6"]),
    ("slope", "young = 10e6", "young = \"10 MPa\"", 2, &["material.clay.young", "carry no unit"]),
    ("slope", "density = 1835.0", "density = 1835,0", 2, &["slope.toml:32", "density = 1835.0"]),
    ("slope", "density = 1835.0", "density = -1835.0", 2, &["body.0.density", ">= 0 (kg/m3)"]),
    ("slope", "-9.81", "9.81", 0, &["acts towards +y", "side \"bottom\"", "[0, -9.81]"]),
    // Brackets and names.
    (
        "slope",
        "[material.clay]",
        "[[material]]",
        2,
        &["material: expected tables", "[material.NAME]"],
    ),
    ("slope", "[[load]]", "[load]", 2, &["load: expected an array", "write [[load]]"]),
    (
        "beam",
        "shape = { box = { min = [0, 9], max = [10, 10] } }",
        "shape = { points = \"C:\\data\\p.csv\" }",
        2,
        &["beam.toml:31", "'single quotes'"],
    ),
    (
        "beam",
        "min = [0, 9], max = [10, 10]",
        "min = [0, 10], max = [10, 9]",
        2,
        &["body.0.shape.box.max", "more than min = 10 along y"],
    ),
    ("beam", "name = \"pin\"", "name = \"root\"", 2, &["boundary.1.name", "another boundary"]),
];

#[test]
fn typical_mistakes_are_explained() {
    for (name, from, to, code, words) in MISTAKES {
        let text = template_of(name).expect("a template").text;
        assert!(text.contains(from), "{name}: {from}");
        let outcome = Run::text(&text.replacen(from, to, 1)).word("--check").attempt();
        let said = format!("{}{}", outcome.stdout, outcome.stderr)
            .replace("deck.toml", &format!("{name}.toml"));
        assert_eq!(outcome.code, code, "{to}: {said}");
        for word in words {
            assert!(said.contains(word), "{to}: not said: {word}\n{said}");
        }
        assert_eq!(outcome.files(), ["deck.toml"], "{to}: something was written");
    }
}

/// Side "bottom" is the lowest y also where the weight acts along z.
#[test]
fn a_floor_of_another_axis_is_told() {
    let deck = r#"
[analysis]
type = "quasi-static"
steps = 1
[grid]
type = "lattice"
size = [2, 2, 3]
h = 1
[material.soil]
model = "hencky"
young = 20e6
poisson = 0.3
[[body]]
material = "soil"
density = 1800
shape = { box = { min = [0, 0, 0], max = [2, 2, 2] } }
[[boundary]]
where = { side = "bottom" }
fix = ["x", "y", "z"]
[[load]]
gravity = [0, 0, -9.81]
"#;
    let said = |deck: &str| Run::text(deck).word("--check").attempt().stdout;
    let warning = "the lowest z is side \"back\"";
    assert!(said(deck).contains(warning), "{}", said(deck));
    for good in [
        deck.replace("\"bottom\"", "\"back\""),
        deck.replace("[0, 0, -9.81]", "[0, -9.81, 0]"),
        // Somebody means it.
        deck.replace("\"bottom\"", "\"left\""),
    ] {
        assert!(!said(&good).contains(warning), "{}", said(&good));
    }
}

/// A beam thinner than two cells is too stiff, and says so: beside Timoshenko's beam, in plane strain.
#[test]
fn a_body_too_thin_to_bend_is_told() {
    let deck = |thickness: f64| {
        format!(
            r#"
[analysis]
type = "quasi-static"
steps = 1
[method]
basis = "gimp"
[grid]
type = "lattice"
size = [10, 5]
h = 0.5
[material.steel]
model = "hencky"
young = 1e9
poisson = 0.2
[[body]]
name = "beam"
material = "steel"
density = 1
shape = {{ box = {{ min = [0, 1.1], max = [8, {}] }} }}
[[boundary]]
where = {{ side = "left" }}
fix = ["x", "y"]
[[load]]
gravity = [0, -1]
[[probe]]
name = "tip"
near = [8, {}]
fields = ["displacement.y"]
"#,
            1.1 + thickness,
            1.1 + 0.5 * thickness
        )
    };
    // Thickness over h, and the bounds of exact over computed deflection.
    for (thickness, bounds, told) in [
        (0.1, 11.0..13.0, true),
        (0.25, 2.1..2.5, true),
        (0.5, 1.2..1.3, true),
        (1.0, 1.04..1.08, false),
    ] {
        let outcome = Run::text(&deck(thickness)).attempt();
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        let said = outcome.stdout.clone();
        let (plane, shear) = (1e9 / (1.0 - 0.04), 1e9 / 2.4);
        let bending = 8f64.powi(4) / (8.0 * plane * thickness * thickness / 12.0);
        let exact = -(bending + 8f64.powi(2) / (2.0 * shear * 5.0 / 6.0));
        let stiffer = exact / probed(&outcome.results(), "tip.displacement.y");
        assert!(bounds.contains(&stiffer), "{thickness}: {stiffer}");
        assert_eq!(said.contains("cells thick"), told, "{thickness}: {said}");
    }
    let said = |deck: &str| Run::text(deck).word("--check").attempt().stdout;
    // Upright in the ground: the wall carries, and a layer of the ground is carried.
    let wall = |young: &str| {
        deck(0.1)
            + "[[body]]\nname = \"ground\"\nmaterial = \"soil\"\ndensity = 1\n\
            shape = { box = { min = [0, 0], max = [8, 1.1] } }\n\
            [material.soil]\nmodel = \"hencky\"\npoisson = 0.3\nyoung = "
            + young
            + "\n"
    };
    assert!(said(&wall("1e7")).contains("body \"beam\" is 0.2 cells thick"));
    assert!(!said(&wall("1e9")).contains("cells thick"));
    // Between walls nothing bends.
    let bar = deck(0.5).replace("[0, 1.1]", "[0, 0]").replace("size = [10, 5]", "size = [10, 0.5]");
    let bar = bar.replace("[8, 1.6]", "[8, 0.5]").replace("[8, 1.35]", "[8, 0.25]")
        + "[[boundary]]\nwhere = { side = \"bottom\" }\nfix = [\"y\"]\n";
    assert!(!said(&bar).contains("cells thick"), "{}", said(&bar));
}

/// Lengths in mm beside density, gravity and stiffness in SI units.
#[test]
fn lengths_in_mm_are_told() {
    let said = |text: &str| {
        let outcome = Run::text(text).word("--check").attempt();
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        outcome.stdout
    };
    let slope = template_of("slope").expect("a template").text;
    let in_mm = |text: &str, sizes: &[(&str, &str)]| {
        sizes.iter().fold(text.to_string(), |text, (from, to)| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, 1)
        })
    };
    let sizes = [
        ("size = [35.0, 12.0]", "size = [35000.0, 12000.0]"),
        ("h = 1.0", "h = 1000.0"),
        (
            "[[0, 0], [35, 0], [35, 5], [15, 5], [10, 10], [0, 10]]",
            "[[0, 0], [35000, 0], [35000, 5000], [15000, 5000], [10000, 10000], [0, 10000]]",
        ),
        ("near = [9.9, 9.9]", "near = [9900, 9900]"),
    ];
    let found = said(&in_mm(slope, &sizes));
    assert!(found.contains("rho g H / E = 18") && found.contains("lengths (m)"), "{found}");
    // Stiff rock: its ratios are usual ones.
    let rock = in_mm(slope, &[("young = 10e6", "young = 1e10")]);
    let rock = in_mm(&rock, &[("shear_strength = 25e3", "shear_strength = 25e6")]);
    assert!(!said(&rock).contains("warning"), "{}", said(&rock));
    let found = said(&in_mm(&rock, &sizes));
    assert!(found.contains("35000 m long") && found.contains("is it in mm?"), "{found}");
    // A column of 0.1 by 0.2 m that does not move within the time of its fall.
    let column = template_of("column-collapse").expect("a template").text;
    assert!(!said(column).contains("hardly anything"));
    let found = said(&in_mm(
        column,
        &[
            ("size = [0.6, 0.24]", "size = [600, 240]"),
            ("h = 0.01", "h = 10"),
            ("max = [0.1, 0.2]", "max = [100, 200]"),
            ("near = [0.0, 0.2]", "near = [0, 200]"),
        ],
    ));
    assert!(
        found.contains("hardly anything will happen") && found.contains("lengths (m)"),
        "{found}"
    );
}

/// Mistakes on the command line.
#[test]
fn mistakes_of_the_command_line_are_explained() {
    let beam = || Run::text(template_of("beam").expect("a template").text);
    for (run, code, words) in [
        (
            beam().word("--restart").word("last"),
            3,
            &["holds no checkpoint", "output.checkpoint"][..],
        ),
        (beam().set("grid.hh=0.5"), 2, &["grid.hh", "did you mean \"h\""]),
        (beam().word("-qs_ksp_tpye").word("cg"), 2, &["-qs_ksp_tpye", "did you mean -qs_ksp_type"]),
        (beam().word("--chekc"), 2, &["--chekc", "--check"]),
    ] {
        let outcome = run.attempt();
        assert_eq!(outcome.code, code, "{}", outcome.stderr);
        for word in words {
            assert!(outcome.stderr.contains(word), "not said: {word}\n{}", outcome.stderr);
        }
    }
    let done = beam().set("analysis.steps=2").set("load.0.point.force=[0, -1e3]").attempt();
    assert_eq!(done.code, 0, "{}", done.stderr);
    let again = beam().attempt_in(done.folder);
    assert_eq!(again.code, 2, "{}", again.stderr);
    for word in ["already holds results", "--force", "--out DIR", "--restart last"] {
        assert!(again.stderr.contains(word), "{}", again.stderr);
    }
}

/// A load that is too large ends the run, and the message says what to try.
#[test]
fn a_load_that_is_too_large_is_explained() {
    let text = template_of("beam").expect("a template").text;
    let run = Run::text(&text.replace("force = [0, -100e3]", "force = [0, -100e7]"));
    let outcome = run.attempt();
    assert_eq!(outcome.code, 1, "{}", outcome.stderr);
    for word in ["step 1", "try:", "analysis.on_failure = \"cut\""] {
        assert!(outcome.stderr.contains(word), "not said: {word}\n{}", outcome.stderr);
    }
    assert!(outcome.results().text("summary.json").contains("\"stopped\""));
}
