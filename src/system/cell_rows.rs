//! The rows of cells that points share with F-bar, and what these points hand to them
//! ([`crate::mechanics::dilation`]): summed while point after point has the cells of the one before it, so that
//! dF_0, its rows and their products are made once for all of them.

use std::ops::Range;

use crate::basis::Influences;
use crate::mechanics::dilation::{inverse, mapped, volume_change};
use crate::mechanics::{Expansion, Increment};
use crate::tensor::fused::multiply_add;

/// Cells of the last points of a group, and the sums over these points.
#[derive(Default)]
pub(crate) struct CellRows<const D: usize> {
    /// Entries of the influences that have the rows; empty before the first point.
    entries: Range<usize>,
    /// det dF_0 - 1 with the hoop
    pub volume_change: f64,
    /// g_0 of each node, 1/m, and of rings the hoop's
    pub gradients: Vec<([f64; D], f64)>,
    /// e: g_0 with the hoop's along the radius
    pub expansion: Vec<[f64; D]>,
    /// Σ V q g of each node, N/m^2 times m^2
    onto: Vec<[f64; D]>,
    /// Σ V kappa/n^2
    own: f64,
    /// Σ V pi/n
    pub trace: f64,
}

impl<const D: usize> CellRows<D> {
    /// Forgets the cells: another group has other nodes.
    pub fn leave(&mut self) {
        self.entries = 0..0;
    }

    /// Points have been added to cells.
    pub fn is_open(&self) -> bool {
        !self.entries.is_empty()
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

    /// Begins the sums of other cells, whose rows are at `entries` and whose dF_0 - 1 is `increment`.
    #[inline(always)]
    pub fn enter(
        &mut self,
        influences: &Influences<D>,
        entries: Range<usize>,
        increment: Increment<'_, D>,
    ) {
        let rows = &influences.centre_gradients[entries.clone()];
        let hoops = influences.centre_hoop.get(entries.clone()).unwrap_or_default();
        self.entries = entries;
        self.volume_change = volume_change(increment);
        let common = inverse(increment);
        self.gradients.clear();
        self.expansion.clear();
        for (a, row) in rows.iter().enumerate() {
            let hoop = hoops.get(a).copied().unwrap_or(0.0);
            let (gradient, hoop) = mapped((row, hoop), &common);
            let mut expansion = gradient;
            expansion[0] += hoop;
            self.gradients.push((gradient, hoop));
            self.expansion.push(expansion);
        }
        self.onto.clear();
        self.onto.resize(rows.len(), [0.0; D]);
        (self.own, self.trace) = (0.0, 0.0);
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

    /// Σ V (q g_b + kappa/n^2 e_b) of node `b`, N
    #[inline(always)]
    pub fn change<const FUSED: bool>(&self, b: usize) -> [f64; D] {
        let (sum, row) = (&self.onto[b], &self.expansion[b]);
        std::array::from_fn(|k| multiply_add::<FUSED>(self.own, row[k], sum[k]))
    }
}
