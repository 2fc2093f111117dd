//! Where a shape's boundary lies: for lines that cross it, and for boxes that it may cut.
//!
//! Between two neighbouring crossings a line is wholly inside or wholly outside, whatever unions
//! and differences the shape is made of (S. D. Roth, "Ray casting for modeling solids", Computer
//! Graphics and Image Processing 18 (1982) 109-144).

use super::expression::Scope;
use super::shape::{Form, Shape, padded};

/// How a box lies to a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// All of it is inside.
    Inside,
    /// All of it is outside.
    Outside,
    /// The boundary may cut it.
    Cut,
}

/// Samples along a line (and along each axis of a box) in which a formula may change its sign.
const SAMPLES: usize = 16;

impl Shape {
    /// Appends every t at which the line `from + t (to - from)` may cross the boundary; some lie
    /// beyond 0 and 1, and some cross no boundary of the whole.
    pub fn crossings(&self, from: [f64; 3], to: [f64; 3], out: &mut Vec<f64>) {
        let (a, b) = (self.localised(from), self.localised(to));
        let d: [f64; 3] = std::array::from_fn(|i| b[i] - a[i]);
        match &self.form {
            Form::Box { min, max } => {
                for (axis, ends) in min.iter().zip(max).enumerate() {
                    out.extend([ends.0, ends.1].map(|end| (end - a[axis]) / d[axis]));
                }
            }
            Form::Ball { centre, radius } => sphere(&a, &d, centre, |_| *radius, out),
            Form::Ellipsoid { centre, semi_axes } => {
                sphere(&a, &d, centre, |axis| semi_axes[axis], out);
            }
            Form::Capsule { from, to, radius } => {
                sphere(&a, &d, from, |_| *radius, out);
                sphere(&a, &d, to, |_| *radius, out);
                cylinder(&a, &d, from, to, *radius, out);
            }
            Form::Polygon { vertices } => {
                let Some(mut p) = vertices.last() else { return };
                for q in vertices {
                    // On the edge's line where (q - p) x (a + t d - p) = 0.
                    let edge = [q[0] - p[0], q[1] - p[1]];
                    let offset = edge[0] * (a[1] - p[1]) - edge[1] * (a[0] - p[0]);
                    let slope = edge[0] * d[1] - edge[1] * d[0];
                    out.push(-offset / slope);
                    p = q;
                }
            }
            Form::Solid(solid) => solid.crossings(&a, &d, out),
            Form::Where(condition) => {
                let holds = |t: f64| {
                    let x = std::array::from_fn(|i| a[i] + t * d[i]);
                    let scope = Scope { initial: x, current: x, ..Scope::default() };
                    let value = condition.value(&scope);
                    value != 0.0 && !value.is_nan()
                };
                let at = |k: usize| k as f64 / SAMPLES as f64;
                let mut next = holds(at(0));
                for k in 0..SAMPLES {
                    let (mut low, mut high) = (at(k), at(k + 1));
                    let first = next;
                    next = holds(high);
                    if first != next {
                        for _ in 0..40 {
                            let middle = 0.5 * (low + high);
                            if holds(middle) == first { low = middle } else { high = middle }
                        }
                        out.push(0.5 * (low + high));
                    }
                }
            }
            Form::Union(parts) | Form::Intersection(parts) | Form::Difference(parts) => {
                parts.iter().for_each(|part| part.crossings(a, b, out));
            }
        }
    }

    /// Appends places at which the section across an axis may begin, end or have a kink: corners,
    /// and the ends of round forms.
    pub fn corners(&self, out: &mut Vec<[f64; 3]>) {
        let first = out.len();
        let mut around = |centre: &[f64], reach: &dyn Fn(usize) -> f64| {
            for axis in 0..centre.len() {
                for sign in [-1.0, 1.0] {
                    let mut end = padded(centre);
                    end[axis] += sign * reach(axis);
                    out.push(end);
                }
            }
        };
        match &self.form {
            Form::Box { min, max } => {
                for corner in 0..1_usize << min.len() {
                    let of = |axis: usize| if corner >> axis & 1 == 0 { min } else { max };
                    let corner: Vec<f64> = (0..min.len()).map(|axis| of(axis)[axis]).collect();
                    out.push(padded(&corner));
                }
            }
            Form::Ball { centre, radius } => around(centre, &|_| *radius),
            Form::Ellipsoid { centre, semi_axes } => around(centre, &|axis| semi_axes[axis]),
            Form::Capsule { from, to, radius } => {
                around(from, &|_| *radius);
                around(to, &|_| *radius);
            }
            Form::Polygon { vertices } => out.extend(vertices.iter().map(|v| padded(v))),
            Form::Solid(solid) => {
                // The corners of its box stand for them: a fine surface has too many.
                let (low, high) = solid.bounds();
                out.extend([low, high]);
            }
            Form::Where(_) => {}
            Form::Union(parts) | Form::Intersection(parts) | Form::Difference(parts) => {
                parts.iter().for_each(|part| part.corners(out));
            }
        }
        for corner in &mut out[first..] {
            *corner = padded(&self.to_global(corner));
        }
    }

    /// How the box of these half lengths around `centre` lies. `Cut` is always possible; of a
    /// formula the two others rest on samples.
    pub fn side(&self, centre: [f64; 3], half: [f64; 3]) -> Side {
        let x = self.localised(centre);
        let radius = half.iter().map(|l| l * l).sum::<f64>().sqrt();
        // A turned box is inside the ball around it.
        let half = if self.placement.rotate.is_some() { [radius; 3] } else { half };
        // By a distance to the boundary, negative inside, that is never too large.
        let by = |distance: f64, radius: f64| match distance {
            d if d <= -radius => Side::Inside,
            d if d >= radius => Side::Outside,
            _ => Side::Cut,
        };
        match &self.form {
            Form::Box { min, max } => {
                let axes = || min.iter().zip(max).enumerate();
                if axes().all(|(i, (a, b))| *a <= x[i] - half[i] && x[i] + half[i] <= *b) {
                    Side::Inside
                } else if axes().any(|(i, (a, b))| x[i] + half[i] <= *a || *b <= x[i] - half[i]) {
                    Side::Outside
                } else {
                    Side::Cut
                }
            }
            Form::Ball { centre, radius: own } => by(norm(&x, centre, |_| 1.0) - own, radius),
            Form::Ellipsoid { centre, semi_axes } => {
                let shortest = semi_axes.iter().copied().fold(f64::INFINITY, f64::min);
                by(norm(&x, centre, |axis| semi_axes[axis]) - 1.0, radius / shortest)
            }
            Form::Capsule { from, to, radius: own } => {
                by(super::shape::distance_to_segment_squared(&x, from, to).sqrt() - own, radius)
            }
            Form::Polygon { vertices } => {
                let mut nearest = f64::INFINITY;
                let mut p = vertices.last().copied().unwrap_or_default();
                for q in vertices {
                    let y = [x[0], x[1], 0.0];
                    let squared = super::shape::distance_to_segment_squared(&y, &p, q);
                    nearest = nearest.min(squared);
                    p = *q;
                }
                let sign = if self.form_contains(x) { -1.0 } else { 1.0 };
                by(sign * nearest.sqrt(), radius)
            }
            Form::Solid(solid) => solid.side(&x, &half),
            Form::Where(_) => {
                let dimension = if half[2] > 0.0 { 3 } else { 2 };
                let across = SAMPLES / 4 + 1;
                let inside = |sample: usize| {
                    let place = |axis: usize| {
                        let k = sample / across.pow(axis as u32) % across;
                        x[axis] + half[axis] * (2.0 * k as f64 / (across - 1) as f64 - 1.0)
                    };
                    self.form_contains(std::array::from_fn(place))
                };
                let count = across.pow(dimension);
                match (0..count).filter(|&sample| inside(sample)).count() {
                    0 => Side::Outside,
                    all if all == count => Side::Inside,
                    _ => Side::Cut,
                }
            }
            Form::Union(parts) => {
                let sides = || parts.iter().map(|part| part.side(x, half));
                any_or_all(sides(), Side::Inside, Side::Outside)
            }
            Form::Intersection(parts) => {
                let sides = || parts.iter().map(|part| part.side(x, half));
                any_or_all(sides(), Side::Outside, Side::Inside)
            }
            Form::Difference(parts) => {
                let sides = parts.iter().enumerate().map(|(i, part)| match part.side(x, half) {
                    side if i == 0 => side,
                    Side::Inside => Side::Outside,
                    Side::Outside => Side::Inside,
                    Side::Cut => Side::Cut,
                });
                any_or_all(sides, Side::Outside, Side::Inside)
            }
        }
    }

    fn localised(&self, x: [f64; 3]) -> [f64; 3] {
        if self.placement.is_identity() { x } else { padded(&self.to_local(&x)) }
    }

    fn form_contains(&self, local: [f64; 3]) -> bool {
        self.contains_local(&local)
    }
}

/// `one` if any of the sides is that, `all` if all are that, otherwise cut.
fn any_or_all(sides: impl Iterator<Item = Side>, one: Side, all: Side) -> Side {
    let mut result = all;
    for side in sides {
        if side == one {
            return one;
        }
        if side != all {
            result = Side::Cut;
        }
    }
    result
}

/// |(x - centre) / scale|, over the components of `centre`.
fn norm(x: &[f64; 3], centre: &[f64], scale: impl Fn(usize) -> f64) -> f64 {
    let parts = centre.iter().enumerate().map(|(axis, c)| (x[axis] - c) / scale(axis));
    parts.map(|u| u * u).sum::<f64>().sqrt()
}

/// |(a + t d - centre) / scale| = 1
fn sphere(
    a: &[f64; 3],
    d: &[f64; 3],
    centre: &[f64],
    scale: impl Fn(usize) -> f64,
    out: &mut Vec<f64>,
) {
    let (mut dd, mut ad, mut aa) = (0.0, 0.0, -1.0);
    for (axis, c) in centre.iter().enumerate() {
        let (u, v) = ((a[axis] - c) / scale(axis), d[axis] / scale(axis));
        dd += v * v;
        ad += u * v;
        aa += u * u;
    }
    roots(dd, ad, aa, out);
}

/// Distance of a + t d from the line through `from` and `to` = radius, and the planes at its ends.
fn cylinder(a: &[f64; 3], d: &[f64; 3], from: &[f64], to: &[f64], radius: f64, out: &mut Vec<f64>) {
    let axis: Vec<f64> = from.iter().zip(to).map(|(p, q)| q - p).collect();
    let length = axis.iter().map(|k| k * k).sum::<f64>();
    if length == 0.0 {
        return;
    }
    let offset: Vec<f64> = from.iter().enumerate().map(|(i, p)| a[i] - p).collect();
    let (mut along_a, mut along_d) = (0.0, 0.0);
    for (i, k) in axis.iter().enumerate() {
        along_a += offset[i] * k / length;
        along_d += d[i] * k / length;
    }
    let (mut dd, mut ad, mut aa) = (0.0, 0.0, -radius * radius);
    for (i, k) in axis.iter().enumerate() {
        let (u, v) = (offset[i] - along_a * k, d[i] - along_d * k);
        dd += v * v;
        ad += u * v;
        aa += u * u;
    }
    roots(dd, ad, aa, out);
    out.extend([-along_a / along_d, (1.0 - along_a) / along_d]);
}

/// dd t^2 + 2 ad t + aa = 0
fn roots(dd: f64, ad: f64, aa: f64, out: &mut Vec<f64>) {
    let discriminant = ad * ad - dd * aa;
    if discriminant >= 0.0 {
        let root = discriminant.sqrt();
        out.extend([(-ad - root) / dd, (-ad + root) / dd]);
    }
}
