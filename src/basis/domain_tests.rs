//! The deformation modes of Lagrangian Table 2, in two and three dimensions.

#![allow(clippy::needless_range_loop, reason = "one index runs over several arrays")]

use nalgebra::Matrix3;

use crate::basis;
use crate::basis::domain::DomainStep;
use crate::basis::map_points;
use crate::deck::model::{Basis, DomainUpdate, GimpEdge};
use crate::error::Result;
use crate::grid::{Grid, Lattice};
use crate::points::Points;

const RULES: [DomainUpdate; 7] = [
    DomainUpdate::None,
    DomainUpdate::Det,
    DomainUpdate::Normal,
    DomainUpdate::Stretch,
    DomainUpdate::Corners,
    DomainUpdate::NormalCorrected,
    DomainUpdate::NormalIncremental,
];

const HALF: [f64; 3] = [0.2, 0.3, 0.25];

fn grid<const D: usize>() -> Grid<D> {
    Grid::Lattice(Lattice { origin: [-4.0; D], spacing: [1.0; D], cells: [8; D] })
}

fn points<const D: usize>(at: [f64; D]) -> Points<D> {
    let half = std::array::from_fn(|a| HALF[a]);
    let mut points = Points::default();
    points.push_unstrained(7, 0, at, half.iter().map(|l| 2.0 * l).product(), 1.0, half);
    points
}

fn update_domains<const D: usize>(
    grid: &Grid<D>,
    basis: Basis,
    rule: DomainUpdate,
    points: &mut Points<D>,
    increments: &[Matrix3<f64>],
    nodal: &dyn Fn(usize, usize) -> [f64; D],
) -> Result<usize> {
    let less_unit = |f: &Matrix3<f64>| -> [[f64; D]; D] {
        let f = f - Matrix3::identity();
        std::array::from_fn(|i| std::array::from_fn(|j| f[(i, j)]))
    };
    let increments: Vec<_> = increments.iter().map(less_unit).collect();
    let (grids, moved, rings) = ([grid; 2], &[][..], false);
    let step = DomainStep { grids, increments: &increments, moved, nodal, rings };
    basis::of_deck(basis, GimpEdge::Continued).update_domains(rule, &step, points)
}

/// One step from the unstrained state with the linear field u = (F - 1) X on the grid.
fn one_step<const D: usize>(
    rule: DomainUpdate,
    f: &Matrix3<f64>,
    at: [f64; D],
) -> Result<[f64; D]> {
    let mut points = points(at);
    step(Basis::Gimp, rule, f, &mut points)?;
    Ok(points.half_length[0])
}

/// One more step by dF; positions are moved afterwards.
fn step<const D: usize>(
    basis: Basis,
    rule: DomainUpdate,
    increment: &Matrix3<f64>,
    points: &mut Points<D>,
) -> Result<()> {
    let grid = grid::<D>();
    let row = map_points(&grid, basis, points)?.nodes;
    let motion = |x: &[f64; D]| -> [f64; D] {
        std::array::from_fn(|i| (0..D).map(|j| increment[(i, j)] * x[j]).sum::<f64>() - x[i])
    };
    points.deformation_gradient[0] = increment * points.deformation_gradient[0];
    let displacement = |_: usize, node: usize| {
        assert!(row.contains(&node), "node {node} is not in the point's row");
        motion(&grid.node_position(node))
    };
    update_domains(&grid, basis, rule, points, &[*increment], &displacement)?;
    let moved = motion(&points.position[0]);
    for a in 0..D {
        points.position[0][a] += moved[a];
    }
    Ok(())
}

fn assert_near<const D: usize>(lengths: [f64; D], exact: [f64; D], what: &str) {
    for a in 0..D {
        assert!((lengths[a] - exact[a]).abs() < 1e-14, "{what}: {lengths:?} {exact:?}");
    }
}

fn plane(xx: f64, xy: f64, yx: f64, yy: f64) -> Matrix3<f64> {
    Matrix3::new(xx, xy, 0.0, yx, yy, 0.0, 0.0, 0.0, 1.0)
}

fn initial<const D: usize>() -> [f64; D] {
    std::array::from_fn(|a| HALF[a])
}

fn stretch_modes<const D: usize>() {
    // Simple stretch along x.
    let f = plane(1.4, 0.0, 0.0, 1.0);
    let mut exact = initial::<D>();
    exact[0] *= 1.4;
    for rule in RULES {
        let got = one_step::<D>(rule, &f, [0.3; D]).expect("valid");
        match rule {
            DomainUpdate::None => assert_near(got, initial(), "none"),
            DomainUpdate::Det => {
                let factor = 1.4f64.powf(1.0 / D as f64);
                assert_near(got, initial().map(|l| l * factor), "det");
            }
            _ => assert_near(got, exact, &format!("{rule:?}")),
        }
    }
    // The same compression of every axis.
    let mut f = Matrix3::identity();
    for a in 0..D {
        f[(a, a)] = 0.7;
    }
    for rule in RULES.into_iter().skip(1) {
        let got = one_step::<D>(rule, &f, [0.3; D]).expect("valid");
        assert_near(got, initial().map(|l| 0.7 * l), &format!("{rule:?}"));
    }
}

#[test]
fn simple_and_hydrostatic_stretch() {
    stretch_modes::<2>();
    stretch_modes::<3>();
}

fn shear_mode<const D: usize>() {
    let f = plane(1.0, 0.4, 0.0, 1.0);
    for rule in RULES {
        let got = one_step::<D>(rule, &f, [0.3; D]).expect("valid");
        if rule == DomainUpdate::Stretch {
            // F^T F = [[1, g], [g, 1 + g^2]]: U = (F^T F + 1) / sqrt(4 + g^2).
            let root = 4.16f64.sqrt();
            let mut exact = initial::<D>();
            exact[0] *= 2.0 / root;
            exact[1] *= 2.16 / root;
            assert_near(got, exact, "stretch");
            // Table 2 (c): the volume grows although the deformation is isochoric.
            assert!(2.0 * 2.16 / (root * root) > 1.03);
        } else {
            assert_near(got, initial(), &format!("{rule:?}"));
        }
    }
}

#[test]
fn simple_shear() {
    shear_mode::<2>();
    shear_mode::<3>();
}

#[test]
fn corners_follow_the_side_centres_not_the_corners() {
    // 3D shear of the xy plane: side centres leave l_x = l_x, corners would give l_x + g l_y.
    let f = plane(1.0, 0.8, 0.0, 1.0);
    let got = one_step::<3>(DomainUpdate::Corners, &f, [0.1; 3]).expect("valid");
    // The centre of the upper y side moves by g l_y = 0.24 > l_x = 0.2 and sets the extent.
    let lm = [0.24, 0.3, 0.25];
    let factor = (0.2f64 / 0.24).cbrt();
    assert_near(got, lm.map(|l| l * factor), "corners");
}

fn rotation_mode<const D: usize>() {
    let angle: f64 = 0.3;
    let (s, c) = angle.sin_cos();
    let f = plane(c, -s, s, c);
    for rule in RULES {
        let got = one_step::<D>(rule, &f, [0.3; D]).expect("valid");
        let mut exact = initial::<D>();
        match rule {
            DomainUpdate::Normal => {
                // Table 2 (d): the domain vanishes with increasing rotation.
                exact[0] *= c;
                exact[1] *= c;
            }
            DomainUpdate::NormalCorrected | DomainUpdate::NormalIncremental => {
                // All in-plane axes shrink alike; in space the third has to make up for it.
                let factor = (c * c).powf(-1.0 / D as f64);
                exact = exact.map(|l| l * factor);
                exact[0] *= c;
                exact[1] *= c;
            }
            DomainUpdate::Corners => {
                // The turned sides' centres: at (c l_x, s l_x) and (-s l_y, c l_y).
                exact[0] = (c * HALF[0]).max(s * HALF[1]);
                exact[1] = (s * HALF[0]).max(c * HALF[1]);
                let lost: f64 = exact[0] * exact[1] / (HALF[0] * HALF[1]);
                let factor = lost.powf(-1.0 / D as f64);
                exact = exact.map(|l| l * factor);
            }
            _ => {}
        }
        assert_near(got, exact, &format!("{rule:?}"));
    }
}

#[test]
fn pure_rotation() {
    rotation_mode::<2>();
    rotation_mode::<3>();
}

#[test]
fn a_full_turn_in_many_steps_keeps_the_volume() {
    let (s, c) = (std::f64::consts::TAU / 400.0).sin_cos();
    let turn = plane(c, -s, s, c);
    for rule in [DomainUpdate::Corners, DomainUpdate::NormalIncremental, DomainUpdate::Stretch] {
        let mut points = points([0.8, 0.3]);
        for _ in 0..400 {
            step(Basis::Gimp, rule, &turn, &mut points).expect("valid");
            let [a, b] = points.half_length[0];
            assert!((a * b / (HALF[0] * HALF[1]) - 1.0).abs() < 1e-11, "{rule:?}");
        }
    }
}

#[test]
fn a_quarter_turn_defeats_the_normal_rules() {
    let f = plane(0.0, -1.0, 1.0, 0.0);
    for rule in
        [DomainUpdate::Normal, DomainUpdate::NormalCorrected, DomainUpdate::NormalIncremental]
    {
        let error = one_step::<2>(rule, &f, [0.3; 2]).expect_err("no length is left");
        let text = error.to_string();
        assert!(text.contains("point 7") && text.contains("corners"), "{text}");
    }
    // Half a turn is harmless: lengths have no sign.
    let f = plane(-1.0, 0.0, 0.0, -1.0);
    for rule in RULES {
        assert_near(one_step::<2>(rule, &f, [0.3; 2]).expect("valid"), initial(), "half a turn");
    }
    // The quarter turn swaps the axes where the rule knows about turning.
    let f = plane(0.0, -1.0, 1.0, 0.0);
    let got = one_step::<2>(DomainUpdate::Corners, &f, [0.3; 2]).expect("valid");
    assert_near(got, [HALF[1], HALF[0]], "corners");
}

#[test]
fn an_inverted_point_is_an_error_where_the_volume_counts() {
    let f = plane(-1.0, 0.0, 0.0, 1.0);
    for rule in [DomainUpdate::Det, DomainUpdate::NormalCorrected, DomainUpdate::Corners] {
        assert!(one_step::<2>(rule, &f, [0.3; 2]).is_err(), "{rule:?}");
    }
    let mirrored = Matrix3::from_diagonal(&[1.0, 1.0, -1.0].into());
    assert!(one_step::<3>(DomainUpdate::Det, &mirrored, [0.3; 3]).is_err());
}

#[test]
fn standard_points_take_the_root_of_their_volume() {
    let f = plane(1.3, 0.2, -0.1, 0.9);
    let det: f64 = 1.3 * 0.9 + 0.02;
    for rule in RULES {
        let mut two = points([0.3; 2]);
        step(Basis::Mpm, rule, &f, &mut two).expect("valid");
        assert_near(two.half_length[0], [(0.4 * 0.6 * det).sqrt() / 2.0; 2], "mpm");
        let mut three = points([0.3; 3]);
        step(Basis::Mpm, rule, &f, &mut three).expect("valid");
        assert_near(three.half_length[0], [(0.4 * 0.6 * 0.5 * det).cbrt() / 2.0; 3], "mpm");
    }
}

#[test]
fn corners_beyond_the_grid_move_with_its_edge() {
    // Centre 0.05 inside the lower edge: the lower corners stick out by 0.15 in x. Under a
    // stretch s of x about the edge they move as the edge does, not at all.
    let s = 1.5;
    let mut points = points([-3.95, 0.3]);
    let grid = grid::<2>();
    points.deformation_gradient[0][(0, 0)] = s;
    let displacement =
        |_: usize, node: usize| [(s - 1.0) * (grid.node_position(node)[0] + 4.0), 0.0];
    let (basis, rule) = (Basis::Gimp, DomainUpdate::Corners);
    update_domains(&grid, basis, rule, &mut points, &[Matrix3::identity()], &displacement)
        .expect("valid");
    // Sides: lower -0.15, upper 0.25 s; then scaled to the volume s.
    let lm = [0.5 * (0.25 * s + 0.15), HALF[1]];
    let factor = (s * HALF[0] / lm[0]).sqrt();
    assert_near(points.half_length[0], lm.map(|l| l * factor), "corners");
}
