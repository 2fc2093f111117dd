//! How much of a box a shape covers: volume, centroid and extent of the covered part.
//!
//! Lines along the last axis meet the shape in exact intervals; over the other axes these are
//! integrated by Gauss's rule on panels that end at the shape's corners and are halved until the
//! volume no longer changes. Polygons come out exact, round shapes to the tolerance.

use std::f64::consts::TAU;

use crate::deck::shape::Form;
use crate::deck::{Shape, Side};

/// Integrals over the covered part of a box, in coordinates from -1 to 1 along each axis, as
/// shares of the box's volume: of 1, of u_a and of u_a^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments<const D: usize> {
    pub volume: f64,
    pub first: [f64; D],
    pub second: [f64; D],
}

impl<const D: usize> Moments<D> {
    pub const NONE: Self = Moments { volume: 0.0, first: [0.0; D], second: [0.0; D] };
    pub const FULL: Self = Moments { volume: 1.0, first: [0.0; D], second: [1.0 / 3.0; D] };

    /// Adds those of another box of that size, whose centre lies `2 by` away.
    pub fn add(&mut self, other: &Self, by: [f64; D]) {
        self.volume += other.volume;
        for axis in 0..D {
            let shift = 2.0 * by[axis];
            self.first[axis] += other.first[axis] + shift * other.volume;
            self.second[axis] +=
                other.second[axis] + 2.0 * shift * other.first[axis] + shift * shift * other.volume;
        }
    }

    fn plus(mut self, other: &Self, weight: f64) -> Self {
        self.volume += weight * other.volume;
        for axis in 0..D {
            self.first[axis] += weight * other.first[axis];
            self.second[axis] += weight * other.second[axis];
        }
        self
    }

    pub fn centroid(&self) -> [f64; D] {
        self.first.map(|first| first / self.volume)
    }

    /// Half lengths of the box with this volume and these proportions of the radii of gyration;
    /// of a box its own.
    pub fn half_lengths(&self) -> [f64; D] {
        let centroid = self.centroid();
        let gyration: [f64; D] = std::array::from_fn(|axis| {
            (3.0 * (self.second[axis] / self.volume - centroid[axis].powi(2))).max(0.0).sqrt()
        });
        let scale = (self.volume / gyration.iter().product::<f64>()).powf(1.0 / D as f64);
        gyration.map(|length| length * scale)
    }
}

/// Share of the box's volume to which an integral over an axis is found; the innermost integral is
/// exact.
const TOLERANCE: [[f64; 2]; 2] = [[1e-8, 0.0], [2e-4, 5e-5]];
/// For a whole shape in the plane: a plan prints its volume to four digits. The error of a disc is 2e-8, as each
/// halving gains two digits.
const OF_WHOLE: f64 = 1e-5;
/// Halvings of a panel at most.
const HALVINGS: [usize; 2] = [26, 5];
/// Lines along each of two axes that a volume in 3D is summed over.
const LINES: usize = 96;

/// A shape made ready for many boxes.
pub struct Coverage<'a, const D: usize> {
    shape: &'a Shape,
    /// Along each axis, ascending, m: where its section may have a kink.
    kinks: [Vec<f64>; D],
    /// Of the box's volume, by axis.
    tolerance: [f64; 2],
}

impl<'a, const D: usize> Coverage<'a, D> {
    pub fn new(shape: &'a Shape) -> Self {
        let mut corners = Vec::new();
        shape.corners(&mut corners);
        let kinks = std::array::from_fn(|axis| {
            let mut along: Vec<f64> = corners.iter().map(|corner| corner[axis]).collect();
            along.sort_unstable_by(f64::total_cmp);
            along.dedup();
            along
        });
        Coverage { shape, kinks, tolerance: TOLERANCE[D - 2] }
    }

    fn is_upright_box(&self) -> bool {
        matches!(self.shape.form, Form::Box { .. }) && self.shape.placement.rotate.is_none()
    }

    /// How the box of these half lengths lies.
    pub fn side(&self, centre: &[f64; D], half: &[f64; D]) -> Side {
        self.shape.side(padded(centre), padded(half))
    }

    /// Of the box of these half lengths.
    pub fn of(&self, centre: &[f64; D], half: &[f64; D]) -> Moments<D> {
        match self.side(centre, half) {
            Side::Inside => return Moments::FULL,
            Side::Outside => return Moments::NONE,
            Side::Cut => {}
        }
        if let (Form::Box { min, max }, true) = (&self.shape.form, self.is_upright_box()) {
            let shift = |axis: usize| {
                centre[axis] - self.shape.placement.translate.get(axis).copied().unwrap_or(0.0)
            };
            let end = |axis: usize, end: f64| ((end - shift(axis)) / half[axis]).clamp(-1.0, 1.0);
            let mut moments = Moments::FULL;
            let ends: [[f64; 2]; D] =
                std::array::from_fn(|axis| [end(axis, min[axis]), end(axis, max[axis])]);
            for [low, high] in ends {
                moments.volume *= 0.5 * (high - low);
            }
            for (axis, [low, high]) in ends.into_iter().enumerate() {
                moments.first[axis] = moments.volume * 0.5 * (low + high);
                moments.second[axis] =
                    moments.volume * (low * low + low * high + high * high) / 3.0;
            }
            return moments;
        }
        self.over(0, &mut [0.0; D], centre, half)
    }

    /// The integral over the axes from `axis` on, the others at `at`.
    fn over(
        &self,
        axis: usize,
        at: &mut [f64; D],
        centre: &[f64; D],
        half: &[f64; D],
    ) -> Moments<D> {
        if axis + 1 == D {
            return self.along_line(at, centre, half);
        }
        let mut ends = vec![-1.0];
        let kinks = &self.kinks[axis];
        let first = kinks.partition_point(|&x| x <= centre[axis] - half[axis]);
        let inside = kinks[first..].iter().take_while(|&&x| x < centre[axis] + half[axis]);
        ends.extend(inside.map(|x| (x - centre[axis]) / half[axis]));
        if axis + 2 == D {
            // Where the boundary enters or leaves through the ends of the lines.
            for end in [-1.0, 1.0] {
                let mut crossings = Vec::new();
                let corner = |u: f64| {
                    let mut x = padded(centre);
                    for (other, x) in x.iter_mut().enumerate().take(D) {
                        let along = match other {
                            _ if other == axis => u,
                            _ if other < axis => at[other],
                            _ => end,
                        };
                        *x += along * half[other];
                    }
                    x
                };
                self.shape.crossings(corner(-1.0), corner(1.0), &mut crossings);
                ends.extend(crossings.iter().map(|t| 2.0 * t - 1.0).filter(|u| u.abs() < 1.0));
            }
            ends.sort_unstable_by(f64::total_cmp);
        }
        ends.push(1.0);
        let mut sum = Moments::NONE;
        for panel in ends.windows(2).filter(|panel| panel[0] < panel[1]) {
            let mut section = |u: f64| {
                at[axis] = u;
                self.over(axis + 1, at, centre, half)
            };
            let whole = gauss(&mut section, panel[0], panel[1]);
            let until = (self.tolerance[axis], HALVINGS[D - 2]);
            let settled = halve(&mut section, (panel[0], panel[1]), whole, until);
            sum = sum.plus(&settled, 1.0);
        }
        sum
    }

    fn along_line(&self, at: &[f64; D], centre: &[f64; D], half: &[f64; D]) -> Moments<D> {
        let last = D - 1;
        let place = |t: f64| {
            let mut x = [0.0; 3];
            for axis in 0..last {
                x[axis] = centre[axis] + at[axis] * half[axis];
            }
            x[last] = centre[last] + (2.0 * t - 1.0) * half[last];
            x
        };
        let mut ends = vec![0.0, 1.0];
        self.shape.crossings(place(0.0), place(1.0), &mut ends);
        ends.retain(|t| (0.0..=1.0).contains(t));
        ends.sort_unstable_by(f64::total_cmp);
        let mut moments = Moments::NONE;
        for pair in ends.windows(2) {
            if pair[0] < pair[1] && self.shape.contains(&place(0.5 * (pair[0] + pair[1]))[..D]) {
                let (low, high) = (2.0 * pair[0] - 1.0, 2.0 * pair[1] - 1.0);
                let length = 0.5 * (high - low);
                moments.volume += length;
                moments.first[last] += length * 0.5 * (low + high);
                moments.second[last] += length * (low * low + low * high + high * high) / 3.0;
            }
        }
        for axis in 0..last {
            moments.first[axis] = at[axis] * moments.volume;
            moments.second[axis] = at[axis] * at[axis] * moments.volume;
        }
        moments
    }
}

/// Volume of a shape, m3 (m2 in plane strain), to about 1e-6 and in 3D to about 1e-3; `None` if it is unbounded.
pub fn volume<const D: usize>(shape: &Shape) -> Option<f64> {
    let (low, high) = shape.bounds()?;
    let centre: [f64; D] = std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
    let half: [f64; D] = std::array::from_fn(|axis| 0.5 * (high[axis] - low[axis]));
    let whole: f64 = half.iter().map(|length| 2.0 * length).product();
    let mut coverage = Coverage::new(shape);
    if D == 2 || coverage.is_upright_box() {
        coverage.tolerance[0] = OF_WHOLE;
        return Some(coverage.of(&centre, &half).volume * whole);
    }
    let place = |line: usize| 2.0 * (line as f64 + 0.5) / LINES as f64 - 1.0;
    let lines = (0..LINES * LINES).map(|k| {
        let mut at = [0.0; D];
        (at[0], at[1]) = (place(k % LINES), place(k / LINES));
        coverage.along_line(&at, &centre, &half).volume
    });
    Some(lines.sum::<f64>() / (LINES * LINES) as f64 * whole)
}

/// Volume of the whole turn of a section in the plane about the axis x = 0, m3: 2π ∫ x dA.
pub fn volume_of_turn(section: &Shape) -> Option<f64> {
    let (low, high) = section.bounds()?;
    let centre: [f64; 2] = std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
    let half: [f64; 2] = std::array::from_fn(|axis| 0.5 * (high[axis] - low[axis]));
    let moments = Coverage::new(section).of(&centre, &half);
    let area = 4.0 * half[0] * half[1];
    Some(TAU * area * (centre[0] * moments.volume + half[0] * moments.first[0]))
}

/// Half the integral from `low` to `high`: three points, exact for polynomials of degree five.
fn gauss<const D: usize>(
    section: &mut impl FnMut(f64) -> Moments<D>,
    low: f64,
    high: f64,
) -> Moments<D> {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let reach = half * 0.6_f64.sqrt();
    let mut sum = Moments::NONE;
    for (u, weight) in [(middle - reach, 5.0), (middle, 8.0), (middle + reach, 5.0)] {
        sum = sum.plus(&section(u), weight / 18.0 * half);
    }
    sum
}

/// The integral over a panel whose value in one piece is `whole`.
fn halve<const D: usize>(
    section: &mut impl FnMut(f64) -> Moments<D>,
    (low, high): (f64, f64),
    whole: Moments<D>,
    (tolerance, halvings): (f64, usize),
) -> Moments<D> {
    let middle = 0.5 * (low + high);
    let (left, right) = (gauss(section, low, middle), gauss(section, middle, high));
    let sum = left.plus(&right, 1.0);
    if halvings == 0 || (sum.volume - whole.volume).abs() <= tolerance * 0.5 * (high - low) {
        return sum;
    }
    let rest = (tolerance, halvings - 1);
    halve(section, (low, middle), left, rest)
        .plus(&halve(section, (middle, high), right, rest), 1.0)
}

fn padded<const D: usize>(x: &[f64; D]) -> [f64; 3] {
    std::array::from_fn(|axis| if axis < D { x[axis] } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::shape::{Placement, Turn};

    fn near(found: f64, exact: f64, tolerance: f64) {
        assert!((found / exact - 1.0).abs() < tolerance, "{found}, exact {exact}");
    }

    fn turned(form: Form, degrees: f64) -> Shape {
        let about = vec![0.3; 2];
        let rotate = Some(Turn { degrees, about, axis: [0.0, 0.0, 1.0] });
        Shape { form, placement: Placement { translate: vec![0.1, -0.7], rotate } }
    }

    #[test]
    fn volumes_are_those_of_the_formulas() {
        let pi = std::f64::consts::PI;
        let disc = Form::Ball { centre: vec![1.0, 2.0], radius: 0.5 };
        near(volume::<2>(&Shape::new(disc.clone())).unwrap(), pi / 4.0, 1e-6);
        let ellipse = Form::Ellipsoid { centre: vec![0.0, 1.0], semi_axes: vec![2.0, 0.5] };
        near(volume::<2>(&turned(ellipse, 33.0)).unwrap(), pi, 1e-6);
        let capsule = Form::Capsule { from: vec![0.0, 0.0], to: vec![3.0, 4.0], radius: 1.0 };
        near(volume::<2>(&Shape::new(capsule)).unwrap(), pi + 10.0, 1e-6);
        let ell = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        near(volume::<2>(&turned(Form::Polygon { vertices: ell }, 17.0)).unwrap(), 4.0, 1e-12);
        let hole = Form::Ball { centre: vec![1.0, 2.0], radius: 0.25 };
        let ring = Form::Difference(vec![Shape::new(disc), Shape::new(hole)]);
        near(volume::<2>(&Shape::new(ring)).unwrap(), pi * 3.0 / 16.0, 1e-6);
        let ball = Form::Ball { centre: vec![0.1, 0.2, 0.3], radius: 1.5 };
        near(volume::<3>(&Shape::new(ball.clone())).unwrap(), pi * 4.5, 1e-3);
        // Summed over boxes of which the boundary cuts some.
        let shape = Shape::new(ball);
        let coverage = Coverage::<3>::new(&shape);
        let sum: f64 = (0..1000)
            .map(|k| {
                let centre = [k % 10, k / 10 % 10, k / 100].map(|i| -1.6 + 0.4 * i as f64);
                coverage.of(&centre, &[0.2; 3]).volume * 0.064
            })
            .sum();
        near(sum, pi * 4.5, 1e-3);
    }

    #[test]
    fn a_cut_box_keeps_centroid_and_extent() {
        // Covered from -1 to 0.2 along y by a box, by a polygon and by a turned box.
        let vertices = vec![[-9.0, -9.0], [9.0, -9.0], [9.0, 0.2], [-9.0, 0.2]];
        let bar = Form::Box { min: vec![-9.0, -9.0], max: vec![0.2, 9.0] };
        let mut upright = turned(bar, 90.0);
        upright.placement.translate = Vec::new();
        if let Some(turn) = &mut upright.placement.rotate {
            turn.about = vec![0.0, 0.0];
        }
        let flat = Form::Box { min: vec![-9.0, -9.0], max: vec![9.0, 0.2] };
        for shape in [Shape::new(flat), Shape::new(Form::Polygon { vertices }), upright] {
            let part = Coverage::<2>::new(&shape).of(&[0.0; 2], &[1.0; 2]);
            near(part.volume, 0.6, 1e-7);
            near(part.centroid()[1], -0.4, 1e-6);
            let half = part.half_lengths();
            near(half[0], 1.0, 1e-7);
            near(half[1], 0.6, 1e-7);
        }
    }

    #[test]
    fn sides_are_true() {
        let disc = Shape::new(Form::Ball { centre: vec![0.0, 0.0], radius: 1.0 });
        let hole = Shape::new(Form::Ball { centre: vec![0.0, 0.0], radius: 0.5 });
        let ring = Shape::new(Form::Difference(vec![disc, hole]));
        let coverage = Coverage::<2>::new(&ring);
        for (x, side) in [
            ([0.75, 0.0], Side::Inside),
            ([0.0, 0.1], Side::Outside),
            ([2.0, 0.0], Side::Outside),
            ([0.5, 0.0], Side::Cut),
            ([0.0, 1.0], Side::Cut),
        ] {
            assert_eq!(coverage.side(&x, &[0.1; 2]), side, "{x:?}");
        }
    }
}
