//! What acts on bodies' own surfaces, wherever they lie on the grid: supports, tractions, pressures
//! (formulations.md B.6, C.2, C.6).

mod common;
#[path = "common/program.rs"]
mod program;

use std::path::Path;

use common::on_ranks;
use common::product::product;
use common::run::{PointTable, Results, Run, input, last, relative_difference};
use mpi::environment::Universe;
use mpi::traits::*;
use mpm_par::deck;
use mpm_par::parallel::World;
use mpm_par::run::setup;
use mpm_par::system::scatter::BlockMatrix;
use mpm_par::system::step_system::Discretisation;
use mpm_par::system::terms::surface::SurfaceTerm;
use mpm_par::system::terms::term::{At, Part};
use program::{difference, points_of, run_well};

const WEIGHT: f64 = 1.5 * 1000.0 * 10.0;

fn incline(degrees: f64, h: f64) -> Run {
    let (half, quarter) = (0.5 * h, 0.25 * h);
    Run::of("inclined-roller")
        .set(format!("body.0.shape.rotate.degrees={degrees}"))
        .set(format!("grid.h={h}"))
        .set(format!("body.0.lattice={{spacing={half},offset=[{quarter},{quarter}]}}"))
}

/// The same block on nodes held along the axes, under its weight turned.
fn aligned(degrees: f64, h: f64) -> Run {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let (x, y) = (-10.0 * sin, -10.0 * cos);
    incline(0.0, h)
        .set("grid.origin=[0,0]")
        .set("grid.size=[2,1.5]")
        .set("boundary=[{where={side=\"bottom\"},fix=[\"y\"]},{where={side=\"left\"},fix=[\"x\"]}]")
        .set(format!("load=[{{gravity=[{x},{y}]}}]"))
}

/// Place, displacement and stress (xx, xy, yy) of each point in axes turned by `degrees`, ordered by
/// place.
fn turned(points: &PointTable, degrees: f64) -> Vec<[f64; 7]> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let back = |v: &[f64]| [cos * v[0] + sin * v[1], cos * v[1] - sin * v[0]];
    let mut rows: Vec<[f64; 7]> = (0..points.id.len())
        .map(|p| {
            let x = back(&points.field("position_initial")[3 * p..3 * p + 2]);
            let u = back(&points.field("displacement")[3 * p..3 * p + 2]);
            let s = &points.field("stress")[6 * p..6 * p + 6];
            let (xx, xy, yy) = (s[0], s[1], s[3]);
            let along = cos * cos * xx + 2.0 * sin * cos * xy + sin * sin * yy;
            let across = sin * sin * xx - 2.0 * sin * cos * xy + cos * cos * yy;
            let shear = sin * cos * (yy - xx) + (cos * cos - sin * sin) * xy;
            [x[0], x[1], u[0], u[1], along, shear, across]
        })
        .collect();
    let key = |row: &[f64; 7]| [(row[1] * 1e6).round() as i64, (row[0] * 1e6).round() as i64];
    rows.sort_by_key(key);
    rows
}

/// Error of displacements, root mean square over that of the aligned run's; and of the mean stresses in
/// bands of a fifth of the height, over rho g H.
fn errors(degrees: f64, h: f64) -> (f64, f64) {
    let found = turned(&incline(degrees, h).results().points(2), degrees);
    let exact = turned(&aligned(degrees, h).results().points(2), 0.0);
    assert_eq!(found.len(), exact.len());
    let (mut wrong, mut size) = (0.0, 0.0);
    let mut bands = [[0.0; 4]; 5];
    for (a, b) in found.iter().zip(&exact) {
        assert!((a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9);
        for k in [2, 3] {
            wrong += (a[k] - b[k]).powi(2);
            size += b[k] * b[k];
        }
        let band = &mut bands[(a[1] * 5.0) as usize];
        (0..3).for_each(|k| band[k] += a[4 + k] - b[4 + k]);
        band[3] += 1.0;
    }
    let of_band = |band: &[f64; 4]| band[..3].iter().fold(0.0f64, |m, s| m.max(s.abs())) / band[3];
    let stress = bands.iter().map(of_band).fold(0.0, f64::max) / 1e4;
    ((wrong / size).sqrt(), stress)
}

/// The plane carries what presses on it and nothing along it, the stop the rest: exactly, as the weights
/// of the elements sum to one.
#[test]
fn a_block_on_an_inclined_plane_presses_with_its_weight() {
    for degrees in [5.0f64, 25.0, 45.0] {
        let results = incline(degrees, 0.1).results();
        let (sin, cos) = degrees.to_radians().sin_cos();
        let of = |name: &str| {
            let force = |axis: &str| last(&results, &format!("reaction.{name}.{axis}"));
            (force("x") * cos + force("y") * sin, force("y") * cos - force("x") * sin)
        };
        let (plane, stop) = (of("plane"), of("stop"));
        for (value, exact) in
            [(plane.1, WEIGHT * cos), (plane.0, 0.0), (stop.0, WEIGHT * sin), (stop.1, 0.0)]
        {
            assert!((value - exact).abs() < 1e-6 * WEIGHT, "{degrees}: {value} for {exact}");
        }
        // What is done on the block is in it: the weight's work less what the springs keep.
        let inside = last(&results, "energy_strain") + last(&results, "energy_ghost");
        assert!((last(&results, "work_external") / inside - 1.0).abs() < 2e-3);
    }
}

/// The sum over a step's solves hardly depends on the penalty, on h and on the ranks: 42 and 53 for 10
/// and 100 at h = 1/80 (docs/evidence/contact.md).
#[test]
fn linear_iterations_hardly_grow_with_the_penalty() {
    let count = |h: f64, penalty: f64, ranks: usize| {
        let run = incline(25.0, h)
            .ranks(ranks)
            .set("analysis.steps=1")
            .set("output.every=1")
            .set(format!("boundary.0.penalty={penalty}"))
            .set(format!("boundary.1.penalty={penalty}"))
            .set("petsc={qs_pc_type=\"mg\",qs_ksp_type=\"cg\",qs_ksp_rtol=\"1e-8\"}");
        last(&run.results(), "linear_iterations")
    };
    let (soft, stiff, stiffest) =
        (count(0.025, 10.0, 1), count(0.025, 100.0, 1), count(0.025, 1000.0, 1));
    assert!(stiff < 1.5 * soft && stiffest < 1.5 * soft, "{soft}, {stiff}, {stiffest}");
    let fine = count(0.0125, 100.0, 1);
    assert!(fine < 1.2 * stiff, "{stiff} at 1/40, {fine} at 1/80");
    for ranks in [2, 3] {
        let spread = count(0.025, 100.0, ranks);
        assert!((spread - stiff).abs() <= 2.0, "{spread} on {ranks} ranks, {stiff} on one");
    }
}

/// Measured at 25 degrees: u to 9.8e-3, 4.3e-3 and 2.1e-3 at h = 1/10, 1/20 and 1/40 of the height.
#[test]
fn settlement_and_stress_on_an_inclined_plane_are_those_on_rollers() {
    for degrees in [25.0, 45.0] {
        let (coarse, fine) = (errors(degrees, 0.1), errors(degrees, 0.05));
        assert!(fine.0 < 0.01 && fine.1 < 0.01, "{degrees}: {fine:?}");
        let order = (coarse.0 / fine.0).log2();
        assert!(order > 0.95, "{degrees}: order {order}, {coarse:?} {fine:?}");
    }
}

/// A line fixed in space holds the side that lies on it, however far the line reaches beyond.
#[test]
fn a_line_under_a_body_supports_it_as_its_own_side() {
    let degrees = 25.0f64;
    let (sin, cos) = degrees.to_radians().sin_cos();
    let at = |s: f64| format!("[{},{}]", s * cos, s * sin);
    let line = format!("boundary.0.surface={{line=[{},{}]}}", at(-0.3), at(1.7));
    let side = incline(degrees, 0.1).results();
    let line = incline(degrees, 0.1).set(line).results();
    let of = |results: &Results| results.points(2).field("displacement").to_vec();
    let apart = relative_difference(&of(&line), &of(&side));
    assert!(apart < 1e-2, "{apart}");
    let (a, b) = (last(&line, "reaction.plane.y"), last(&side, "reaction.plane.y"));
    assert!((a / b - 1.0).abs() < 1e-8, "{a} {b}");
}

/// What slides off the end of a line is free: half of the block's foot is held after it has moved by
/// half of its length.
#[test]
fn a_line_holds_what_lies_on_it() {
    let run = Run::text(
        r#"
[analysis]
type = "quasi-static"
steps = 10
[grid]
type = "lattice"
size = [4.0, 2.0]
h = 0.25
[material.soil]
model = "hencky"
young = 1e7
poisson = 0.0
[[body]]
material = "soil"
density = 0.0
shape = { box = { min = [0.5, 0.6], max = [1.5, 1.6] } }
[[boundary]]
name = "line"
surface = { line = [[0.2, 0.6], [1.5, 0.6]] }
slip = true
[[boundary]]
name = "pull"
surface = { body = "body-1", side = "top" }
displacement = { x = 0.5, y = 0.0 }
[output]
every = 10
"#,
    );
    let held = run.results().history("reaction.line.held");
    let share = held.last().expect("a row") / held[0];
    assert!((share - 0.5).abs() < 0.13, "{held:?}");
}

/// Ranks agree, and a restart is the run without interruption, bit by bit.
#[test]
fn surfaces_go_with_their_points_over_ranks_and_restarts() {
    let folder = tempfile::tempdir().expect("a folder");
    let deck = input("inclined-roller");
    let more = ["--set", "analysis.steps=4", "--set", "output.checkpoint={every=2,keep=9}"];
    let ends: Vec<_> = (1..=3)
        .map(|ranks| {
            let out = folder.path().join(format!("whole-{ranks}"));
            run_well(ranks, &deck, &out, &more);
            points_of(&out.join("checkpoint-000004.h5"))
        })
        .collect();
    for end in &ends[1..] {
        let (error, field) = difference(&ends[0], end);
        assert!(error < 1e-8, "{field} differs by {error:e}");
    }
    for ranks in [2, 3] {
        let part = folder.path().join(format!("part-{ranks}"));
        let middle = folder.path().join("whole-2/checkpoint-000002.h5").display().to_string();
        run_well(ranks, &deck, &part, &[&more[..], &["--restart", &middle]].concat());
        let (error, field) = difference(&ends[1], &points_of(&part.join("checkpoint-000004.h5")));
        let limit = if ranks == 2 { 0.0 } else { 1e-8 };
        assert!(error <= limit, "{ranks} ranks: {field} differs by {error:e}");
    }
}

/// A bar under a traction on its top, which a support of the second stage holds while the traction goes.
const PROPPED: &str = r#"
[analysis]
type = "quasi-static"
tolerance = 1e-12
[[stage]]
name = "loaded"
steps = 2
[[stage]]
name = "propped"
steps = 4
[method]
basis = "gimp"
[grid]
type = "lattice"
origin = [-0.5, -0.5]
size = [2.0, 2.0]
h = 0.25
[material.m]
model = "hencky"
young = 1e6
poisson = 0.0
[[body]]
name = "bar"
material = "m"
shape = { box = { min = [0.1, 0.07], max = [1.1, 1.07] } }
[[boundary]]
name = "foot"
surface = { side = "bottom" }
[[boundary]]
name = "prop"
surface = { side = "top" }
from = "propped"
[[load]]
traction = { side = "top", value = [0.0, -100.0] }
until = "propped"
[output]
checkpoint = { every = 1, keep = 9 }
"#;

/// A support of a later stage holds its surface where it was as that stage began: it bears what the traction bore,
/// less what its penalty gives way; a displacement counts from there. A restart knows the place.
#[test]
fn a_support_of_a_later_stage_holds_what_it_finds() {
    let (young, pressure, gives_way) = (1e6, 100.0, 0.25 / (100.0 * 1e6));
    // The way of the top under the traction: the bar's and that of the foot's penalty.
    let compliance = 1.0 / young + gives_way;
    let found = pressure * compliance;
    for driven in [0.0, -0.7e-4] {
        let results = Run::text(PROPPED).set(format!("boundary.1.displacement={{y={driven}}}"));
        let results = results.results();
        let force = results.history("reaction.prop.y");
        assert_eq!(force[1], 0.0, "nothing is there before");
        let expected = -(found - driven) / (compliance + gives_way);
        let last = force[force.len() - 1];
        assert!((last / expected - 1.0).abs() < 1e-3, "{driven}: {last} {expected}");
        // Until the traction has gone the foot bears both.
        let foot = results.history("reaction.foot.y");
        assert!((foot[3] + force[3] - 0.5 * pressure).abs() < 1e-6 * pressure, "{foot:?}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let deck = folder.path().join("deck.toml");
    std::fs::write(&deck, PROPPED).expect("a deck");
    let at = |name: &str| folder.path().join(name);
    run_well(1, &deck, &at("one"), &[]);
    run_well(2, &deck, &at("two"), &[]);
    let end = |name: &str| points_of(&at(name).join("checkpoint-000006.h5"));
    let (error, field) = difference(&end("one"), &end("two"));
    assert!(error < 1e-8, "{field} differs by {error:e}");
    for (name, step) in [("begin", 2), ("middle", 4)] {
        let from = at("two").join(format!("checkpoint-00000{step}.h5")).display().to_string();
        run_well(2, &deck, &at(name), &["--restart", &from]);
        let (error, field) = difference(&end("two"), &end(name));
        assert!(error == 0.0, "{name}: {field} differs by {error:e}");
    }
}

/// Driven by its surfaces alone: the lower side of a column is held, the upper one pressed down. With
/// the gap p h / (penalty E) at either end, -E ln(l) / l = p.
#[test]
fn a_driven_surface_presses_a_column_as_the_closed_form_says() {
    let (young, h, penalty) = (1e6, 0.1, 100.0);
    let pressure = |l: f64| -young * l.ln() / l;
    let (mut low, mut high) = (0.5, 1.0);
    for _ in 0..60 {
        let l = 0.5 * (low + high);
        let moved = 1.0 - l + 2.0 * pressure(l) * h / (penalty * young);
        if moved > 0.1 { low = l } else { high = l }
    }
    let exact = 1.5 * pressure(0.5 * (low + high));
    let (sin, cos) = 25f64.to_radians().sin_cos();
    let (x, y) = (0.1 * sin, -0.1 * cos);
    let results = incline(25.0, h)
        .set("material.soil.poisson=0")
        .set("load=")
        .set(format!(
            "boundary=[{{name=\"foot\",surface={{side=\"bottom\"}},slip=true}},\
             {{name=\"stop\",surface={{side=\"left\"}},slip=true}},\
             {{name=\"top\",surface={{side=\"top\"}},slip=true,displacement={{x={x},y={y}}}}}]"
        ))
        .set("analysis.steps=4")
        .results();
    let normal = |name: &str| {
        last(&results, &format!("reaction.{name}.y")) * cos
            - last(&results, &format!("reaction.{name}.x")) * sin
    };
    assert!((normal("foot") / exact - 1.0).abs() < 0.01, "{} {exact}", normal("foot"));
    assert!((normal("foot") + normal("top")).abs() < 1e-7 * exact);
    let inside = last(&results, "energy_strain") + last(&results, "energy_ghost");
    assert!((last(&results, "work_external") / inside - 1.0).abs() < 2e-2);
}

/// Impulses are changes of momentum to round-off, work that of energy to the error of the scheme; the
/// penalty is in the stable time step, which an explicit run follows.
#[test]
fn supports_keep_momentum_and_energy_in_dynamics() {
    for (analysis, gap) in [
        ("{type=\"explicit\",duration=0.1,cfl=0.9}", 0.01),
        ("{type=\"implicit-dynamic\",duration=0.1,steps=20}", 0.01),
    ] {
        let results = incline(25.0, 0.1).set(format!("analysis={analysis}")).results();
        let columns = |names: [&str; 4]| names.map(|name| results.history(name));
        let [dt, momentum, plane, stop] =
            columns(["dt", "momentum_y", "reaction.plane.y", "reaction.stop.y"]);
        let impulse: f64 = (0..dt.len()).map(|k| dt[k] * (plane[k] + stop[k] - WEIGHT)).sum();
        let end = momentum.last().expect("a row");
        assert!((impulse - end).abs() < 1e-9 * WEIGHT * 0.1, "{impulse} {end}");
        let [kinetic, strain, work, _] =
            columns(["energy_kinetic", "energy_strain", "work_external", "dt"]);
        let largest = work.iter().fold(0.0f64, |m, w| m.max(w.abs()));
        for k in 0..work.len() {
            let lost = kinetic[k] + strain[k] - work[k];
            assert!(lost.abs() < gap * largest, "{analysis}: {lost} of {largest} in row {k}");
        }
    }
}

/// Lame's ring: order 2 for displacements, 1 for stresses (measured 1.93 and 0.94).
#[test]
fn pressure_in_a_ring_follows_lame() {
    let at = |h: f64| {
        let results = Run::of("ring").set(format!("grid.h={h}")).results();
        (results.verify("displacement_error"), results.verify("stress_error"))
    };
    let (coarse, fine) = (at(0.5), at(0.25));
    assert!(fine.0 < 0.005 && fine.1 < 0.015, "{fine:?}");
    assert!((coarse.0 / fine.0).log2() > 1.7, "{coarse:?} {fine:?}");
    assert!((coarse.1 / fine.1).log2() > 0.8, "{coarse:?} {fine:?}");
}

/// Lame's sphere, an eighth of it: u = p a^3 / (E (b^3 - a^3)) [(1 - 2 nu) r + (1 + nu) b^3 / (2 r^2)].
#[test]
fn pressure_in_a_sphere_follows_lame() {
    let at = |h: f64| {
        let ball = |radius: f64| format!("{{ball={{centre=[0,0,0],radius={radius}}}}}");
        let scale = 1e5 / 1e9 / 26.0;
        let exact = |x: &str| format!("{scale:e}*(0.4 + 0.65*27/(X*X+Y*Y+Z*Z)^1.5)*{x}");
        let wall =
            |side: &str, axis: &str| format!("{{where={{side=\"{side}\"}},fix=[\"{axis}\"]}}");
        Run::of("ring")
            .set(format!("grid={{type=\"lattice\",size=[3.5,3.5,3.5],h={h}}}"))
            .set(format!(
                "body.0.shape={{intersection=[{{difference=[{},{}]}},\
                 {{box={{min=[0,0,0],max=[4,4,4]}}}}]}}",
                ball(3.0),
                ball(1.0)
            ))
            .set("body.0.points_per_cell=2")
            .set(format!(
                "boundary=[{},{},{}]",
                wall("left", "x"),
                wall("bottom", "y"),
                wall("back", "z")
            ))
            .set(
                "load=[{pressure={value=1e5,surface={where=\
                 \"x*x+y*y+z*z < 1.1 && x*y*z > 1e-7\"}}}]",
            )
            .set(format!(
                "verify=[{{name=\"error\",field=\"displacement\",exact=[\"{}\",\"{}\",\"{}\"],\
                 scale={:e}}}]",
                exact("X"),
                exact("Y"),
                exact("Z"),
                scale * (0.4 + 0.65 * 27.0)
            ))
            .results()
            .verify("error")
    };
    let (coarse, fine) = (at(0.5), at(0.25));
    assert!(fine < 0.01 && coarse / fine > 2.5, "{coarse} {fine}");
}

/// Errors of the pressure at the displacement found, front by front.
fn cylinder(young: f64) -> Vec<f64> {
    let results =
        Run::of("cylinder").set(format!("material.steel.young={young:e}")).ranks(2).results();
    let k = 0.24e9 / 3f64.sqrt();
    let pressure = |c: f64| k * (1.0 - c * c / 0.04 + 2.0 * (c / 0.1).ln());
    let fronts = [0.10, 0.12, 0.14, 0.16, 0.18];
    (1..=5)
        .map(|step| {
            let points = results.points(step);
            let (mut sum, mut count) = (0.0, 0.0);
            for (x, u) in points
                .field("position_initial")
                .chunks_exact(3)
                .zip(points.field("displacement").chunks_exact(3))
            {
                let r = x[0].hypot(x[1]);
                if r > 0.185 {
                    let radial = (x[0] * u[0] + x[1] * u[1]) / r;
                    sum += radial / (1.3 / young * k / 0.04 * (0.4 * r + 0.04 / r));
                    count += 1.0;
                }
            }
            let front = f64::sqrt(sum / count);
            (pressure(front) / pressure(fronts[step - 1]) - 1.0).abs()
        })
        .collect()
}

/// Of steel, whose strains of 0.2 % are not small; and a hundred times stiffer, as in the closed form.
#[test]
fn a_thick_cylinder_yields_as_hill_says() {
    let steel = cylinder(210e9);
    assert!(steel[..4].iter().all(|e| *e < 0.005) && steel[4] < 0.0075, "{steel:?}");
    let stiff = cylinder(210e11);
    assert!(stiff.iter().all(|e| *e < 0.003), "{stiff:?}");
}

/// Widening of the cavity's wall: of points near it, u r = A + B r^2 in the mean (least squares).
fn widening(points: &PointTable) -> f64 {
    let (mut sums, mut rights) = ([0.0; 3], [0.0; 2]);
    let places = points.field("position_initial").chunks_exact(3);
    for (x, u) in places.zip(points.field("displacement").chunks_exact(3)) {
        let r = x[0].hypot(x[1]);
        if r < 1.3 {
            let (radial, basis) = ((x[0] * u[0] + x[1] * u[1]) / r, [1.0 / r, r]);
            for (k, (row, column)) in [(0, 0), (0, 1), (1, 1)].into_iter().enumerate() {
                sums[k] += basis[row] * basis[column];
            }
            (0..2).for_each(|k| rights[k] += basis[k] * radial);
        }
    }
    let [a, b, c] = sums;
    // A + B at the wall, r = 1.
    ((c - b) * rights[0] + (a - b) * rights[1]) / (a * c - b * b)
}

#[test]
#[ignore = "a minute and a half"]
fn a_quarter_of_a_cavity_widens_as_the_whole() {
    let results = Run::of("cavity-quarter").ranks(2).limit(900).results();
    for (step, wide) in [(3, 0.01), (6, 0.05), (9, 0.1), (12, 0.2)] {
        let found = widening(&results.points(step));
        assert!((found / wide - 1.0).abs() < 0.01, "{found} for {wide}");
    }
}

/// Nitsche's method at a tenth of the penalty is as exact as the penalty, and four times as exact as that
/// penalty without it (measured at h = 1/20 of the height: 5.2e-3 for 4.3e-3 and 2.4e-2); wall forces are
/// the weight in any case.
#[test]
fn nitsche_holds_exactly_with_a_small_penalty() {
    let degrees = 25.0f64;
    let exact = turned(&aligned(degrees, 0.05).results().points(2), 0.0);
    let of = |method: &str, penalty: f64| {
        let mut run = incline(degrees, 0.05);
        for support in [0, 1] {
            run = run
                .set(format!("boundary.{support}.method=\"{method}\""))
                .set(format!("boundary.{support}.penalty={penalty}"));
        }
        let results = run.results();
        let (sin, cos) = degrees.to_radians().sin_cos();
        let force = |axis: &str| last(&results, &format!("reaction.plane.{axis}"));
        let normal = force("y") * cos - force("x") * sin;
        assert!((normal - WEIGHT * cos).abs() < 1e-6 * WEIGHT, "{normal}");
        // Newton's order: the tangent is that of the force.
        assert!(results.count("newton_iterations.max") <= 5);
        let found = turned(&results.points(2), degrees);
        let squares = |k: usize| {
            let pairs = found.iter().zip(&exact);
            pairs
                .map(|(a, b)| ((a[k] - b[k]).powi(2), b[k] * b[k]))
                .fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1))
        };
        let (x, y) = (squares(2), squares(3));
        ((x.0 + y.0) / (x.1 + y.1)).sqrt()
    };
    let (nitsche, penalty) = (of("nitsche", 10.0), of("penalty", 10.0));
    assert!(nitsche < 0.006 && penalty > 3.0 * nitsche, "{nitsche} {penalty}");
}

fn tangents(universe: &Universe) {
    let world = World::new(universe.world().duplicate());
    for (basis, locking) in
        [("mpm", "none"), ("gimp", "none"), ("cpdi2", "none"), ("gimp", "f-bar")]
    {
        tangent::<2>(&world, basis, locking);
    }
    tangent::<3>(&world, "gimp", "none");
}

/// The tangent times a direction is the central difference of the force.
fn tangent<const D: usize>(world: &World, basis: &str, locking: &str) {
    let list = |value: f64| format!("{:?}", vec![value; D]);
    let turn = if D == 2 { "degrees = 20" } else { "degrees = 20, axis = [1, 2, 0.5]" };
    let text = format!(
        "[analysis]\ntype = \"quasi-static\"\nsteps = 1\n[method]\nbasis = \"{basis}\"\n\
         locking = \"{locking}\"\n\
         [grid]\ntype = \"lattice\"\norigin = {}\nsize = {}\nh = 1.0\n\
         [material.m]\nmodel = \"hencky\"\nyoung = 1e6\npoisson = 0.3\n\
         [[body]]\nmaterial = \"m\"\n\
         shape = {{ box = {{ min = {}, max = {} }}, rotate = {{ {turn} }} }}\n\
         [[boundary]]\nsurface = {{ side = \"bottom\" }}\nslip = true\npenalty = 3.0\n\
         displacement = {{ y = 0.1 }}\n\
         [[boundary]]\nsurface = {{ side = \"left\" }}\npenalty = 2.0\n\
         [[boundary]]\nsurface = {{ side = \"right\" }}\npenalty = 0.1\nslip = true\n\
         method = \"nitsche\"\n\
         [[load]]\npressure = {{ value = \"1e6*(5-y) + 3e5*x*x\", surface = {{ side = \"top\" }} }}\n\
         [[load]]\ntraction = {{ side = \"right\", value = {} }}\n",
        list(-3.0),
        list(8.0),
        list(0.2),
        list(2.4),
        list(1e5),
    );
    let deck = deck::read(Path::new("block.toml"), &text, &[]).expect("a deck");
    let (model, points) = setup::prepare::<D>(world, deck).expect("a model");
    assert!(!model.symmetric());
    let mesh = Discretisation::new(world, &model, &points).expect("a grid side");
    let (count, pattern) = (mesh.numbering.len() * D, &mesh.pattern);
    let step = mesh.step_points(&points, &model.materials);
    let term = SurfaceTerm::new(
        &model,
        step,
        &mesh.carriers,
        deck::When { stage: 0, factor: 1.0, time: 1.0 },
    )
    .expect("a term");
    let field =
        |seed: f64| -> Vec<f64> { (0..count).map(|i| (seed + 1.7 * i as f64).sin()).collect() };
    let (base, v) = (field(0.3), field(1.1));
    let at =
        |size: f64| -> Vec<f64> { base.iter().zip(&v).map(|(u, v)| 0.02 * u + size * v).collect() };
    let mut matrix = BlockMatrix::<D>::zeros(pattern);
    let force = |u: &[f64], mut matrix: Option<&mut BlockMatrix<D>>| {
        let mut force = vec![0.0; count];
        for part in [Part::Reaching, Part::Inner] {
            let at = At { pattern, displacement: u };
            term.add_shares(step, part, at, &mut force, matrix.as_deref_mut());
        }
        force
    };
    force(&at(0.0), Some(&mut matrix));
    let along = product(pattern, &matrix, &v);
    let (more, less) = (force(&at(1e-6), None), force(&at(-1e-6), None));
    let size = along.iter().fold(0.0f64, |m, k| m.max(k.abs()));
    for dof in 0..count {
        let error = ((less[dof] - more[dof]) / 2e-6 - along[dof]).abs() / size;
        assert!(error < 1e-6, "{D}D {basis} {locking}: {error:e}");
    }
}

#[test]
fn the_tangent_on_surfaces_is_that_of_the_force() {
    on_ranks("the_tangent_on_surfaces_is_that_of_the_force", &[1], tangents);
}

/// What cannot be a surface is named before anything runs.
#[test]
fn what_is_no_surface_is_refused() {
    let says = |set: &str, words: &str| {
        let outcome = Run::of("inclined-roller").set(set).attempt();
        assert_eq!(outcome.code, 2, "{set}: {}", outcome.said());
        assert!(outcome.said().contains(words), "{set}: {}", outcome.said());
    };
    says(
        "boundary.0.surface={plane=[[0,0,0],[1,0,0],[0,1,0]]}",
        "the problem is 2D: expected line",
    );
    says("boundary.0.surface={line=[[0,0],[0,0]]}", "has no extent");
    says("boundary.0.surface={line=[[5,5],[6,6]]}", "no material of a body");
    says("boundary.0.surface={side=\"bottom\",where=\"x > 99\"}", "no part of the surface");
    says("boundary.0.surface={body=\"stone\",side=\"bottom\"}", "stone");
    says("boundary.0.fix=[\"y\"]", "slip holds the normal component already");
    says("boundary.0.slip=1", "expected true or false");
    says("boundary.0.rotation={degrees=5}", "not known of a surface");
    says("boundary=[{where={side=\"left\"},fix=[\"x\"],slip=true}]", "only with surface");
    says("boundary.0.displacement={y=\"1/(s-0.5)\"}", "not finite");
    says(
        "body.0.shape={intersection=[{where=\"x < y\"},{box={min=[0,0],max=[1,1]}}]}",
        "of which no surface is known",
    );
    // A roller along the plane alone lets the block slide.
    says("boundary=[{surface={side=\"bottom\"},slip=true}]", "freely");
}

/// STL text of triangles.
fn stl(triangles: &[[[f64; 3]; 3]]) -> String {
    let mut text = String::from("solid a\n");
    for corners in triangles {
        text.push_str("facet normal 0 0 0\nouter loop\n");
        corners.iter().for_each(|[x, y, z]| text.push_str(&format!("vertex {x} {y} {z}\n")));
        text.push_str("endloop\nendfacet\n");
    }
    text + "endsolid a\n"
}

/// The surface of a ball around the origin: an octahedron whose facets are cut into four, `cuts` times,
/// with corners on the ball.
fn ball(radius: f64, cuts: usize) -> Vec<[[f64; 3]; 3]> {
    let mut triangles = Vec::new();
    for k in 0..8usize {
        let sign = |a: usize| if k >> a & 1 == 0 { radius } else { -radius };
        let (x, y, z) = ([sign(0), 0.0, 0.0], [0.0, sign(1), 0.0], [0.0, 0.0, sign(2)]);
        let outward = k.count_ones() % 2 == 0;
        triangles.push(if outward { [x, y, z] } else { [y, x, z] });
    }
    let middle = |a: &[f64; 3], b: &[f64; 3]| -> [f64; 3] {
        let m: [f64; 3] = std::array::from_fn(|i| a[i] + b[i]);
        let size = m.iter().map(|x| x * x).sum::<f64>().sqrt();
        m.map(|x| x * radius / size)
    };
    for _ in 0..cuts {
        let cut = |[a, b, c]: &[[f64; 3]; 3]| {
            let (p, q, r) = (middle(a, b), middle(b, c), middle(c, a));
            [[*a, p, r], [p, *b, q], [r, q, *c], [p, q, r]]
        };
        triangles = triangles.iter().flat_map(cut).collect();
    }
    triangles
}

const SOLID: &str = r#"
[analysis]
type = "quasi-static"
steps = 1
tolerance = 1e-10
[method]
basis = "gimp"
domain_update = "none"
[grid]
type = "lattice"
origin = [-1.5, -1.5, -1.5]
size = [3.0, 3.0, 3.0]
h = 0.25
[material.rubber]
model = "hencky"
young = 1e9
poisson = 0.3
[[body]]
name = "ball"
material = "rubber"
density = 1000.0
shape = { stl = "ball.stl" }
[[boundary]]
name = "pin"
where = { box = { min = [0, 0, 0], max = [0, 0, 0] } }
fix = ["x", "y", "z"]
[[boundary]]
name = "level"
where = { box = { min = [0.25, 0, 0], max = [0.25, 0, 0] } }
fix = ["y", "z"]
[[boundary]]
name = "roll"
where = { box = { min = [0, 0.25, 0], max = [0, 0.25, 0] } }
fix = ["z"]
[[load]]
pressure = { value = 1e5, surface = {} }
[[verify]]
name = "mean"
field = "pressure"
exact = "1e5"
scale = 1e5
[output]
every = 1
fields = ["pressure", "volume"]
"#;

fn with_file(deck: &str, name: &str, content: &str) -> common::run::Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join(name), content).expect("a file");
    Run::text(deck).ranks(2).attempt_in(folder)
}

/// A ball of an STL file under pressure all round: its points fill the volume of the triangles, and its
/// stress is that pressure.
#[test]
fn a_solid_of_triangles_has_their_volume_and_surface() {
    let triangles = ball(1.07, 3);
    let outcome = with_file(SOLID, "ball.stl", &stl(&triangles));
    assert_eq!(outcome.code, 0, "{}", outcome.said());
    let results = outcome.results();
    let volume: f64 = triangles
        .iter()
        .map(|[a, b, c]| {
            (a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0]))
                / 6.0
        })
        .sum();
    let filled: f64 = results.points(1).field("volume").iter().sum();
    assert!((filled / volume - 1.0).abs() < 2e-3, "{filled} for {volume}");
    let mean = results.verify("mean");
    assert!(mean < 0.02, "{mean}");
    // Nothing is carried by what holds the rigid motions.
    for name in ["pin", "level", "roll"] {
        let force = last(&results, &format!("reaction.{name}.sum_abs"));
        assert!(force < 1e-4 * 1e5, "{name}: {force}");
    }
}

/// The ground below a terrain weighs what is between its heights and the bottom.
#[test]
fn ground_below_a_terrain_weighs_its_volume() {
    let deck = SOLID
        .replace("stl = \"ball.stl\"", "terrain = { file = \"a.asc\", bottom = -1.0 }")
        .replace("pressure = { value = 1e5, surface = {} }", "gravity = [0, 0, -10]");
    let base = "where = { box = { min = [-2, -2, -1], max = [2, 2, -1] } }";
    let deck = deck.replace("where = { box = { min = [0, 0, 0], max = [0, 0, 0] } }", base);
    let heights =
        "ncols 3\nnrows 2\nxllcenter -1\nyllcenter -0.5\ncellsize 1\n0.2 0.6 0.1\n0 0.4 0.3\n";
    let outcome = with_file(&deck, "a.asc", heights);
    assert_eq!(outcome.code, 0, "{}", outcome.said());
    let results = outcome.results();
    // Two triangles a square, from south-west to north-east.
    let square = |sw: f64, se: f64, ne: f64, nw: f64| (sw + se + ne) / 6.0 + (sw + ne + nw) / 6.0;
    let volume = 2.0 + square(0.0, 0.4, 0.6, 0.2) + square(0.4, 0.3, 0.1, 0.6);
    let held = ["pin", "level", "roll"];
    let weight: f64 = held.iter().map(|name| last(&results, &format!("reaction.{name}.z"))).sum();
    assert!((weight / (1e4 * volume) - 1.0).abs() < 2e-3, "{weight} for {}", 1e4 * volume);
}

#[test]
fn files_that_bound_no_body_are_refused() {
    let says = |triangles: &[[[f64; 3]; 3]], words: &str| {
        let outcome = with_file(SOLID, "ball.stl", &stl(triangles));
        assert_eq!(outcome.code, 2, "{}", outcome.said());
        assert!(outcome.said().contains(words), "{}", outcome.said());
    };
    let good = ball(1.0, 1);
    says(&good[1..], "is open: 3 edges");
    let mut turned = good.clone();
    turned[4].swap(0, 1);
    says(&turned, "face to different sides");
    let mut twice = good.clone();
    twice.extend(ball(1.0, 1).iter().map(|t| t.map(|x| [x[0] + 0.3, x[1] + 0.11, x[2] + 0.05])));
    says(&twice, "cut each other");
    let outcome = with_file(&SOLID.replace("ball.stl", "none.stl"), "ball.stl", "");
    assert!(outcome.code == 2 && outcome.said().contains("cannot be read"), "{}", outcome.said());
    // So small that the volume vanishes: the file is good, its scale is not.
    let tiny = SOLID.replace("stl = \"ball.stl\"", "stl = \"ball.stl\", scale = 1e-300");
    let said = with_file(&tiny, "ball.stl", &stl(&good)).said();
    assert!(said.contains("shape.scale: 1e-300 makes the surface"), "{said}");
    assert!(!said.contains("face inward"), "{said}");
}

/// A rigid body takes no file that bounds none, and no load acts on a body that has gone.
#[test]
fn what_contacts_and_loads_cannot_act_on_is_refused() {
    let rigid = SOLID
        .replace("shape = { stl = \"ball.stl\" }", "shape = { box = { min = [0, 0, 0], max = [1, 1, 1] } }")
        .replace("[[load]]\npressure = { value = 1e5, surface = {} }", "[[rigid]]\nname = \"tool\"\nshape = { stl = \"tool.stl\" }\n[[contact]]\nbetween = [\"tool\", \"ball\"]");
    let good: Vec<[[f64; 3]; 3]> =
        ball(0.3, 1).iter().map(|t| t.map(|[x, y, z]| [x + 0.5, y + 0.5, z + 1.31])).collect();
    let mut turned = good.clone();
    turned[4].swap(0, 1);
    let inward: Vec<_> = good.iter().map(|[a, b, c]| [*b, *a, *c]).collect();
    let mut twice = good.clone();
    twice.extend(good.iter().map(|t| t.map(|x| [x[0] + 0.1, x[1] + 0.02, x[2] + 0.03])));
    let deeper: Vec<_> = good.iter().map(|t| t.map(|[x, y, z]| [x, y, z - 0.11])).collect();
    for (triangles, words) in [
        (&good[1..], &["is open: 3 edges", "tool.stl"][..]),
        (&turned, &["face to different sides", "tool.stl"]),
        (&inward, &["face inward", "tool.stl"]),
        (&twice, &["cut each other", "tool.stl"]),
        (&deeper, &["body \"ball\" overlaps the rigid body \"tool\" by", "move one of them"]),
    ] {
        let outcome = with_file(&rigid, "tool.stl", &stl(triangles));
        let said = outcome.said();
        assert_eq!(outcome.code, 2, "{said}");
        assert!(words.iter().all(|word| said.contains(word)), "{words:?}: {said}");
        assert!(!outcome.folder.path().join("out").exists(), "{said}");
    }
    let staged = rigid
        .replace("steps = 1\n", "")
        .replace(
            "[method]",
            "[[stage]]\nname = \"one\"\nsteps = 1\n[[stage]]\nname = \"two\"\nsteps = 1\n[method]",
        )
        .replace("density = 1000.0", "density = 1000.0\nuntil = \"one\"");
    let from = staged.find("[[rigid]]").expect("a rigid body");
    let to = staged.find("[[verify]]").expect("a verification");
    let load = "[[load]]\ntraction = { value = [0, 0, -1e3], side = \"back\" }\n";
    let outcome = Run::text(&format!("{}{load}{}", &staged[..from], &staged[to..])).attempt();
    let said = outcome.said();
    assert_eq!(outcome.code, 2, "{said}");
    assert!(
        said.contains("after that has gone with stage") && said.contains("until = \"one\""),
        "{said}"
    );
}

/// [`PROPPED`] with a third stage, in which the prop has gone, and a displacement of the prop.
fn propped_until_free(displacement: &str) -> String {
    let stage = "[[stage]]\nname = \"free\"\nsteps = 1\n[method]";
    let moved = format!(
        "displacement = {{ y = \"{displacement}\" }}\nfrom = \"propped\"\nuntil = \"free\""
    );
    PROPPED.replace("[method]", stage).replace("from = \"propped\"", &moved)
}

/// The deck with all defaults says from when and until when a surface is held, and reads back to the deck.
#[test]
fn the_resolved_deck_tells_when_a_surface_is_held() {
    let read = |text: &str| {
        let sets: Vec<String> = Vec::new();
        mpm_par::deck::read(std::path::Path::new("deck.toml"), text, &sets)
            .unwrap_or_else(|error| panic!("{error}\n{text}"))
    };
    let deck = read(&propped_until_free("-1e-4*s"));
    assert_eq!(read(&mpm_par::deck::resolved(&deck)), deck);
}

/// A support of a later stage whose displacement has no value there is named before the first step.
#[test]
fn a_later_support_without_a_value_is_named_at_the_start() {
    let refused = |formula: &str, words: &[&str]| {
        let outcome = Run::text(&propped_until_free(formula)).word("--check").attempt();
        let said = outcome.said();
        assert_eq!(outcome.code, 2, "{formula}: {said}");
        assert!(words.iter().all(|word| said.contains(word)), "{formula}: {said}");
    };
    let key = "boundary.1.displacement.y: is NaN m at [";
    refused("-1e-4*log(s-2)", &[key, "s = 0 of stage \"propped\"", "not finite"]);
    // At the end of its first step: s = 1/4, t = 1.25.
    refused("if(s > 0.2, sqrt(-s), s)", &[key, "s = 0.25 of stage \"propped\""]);
    refused("1e-4*s*sqrt(1.1-t)", &[key, "s = 0.25 of stage \"propped\""]);
    // What has no value before its stage has one in it.
    let outcome = Run::text(&propped_until_free("-1e-4*s*sqrt(t-0.5)")).word("--check").attempt();
    assert_eq!(outcome.code, 0, "{}", outcome.said());
}

/// A run does not go on with another file of triangles under the name of the first one.
#[test]
fn a_restart_knows_its_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let (deck, out) = (folder.path().join("deck.toml"), folder.path().join("out"));
    let file = folder.path().join("ball.stl");
    let text = SOLID
        .replace("steps = 1", "steps = 2")
        .replace("every = 1\n", "every = 1\ncheckpoint = { every = 1 }\n");
    std::fs::write(&deck, text).expect("a deck");
    std::fs::write(&file, stl(&ball(1.07, 1))).expect("a file");
    program::run_well(1, &deck, &out, &[]);
    let first = out.join("checkpoint-000001.h5").display().to_string();
    let other = folder.path().join("other");
    program::run_well(1, &deck, &other, &["--restart", &first]);
    std::fs::write(&file, stl(&ball(1.0701, 1))).expect("a file");
    let refused = program::run(2, &deck, &folder.path().join("third"), &["--restart", &first]);
    let said = program::text(&refused);
    assert_eq!(refused.status.code(), Some(3), "{said}");
    assert!(said.contains("belongs to another problem"), "{said}");
    assert!(said.contains("checksum of ball.stl"), "{said}");
}

/// A rigid box of twelve facets presses a block as the box does.
#[test]
fn a_rigid_body_of_triangles_presses_as_its_form_does() {
    let deck = |shape: &str| {
        format!(
            r#"
[analysis]
type = "quasi-static"
steps = 2
tolerance = 1e-10
[method]
basis = "gimp"
[grid]
type = "lattice"
size = [3.0, 3.0, 2.0]
h = 0.5
[material.soil]
model = "hencky"
young = 1e6
poisson = 0.3
[[body]]
name = "block"
material = "soil"
density = 1000.0
shape = {{ box = {{ min = [0.5, 0.5, 0.0], max = [2.5, 2.5, 1.5] }} }}
[[boundary]]
name = "ground"
where = {{ side = "back" }}
fix = ["x", "y", "z"]
[[rigid]]
name = "plate"
shape = {shape}
motion = {{ displacement = [0, 0, "-0.1*s"] }}
[[contact]]
between = ["plate", "block"]
friction = 0
[output]
fields = ["displacement"]
"#
        )
    };
    let (min, max) = ([0.9, 0.8, 1.5], [2.2, 2.3, 1.9]);
    let at = |k: usize| -> [f64; 3] {
        std::array::from_fn(|a| if k >> a & 1 == 0 { min[a] } else { max[a] })
    };
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[[f64; 3]; 3]> = faces
        .iter()
        .flat_map(|[a, b, c, d]| [[at(*a), at(*b), at(*c)], [at(*a), at(*c), at(*d)]])
        .collect();
    let form =
        Run::text(&deck(&format!("{{ box = {{ min = {min:?}, max = {max:?} }} }}"))).results();
    let outcome = with_file(&deck("{ stl = \"plate.stl\" }"), "plate.stl", &stl(&triangles));
    assert_eq!(outcome.code, 0, "{}", outcome.said());
    let solid = outcome.results();
    let (a, b) = (last(&solid, "reaction.ground.z"), last(&form, "reaction.ground.z"));
    assert!(a > 1e4 && (a / b - 1.0).abs() < 1e-7, "{a} {b}");
    let apart = relative_difference(
        solid.points(2).field("displacement"),
        form.points(2).field("displacement"),
    );
    assert!(apart < 1e-6, "{apart}");
}
