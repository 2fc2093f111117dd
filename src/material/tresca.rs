//! f = tau_1 - tau_3 - 2 c_u = 0 in Kirchhoff stress: Mohr-Coulomb without friction and dilation.

use super::mohr_coulomb::STIFF;
use super::parameter::{POISSON, POSITIVE, Parameter};
use super::{Hencky, Model, MohrCoulomb, Response};

const SHEAR_STRENGTH: Parameter = Parameter::new(
    "shear_strength",
    "Pa",
    POSITIVE,
    "c_u: undrained shear strength, half the largest difference of principal stresses.",
);

/// Perfect Tresca plasticity on Hencky elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tresca {
    pyramid: MohrCoulomb,
    /// c_u, Pa
    strength: f64,
}

impl Model for Tresca {
    const NAME: &'static str = "tresca";
    const DOC: &'static str = "Hencky elasticity with perfect Tresca plasticity: undrained clay.";
    const PARAMETERS: &'static [Parameter] = &[STIFF, POISSON, SHEAR_STRENGTH];

    fn new(p: &[f64]) -> Self {
        let elasticity = Hencky::new(p[0], p[1]);
        let pyramid = MohrCoulomb::with(elasticity, 0.0, 0.0, p[2], f64::INFINITY);
        Tresca { pyramid, strength: p[2] }
    }

    #[inline]
    fn respond(&self, trial: [f64; 3], state: &[f64]) -> Response {
        self.pyramid.respond(trial, state)
    }

    fn elastic_strain(&self, stress: [f64; 3]) -> [f64; 3] {
        self.pyramid.elastic_strain(stress)
    }

    fn energy(&self, elastic_strain: [f64; 3]) -> f64 {
        self.pyramid.energy(elastic_strain)
    }

    fn wave_modulus(&self, elastic_strain: impl FnOnce() -> [f64; 3]) -> f64 {
        self.pyramid.wave_modulus(elastic_strain)
    }

    fn stiffness(&self) -> f64 {
        self.pyramid.stiffness()
    }

    fn strength(&self) -> Option<f64> {
        Some(self.strength)
    }

    fn symmetric(&self) -> bool {
        true
    }
}
