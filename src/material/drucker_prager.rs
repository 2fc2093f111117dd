//! f = sqrt(J2) + eta p - xi c = 0 in Kirchhoff stress (p mean stress, tension positive), with the
//! potential of the same form in eta_bar: closed-form return to the cone or to its apex
//! p = xi c / eta (de Souza Neto, Peric, Owen 2008, section 8.3).

use super::mohr_coulomb::{COHESION, DILATION, FRICTION, STIFF, check_cone};
use super::parameter::{POISSON, Parameter};
use super::{Hencky, MOST_STATE, Misfit, Model, Response};

/// Share of the compared stresses; see the same constant of [`super::VonMises`].
const YIELD_TOLERANCE: f64 = 1e-10;

const FIT: Parameter = Parameter::choice(
    "fit",
    &["plane-strain", "outer", "inner"],
    "\"plane-strain\"",
    "Which cone stands for the Mohr-Coulomb pyramid: plane strain at collapse, through its outer \
     (triaxial compression) or inner (extension) edges.",
);

/// Drucker-Prager plasticity with apex on Hencky elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DruckerPrager {
    pub elasticity: Hencky,
    eta: f64,
    /// xi c, Pa
    strength: f64,
    eta_bar: f64,
}

/// eta (or eta_bar) and xi of an angle in degrees, by the place of the word in [`FIT`].
fn cone(degrees: f64, fit: f64) -> [f64; 2] {
    let angle = degrees.to_radians();
    let (sine, cosine, tangent) = (angle.sin(), angle.cos(), angle.tan());
    match fit as usize {
        0 => {
            let root = (9.0 + 12.0 * tangent * tangent).sqrt();
            [3.0 * tangent / root, 3.0 / root]
        }
        1 => [6.0 * sine, 6.0 * cosine].map(|x| x / (3.0_f64.sqrt() * (3.0 - sine))),
        _ => [6.0 * sine, 6.0 * cosine].map(|x| x / (3.0_f64.sqrt() * (3.0 + sine))),
    }
}

impl Model for DruckerPrager {
    const NAME: &'static str = "drucker-prager";
    const DOC: &'static str = "Hencky elasticity with a perfectly plastic Drucker-Prager cone and \
        its apex, non-associated where dilation differs from friction.";
    const PARAMETERS: &'static [Parameter] = &[STIFF, POISSON, FRICTION, DILATION, COHESION, FIT];

    fn new(p: &[f64]) -> Self {
        let ([eta, xi], [eta_bar, _]) = (cone(p[2], p[5]), cone(p[3], p[5]));
        DruckerPrager { elasticity: Hencky::new(p[0], p[1]), eta, strength: xi * p[4], eta_bar }
    }

    fn check(p: &[f64]) -> Result<(), Misfit> {
        check_cone(p[2], p[3], p[4])
    }

    #[inline(never)]
    fn respond(&self, trial: [f64; 3], _: &[f64]) -> Response {
        let (bulk, mu) = (self.elasticity.bulk_modulus(), self.elasticity.mu);
        let volume = trial[0] + trial[1] + trial[2];
        let deviator = trial.map(|e| e - volume * (1.0 / 3.0));
        let norm = deviator.iter().map(|e| e * e).sum::<f64>().sqrt();
        // sqrt(J2) = sqrt(2) mu |dev eps|
        let (shear_stress, pressure) = (std::f64::consts::SQRT_2 * mu * norm, bulk * volume);
        let excess = shear_stress + self.eta * pressure - self.strength;
        let scale = shear_stress + self.eta * pressure.abs() + self.strength;
        if excess <= YIELD_TOLERANCE * scale || excess.is_nan() {
            return self.elasticity.respond_with(trial, [0.0; MOST_STATE]);
        }
        let compliance = 1.0 / (mu + bulk * self.eta * self.eta_bar);
        let multiplier = compliance * excess;
        let on_cone = shear_stress - mu * multiplier >= 0.0;
        let mut tangent = [[0.0; 3]; 3];
        let (stress, shear) = if on_cone {
            let share = mu * multiplier / shear_stress;
            let direction = deviator.map(|e| e / norm);
            let mean = pressure - bulk * self.eta_bar * multiplier;
            let root = std::f64::consts::SQRT_2 * mu * compliance * bulk;
            let volumetric = bulk * (1.0 - bulk * self.eta * self.eta_bar * compliance);
            for a in 0..3 {
                for b in 0..3 {
                    let identity = if a == b { 2.0 / 3.0 } else { -1.0 / 3.0 };
                    let (x, y) = (direction[a], direction[b]);
                    tangent[a][b] = 2.0 * mu * (1.0 - share) * identity
                        + 2.0 * mu * (share - mu * compliance) * x * y
                        - root * (self.eta * x + self.eta_bar * y)
                        + volumetric;
                }
            }
            let kept = 2.0 * mu * (1.0 - share);
            (deviator.map(|e| mean + kept * e), kept)
        } else {
            ([self.strength / self.eta; 3], 0.0)
        };
        let elastic_strain = self.elasticity.strain(stress);
        let flow = [0, 1, 2].map(|a| trial[a] - elastic_strain[a]);
        Response {
            stress,
            elastic_strain,
            tangent,
            shear: [shear; 3],
            state: [0.0; MOST_STATE],
            plastic_increment: flow.iter().map(|e| e * e).sum::<f64>().sqrt(),
            dissipation: (0..3).map(|a| stress[a] * flow[a]).sum(),
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

    fn symmetric(&self) -> bool {
        self.eta == self.eta_bar
    }
}
