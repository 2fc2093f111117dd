//! What every basis owes: partition of unity, linear fields, gradients, rows = populated cells.

#![allow(clippy::needless_range_loop, reason = "one index runs over several arrays")]

use proptest::prelude::*;

use super::{Groups, Influences, map_points, map_points_with, of_deck, populated_cells};
use crate::deck::model::{Basis, GimpEdge};
use crate::error::Error;
use crate::grid::{Grid, Lattice};
use crate::points::Points;

pub(crate) fn lattice<const D: usize>() -> Lattice<D> {
    Lattice {
        origin: std::array::from_fn(|a| [-0.3, 0.7, 0.1][a]),
        spacing: std::array::from_fn(|a| [0.1, 0.3, 0.7][a]),
        cells: std::array::from_fn(|a| [7, 5, 4][a]),
    }
}

/// Points at grid coordinates `t` (in cells) with half lengths `reach` (in cells).
pub(crate) fn points_at<const D: usize>(places: &[([f64; D], [f64; D])]) -> Points<D> {
    let grid = lattice::<D>();
    let mut points = Points::default();
    for (id, (t, reach)) in places.iter().enumerate() {
        let x = std::array::from_fn(|a| grid.origin[a] + t[a] * grid.spacing[a]);
        let half = std::array::from_fn(|a| reach[a] * grid.spacing[a]);
        let volume = half.iter().map(|l| 2.0 * l).product();
        points.push_unstrained(100 + id as u64, 0, x, volume, 1.0, half);
    }
    points
}

fn map<const D: usize>(basis: Basis, points: &Points<D>) -> Influences<D> {
    map_points(&Grid::Lattice(lattice()), basis, points).expect("all points are inside")
}

fn cells_of<const D: usize>(basis: Basis, points: &Points<D>, p: usize) -> Vec<usize> {
    let mut cells = Vec::new();
    populated_cells(&Grid::Lattice(lattice()), basis, points, p, None, &mut cells).expect("inside");
    cells
}

/// Sum of S, S x_v and grad S over the row of point `p`.
fn check_linear_fields<const D: usize>(points: &Points<D>, influences: &Influences<D>, p: usize) {
    let grid = lattice::<D>();
    let mut sum = 0.0;
    let (mut place, mut slope) = ([0.0; D], [[0.0; D]; D]);
    let mut constant = [0.0; D];
    for e in influences.row(p) {
        let x = grid.node_position(influences.nodes[e]);
        sum += influences.weights[e];
        for a in 0..D {
            place[a] += influences.weights[e] * x[a];
            constant[a] += influences.gradients[e][a];
            for b in 0..D {
                slope[a][b] += x[a] * influences.gradients[e][b];
            }
        }
    }
    assert!((sum - 1.0).abs() < 1e-14);
    for a in 0..D {
        assert!((place[a] - points.position[p][a]).abs() < 1e-14);
        assert!((constant[a] * grid.spacing[a]).abs() < 1e-12);
        for b in 0..D {
            let exact = if a == b { 1.0 } else { 0.0 };
            assert!((slope[a][b] - exact).abs() < 1e-12);
        }
    }
}

/// The row holds the nodes of the populated cells, ascending, each once.
fn check_row_is_cells<const D: usize>(basis: Basis, points: &Points<D>, p: usize) {
    let influences = map(basis, points);
    let mut nodes = Vec::new();
    for cell in cells_of(basis, points, p) {
        lattice::<D>().cell_nodes(cell, &mut nodes);
    }
    nodes.sort_unstable();
    nodes.dedup();
    assert_eq!(&influences.nodes[influences.row(p)], &nodes[..]);
}

/// Largest error of the gradients against central differences of the weights, in 1/cell.
fn gradient_error<const D: usize>(basis: Basis, points: &Points<D>) -> Option<f64> {
    let grid = lattice::<D>();
    let exact = map(basis, points);
    let mut largest: f64 = 0.0;
    for axis in 0..D {
        let step = 1e-6 * grid.spacing[axis];
        let shifted = |by: f64| {
            let mut other = points.clone();
            other.position[0][axis] += by;
            map(basis, &other)
        };
        let (up, down) = (shifted(step), shifted(-step));
        if up.nodes != exact.nodes || down.nodes != exact.nodes {
            return None;
        }
        for e in exact.row(0) {
            let difference = (up.weights[e] - down.weights[e]) / (2.0 * step);
            let error = (difference - exact.gradients[e][axis]) * grid.spacing[axis];
            largest = largest.max(error.abs());
        }
    }
    Some(largest)
}

proptest! {
    #[test]
    fn both_bases_reproduce_linear_fields_2d(t in prop::array::uniform2(2.0..3.0f64),
                                             reach in prop::array::uniform2(1e-3..1.9f64)) {
        let points = points_at::<2>(&[(t, reach)]);
        for basis in [Basis::Mpm, Basis::Gimp] {
            check_linear_fields(&points, &map(basis, &points), 0);
            check_row_is_cells(basis, &points, 0);
        }
        if let Some(error) = gradient_error(Basis::Mpm, &points) {
            prop_assert!(error < 1e-8);
        }
        if reach.iter().all(|r| *r > 0.1)
            && let Some(error) = gradient_error(Basis::Gimp, &points)
        {
            prop_assert!(error < 1e-7);
        }
    }

    #[test]
    fn both_bases_reproduce_linear_fields_3d(t in prop::array::uniform3(1.5..2.5f64),
                                             reach in prop::array::uniform3(1e-3..1.4f64)) {
        let points = points_at::<3>(&[(t, reach)]);
        for basis in [Basis::Mpm, Basis::Gimp] {
            check_linear_fields(&points, &map(basis, &points), 0);
            check_row_is_cells(basis, &points, 0);
        }
    }

    #[test]
    fn rows_are_populated_cells_anywhere(t in prop::array::uniform3(0.0..4.0f64),
                                         reach in prop::array::uniform3(1e-12..3.0f64)) {
        let points = points_at::<3>(&[(t, reach)]);
        check_row_is_cells(Basis::Gimp, &points, 0);
        check_row_is_cells(Basis::Mpm, &points, 0);
    }
}

/// Mean of the hat at `node` over [t - r, t + r] by its antiderivative, and its slope.
fn mean_of_hat(node: f64, t: f64, r: f64) -> (f64, f64) {
    let hat = |s: f64| (1.0 - s.abs()).max(0.0);
    let antiderivative = |s: f64| {
        let s = s.clamp(-1.0, 1.0);
        0.5 + s - 0.5 * s * s.abs()
    };
    let (low, high) = (t - r - node, t + r - node);
    let weight = (antiderivative(high) - antiderivative(low)) / (2.0 * r);
    (weight, (hat(high) - hat(low)) / (2.0 * r))
}

#[test]
fn gimp_is_the_mean_of_the_hats() {
    let grid = lattice::<2>();
    for i in 0..40 {
        for r in [0.05, 0.25, 0.4, 0.5, 0.6, 1.0, 1.37] {
            let t = [0.171 * i as f64, 0.117 * i as f64];
            let points = points_at::<2>(&[(t, [r, 0.8 * r])]);
            // Over the edge too, where the hats of the grid's own nodes are all there is.
            let influences = map_points_with(
                &Grid::Lattice(lattice()),
                Basis::Gimp,
                GimpEdge::Published,
                &points,
            )
            .expect("all points are inside");
            for e in influences.row(0) {
                let node = grid.node_index(influences.nodes[e]);
                let (sx, gx) = mean_of_hat(node[0] as f64, t[0], r);
                let (sy, gy) = mean_of_hat(node[1] as f64, t[1], 0.8 * r);
                assert!((influences.weights[e] - sx * sy).abs() < 1e-14);
                let gradient = influences.gradients[e];
                assert!((gradient[0] - gx * sy / grid.spacing[0]).abs() < 1e-12);
                assert!((gradient[1] - sx * gy / grid.spacing[1]).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn gimp_closed_form_of_bardenhagen_and_kober() {
    // l = h/4 around the middle node: 1 - (x^2 + l^2) / (2 h l), 1 - |x| / h, (h + l - |x|)^2 / 4hl.
    let l = 0.25;
    for (x, exact) in [
        (0.0, 1.0 - l / 2.0),
        (0.1, 1.0 - (0.01 + l * l) / (2.0 * l)),
        (0.5, 0.5),
        (0.9, (1.0f64 + l - 0.9).powi(2) / (4.0 * l)),
    ] {
        let points = points_at::<2>(&[([3.0 + x, 2.5], [l, l])]);
        let influences = map(Basis::Gimp, &points);
        let grid = lattice::<2>();
        let column: f64 = influences
            .row(0)
            .filter(|&e| grid.node_index(influences.nodes[e])[0] == 3)
            .map(|e| influences.weights[e])
            .sum();
        assert!((column - exact).abs() < 1e-14, "{x}");
    }
}

#[test]
fn a_domain_that_fills_its_cell_touches_no_other() {
    let grid = lattice::<3>();
    for cell in 0..grid.cell_count() {
        let index = grid.cell_index(cell);
        for noise in [0.0, 3e-16, -3e-16] {
            let t = std::array::from_fn(|a| index[a] as f64 + 0.5);
            let points = points_at::<3>(&[(t, [0.5 + noise; 3])]);
            assert_eq!(cells_of(Basis::Gimp, &points, 0), [cell]);
            let influences = map(Basis::Gimp, &points);
            assert_eq!(influences.len(), 1);
            assert_eq!(influences.row(0).len(), 8);
            for e in influences.row(0) {
                assert!((influences.weights[e] - 0.125).abs() < 1e-12);
            }
            check_linear_fields(&points, &influences, 0);
        }
    }
}

#[test]
fn an_overlap_that_is_no_round_off_counts() {
    let points = points_at::<2>(&[([2.5, 2.5], [0.5 + 1e-8, 0.5])]);
    assert_eq!(cells_of(Basis::Gimp, &points, 0).len(), 3);
    check_row_is_cells(Basis::Gimp, &points, 0);
}

/// Domains that stick out of the lattice, the sum of their weights where hats of the grid's own
/// nodes are all there is, and their cells.
fn sticking_out() -> Vec<([[f64; 2]; 2], f64, usize)> {
    let grid = lattice::<2>();
    // One minus, per axis, the share beyond the edge times its mean distance in cells.
    vec![
        ([[0.0, 2.5], [0.4, 0.3]], 1.0 - 0.5 * 0.2, grid.cell_at([0, 2])),
        ([[0.1, 2.5], [0.4, 0.3]], 1.0 - 0.375 * 0.15, grid.cell_at([0, 2])),
        ([[7.0, 5.0], [0.25, 0.25]], 0.9375 * 0.9375, grid.cell_at([6, 4])),
        ([[6.9, 2.5], [0.2, 0.5]], 1.0 - 0.25 * 0.05, grid.cell_at([6, 2])),
    ]
}

/// Partition of unity, and linear fields with their gradient, for domains over the edge.
#[test]
fn no_weight_is_lost_beyond_the_edge() {
    let grid = lattice::<2>();
    for ([t, reach], _, cell) in sticking_out() {
        let points = points_at::<2>(&[(t, reach)]);
        let influences = map(Basis::Gimp, &points);
        let mut sum = [0.0; 3];
        let mut slope = [[0.0; 2]; 3];
        for entry in influences.row(0) {
            let x = grid.node_position(influences.nodes[entry]);
            for (k, field) in [1.0, x[0], x[1]].into_iter().enumerate() {
                sum[k] += influences.weights[entry] * field;
                for a in 0..2 {
                    slope[k][a] += influences.gradients[entry][a] * field;
                }
            }
        }
        let at = points.position[0];
        for (k, exact) in [1.0, at[0], at[1]].into_iter().enumerate() {
            assert!((sum[k] - exact).abs() < 1e-13, "{t:?}: {sum:?}");
            for a in 0..2 {
                let exact = if k == a + 1 { 1.0 } else { 0.0 };
                assert!((slope[k][a] - exact).abs() < 1e-12, "{t:?}: {slope:?}");
            }
        }
        assert_eq!(cells_of(Basis::Gimp, &points, 0), [cell]);
        check_row_is_cells(Basis::Gimp, &points, 0);
    }
}

#[test]
fn published_hats_of_the_edge_go_on_for_a_cell_beyond_it() {
    for ([t, reach], exact, _) in sticking_out() {
        let points = points_at::<2>(&[(t, reach)]);
        let grid = Grid::Lattice(lattice());
        let influences = map_points_with(&grid, Basis::Gimp, GimpEdge::Published, &points)
            .expect("the centre is inside");
        let sum: f64 = influences.weights.iter().sum();
        assert!((sum - exact).abs() < 1e-12, "{t:?}: {sum}");
    }
}

#[test]
fn standard_points_on_grid_lines_belong_to_the_upper_cell() {
    let grid = lattice::<2>();
    let origin = Points { position: vec![grid.origin], ..points_at::<2>(&[([0.0; 2], [0.5; 2])]) };
    assert_eq!(cells_of(Basis::Mpm, &origin, 0), [0]);
    let mut points = points_at::<2>(&[([0.0; 2], [0.5; 2])]);
    points.position[0] = grid.node_position(grid.node_at([3, 2]));
    let cell = cells_of(Basis::Mpm, &points, 0)[0];
    let influences = map(Basis::Mpm, &points);
    assert_eq!(influences.row(0).len(), 4);
    assert_eq!(Some(cell), grid.locate(&points.position[0]));
    check_row_is_cells(Basis::Mpm, &points, 0);
    // The grid's upper edge is closed.
    points.position[0] = [0.4, 2.2];
    assert_eq!(cells_of(Basis::Mpm, &points, 0), [grid.cell_count() - 1]);
}

#[test]
fn a_point_outside_is_named() {
    for basis in [Basis::Mpm, Basis::Gimp] {
        for t in [[-0.01, 2.0], [3.0, 5.001], [f64::NAN, 1.0]] {
            let points = points_at::<2>(&[([1.0; 2], [0.25; 2]), (t, [0.25; 2])]);
            let error = map_points(&Grid::Lattice(lattice()), basis, &points).expect_err("outside");
            assert!(matches!(&error, Error::Run(text) if text.contains("point 101")), "{error}");
            let mut cells = Vec::new();
            let grid = Grid::Lattice(lattice());
            assert!(populated_cells(&grid, basis, &points, 1, None, &mut cells).is_err());
        }
    }
}

#[test]
fn a_domain_without_size_is_named() {
    for reach in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        let points = points_at::<2>(&[([1.0; 2], [0.25, reach])]);
        let error = map_points(&Grid::Lattice(lattice()), Basis::Gimp, &points);
        assert!(error.is_err_and(|e| e.to_string().contains("point 100")));
    }
}

#[test]
fn groups_collect_equal_rows() {
    let mut places = Vec::new();
    for i in 0..60 {
        for j in 0..37 {
            places.push(([0.05 + 0.11 * i as f64, 0.07 + 0.13 * j as f64], [0.25, 0.2]));
        }
    }
    let points = points_at::<2>(&places);
    let influences = map(Basis::Gimp, &points);
    let groups = Groups::new(&influences);
    let mut rows: Vec<&[usize]> =
        (0..points.len()).map(|p| &influences.nodes[influences.row(p)]).collect();
    for p in 0..points.len() {
        assert_eq!(groups.nodes(groups.group_of_point[p]), rows[p]);
    }
    rows.sort();
    rows.dedup();
    assert_eq!(groups.len(), rows.len());
    let mut seen = 0;
    for g in 0..groups.len() {
        assert!(groups.points(g).is_sorted() && !groups.points(g).is_empty());
        assert!(groups.points(g).iter().all(|&p| groups.group_of_point[p] == g));
        seen += groups.points(g).len();
    }
    assert_eq!(seen, points.len());
    assert!(Groups::new(&Influences::<2>::default()).is_empty());
}

#[test]
fn groups_tell_rows_with_equal_ends_apart() {
    let influences = Influences::<2> {
        offsets: vec![0, 3, 6, 9, 9, 12],
        nodes: vec![1, 4, 9, 1, 5, 9, 1, 4, 9, 1, 6, 9],
        weights: vec![0.0; 12],
        gradients: vec![[0.0; 2]; 12],
        ..Influences::default()
    };
    let groups = Groups::new(&influences);
    assert_eq!(groups.group_of_point, [0, 1, 0, 2, 3]);
    assert_eq!(groups.points(0), [0, 2]);
    assert_eq!(groups.nodes(1), [1, 5, 9]);
    assert!(groups.nodes(2).is_empty());
}

const SPLINE: &str = r#"
[analysis]
type = "quasi-static"
steps = 1
[method]
basis = "spline"
[grid]
type = "lattice"
origin = [0, 0]
size = [4, 4]
h = 1
[material.m]
model = "hencky"
young = 1.0
poisson = 0.3
[[body]]
material = "m"
shape = { box = { min = [1, 1], max = [2, 2] } }
[[boundary]]
where = { side = "left" }
fix = ["x", "y"]
"#;

/// The example of the guide is a file and its name in the list: the deck knows it by that.
#[test]
fn a_basis_is_a_file_and_a_line() {
    let deck = crate::deck::read(std::path::Path::new("deck.toml"), SPLINE, &[]).expect("sound");
    let basis = deck.method.basis;
    assert_eq!((basis.name(), basis.domain()), ("spline", super::Domain::None));
    assert!(!of_deck::<2>(basis, GimpEdge::Continued).within_cells());
    assert!(crate::deck::resolved(&deck).contains("basis = \"spline\""));
    assert!(crate::deck::json_schema::json_schema().to_string().contains("\"spline\""));
}
