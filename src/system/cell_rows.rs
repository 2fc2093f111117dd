//! The rows of cells that points share with F-bar, and what these points hand to them
//! ([`crate::mechanics::dilation`]): summed while point after point has the cells of the one before it, so that
//! dF_0, its rows and their products are made once for all of them.
//!
//! A domain in several cells has det dF_0 = Σ w_c det dF_c ([`crate::basis::CellParts`]). Its rows g_0 are
//! Σ v_c g_c, v_c = w_c det dF_c / det dF_0. What the second derivative of ln det dF_0 has of each cell,
//! π/n v_c (e_ca x e_cb - g_cb x g_ca), is summed over all points of the group.

use std::ops::Range;

use crate::basis::{CellPart, Influences};
use crate::mechanics::dilation::{inverse, mapped, volume_change};
use crate::mechanics::{Expansion, Increment, displacement_gradient, hoop_increment};
use crate::tensor::fused::multiply_add;

/// A row in the current state, 1/m, and of rings the hoop's.
pub(crate) type Now<const D: usize> = ([f64; D], f64);

/// One cell of several in the current state.
pub(crate) struct CellNow<const D: usize> {
    /// Places of its nodes in the row of the points
    pub entries: [u16; 8],
    /// g_c of these nodes
    pub rows: [Now<D>; 8],
    /// det dF_c - 1 with the hoop
    change: f64,
    /// Σ V v_c π/n of points
    pub trace: f64,
}

impl<const D: usize> CellNow<D> {
    fn new(part: &CellPart<D>, nodal: impl Fn(usize) -> [f64; D]) -> Self {
        let of_part = |a: usize| nodal(usize::from(part.entries[a]));
        let count = CellPart::<D>::NODES;
        let block = displacement_gradient(&part.gradients[..count], of_part);
        let hoop = hoop_increment(&part.hoops[..count], of_part);
        let increment = Increment { block: &block, hoop };
        let back = inverse(increment);
        let mut rows = [([0.0; D], 0.0); 8];
        for (now, (_, row, hoop)) in rows.iter_mut().zip(part.nodes()) {
            *now = mapped((row, hoop), &back);
        }
        CellNow { entries: part.entries, rows, change: volume_change(increment), trace: 0.0 }
    }

    /// Place in the points' row and row of each node.
    pub fn nodes(&self) -> impl Iterator<Item = (usize, &Now<D>)> {
        let places = self.entries[..CellPart::<D>::NODES].iter().map(|&entry| usize::from(entry));
        places.zip(&self.rows)
    }

    /// v_c from w_c and det dF_0 - 1
    fn share_now(&self, share: f64, common: f64) -> f64 {
        share * (1.0 + self.change) / (1.0 + common)
    }

    /// Adds the rows by v_c.
    fn add_to(&self, share: f64, sums: &mut [Now<D>]) {
        for (place, (row, hoop)) in self.nodes() {
            let sum = &mut sums[place];
            sum.0.iter_mut().zip(row).for_each(|(sum, g)| *sum += share * g);
            sum.1 += share * hoop;
        }
    }
}

/// det dF_0 - 1, hoop included, of the cells of point `p`. `nodal`: increments of the nodes of its row; `rows`
/// becomes its g_0.
pub(crate) fn rows_now<const D: usize>(
    influences: &Influences<D>,
    p: usize,
    nodal: impl Fn(usize) -> [f64; D],
    rows: &mut Vec<Now<D>>,
) -> f64 {
    rows.clear();
    let (entries, parts) = (influences.row(p), influences.parts.of(p));
    if parts.is_empty() {
        return single(influences, entries, nodal, rows);
    }
    rows.resize(entries.len(), ([0.0; D], 0.0));
    let cells: Vec<_> = parts.iter().map(|part| CellNow::new(part, &nodal)).collect();
    let common = parts.iter().zip(&cells).map(|(part, cell)| part.share * cell.change).sum();
    for (part, cell) in parts.iter().zip(&cells) {
        cell.add_to(cell.share_now(part.share, common), rows);
    }
    common
}

/// [`rows_now`] of one cell, with the rows at `entries`.
#[inline(always)]
fn single<const D: usize>(
    influences: &Influences<D>,
    entries: Range<usize>,
    nodal: impl Fn(usize) -> [f64; D],
    rows: &mut Vec<Now<D>>,
) -> f64 {
    let gradients = &influences.centre_gradients[entries.clone()];
    let hoops = influences.centre_hoop.get(entries).unwrap_or_default();
    let block = displacement_gradient(gradients, &nodal);
    let increment = Increment { block: &block, hoop: hoop_increment(hoops, &nodal) };
    let back = inverse(increment);
    let hoop = |a: usize| hoops.get(a).copied().unwrap_or(0.0);
    rows.extend(gradients.iter().enumerate().map(|(a, row)| mapped((row, hoop(a)), &back)));
    volume_change(increment)
}

/// Cells of the last points of a group, and the sums over these points.
#[derive(Default)]
pub(crate) struct CellRows<const D: usize> {
    /// Entries of the influences that have the rows; empty before the first point.
    entries: Range<usize>,
    /// det dF_0 - 1 with the hoop
    pub volume_change: f64,
    /// g_0 of each node
    pub gradients: Vec<Now<D>>,
    /// e: g_0 with the hoop's along the radius, 1/m
    pub expansion: Vec<[f64; D]>,
    /// Σ V q g of each node
    onto: Vec<[f64; D]>,
    /// Σ V kappa/n^2
    own: f64,
    /// Σ V π/n
    pub trace: f64,
    /// Cells of the group's domains that lie in several
    pub several: Vec<CellNow<D>>,
    /// Those of the last points, and v_c
    shares: Vec<(usize, f64)>,
}

impl<const D: usize> CellRows<D> {
    /// Begins a group of points.
    pub fn start(&mut self) {
        self.several.clear();
        self.entries = 0..0;
    }

    /// Points have been added to cells.
    pub fn is_open(&self) -> bool {
        !self.entries.is_empty()
    }

    /// The points lie in one cell each.
    pub fn is_single(&self) -> bool {
        self.shares.is_empty()
    }

    /// The rows at `entries` are those of these cells.
    #[inline(always)]
    pub fn has(&self, influences: &Influences<D>, entries: &Range<usize>) -> bool {
        let (rows, hoops) = (&influences.centre_gradients, &influences.centre_hoop);
        let known = &self.entries;
        !known.is_empty()
            && rows[known.clone()] == rows[entries.clone()]
            && hoops.get(known.clone()) == hoops.get(entries.clone())
    }

    /// Begins the sums of the cells of point `p`; `displacement`: increments of the group's nodes.
    #[inline(always)]
    pub fn enter(&mut self, influences: &Influences<D>, p: usize, displacement: &[[f64; D]]) {
        self.entries = influences.row(p);
        self.gradients.clear();
        self.shares.clear();
        let parts = influences.parts.of(p);
        if parts.is_empty() {
            let (entries, nodal) = (self.entries.clone(), |a: usize| displacement[a]);
            self.volume_change = single(influences, entries, nodal, &mut self.gradients);
        } else {
            self.volume_change = self.enter_several(parts, displacement);
        }
        self.expansion.clear();
        self.expansion.extend(self.gradients.iter().map(|(row, hoop)| {
            let mut expansion = *row;
            expansion[0] += hoop;
            expansion
        }));
        self.onto.clear();
        self.onto.resize(self.gradients.len(), [0.0; D]);
        (self.own, self.trace) = (0.0, 0.0);
    }

    /// A cell's rows and dF_c are made once for all points of a group.
    fn enter_several(&mut self, parts: &[CellPart<D>], displacement: &[[f64; D]]) -> f64 {
        let mut common = 0.0;
        for part in parts {
            let known = self.several.iter().position(|cell| cell.entries == part.entries);
            let number = known.unwrap_or(self.several.len());
            if known.is_none() {
                self.several.push(CellNow::new(part, |a| displacement[a]));
            }
            common += part.share * self.several[number].change;
            self.shares.push((number, part.share));
        }
        self.gradients.resize(displacement.len(), ([0.0; D], 0.0));
        for (number, share) in &mut self.shares {
            let cell = &self.several[*number];
            *share = cell.share_now(*share, common);
            cell.add_to(*share, &mut self.gradients);
        }
        common
    }

    /// Ends the sums: what the cells of several get of them.
    pub fn leave(&mut self) {
        for &(number, share) in &self.shares {
            self.several[number].trace += share * self.trace;
        }
        self.shares.clear();
        self.entries = 0..0;
    }

    /// Adds a point's share; `gradients` and `hoops` in the frame, the latter empty but for rings, `volume` in
    /// m3. Without the block the force alone.
    #[inline(always)]
    pub fn add<const FUSED: bool>(
        &mut self,
        (gradients, hoops): (&[[f64; D]], &[f64]),
        share: &Expansion<D>,
        volume: f64,
        with_block: bool,
    ) {
        self.trace = multiply_add::<FUSED>(share.trace, volume, self.trace);
        if !with_block {
            return;
        }
        self.own = multiply_add::<FUSED>(share.own, volume, self.own);
        let onto = share.onto.map(|row| row.map(|value| value * volume));
        for (sum, gradient) in self.onto.iter_mut().zip(gradients) {
            for k in 0..D {
                for l in 0..D {
                    sum[k] = multiply_add::<FUSED>(onto[k][l], gradient[l], sum[k]);
                }
            }
        }
        let hoop_onto = share.hoop_onto * volume;
        for (sum, hoop) in self.onto.iter_mut().zip(hoops) {
            sum[0] = multiply_add::<FUSED>(hoop_onto, *hoop, sum[0]);
        }
    }

    /// Σ V (q g_b + kappa/n^2 e_b) of node `b`, and for domains in several cells - Σ V π/n e_b
    #[inline(always)]
    pub fn change<const FUSED: bool>(&self, b: usize) -> [f64; D] {
        let (sum, row) = (&self.onto[b], &self.expansion[b]);
        let own = if self.is_single() { self.own } else { self.own - self.trace };
        std::array::from_fn(|k| multiply_add::<FUSED>(own, row[k], sum[k]))
    }
}
