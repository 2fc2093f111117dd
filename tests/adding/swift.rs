//! f = sqrt(2 J2) - rho(alpha) = 0 in Kirchhoff stress with the hardening of Swift (J. Mech. Phys.
//! Solids 1 (1952) 1-18):
//!
//! rho(alpha) = sqrt(2/3) sigma_y (1 + alpha / alpha_0)^n
//!
//! in the equivalent plastic strain alpha. The return is radial; its length x solves
//! 2 mu (|dev trial| - x) = rho(alpha + sqrt(2/3) x), whose right side is concave.

use mpm_par::material::parameter::{POISSON, POSITIVE, Parameter, YOUNG, between};
use mpm_par::material::{Hencky, MOST_STATE, Model, Response, StateVariable};

const YIELD_STRESS: Parameter =
    Parameter::new("yield_stress", "Pa", POSITIVE, "sigma_y: first yield in uniaxial tension.");
const STRAIN: Parameter = Parameter::new(
    "hardening_strain",
    "",
    POSITIVE,
    "alpha_0: equivalent plastic strain that hardening is measured by.",
);
const EXPONENT: Parameter = Parameter::new(
    "hardening_exponent",
    "",
    between(0.0, 1.0),
    "n: power of hardening; 0 is perfect plasticity.",
);

/// Swift plasticity on Hencky elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swift {
    pub elasticity: Hencky,
    /// Radius of the cylinder at first yield, Pa.
    radius: f64,
    /// alpha_0
    strain: f64,
    /// n
    exponent: f64,
}

impl Swift {
    /// rho and its derivative by alpha, Pa.
    fn grown(&self, alpha: f64) -> (f64, f64) {
        let base = 1.0 + alpha / self.strain;
        let radius = self.radius * base.powf(self.exponent);
        (radius, self.exponent * radius / (self.strain * base))
    }
}

impl Model for Swift {
    const NAME: &'static str = "swift";
    const DOC: &'static str = "Hencky elasticity, von Mises plasticity with power hardening.";
    const PARAMETERS: &'static [Parameter] = &[YOUNG, POISSON, YIELD_STRESS, STRAIN, EXPONENT];
    const STATE: &'static [StateVariable] =
        &[StateVariable { name: "equivalent_plastic_strain", unit: "-", initial: 0.0 }];

    fn new(p: &[f64]) -> Self {
        let radius = (2.0_f64 / 3.0).sqrt() * p[2];
        Swift { elasticity: Hencky::new(p[0], p[1]), radius, strain: p[3], exponent: p[4] }
    }

    fn respond(&self, trial: [f64; 3], state: &[f64]) -> Response {
        let (two_mu, bulk) = (2.0 * self.elasticity.mu, self.elasticity.bulk_modulus());
        let share = (2.0_f64 / 3.0).sqrt();
        let alpha = state[0];
        let mut after = [0.0; MOST_STATE];
        after[0] = alpha;
        let mean = (trial[0] + trial[1] + trial[2]) / 3.0;
        let deviator = trial.map(|e| e - mean);
        let norm = deviator.iter().map(|e| e * e).sum::<f64>().sqrt();
        let (mut radius, mut slope) = self.grown(alpha);
        // A little outside is still elastic, so that points at yield do not flicker.
        if two_mu * norm <= radius * (1.0 + 1e-9) {
            return self.elasticity.respond_with(trial, after);
        }
        // The excess is convex in the length: after one step Newton's method comes from the left.
        let mut length = 0.0;
        for _ in 0..50 {
            let more = (two_mu * (norm - length) - radius) / (two_mu + share * slope);
            length += more;
            (radius, slope) = self.grown(alpha + share * length);
            if more.abs() <= 4.0 * f64::EPSILON * length {
                break;
            }
        }
        let theta = 1.0 - length / norm;
        let growing = share * slope / (two_mu + share * slope);
        let direction = deviator.map(|e| e / norm);
        let tangent = std::array::from_fn(|a| {
            std::array::from_fn(|b| {
                let identity = if a == b { 1.0 } else { 0.0 };
                let along = direction[a] * direction[b];
                bulk + two_mu * (theta * (identity - 1.0 / 3.0 - along) + growing * along)
            })
        });
        after[0] = alpha + share * length;
        Response {
            stress: deviator.map(|e| 3.0 * bulk * mean + two_mu * theta * e),
            elastic_strain: deviator.map(|e| mean + theta * e),
            tangent,
            shear: [two_mu * theta; 3],
            state: after,
            plastic_increment: length,
            dissipation: radius * length,
        }
    }

    fn elastic_strain(&self, stress: [f64; 3]) -> [f64; 3] {
        self.elasticity.strain(stress)
    }

    fn energy(&self, elastic_strain: [f64; 3]) -> f64 {
        self.elasticity.energy(elastic_strain)
    }

    fn wave_modulus(&self, _: impl FnOnce() -> [f64; 3]) -> f64 {
        self.elasticity.p_wave_modulus()
    }

    fn stiffness(&self) -> f64 {
        self.elasticity.young
    }

    fn strength(&self) -> Option<f64> {
        Some(self.radius)
    }

    fn symmetric(&self) -> bool {
        true
    }
}
