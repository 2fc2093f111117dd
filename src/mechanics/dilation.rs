//! F-bar: dF_bar = (det dF_0 / det dF)^(1/D) dF, the point's distortion with the change of volume of
//! its cells (de Souza Neto et al. 1996, IJSS 33:3277, eq. 8); in plane strain it acts in
//! the plane only, where dF_zz = 1 stays. Rings (`ring.rs`) take all three directions.
//!
//! The material sees dF_bar: b_e and tau follow from it. Gradients, positions, domains and volumes
//! follow dF, so that sigma = tau / det F is integrated over the true volume. With L = d(dF) dF^-1:
//! d(dF_bar) dF_bar^-1 = L + 1 (tr L_0 - tr L) / D. The part along L is the tangent of
//! [`super::contribution`] at dF_bar, the rest one product per point: dtau for L = 1 times
//! (tr L_0 - tr L) / D. Without a counterpart in the rows it makes the tangent unsymmetric.

use super::Increment;
use crate::tensor::dense::{self, Square};
use crate::tensor::spectral::ln_1p;

/// dF_bar - 1 from dF - 1 (`increment`) and dF_0 - 1 (`centre`). Not a number where a determinant
/// is not positive.
#[inline]
pub fn averaged<const D: usize>(increment: &Square<D>, centre: &Square<D>) -> Square<D> {
    let [own, common] = [increment, centre].map(|h| ln_1p(dense::determinant_excess(h)));
    grown(increment, ((common - own) / D as f64).exp_m1())
}

/// ln det dF of a ring
#[inline]
pub(crate) fn logarithm<const D: usize>(increment: Increment<'_, D>) -> f64 {
    ln_1p(dense::determinant_excess(increment.block)) + ln_1p(increment.hoop)
}

/// (1 + `growth`) dF - 1
#[inline]
pub(crate) fn grown<const D: usize>(increment: &Square<D>, growth: f64) -> Square<D> {
    let mut grown = *increment;
    for (i, row) in grown.iter_mut().enumerate() {
        for (j, value) in row.iter_mut().enumerate() {
            let whole = if i == j { 1.0 + *value } else { *value };
            *value += growth * whole;
        }
    }
    grown
}

/// What F-bar adds to a point's tangent: K_aibk += (dS_a/dy_j) R_ij r_bk V.
#[derive(Debug, Clone, Copy)]
pub struct Dilation<const D: usize> {
    /// R_ij: change of T for a uniform expansion L = 1 of what the material sees, Pa.
    pub rate: Square<D>,
    /// dF^-1
    here: Square<D>,
    /// dF_0^-1
    centre: Square<D>,
}

impl<const D: usize> Dilation<D> {
    #[inline]
    pub(crate) fn new(rate: Square<D>, increment: &Square<D>, centre: &Square<D>) -> Self {
        let inverse = |h: &Square<D>| dense::inverse(&dense::plus_unit(h)).0;
        Dilation { rate, here: inverse(increment), centre: inverse(centre) }
    }

    /// r_b = (dF_0^-T G_0b - dF^-T G_b) / D, 1/m, of a node's gradients G_b at the point and G_0b
    /// of the cells.
    #[inline]
    pub fn row(&self, gradient: &[f64; D], centre: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|k| {
            let mut sum = 0.0;
            for m in 0..D {
                sum += centre[m] * self.centre[m][k] - gradient[m] * self.here[m][k];
            }
            sum / D as f64
        })
    }
}
