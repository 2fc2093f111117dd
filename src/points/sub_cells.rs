//! Equal sub-cells of a lattice's cells, filled by a shape: where their points sit, and how large
//! they are.
//!
//! A sub-cell inside the shape has its point at its centre. One that the boundary cuts has it at
//! the centroid of the covered part, with its volume and extent, so that the volumes sum to the
//! shape's. A sliver joins the point of a neighbour: a point of next to no mass would do harm.

use std::cell::RefCell;

use rustc_hash::FxHashMap;

use crate::basis::Domain;
use crate::deck::model::Basis;
use crate::deck::{Shape, Side};
use crate::grid::Lattice;

use super::coverage::{Coverage, Moments};

/// Shares of a sub-cell below this are nothing: round-off of a boundary that is meant to lie on a face.
const NOTHING: f64 = 1e-9;
/// Shares below this join a neighbour's.
const SLIVER: f64 = 0.25;

/// A point as a sub-cell makes it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed<const D: usize> {
    pub position: [f64; D],
    pub volume: f64,
    pub half_length: [f64; D],
    /// A neighbour across a face has no point.
    pub outermost: bool,
}

/// Indices may lie beyond the lattice, which goes on there in thought.
pub(super) struct SubCells<'a, const D: usize> {
    lattice: &'a Lattice<D>,
    counts: [usize; D],
    coverage: Coverage<'a, D>,
    /// A shape without bounds ends at the lattice.
    bounded: bool,
    half: [f64; D],
    /// Axes along which a point may reach beyond its sub-cell: a GIMP domain is no wider than a cell.
    joins: [bool; D],
    /// Covered parts of the sub-cells near the boundary.
    known: RefCell<FxHashMap<[isize; D], Moments<D>>>,
}

impl<'a, const D: usize> SubCells<'a, D> {
    pub fn new(
        lattice: &'a Lattice<D>,
        counts: [usize; D],
        shape: &'a Shape,
        basis: Basis,
    ) -> Self {
        SubCells {
            lattice,
            counts,
            coverage: Coverage::new(shape),
            bounded: shape.bounds().is_some(),
            half: std::array::from_fn(|a| 0.5 * lattice.spacing[a] / counts[a] as f64),
            joins: counts.map(|count| count > 1 || basis.domain() != Domain::Box),
            known: RefCell::default(),
        }
    }

    /// Volume of a whole sub-cell, m3.
    fn whole(&self) -> f64 {
        self.half.iter().map(|l| 2.0 * l).product()
    }

    fn centre(&self, sub: &[isize; D]) -> [f64; D] {
        std::array::from_fn(|a| {
            let count = self.counts[a] as isize;
            let (cell, part) = (sub[a].div_euclid(count), sub[a].rem_euclid(count));
            let along = cell as f64 + (part as f64 + 0.5) / self.counts[a] as f64;
            self.lattice.origin[a] + self.lattice.spacing[a] * along
        })
    }

    /// The covered part of a sub-cell.
    fn covered(&self, sub: &[isize; D]) -> Moments<D> {
        let ends = |a: usize| (self.lattice.cells[a] * self.counts[a]) as isize;
        if !self.bounded && !(0..D).all(|a| (0..ends(a)).contains(&sub[a])) {
            return Moments::NONE;
        }
        if let Some(known) = self.known.borrow().get(sub) {
            return *known;
        }
        let centre = self.centre(sub);
        let mut moments = self.coverage.of(&centre, &self.half);
        if moments.volume < NOTHING {
            moments = Moments::NONE;
        } else if moments.volume > 1.0 - NOTHING {
            moments = Moments::FULL;
        }
        self.known.borrow_mut().insert(*sub, moments);
        moments
    }

    /// Somewhere inside the covered part, m; `None` if nothing is covered.
    pub fn inside(&self, sub: &[isize; D]) -> Option<[f64; D]> {
        let part = self.covered(sub);
        (part.volume > 0.0).then(|| self.placed_at(sub, &part))
    }

    fn placed_at(&self, sub: &[isize; D], part: &Moments<D>) -> [f64; D] {
        let (centre, shift) = (self.centre(sub), part.centroid());
        std::array::from_fn(|a| centre[a] + shift[a] * self.half[a])
    }

    /// The point of a sub-cell, if it makes one.
    pub fn point(&self, sub: &[isize; D]) -> Option<Placed<D>> {
        let centre = self.centre(sub);
        let around = self.half.map(|length| 3.0 * length);
        let nominal = |outermost| Placed {
            position: centre,
            volume: self.whole(),
            half_length: self.half,
            outermost,
        };
        match self.coverage.side(&centre, &around) {
            Side::Inside => return Some(nominal(false)),
            Side::Outside => return None,
            Side::Cut => {}
        }
        let mut part = self.covered(sub);
        if !self.makes_point(sub, &part) {
            return None;
        }
        let mut joined = false;
        if part.volume >= SLIVER {
            for (other, by) in self.neighbours(sub) {
                let sliver = self.covered(&other);
                if is_sliver(&sliver) && self.host(&other).as_ref() == Some(sub) {
                    part.add(&sliver, by);
                    joined = true;
                }
            }
        }
        let faces = (0..D).flat_map(|axis| [(axis, -1), (axis, 1)]);
        let outermost = faces.map(|(axis, step)| {
            let mut other = *sub;
            other[axis] += step;
            !self.makes_point(&other, &self.covered(&other))
        });
        let outermost = outermost.fold(false, |any, open| any | open);
        if !joined && part == Moments::FULL {
            return Some(nominal(outermost));
        }
        let half = part.half_lengths();
        Some(Placed {
            position: self.placed_at(sub, &part),
            volume: part.volume * self.whole(),
            half_length: std::array::from_fn(|a| {
                (half[a] * self.half[a]).min(0.5 * self.lattice.spacing[a])
            }),
            outermost,
        })
    }

    fn makes_point(&self, sub: &[isize; D], part: &Moments<D>) -> bool {
        part.volume >= SLIVER || (part.volume > 0.0 && self.host(sub).is_none())
    }

    /// Whose point a sliver joins: of the neighbours that are none the nearest, of those the
    /// fullest, of those the first.
    fn host(&self, sub: &[isize; D]) -> Option<[isize; D]> {
        let mut best: Option<(usize, f64, [isize; D])> = None;
        for (other, by) in self.neighbours(sub) {
            let volume = self.covered(&other).volume;
            let far = by.iter().filter(|step| **step != 0.0).count();
            let better = best.is_none_or(|(least, fullest, _)| {
                far < least || (far == least && volume > fullest)
            });
            if volume >= SLIVER && better {
                best = Some((far, volume, other));
            }
        }
        best.map(|(_, _, other)| other)
    }

    /// Sub-cells that share a corner, along the axes in which points may join, with the step there.
    fn neighbours(&self, sub: &[isize; D]) -> impl Iterator<Item = ([isize; D], [f64; D])> {
        let (sub, joins) = (*sub, self.joins);
        (0..3_usize.pow(D as u32)).filter_map(move |k| {
            let by: [isize; D] =
                std::array::from_fn(|a| (k / 3_usize.pow(a as u32) % 3) as isize - 1);
            let other = std::array::from_fn(|a| sub[a] + by[a]);
            let allowed = (0..D).all(|a| by[a] == 0 || joins[a]) && by != [0; D];
            allowed.then(|| (other, by.map(|step| step as f64)))
        })
    }
}

fn is_sliver<const D: usize>(part: &Moments<D>) -> bool {
    part.volume > 0.0 && part.volume < SLIVER
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::shape::Form;

    fn points(shape: &Shape, basis: Basis, count: usize) -> Vec<Placed<2>> {
        let lattice = Lattice { origin: [0.0; 2], spacing: [0.5; 2], cells: [8, 8] };
        let cells = SubCells::new(&lattice, [count; 2], shape, basis);
        let all = (0..64 * (count * count) as isize).map(|k| {
            let n = 8 * count as isize;
            [k % n, k / n]
        });
        all.filter_map(|sub| cells.point(&sub)).collect()
    }

    fn sums(points: &[Placed<2>]) -> [f64; 3] {
        let sum = |value: &dyn Fn(&Placed<2>) -> f64| points.iter().map(value).sum::<f64>();
        let volume = sum(&|p| p.volume);
        let centre = [0, 1].map(|a| sum(&|p| p.volume * p.position[a]) / volume);
        [volume, centre[0], centre[1]]
    }

    fn near(found: [f64; 3], exact: [f64; 3], tolerance: f64) {
        for (found, exact) in found.iter().zip(exact) {
            assert!((found / exact - 1.0).abs() < tolerance, "{found}, exact {exact}");
        }
    }

    #[test]
    fn boxes_off_the_lattice_keep_volume_and_centroid_and_domains_tile_them() {
        // 1.1: a layer of its own; 1.03: a sliver that joins; 0.05 above the floor; both axes.
        for (low, high) in [
            ([0.0, 0.0], [2.0, 1.1]),
            ([0.0, 0.0], [2.0, 1.03]),
            ([0.0, 0.05], [2.0, 1.0]),
            ([0.27, 0.22], [1.55, 1.27]),
            ([0.3, 0.3], [0.4, 0.4]),
        ] {
            let form = Form::Box { min: low.to_vec(), max: high.to_vec() };
            let points = points(&Shape::new(form), Basis::Gimp, 2);
            let sides = [high[0] - low[0], high[1] - low[1]];
            let centre = [0, 1].map(|a| 0.5 * (low[a] + high[a]));
            near(sums(&points), [sides[0] * sides[1], centre[0], centre[1]], 1e-12);
            for point in &points {
                let domain = 4.0 * point.half_length[0] * point.half_length[1];
                assert!((domain / point.volume - 1.0).abs() < 1e-12);
                assert!(point.half_length.iter().all(|&l| l <= 0.25));
                // No sliver is left, and no domain reaches out of the body.
                assert!(point.volume > 0.24 * 0.0625 || points.len() == 1);
                for axis in 0..2 {
                    let (x, l) = (point.position[axis], point.half_length[axis]);
                    assert!(x - l > low[axis] - 1e-12 && x + l < high[axis] + 1e-12);
                }
            }
        }
    }

    #[test]
    fn aligned_boxes_keep_the_centres_of_their_sub_cells_to_the_last_bit() {
        let form = Form::Box { min: vec![0.5, 0.0], max: vec![2.0, 1.5] };
        let points = points(&Shape::new(form), Basis::Gimp, 2);
        assert_eq!(points.len(), 36);
        for point in &points {
            assert_eq!((point.volume, point.half_length), (0.0625, [0.125; 2]));
            assert!(point.position.iter().all(|x| (x / 0.125) % 2.0 == 1.0));
            let inner = point.position[0] > 0.75
                && point.position[0] < 1.75
                && point.position[1] > 0.25
                && point.position[1] < 1.25;
            assert_eq!(point.outermost, !inner);
        }
    }

    #[test]
    fn discs_have_their_area_at_every_place() {
        let area = std::f64::consts::PI * 1.21;
        for k in 0..10 {
            let centre = vec![1.5 + 0.029 * k as f64, 1.7 - 0.017 * k as f64];
            let exact = [area, centre[0], centre[1]];
            let shape = Shape::new(Form::Ball { centre, radius: 1.1 });
            for (basis, count) in [(Basis::Gimp, 2), (Basis::Mpm, 1), (Basis::Gimp, 1)] {
                near(sums(&points(&shape, basis, count)), exact, 1e-6);
            }
        }
    }
}
