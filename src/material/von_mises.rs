//! f = sqrt(2 J2) - rho(alpha) = 0 in Kirchhoff stress, closest-point return (Lagrangian eq. 43;
//! Ghost eq. 29): perfect, or with isotropic hardening (Simo, Hughes 1998, section 3.3)
//!
//! rho(alpha) = sqrt(2/3) (sigma_y + H alpha + (sigma_s - sigma_y) (1 - exp(-delta alpha)))
//!
//! in the equivalent plastic strain alpha = sum of sqrt(2/3) |increment of plastic strain|. The
//! return is radial; its length x solves 2 mu (|dev trial| - x) = rho(alpha + sqrt(2/3) x), which is
//! convex and falls in x: Newton's method from x = 0 comes up to the root and never passes it.

use super::model::elastic_by;
use super::parameter::{POISSON, POSITIVE, Parameter, YOUNG, at_least};
use super::{Hencky, MOST_STATE, Misfit, Model, Response, StateVariable};

/// A trial state counts as plastic when it lies outside the surface by more than this share of
/// rho_y. Points at yield then start a step with the elastic tangent, whatever the rounding of
/// their stored strain, so that counts of iterations repeat on any number of ranks.
const YIELD_TOLERANCE: f64 = 1e-9;

/// rho_y in the deck.
const YIELD: Parameter = Parameter::new(
    "yield",
    "Pa",
    POSITIVE,
    "rho_y: radius sqrt(2 J2) of the Kirchhoff stress at yield, as in the papers (Lagrangian eq. 43).",
)
.absent(0.0, "or yield_stress, or shear_strength");

/// sigma_y in the deck: J2 = sigma_y^2 / 3 in uniaxial tension.
const YIELD_STRESS: Parameter = Parameter::new(
    "yield_stress",
    "Pa",
    POSITIVE,
    "sigma_y: stress at yield in uniaxial tension; rho_y = sqrt(2/3) sigma_y.",
)
.absent(0.0, "or yield, or shear_strength");

/// c_u in the deck: J2 = c_u^2 in pure shear.
pub(super) const SHEAR_STRENGTH: Parameter = Parameter::new(
    "shear_strength",
    "Pa",
    POSITIVE,
    "c_u: stress at yield in pure shear, as of undrained clay; rho_y = sqrt(2) c_u.",
)
.absent(0.0, "or yield, or yield_stress");

/// H in the deck.
const HARDENING: Parameter = Parameter::new(
    "hardening",
    "Pa",
    at_least(0.0),
    "H: growth of the uniaxial yield stress per equivalent plastic strain.",
)
.absent(0.0, "0");

/// sigma_s in the deck.
const SATURATION: Parameter = Parameter::new(
    "saturation.stress",
    "Pa",
    POSITIVE,
    "sigma_s: uniaxial yield stress that Voce hardening tends to, at least that at first yield \
     (`hardening` adds to it).",
)
.with_table(0.0);

/// delta in the deck.
const RATE: Parameter = Parameter::new(
    "saturation.rate",
    "",
    POSITIVE,
    "delta: Voce hardening is complete to 1/e of the difference at the equivalent plastic strain \
     1/delta.",
)
.with_table(0.0);

/// Largest number of Newton steps of a return; quadratic, so that half of them are never taken.
const MOST_ITERATIONS: usize = 50;

/// Von Mises plasticity on Hencky elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VonMises {
    /// Below yield.
    pub elasticity: Hencky,
    /// rho_y, Pa: radius of the cylinder in the deviatoric plane at first yield.
    pub radius: f64,
    /// sqrt(2/3) H, Pa: linear growth of the radius.
    linear: f64,
    /// sqrt(2/3) (sigma_s - sigma_y), Pa: growth of the radius that saturates.
    saturating: f64,
    /// delta
    rate: f64,
}

impl VonMises {
    /// With the radius rho_y, Pa.
    pub fn perfect(elasticity: Hencky, radius: f64) -> Self {
        VonMises { elasticity, radius, linear: 0.0, saturating: 0.0, rate: 0.0 }
    }

    fn hardens(&self) -> bool {
        self.linear > 0.0 || self.saturating > 0.0
    }

    /// rho and d rho / d alpha at an equivalent plastic strain, Pa.
    fn grown(&self, alpha: f64) -> (f64, f64) {
        let left = (-self.rate * alpha).exp();
        let radius = self.radius + self.linear * alpha + self.saturating * (1.0 - left);
        (radius, self.linear + self.saturating * self.rate * left)
    }

    /// [`Model::respond`] where the radius grows with the equivalent plastic strain `alpha`.
    #[inline(never)]
    fn respond_hardening(&self, trial: [f64; 3], alpha: f64) -> Response {
        let (two_mu, bulk) = (2.0 * self.elasticity.mu, self.elasticity.bulk_modulus());
        let share = (2.0_f64 / 3.0).sqrt();
        let mean = (trial[0] + trial[1] + trial[2]) * (1.0 / 3.0);
        let deviator = trial.map(|e| e - mean);
        let norm = deviator.iter().map(|e| e * e).sum::<f64>().sqrt();
        let (mut radius, mut slope) = self.grown(alpha);
        if two_mu * norm <= radius * (1.0 + YIELD_TOLERANCE) {
            let mut state = [0.0; MOST_STATE];
            state[0] = alpha;
            return self.elasticity.respond_with(trial, state);
        }
        let mut length = 0.0;
        for _ in 0..MOST_ITERATIONS {
            let excess = two_mu * (norm - length) - radius;
            let more = excess / (two_mu + share * slope);
            // Rounding alone is left where a step goes back or no longer changes the length.
            if more.is_nan() || more <= 4.0 * f64::EPSILON * length {
                break;
            }
            length += more;
            (radius, slope) = self.grown(alpha + share * length);
        }
        let theta = radius / (two_mu * norm);
        let growing = share * slope / (two_mu + share * slope);
        let direction = deviator.map(|e| e / norm);
        let mut tangent = [[0.0; 3]; 3];
        for a in 0..3 {
            for b in 0..3 {
                let identity = if a == b { 1.0 } else { 0.0 };
                let along = direction[a] * direction[b];
                tangent[a][b] =
                    bulk + two_mu * (theta * (identity - 1.0 / 3.0 - along) + growing * along);
            }
        }
        let plastic_increment = norm * (1.0 - theta);
        let mut state = [0.0; MOST_STATE];
        state[0] = alpha + share * plastic_increment;
        Response {
            stress: deviator.map(|e| 3.0 * bulk * mean + two_mu * theta * e),
            elastic_strain: deviator.map(|e| mean + theta * e),
            tangent,
            shear: [two_mu * theta; 3],
            state,
            plastic_increment,
            dissipation: radius * plastic_increment,
        }
    }
}

impl Model for VonMises {
    const NAME: &'static str = "von-mises";
    const DOC: &'static str = "Hencky elasticity with von Mises plasticity (Lagrangian eq. 43), perfect or with isotropic \
         hardening, linear and saturating (Voce).";
    const PARAMETERS: &'static [Parameter] =
        &[YOUNG, POISSON, YIELD, YIELD_STRESS, SHEAR_STRENGTH, HARDENING, SATURATION, RATE];
    const ALTERNATIVES: &'static [(&'static [&'static str], &'static str)] = &[(
        &["yield", "yield_stress", "shear_strength"],
        "model = \"von-mises\" needs it, or yield_stress (uniaxial), or shear_strength",
    )];

    const STATE: &'static [StateVariable] =
        &[StateVariable { name: "equivalent_plastic_strain", unit: "-", initial: 0.0 }];

    fn new(parameters: &[f64]) -> Self {
        let radius = first_radius(parameters);
        let share = (2.0_f64 / 3.0).sqrt();
        let saturates = parameters[7] > 0.0;
        VonMises {
            elasticity: Hencky::new(parameters[0], parameters[1]),
            radius,
            linear: share * parameters[5],
            saturating: if saturates { (share * parameters[6] - radius).max(0.0) } else { 0.0 },
            rate: parameters[7],
        }
    }

    fn check(parameters: &[f64]) -> Result<(), Misfit> {
        let first = first_radius(parameters) / (2.0_f64 / 3.0).sqrt();
        let last = parameters[6];
        if parameters[7] > 0.0 && last < first * (1.0 - 1e-12) {
            let why = format!(
                "{last} Pa is less than the uniaxial yield stress {first} Pa: the material would \
                 soften; expected at least that"
            );
            return Err(Misfit { key: "saturation.stress", why });
        }
        Ok(())
    }

    fn state_words(&self) -> usize {
        usize::from(self.hardens())
    }

    #[inline(always)]
    fn respond(&self, trial: [f64; 3], state: &[f64]) -> Response {
        // Only bodies that harden somewhere carry the word.
        if let Some(&alpha) = state.first() {
            return self.respond_hardening(trial, alpha);
        }
        let two_mu = 2.0 * self.elasticity.mu;
        let mean = (trial[0] + trial[1] + trial[2]) * (1.0 / 3.0);
        let deviator = trial.map(|e| e - mean);
        let norm = deviator.iter().map(|e| e * e).sum::<f64>().sqrt();
        let radius = two_mu * norm;
        if radius <= self.radius * (1.0 + YIELD_TOLERANCE) {
            return self.elasticity.respond_with(trial, [0.0; MOST_STATE]);
        }
        // Radial return: the deviator shrinks by theta, its direction n stays.
        let theta = self.radius / radius;
        let direction = deviator.map(|e| e / norm);
        let pressure = 3.0 * self.elasticity.bulk_modulus() * mean;
        let bulk = self.elasticity.bulk_modulus();
        let mut tangent = [[0.0; 3]; 3];
        for a in 0..3 {
            for b in 0..3 {
                let identity = if a == b { 1.0 } else { 0.0 };
                tangent[a][b] =
                    bulk + two_mu * theta * (identity - 1.0 / 3.0 - direction[a] * direction[b]);
            }
        }
        let plastic_increment = norm * (1.0 - theta);
        Response {
            stress: deviator.map(|e| pressure + two_mu * theta * e),
            elastic_strain: deviator.map(|e| mean + theta * e),
            tangent,
            shear: [two_mu * theta; 3],
            state: [0.0; MOST_STATE],
            plastic_increment,
            dissipation: self.radius * plastic_increment,
        }
    }

    elastic_by!(elasticity);

    fn strength(&self) -> Option<f64> {
        Some(self.radius)
    }

    fn symmetric(&self) -> bool {
        true
    }
}

/// rho_y (Pa) of the one of the three strengths that is given; the others are zero.
fn first_radius(parameters: &[f64]) -> f64 {
    parameters[2]
        + (2.0_f64 / 3.0).sqrt() * parameters[3]
        + std::f64::consts::SQRT_2 * parameters[4]
}
