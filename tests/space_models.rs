//! Every model of soil, metal and rubber in three dimensions: a slab of plane strain is the plane problem, and
//! a problem turned on the grid is the same problem.

mod common;

use common::run::{PointTable, Results, Run};

/// Name, parameters, and whether some of the block shall flow.
const MODELS: [(&str, &str, bool); 6] = [
    ("neo-hookean", "", false),
    ("von-mises", "yield_stress=3e3,hardening=2e4,", true),
    ("tresca", "shear_strength=1.5e3,", true),
    ("mohr-coulomb", "cohesion=500.0,friction=25.0,dilation=5.0,", true),
    ("drucker-prager", "cohesion=500.0,friction=25.0,dilation=5.0,", true),
    ("cam-clay", "slope=1.0,compression=0.1,swelling=0.02,preconsolidation=3e3,", true),
];

const ELASTIC: &str = "young=1e6,poisson=0.2";
/// m; two, three and four cells of 0.5 m.
const SIZE: [f64; 3] = [1.0, 1.5, 2.0];

/// A block between smooth walls whose top is pushed down (m) by `push` of X, Y, Z, where the axis i of the
/// problem lies along the axis `to[i].0` of the grid, turned round where `to[i].1`. Of two axes: the
/// section of unit thickness.
fn block(model: (&str, &str, bool), to: &[(usize, bool)], push: &str) -> Run {
    let axes = ["x", "y", "z"];
    let dimension = to.len();
    let mut size = vec![0.0; dimension];
    for (i, &(axis, _)) in to.iter().enumerate() {
        size[axis] = SIZE[i];
    }
    // X, Y, Z of the problem by the places on the grid.
    let place = |letter: char| match "XYZ".find(letter) {
        None => letter.to_string(),
        Some(i) => match (["X", "Y", "Z"][to[i].0], to[i].1) {
            (place, false) => place.to_string(),
            (place, true) => format!("({}-{place})", SIZE[i]),
        },
    };
    let push: String = push.chars().map(place).collect();
    let mut walls = String::new();
    for (i, &(axis, back)) in to.iter().enumerate() {
        for high in [false, true] {
            let mut ends = [vec![0.0; dimension], size.clone()];
            let at = if high != back { size[axis] } else { 0.0 };
            ends[0][axis] = at;
            ends[1][axis] = at;
            let held = if i == 1 && high {
                let sign = if back { "" } else { "-" };
                format!("displacement = {{ {} = \"{sign}({push})*s\" }}", axes[axis])
            } else {
                format!("fix = [\"{}\"]", axes[axis])
            };
            let [low, up] = ends;
            let place = format!("where = {{ box = {{ min = {low:?}, max = {up:?} }} }}");
            walls.push_str(&format!("[[boundary]]\n{place}\n{held}\n"));
        }
    }
    let zeros = vec![0.0; dimension];
    deck(
        model,
        &format!("size = {size:?}\nh = 0.5"),
        &format!("{{ box = {{ min = {zeros:?}, max = {size:?} }} }}"),
        &walls,
    )
}

/// Two steps of a body of a model.
fn deck(model: (&str, &str, bool), grid: &str, shape: &str, boundaries: &str) -> Run {
    let (name, parameters, _) = model;
    let initial = if name == "cam-clay" {
        "initial_stress = { xx = -2e3, yy = -2e3, zz = -2e3 }\n"
    } else {
        ""
    };
    Run::text(&format!(
        "[analysis]\ntype = \"quasi-static\"\nsteps = 2\ntolerance = 1e-12\nmax_iterations = 40\n\
         [method]\nbasis = \"gimp\"\ndomain_update = \"none\"\n\
         [grid]\ntype = \"lattice\"\n{grid}\n\
         [material]\nm = {{ model = \"{name}\", {parameters} {ELASTIC} }}\n\
         [[body]]\nname = \"block\"\nmaterial = \"m\"\npoints_per_cell = 2\n\
         shape = {shape}\n{initial}{boundaries}\
         [output]\nevery = 2\n\
         fields = [\"position_initial\", \"displacement\", \"stress\", \"plastic_strain\"]\n"
    ))
}

/// Row and column of a component of stress as files have them: xx, xy, xz, yy, yz, zz.
const STRESS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Place, displacement and stress of the points, along the axes of the problem.
fn states(points: &PointTable, to: &[(usize, bool)]) -> Vec<([f64; 3], [f64; 3], [f64; 6])> {
    let axis = |i: usize| to.get(i).map_or(i, |&(axis, _)| axis);
    let sign = |i: usize| if to.get(i).is_some_and(|&(_, back)| back) { -1.0 } else { 1.0 };
    let [start, moved, stress] =
        ["position_initial", "displacement", "stress"].map(|name| points.field(name));
    let rows = 0..points.id.len();
    let state = |p: usize| {
        let place = |i: usize| {
            let x = start[3 * p + axis(i)];
            if sign(i) < 0.0 { SIZE[i] - x } else { x }
        };
        let entry = |(i, j): (usize, usize)| {
            let pair = (axis(i).min(axis(j)), axis(i).max(axis(j)));
            let k = STRESS.iter().position(|&known| known == pair).expect("a component");
            sign(i) * sign(j) * stress[6 * p + k]
        };
        (
            [0, 1, 2].map(place),
            [0, 1, 2].map(|i| sign(i) * moved[3 * p + axis(i)]),
            STRESS.map(entry),
        )
    };
    rows.map(state).collect()
}

/// Every point of `turned` has a twin at its place of `plain` (in the section of it, if that is plane) with its
/// displacement and stress, to the share `most` of the largest.
#[track_caller]
fn assert_alike(
    what: &str,
    (turned, to): (&Results, &[(usize, bool)]),
    (plain, as_is): (&Results, &[(usize, bool)]),
    most: f64,
) {
    let (turned, plain) = (states(&turned.points(2), to), states(&plain.points(2), as_is));
    let largest =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |m: f64, v| m.max(v.abs()));
    let far = largest(&mut plain.iter().flat_map(|state| state.1));
    let strong = largest(&mut plain.iter().flat_map(|state| state.2));
    let dimension = as_is.len();
    let mut worst = [0.0f64; 2];
    for (place, moved, stress) in &turned {
        let near = |other: &&([f64; 3], [f64; 3], [f64; 6])| {
            (0..dimension).all(|i| (other.0[i] - place[i]).abs() < 1e-9)
        };
        let (_, exact, exact_stress) = plain.iter().find(near).expect("a twin");
        for i in 0..3 {
            worst[0] = worst[0].max((moved[i] - exact[i]).abs() / far);
        }
        for k in 0..6 {
            worst[1] = worst[1].max((stress[k] - exact_stress[k]).abs() / strong);
        }
    }
    assert!(worst[0] < most && worst[1] < most, "{what}: {worst:?}");
}

const AS_IS: [(usize, bool); 3] = [(0, false), (1, false), (2, false)];

/// By 90 degrees about z; about x, then y; and about z by 180 degrees.
const TURNS: [[(usize, bool); 3]; 3] = [
    [(1, false), (0, true), (2, false)],
    [(1, false), (2, false), (0, false)],
    [(0, true), (1, true), (2, false)],
];

#[test]
fn every_model_in_space_is_the_same_however_it_is_turned_on_the_grid() {
    let push = "0.01+0.03*X*X*Z";
    for model in MODELS {
        let plain = block(model, &AS_IS, push).results();
        let points = plain.points(2);
        let flows = points.field("plastic_strain").iter().any(|&strain| strain > 1e-4);
        assert_eq!(flows, model.2, "{}", model.0);
        let shear =
            |k| points.component("stress", k).into_iter().fold(0.0f64, |m, v| m.max(v.abs()));
        assert!(shear(2) > 0.0 && shear(1) > 100.0 && shear(4) > 100.0, "{}: space", model.0);
        for (turn, ranks) in TURNS.iter().zip([1, 2, 1]) {
            let turned = block(model, turn, push).ranks(ranks).results();
            assert_alike(model.0, (&turned, turn), (&plain, &AS_IS), 1e-10);
        }
    }
}

#[test]
fn every_model_between_walls_of_plane_strain_is_the_plane_problem() {
    let push = "0.01+0.03*X*X";
    for model in MODELS {
        let plane = block(model, &AS_IS[..2], push).results();
        for ranks in [1, 2] {
            let space = block(model, &AS_IS, push).ranks(ranks).results();
            assert_alike(model.0, (&space, &AS_IS), (&plane, &AS_IS[..2]), 1e-8);
        }
    }
}

/// Q of a rotation by 0.7 about (1, 2, 3): Rodrigues.
fn rotation() -> [[f64; 3]; 3] {
    let (sin, cos) = 0.7f64.sin_cos();
    let n = [1.0, 2.0, 3.0].map(|c: f64| c / 14f64.sqrt());
    let cross = [[0.0, -n[2], n[1]], [n[2], 0.0, -n[0]], [-n[1], n[0], 0.0]];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            f64::from(u8::from(i == j)) * cos + sin * cross[i][j] + (1.0 - cos) * n[i] * n[j]
        })
    })
}

/// Q A Q^T
fn turned(q: &[[f64; 3]; 3], a: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let entry = |i: usize, j: usize| -> f64 {
        (0..9).map(|k| q[i][k / 3] * a[k / 3][k % 3] * q[j][k % 3]).sum()
    };
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

/// Stress of a cell whose nodes all move by s H X.
fn stress(model: (&str, &str, bool), h: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let component = |i: usize| {
        let [a, b, c] = h[i].map(|entry| format!("({entry:e})"));
        format!("{} = \"s*({a}*X+{b}*Y+{c}*Z)\"", ["x", "y", "z"][i])
    };
    let [x, y, z] = [0, 1, 2].map(component);
    let all = "{ box = { min = [0, 0, 0], max = [1, 1, 1] } }";
    let boundary = format!("[[boundary]]\nwhere = {all}\ndisplacement = {{ {x}, {y}, {z} }}\n");
    let results = deck(model, "size = [1.0, 1.0, 1.0]\nh = 1.0", all, &boundary).results();
    let points = results.points(2);
    let flows = points.field("plastic_strain").iter().all(|&strain| strain > 1e-4);
    assert_eq!(flows, model.2, "{}", model.0);
    let mut found = [[0.0; 3]; 3];
    for (k, &(i, j)) in STRESS.iter().enumerate() {
        found[i][j] = points.field("stress")[k];
        found[j][i] = found[i][j];
    }
    found
}

#[test]
fn the_stress_of_a_turned_deformation_is_the_turned_stress() {
    let h = [[0.02, 0.03, 0.0], [-0.01, -0.05, 0.015], [0.02, 0.0, -0.01]];
    let q = rotation();
    for model in MODELS {
        let (exact, found) = (turned(&q, &stress(model, &h)), stress(model, &turned(&q, &h)));
        let size = exact.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        for (a, b) in found.iter().flatten().zip(exact.iter().flatten()) {
            assert!((a - b).abs() < 1e-10 * size, "{}: {found:?} {exact:?}", model.0);
        }
    }
}
