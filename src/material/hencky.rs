//! tau = lambda tr(eps_e) 1 + 2 mu eps_e (Lagrangian §2: linear between logarithmic elastic
//! strain and Kirchhoff stress).

use super::Response;

/// Hencky elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hencky {
    /// First Lamé parameter, Pa.
    pub lambda: f64,
    /// Shear modulus, Pa.
    pub mu: f64,
}

impl Hencky {
    /// From Young's modulus (Pa) and Poisson's ratio (below 0.5, checked by the deck).
    pub fn new(young: f64, poisson: f64) -> Self {
        Hencky {
            lambda: young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
            mu: young / (2.0 * (1.0 + poisson)),
        }
    }

    pub fn bulk_modulus(&self) -> f64 {
        self.lambda + 2.0 / 3.0 * self.mu
    }

    /// lambda + 2 mu, Pa: with the density it gives the speed of pressure waves.
    pub fn p_wave_modulus(&self) -> f64 {
        self.lambda + 2.0 * self.mu
    }

    /// Principal Kirchhoff stresses of principal elastic strains.
    #[inline]
    pub fn stress(&self, strain: [f64; 3]) -> [f64; 3] {
        let volumetric = self.lambda * (strain[0] + strain[1] + strain[2]);
        strain.map(|e| volumetric + 2.0 * self.mu * e)
    }

    /// Stored energy per unit of initial volume, J/m3.
    #[inline]
    pub fn energy(&self, strain: [f64; 3]) -> f64 {
        let trace = strain[0] + strain[1] + strain[2];
        let square: f64 = strain.iter().map(|e| e * e).sum();
        0.5 * self.lambda * trace * trace + self.mu * square
    }

    #[inline(always)]
    pub fn respond(&self, trial: [f64; 3]) -> Response {
        let mut tangent = [[self.lambda; 3]; 3];
        for (a, row) in tangent.iter_mut().enumerate() {
            row[a] += 2.0 * self.mu;
        }
        Response {
            stress: self.stress(trial),
            elastic_strain: trial,
            tangent,
            shear: [2.0 * self.mu; 3],
            plastic_increment: 0.0,
            dissipation: 0.0,
        }
    }
}
