//! CPDI1 and CPDI2 against moments, quadrature, printed formulas and plain interpolation.

#![allow(clippy::needless_range_loop, reason = "tensor formulas read by their indices")]

use nalgebra::Matrix3;

use super::*;
use crate::basis::Row;
use crate::basis::cpdi1::{self, Cpdi1};
use crate::deck::model::Basis;
use crate::grid::Grid;
use crate::grid::generate::{annulus, box_mesh};
use crate::grid::{Lattice, Mesh};
use crate::points::rectangle_corners;

type Influence<const D: usize> =
    fn(&Grid<D>, &Points<D>, usize, &mut Row<D>) -> crate::error::Result<()>;

fn influence<T: Cornered<D>, const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
    p: usize,
    row: &mut Row<D>,
) -> Result<()> {
    T::shares(points, p)?.fill(grid, points, p, &mut None, row)
}

fn point<const D: usize>(x: [f64; D], half: [f64; D]) -> Points<D> {
    let mut points = Points::default();
    let volume = half.iter().map(|l| 2.0 * l).product();
    points.push_unstrained(41, 0, x, volume, 1.0, half);
    points
}

/// A CPDI2 point with given corners.
fn polygon<const D: usize>(corners: &[[f64; D]]) -> Points<D> {
    let mut all = [[0.0; D]; 8];
    all[..corners.len()].copy_from_slice(corners);
    let mut points = point(centroid(&all), [0.1; D]);
    points.volume_initial[0] = volume(&all);
    points.corners[0] = all;
    points
}

fn quad_lattice() -> Grid<2> {
    Grid::Lattice(Lattice { origin: [-1.0, 0.0], spacing: [0.5, 0.4], cells: [8, 10] })
}

fn hex_lattice() -> Grid<3> {
    Grid::Lattice(Lattice { origin: [-1.0; 3], spacing: [0.5, 0.4, 0.3], cells: [6, 6, 8] })
}

/// Sum S = 1, sum dS = 0, sum S_i x_i = `centre`, sum dS_i x_i = 1; nodes ascend.
fn check_moments<const D: usize>(grid: &Grid<D>, row: &Row<D>, centre: [f64; D]) {
    assert!(row.entries().is_sorted_by(|a, b| a.0 < b.0));
    let mut unity = 0.0;
    let (mut first, mut slope_sum, mut slopes) = ([0.0; D], [0.0; D], [[0.0; D]; D]);
    for (node, s, ds) in row.entries() {
        let x = grid.node_position(*node);
        unity += s;
        for i in 0..D {
            first[i] += s * x[i];
            slope_sum[i] += ds[i];
            for j in 0..D {
                slopes[i][j] += x[i] * ds[j];
            }
        }
    }
    assert!((unity - 1.0).abs() < 1e-13);
    for i in 0..D {
        assert!((first[i] - centre[i]).abs() < 1e-12, "{first:?} {centre:?}");
        assert!(slope_sum[i].abs() < 1e-11);
        for j in 0..D {
            let exact = f64::from(u8::from(i == j));
            assert!((slopes[i][j] - exact).abs() < 1e-11, "{slopes:?}");
        }
    }
}

fn strained<const D: usize>(mut points: Points<D>) -> Points<D> {
    points.deformation_gradient[0] =
        Matrix3::new(1.1, 0.35, -0.1, -0.2, 0.9, 0.15, 0.05, 0.1, 1.05);
    if D == 2 {
        // Plane strain.
        for i in 0..3 {
            points.deformation_gradient[0][(2, i)] = f64::from(u8::from(i == 2));
            points.deformation_gradient[0][(i, 2)] = f64::from(u8::from(i == 2));
        }
    }
    points
}

const QUAD: [[f64; 2]; 4] = [[0.1, 0.9], [1.3, 1.2], [1.05, 2.3], [0.2, 1.9]];

fn hex(centre: [f64; 3], size: f64) -> Vec<[f64; 3]> {
    let wobble = [0.1, -0.2, 0.05, 0.15, -0.1, 0.2, -0.15, 0.08];
    (0..8)
        .map(|c| {
            let r = Element::Hex8.reference_node::<3>(c);
            let w = wobble[c];
            [
                centre[0] + size * (r[0] + w),
                centre[1] + size * (r[1] - 0.7 * w),
                centre[2] + size * (r[2] + 0.5 * w + 0.2 * r[0] * r[1]),
            ]
        })
        .collect()
}

#[test]
fn moments_hold_on_lattices_and_meshes() {
    let mut row = Row::default();
    let ring = |element| Grid::Mesh(annulus([6.0, 4.0], 10.0, [6, 40], element, 2.0).unwrap());
    let away = |x: [f64; 2]| [x[0] - 0.6 + 7.0, x[1] - 1.6 + 1.0];
    let shifted: Vec<[f64; 2]> = QUAD.iter().map(|&x| away(x)).collect();
    for (grid, centre, corners) in [
        (quad_lattice(), [0.7, 1.5], QUAD.to_vec()),
        (ring(Element::Quad4), [7.3, 1.1], shifted.clone()),
        (ring(Element::Tri3), [7.3, 1.1], shifted),
    ] {
        let points = strained(point(centre, [0.5, 0.3]));
        influence::<Cpdi1, _>(&grid, &points, 0, &mut row).unwrap();
        check_moments(&grid, &row, centre);
        assert!(row.cells().len() > 2);
        let points = polygon(&corners);
        influence::<Cpdi2, _>(&grid, &points, 0, &mut row).unwrap();
        check_moments(&grid, &row, points.position[0]);
        assert!(row.cells().len() > 2);
    }
    let mut row = Row::default();
    let boxed = |element| {
        let mut mesh = box_mesh([-1.0; 3], [2.0, 1.4, 1.4], [6, 6, 8], element).unwrap();
        let wave = |x: f64| 0.02 * (3.0 * x).sin();
        let moved = (0..mesh.node_count()).map(|n| {
            let [x, y, z] = mesh.node_position(n);
            [x + wave(y), y + wave(z), z + wave(x)]
        });
        mesh.set_positions(moved.collect()).unwrap();
        Grid::Mesh(mesh)
    };
    for grid in [hex_lattice(), boxed(Element::Hex8), boxed(Element::Tet4)] {
        let points = strained(point([0.35, 0.2, 0.1], [0.4, 0.35, 0.3]));
        influence::<Cpdi1, _>(&grid, &points, 0, &mut row).unwrap();
        check_moments(&grid, &row, [0.35, 0.2, 0.1]);
        let points = polygon(&hex([0.35, 0.2, 0.1], 0.4));
        influence::<Cpdi2, _>(&grid, &points, 0, &mut row).unwrap();
        check_moments(&grid, &row, points.position[0]);
    }
}

/// Rotation §2 (iv) as printed, with the full edges s and t.
#[test]
fn cpdi1_has_the_printed_gradients_in_the_plane() {
    let points = strained(point([0.7, 1.5], [0.5, 0.3]));
    let edges = cpdi1::half_edges(&points, 0);
    let (s, t) = ([2.0 * edges[0][0], 2.0 * edges[1][0]], [2.0 * edges[0][1], 2.0 * edges[1][1]]);
    let v = s[0] * t[1] - s[1] * t[0];
    assert!((v - points.volume(0)).abs() < 1e-14);
    let one_three = [(s[1] - t[1]) / (2.0 * v), (t[0] - s[0]) / (2.0 * v)];
    let two_four = [(s[1] + t[1]) / (2.0 * v), (-s[0] - t[0]) / (2.0 * v)];
    let corners = Cpdi1::shares(&points, 0).unwrap();
    for i in 0..2 {
        assert!((corners.gradients[0][i] - one_three[i]).abs() < 1e-14);
        assert!((corners.gradients[2][i] + one_three[i]).abs() < 1e-14);
        assert!((corners.gradients[1][i] - two_four[i]).abs() < 1e-14);
        assert!((corners.gradients[3][i] + two_four[i]).abs() < 1e-14);
        assert!(
            (corners.positions[1][i] - (0.7 + 0.8 * i as f64 + 0.5 * (s[i] - t[i]))).abs() < 1e-14
        );
    }
}

/// Both integrals by a quadrature of much higher order, in 2D and 3D.
#[test]
fn cpdi2_weights_and_gradients_are_the_integrals() {
    fn check<const D: usize>(element: Element, corners: &[[f64; D]]) {
        let points = polygon(corners);
        let found = Cpdi2::shares(&points, 0).unwrap();
        let (mut volume, mut weights, mut gradients) = (0.0, [0.0; 8], [[0.0; D]; 8]);
        for (xi, gauss) in gauss_rule::<D>(element, 7) {
            let (dn, det) = crate::grid::element::gradients(element, corners, &xi).unwrap();
            volume += gauss * det;
            for (c, n) in element.shape(&xi).iter().enumerate() {
                weights[c] += gauss * det * n;
                for i in 0..D {
                    gradients[c][i] += gauss * det * dn[c][i];
                }
            }
        }
        assert!((super::volume(&points.corners[0]) - volume).abs() < 1e-13);
        for c in 0..corners.len() {
            assert!((found.weights[c] - weights[c] / volume).abs() < 1e-13);
            for i in 0..D {
                assert!((found.gradients[c][i] - gradients[c][i] / volume).abs() < 1e-12);
            }
        }
    }
    check(Element::Quad4, &QUAD);
    check(Element::Quad4, &[[0.0, 0.0], [3.0, 0.1], [2.0, 1.0], [-0.5, 0.6]]);
    check(Element::Hex8, &hex([0.0, 1.0, 2.0], 0.7));
}

/// The centroid of a polygon by Green's theorem, without any shape function.
#[test]
fn cpdi2_centre_is_the_centroid() {
    let (mut area, mut moment) = (0.0, [0.0; 2]);
    for (k, p) in QUAD.iter().enumerate() {
        let q = QUAD[(k + 1) % 4];
        let cross = p[0] * q[1] - q[0] * p[1];
        area += 0.5 * cross;
        for i in 0..2 {
            moment[i] += cross * (p[i] + q[i]) / 6.0;
        }
    }
    let points = polygon(&QUAD);
    for i in 0..2 {
        assert!((points.position[0][i] - moment[i] / area).abs() < 1e-14);
    }
    assert!((points.volume_initial[0] - area).abs() < 1e-14);
}

/// Repeated corners make linear triangles and tetrahedra.
#[test]
fn cpdi2_on_simplices_is_linear() {
    let [a, b, c] = [[0.2, 1.0], [1.1, 1.2], [0.5, 2.2]];
    let found = Cpdi2::shares(&polygon(&[a, b, c, c]), 0).unwrap();
    for (weight, exact) in [
        (found.weights[0], 1.0 / 3.0),
        (found.weights[1], 1.0 / 3.0),
        (found.weights[2] + found.weights[3], 1.0 / 3.0),
    ] {
        assert!((weight - exact).abs() < 1e-14);
    }
    let tet = [[0.0, 0.1, 0.0], [1.0, 0.0, 0.2], [0.1, 1.2, 0.0], [0.3, 0.2, 0.9]];
    let [a, b, c, d] = tet;
    let found = Cpdi2::shares(&polygon(&[a, b, c, c, d, d, d, d]), 0).unwrap();
    let (dn, _) = crate::grid::element::gradients(Element::Tet4, &tet, &[0.2, 0.2, 0.2]).unwrap();
    for (vertex, group) in [(0, 0..1), (1, 1..2), (2, 2..4), (3, 4..8)] {
        let weight: f64 = found.weights[group.clone()].iter().sum();
        assert!((weight - 0.25).abs() < 1e-13, "{weight}");
        for i in 0..3 {
            let slope: f64 = found.gradients[group.clone()].iter().map(|g| g[i]).sum();
            assert!((slope - dn[vertex][i]).abs() < 1e-12);
        }
    }
}

/// Inside one cell the corner values determine the linear (on a box: bilinear) field exactly, so
/// both bases, like gimp, give the standard functions of the centre.
#[test]
fn a_rectangle_inside_a_box_cell_gives_the_standard_functions() {
    fn check<const D: usize>(grid: &Grid<D>, x: [f64; D], half: [f64; D]) {
        let points = point(x, half);
        let at = grid.interpolate(&x, 0.0, None).unwrap();
        let (mut plain, mut row) = (Row::default(), Row::default());
        plain.add_place(&at);
        plain.merge();
        let both: [Influence<D>; 2] = [influence::<Cpdi1, _>, influence::<Cpdi2, _>];
        for basis in both {
            basis(grid, &points, 0, &mut row).unwrap();
            assert_eq!(row.cells(), [at.values.cell]);
            assert_eq!(row.entries().len(), 1 << D);
            for (p, q) in plain.entries().iter().zip(row.entries()) {
                assert_eq!(p.0, q.0);
                assert!((p.1 - q.1).abs() < 1e-14);
                for i in 0..D {
                    assert!((p.2[i] - q.2[i]).abs() < 1e-12);
                }
            }
        }
    }
    // The second touches two sides of its cell, which leaves the neighbours unpopulated.
    check(&quad_lattice(), [0.2, 1.0], [0.1, 0.15]);
    check(&quad_lattice(), [0.125, 0.9], [0.125, 0.1]);
    let mesh: Mesh<2> = box_mesh([-1.0, 0.0], [3.0, 4.0], [8, 10], Element::Quad4).unwrap();
    check(&Grid::Mesh(mesh), [0.125, 0.9], [0.125, 0.1]);
    check(&hex_lattice(), [0.2, 0.0, 0.05], [0.1, 0.1, 0.1]);
}

/// Half a cell on each side of a node line: weights 1/4 1/2 1/4 per axis, slopes -1/2h 0 1/2h.
#[test]
fn a_domain_across_a_node_has_known_weights() {
    let grid = quad_lattice();
    let points = point([0.5, 1.2], [0.25, 0.2]);
    let mut row = Row::default();
    influence::<Cpdi1, _>(&grid, &points, 0, &mut row).unwrap();
    assert_eq!((row.entries().len(), row.cells().len()), (9, 4));
    let line = [0.25, 0.5, 0.25];
    let slope = [-1.0, 0.0, 1.0];
    for (k, (_, s, ds)) in row.entries().iter().enumerate() {
        let (i, j) = (k % 3, k / 3);
        assert!((s - line[i] * line[j]).abs() < 1e-14);
        assert!((ds[0] - slope[i] * line[j]).abs() < 1e-13);
        assert!((ds[1] - line[i] * slope[j] / 0.8).abs() < 1e-13);
    }
    let mut cells = vec![99];
    crate::basis::populated_cells(&grid, Basis::Cpdi1, &points, 0, None, &mut cells).unwrap();
    assert_eq!(cells[0], 99);
    assert_eq!(&cells[1..], row.cells());
}

/// A displacement with curvature: the area follows det(1 + mean du/dx), Rotation §2 (vii).
#[test]
fn moved_corners_have_the_area_of_the_mean_gradient() {
    let grid = quad_lattice();
    let mut points = polygon(&QUAD);
    let u = |node: usize| {
        let [x, y] = grid.node_position(node);
        [0.1 * x * y - 0.05 * y * y, 0.07 * x * x + 0.04 * y]
    };
    let mut row = Row::default();
    influence::<Cpdi2, _>(&grid, &points, 0, &mut row).unwrap();
    let mut increment = Matrix3::identity();
    for (node, _, ds) in row.entries() {
        let u = u(*node);
        for i in 0..2 {
            for j in 0..2 {
                increment[(i, j)] += u[i] * ds[j];
            }
        }
    }
    points.deformation_gradient[0] = increment;
    let moved = moved_corners([&grid; 2], &points, 0, &mut None, &u).unwrap();
    assert!((moved[2][0] - points.corners[0][2][0]).abs() > 0.01);
    assert!((volume(&moved) - points.volume(0)).abs() < 1e-13);
}

#[test]
fn corners_follow_linear_fields_exactly_on_any_grid() {
    let mesh = annulus([6.0, 4.0], 10.0, [6, 40], Element::Tri3, 1.0).unwrap();
    let grid = Grid::Mesh(mesh);
    let field = |x: [f64; 2]| [0.1 + 0.02 * x[0] - 0.03 * x[1], -0.2 + 0.01 * x[0]];
    let shifted: Vec<[f64; 2]> = QUAD.iter().map(|x| [x[0] + 6.5, x[1] - 1.0]).collect();
    let points = polygon(&shifted);
    let nodal = |n| field(grid.node_position(n));
    let moved = moved_corners([&grid; 2], &points, 0, &mut None, &nodal).unwrap();
    for (corner, x) in moved.iter().zip(&shifted) {
        let u = field(*x);
        assert!((corner[0] - x[0] - u[0]).abs() < 1e-13);
        assert!((corner[1] - x[1] - u[1]).abs() < 1e-13);
    }
}

#[test]
fn the_start_domain_of_cpdi1_may_be_oblique() {
    // A trapezium: the parallelogram with its mean edges, which has the same area.
    let trapezium = [[0.0, 0.0], [1.0, 0.0], [0.8, 0.5], [0.3, 0.6]];
    let points = polygon(&trapezium);
    let edges = cpdi1::half_edges_initial(&points, 0);
    let mean = |i: usize, sign: [f64; 4]| -> f64 {
        (0..4).map(|c| sign[c] * trapezium[c][i]).sum::<f64>() / 4.0
    };
    for i in 0..2 {
        assert!((edges[i][0] - mean(i, [-1.0, 1.0, 1.0, -1.0])).abs() < 1e-15);
        assert!((edges[i][1] - mean(i, [-1.0, -1.0, 1.0, 1.0])).abs() < 1e-15);
    }
    // A tetrahedron's parallelepiped keeps its volume.
    let [a, b, c, d] = [[0.0, 0.1, 0.0], [1.0, 0.0, 0.2], [0.1, 1.2, 0.0], [0.3, 0.2, 0.9]];
    let points = polygon(&[a, b, c, c, d, d, d, d]);
    let edges = cpdi1::half_edges_initial(&points, 0);
    assert!((8.0 * determinant(&edges) - points.volume_initial[0]).abs() < 1e-14);
    // Without corners the half lengths count.
    let mut points = point([0.0; 2], [0.3, 0.2]);
    points.corners[0] = [[0.0; 2]; 8];
    assert_eq!(cpdi1::half_edges_initial(&points, 0), [[0.3, 0.0], [0.0, 0.2]]);
}

#[test]
fn a_corner_just_outside_keeps_the_moments_and_one_far_outside_is_an_error() {
    let grid = quad_lattice();
    let mut row = Row::default();
    let points = point([-0.95, 1.5], [0.1, 0.1]);
    influence::<Cpdi1, _>(&grid, &points, 0, &mut row).unwrap();
    check_moments(&grid, &row, [-0.95, 1.5]);
    let points = point([-0.95, 1.5], [0.3, 0.1]);
    let both: [Influence<2>; 2] = [influence::<Cpdi1, _>, influence::<Cpdi2, _>];
    for basis in both {
        let error = basis(&grid, &points, 0, &mut row).unwrap_err();
        assert_eq!(error.exit_code(), 1);
        let text = error.to_string();
        assert!(
            text.contains("corner 1 of point 41 is outside the grid at [-1.25, 1.4] m"),
            "{text}"
        );
    }
}

#[test]
fn inverted_domains_are_refused() {
    let grid = quad_lattice();
    let mut row = Row::default();
    let mut points = point([0.5, 1.5], [0.2, 0.2]);
    points.corners[0] = rectangle_corners([0.5, 1.5], [-0.2, 0.2]);
    let text = influence::<Cpdi2, _>(&grid, &points, 0, &mut row).unwrap_err().to_string();
    assert!(text.contains("point 41") && text.contains("inverted"), "{text}");
    points.corners[0] = rectangle_corners([0.5, 1.5], [0.2, 0.2]);
    points.deformation_gradient[0][(1, 1)] = -0.5;
    let text = influence::<Cpdi1, _>(&grid, &points, 0, &mut row).unwrap_err().to_string();
    assert!(text.contains("point 41") && text.contains("inverted"), "{text}");
    // The displacement that turns a domain over is caught when it happens.
    points.corners[0] = rectangle_corners([0.5, 1.5], [0.2, 0.2]);
    let fold = |node: usize| [-2.0 * (grid.node_position(node)[0] - 0.5), 0.0];
    assert!(moved_corners([&grid; 2], &points, 0, &mut None, &fold).is_err());
}

/// Seeding puts CPDI2 points where its functions put them, and volumes agree.
#[test]
fn sub_cells_of_meshes_make_consistent_domains() {
    fn check<const D: usize>(mesh: &Mesh<D>) {
        let mut cells = Vec::new();
        mesh.sub_cells(mesh.cell_count() / 2, [2; D], &mut cells);
        assert_eq!(cells.len(), 1 << D);
        for cell in &cells {
            let centre = centroid(&cell.corners);
            for a in 0..D {
                assert!((centre[a] - cell.centroid[a]).abs() < 1e-12);
            }
            assert!((volume(&cell.corners) - cell.volume).abs() < 1e-13);
        }
    }
    check(&annulus::<2>([6.0, 4.0], 10.0, [6, 40], Element::Quad4, 2.0).unwrap());
    check(&annulus::<2>([6.0, 4.0], 10.0, [6, 40], Element::Tri3, 2.0).unwrap());
    for element in [Element::Hex8, Element::Tet4] {
        let mut mesh = box_mesh([0.0; 3], [1.0; 3], [2; 3], element).unwrap();
        let moved = (0..mesh.node_count()).map(|n| {
            let [x, y, z] = mesh.node_position(n);
            [x + 0.2 * y * z, y + 0.1 * x * z, z - 0.15 * x * y]
        });
        mesh.set_positions(moved.collect()).unwrap();
        check(&mesh);
    }
}
