//! The surface of a shape: patches of its forms where the shape lies on one side only, cut into elements
//! of about half the spacing of the points.

use super::patch::{self, Patch};
use super::{Element, norm};
use crate::deck::Scope;
use crate::deck::expression::Expression;
use crate::deck::shape::{Form, Placement, Shape};

/// Elements per spacing of the points.
const CUTS: f64 = 2.0;
/// An element is tested at so many places along each direction: what of it does not lie on the surface does not count.
const LOOKS: [usize; 2] = [16, 4];
/// Distance from a surface, as a share of the spacing, at which its two sides are tested for being inside the shape.
const SIDE: f64 = 1e-6;

/// What is wanted of a surface: [`crate::deck::model::BodySurface`] without the body.
#[derive(Clone, Copy, Default)]
pub struct Part<'a> {
    pub side: Option<(usize, bool)>,
    pub within: Option<&'a Expression>,
}

impl Part<'_> {
    /// Whether an element with this outward normal in the shape's own frame belongs to the part.
    fn has<const D: usize>(&self, element: &Element<D>, local_normal: &[f64; 3]) -> bool {
        let to_side = self.side.is_none_or(|(axis, upper)| {
            // If two directions are equally near, the lower one, so that each element belongs to one side.
            let size = |a: usize| local_normal[a].abs();
            let nearest = (0..D)
                .fold(0, |best, a| if size(a) > size(best) * (1.0 + 1e-9) { a } else { best });
            nearest == axis && (local_normal[axis] > 0.0) == upper
        });
        to_side
            && self.within.is_none_or(|condition| {
                let mut place = [0.0; 3];
                place[..D].copy_from_slice(&element.place);
                let value =
                    condition.value(&Scope { initial: place, current: place, ..Scope::default() });
                value != 0.0 && !value.is_nan()
            })
    }
}

/// The elements of a part of a shape's surface; `spacing`: that of the body's points, m.
pub fn elements<const D: usize>(shape: &Shape, part: Part<'_>, spacing: f64) -> Vec<Element<D>> {
    let mut leaves = Vec::new();
    collect(shape, &[], &mut leaves);
    let mut found = Vec::new();
    for index in 0..leaves.len() {
        let leaf = &leaves[index];
        for patch in patch::of_form(leaf.form, D) {
            cut(shape, &leaves[..index], leaf, &patch, part, spacing, &mut found);
        }
    }
    found
}

/// A form of a shape that is no set, and the frames that it lies in, the innermost first.
struct Leaf<'a> {
    form: &'a Form,
    frames: Vec<&'a Placement>,
}

fn collect<'a>(shape: &'a Shape, outer: &[&'a Placement], out: &mut Vec<Leaf<'a>>) {
    let mut frames = vec![&shape.placement];
    frames.extend(outer);
    match &shape.form {
        Form::Union(parts) | Form::Intersection(parts) | Form::Difference(parts) => {
            parts.iter().for_each(|part| collect(part, &frames, out));
        }
        form => out.push(Leaf { form, frames }),
    }
}

impl Leaf<'_> {
    fn to_global(&self, x: [f64; 3]) -> [f64; 3] {
        self.frames.iter().fold(x, |x, frame| frame.globalise(x))
    }

    /// Difference of two places instead of a rotation: frames only turn and move.
    fn direction(&self, v: [f64; 3]) -> [f64; 3] {
        let (end, start) = (self.to_global(v), self.to_global([0.0; 3]));
        std::array::from_fn(|i| end[i] - start[i])
    }

    fn contains(&self, x: [f64; 3]) -> bool {
        let local = self.frames.iter().rev().fold(x, |x, frame| frame.localise(x));
        self.form.contains(local)
    }
}

/// Cuts a patch into elements and keeps what lies on the surface of the whole shape.
fn cut<const D: usize>(
    shape: &Shape,
    before: &[Leaf<'_>],
    leaf: &Leaf<'_>,
    patch: &Patch,
    part: Part<'_>,
    spacing: f64,
    found: &mut Vec<Element<D>>,
) {
    let single = before.is_empty() && std::ptr::eq(leaf.form, &shape.form);
    let (extent, folds) = (patch.extent(), patch.folds());
    let counts: [usize; 2] = std::array::from_fn(|k| {
        if k + 1 >= D {
            return 1;
        }
        // Round-off must not decide about a cut.
        let wanted = (CUTS * extent[k] / spacing - 1e-6).ceil().max(1.0) as usize;
        wanted.next_multiple_of(folds[k])
    });
    let looks = [LOOKS[D - 2], if D == 2 { 1 } else { LOOKS[1] }];
    let share = 1.0 / (counts[0] * counts[1] * looks[0] * looks[1]) as f64;
    for cell in 0..counts[0] * counts[1] {
        let first = [cell % counts[0], cell / counts[0]];
        let (mut area, mut middle, mut size, mut kept) = ([0.0; 3], [0.0; 3], 0.0, 0);
        for look in 0..looks[0] * looks[1] {
            let step = [look % looks[0], look / looks[0]];
            let at = |k: usize| {
                (first[k] as f64 + (step[k] as f64 + 0.5) / looks[k] as f64) / counts[k] as f64
            };
            let (x, a) = patch.at(at(0), at(1));
            let (x, a) = (leaf.to_global(x), leaf.direction(a).map(|a| a * share));
            let length = norm(&a);
            if length == 0.0 {
                continue;
            }
            let beside = |sign: f64| -> [f64; 3] {
                std::array::from_fn(|i| x[i] + sign * SIDE * spacing / length * a[i])
            };
            let (ahead, behind) = (beside(1.0), beside(-1.0));
            let (out, inner) = (shape.contains_padded(ahead), shape.contains_padded(behind));
            let known = !single && before.iter().any(|b| b.contains(ahead) != b.contains(behind));
            if out == inner || known {
                continue;
            }
            let sign = if inner { 1.0 } else { -1.0 };
            for i in 0..3 {
                area[i] += sign * a[i];
                middle[i] += length * x[i];
            }
            size += length;
            kept += 1;
        }
        if kept == 0 {
            continue;
        }
        // Of an element that is kept as a whole, its middle lies on the surface itself.
        let whole = kept == looks[0] * looks[1] && !patch.is_flat();
        let centre = match whole {
            true => {
                let at = |k: usize| (first[k] as f64 + 0.5) / counts[k] as f64;
                leaf.to_global(patch.at(at(0), at(1)).0)
            }
            false => middle.map(|m| m / size),
        };
        let element = Element {
            place: std::array::from_fn(|i| centre[i]),
            area: std::array::from_fn(|i| area[i]),
        };
        let origin = shape.placement.localise([0.0; 3]);
        let end = shape.placement.localise(area);
        let local_normal = std::array::from_fn(|i| end[i] - origin[i]);
        if part.has(&element, &local_normal) {
            found.push(element);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::shape::Turn;

    fn total<const D: usize>(elements: &[Element<D>]) -> ([f64; D], f64, f64) {
        let sum = std::array::from_fn(|i| elements.iter().map(|e| e.area[i]).sum());
        // By the divergence theorem.
        let flux = |e: &Element<D>| e.place.iter().zip(&e.area).map(|(x, a)| x * a).sum::<f64>();
        let volume = elements.iter().map(flux).sum::<f64>() / D as f64;
        (sum, elements.iter().map(|e| norm(&e.area)).sum(), volume)
    }

    fn ball(centre: &[f64], radius: f64) -> Shape {
        Shape::new(Form::Ball { centre: centre.to_vec(), radius })
    }

    fn cuboid(min: &[f64], max: &[f64]) -> Shape {
        Shape::new(Form::Box { min: min.to_vec(), max: max.to_vec() })
    }

    /// Areas sum to zero (closed), their sizes to the area, and their flux of x to the volume.
    fn check<const D: usize>(shape: &Shape, area: f64, volume: f64, tolerance: f64) {
        let found = elements::<D>(shape, Part::default(), 0.1);
        let (sum, size, flux) = total(&found);
        assert!(norm(&sum) < tolerance * area, "{shape:?}: {sum:?}");
        assert!((size / area - 1.0).abs() < tolerance, "{shape:?}: {size} for {area}");
        assert!((flux / volume - 1.0).abs() < tolerance, "{shape:?}: {flux} for {volume}");
    }

    #[test]
    fn surfaces_close_and_hold_their_volume() {
        let pi = std::f64::consts::PI;
        check::<2>(&cuboid(&[0.3, 0.1], &[1.3, 2.1]), 6.0, 2.0, 1e-12);
        check::<2>(&ball(&[1.0, 2.0], 0.7), 1.4 * pi, 0.49 * pi, 1e-3);
        let capsule = Form::Capsule { from: vec![0.0, 0.0], to: vec![3.0, 4.0], radius: 1.0 };
        check::<2>(&Shape::new(capsule), 2.0 * pi + 10.0, pi + 10.0, 1e-3);
        let corner =
            [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]].to_vec();
        check::<2>(&Shape::new(Form::Polygon { vertices: corner }), 10.0, 4.0, 1e-12);
        let mut bar = cuboid(&[0.0; 3], &[1.0, 0.5, 2.0]);
        let turn = Turn { degrees: 33.0, about: vec![1.0, 0.0, 2.0], axis: [1.0, 2.0, -1.0] };
        bar.placement = Placement { translate: vec![0.1, 0.2, 0.3], rotate: Some(turn) };
        check::<3>(&bar, 7.0, 1.0, 1e-12);
        check::<3>(&ball(&[1.0, 2.0, 0.5], 0.7), 4.0 * pi * 0.49, 4.0 / 3.0 * pi * 0.343, 2e-3);
        let capsule = Form::Capsule { from: vec![0.0; 3], to: vec![0.0, 0.6, 0.8], radius: 0.5 };
        check::<3>(&Shape::new(capsule), 2.0 * pi, pi * (0.25 + 4.0 / 3.0 * 0.125), 2e-3);
        let egg = Form::Ellipsoid { centre: vec![0.0; 3], semi_axes: vec![1.0, 1.0, 0.5] };
        // Oblate spheroid: 2 pi a^2 (1 + (1 - e^2)/e artanh e).
        let e = 0.75f64.sqrt();
        let area = 2.0 * pi * (1.0 + 0.25 / e * e.atanh());
        check::<3>(&Shape::new(egg), area, 4.0 / 3.0 * pi * 0.5, 3e-3);
    }

    /// Holes face inward, what is cut away has no surface, and a side that two boxes share is none.
    #[test]
    fn sets_of_shapes_have_the_surface_of_what_is_left() {
        let pi = std::f64::consts::PI;
        let ring = Form::Difference(vec![ball(&[0.0, 0.0], 1.0), ball(&[0.0, 0.0], 0.5)]);
        check::<2>(&Shape::new(ring.clone()), 3.0 * pi, 0.75 * pi, 2e-3);
        let quarter = Shape::new(Form::Intersection(vec![
            Shape::new(ring),
            cuboid(&[0.0, 0.0], &[2.0, 2.0]),
        ]));
        check::<2>(&quarter, 0.75 * pi + 1.0, 0.1875 * pi, 2e-3);
        let both = Form::Union(vec![
            cuboid(&[0.0, 0.0], &[1.0, 1.0]),
            cuboid(&[1.0, 0.0], &[2.0, 1.0]),
            cuboid(&[0.0, 0.0], &[2.0, 0.5]),
        ]);
        check::<2>(&Shape::new(both), 6.0, 2.0, 1e-12);
        // Parts of elements.
        let bitten = Form::Difference(vec![
            cuboid(&[0.0, 0.0], &[1.0, 1.0]),
            cuboid(&[0.3123, -1.0], &[0.6177, 0.5311]),
        ]);
        check::<2>(&Shape::new(bitten), 4.0 + 2.0 * 0.5311, 1.0 - 0.3054 * 0.5311, 5e-3);
    }

    #[test]
    fn sides_are_those_of_the_shape_before_it_is_turned() {
        let mut bar = cuboid(&[0.0, 0.0], &[4.0, 1.0]);
        let turn = Turn { degrees: 30.0, about: vec![0.0; 2], axis: [0.0, 0.0, 1.0] };
        bar.placement.rotate = Some(turn);
        let bottom = Part { side: Some((1, false)), within: None };
        let (sum, size, _) = total(&elements::<2>(&bar, bottom, 0.1));
        assert!((size - 4.0).abs() < 1e-12);
        assert!(
            (sum[0] - 4.0 * 0.5).abs() < 1e-12 && (sum[1] + 4.0 * 0.75f64.sqrt()).abs() < 1e-12
        );
        let inside = Expression::parse("x*x + y*y < 0.3").expect("valid");
        let ring =
            Shape::new(Form::Difference(vec![ball(&[0.0, 0.0], 1.0), ball(&[0.0, 0.0], 0.5)]));
        let part = Part { side: None, within: Some(&inside) };
        let (_, size, volume) = total(&elements::<2>(&ring, part, 0.05));
        let pi = std::f64::consts::PI;
        assert!((size / pi - 1.0).abs() < 1e-3 && (volume / (-0.25 * pi) - 1.0).abs() < 1e-3);
        // The four sides of a disc are a quarter each.
        let disc = ball(&[0.0, 0.0], 1.0);
        for side in [(0, false), (0, true), (1, false), (1, true)] {
            let part = Part { side: Some(side), within: None };
            let (_, size, _) = total(&elements::<2>(&disc, part, 0.01));
            assert!((size / (0.5 * pi) - 1.0).abs() < 0.01, "{side:?}: {size}");
        }
    }
}
