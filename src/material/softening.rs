//! Strength that falls linearly with the accumulated deviatoric plastic strain, or a cohesion that grows
//! with it: κ' - κ = Δ(κ'), where Δ is sqrt(2/3) times the norm of the deviatoric plastic strain of the return to the perfect surface
//! of κ' (formulations.md B.1).
//!
//! With r = d tau / d κ' at a fixed trial strain and Δ_ε, Δ_κ the derivatives of Δ, the consistent
//! tangent is that of the perfect surface and r ⊗ Δ_ε / (1 - Δ_κ).
//!
//! A band of softening material is about a cell wide, whatever the cell. The figures of the deck
//! belong to a band of `length`; the values that a model is made of have the strain brought to the
//! cells, strain length / h. That keeps the energy of a band; it does not keep its place or direction
//! from following the cells.

use super::model::dot;
use super::parameter::{Absence, Parameter, at_least};
use super::{Hencky, Misfit, Response, StateVariable};

/// Newton steps, or halvings, of a return.
const MOST_ITERATIONS: usize = 60;
/// Of κ, in units of the strain over which the strength falls, or of the trial strain.
const PRECISION: f64 = 1e-14;

/// The state variable.
pub(super) const KAPPA: StateVariable =
    StateVariable { name: "softening_strain", unit: "-", initial: 0.0 };

pub(super) const STRAIN: Parameter = Parameter::new(
    "softening.strain",
    "",
    super::parameter::POSITIVE,
    "Accumulated deviatoric plastic strain, sqrt(2/3) of its norm, at which the residual strength is \
     reached, in a band of the length.",
)
.with_table(f64::INFINITY);
pub(super) const LENGTH: Parameter = Parameter::new(
    "softening.length",
    "m",
    super::parameter::POSITIVE,
    "Width of the band that the strain belongs to: in cells of size h the strain is strain length / h.",
)
.with_table(f64::INFINITY);

/// A residual value; without it the parameter stays what it is.
const fn residual(key: &'static str, unit: &'static str, doc: &'static str) -> Parameter {
    Parameter {
        absence: Absence::Means(f64::NAN, "stays what it is"),
        ..Parameter::new(key, unit, at_least(0.0), doc)
    }
}

pub(super) const COHESION: Parameter =
    residual("softening.cohesion", "Pa", "Residual cohesion (tresca: shear strength).");
pub(super) const FRICTION: Parameter =
    residual("softening.friction", "degrees", "Residual angle of friction.");
pub(super) const DILATION: Parameter =
    residual("softening.dilation", "degrees", "Residual angle of dilation.");

/// Needs no length: flow of hardening material spreads.
pub(super) const HARDENING: Parameter = Parameter::new(
    "hardening",
    "Pa",
    at_least(0.0),
    "Growth of the cohesion per accumulated deviatoric plastic strain (sqrt(2/3) of its norm); not beside \
     `softening`.",
)
.absent(0.0, "0");

/// A value that changes linearly with κ, to a last one or without end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Linear {
    first: f64,
    last: f64,
    rate: f64,
}

impl Linear {
    fn steady(value: f64) -> Self {
        Linear { first: value, last: value, rate: 0.0 }
    }

    /// `residual` is not a number where the value stays; `strain`: where the fall ends.
    fn falling(peak: f64, residual: f64, strain: f64) -> Self {
        match residual.is_nan() {
            true => Linear::steady(peak),
            false => Linear { first: peak, last: residual, rate: (residual - peak) / strain },
        }
    }
}

/// How strength changes with κ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Change {
    /// Where it ends; infinite for a cohesion that grows.
    strain: f64,
    friction: Linear,
    dilation: Linear,
    cohesion: Linear,
}

impl Change {
    /// Of peak and residual values (angle of friction, of dilation, cohesion; not a number where one
    /// stays) that are reached at κ = `strain`, or of a cohesion that grows at the rate `hardening`.
    /// `None`: the strength stays.
    pub fn new(strain: f64, hardening: f64, values: [[f64; 2]; 3]) -> Option<Self> {
        if strain.is_finite() {
            let [friction, dilation, cohesion] =
                values.map(|[peak, residual]| Linear::falling(peak, residual, strain));
            return Some(Change { strain, friction, dilation, cohesion });
        }
        let [friction, dilation, mut cohesion] = values.map(|[value, _]| Linear::steady(value));
        cohesion.rate = hardening;
        (hardening > 0.0).then_some(Change { strain, friction, dilation, cohesion })
    }

    /// Angle of friction, of dilation, and cohesion at κ, each with its rate.
    pub fn at(&self, kappa: f64) -> [[f64; 2]; 3] {
        [self.friction, self.dilation, self.cohesion].map(|value| match kappa < self.strain {
            true => [value.first + value.rate * kappa, value.rate],
            false => [value.last, 0.0],
        })
    }

    /// A κ that no return from κ = `kappa` passes, `flow` being the one to the surface of `kappa`.
    fn most(&self, kappa: f64, flow: f64, at: impl Fn(f64) -> f64) -> f64 {
        kappa + if self.strain.is_finite() { at(self.strain) } else { flow }
    }

    /// To which a return's κ is found; `trial`: the elastic trial strain.
    fn precision(&self, kappa: f64, trial: [f64; 3]) -> f64 {
        let size = trial.iter().fold(kappa, |most, strain| most.max(strain.abs()));
        PRECISION * if self.strain.is_finite() { self.strain.min(1.0) } else { size }
    }
}

/// A growing cohesion beside one that falls is refused.
pub(super) fn check_hardening(strain: f64, hardening: f64) -> Result<(), Misfit> {
    if strain.is_finite() && hardening > 0.0 {
        let why = "the cohesion would grow and fall: expected either `hardening` or `softening`";
        return Err(Misfit { key: "hardening", why: why.into() });
    }
    Ok(())
}

/// The response from κ on. `perfect` gives that of the surface of a κ to the trial strain, and the
/// rate of its stress with κ.
pub(super) fn respond(
    elasticity: &Hencky,
    trial: [f64; 3],
    (kappa, change): (f64, &Change),
    perfect: impl Fn(f64) -> (Response, [f64; 3]),
) -> Response {
    let first = perfect(kappa);
    let plastic = first.0.plastic_increment > 0.0;
    let mut found = first;
    let mut end = kappa;
    if plastic {
        let size = flow(trial, &found.0).0;
        let most = change.most(kappa, size, |kappa| flow(trial, &perfect(kappa).0).0);
        let precision = change.precision(kappa, trial);
        let (mut low, mut high) = (kappa, most);
        end = kappa + size;
        for _ in 0..MOST_ITERATIONS {
            end = if end > low && end < high { end } else { 0.5 * (low + high) };
            found = perfect(end);
            let (size, direction) = flow(trial, &found.0);
            let off = end - kappa - size;
            if off.abs() <= precision || high - low <= f64::EPSILON * high {
                break;
            }
            if off < 0.0 {
                low = end
            } else {
                high = end
            }
            end -= off / (1.0 - growth(elasticity, &found, direction));
        }
    }
    let (mut response, rate) = found;
    if plastic && rate != [0.0; 3] {
        let (_, direction) = flow(trial, &response);
        let slope = 1.0 / (1.0 - growth(elasticity, &found, direction));
        // Δ_ε = n - n C d tau / d ε, C the elastic compliance, symmetric.
        let mut with_strain = direction;
        for (b, value) in with_strain.iter_mut().enumerate() {
            let elastic = elasticity.strain([0, 1, 2].map(|a| found.0.tangent[a][b]));
            *value -= dot(direction, elastic);
        }
        for (row, rate) in response.tangent.iter_mut().zip(rate) {
            row.iter_mut().zip(with_strain).for_each(|(entry, b)| *entry += rate * slope * b);
        }
    }
    response.state[0] = end;
    response
}

/// Δ and its derivative by the plastic strain.
fn flow(trial: [f64; 3], response: &Response) -> (f64, [f64; 3]) {
    let flow = [0, 1, 2].map(|a| trial[a] - response.elastic_strain[a]);
    let mean = flow.iter().sum::<f64>() / 3.0;
    let deviator = flow.map(|e| e - mean);
    let size = (2.0 / 3.0 * dot(deviator, deviator)).sqrt();
    let direction = match size > 0.0 {
        true => deviator.map(|e| 2.0 / 3.0 * e / size),
        false => [0.0; 3],
    };
    (size, direction)
}

/// Δ_κ
fn growth(elasticity: &Hencky, (_, rate): &(Response, [f64; 3]), direction: [f64; 3]) -> f64 {
    -dot(direction, elasticity.strain(*rate))
}
