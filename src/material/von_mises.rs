//! f = sqrt(2 J2) - rho_y = 0 in Kirchhoff stress, perfect plasticity, closest-point return
//! (Lagrangian eq. 43; Ghost eq. 29).

use super::parameter::{POISSON, POSITIVE, Parameter, YOUNG};
use super::{Hencky, MOST_STATE, Model, Response};

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

/// Perfect von Mises plasticity on Hencky elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VonMises {
    pub elasticity: Hencky,
    /// rho_y, Pa: radius of the cylinder in the deviatoric plane.
    pub radius: f64,
}

impl VonMises {
    /// With the radius rho_y, Pa.
    pub fn perfect(elasticity: Hencky, radius: f64) -> Self {
        VonMises { elasticity, radius }
    }
}

impl Model for VonMises {
    const NAME: &'static str = "von-mises";
    const DOC: &'static str =
        "Hencky elasticity with perfect von Mises plasticity (Lagrangian eq. 43).";
    const PARAMETERS: &'static [Parameter] = &[YOUNG, POISSON, YIELD, YIELD_STRESS, SHEAR_STRENGTH];
    const ALTERNATIVES: &'static [(&'static [&'static str], &'static str)] = &[(
        &["yield", "yield_stress", "shear_strength"],
        "model = \"von-mises\" needs it, or yield_stress (uniaxial), or shear_strength",
    )];

    fn new(parameters: &[f64]) -> Self {
        // One of the three is given, the others are zero.
        let radius = parameters[2]
            + (2.0_f64 / 3.0).sqrt() * parameters[3]
            + std::f64::consts::SQRT_2 * parameters[4];
        VonMises { elasticity: Hencky::new(parameters[0], parameters[1]), radius }
    }

    #[inline(always)]
    fn respond(&self, trial: [f64; 3], _: &[f64]) -> Response {
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

    fn elastic_strain(&self, stress: [f64; 3]) -> [f64; 3] {
        self.elasticity.strain(stress)
    }

    #[inline(always)]
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
