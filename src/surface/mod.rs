//! Surfaces of bodies: places with areas, found from the shapes at the start and carried by the points
//! beside them.
//!
//! | file | idea |
//! |---|---|
//! | `mod.rs` | an element, and the surface that a part of a run acts on |
//! | `patch.rs` | smooth patches of the surfaces of forms |
//! | `of_shape.rs` | which of them lie on the surface of a shape, cut into elements |
//! | `sheet.rs` | lines and planes through the bodies |
//! | `carriers.rs` | the point that carries each element |
//!
//! An element at the place X_s is carried by the nearest point p of its body: it lies at
//! x_s = x_p + F_p (X_s - X_p), and its area vector is J F^-T A (Nanson). It moves with the nodes by
//! the weights S_a + ∇S_a·(x_s - x_p), which reproduce linear fields, so that forces and moments of
//! what acts there are exact. An element has no state of its own: it follows from the deck and from
//! its carrier, which moves, is stored and changes ranks as all points do; and it couples no nodes
//! that its carrier does not couple.

pub(crate) mod carriers;
pub(crate) mod of_shape;
mod patch;
pub(crate) mod sheet;

use std::ops::Range;

use rustc_hash::FxHashMap;

/// A place on a surface with its share of the area, at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Element<const D: usize> {
    /// X_s, m
    pub place: [f64; D],
    /// Along the outward normal, m2 (m in 2D).
    pub area: [f64; D],
}

/// An element and where it lies from the point that carries it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carried<const D: usize> {
    pub element: Element<D>,
    /// X_s - X_p, m
    pub offset: [f64; D],
}

/// Elements by the identities of their carriers; alike on all ranks.
#[derive(Debug, Clone, Default)]
pub struct Surface<const D: usize> {
    elements: Vec<Carried<D>>,
    of_carrier: FxHashMap<u64, Range<usize>>,
    /// How many elements a carrier has at most.
    most: usize,
}

impl<const D: usize> Surface<D> {
    /// From elements with the identities of their carriers.
    pub fn new(mut carried: Vec<(u64, Carried<D>)>) -> Self {
        carried.sort_by_key(|(carrier, _)| *carrier);
        let mut of_carrier: FxHashMap<u64, Range<usize>> = FxHashMap::default();
        for (index, (carrier, _)) in carried.iter().enumerate() {
            of_carrier.entry(*carrier).or_insert(index..index).end = index + 1;
        }
        let elements = carried.into_iter().map(|(_, element)| element).collect();
        let most = of_carrier.values().map(Range::len).max().unwrap_or(0);
        Surface { elements, of_carrier, most }
    }

    /// The elements that a point carries.
    #[inline]
    pub fn carried_by(&self, id: u64) -> &[Carried<D>] {
        self.of_carrier.get(&id).map_or(&[], |range| &self.elements[range.clone()])
    }

    /// How many elements a point carries at most.
    pub fn most_carried(&self) -> usize {
        self.most
    }

    pub fn elements(&self) -> &[Carried<D>] {
        &self.elements
    }

    /// Σ |A|, m2.
    pub fn area(&self) -> f64 {
        self.elements.iter().map(|carried| norm(&carried.element.area)).sum()
    }
}

pub fn norm<const N: usize>(v: &[f64; N]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
