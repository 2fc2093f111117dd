//! f = tau_1 - tau_3 - 2 c_u = 0 in Kirchhoff stress: Mohr-Coulomb without friction and dilation,
//! perfect or softening.

use super::model::elastic_by;
use super::mohr_coulomb::{STIFF, check_residual};
use super::parameter::{POISSON, POSITIVE, Parameter};
use super::{Hencky, Misfit, Model, MohrCoulomb, Response, StateVariable, softening};

const SHEAR_STRENGTH: Parameter = Parameter::new(
    "shear_strength",
    "Pa",
    POSITIVE,
    "c_u: undrained shear strength, half the largest difference of principal stresses.",
);

/// Tresca plasticity on Hencky elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tresca {
    pyramid: MohrCoulomb,
    /// c_u, Pa
    strength: f64,
}

impl Model for Tresca {
    const NAME: &'static str = "tresca";
    const DOC: &'static str =
        "Hencky elasticity with Tresca plasticity, perfect or softening: undrained clay.";
    const PARAMETERS: &'static [Parameter] = &[
        STIFF,
        POISSON,
        SHEAR_STRENGTH,
        softening::STRAIN,
        softening::COHESION,
        softening::LENGTH,
    ];
    const STATE: &'static [StateVariable] = &[softening::KAPPA];

    fn new(p: &[f64]) -> Self {
        let elasticity = Hencky::new(p[0], p[1]);
        let pyramid = MohrCoulomb::with(elasticity, 0.0, 0.0, p[2], f64::INFINITY);
        let pyramid = pyramid.changing(p[3], 0.0, [[0.0; 2], [0.0; 2], [p[2], p[4]]]);
        Tresca { pyramid, strength: p[2] }
    }

    fn check(p: &[f64]) -> Result<(), Misfit> {
        check_residual(p[3], [[0.0; 2], [0.0; 2], [p[2], p[4]]]).map(drop)
    }

    fn state_words(&self) -> usize {
        self.pyramid.state_words()
    }

    #[inline]
    fn respond(&self, trial: [f64; 3], state: &[f64]) -> Response {
        self.pyramid.respond(trial, state)
    }

    elastic_by!(pyramid);

    fn strength(&self) -> Option<f64> {
        Some(self.strength)
    }

    fn symmetric(&self) -> bool {
        self.pyramid.symmetric()
    }
}
