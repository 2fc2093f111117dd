//! f = sqrt(J2) + eta p - xi c = 0 in Kirchhoff stress (p mean stress, tension positive), with the
//! potential of the same form in eta_bar: closed-form return to the cone or to its apex
//! p = xi c / eta (de Souza Neto, Peric, Owen 2008, section 8.3); with `softening` cohesion and angles
//! fall with the plastic strain, with `hardening` the cohesion grows ([`super::softening`]).

use super::model::{elastic_by, perfect_or_changing};
use super::mohr_coulomb::{check_parameters, ends_of_cone, of_cone};
use super::parameter::Parameter;
use super::softening::{self, Change};
use super::{Hencky, MOST_STATE, Misfit, Model, Response, StateVariable};

/// Share of the compared stresses; see the same constant of [`super::VonMises`].
const YIELD_TOLERANCE: f64 = 1e-10;

const FIT: Parameter = Parameter::choice(
    "fit",
    &["plane-strain", "outer", "inner"],
    "\"plane-strain\"",
    "Which cone stands for the Mohr-Coulomb pyramid: plane strain at collapse, through its outer \
     (triaxial compression) or inner (extension) edges. The outer cone is stronger than the pyramid in \
     every other state: its 31 degrees act as 41 to 44 where a round column of sand spreads.",
);

/// Drucker-Prager plasticity with apex on Hencky elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DruckerPrager {
    /// Below yield.
    pub elasticity: Hencky,
    eta: f64,
    /// xi c, Pa
    strength: f64,
    eta_bar: f64,
    /// `None`: the strength stays.
    change: Option<Change>,
    fit: f64,
}

/// Rates, with κ, of the fields of [`DruckerPrager`] of these names.
#[derive(Debug, Clone, Copy, Default)]
struct Rates {
    eta: f64,
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

/// d/d angle (degrees) of [`cone`].
fn cone_rate(degrees: f64, fit: f64) -> [f64; 2] {
    let angle = degrees.to_radians();
    let (sine, cosine, tangent) = (angle.sin(), angle.cos(), angle.tan());
    let rate = match fit as usize {
        0 => {
            let root = 9.0 + 12.0 * tangent * tangent;
            let slope = (1.0 + tangent * tangent) / (root * root.sqrt());
            [27.0 * slope, -36.0 * tangent * slope]
        }
        outer => {
            // sin / (3 - s sin) and cos / (3 - s sin), s = 1 for the outer cone.
            let s = if outer == 1 { 1.0 } else { -1.0 };
            let below = (3.0 - s * sine).powi(2);
            [3.0 * cosine, s - 3.0 * sine].map(|x| 6.0 / 3.0_f64.sqrt() * x / below)
        }
    };
    rate.map(f64::to_radians)
}

impl DruckerPrager {
    /// The perfect surface of κ, and its rates.
    fn surface(&self, change: &Change, kappa: f64) -> (DruckerPrager, Rates) {
        let [[phi, phi_rate], [psi, psi_rate], [cohesion, cohesion_rate]] = change.at(kappa);
        let ([eta, xi], [eta_bar, _]) = (cone(phi, self.fit), cone(psi, self.fit));
        let [eta_slope, xi_slope] = cone_rate(phi, self.fit);
        let surface =
            DruckerPrager { eta, strength: xi * cohesion, eta_bar, change: None, ..*self };
        let rates = Rates {
            eta: eta_slope * phi_rate,
            strength: xi_slope * phi_rate * cohesion + xi * cohesion_rate,
            eta_bar: cone_rate(psi, self.fit)[0] * psi_rate,
        };
        (surface, rates)
    }

    /// [`Model::respond`] from κ on.
    #[inline(never)]
    fn respond_changing(&self, change: &Change, trial: [f64; 3], kappa: f64) -> Response {
        softening::respond(&self.elasticity, trial, (kappa, change), |kappa| {
            let (surface, rates) = self.surface(change, kappa);
            surface.respond_with_rate(trial, Some(rates))
        })
    }

    /// [`Model::respond`] of the perfectly plastic law.
    #[inline(never)]
    fn respond_perfectly(&self, trial: [f64; 3]) -> Response {
        self.respond_with_rate(trial, None).0
    }

    /// The response, and the rate of its stress where the cone changes at `rates`.
    #[inline(always)]
    fn respond_with_rate(&self, trial: [f64; 3], rates: Option<Rates>) -> (Response, [f64; 3]) {
        let (bulk, mu) = (self.elasticity.bulk_modulus(), self.elasticity.mu);
        let volume = trial[0] + trial[1] + trial[2];
        let deviator = trial.map(|e| e - volume * (1.0 / 3.0));
        let norm = deviator.iter().map(|e| e * e).sum::<f64>().sqrt();
        // sqrt(J2) = sqrt(2) mu |dev eps|
        let (shear_stress, pressure) = (std::f64::consts::SQRT_2 * mu * norm, bulk * volume);
        let excess = shear_stress + self.eta * pressure - self.strength;
        let scale = shear_stress + self.eta * pressure.abs() + self.strength;
        if excess <= YIELD_TOLERANCE * scale || excess.is_nan() {
            return (self.elasticity.respond_with(trial, [0.0; MOST_STATE]), [0.0; 3]);
        }
        let compliance = 1.0 / (mu + bulk * self.eta * self.eta_bar);
        let multiplier = compliance * excess;
        let on_cone = shear_stress - mu * multiplier >= 0.0;
        let mut tangent = [[0.0; 3]; 3];
        let mut rate = [0.0; 3];
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
            if let Some(to) = rates {
                let sum = to.eta * self.eta_bar + self.eta * to.eta_bar;
                let grown =
                    compliance * (to.eta * pressure - to.strength - bulk * sum * multiplier);
                let mean = -bulk * (to.eta_bar * multiplier + self.eta_bar * grown);
                let less = 2.0 * mu * mu * grown / shear_stress;
                rate = deviator.map(|e| mean - less * e);
            }
            (deviator.map(|e| mean + kept * e), kept)
        } else {
            if let Some(to) = rates {
                let apex = self.strength / self.eta;
                rate = [(to.strength - apex * to.eta) / self.eta; 3];
            }
            ([self.strength / self.eta; 3], 0.0)
        };
        let elastic_strain = self.elasticity.strain(stress);
        let (found, slopes) = ((stress, elastic_strain), (tangent, [shear; 3]));
        (Response::returned(trial, found, slopes, [0.0; MOST_STATE]), rate)
    }
}

impl Model for DruckerPrager {
    const NAME: &'static str = "drucker-prager";
    const DOC: &'static str = "Hencky elasticity with a Drucker-Prager cone, perfect, softening or \
        hardening, and its apex, non-associated where dilation differs from friction.";
    const PARAMETERS: &'static [Parameter] = &of_cone(FIT);

    fn new(p: &[f64]) -> Self {
        let ([eta, xi], [eta_bar, _]) = (cone(p[2], p[5]), cone(p[3], p[5]));
        let change = Change::new(p[6], p[11], ends_of_cone(p));
        let elasticity = Hencky::new(p[0], p[1]);
        DruckerPrager { elasticity, eta, strength: xi * p[4], eta_bar, change, fit: p[5] }
    }

    fn check(p: &[f64]) -> Result<(), Misfit> {
        check_parameters(p).map(drop)
    }

    perfect_or_changing!();
    elastic_by!(elasticity);

    fn symmetric(&self) -> bool {
        self.eta == self.eta_bar && self.change.is_none()
    }
}
