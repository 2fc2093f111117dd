//! The same answer from every frame, on any number of ranks, again, and from any side.

use crate::common::at_once::at_once;
use crate::common::run::{Results, Run, relative_difference};

/// Stabilised beam, far into the large rotation; elasto-plastic collapse, where points cross
/// cells and ranks. Tight, so that only round-off is left.
fn beam() -> Run {
    Run::of("beam").set("grid.h=0.5").set("analysis.steps=25").set("analysis.tolerance=1e-11")
}

fn collapse() -> Run {
    Run::of("collapse-gimp")
        .set("body.0.points_per_cell=[3,3]")
        .set("ghost={stiffness_factor=0.1}")
        .set("analysis.tolerance=1e-11")
}

#[track_caller]
fn assert_alike(a: &Results, b: &Results, step: usize, tolerance: f64, what: &str) {
    let (a, b) = (a.points(step), b.points(step));
    assert_eq!(a.id, b.id, "{what}: other points");
    for field in ["position", "stress"] {
        let off = relative_difference(a.field(field), b.field(field));
        assert!(off < tolerance, "{what}: {field} differ by {off:e}");
    }
}

#[test]
fn frames_agree() {
    for (run, step) in [(beam(), 25), (collapse(), 40)] {
        let of = |frame: &str| run.clone().set(format!("method.frame=\"{frame}\"")).results();
        let previous = of("previous");
        for frame in ["updated", "total"] {
            assert_alike(&of(frame), &previous, step, 1e-9, frame);
        }
    }
}

#[test]
fn ranks_agree() {
    at_once([(beam(), 25), (collapse(), 40)], |(run, step)| {
        // Small bricks: every rank gets some, and Ghost faces lie between ranks.
        let run = run.set("parallel.brick=1");
        let alone = run.clone().results();
        at_once([2, 3, 4, 7], |ranks| {
            let many = run.clone().ranks(ranks).results();
            assert_alike(&many, &alone, step, 1e-8, &format!("{ranks} ranks"));
            assert_eq!(many.count("ranks"), ranks);
            let mut owners: Vec<i64> =
                many.points(step).field("rank").iter().map(|r| *r as i64).collect();
            owners.sort_unstable();
            owners.dedup();
            assert_eq!(owners.len(), ranks, "every rank has points");
            for column in ["ghost_faces", "populated_cells", "newton_iterations"] {
                assert_eq!(many.history(column), alone.history(column), "{column}, {ranks} ranks");
            }
            for column in ["energy_strain", "energy_ghost", "work_external"] {
                let off = relative_difference(&many.history(column), &alone.history(column));
                assert!(off < 1e-8, "{column}, {ranks} ranks: {off:e}");
            }
        });
    });
}

#[test]
fn ranks_agree_in_space_and_without_points_of_their_own() {
    let run = Run::of("cube-collapse").set("analysis.steps=12").set("analysis.tolerance=1e-11");
    let alone = run.clone().set("parallel.brick=1").results();
    // Two bricks only: the other ranks stay empty.
    for (ranks, brick) in [(3, 1), (4, 4)] {
        let many = run.clone().set(format!("parallel.brick={brick}")).ranks(ranks).results();
        assert_alike(&many, &alone, 12, 1e-8, &format!("{ranks} ranks"));
    }
}

#[test]
fn more_ranks_than_bricks() {
    let run = Run::of("column").set("grid.h=12.5").set("grid.size=[12.5,50.0]");
    let alone = run.clone().results();
    let many = run.set("parallel.brick=4").ranks(5).results();
    assert_alike(&many, &alone, 20, 1e-8, "5 ranks, one brick");
    let owners = many.points(20).field("rank").to_vec();
    assert!(owners.iter().all(|rank| *rank == owners[0]), "one rank has all");
}

/// A repeat gives the same bits, whatever the timing of messages.
#[test]
fn repeats_are_bitwise_equal() {
    for ranks in [1, 3] {
        for (run, step) in [(beam(), 25), (collapse(), 40)] {
            let once = || run.clone().set("parallel.brick=1").ranks(ranks).results();
            let (first, second) = (once(), once());
            assert_eq!(first.text("residuals.csv"), second.text("residuals.csv"), "{ranks} ranks");
            let (a, b) = (first.points(step), second.points(step));
            for field in ["position", "displacement", "stress", "rank"] {
                let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                assert!(bits(a.field(field)) == bits(b.field(field)), "{field} on {ranks} ranks");
            }
        }
    }
}

/// A symmetry of the square lattice: x' = a x + b y, y' = c x + d y with entries 0 and +-1.
#[derive(Clone, Copy)]
struct Turn {
    name: &'static str,
    matrix: [[f64; 2]; 2],
    /// Sides that left becomes.
    root: &'static str,
}

const TURNS: [Turn; 4] = [
    Turn { name: "as printed", matrix: [[1.0, 0.0], [0.0, 1.0]], root: "left" },
    Turn { name: "mirrored", matrix: [[-1.0, 0.0], [0.0, 1.0]], root: "right" },
    Turn { name: "turned by 90 degrees", matrix: [[0.0, -1.0], [1.0, 0.0]], root: "bottom" },
    Turn { name: "turned by 180 degrees", matrix: [[-1.0, 0.0], [0.0, -1.0]], root: "right" },
];

impl Turn {
    fn vector(&self, v: [f64; 2]) -> [f64; 2] {
        self.matrix.map(|row| row[0] * v[0] + row[1] * v[1])
    }

    /// `min = [..], max = [..]` of the turned box.
    fn corners(&self, a: [f64; 2], b: [f64; 2]) -> ([f64; 2], [f64; 2]) {
        let (a, b) = (self.vector(a), self.vector(b));
        let pick = |f: fn(f64, f64) -> f64| [f(a[0], b[0]), f(a[1], b[1])];
        (pick(f64::min), pick(f64::max))
    }

    /// The axis that x (0) or y (1) becomes.
    fn axis(&self, axis: usize) -> &'static str {
        let mut unit = [0.0; 2];
        unit[axis] = 1.0;
        if self.vector(unit)[0] != 0.0 { "x" } else { "y" }
    }

    /// The stabilised beam on a padded grid: nothing but the deck tells where up is.
    fn deck(&self) -> String {
        let (origin, end) = self.corners([0.0, 0.0], [11.0, 11.0]);
        let size = [end[0] - origin[0], end[1] - origin[1]];
        let (low, high) = self.corners([0.0, 9.0], [10.0, 10.0]);
        let (pin, _) = self.corners([0.0, 9.5], [0.0, 9.5]);
        let ends = [[10.0, 9.499], [10.0, 9.501]].map(|place| self.vector(place));
        let force = self.vector([0.0, -60e3]);
        format!(
            r#"
title = "beam, {name}"
[analysis]
type = "quasi-static"
steps = 15
tolerance = 1e-11
inverted_iterates = "allow"
[method]
basis = "gimp"
domain_update = "corners"
[ghost]
stiffness_factor = 1.0
[grid]
type = "lattice"
origin = {origin:?}
size = {size:?}
h = 0.5
[material.rubber]
model = "von-mises"
young = 12e6
poisson = 0.2
yield = 2e6
[[body]]
name = "beam"
material = "rubber"
density = 0.0
shape = {{ box = {{ min = {low:?}, max = {high:?} }} }}
points_per_cell = [3, 3]
[[boundary]]
name = "root"
where = {{ side = "{root}" }}
fix = ["{along}"]
[[boundary]]
name = "pin"
where = {{ box = {{ min = {pin:?}, max = {pin:?} }} }}
fix = ["{across}"]
[[load]]
point = {{ body = "beam", nearest = {ends:?}, force = {force:?} }}
[output]
every = 15
fields = ["displacement", "stress", "plastic_strain"]
"#,
            name = self.name,
            root = self.root,
            along = self.axis(0),
            across = self.axis(1),
        )
    }

    /// (start, end, stress in the plane) of every point, turned back and ordered by its start.
    fn points_turned_back(&self) -> Vec<[f64; 7]> {
        let points = Run::text(&self.deck()).results().points(15);
        let (x, u, s) =
            (points.field("position"), points.field("displacement"), points.field("stress"));
        let m = self.matrix;
        // The inverse of a symmetry is its transpose.
        let back = |v: [f64; 2]| [0, 1].map(|i| m[0][i] * v[0] + m[1][i] * v[1]);
        let mut rows: Vec<[f64; 7]> = (0..points.id.len())
            .map(|p| {
                let end = back([x[3 * p], x[3 * p + 1]]);
                let start = back([x[3 * p] - u[3 * p], x[3 * p + 1] - u[3 * p + 1]]);
                let tau = [[s[6 * p], s[6 * p + 1]], [s[6 * p + 1], s[6 * p + 3]]];
                let turned = |i: usize, j: usize| -> f64 {
                    (0..2).flat_map(|k| (0..2).map(move |l| m[k][i] * tau[k][l] * m[l][j])).sum()
                };
                [start[0], start[1], end[0], end[1], turned(0, 0), turned(0, 1), turned(1, 1)]
            })
            .collect();
        let key = |row: &[f64; 7]| [row[0], row[1]].map(|v| (v * 1e4).round() as i64);
        rows.sort_by_key(key);
        rows
    }
}

#[test]
fn a_turned_or_mirrored_deck_gives_the_turned_or_mirrored_answer() {
    let reference = TURNS[0].points_turned_back();
    let column = |rows: &[[f64; 7]], c: std::ops::Range<usize>| -> Vec<f64> {
        rows.iter().flat_map(|row| row[c.clone()].to_vec()).collect()
    };
    // It is bent well and yields.
    assert!(reference.iter().any(|row| row[3] < 6.0));
    for turn in &TURNS[1..] {
        let rows = turn.points_turned_back();
        for (what, range) in [("start", 0..2), ("end", 2..4), ("stress", 4..7)] {
            let off =
                relative_difference(&column(&rows, range.clone()), &column(&reference, range));
            assert!(off < 1e-8, "{}: {what} differ by {off:e}", turn.name);
        }
    }
}
