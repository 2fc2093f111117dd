//! Decks that are wrong: exit code, place, key and the words that matter. Two messages are compared whole, for their layout.

use std::path::Path;

use mpm_par::deck;

const BEAM: &str = include_str!("decks/beam.toml");
const COLLISION: &str = include_str!("decks/collision.toml");
const ANNULUS: &str = include_str!("decks/annulus.toml");
const CUBE: &str = include_str!("decks/cube.toml");

fn message(text: &str, sets: &[&str]) -> String {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_string()).collect();
    let error = deck::read(Path::new("beam.toml"), text, &sets).expect_err("a faulty deck");
    assert_eq!(error.exit_code(), 2);
    error.to_string()
}

/// The beam with one piece of text replaced.
fn replaced(from: &str, to: &str) -> String {
    assert!(BEAM.contains(from), "{from}");
    message(&BEAM.replacen(from, to, 1), &[])
}

/// The message of that deck, whose words these are, in their order.
fn replaced_says(from: &str, to: &str, words: &[&str]) {
    says(&replaced(from, to), words);
}

fn says(message: &str, words: &[&str]) {
    let mut rest = message;
    for word in words {
        let at = rest.find(word);
        let at = at.unwrap_or_else(|| panic!("\"{word}\" is not, or not there, in:\n{message}"));
        rest = &rest[at + word.len()..];
    }
}

#[test]
fn malformed_toml() {
    assert_eq!(
        replaced("steps = 50", "steps = = 50"),
        "\
beam.toml:5:9: not valid TOML: extra `=`, expected nothing
   |
 5 | steps = = 50
   |         ^"
    );
    for text in ["[analysis", "a = 1\na = 2", "x = 99999999999999999999", "\u{0}", "x = {"] {
        let found = message(text, &[]);
        assert!(found.contains("beam.toml:") && found.contains("not valid TOML: "), "{found}");
    }
}

#[test]
fn unknown_key_names_the_nearest() {
    let found = replaced("tolerance = 1e-9", "tolerence = 1e-9");
    let layout = "\
beam.toml:6:1: analysis.tolerence: unknown key \"tolerence\"
   |
 6 | tolerence = 1e-9
   | ^^^^^^^^^
   = did you mean \"tolerance\"?
   = known keys of [analysis]: type, ";
    assert!(found.starts_with(layout), "{found}");
}

#[test]
fn key_of_another_section_is_sent_there() {
    replaced_says(
        "poisson = 0.2",
        "poisson = 0.2\ndensity = 1",
        &[
            "beam.toml:29:1: material.steel.density",
            "\"density\" belongs to [[body]]",
            "known keys of [material.NAME]: model, young",
        ],
    );
}

/// A hint leads to a key that the deck's model or analysis reads, with its meaning; in doubt there is none.
#[test]
fn hints_lead_to_what_is_read() {
    let unknown = |text: &str, set: &str| {
        let said = message(text, &[set]);
        // Beside the list of all keys.
        let hint = said.lines().filter(|line| !line.contains("known keys of")).collect::<Vec<_>>();
        let hint = hint.join("\n");
        assert!(hint.contains("unknown key"), "{set}: {said}");
        hint
    };
    let material = |model: &str, key: &str| {
        unknown(BEAM, &format!("material.steel={{ model = \"{model}\", {key} = 1 }}"))
    };
    for (model, key, words) in [
        ("hencky", "mu", "young = mu (3 lambda + 2 mu) / (lambda + mu)"),
        ("neo-hookean", "lambda", "poisson = lambda / (2 (lambda + mu))"),
        ("mohr-coulomb", "lambda", "Lamé"),
        ("cam-clay", "lambda", "here it is called \"compression\""),
        ("hencky", "G", "young = 2 G (1 + poisson)"),
        ("mohr-coulomb", "G", "young = 2 G (1 + poisson)"),
        ("cam-clay", "G", "called \"shear\" here"),
        ("tresca", "c", "is shear_strength"),
        ("tresca", "phi", "is shear_strength"),
        ("tresca", "cu", "here it is called \"shear_strength\""),
        ("mohr-coulomb", "phi", "here it is called \"friction\""),
        ("mohr-coulomb", "c", "here it is called \"cohesion\""),
        ("cam-clay", "kappa", "here it is called \"swelling\""),
        ("cam-clay", "m", "here it is called \"slope\""),
        ("von-mises", "fy", "here it is called \"yield_stress\""),
        ("hencky", "rho", "here it is called \"density\" and belongs to [[body]]"),
        ("hencky", "gamma", "density of [[body]] times gravity"),
    ] {
        let said = material(model, key);
        assert!(said.contains(words), "{model}, {key}: {said}");
        assert!(!said.contains("gravity\""), "{model}, {key}: {said}");
    }
    let silent = |said: &str| {
        !["here it is called", "did you mean", "belongs to", "write "]
            .iter()
            .any(|w| said.contains(w))
    };
    for key in ["p0", "m", "kappa", "su", "fy", "mu"] {
        let said = material("mohr-coulomb", key);
        assert!(silent(&said), "{key}: {said}");
    }
    for key in ["c", "phi", "su", "fy", "kappa"] {
        let said = material("hencky", key);
        assert!(silent(&said), "{key}: {said}");
    }
    for key in ["time", "end_time", "courant", "dt"] {
        let said = unknown(BEAM, &format!("analysis.{key}=1"));
        assert!(said.contains("no time: steps is"), "{key}: {said}");
        assert!(!said.contains("cfl") && !said.contains("duration"), "{key}: {said}");
        let said = unknown(COLLISION, &format!("analysis.{key}=1"));
        assert!(said.contains("cfl") || said.contains("duration"), "{key}: {said}");
    }
    for key in ["velocity", "v"] {
        let said = unknown(BEAM, &format!("boundary.0.{key}=1"));
        assert!(said.contains("displacement = { x = \"v*t\" }"), "{key}: {said}");
    }
    for (set, words) in [
        ("rigid=[{ name = \"r\", u = [0, 1] }]", "motion = { displacement = [...] }"),
        ("rigid=[{ name = \"r\", v = [0, 1] }]", "motion = { velocity = [...] }"),
        ("contact=[{ between = [\"r\", \"b\"], phi = 30 }]", "friction = tan(phi)"),
        ("contact=[{ between = [\"r\", \"b\"], mu = 0.3 }]", "here it is called \"friction\""),
    ] {
        let said = unknown(BEAM, set);
        assert!(said.contains(words), "{set}: {said}");
    }
    for set in [
        "contact=[{ between = [\"r\", \"b\"], type = \"penalty\" }]",
        "boundary.0.type=\"fixed\"",
        "load.0.type=\"gravity\"",
    ] {
        let said = unknown(BEAM, set);
        assert!(silent(&said) && !said.contains("[analysis]"), "{set}: {said}");
    }
}

/// A field that cannot be differentiated is named with its line, before the model is made.
#[test]
fn a_manufactured_field_has_derivatives() {
    for formula in ["1e-3*abs(X)", "if(X > 1, 1e-3, 0)"] {
        let set = format!("load=[{{ manufactured = [\"{formula}\", \"0\"] }}]");
        let said = message(BEAM, &[&set]);
        assert!(said.contains("load.0.manufactured: \""), "{said}");
        assert!(said.contains("no derivative rule"), "{said}");
    }
}

#[test]
fn wrong_type() {
    replaced_says(
        "tolerance = 1e-9",
        "tolerance = \"small\"",
        &["beam.toml:6:13: analysis.tolerance: ", "a number > 0", "the string \"small\""],
    );
}

#[test]
fn poisson_of_a_half() {
    replaced_says(
        "poisson = 0.2",
        "poisson = 0.5",
        &["beam.toml:28:11: material.steel.poisson: ", "> -1 and < 0.5", "found 0.5"],
    );
}

#[test]
fn unknown_word() {
    replaced_says(
        "basis = \"gimp\"",
        "basis = \"gmip\"",
        &[
            "beam.toml:12:9: method.basis: ",
            "\"mpm\", \"gimp\"",
            "\"gmip\"",
            "did you mean \"gimp\"?",
        ],
    );
}

#[test]
fn wrong_dimension() {
    replaced_says(
        "max = [10, 10]",
        "max = [10, 10, 1]",
        &["beam.toml:33:39: body.0.shape.box.max: ", "2 values", "2D", "found 3"],
    );
}

#[test]
fn size_that_is_not_whole_cells() {
    replaced_says(
        "size = [11.0, 10.0]",
        "size = [11.3, 10.0]",
        &["beam.toml:22:8: grid.size: ", "11.3 m along x", "22.600000 cells", "11 or 11.5 m"],
    );
}

#[test]
fn missing_section_and_its_misspelling() {
    replaced_says(
        "[grid]\n",
        "[gird]\n",
        &[
            "beam.toml:19:2: gird: unknown key",
            "did you mean \"grid\"?",
            "known keys of the top level: title, analysis",
            "beam.toml: grid: missing section [grid]",
        ],
    );
    says(
        &message("", &[]),
        &[
            "beam.toml: analysis: missing section [analysis]",
            "beam.toml: material: missing",
            "[material.NAME]",
            "beam.toml: grid: missing section [grid]",
        ],
    );
}

#[test]
fn no_boundary_condition_is_a_singular_system() {
    says(
        &message(BEAM, &["boundary="]),
        &["beam.toml: boundary: no [[boundary]]", "singular", "fix = [\"x\", \"y\"]"],
    );
    says(
        &message(BEAM, &["boundary.1="]),
        &["beam.toml: boundary: no [[boundary]] holds y", "singular", "fix = [\"y\"]"],
    );
}

#[test]
fn options_are_named_in_messages() {
    says(
        &message(BEAM, &["method.frame=total", "analysis.steps=0"]),
        &["--set analysis.steps=0: analysis.steps: ", ">= 1", "found 0"],
    );
    says(&message(BEAM, &["method.basis"]), &["--set method.basis: ", "KEY=VALUE"]);
}

/// Every key of the schema that only some choices read is refused with the others, in the deck and
/// from the command line, and a key of the deck is set aside where an option makes the choice.
#[test]
fn keys_of_no_effect_are_refused_with_the_choice_that_reads_them() {
    for (text, key, value, what) in [
        (BEAM, "method.stress_update", "\"usf\"", "analysis.type = \"explicit\" reads it"),
        (BEAM, "method.mass", "\"lumped\"", "\"explicit\" or \"implicit-dynamic\" reads it"),
        (BEAM, "analysis.newmark_beta", "0.25", "\"implicit-dynamic\" reads it"),
        (BEAM, "body.0.velocity", "[1, 0]", "\"explicit\" or \"implicit-dynamic\" reads it"),
        (BEAM, "ghost.mass_factor", "1.0", "found \"quasi-static\""),
        (
            COLLISION,
            "analysis.tolerance",
            "1e-6",
            "\"strength-reduction\" or \"implicit-dynamic\" reads",
        ),
        (COLLISION, "analysis.max_iterations", "7", "found \"explicit\""),
        (COLLISION, "method.frame", "\"total\"", "found \"explicit\""),
        (CUBE, "method.domain_update", "\"corners\"", "method.basis = \"gimp\" reads it, found"),
        (
            CUBE,
            "analysis.smallest_step",
            "0.5",
            "analysis.on_failure = \"cut\" reads it, found \"stop\"",
        ),
        (ANNULUS, "parallel.brick", "4", "grid.type = \"lattice\" reads it, found \"mesh\""),
    ] {
        let found = message(text, &[&format!("{key}={value}")]);
        assert!(found.contains(&format!("{key}: has no effect: only")), "{found}");
        assert!(found.contains(what), "{key}: {found}");
    }
    let text = BEAM.replacen("[method]", "[method]\nstress_update = \"usl\"", 1);
    let found = message(&text, &[]);
    assert!(found.contains("method.stress_update: has no effect"), "{found}");
}

#[test]
fn a_key_of_the_deck_is_set_aside_where_an_option_makes_the_choice() {
    let sets = ["method.basis=mpm".to_string()];
    let deck = deck::read(Path::new("beam.toml"), BEAM, &sets).expect("a good deck");
    assert_eq!(
        deck.notes,
        [
            "note: method.domain_update of the deck has no effect with --set method.basis=mpm and is set aside"
        ]
    );
    let found = message(BEAM, &["method.basis=mpm", "method.domain_update=corners"]);
    assert!(found.contains("only method.basis = \"gimp\" reads it, found \"mpm\""), "{found}");
}

#[test]
fn a_weightless_body_beside_heavy_ones_is_meant_to_be() {
    let heavy = "body.0.density=1000";
    let gravity = "load=[{ gravity = [0, -10] }]";
    let second = "[[body]]\nname = \"light\"\nmaterial = \"steel\"\n\
                  shape = { box = { min = [0, 0], max = [1, 1] } }\n";
    let at = BEAM.find("[[boundary]]").expect("a boundary");
    let text = format!("{}{second}{}", &BEAM[..at], &BEAM[at..]);
    let found = message(&text, &[heavy, gravity]);
    assert!(found.contains("body \"light\" has no density, and others have one"), "{found}");
    let sets = [heavy, gravity, "body.1.density=0.0"].map(String::from);
    deck::read(Path::new("beam.toml"), &text, &sets).expect("density = 0.0 says so");
}

#[test]
fn several_problems_are_told_at_once_in_the_order_of_the_text() {
    let text = BEAM
        .replacen("steps = 50", "steps = -1", 1)
        .replacen("young = 12e6", "young = -1", 1)
        .replacen("force = [0, -100e3]", "force = [0]", 1);
    let found = message(&text, &["output.every=0"]);
    let starts: Vec<&str> = found.lines().filter(|line| !line.starts_with(' ')).collect();
    assert_eq!(
        starts,
        [
            "beam.toml:5:9: analysis.steps: expected a whole number >= 1, found -1",
            "beam.toml:27:9: material.steel.young: expected a number >= 0 (Pa), found -1",
            "beam.toml:46:70: load.0.point.force: expected 2 values, one per axis (2D, from [grid]), found 1",
            "--set output.every=0: output.every: expected a whole number of steps, or { seconds = s } >= 1, found 0",
        ]
    );
    let many: String = (0..14).map(|i| format!("unknown{i} = 1\n")).collect();
    let found = message(&(many + BEAM), &[]);
    assert_eq!(found.matches("unknown key").count(), 10);
    assert!(found.ends_with("... and 4 more"), "{found}");
}

/// (options, part of the message)
type Cases<'a> = &'a [(&'a [&'a str], &'a str)];

fn expect(text: &str, cases: Cases<'_>) {
    for (sets, part) in cases {
        let found = message(text, sets);
        assert!(found.contains(part), "{sets:?}\nexpected: {part}\nfound: {found}");
    }
}

#[test]
fn checks_of_the_analysis_and_the_method() {
    expect(
        BEAM,
        &[
            (&["analysis.type=static"], "expected one of \"quasi-static\", \"explicit\""),
            (&["analysis.steps="], "analysis.steps: missing a whole number >= 1"),
            (&["analysis.steps=5.0"], "expected a whole number >= 1, found 5.0"),
            (&["analysis.duration=1"], "type = \"quasi-static\" has no time"),
            (&["analysis.tolerance=nan"], "expected a number > 0, found NaN"),
            (&["analysis.tolerance=inf"], "expected a number > 0, found inf"),
            (&["analysis.type=conditioning", "body.0.density=1"], "missing section [conditioning]"),
            (
                &["conditioning.displacement=[1, 0]"],
                "only for analysis.type = \"conditioning\", found \"quasi-static\"",
            ),
            (
                &["method.velocity_update=0.5"],
                "only analysis.type = \"explicit\" or \"implicit-dynamic\" reads it, found \"quasi-static\"",
            ),
            (
                &["analysis.type=explicit", "analysis.duration=1", "method.velocity_update=1.5"],
                "number from 0 (pic) to 1 (flip) >= 0 and <= 1, found 1.5",
            ),
            (&["analysis.type=explicit", "method.velocity_update=flop"], "did you mean \"flip\"?"),
            (
                &[
                    "analysis.type=implicit-dynamic",
                    "analysis.duration=1",
                    "method.velocity_update=apic",
                ],
                "\"apic\" is for analysis.type = \"explicit\"",
            ),
            (
                &["analysis.type=explicit", "method.velocity_update=apic", "method.basis=mpm"],
                "zero on the faces of cells; use basis = \"gimp\"",
            ),
            (
                &["analysis.type=explicit", "method.velocity_update=tpic", "method.basis=cpdi2"],
                "velocity_update = \"tpic\" is not derived for CPDI domains; use basis = \"gimp\"",
            ),
            (
                &[
                    "analysis.type=explicit",
                    "method.velocity_update=apic",
                    "method.stress_update=usf",
                ],
                "where the stress is updated first; use \"musl\" or \"usl\"",
            ),
            (
                &[
                    "analysis.type=explicit",
                    "method.velocity_update=apic",
                    "method.mass=consistent",
                ],
                "\"apic\" is derived for mass = \"lumped\"; with mass = \"consistent\", \"flip\"",
            ),
            (
                &[
                    "analysis.type=explicit",
                    "method.velocity_update=apic",
                    "method.gimp_edge=published",
                ],
                "needs functions that sum to one; use \"continued\"",
            ),
            (
                &["analysis.type=explicit", "method.position_update=publisht"],
                "did you mean \"published\"?",
            ),
            (
                &["method.point_volume=domain", "method.basis=mpm"],
                "only method.basis = \"gimp\" reads it",
            ),
            (&["method.position_updates=published"], "did you mean \"position_update\"?"),
            (
                &["method.xpic_order=3"],
                "only method.velocity_update = \"xpic\" reads it, found \"flip\"",
            ),
            (&["ghost.stiffness_factor=1"], "stiffness is given too"),
            (&["ghost=on"], "ghost: expected \"off\", found \"on\""),
            (&["ghost=false"], "ghost: expected a table or \"off\", found false"),
            (
                &["output.fields=[\"stres\", \"strain\", \"stress\"]"],
                "found \"stres\"\n   = did you mean \"stress\"?\n--set",
            ),
            (&["parallel.rebalance_above=0.5"], "expected 0 (never) or a number >= 1"),
            (&["petsc.a=[1]"], "petsc.a: expected a string, number or true"),
            (&["output.fields=[\"stresses\"]"], "did you mean \"stress\"?"),
            (&["output.fields=[\"stress\", \"stress\"]"], "\"stress\" is named twice"),
            (&["output.checkpoint={ keep = 3 }"], "expected \"every\" (steps), \"minutes\""),
        ],
    );
    expect(
        CUBE,
        &[
            (&["analysis.duration="], "type = \"implicit-dynamic\" needs it"),
            (&["analysis.cfl=0.5"], "only type = \"explicit\" takes it"),
            (
                &["body.0.density=0"],
                "expected > 0 kg/m3: analysis.type = \"implicit-dynamic\" needs mass",
            ),
            (&["body.0.density="], "needs mass"),
            (&["analysis.hht_alpha=-0.5"], "analysis.hht_alpha: expected a number >= -0.333"),
            (
                &["analysis.hht_alpha=-0.1", "analysis.newmark_beta=0.25"],
                "hht_alpha = -0.1 sets it to",
            ),
            (&["analysis.newmark_gamma=0.6"], "expected at least (gamma + 1/2)^2 / 4"),
        ],
    );
    expect(
        COLLISION,
        &[
            (&["analysis.steps=10"], "steps and cfl exclude each other"),
            (
                &["material.soft.young=0"],
                "without stiffness there is no stability limit for cfl to divide",
            ),
            (&["analysis.cfl="], "analysis.steps: missing a whole number >= 1; or give cfl"),
        ],
    );
}

#[test]
fn checks_of_the_grid() {
    expect(
        BEAM,
        &[
            (&["grid.h=[0.5, 0.5, 0.5]"], "expected 2 values, as many as size has, found 3"),
            (&["grid.cells=[1, 1]"], "expected only one of \"size\", \"cells\""),
            (&["grid.size=[1]"], "expected 2 (plane strain) or 3 values, found 1"),
            (&["grid.h=0"], "grid.h: expected a number"),
            (&["grid.h="], "type = \"lattice\" needs it"),
            (&["grid.motion={ follow = \"material\" }"], "only for type = \"mesh\""),
            (&["grid.type=mesh"], "only for type = \"lattice\""),
            (&["grid.size=", "grid.cells=[9000000000, 9000000000]"], "more than can be numbered"),
            (&["grid.h=3"], "nearest: 9 or 12 m"),
        ],
    );
    expect(
        ANNULUS,
        &[
            (&["method.basis=gimp"], "method.basis = \"gimp\" needs type = \"lattice\""),
            (&["grid.generate.annulus.inner=11"], "expected a hole smaller than outer = 10 m"),
            (&["grid.generate.annulus.inner=[1, 2, 3]"], "a radius, or an array of two semi-axes"),
            (&["grid.generate.annulus.element=hex8"], "expected one of \"quad4\", \"tri3\""),
            (&["grid.generate.annulus.element=quad"], "did you mean \"quad4\"?"),
            (
                &["grid.generate={ box = { spacing = [[[0, 1], [0, 1]], [[0, 1], [2, 1]]] } }"],
                "pairs [place, spacing] for each axis, places ascending",
            ),
            (
                &["grid.generate={ box = { spacing = [[[0, 1], [2, 0]], [[0, 1], [2, 1]]] } }"],
                "pairs [place, spacing there] > 0 (m), found 0",
            ),
            (
                &[
                    "grid.generate={ box = { min = [0, 0], spacing = [[[0, 1], [2, 1]], [[0, 1], [2, 1]]] } }",
                ],
                "only without spacing",
            ),
            (
                &["boundary.0.rotation=", "boundary.0.fix=[\"x\"]"],
                "no [[boundary]] with where = { tag = \"inner\" } prescribes a rotation",
            ),
            (&["grid.motion={ follow = [\"z\"] }"], "expected one of \"x\", \"y\", found \"z\""),
            (&["grid.motion={ follow = \"x\" }"], "expected \"material\", found \"x\""),
            (
                &["boundary.0.where.tag=inside"],
                "expected one of \"inner\", \"outer\", found \"inside\"",
            ),
            (&["boundary.0.where={ side = \"left\" }"], "a mesh has no sides"),
            (&["body.0.gauss=2", "body.0.points_per_cell="], "Gauss points are finite elements"),
        ],
    );
}

#[test]
fn checks_of_bodies_and_shapes() {
    expect(
        BEAM,
        &[
            (&["material.steel.yield=1"], "only for model = \"von-mises\""),
            (
                &["material.steel.model=von-mises"],
                "material.steel.yield: missing a number or an expression (string) of X Y Z > 0; model = \"von-mises\" needs it, or \
                 yield_stress (uniaxial), or shear_strength",
            ),
            (
                &[
                    "material.steel.model=von-mises",
                    "material.steel.yield=1",
                    "material.steel.shear_strength=1",
                ],
                "expected only one of \"yield\", \"shear_strength\"",
            ),
            (&["material.steel.shear_strength=1"], "only for model = \"von-mises\", \"tresca\""),
            (&["material.steel.poisson=-1"], "expected a number > -1 and < 0.5"),
            (&["material=7"], "material: expected tables, each under a name of its own, found 7"),
            (&["body.0.material=stel"], "expected \"steel\", found \"stel\""),
            (&["body="], "body: missing an array of tables; expected a [[body]]"),
            (&["body={ name = \"a\" }"], "write [[body]], in double brackets"),
            (
                &["body.0.density=2e100"],
                "expected at most 1e100, so that energies and sums stay finite",
            ),
            (&["material.steel.young=1e300"], "expected at most 1e100"),
            (&["body.0.density=-1"], "body.0.density: expected a number >= 0 (kg/m3), found -1"),
            (&["body.0.points_per_cell=[2]"], "expected 2 values, one per axis"),
            (
                &["body.0.points_per_cell=0"],
                "expected a whole number, or an array of one per axis >= 1",
            ),
            (
                &["body.0.lattice={ spacing = 0.1 }"],
                "expected only one of \"points_per_cell\", \"lattice\"",
            ),
            (
                &["body.0.points_per_cell=", "body.0.lattice={ spacing = 0.6 }"],
                "a domain may not be larger than a cell, found 0.6 m",
            ),
            (&["body.0.velocity=[\"x\", 0]"], "`x` is not known here; variables: X Y Z"),
            (&["body.0.shape={}"], "expected one of \"box\", \"disc\""),
            (&["body.0.shape.where=\"x < 1\""], "expected only one of \"box\", \"where\""),
            (&["body.0.shape={ where = \"1 < 2\" }"], "found a constant"),
            (&["body.0.shape={ where = \"x < \" }"], "in \"x < \", character 5: expected a number"),
            (&["body.0.shape={ where = \"z < 1\" }"], "`z` is not known here"),
            (
                &["body.0.shape.translate=[20, 0]"],
                "the body lies outside the grid: x from 20 to 30 m, the grid from 0 to 11 m",
            ),
            (&["body.0.shape.box.max=[0, 10]"], "expected more than min = 0 along x, found 0"),
            (
                &["body.0.shape={ disc = { centre = [1, 1], radius = 0 } }"],
                "body.0.shape.disc.radius: expected a number > 0 (m), found 0",
            ),
            (
                &["body.0.shape={ polygon = { vertices = [[0, 0], [1, 0]] } }"],
                "expected 3 or more corners, found 2",
            ),
            (
                &["body.0.shape={ difference = [{ box = { min = [0, 0], max = [1, 1] } }] }"],
                "expected 2 or more shapes, found 1",
            ),
            (
                &["body.0.shape={ union = [{ bx = 1 }] }"],
                "body.0.shape.union.0.bx: unknown key \"bx\"",
            ),
            (&["body.0.shape={ union = [{ points = \"a.csv\" }] }"], "only directly in a body"),
            (&["body.0.shape={ points = \"a.csv\" }"], "points come from a file"),
            (&["body.0.shape={ cells = \"all\" }"], "only for grid.type = \"mesh\""),
        ],
    );
    expect(COLLISION, &[(&["body.1.name=left"], "another body is called \"left\"")]);
    expect(
        CUBE,
        &[(
            &["body.0.shape={ polygon = { vertices = [[0, 0], [1, 0], [1, 1]] } }"],
            "polygons are 2D",
        )],
    );
}

#[test]
fn checks_of_conditions_and_results() {
    expect(
        BEAM,
        &[
            (
                &["boundary.0.fix=[\"z\"]"],
                "boundary.0.fix: expected one of \"x\", \"y\", found \"z\"",
            ),
            (&["boundary.0.fix=[]"], "prescribes nothing"),
            (&["boundary.0.displacement={ x = 1 }"], "x is held by fix and displaced too"),
            (&["boundary.0.displacement={ z = 1 }"], "the problem is 2D"),
            (
                &["boundary.0.displacement={ y = \"x\" }"],
                "`x` is not known here; variables: X Y Z s t",
            ),
            (&["boundary.0.rotation={ degrees = 1 }"], "x and y are prescribed already"),
            (
                &["boundary.0.where.side=front"],
                "expected one of \"left\", \"right\", \"bottom\", \"top\", found \"front\"",
            ),
            (&["boundary.0.where={ tag = \"left\" }"], "a lattice has no tags"),
            (&["boundary.0.where={ cells_of = \"bean\" }"], "did you mean \"beam\"?"),
            (&["boundary.1.name=root"], "another boundary is called \"root\""),
            (&["load.0.point.body=bean"], "load.0.point.body: expected \"beam\", found \"bean\""),
            (&["load.0.point.nearest=[]"], "expected one or more positions, found none"),
            (
                &["load.0.point=", "load.0.gravity=[0, -10]"],
                "acts on nothing: every body has density 0",
            ),
            (&["load.0.gravity=[0, -10]"], "expected only one of \"point\", \"gravity\""),
            (&["verify.0.field=stress"], "expected one of \"stress.xx\", \"stress.xy\""),
            (&["verify.0.field=strss.yy"], "verify.0.field: expected one of \"displacement\""),
            (
                &["verify.0.field=displacement"],
                "\"displacement\" has 2 component(s), found 1 value(s)",
            ),
            (
                &["verify.0.exact=80*1O*(Y-50)"],
                "in \"80*1O*(Y-50)\", character 5: expected an operator or the end, found `O`",
            ),
            (&["verify.0.scale=0"], "verify.0.scale: expected a number > 0"),
        ],
    );
    expect(
        COLLISION,
        &[(
            &["load=[{ point = { nearest = [0, 0], force = [0, 1] } }]"],
            "the deck has several bodies",
        )],
    );
}

/// By their power of ten, not by three hundred digits.
#[test]
fn numbers_that_are_huge_or_tiny() {
    expect(
        BEAM,
        &[
            (
                &["grid.size=[1e300, 1e300]"],
                "1e300 m along x with h = 0.5 m is 2e300 cells, more than can be numbered",
            ),
            (&["grid.h=1e-300"], "11 m along x with h = 1e-300 m is 1.1"),
            (&["grid.h=1e300"], "with h = 1e300 m, which is 1.1e-299 cells; nearest: 1e300 m"),
            (
                &["body.0.shape.translate=[1e300, 0]"],
                "outside the grid: x from 1e300 to 1e300 m, the grid from 0 to 11 m",
            ),
        ],
    );
    assert!(message(BEAM, &["grid.h=1e-300"]).len() < 300);
}

/// What a later stage says of a key: at its line, at the table's where it is not written, and at
/// the option that set it.
#[test]
fn keys_remember_their_places() {
    let sets = ["load.0.point.force=[0, 1]".to_string()];
    let deck = deck::read(Path::new("beam.toml"), BEAM, &sets).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(
        deck.origins.message("grid.h", "too fine"),
        "\
beam.toml:23:5: grid.h: too fine
    |
 23 | h = 0.5
    |     ^^^"
    );
    assert!(
        deck.origins
            .message("boundary.1.fix", "so")
            .starts_with("beam.toml:43:7: boundary.1.fix: so")
    );
    assert!(deck.origins.message("boundary.1.rotation", "no").starts_with("beam.toml:41:"));
    assert_eq!(
        deck.origins.message("load.0.point.force", "weak"),
        "--set load.0.point.force=[0, 1]: load.0.point.force: weak"
    );
    assert_eq!(deck.origins.message("conditioning", "none"), "beam.toml: conditioning: none");
}
