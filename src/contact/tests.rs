//! Distances, normals and curvatures of surfaces against differences; the tangent of the contact law
//! against differences of its force.

use super::ball::Ball;
use super::capsule::Capsule;
use super::cone::Cone;
use super::cuboid::Cuboid;
use super::half_space::HalfSpace;
use super::law::{Friction, Law, Reached, Response};
use super::outline::Outline;
use super::pose::{Pose, rotation};
use super::surface::{Near, Surface, length};

/// ∇g and ∇n by central differences, the gap at the closest point, and the box around.
fn require_derivatives<const D: usize>(surface: &dyn Surface<D>, x: [f64; D]) {
    let (step, near) = (1e-6, surface.near(&x));
    assert!((length(&near.normal) - 1.0).abs() < 1e-14);
    for j in 0..D {
        let beside = |sign: f64| {
            let mut moved = x;
            moved[j] += sign * step;
            surface.near(&moved)
        };
        let (more, less) = (beside(1.0), beside(-1.0));
        let slope = (more.gap - less.gap) / (2.0 * step);
        assert!((slope - near.normal[j]).abs() < 1e-8, "{surface:?} at {x:?}: {slope} {near:?}");
        for i in 0..D {
            let turn = (more.normal[i] - less.normal[i]) / (2.0 * step);
            let found = near.curvature[i][j];
            assert!((turn - found).abs() < 1e-7, "{surface:?} at {x:?}: {turn} {found}");
        }
    }
    let closest = near.closest(&x);
    let (low, high) = surface.bounds();
    assert!(surface.near(&closest).gap.abs() < 1e-12);
    for a in 0..D {
        assert!(
            (low[a] - 1e-12..=high[a] + 1e-12).contains(&closest[a]),
            "{surface:?} {closest:?}"
        );
    }
}

#[test]
fn normals_and_curvatures_are_those_of_the_distance() {
    let plane: [&dyn Surface<2>; 5] = [
        &HalfSpace { point: [0.2, 0.1], normal: [0.6, 0.8] },
        &Ball { centre: [0.1, 0.2], radius: 0.7 },
        &Cuboid { min: [-0.5, -0.4], max: [0.6, 0.8] },
        &Capsule { from: [-0.5, 0.0], to: [0.4, 0.3], radius: 0.3 },
        // With a corner that points inwards, at (0.1, 0.1).
        &Outline::new(&[[-0.6, -0.5], [0.7, -0.4], [0.1, 0.1], [0.0, 0.8]]).expect("an area"),
    ];
    for surface in plane {
        for x in [[0.33, 0.41], [-0.2, 0.05], [0.9, -0.8], [0.0, -0.03], [0.07, 0.08], [1.3, 1.1]] {
            require_derivatives(surface, x);
        }
    }
    let unit = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];
    let space: [&dyn Surface<3>; 5] = [
        &HalfSpace { point: [0.2, 0.1, 0.0], normal: unit },
        &Ball { centre: [0.1, 0.2, 0.3], radius: 0.7 },
        &Cuboid { min: [-0.5, -0.4, -0.6], max: [0.6, 0.8, 0.7] },
        &Capsule { from: [-0.5, 0.0, 0.1], to: [0.4, 0.3, 0.0], radius: 0.3 },
        &Cone::new([0.1, 0.0, -0.2], unit, 60.0, 0.3, 0.5).expect("a volume"),
    ];
    for surface in space {
        for x in [[0.33, 0.41, 0.2], [-0.2, 0.05, 0.37], [0.9, -0.8, 0.1], [0.2, 0.13, 0.05]] {
            require_derivatives(surface, x);
        }
    }
}

#[test]
fn an_outline_knows_its_inside() {
    let outline = Outline::new(&[[0.0, 0.0], [0.0, 1.0], [2.0, 1.0], [2.0, 0.0], [1.0, 0.0]]);
    let outline = outline.expect("an area");
    // Above and below the corner of a straight side, beside and beyond the others.
    for (x, gap) in [
        ([1.0, -0.3], 0.3),
        ([1.0, 0.2], -0.2),
        ([0.5, 0.9], -0.1),
        ([-3.0, 5.0], 5.0),
        ([2.0, 1.25], 0.25),
    ] {
        assert!((outline.near(&x).gap - gap).abs() < 1e-14, "{x:?}");
    }
    assert!(Outline::new(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]).is_none());
}

/// The edge on the axis of a body of revolution is no surface: a place inside, near the axis, is told
/// of the cone.
#[test]
fn a_profile_has_no_surface_on_its_axis() {
    let profile = [[0.0, 1.0], [0.2, 1.2], [0.2, 2.0], [0.0, 2.0]];
    let outline = Outline::mirrored(&profile).expect("an area");
    let x = [0.01, 1.05];
    let near = outline.near(&x);
    let root = 0.5f64.sqrt();
    assert!((near.normal[0] - root).abs() < 1e-14 && (near.normal[1] + root).abs() < 1e-14);
    assert!((near.gap + 0.04 * root).abs() < 1e-14, "{near:?}");
    let open = Outline::new(&profile).expect("an area");
    assert_eq!(open.near(&x).normal, [-1.0, 0.0]);
}

#[test]
fn a_pose_carries_the_surface_along() {
    let surface = Capsule { from: [-0.5, 0.0, 0.1], to: [0.4, 0.3, 0.0], radius: 0.3 };
    let pose = Pose {
        centre: [0.3, -0.2, 0.5],
        shift: [1.0, 2.0, -1.0],
        turn: rotation(&[1.0, 2.0, -0.5], 37.0),
    };
    let place = [0.2, 0.5, 0.3];
    let x = pose.to_space(&place);
    let back = pose.to_body(&x);
    assert!((0..3).all(|i| (back[i] - place[i]).abs() < 1e-14));
    let (there, here) = (pose.near(&surface, &x), surface.near(&place));
    assert!((there.gap - here.gap).abs() < 1e-14);
    let step = 1e-6;
    for j in 0..3 {
        let beside = |sign: f64| {
            let mut moved = x;
            moved[j] += sign * step;
            pose.near(&surface, &moved)
        };
        let (more, less) = (beside(1.0), beside(-1.0));
        for i in 0..3 {
            let turn = (more.normal[i] - less.normal[i]) / (2.0 * step);
            assert!((turn - there.curvature[i][j]).abs() < 1e-8);
        }
    }
}

/// A state of contact on a surface at `x`, with the way `come` against the surface so far.
fn respond<const D: usize>(
    law: &Law,
    surface: &dyn Surface<D>,
    (x, from): ([f64; D], [f64; D]),
    before: f64,
) -> Response<D> {
    let near: Near<D> = surface.near(&x);
    assert!(near.gap < 0.0);
    let slip = std::array::from_fn(|i| x[i] - from[i]);
    law.respond(&Reached { near, gap_before: before, slip })
}

/// The tangent of the traction by differences, in stick, in slip, under the largest shear and where
/// contact begins in the step, on flat and curved parts and near a corner that points inwards.
#[test]
fn the_stiffness_is_that_of_the_traction() {
    let notch = Outline::new(&[[-1.0, -1.0], [1.0, -1.0], [0.0, 0.3], [-0.2, 1.0]]).expect("area");
    let ball = Ball { centre: [0.0, -1.0], radius: 1.3 };
    let coulomb = |coefficient, most| Friction::Coulomb { coefficient, adhesion: 0.4, most };
    let mut slid = [0, 0];
    for surface in [&notch as &dyn Surface<2>, &ball] {
        for friction in [
            Friction::Smooth,
            Friction::Rough,
            coulomb(0.3, f64::INFINITY),
            coulomb(30.0, f64::INFINITY),
            coulomb(0.3, 0.5),
        ] {
            let law = Law { penalty: 50.0, friction };
            for before in [-0.1, 0.0, 0.2] {
                let (x, from) = ([-0.08, 0.26], [-0.14, 0.29]);
                let found = respond(&law, surface, (x, from), before);
                slid[usize::from(length(&found.sliding) > 0.0)] += 1;
                let step = 1e-7;
                for j in 0..2 {
                    let beside = |sign: f64| {
                        let mut moved = x;
                        moved[j] += sign * step;
                        respond(&law, surface, (moved, from), before).traction
                    };
                    let (more, less) = (beside(1.0), beside(-1.0));
                    for i in 0..2 {
                        let slope = -(more[i] - less[i]) / (2.0 * step);
                        let wrong = (slope - found.stiffness[i][j]).abs();
                        assert!(wrong < 1e-6 * law.penalty, "{law:?} {before}: {slope} {found:?}");
                    }
                }
            }
        }
    }
    assert!(slid[0] > 5 && slid[1] > 5, "both stick and slip: {slid:?}");
}

#[test]
fn what_slides_is_at_the_limit() {
    let law = Law {
        penalty: 1e3,
        friction: Friction::Coulomb { coefficient: 0.3, adhesion: 0.0, most: f64::INFINITY },
    };
    let floor = HalfSpace { point: [0.0; 3], normal: [0.0, 0.0, 1.0] };
    let found = respond(&law, &floor, ([0.3, 0.4, -0.01], [0.0, 0.0, -0.01]), -0.01);
    let [x, y, p] = found.traction;
    assert!((p - 10.0).abs() < 1e-12 && (x.hypot(y) - 3.0).abs() < 1e-12);
    assert!((x + 1.8).abs() < 1e-12 && (length(&found.sliding) - 0.497).abs() < 1e-12);
}

/// Volume, centroid and inertia by counting small cubes.
fn require_solid<const D: usize>(surface: &dyn Surface<D>, pieces: usize) {
    let solid = surface.solid().expect("a volume");
    let (low, high) = surface.bounds();
    let step: [f64; D] = std::array::from_fn(|a| (high[a] - low[a]) / pieces as f64);
    let piece: f64 = step.iter().product();
    let (mut volume, mut first, mut second) = (0.0, [0.0; D], [[0.0; 3]; 3]);
    for k in 0..pieces.pow(D as u32) {
        let x: [f64; D] = std::array::from_fn(|a| {
            low[a] + step[a] * ((k / pieces.pow(a as u32) % pieces) as f64 + 0.5)
        });
        if surface.near(&x).gap > 0.0 {
            continue;
        }
        volume += piece;
        let mut r = [0.0; 3];
        for a in 0..D {
            first[a] += piece * x[a];
            r[a] = x[a] - solid.centroid[a];
        }
        let square: f64 = r.iter().map(|r| r * r).sum();
        for i in 0..3 {
            for j in 0..3 {
                let unit = if i == j { square } else { 0.0 };
                second[i][j] += piece * (unit - r[i] * r[j]);
            }
        }
    }
    let close = |found: f64, exact: f64, scale: f64| (found - exact).abs() < 0.02 * scale;
    assert!(close(volume, solid.volume, volume), "{surface:?}: {volume} {solid:?}");
    for a in 0..D {
        assert!(close(first[a] / volume, solid.centroid[a], high[a] - low[a]), "{surface:?}");
    }
    let turns = if D == 2 { 2..3 } else { 0..3 };
    for i in turns.clone() {
        for j in turns.clone() {
            let scale = second[2][2].max(second[0][0]);
            assert!(close(second[i][j], solid.inertia[i][j], scale), "{surface:?} {second:?}");
        }
    }
}

#[test]
fn volumes_and_inertia_are_those_of_the_inside() {
    let corners = [[-0.6, -0.5], [0.7, -0.4], [0.1, 0.1], [0.0, 0.8]];
    let plane: [&dyn Surface<2>; 4] = [
        &Ball { centre: [0.1, 0.2], radius: 0.7 },
        &Cuboid { min: [-0.5, -0.4], max: [0.6, 0.8] },
        &Capsule { from: [-0.5, 0.0], to: [0.4, 0.3], radius: 0.3 },
        &Outline::new(&corners).expect("an area"),
    ];
    plane.iter().for_each(|surface| require_solid(*surface, 300));
    let unit = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];
    let space: [&dyn Surface<3>; 4] = [
        &Ball { centre: [0.1, 0.2, 0.3], radius: 0.7 },
        &Cuboid { min: [-0.5, -0.4, -0.6], max: [0.6, 0.8, 0.7] },
        &Capsule { from: [-0.5, 0.0, 0.1], to: [0.4, 0.3, 0.0], radius: 0.3 },
        &Cone::new([0.1, 0.0, -0.2], unit, 60.0, 0.3, 0.5).expect("a volume"),
    ];
    space.iter().for_each(|surface| require_solid(*surface, 60));
    assert!(HalfSpace { point: [0.0; 2], normal: [0.0, 1.0] }.solid().is_none());
}

/// Corners of the facets lie on the surface, and their middles near it.
fn require_facets<const D: usize>(surface: &dyn Surface<D>) {
    let facets = surface.facets(&[0.1; D], 2.0);
    assert!(!facets.facets.is_empty());
    for corner in &facets.corners {
        assert!(surface.near(corner).gap.abs() < 1e-12, "{surface:?} at {corner:?}");
    }
    for facet in &facets.facets {
        let middle: [f64; D] = std::array::from_fn(|i| {
            facet.iter().map(|&k| facets.corners[k][i]).sum::<f64>() / D as f64
        });
        assert!(surface.near(&middle).gap.abs() < 0.01, "{surface:?} at {middle:?}");
    }
}

#[test]
fn facets_lie_on_the_surface() {
    let corners = [[-0.6, -0.5], [0.7, -0.4], [0.1, 0.1], [0.0, 0.8]];
    let plane: [&dyn Surface<2>; 5] = [
        &HalfSpace { point: [0.2, 0.1], normal: [0.6, 0.8] },
        &Ball { centre: [0.1, 0.2], radius: 0.7 },
        &Cuboid { min: [-0.5, -0.4], max: [0.6, 0.8] },
        &Capsule { from: [-0.5, 0.0], to: [0.4, 0.3], radius: 0.3 },
        &Outline::new(&corners).expect("an area"),
    ];
    plane.iter().for_each(|surface| require_facets(*surface));
    let unit = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];
    let space: [&dyn Surface<3>; 5] = [
        &HalfSpace { point: [0.2, 0.1, 0.0], normal: unit },
        &Ball { centre: [0.1, 0.2, 0.3], radius: 0.7 },
        &Cuboid { min: [-0.5, -0.4, -0.6], max: [0.6, 0.8, 0.7] },
        &Capsule { from: [-0.5, 0.0, 0.1], to: [0.4, 0.3, 0.0], radius: 0.3 },
        &Cone::new([0.1, 0.0, -0.2], unit, 60.0, 0.3, 0.5).expect("a volume"),
    ];
    space.iter().for_each(|surface| require_facets(*surface));
}
