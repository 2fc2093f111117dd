//! tau = lambda tr(eps_e) 1 + 2 mu eps_e (Lagrangian §2: linear between logarithmic elastic
//! strain and Kirchhoff stress).

use super::parameter::{POISSON, Parameter, YOUNG};
use super::{MOST_STATE, Model, Response};

/// Hencky elasticity.
///
/// ```
/// use mpm_par::material::{Hencky, Model};
///
/// // A bar that is pulled and may contract: sigma = E eps.
/// let steel = Hencky::new(210e9, 0.3);
/// let found = steel.respond([1e-3, -0.3e-3, -0.3e-3], &[]);
/// assert!((found.stress[0] - 210e6).abs() < 1.0 && found.stress[1].abs() < 1.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hencky {
    /// First Lamé parameter, Pa.
    pub lambda: f64,
    /// Shear modulus, Pa.
    pub mu: f64,
    /// Young's modulus, Pa.
    pub young: f64,
}

impl Hencky {
    /// From Young's modulus (Pa) and Poisson's ratio (below 0.5, checked by the deck).
    pub fn new(young: f64, poisson: f64) -> Self {
        Hencky {
            lambda: young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
            mu: young / (2.0 * (1.0 + poisson)),
            young,
        }
    }

    /// Bulk modulus, Pa.
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

    /// Principal elastic strains of principal Kirchhoff stresses. Not finite without stiffness.
    pub fn strain(&self, stress: [f64; 3]) -> [f64; 3] {
        let trace = stress[0] + stress[1] + stress[2];
        let mean = self.lambda / (3.0 * self.lambda + 2.0 * self.mu) * trace;
        stress.map(|s| (s - mean) / (2.0 * self.mu))
    }

    /// Stored energy per unit of initial volume, J/m3.
    #[inline]
    pub fn energy(&self, strain: [f64; 3]) -> f64 {
        let trace = strain[0] + strain[1] + strain[2];
        let square: f64 = strain.iter().map(|e| e * e).sum();
        0.5 * self.lambda * trace * trace + self.mu * square
    }

    /// The response without plastic flow; `state` stays what it is.
    #[inline(always)]
    pub fn respond_with(&self, trial: [f64; 3], state: [f64; MOST_STATE]) -> Response {
        Response::elastic(trial, self.stress(trial), [self.lambda, 2.0 * self.mu], state)
    }
}

impl Model for Hencky {
    const NAME: &'static str = "hencky";
    const DOC: &'static str = "Hencky elasticity (Lagrangian §2).";
    const PARAMETERS: &'static [Parameter] = &[YOUNG, POISSON];

    fn new(parameters: &[f64]) -> Self {
        Hencky::new(parameters[0], parameters[1])
    }

    #[inline(always)]
    fn respond(&self, trial: [f64; 3], _: &[f64]) -> Response {
        self.respond_with(trial, [0.0; MOST_STATE])
    }

    fn elastic_strain(&self, stress: [f64; 3]) -> [f64; 3] {
        self.strain(stress)
    }

    #[inline(always)]
    fn energy(&self, elastic_strain: [f64; 3]) -> f64 {
        self.energy(elastic_strain)
    }

    fn wave_modulus(&self, _: impl FnOnce() -> [f64; 3]) -> f64 {
        self.p_wave_modulus()
    }

    fn stiffness(&self) -> f64 {
        self.young
    }

    fn symmetric(&self) -> bool {
        true
    }
}
