//! f = sqrt(2 J2) - rho_y = 0 in Kirchhoff stress, perfect plasticity, closest-point return
//! (Lagrangian eq. 43; Ghost eq. 29).

use super::{Hencky, Response};

/// A trial state counts as plastic when it lies outside the surface by more than this share of
/// rho_y. Points at yield then start a step with the elastic tangent, whatever the rounding of
/// their stored strain, so that counts of iterations repeat on any number of ranks.
const YIELD_TOLERANCE: f64 = 1e-9;

/// Perfect von Mises plasticity on Hencky elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VonMises {
    pub elasticity: Hencky,
    /// rho_y, Pa: radius of the cylinder in the deviatoric plane.
    pub yield_stress: f64,
}

impl VonMises {
    pub fn new(elasticity: Hencky, yield_stress: f64) -> Self {
        VonMises { elasticity, yield_stress }
    }

    #[inline(always)]
    pub fn respond(&self, trial: [f64; 3]) -> Response {
        let two_mu = 2.0 * self.elasticity.mu;
        let mean = (trial[0] + trial[1] + trial[2]) * (1.0 / 3.0);
        let deviator = trial.map(|e| e - mean);
        let norm = deviator.iter().map(|e| e * e).sum::<f64>().sqrt();
        let radius = two_mu * norm;
        if radius <= self.yield_stress * (1.0 + YIELD_TOLERANCE) {
            return self.elasticity.respond(trial);
        }
        // Radial return: the deviator shrinks by theta, its direction n stays.
        let theta = self.yield_stress / radius;
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
            plastic_increment,
            dissipation: self.yield_stress * plastic_increment,
        }
    }
}
