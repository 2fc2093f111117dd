//! p = -ε g A and |t| <= c + μ p: contact pressure and friction of a corner, with their derivatives
//! (formulations.md B.5; Bird et al. 2024).
//!
//! Friction is elastic-plastic: the tangential traction is ε times the elastic slip, as long as it stays
//! below the limit; beyond it the corner slides, and the elastic slip keeps the size that belongs to the
//! limit. With v the slip in space (elastic slip of the step's start and the motion against the surface
//! in the step), w = θ (1 - n n) v and θ the share of the step in which there is contact,
//!
//! dw/dx = θ (1 - n n - n (H v) - (n·v) H) + (1 - n n) v θ' n, H = ∇n;
//! t = ε w in stick, t = L w/|w| in slip, L = min(c + μ p, most).

use super::surface::{Near, length};
use crate::tensor::Square;
use crate::tensor::dense::dot;

/// What limits the tangential traction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Friction {
    /// There is none.
    Smooth,
    /// min(adhesion + coefficient p, most); `most` may be infinite.
    Coulomb { coefficient: f64, adhesion: f64, most: f64 },
    /// Nothing slips.
    Rough,
}

/// Of a body on a rigid surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Law {
    /// ε, Pa/m.
    pub penalty: f64,
    pub friction: Friction,
}

/// Where a corner is and how it came there.
#[derive(Debug, Clone, Copy)]
pub struct Reached<const D: usize> {
    pub near: Near<D>,
    /// Gap at the step's start, m.
    pub gap_before: f64,
    /// v, m.
    pub slip: [f64; D],
}

/// What acts on a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response<const D: usize> {
    /// p n - t: force of the surface on the body per area, Pa.
    pub traction: [f64; D],
    /// -d traction / dx, Pa/m.
    pub stiffness: Square<D>,
    /// t / ε, m.
    pub elastic_slip: [f64; D],
    /// Slip that does not come back, m.
    pub sliding: [f64; D],
}

impl<const D: usize> Response<D> {
    /// The forces times `share`.
    pub fn scaled(self, share: f64) -> Self {
        Response {
            traction: self.traction.map(|t| share * t),
            stiffness: self.stiffness.map(|row| row.map(|k| share * k)),
            ..self
        }
    }
}

impl Law {
    /// Whether the stiffness equals its transposed.
    pub fn symmetric(&self) -> bool {
        self.friction == Friction::Smooth
    }

    /// Whether elastic slip is carried from step to step.
    pub fn has_history(&self) -> bool {
        !self.symmetric()
    }

    /// Largest tangential traction under the pressure `p`, Pa, and its derivative by p.
    fn limit(&self, p: f64) -> (f64, f64) {
        match self.friction {
            Friction::Smooth => (0.0, 0.0),
            Friction::Rough => (f64::INFINITY, 0.0),
            Friction::Coulomb { coefficient, adhesion, most } => {
                let pressed = coefficient * p.max(0.0);
                if adhesion + pressed < most {
                    (adhesion + pressed, if p > 0.0 { coefficient } else { 0.0 })
                } else {
                    (most, 0.0)
                }
            }
        }
    }

    /// What acts on a corner at the gap of `reached`, which is taken to touch.
    pub fn respond<const D: usize>(&self, reached: &Reached<D>) -> Response<D> {
        let Near { gap, normal: n, curvature } = reached.near;
        let pressure = -self.penalty * gap;
        let mut traction = n.map(|n| pressure * n);
        let mut stiffness: Square<D> = std::array::from_fn(|i| {
            std::array::from_fn(|j| self.penalty * n[i] * n[j] - pressure * curvature[i][j])
        });
        let still = [0.0; D];
        if self.friction == Friction::Smooth {
            return Response { traction, stiffness, elastic_slip: still, sliding: still };
        }
        let (w, by_x) = slip_in_contact(reached);
        let (limit, by_pressure) = self.limit(pressure);
        let size = length(&w);
        let elastic = self.penalty * size <= limit;
        let tangential: [f64; D] =
            if elastic { w.map(|w| self.penalty * w) } else { w.map(|w| limit * w / size) };
        for i in 0..D {
            traction[i] -= tangential[i];
            for j in 0..D {
                stiffness[i][j] += if elastic {
                    self.penalty * by_x[i][j]
                } else {
                    let along: f64 = (0..D).map(|k| w[k] * by_x[k][j]).sum::<f64>() / size;
                    let turned = (by_x[i][j] - w[i] / size * along) * limit / size;
                    turned - w[i] / size * by_pressure * self.penalty * n[j]
                };
            }
        }
        let elastic_slip = tangential.map(|t| t / self.penalty);
        let sliding = std::array::from_fn(|i| w[i] - elastic_slip[i]);
        Response { traction, stiffness, elastic_slip, sliding }
    }
}

/// w and dw/dx.
fn slip_in_contact<const D: usize>(reached: &Reached<D>) -> ([f64; D], Square<D>) {
    let Near { gap, normal: n, curvature } = reached.near;
    let v = reached.slip;
    let before = reached.gap_before;
    // A corner that was apart touches when its way is done to the share 1 - θ.
    let apart = before > 0.0;
    let share = match apart {
        true if gap < 0.0 => -gap / (before - gap),
        true => 0.0,
        false => 1.0,
    };
    let by_gap = if apart && gap < 0.0 { -before / ((before - gap) * (before - gap)) } else { 0.0 };
    let along = dot(&n, &v);
    let curved: [f64; D] = std::array::from_fn(|i| dot(&curvature[i], &v));
    let flat: [f64; D] = std::array::from_fn(|i| v[i] - along * n[i]);
    let by_x = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let unit = if i == j { 1.0 } else { 0.0 };
            share * (unit - n[i] * n[j] - n[i] * curved[j] - along * curvature[i][j])
                + by_gap * flat[i] * n[j]
        })
    });
    (flat.map(|f| share * f), by_x)
}
