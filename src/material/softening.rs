//! Strength that falls linearly with the accumulated deviatoric plastic strain: κ' - κ = Δ(κ'), where
//! Δ is sqrt(2/3) times the norm of the deviatoric plastic strain of the return to the perfect surface
//! of κ' (formulations.md B.1).
//!
//! With r = d tau / d κ' at a fixed trial strain and Δ_ε, Δ_κ the derivatives of Δ, the consistent
//! tangent is that of the perfect surface and r ⊗ Δ_ε / (1 - Δ_κ).
//!
//! A band of softening material is about a cell wide, whatever the cell. The figures of the deck
//! belong to a band of `length`; the values that a model is made of have the strain brought to the
//! cells, strain length / h. That keeps the energy of a band; it does not keep its place or direction
//! from following the cells.

use super::parameter::{Absence, Parameter, at_least};
use super::{Hencky, Response, StateVariable};

/// Newton steps, or halvings, of a return.
const MOST_ITERATIONS: usize = 60;
/// Of κ, in units of the strain over which the strength falls.
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

/// A value that falls from its peak to a residual one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Falling {
    peak: f64,
    residual: f64,
}

impl Falling {
    /// `residual` is not a number where the value stays.
    pub fn new(peak: f64, residual: f64) -> Self {
        Falling { peak, residual: if residual.is_nan() { peak } else { residual } }
    }

    /// The value at κ, and its rate; `strain`: where the fall ends.
    pub fn at(&self, kappa: f64, strain: f64) -> [f64; 2] {
        if kappa >= strain {
            return [self.residual, 0.0];
        }
        let rate = (self.residual - self.peak) / strain;
        [self.peak + rate * kappa, rate]
    }
}

/// The response from κ on. `perfect` gives that of the surface of a κ to the trial strain, and the
/// rate of its stress with κ; `strain`: where the fall ends.
pub(super) fn respond(
    elasticity: &Hencky,
    trial: [f64; 3],
    (kappa, strain): (f64, f64),
    perfect: impl Fn(f64) -> (Response, [f64; 3]),
) -> Response {
    let first = perfect(kappa);
    let plastic = first.0.plastic_increment > 0.0;
    let mut found = first;
    let mut end = kappa;
    if plastic {
        let (mut low, mut high) = (kappa, kappa + flow(trial, &perfect(strain).0).0);
        end = kappa + flow(trial, &found.0).0;
        for _ in 0..MOST_ITERATIONS {
            end = if end > low && end < high { end } else { 0.5 * (low + high) };
            found = perfect(end);
            let (size, direction) = flow(trial, &found.0);
            let off = end - kappa - size;
            if off.abs() <= PRECISION * strain.min(1.0) || high - low <= f64::EPSILON * high {
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

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
