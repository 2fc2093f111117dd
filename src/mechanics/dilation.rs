//! F-bar: dF_bar = (det dF_0 / det dF)^(1/n) dF, the point's distortion with the change of volume of
//! its cells (de Souza Neto et al. 1996, IJSS 33:3277, eq. 8). In plane strain n = 2: it acts in
//! the plane only, where dF_zz = 1 stays. In space and for rings (`ring.rs`) n = 3.
//!
//! The material sees dF_bar: b_e and tau follow from it. Gradients, positions, domains and volumes
//! follow dF. The force is the derivative of the energy Σ V0 psi(dF_bar) by the nodes' displacements,
//! so that it does as much work as the material stores and dissipates. With L = d(dF) dF^-1 it is
//! d(dF_bar) dF_bar^-1 = L + 1 (tr L_0 - tr L) / n, hence
//!
//! f_a = V0 (tau g_a + pi r_a), r_a = (g_0a - g_a) / n, pi = Σ tau_dd over the n directions,
//!
//! g = dF^-T G of the point's gradients and g_0 = dF_0^-T G_0 of its cells'. The pressure thus acts on the
//! cells' change of volume, as its mean over the cell would (mean dilatation: Nagtegaal et al. 1974,
//! CMAME 4:153; Simo, Taylor and Pister 1985, CMAME 51:177). De Souza Neto et al. leave the second term
//! out, and gain or lose energy. With d g_a = -L^T g_a the tangent is that of [`super::contribution`] and
//!
//! V ((R g_a) x r_b + r_a x (l g_b + kappa r_b) + pi/n (g_b x g_a - g_0b x g_0a)),
//!
//! R = dtau for L = 1, l : L = dpi, kappa = Σ R_dd: symmetric where the material's moduli are.
//!
//! The assembly sums the parts of the point's gradients and of its cells' apart: with s = tau - (pi/n) 1 and
//! e_a = Σ_d g_0a of the directions,
//!
//! f_a = V0 (s g_a + (pi/n) e_a),
//! K_ab = V (A' + (Q g_a) x e_b + e_a x (q g_b) + kappa/n^2 e_a x e_b - pi/n g_0b x g_0a),
//!
//! A' the tangent of [`super::contribution`] with s for tau and P c P for the moduli c (P takes the mean over
//! the directions away), n Q = R - kappa/n 1, n q = l - kappa/n 1. Points that share their cells share g_0: of the
//! last three terms the cells need the sums over the points only.
//!
//! For a domain in several cells det dF_0 = Σ w_c det dF_c, hence g_0 = Σ v_c g_c, v_c = w_c det dF_c / det dF_0, and
//! the last term is pi/n (Σ v_c (e_ca x e_cb - g_cb x g_ca) - e_a x e_b), the second derivative of ln det dF_0.

use super::Increment;
use super::tangent::Expansion;
use crate::tensor::dense::{self, Square};

/// dF_bar - 1 from dF - 1 (`increment`) and det dF_0 - 1 (`common`). Not a number where a determinant
/// is not positive.
#[inline(always)]
pub fn within<const D: usize>(increment: &Square<D>, common: f64) -> Square<D> {
    grown(increment, growth(dense::determinant_excess(increment), common, D))
}

/// det dF - 1 with the hoop
#[inline(always)]
pub fn volume_change<const D: usize>(increment: Increment<'_, D>) -> f64 {
    let section = dense::determinant_excess(increment.block);
    section + increment.hoop + section * increment.hoop
}

/// (det dF_0 / det dF)^(1/n) - 1 from the determinants less one, `own` of dF and `common` of dF_0, n = 2 or 3:
/// with all digits where they are small.
#[inline(always)]
pub(crate) fn growth(own: f64, common: f64, directions: usize) -> f64 {
    let excess = (common - own) / (1.0 + own);
    let growth = if directions == 2 {
        excess / (1.0 + (1.0 + excess).sqrt())
    } else {
        let root = (1.0 + excess).cbrt();
        excess / (1.0 + root + root * root)
    };
    if own > -1.0 && common > -1.0 { growth } else { f64::NAN }
}

/// (1 + `growth`) dF - 1
#[inline(always)]
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

/// What F-bar adds to a point's force and tangent (see the top of this file), per volume of the frame.
/// The hoop's parts are zero but for rings.
#[derive(Debug, Clone, Copy)]
pub struct Dilation<const D: usize> {
    /// R_ij and R_zz in the frame, l_kl and l_zz, kappa, pi; Pa.
    pub moduli: Expansion<D>,
    /// 1/n
    pub share: f64,
    /// dF^-1
    here: (Square<D>, f64),
}

impl<const D: usize> Dilation<D> {
    #[inline]
    pub(crate) fn new(moduli: Expansion<D>, share: f64, increment: Increment<'_, D>) -> Self {
        Dilation { moduli, share, here: inverse(increment) }
    }

    /// g of a node, from its gradient and hoop row at the step's start.
    #[inline]
    pub fn own(&self, row: (&[f64; D], f64)) -> ([f64; D], f64) {
        mapped(row, &self.here)
    }

    /// r = (g_0 - g) / n, the hoops' along the radius, from g and g_0.
    #[inline]
    pub fn swelling(&self, own: &([f64; D], f64), common: &([f64; D], f64)) -> [f64; D] {
        swelling(own, common, self.share)
    }

    /// c_b = l g_b + kappa r_b: change of pi by the node's displacement, Pa/m; `frame`: its rows in the frame.
    #[inline]
    pub fn change_of_trace(&self, frame: (&[f64; D], f64), swelling: &[f64; D]) -> [f64; D] {
        let mut change = dense::apply(&self.moduli.onto, frame.0);
        change[0] += self.moduli.hoop_onto * frame.1;
        for (change, r) in change.iter_mut().zip(swelling) {
            *change += self.moduli.own * r;
        }
        change
    }
}

/// r = (g_0 - g) / n of rows in the current state.
#[inline]
pub fn swelling<const D: usize>(
    own: &([f64; D], f64),
    common: &([f64; D], f64),
    share: f64,
) -> [f64; D] {
    let mut row: [f64; D] = std::array::from_fn(|k| share * (common.0[k] - own.0[k]));
    row[0] += share * (common.1 - own.1);
    row
}

/// dF^-1 of dF - 1
#[inline]
pub fn inverse<const D: usize>(increment: Increment<'_, D>) -> (Square<D>, f64) {
    let block = dense::inverse(&dense::plus_unit(increment.block)).0;
    (block, 1.0 / (1.0 + increment.hoop))
}

/// dF^-T of rows at the step's start: those of the current state.
#[inline]
pub fn mapped<const D: usize>(
    (gradient, hoop): (&[f64; D], f64),
    (inverse, hoop_inverse): &(Square<D>, f64),
) -> ([f64; D], f64) {
    let mut row = [0.0; D];
    for (g, line) in gradient.iter().zip(inverse) {
        for (sum, value) in row.iter_mut().zip(line) {
            *sum += g * value;
        }
    }
    (row, hoop * hoop_inverse)
}
