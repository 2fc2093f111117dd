//! Linear iterations on a slope of non-associated soil that flows: over cells, ranks, places on the grid, with
//! F-bar and without Ghost.

mod common;

use common::run::Run;
use common::validation::record_in;

/// 2:1, 10 m high, dilation 0; the tangent is unsymmetric where it flows. Its weight comes in two steps.
const SLOPE: &str = r#"
[analysis]
type = "quasi-static"
steps = 2
max_iterations = 25
[method]
basis = "mpm"
[grid]
type = "lattice"
size = [36.0, 12.0]
h = 0.5
[material.soil]
model = "drucker-prager"
young = 1e8
poisson = 0.4
cohesion = 10e3
friction = 20.0
dilation = 0.0
[[body]]
name = "slope"
material = "soil"
density = 2000.0
shape = { polygon = { vertices = VERTICES } }
lattice = { spacing = SPACING, offset = [OFFSET, OFFSET] }
[[boundary]]
where = { side = "left" }
fix = ["x"]
[[boundary]]
where = { side = "bottom" }
fix = ["x", "y"]
[[load]]
gravity = [0, -10]
[output]
every = 2
fields = ["plastic_strain"]
[petsc]
qs_pc_type = "mg"
qs_ksp_rtol = 1e-8
"#;

/// 2 x 2 points a cell whose top lies the share `above` of a cell above a line of the grid. All soil
/// has yielded at a Poisson's ratio of 0.3, for then the weight alone presses by more than the friction bears.
fn slope(h: f64, above: f64) -> Run {
    let top = 10.0 + above * h;
    let (spacing, k) = (top * h / 20.0, top / 10.0);
    let vertices = format!("[[0,0],[{},0],[{},{top}],[0,{top}]]", 32.0 * k, 12.0 * k);
    let text = SLOPE
        .replace("VERTICES", &vertices)
        .replace("SPACING", &spacing.to_string())
        .replace("OFFSET", &(0.5 * spacing).to_string());
    // Strength and stiffness grow with the size: all these slopes are alike.
    Run::text(&text)
        .set(format!("grid.h={h}"))
        .set(format!("material.soil.cohesion={}", 10e3 * k))
        .set(format!("material.soil.young={}", 1e8 * k))
}

/// Linear iterations per solve in the elastic first half of the weight and in the second half.
fn iterations(run: &Run) -> [f64; 2] {
    let results = run.results();
    let [linear, newton] = ["linear_iterations", "newton_iterations"].map(|c| results.history(c));
    let flowing = results.points(2);
    assert!(flowing.field("plastic_strain").iter().any(|&strain| strain > 0.0), "nothing flows");
    [0, 1].map(|step| linear[step] / (newton[step] - 1.0))
}

#[test]
fn a_slope_takes_the_same_iterations_on_all_ranks_and_nearly_so_anywhere_on_the_grid() {
    let [elastic, flowing] = iterations(&slope(0.5, 0.02));
    for ranks in 2..=4 {
        let [a, b] = iterations(&slope(0.5, 0.02).ranks(ranks));
        // A norm may fall to either side of the tolerance by round-off.
        assert!((a - elastic).abs() <= 1.0 && (b - flowing).abs() <= 1.0, "{ranks} ranks: {a} {b}");
    }
    let others = [
        ("place", slope(0.5, 0.3)),
        ("place", slope(0.5, 0.7)),
        ("f-bar", slope(0.5, 0.02).set("method.locking=\"f-bar\"")),
        ("h/2", slope(0.25, 0.02)),
    ];
    for (name, run) in others {
        let found = iterations(&run.ranks(2));
        // More or less of the toe flows as it lies in the cells.
        let most = if name == "place" { [1.15, 1.3] } else { [1.2, 1.2] };
        for ((found, reference), most) in found.iter().zip([elastic, flowing]).zip(most) {
            let ratio = found / reference;
            assert!((1.0 / most..most).contains(&ratio), "{name}: {found} beside {reference}");
        }
    }
}

/// A preconditioner that the user names alone gets an iteration around it on a small system, and factors that
/// the user asks for on a large one are those of the iterate.
#[test]
fn a_preconditioner_of_the_users_suits_any_size() {
    let direct = |run: Run| {
        run.set("petsc={qs_pc_type=\"lu\",qs_ksp_type=\"preonly\",qs_pc_factor_mat_solver_type=\"mumps\"}")
    };
    let newton = |run: Run| run.results().history("newton_iterations");
    for h in [0.5, 0.2] {
        let levels = slope(h, 0.0).results();
        let counts = levels.history("newton_iterations");
        let linear = levels.number("linear_iterations.total");
        assert!(linear > 5.0 * counts.iter().sum::<f64>(), "{linear} at {h}");
        assert_eq!(newton(direct(slope(h, 0.0))), counts, "{h}");
    }
}

/// The tables of docs/evidence/unsymmetric.md.
#[test]
#[ignore = "minutes"]
fn iterations_on_slopes_that_flow() {
    let off = |run: Run| run.set("ghost=\"off\"");
    let bar = |run: Run| run.set("method.locking=\"f-bar\"");
    let wide = |run: Run| run.set("material.soil.poisson=0.3");
    let text = |[a, b]: [f64; 2]| format!("{a:.1}, {b:.1}");
    let mut rows = Vec::new();
    for h in [0.5, 0.25, 0.125, 0.0625] {
        let of = |change: &dyn Fn(Run) -> Run| text(iterations(&change(slope(h, 0.02)).ranks(2)));
        let mut row = vec![h.to_string(), of(&|run| run), of(&off), of(&bar)];
        // The finest one takes minutes for steps of hundreds of iterations.
        row.push(if h < 0.1 { String::new() } else { of(&wide) });
        rows.push(row);
    }
    let header = ["h [m]", "Ghost", "off", "Ghost, F-bar", "all soil flows"];
    record_in("unsymmetric.md", "slope-cells", &header, &rows);
    let mut rows = Vec::new();
    for ranks in [1, 2, 4, 8, 16] {
        let of = |run: Run| text(iterations(&run.ranks(ranks)));
        let runs = [slope(0.25, 0.02), off(slope(0.25, 0.02)), bar(slope(0.25, 0.02))];
        let [a, b, c] = runs.map(of);
        rows.push(vec![ranks.to_string(), a, b, c]);
    }
    record_in("unsymmetric.md", "slope-ranks", &["ranks", "Ghost", "off", "Ghost, F-bar"], &rows);
    let mut rows = Vec::new();
    for above in [0.0, 0.02, 0.27, 0.5, 0.7, 0.9] {
        let of = |run: Run| text(iterations(&run.ranks(2)));
        let runs = [slope(0.25, above), off(slope(0.25, above)), bar(slope(0.25, above))];
        let [a, b, c] = runs.map(of);
        rows.push(vec![above.to_string(), a, b, c]);
    }
    let header = ["top above a line of the grid [h]", "Ghost", "off", "Ghost, F-bar"];
    record_in("unsymmetric.md", "slope-places", &header, &rows);
    let mut rows = Vec::new();
    for h in [0.5, 0.25, 0.125, 0.0625] {
        let of = |dilation: f64| {
            let run = slope(h, 0.02).set(format!("material.soil.dilation={dilation:?}"));
            text(iterations(&run.set("analysis.tangent=\"unsymmetric\"").ranks(2)))
        };
        rows.push(vec![h.to_string(), of(0.0), of(10.0), of(20.0)]);
    }
    let header = ["h [m]", "dilation 0", "10 degrees", "20 degrees, associated"];
    record_in("unsymmetric.md", "slope-dilation", &header, &rows);
}
