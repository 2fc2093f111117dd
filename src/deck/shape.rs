//! Shapes of bodies: primitives, and unions, differences and intersections of them.
//!
//! | deck key | form | test |
//! |---|---|---|
//! | `box` | [`Form::Box`] | min <= x <= max |
//! | `disc`, `ball` | [`Form::Ball`] | distance to the centre <= radius |
//! | `ellipse`, `ellipsoid` | [`Form::Ellipsoid`] | sum ((x - c) / a)^2 <= 1 |
//! | `capsule` | [`Form::Capsule`] | distance to the segment <= radius |
//! | `polygon` | [`Form::Polygon`] | even-odd rule, edges belong to it (2D) |
//! | `stl`, `terrain` | [`Form::Solid`] | winding number of its triangles (3D) |
//! | `where` | [`Form::Where`] | the formula is not zero |
//! | `union`, `intersection`, `difference` | the same | of the listed shapes; first minus the rest |

use std::path::PathBuf;
use std::sync::Arc;

use super::expression::{Expression, Scope};
use super::solid::Solid;

/// A region of space: a form in its own frame, and where that frame lies.
/// `x` slices have the problem's dimension (2 or 3).
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// The region in its own frame.
    pub form: Form,
    /// Where that frame lies.
    pub placement: Placement,
}

/// The region in the shape's local frame, m.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    Box { min: Vec<f64>, max: Vec<f64> },
    Ball { centre: Vec<f64>, radius: f64 },
    Ellipsoid { centre: Vec<f64>, semi_axes: Vec<f64> },
    Capsule { from: Vec<f64>, to: Vec<f64>, radius: f64 },
    Polygon { vertices: Vec<[f64; 2]> },
    Solid(Arc<Solid>),
    Where(Expression),
    Union(Vec<Shape>),
    Intersection(Vec<Shape>),
    Difference(Vec<Shape>),
}

/// Local to global: rotate about a point, then translate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Placement {
    /// m; empty: none.
    pub translate: Vec<f64>,
    pub rotate: Option<Turn>,
}

/// Rotation by `degrees` about the axis through `about` (right-handed; 2D: counter-clockwise).
#[derive(Debug, Clone, PartialEq)]
pub struct Turn {
    pub degrees: f64,
    /// m
    pub about: Vec<f64>,
    /// Direction, any length; z in 2D.
    pub axis: [f64; 3],
}

impl Turn {
    /// Rotates `x - about` by `sign * degrees` (Rodrigues' formula).
    fn apply(&self, x: [f64; 3], sign: f64) -> [f64; 3] {
        let about = padded(&self.about);
        let v: [f64; 3] = std::array::from_fn(|i| x[i] - about[i]);
        let length = self.axis.iter().map(|a| a * a).sum::<f64>().sqrt();
        let k = self.axis.map(|a| a / length);
        let (sin, cos) = sine_cosine(sign * self.degrees);
        let cross =
            [k[1] * v[2] - k[2] * v[1], k[2] * v[0] - k[0] * v[2], k[0] * v[1] - k[1] * v[0]];
        let along = (k[0] * v[0] + k[1] * v[1] + k[2] * v[2]) * (1.0 - cos);
        std::array::from_fn(|i| about[i] + v[i] * cos + cross[i] * sin + k[i] * along)
    }
}

/// Exact at multiples of a right angle, so that a body turned by 90 degrees keeps its points.
fn sine_cosine(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        _ => degrees.to_radians().sin_cos(),
    }
}

impl Placement {
    pub fn is_identity(&self) -> bool {
        self.translate.is_empty() && self.rotate.is_none()
    }

    /// Local to global position, padded with zeros in 2D.
    pub fn globalise(&self, x: [f64; 3]) -> [f64; 3] {
        let mut x = self.rotate.as_ref().map_or(x, |turn| turn.apply(x, 1.0));
        for (value, shift) in x.iter_mut().zip(&self.translate) {
            *value += shift;
        }
        x
    }

    /// Global to local position.
    pub fn localise(&self, mut x: [f64; 3]) -> [f64; 3] {
        for (value, shift) in x.iter_mut().zip(&self.translate) {
            *value -= shift;
        }
        self.rotate.as_ref().map_or(x, |turn| turn.apply(x, -1.0))
    }
}

/// Lower and upper corner, m.
pub type Bounds = (Vec<f64>, Vec<f64>);

impl Shape {
    /// A form whose local frame is the global one.
    pub fn new(form: Form) -> Self {
        Shape { form, placement: Placement::default() }
    }

    /// Whether a condition on the place (`where`) is among its forms: no surface is known of that.
    pub fn has_condition(&self) -> bool {
        match &self.form {
            Form::Where(_) => true,
            Form::Union(parts) | Form::Intersection(parts) | Form::Difference(parts) => {
                parts.iter().any(Shape::has_condition)
            }
            _ => false,
        }
    }

    /// Appends the solids of triangles that it is made of.
    pub fn solids<'a>(&'a self, found: &mut Vec<&'a Solid>) {
        match &self.form {
            Form::Solid(solid) => found.push(solid),
            Form::Union(parts) | Form::Intersection(parts) | Form::Difference(parts) => {
                parts.iter().for_each(|part| part.solids(found));
            }
            _ => {}
        }
    }

    /// Renames the files that its forms came from.
    pub fn rename_files(&mut self, rename: &impl Fn(&mut PathBuf)) {
        match &mut self.form {
            Form::Solid(solid) => {
                let mut path = solid.path.clone();
                rename(&mut path);
                if path != solid.path {
                    *solid = Arc::new(solid.renamed(path));
                }
            }
            Form::Union(parts) | Form::Intersection(parts) | Form::Difference(parts) => {
                parts.iter_mut().for_each(|part| part.rename_files(rename));
            }
            _ => {}
        }
    }

    /// True inside or on the boundary.
    pub fn contains(&self, x: &[f64]) -> bool {
        self.contains_padded(padded(x))
    }

    /// As [`Shape::contains`], for a position in the local frame.
    pub fn contains_local(&self, x: &[f64]) -> bool {
        self.form.contains(padded(x))
    }

    /// Smallest axis-aligned box known to hold it (tight for primitives that are not rotated);
    /// `None` if unbounded (`where` alone).
    pub fn bounds(&self) -> Option<Bounds> {
        let (low, high) = self.form.bounds()?;
        if self.placement.is_identity() {
            return Some((low, high));
        }
        let dimension = low.len();
        let mut bounds = (vec![f64::INFINITY; dimension], vec![f64::NEG_INFINITY; dimension]);
        for corner in 0..1 << dimension {
            let local: Vec<f64> = (0..dimension)
                .map(|a| if corner >> a & 1 == 0 { low[a] } else { high[a] })
                .collect();
            let global = self.placement.globalise(padded(&local));
            let corner = global[..dimension].to_vec();
            bounds = joined(bounds, &(corner.clone(), corner));
        }
        Some(bounds)
    }

    /// Bounds in the local frame: where a lattice of points is laid out.
    pub fn local_bounds(&self) -> Option<Bounds> {
        self.form.bounds()
    }

    /// Local to global position, m.
    pub fn to_global(&self, x: &[f64]) -> Vec<f64> {
        self.placement.globalise(padded(x))[..x.len()].to_vec()
    }

    /// Global to local position, m.
    pub fn to_local(&self, x: &[f64]) -> Vec<f64> {
        self.placement.localise(padded(x))[..x.len()].to_vec()
    }

    /// As [`Shape::contains`], for a position padded with zeros in 2D.
    pub fn contains_padded(&self, x: [f64; 3]) -> bool {
        let local = if self.placement.is_identity() { x } else { self.placement.localise(x) };
        self.form.contains(local)
    }
}

impl Form {
    /// As [`Shape::contains_padded`], in the form's own frame.
    pub fn contains(&self, x: [f64; 3]) -> bool {
        match self {
            Form::Box { min, max } => {
                min.iter().zip(max).zip(&x).all(|((low, high), x)| low <= x && x <= high)
            }
            Form::Ball { centre, radius } => {
                centre.iter().zip(&x).map(|(c, x)| (x - c).powi(2)).sum::<f64>() <= radius * radius
            }
            Form::Ellipsoid { centre, semi_axes } => {
                let scaled = centre.iter().zip(semi_axes).zip(&x).map(|((c, a), x)| (x - c) / a);
                scaled.map(|u| u * u).sum::<f64>() <= 1.0
            }
            Form::Capsule { from, to, radius } => {
                distance_to_segment_squared(&x, from, to) <= radius * radius
            }
            Form::Polygon { vertices } => polygon_contains(vertices, x[0], x[1]),
            Form::Solid(solid) => solid.contains(&x),
            Form::Where(condition) => {
                let value = condition.value(&Scope { initial: x, current: x, ..Scope::default() });
                value != 0.0 && !value.is_nan()
            }
            Form::Union(shapes) => shapes.iter().any(|shape| shape.contains_padded(x)),
            Form::Intersection(shapes) => shapes.iter().all(|shape| shape.contains_padded(x)),
            Form::Difference(shapes) => match shapes.split_first() {
                Some((first, rest)) => {
                    first.contains_padded(x) && !rest.iter().any(|shape| shape.contains_padded(x))
                }
                None => false,
            },
        }
    }

    fn bounds(&self) -> Option<Bounds> {
        let around = |centre: &[f64], reach: &dyn Fn(usize) -> f64| {
            let low = centre.iter().enumerate().map(|(a, c)| c - reach(a)).collect();
            let high = centre.iter().enumerate().map(|(a, c)| c + reach(a)).collect();
            (low, high)
        };
        match self {
            Form::Box { min, max } => Some((min.clone(), max.clone())),
            Form::Ball { centre, radius } => Some(around(centre, &|_| *radius)),
            Form::Ellipsoid { centre, semi_axes } => Some(around(centre, &|a| semi_axes[a])),
            Form::Capsule { from, to, radius } => {
                Some(joined(around(from, &|_| *radius), &around(to, &|_| *radius)))
            }
            Form::Polygon { vertices } => vertices
                .iter()
                .map(|v| (v.to_vec(), v.to_vec()))
                .reduce(|bounds, vertex| joined(bounds, &vertex)),
            Form::Solid(solid) => {
                let (low, high) = solid.bounds();
                Some((low.to_vec(), high.to_vec()))
            }
            Form::Where(_) => None,
            Form::Union(shapes) => {
                let all: Option<Vec<Bounds>> = shapes.iter().map(Shape::bounds).collect();
                all?.into_iter().reduce(|bounds, next| joined(bounds, &next))
            }
            Form::Intersection(shapes) => {
                shapes.iter().filter_map(Shape::bounds).reduce(|mut bounds, next| {
                    for a in 0..bounds.0.len() {
                        bounds.0[a] = bounds.0[a].max(next.0[a]);
                        bounds.1[a] = bounds.1[a].min(next.1[a]);
                    }
                    bounds
                })
            }
            Form::Difference(shapes) => shapes.first().and_then(Shape::bounds),
        }
    }
}

pub fn padded(x: &[f64]) -> [f64; 3] {
    std::array::from_fn(|axis| x.get(axis).copied().unwrap_or(0.0))
}

fn joined(mut bounds: Bounds, other: &Bounds) -> Bounds {
    for a in 0..bounds.0.len() {
        bounds.0[a] = bounds.0[a].min(other.0[a]);
        bounds.1[a] = bounds.1[a].max(other.1[a]);
    }
    bounds
}

/// Components beyond those of `from` are ignored.
pub(super) fn distance_to_segment_squared(x: &[f64; 3], from: &[f64], to: &[f64]) -> f64 {
    let mut along = 0.0;
    let mut length = 0.0;
    for ((x, a), b) in x.iter().zip(from).zip(to) {
        along += (x - a) * (b - a);
        length += (b - a) * (b - a);
    }
    let t = if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 };
    x.iter().zip(from).zip(to).map(|((x, a), b)| (x - (a + t * (b - a))).powi(2)).sum()
}

/// Even-odd rule; a point on an edge is inside.
fn polygon_contains(vertices: &[[f64; 2]], x: f64, y: f64) -> bool {
    let mut inside = false;
    let Some(mut a) = vertices.last() else { return false };
    for b in vertices {
        let cross = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
        let within = |p: f64, q: f64, v: f64| p.min(q) <= v && v <= p.max(q);
        if cross == 0.0 && within(a[0], b[0], x) && within(a[1], b[1], y) {
            return true;
        }
        // The edge crosses the ray to the right: its upward and downward sense decide the side.
        if (a[1] > y) != (b[1] > y) && ((cross > 0.0) == (b[1] > a[1])) {
            inside = !inside;
        }
        a = b;
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(shape: &Shape, n: usize) -> f64 {
        let (low, high) = shape.bounds().expect("bounded");
        let step = [(high[0] - low[0]) / n as f64, (high[1] - low[1]) / n as f64];
        let centre = |i: usize, a: usize| low[a] + (i as f64 + 0.5) * step[a];
        let inside = (0..n * n).filter(|k| shape.contains(&[centre(k % n, 0), centre(k / n, 1)]));
        inside.count() as f64 * step[0] * step[1]
    }

    #[test]
    fn areas_are_those_of_the_formulas() {
        let pi = std::f64::consts::PI;
        let disc = Shape::new(Form::Ball { centre: vec![1.0, 2.0], radius: 0.5 });
        let ellipse =
            Shape::new(Form::Ellipsoid { centre: vec![0.0, 1.0], semi_axes: vec![2.0, 0.5] });
        let capsule =
            Shape::new(Form::Capsule { from: vec![0.0, 0.0], to: vec![3.0, 4.0], radius: 1.0 });
        // An L: non-convex.
        let corner = Shape::new(Form::Polygon {
            vertices: vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]],
        });
        let ring = Shape::new(Form::Difference(vec![
            disc.clone(),
            Shape::new(Form::Ball { centre: vec![1.0, 2.0], radius: 0.25 }),
        ]));
        for (shape, exact) in [
            (disc, pi / 4.0),
            (ellipse, pi),
            (capsule, pi + 10.0),
            (corner, 4.0),
            (ring, pi * 3.0 / 16.0),
        ] {
            let found = area(&shape, 800);
            assert!((found / exact - 1.0).abs() < 2e-3, "{shape:?}: {found} {exact}");
        }
    }

    #[test]
    fn boundaries_belong_to_the_shape() {
        let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let polygon = Shape::new(Form::Polygon { vertices: square });
        let cube = Shape::new(Form::Box { min: vec![0.0; 3], max: vec![1.0; 3] });
        for x in [[0.0, 0.0], [1.0, 1.0], [0.5, 0.0], [1.0, 0.3], [0.0, 0.9], [0.5, 0.5]] {
            assert!(polygon.contains(&x), "{x:?}");
            assert!(cube.contains(&[x[0], x[1], 1.0]));
        }
        assert!(!polygon.contains(&[1.0 + 1e-12, 0.5]) && !polygon.contains(&[0.5, -1e-12]));
        assert!(!cube.contains(&[0.5, 0.5, 1.0 + 1e-12]));
    }

    #[test]
    fn placement_moves_points_bounds_and_back() {
        let mut bar = Shape::new(Form::Box { min: vec![0.0, 0.0], max: vec![4.0, 1.0] });
        bar.placement = Placement {
            translate: vec![10.0, 0.0],
            rotate: Some(Turn { degrees: 90.0, about: vec![0.0, 0.0], axis: [0.0, 0.0, 1.0] }),
        };
        assert!(bar.contains(&[9.5, 3.5]) && !bar.contains(&[10.5, 0.5]));
        assert_eq!(bar.bounds(), Some((vec![9.0, 0.0], vec![10.0, 4.0])));
        assert_eq!(bar.to_global(&[4.0, 1.0]), vec![9.0, 4.0]);
        assert_eq!(bar.to_local(&[9.0, 4.0]), vec![4.0, 1.0]);
        let turned = Shape {
            placement: Placement {
                translate: vec![0.1, 0.2, 0.3],
                rotate: Some(Turn {
                    degrees: 33.0,
                    about: vec![1.0, 0.0, 2.0],
                    axis: [1.0, 2.0, -1.0],
                }),
            },
            ..Shape::new(Form::Box { min: vec![0.0; 3], max: vec![1.0; 3] })
        };
        let x = [0.3, 0.8, 0.1];
        let back = turned.to_local(&turned.to_global(&x));
        assert!(x.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-14));
        assert!(turned.contains(&turned.to_global(&x)));
    }

    #[test]
    fn where_alone_has_no_bounds_and_intersection_gives_them() {
        let half = Shape::new(Form::Where(Expression::parse("x < y").expect("valid")));
        assert_eq!(half.bounds(), None);
        let unit = Shape::new(Form::Box { min: vec![0.0; 2], max: vec![1.0; 2] });
        let both = Shape::new(Form::Intersection(vec![unit.clone(), half.clone()]));
        assert_eq!(both.bounds(), unit.bounds());
        assert!((area(&both, 200) - 0.5).abs() < 5e-3);
        assert_eq!(Shape::new(Form::Union(vec![unit, half])).bounds(), None);
    }
}
