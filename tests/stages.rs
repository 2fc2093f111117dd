//! Initial stress, and stages in which bodies, boundaries and loads come and go.

mod common;

use common::run::{PointTable, Results, Run, input, probed, relative_difference};

const ALL_FIELDS: &str = "output.fields=[\"displacement\",\"stress\",\"body\"]";

fn with(run: Run, sets: &[&str]) -> Results {
    sets.iter().fold(run, |run, set| run.set(*set)).results()
}

/// A column under K0 between smooth walls.
const COLUMN: &str = r#"
[analysis]
type = "quasi-static"
steps = 2
[grid]
type = "lattice"
size = [4.0, 11.0]
h = 1.0
[material.soil]
model = "mohr-coulomb"
young = 20e6
poisson = 0.3
cohesion = 1e3
friction = 30.0
dilation = 0.0
[[body]]
name = "soil"
material = "soil"
density = 1800.0
shape = { box = { min = [0, 0], max = [4, 10] } }
initial_stress = { unit_weight = 18e3, surface = 10.0, k0 = 0.6, surcharge = 5e3 }
[[boundary]]
where = { side = "left" }
fix = ["x"]
[[boundary]]
where = { side = "right" }
fix = ["x"]
[[boundary]]
where = { side = "bottom" }
fix = ["y"]
[[load]]
gravity = [0, -10]
[[load]]
traction = { side = "top", value = [0, -5e3] }
from = "initial"
[[verify]]
name = "moved"
field = "displacement"
exact = ["0", "0"]
norm = "max"
[[verify]]
name = "sideways"
field = "stress.xx"
exact = "-0.6*(18e3*(10-Y)+5e3)"
norm = "max"
scale = 185e3
"#;

/// formulations.md C.2: an initial K0 state does not move, |u| < 1e-10 H, whatever the basis, the
/// frame and the analysis. The traction acts half a domain below the surface, hence not here.
#[test]
fn a_k0_state_in_balance_stays_where_it_is() {
    let alone = COLUMN.replace(", surcharge = 5e3", "").replace("(18e3*(10-Y)+5e3)", "18e3*(10-Y)");
    let (before, rest) = alone.split_once("[[load]]\ntraction").expect("a traction");
    let after = rest.split_once("[[verify]]").expect("figures").1;
    let deck = format!("{before}[[verify]]{after}");
    let dynamic = ["analysis.duration=0.2", "analysis.steps=200"];
    let cases: [&[&str]; 8] = [
        &["method.basis=\"mpm\""],
        &["method.basis=\"gimp\""],
        &["method.basis=\"cpdi1\""],
        &["method.basis=\"gimp\"", "method.frame=\"updated\""],
        &["method.basis=\"gimp\"", "method.frame=\"total\"", "method.locking=\"f-bar\""],
        &["method.basis=\"gimp\"", "analysis.type=\"implicit-dynamic\"", dynamic[0]],
        &["method.basis=\"gimp\"", "analysis.type=\"explicit\"", dynamic[0], dynamic[1]],
        &[
            "method.basis=\"mpm\"",
            "analysis.type=\"explicit\"",
            "method.mass=\"lumped\"",
            dynamic[0],
            dynamic[1],
        ],
    ];
    for (index, sets) in cases.into_iter().enumerate() {
        let results = with(Run::text(&deck).ranks(1 + index % 3), sets);
        let (moved, sideways) = (results.verify("moved"), results.verify("sideways"));
        assert!(moved < 1e-10 * 10.0, "{sets:?}: {moved:e} m");
        assert!(sideways < 1e-9, "{sets:?}: {sideways:e}");
    }
    // The third axis is that of the stress's third component, too.
    let results = Run::text(&deck.replace("stress.xx", "stress.zz")).results();
    assert!(results.verify("sideways") < 1e-12);
}

/// Loads with `from = "initial"` act in full from the first step on; without it they ramp.
#[test]
fn what_balances_the_initial_stress_acts_in_full() {
    let at_start = Run::text(COLUMN).results();
    let ramped = Run::text(&COLUMN.replace("from = \"initial\"\n", "")).results();
    let reaction = |results: &Results| results.history("reaction.boundary-3.y");
    let weight = 4.0 * (10.0 * 18e3 + 5e3);
    let whole = reaction(&at_start);
    assert!(whole.iter().all(|r| (r / weight - 1.0).abs() < 1e-9), "{whole:?}");
    let part = reaction(&ramped);
    let half = weight - 0.5 * 4.0 * 5e3;
    assert!(
        (part[0] / half - 1.0).abs() < 1e-9 && (part[1] / weight - 1.0).abs() < 1e-9,
        "{part:?}"
    );
    // Components by formulas give what K0 gives.
    let stress = "{ xx = \"-0.6*(18e3*(10-Y)+5e3)\", yy = \"-18e3*(10-Y)-5e3\", zz = \"-0.6*(18e3*(10-Y)+5e3)\" }";
    let k0 = "{ unit_weight = 18e3, surface = 10.0, k0 = 0.6, surcharge = 5e3 }";
    let by_formulas = Run::text(&COLUMN.replace(k0, stress)).results();
    let ends = [&at_start, &by_formulas].map(|results| results.points(2));
    let difference = relative_difference(ends[0].field("stress"), ends[1].field("stress"));
    assert!(difference < 1e-12, "{difference:e}");
}

/// Two layers, the water table in the upper one: the lower one's surcharge is all that rests on its surface,
/// with the water in it. Both rest; the total stress at the base is the weight of both.
#[test]
fn layers_under_a_water_table_rest_with_the_surcharge_of_what_lies_above() {
    let soil = "[material.soil]";
    let body = |name: &str, z: [f64; 2], density: f64, stress: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"soil\"\ndensity = {density}\n\
             shape = {{ box = {{ min = [0, {}], max = [4, {}] }} }}\ninitial_stress = {stress}\n",
            z[0], z[1]
        )
    };
    let upper = "{ unit_weight = 18e3, surface = 10.0, k0 = 0.6 }";
    let lower = "{ unit_weight = 20e3, surface = 5.0, k0 = 0.5, surcharge = 90e3 }";
    let bodies =
        body("upper", [5.0, 10.0], 1800.0, upper) + &body("lower", [0.0, 5.0], 2000.0, lower);
    let (before, rest) = COLUMN.split_once("[[body]]").expect("a body");
    let (_, rest) = rest.split_once("[[boundary]]").expect("boundaries");
    let (boundaries, rest) = rest.split_once("[[load]]\ntraction").expect("a traction");
    let (_, figures) = rest.split_once("[[verify]]").expect("figures");
    let deck = format!(
        "{}{bodies}[[boundary]]{boundaries}[[verify]]{figures}[[probe]]\nname = \"base\"\nnear = [2, 0]\n\
         fields = [\"stress.yy\", \"effective_stress.xx\"]\n",
        before.replace(soil, "[water]\nlevel = 8\nunit_weight = 10e3\n[material.soil]")
    );
    let deck = deck.split_once("[[verify]]\nname = \"sideways\"").map_or(deck.clone(), |(a, b)| {
        format!("{a}{}", &b[b.find("[[probe]]").expect("the probe")..])
    });
    let outcome = Run::text(&deck).set("method.basis=\"gimp\"").ranks(2).attempt();
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    assert!(!outcome.stdout.contains("out of balance"), "{}", outcome.stdout);
    let results = outcome.results();
    assert!(results.verify("moved") < 1e-9, "{:e} m", results.verify("moved"));
    let found = ["base.stress.yy", "base.effective_stress.xx"].map(|name| probed(&results, name));
    // The lowest points lie a quarter of a cell above the base.
    let (total, effective) = (-(90e3 + 20e3 * 4.75), -0.5 * (90e3 + 20e3 * 4.75 - 10e3 * 7.75));
    assert!((found[0] / total - 1.0).abs() < 1e-9, "{found:?}");
    assert!((found[1] / effective - 1.0).abs() < 1e-9, "{found:?}");
    // A layer forgotten: half of the ground's weight that no load of the deck explains.
    let forgotten = Run::text(&deck.replace(", surcharge = 90e3", "")).word("--check").attempt();
    let said = &forgotten.stdout;
    assert!(said.contains("out of balance") && said.contains("most at [1.0, 5.0] m"), "{said}");
}

fn excavation() -> String {
    std::fs::read_to_string(input("excavation")).expect("a deck")
}

/// The same cut in ten layers, each with a stage of one step.
fn in_ten(deck: &str) -> String {
    let dig = "[[stage]]\nname = \"dig\"\nsteps = 4\nreset_displacement = true\n";
    let stage = |k: usize| {
        let reset = if k == 0 { "reset_displacement = true\n" } else { "" };
        format!("[[stage]]\nname = \"dig-{k}\"\nsteps = 1\n{reset}")
    };
    let (before, rest) = deck.split_once("[[body]]\nname = \"cut\"").expect("the cut");
    let (cut, after) = rest.split_once("\n[[boundary]]").expect("boundaries");
    let layer = |k: usize| {
        let (top, next) = (10.0 - 0.5 * k as f64, 9.5 - 0.5 * k as f64);
        let own = cut.replace(
            "min = [0, 5], max = [5, 10]",
            &format!("min = [0, {next:?}], max = [5, {top:?}]"),
        );
        format!("[[body]]\nname = \"cut-{k}\"{}", own.replace("\"dig\"", &format!("\"dig-{k}\"")))
    };
    let layers: String = (0..10).map(layer).collect();
    let stages: String = (0..10).map(stage).collect();
    format!("{before}{layers}\n[[boundary]]{after}").replace(dig, &stages)
}

fn ends(one: &Results, last_of_one: usize, ten: &Results, field: &str) -> f64 {
    let (one, ten) = (one.points(last_of_one), ten.points(11));
    assert_eq!(one.field("body").len(), ten.field("body").len());
    // Layers have other identities: compare by place.
    relative_difference(&by_place(&ten, field), &by_place(&one, field))
}

fn by_place(points: &PointTable, field: &str) -> Vec<f64> {
    let width = points.field(field).len() / points.id.len();
    let place = |p: usize| points.field("position")[3 * p..3 * p + 3].to_vec();
    let mut order: Vec<usize> = (0..points.id.len()).collect();
    let key = |p: usize| place(p).iter().map(|x| (x * 1e3).round() as i64).collect::<Vec<_>>();
    order.sort_by_key(|&p| key(p));
    order.iter().flat_map(|&p| points.field(field)[width * p..width * (p + 1)].to_vec()).collect()
}

/// The header of inputs/excavation.toml.
#[test]
fn an_excavation_in_ten_stages_is_that_in_one() {
    let deck = excavation();
    let stiff = ["material.ground.young=1e16", "ghost=\"off\"", ALL_FIELDS];
    let one = with(Run::text(&deck).ranks(2), &stiff);
    assert_eq!(one.summary["stages"][1]["steps_completed"], 4);
    assert_eq!(one.history("stage"), [1.0, 2.0, 2.0, 2.0, 2.0]);
    let rest = one.points(1);
    let moved = rest.field("displacement").iter().fold(0.0f64, |m, u| m.max(u.abs()));
    assert!(moved < 1e-10 * 10.0, "{moved:e}");
    let ten = with(Run::text(&in_ten(&deck)).ranks(3), &stiff);
    let difference = ends(&one, 5, &ten, "stress");
    assert!(difference < 1e-10, "stress {difference:e}");
    // Finite elements forget their path.
    let lattice = "[grid]\ntype = \"lattice\"\nsize = [20.0, 12.0]\nh = 1.0\n";
    let mesh = "[grid]\ntype = \"mesh\"\ngenerate = { box = { min = [0, 0], max = [20, 12], cells = [20, 24] } }\n";
    let elements = deck.replace(lattice, mesh).replace("basis = \"gimp\"", "control = \"fem\"");
    let elements = ["left", "right", "bottom"].into_iter().fold(elements, |deck, side| {
        deck.replace(&format!("side = \"{side}\""), &format!("tag = \"{side}\""))
    });
    let closely = [ALL_FIELDS, "analysis.tolerance=1e-12"];
    let one = with(Run::text(&elements).ranks(2), &closely);
    let ten = with(Run::text(&in_ten(&elements)), &closely);
    for field in ["displacement", "stress"] {
        let difference = ends(&one, 5, &ten, field);
        assert!(difference < 1e-10, "{field} {difference:e}");
    }
    // The heave of the ground below the cut is upwards, and of the size of the weight over M.
    let heave = one.points(5).component("displacement", 1).into_iter().fold(0.0, f64::max);
    assert!((0.5..1.5).contains(&(heave / (90e3 * 5.0 / 26.9e6))), "{heave}");
}

/// The header of inputs/fill.toml.
#[test]
fn a_fill_loads_the_ground_by_its_weight() {
    for ranks in [1, 2, 3] {
        let results = with(Run::of("fill").ranks(ranks), &[ALL_FIELDS]);
        let end = results.points(4);
        assert_eq!(results.count("points"), 8 * 4 * 4);
        let (y, stress) = (end.component("position", 1), end.component("stress", 3));
        for (y, found) in y.iter().zip(&stress) {
            // Strains are constant in a cell: its middle tells the stress of a layer.
            let y = if *y > 4.0 { y.floor() + 0.5 } else { *y };
            let above = |from: f64, to: f64| (to - y.max(from)).max(0.0);
            let exact = -(18e3 * above(0.0, 4.0) + 20e3 * above(4.0, 8.0));
            assert!(
                (found - exact).abs() < 2e-8 * 152e3,
                "{ranks} ranks, y = {y}: {found} {exact}"
            );
        }
        // At half of the second stage half of the upper layer's weight acts.
        let bottom = results.history("reaction.boundary-3.y");
        let weights = [[288e3, 80e3], [288e3, 160e3], [448e3, 80e3], [448e3, 160e3]];
        for (found, [ground, layer]) in bottom.iter().zip(weights) {
            let exact: f64 = ground + layer;
            assert!((found / exact - 1.0).abs() < 1e-9, "{found} {exact}");
        }
        let settled = end.component("displacement", 1);
        let top = end
            .component("position", 1)
            .iter()
            .zip(&settled)
            .filter(|(y, _)| (**y - 3.75).abs() < 0.1)
            .map(|(_, u)| *u)
            .next();
        let exact = -40e3 * 3.75 / (1e14 * 0.75 / (1.25 * 0.5));
        let found = top.expect("a point at 3.75 m");
        assert!((found / exact - 1.0).abs() < 1e-5, "{found} {exact}");
    }
}

/// Boundaries and loads that go are released over their last stage; what comes ramps over its first.
/// A bar of one cell's height is pulled, held at a second place, let go there, and unloaded.
#[test]
fn loads_and_boundaries_come_and_go() {
    let deck = r#"
[analysis]
type = "quasi-static"
[[stage]]
name = "pull"
steps = 2
[[stage]]
name = "hold"
steps = 1
[[stage]]
name = "unload"
steps = 4
[[stage]]
name = "let go"
steps = 4
[method]
basis = "mpm"
[grid]
type = "lattice"
size = [9.0, 1.0]
h = 1.0
[material.bar]
model = "hencky"
young = 1e12
poisson = 0.0
[[body]]
name = "bar"
material = "bar"
shape = { box = { min = [0, 0], max = [8, 1] } }
[[boundary]]
name = "root"
where = { side = "left" }
fix = ["x"]
[[boundary]]
where = { side = "bottom" }
fix = ["y"]
[[boundary]]
name = "clamp"
where = { box = { min = [4, 0], max = [4, 1] } }
fix = ["x"]
from = "hold"
until = "let go"
[[load]]
point = { nearest = [[7.75, 0.25], [7.75, 0.75]], force = [1e4, 0] }
until = "unload"
[[load]]
body_force = ["1e3*s", 0]
from = "hold"
"#;
    let results = Run::text(deck).ranks(2).results();
    assert_eq!(results.history("stage"), [1, 1, 2, 3, 3, 3, 3, 4, 4, 4, 4].map(f64::from));
    // The clamp holds the pull as it is; what comes later on its right side it takes itself.
    let (root, clamp) = (results.history("reaction.root.x"), results.history("reaction.clamp.x"));
    let exact = [
        [-5e3, 0.0],
        [-1e4, 0.0],
        // Half of the new force on the left goes to each end of that part.
        [-1.2e4, -6e3],
        [-1.2e4, -3.5e3],
        [-1.2e4, -1e3],
        [-1.2e4, 1.5e3],
        [-1.2e4, 4e3],
    ];
    for (step, [of_root, of_clamp]) in exact.into_iter().enumerate() {
        assert!((root[step] - of_root).abs() < 1e-3, "root {step}: {}", root[step]);
        assert!((clamp[step] - of_clamp).abs() < 1e-3, "clamp {step}: {}", clamp[step]);
    }
    // Let go in four equal parts: the root takes over, and ends with all of the body force.
    for (step, part) in (7..11).zip([0.25, 0.5, 0.75, 1.0]) {
        let of_root = -1.2e4 + part * 4e3;
        assert!((root[step] - of_root).abs() < 1e-3, "root {step}: {}", root[step]);
        assert_eq!(clamp[step], 0.0);
    }
}

/// In dynamics bodies come whole, and go with a share 1 - s of their stress and weight: what rests
/// on a body that goes begins to fall, and the ledger tells of no energy from nowhere.
#[test]
fn bodies_come_and_go_in_dynamics() {
    let deck = r#"
[analysis]
type = "explicit"
[[stage]]
name = "rest"
steps = 50
duration = 0.05
[[stage]]
name = "go"
steps = 200
duration = 0.2
[[stage]]
name = "fall"
steps = 50
duration = 0.05
[method]
basis = "gimp"
[grid]
type = "lattice"
size = [2.0, 8.0]
h = 1.0
[material.soil]
model = "hencky"
young = 1e6
poisson = 0.0
[[body]]
name = "stand"
material = "soil"
density = 1000.0
shape = { box = { min = [0, 0], max = [2, 2] } }
initial_stress = { unit_weight = 10e3, surface = 4.0, k0 = 0.0 }
until = "go"
[[body]]
name = "block"
material = "soil"
density = 1000.0
shape = { box = { min = [0, 2], max = [2, 4] } }
initial_stress = { unit_weight = 10e3, surface = 4.0, k0 = 0.0 }
[[body]]
name = "late"
material = "soil"
density = 1000.0
shape = { box = { min = [0, 6], max = [2, 7] } }
from = "go"
[[boundary]]
where = { side = "bottom" }
fix = ["y"]
[[load]]
gravity = [0, -10]
"#;
    for (kind, ranks) in [("explicit", 2), ("implicit-dynamic", 1)] {
        let run = Run::text(&deck.replace("explicit", kind)).ranks(ranks);
        let results = run.results();
        let momentum = results.history("momentum_y");
        assert!(
            momentum[..50].iter().all(|p| p.abs() < 1e-6 * 4e4),
            "{kind}: {:?}",
            &momentum[..50]
        );
        // The late body falls freely from the start of its stage on.
        let time = 0.25;
        let late = -10.0 * time * 2000.0;
        // What the block has lost of its support is between nothing and all.
        let block = *momentum.last().expect("a row") - late;
        let free = -10.0 * 4000.0;
        assert!(block < free * 0.05 && block > free * time, "{kind}: {block}");
        assert_eq!(results.number("bodies.stand.mass"), 0.0);
        assert_eq!(results.count("points"), 8 * 2 + 2 * 4);
    }
}

/// Restart inside a stage and between stages, bit by bit on as many ranks and on other ranks to the
/// solver's tolerance; and a run that goes on with a further stage.
#[test]
fn a_staged_run_goes_on_inside_and_between_stages() {
    let keep =
        ["output.checkpoint={every=1,keep=9}", "output.fields=[\"displacement\",\"stress\"]"];
    let direct = "-qs_ksp_type preonly -qs_pc_type telescope -qs_telescope_pc_type lu \
                  -qs_telescope_ksp_type preonly -qs_telescope_pc_factor_mat_solver_type mumps";
    let solver = |run: Run, ranks: usize| {
        let words = direct.split_whitespace().map(String::from);
        let factor = ["-qs_pc_telescope_reduction_factor".to_string(), ranks.to_string()];
        words.chain(factor).fold(run.ranks(ranks), |run, word| run.word(word))
    };
    let cut = excavation();
    let grown = std::fs::read_to_string(input("fill")).expect("a deck");
    for (deck, last, middle) in [(&cut, 5, [1, 3]), (&grown, 4, [2, 3])] {
        let whole = with(solver(Run::text(deck), 2), &keep);
        for step in middle {
            let checkpoint = whole.directory.join(format!("checkpoint-{step:06}.h5"));
            for ranks in [2, 3] {
                let run = solver(Run::text(deck), ranks).word("--restart");
                let part = with(run.word(checkpoint.display().to_string()), &keep);
                let limit = if ranks == 2 { 0.0 } else { 1e-7 };
                for field in ["displacement", "stress"] {
                    let (a, b) = (whole.points(last), part.points(last));
                    let difference = relative_difference(b.field(field), a.field(field));
                    assert!(
                        difference <= limit,
                        "step {step}, {ranks} ranks: {field} {difference:e}"
                    );
                }
                assert_eq!(part.summary["stages"], whole.summary["stages"]);
            }
        }
    }
    // A further stage, with a load that comes with it.
    let whole = with(solver(Run::text(&grown), 2), &keep);
    let checkpoint = whole.directory.join("checkpoint-000004.h5").display().to_string();
    let more = "\n[[stage]]\nname = \"later\"\nsteps = 1\n[[load]]\nbody_force = [0, -1e3]\nfrom = \"later\"\n";
    let longer = grown.clone() + more;
    let on = with(solver(Run::text(&longer), 2).word("--restart").word(checkpoint.clone()), &keep);
    let weight = on.history("reaction.boundary-3.y");
    assert!((weight[0] / (608e3 + 32e3) - 1.0).abs() < 1e-9, "{weight:?}");
    assert_eq!(on.summary["stages"][2]["steps_completed"], 1);
    // What was there cannot be changed.
    let other = longer.replace("density = 2000.0", "density = 2100.0");
    let refused = solver(Run::text(&other), 2).word("--restart").word(checkpoint).attempt();
    assert_eq!(refused.code, 3);
    assert!(refused.said().contains("density = 2100"), "{}", refused.said());
}

/// Messages of decks whose stages do not fit.
#[test]
fn stages_that_do_not_fit_are_named() {
    let message = |deck: &str| {
        let read = mpm_par::deck::read(std::path::Path::new("deck.toml"), deck, &[]);
        let error = read.expect_err("a faulty deck");
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    };
    let deck = excavation();
    let replaced = |from: &str, to: &str| {
        assert!(deck.contains(from), "{from}");
        message(&deck.replacen(from, to, 1))
    };
    let unknown = replaced("until = \"dig\"", "until = \"dug\"");
    assert!(
        unknown.contains("body.1.until: expected one of \"rest\", \"dig\", found \"dug\""),
        "{unknown}"
    );
    assert!(unknown.contains("did you mean \"dig\"?"));
    let order = replaced("until = \"dig\"", "from = \"dig\"\nuntil = \"rest\"");
    assert!(
        order.contains("goes with stage \"rest\", before it comes with stage \"dig\""),
        "{order}"
    );
    let at_once = replaced("until = \"dig\"", "from = \"dig\"\nuntil = \"dig\"");
    assert!(at_once.contains("comes and goes in stage \"dig\""), "{at_once}");
    let empty = replaced("until = \"dig\"\n", "");
    assert!(empty.contains("stage.1: stage \"dig\" is empty"), "{empty}");
    let nothing =
        message(&deck.replace("k0 = 0.5 }\n\n[[body]]", "k0 = 0.5 }\nuntil = \"dig\"\n\n[[body]]"));
    assert!(nothing.contains("stage \"dig\" holds no body"), "{nothing}");
    let hanging = replaced(
        "[[load]]\n",
        "[[load]]\npoint = { body = \"cut\", nearest = [1, 9.75], force = [0, -1] }\n[[load]]\n",
    );
    assert!(
        hanging.contains("load.0: acts on body \"cut\" after that has gone with stage \"dig\""),
        "{hanging}"
    );
    assert!(hanging.contains("give it until = \"dig\""), "{hanging}");
    let free = replaced("side = \"bottom\" }\n", "side = \"bottom\" }\nuntil = \"dig\"\n");
    assert!(free.contains("no [[boundary]] holds y in stage \"dig\""), "{free}");
    let steps = replaced("type = \"quasi-static\"", "type = \"quasi-static\"\nsteps = 3");
    assert!(steps.contains("analysis.steps: each [[stage]] has its own"), "{steps}");
    let twice = replaced("name = \"dig\"", "name = \"rest\"");
    assert!(twice.contains("another stage is called \"rest\""), "{twice}");
    let none = message(&COLUMN.replace("from = \"initial\"", "from = \"now\""));
    assert!(none.contains("load.1.from: expected \"initial\", found \"now\""), "{none}");
    let both = message(&COLUMN.replace("k0 = 0.6,", "k0 = 0.6, xx = 1.0,"));
    assert!(both.contains("initial_stress.xx: K0 sets all components"), "{both}");
    // A block on a stand that is taken away.
    let high = deck.replace("min = [0, 0], max = [20, 10]", "min = [0, 5], max = [20, 10]");
    let stand = high.replace(
        "shape = { box = { min = [0, 5], max = [5, 10] } }",
        "shape = { box = { min = [0, 0], max = [20, 5] } }",
    );
    let hangs = Run::text(&stand).ranks(2).attempt();
    assert_eq!(hangs.code, 2, "{}", hangs.said());
    let said = hangs.said();
    assert!(said.contains("in stage \"dig\", without what has gone by then: body"), "{said}");
    assert!(said.contains("can move along y freely"), "{said}");
    let weak = Run::text(&COLUMN.replace("k0 = 0.6,", "k0 = 0.1,")).ranks(2).attempt();
    assert_eq!(weak.code, 2);
    let said = weak.said();
    assert!(
        said.contains("body.0.initial_stress") && said.contains("outside the yield surface"),
        "{said}"
    );
}
