//! Smooth patches of the surfaces of forms, each the image of the unit interval (2D) or square (3D).

use std::f64::consts::{PI, TAU};

use crate::deck::shape::{Form, padded};

type Vector = [f64; 3];

/// A smooth patch of a surface in the frame of its form.
pub enum Patch {
    /// corner + s u + t v; in 2D v is the unit vector along z and t does not matter.
    Flat { corner: Vector, u: Vector, v: Vector },
    /// corner + s ((1 - t) u + t v) (3D).
    Triangle { corner: Vector, u: Vector, v: Vector },
    /// centre + a cos(w) e_x + b sin(w) e_y for w from `from` over `turn`, radians (2D).
    Arc { centre: Vector, semi: [f64; 2], from: f64, turn: f64 },
    /// centre + semi_i n_i, n on the unit sphere, `height` a range of n·pole (3D).
    Dome { centre: Vector, semi: Vector, frame: [Vector; 3], height: [f64; 2] },
    /// The tube of a radius around a segment (3D).
    Tube { from: Vector, frame: [Vector; 3], length: f64, radius: f64 },
}

impl Patch {
    /// Lengths along s and t, m: what a patch is cut by.
    pub fn extent(&self) -> [f64; 2] {
        match self {
            Patch::Flat { u, v, .. } => [norm(u), norm(v)],
            Patch::Triangle { u, v, .. } => [norm(u).max(norm(v)), norm(&minus(v, u))],
            Patch::Arc { semi, turn, .. } => [semi[0].max(semi[1]) * turn.abs(), 1.0],
            Patch::Dome { semi, height, .. } => {
                let largest = semi.iter().copied().fold(0.0, f64::max);
                [TAU * largest, largest * (height[1].acos() - height[0].acos()).abs()]
            }
            Patch::Tube { length, radius, .. } => [TAU * radius, *length],
        }
    }

    /// Whether it is flat, so that the mean of places on it lies on it.
    pub fn is_flat(&self) -> bool {
        matches!(self, Patch::Flat { .. } | Patch::Triangle { .. })
    }

    /// Numbers of cuts along s and t are multiples of these: patches that are round are cut at their
    /// quadrants.
    pub fn folds(&self) -> [usize; 2] {
        match self {
            Patch::Flat { .. } | Patch::Triangle { .. } => [1, 1],
            Patch::Arc { turn, .. } => [((4.0 * turn.abs() / TAU).round() as usize).max(1), 1],
            Patch::Dome { .. } => [4, 2],
            Patch::Tube { .. } => [4, 1],
        }
    }

    /// Place, m, and area vector per ds dt, m2 (2D: per ds, m), of either orientation.
    pub fn at(&self, s: f64, t: f64) -> (Vector, Vector) {
        match self {
            Patch::Flat { corner, u, v } => {
                (std::array::from_fn(|i| corner[i] + s * u[i] + t * v[i]), cross(u, v))
            }
            Patch::Triangle { corner, u, v } => {
                let place = std::array::from_fn(|i| corner[i] + s * ((1.0 - t) * u[i] + t * v[i]));
                (place, cross(u, v).map(|a| s * a))
            }
            Patch::Arc { centre, semi, from, turn } => {
                let (sin, cos) = (from + s * turn).sin_cos();
                let place = [centre[0] + semi[0] * cos, centre[1] + semi[1] * sin, 0.0];
                (place, [semi[1] * cos * turn, semi[0] * sin * turn, 0.0])
            }
            Patch::Dome { centre, semi, frame, height } => {
                // Equal heights of a sphere have equal areas.
                let z = height[0] + t * (height[1] - height[0]);
                let (sin, cos) = (TAU * s).sin_cos();
                let r = (1.0 - z * z).max(0.0).sqrt();
                let n: Vector = std::array::from_fn(|i| {
                    r * cos * frame[0][i] + r * sin * frame[1][i] + z * frame[2][i]
                });
                let share = TAU * (height[1] - height[0]);
                let volume: f64 = semi.iter().product();
                let place = std::array::from_fn(|i| centre[i] + semi[i] * n[i]);
                (place, std::array::from_fn(|i| share * volume / semi[i] * n[i]))
            }
            Patch::Tube { from, frame, length, radius } => {
                let (sin, cos) = (TAU * s).sin_cos();
                let n: Vector = std::array::from_fn(|i| cos * frame[0][i] + sin * frame[1][i]);
                let place =
                    std::array::from_fn(|i| from[i] + radius * n[i] + t * length * frame[2][i]);
                (place, n.map(|n| TAU * radius * length * n))
            }
        }
    }
}

/// The surface of a form that is no set of shapes; none of a condition.
pub fn of_form(form: &Form, dimension: usize) -> Vec<Patch> {
    match form {
        Form::Box { min, max } => of_box(&padded(min), &padded(max), dimension),
        Form::Ball { centre, radius } => round(&padded(centre), [*radius; 3], dimension),
        Form::Ellipsoid { centre, semi_axes } => {
            round(&padded(centre), padded(semi_axes), dimension)
        }
        Form::Capsule { from, to, radius } => {
            of_capsule(&padded(from), &padded(to), *radius, dimension)
        }
        Form::Polygon { vertices } => {
            let next = vertices.iter().cycle().skip(1);
            vertices
                .iter()
                .zip(next)
                .map(|(a, b)| segment([a[0], a[1], 0.0], [b[0], b[1], 0.0]))
                .collect()
        }
        Form::Solid(solid) => {
            let of_triangle = |[p, q, r]: &[Vector; 3]| Patch::Triangle {
                corner: *p,
                u: minus(q, p),
                v: minus(r, p),
            };
            solid.triangles.iter().map(of_triangle).collect()
        }
        Form::Where(_) | Form::Union(_) | Form::Intersection(_) | Form::Difference(_) => Vec::new(),
    }
}

fn segment(from: Vector, to: Vector) -> Patch {
    Patch::Flat { corner: from, u: minus(&to, &from), v: [0.0, 0.0, 1.0] }
}

fn of_box(min: &Vector, max: &Vector, dimension: usize) -> Vec<Patch> {
    if dimension == 2 {
        let corners = [[min[0], min[1]], [max[0], min[1]], [max[0], max[1]], [min[0], max[1]]];
        let at = |k: usize| [corners[k % 4][0], corners[k % 4][1], 0.0];
        return (0..4).map(|k| segment(at(k), at(k + 1))).collect();
    }
    let along = |axis: usize| {
        let mut u = [0.0; 3];
        u[axis] = max[axis] - min[axis];
        u
    };
    let mut patches = Vec::new();
    for axis in 0..3 {
        for end in [min, max] {
            let mut corner = *min;
            corner[axis] = end[axis];
            patches.push(Patch::Flat {
                corner,
                u: along((axis + 1) % 3),
                v: along((axis + 2) % 3),
            });
        }
    }
    patches
}

fn round(centre: &Vector, semi: Vector, dimension: usize) -> Vec<Patch> {
    if dimension == 2 {
        let semi = [semi[0], semi[1]];
        return vec![Patch::Arc { centre: *centre, semi, from: 0.0, turn: TAU }];
    }
    let height = [-1.0, 1.0];
    vec![Patch::Dome { centre: *centre, semi, frame: AXES, height }]
}

const AXES: [Vector; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn of_capsule(from: &Vector, to: &Vector, radius: f64, dimension: usize) -> Vec<Patch> {
    let axis = minus(to, from);
    let length = norm(&axis);
    if length == 0.0 {
        return round(from, [radius; 3], dimension);
    }
    let axis = axis.map(|a| a / length);
    if dimension == 2 {
        let side = [-axis[1], axis[0], 0.0];
        let beside = |x: &Vector, sign: f64| -> Vector {
            std::array::from_fn(|i| x[i] + sign * radius * side[i])
        };
        let angle = axis[1].atan2(axis[0]);
        let semi = [radius; 2];
        return vec![
            segment(beside(from, -1.0), beside(to, -1.0)),
            Patch::Arc { centre: *to, semi, from: angle - 0.5 * PI, turn: PI },
            segment(beside(to, 1.0), beside(from, 1.0)),
            Patch::Arc { centre: *from, semi, from: angle + 0.5 * PI, turn: PI },
        ];
    }
    // Two directions across the axis.
    let least = (0..3).min_by(|&a, &b| axis[a].abs().total_cmp(&axis[b].abs())).unwrap_or(0);
    let first = cross(&axis, &AXES[least]);
    let size = norm(&first);
    let first = first.map(|f| f / size);
    let frame = [first, cross(&axis, &first), axis];
    let semi = [radius; 3];
    vec![
        Patch::Tube { from: *from, frame, length, radius },
        Patch::Dome { centre: *to, semi, frame, height: [0.0, 1.0] },
        Patch::Dome { centre: *from, semi, frame, height: [-1.0, 0.0] },
    ]
}

fn norm(v: &Vector) -> f64 {
    super::norm(v)
}

fn minus(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|i| a[i] - b[i])
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
