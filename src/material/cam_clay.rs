//! f = (q/M)^2 + p (p - p_c) = 0 in Kirchhoff stress, compression positive, with associated flow
//! and ln v - ln p hardening (modified Cam-clay in logarithmic strain: Borja, Tamagnini 1998,
//! CMAME 155).
//!
//! With the elastic volume strain v (compression positive) and the deviatoric one s the return
//! solves
//!
//! v - v_trial + g (2 p - p_c) = 0,  s - s_trial + g 2 q / M^2 = 0,  f = 0,
//! p_c = p_c,n exp((v_trial - v) / (lambda - kappa)).
//!
//! Elasticity is Hencky's, or p = p_0 exp(v / kappa) with q = 3 G s: then a point without strain is
//! under the pressure p_0, and no strain takes the pressure away.

use super::parameter::{POSITIVE, Parameter, at_least, inside};
use super::{Hencky, MOST_STATE, Misfit, Model, Response, StateVariable};

/// Share of p_c^2; see the same constant of [`super::VonMises`].
const YIELD_TOLERANCE: f64 = 1e-10;
/// Largest number of Newton steps, and of halvings of the search that comes to their help.
const MOST_ITERATIONS: usize = 40;
const MOST_HALVINGS: usize = 60;

const SLOPE: Parameter =
    Parameter::new("slope", "", POSITIVE, "M: q/p at the critical state, in every direction.");
const COMPRESSION: Parameter = Parameter::new(
    "compression",
    "",
    POSITIVE,
    "lambda: slope of normal compression in ln v - ln p.",
);
const SWELLING: Parameter = Parameter::new(
    "swelling",
    "",
    POSITIVE,
    "kappa: slope of swelling in ln v - ln p, below compression.",
);
const PRECONSOLIDATION: Parameter = Parameter::new(
    "preconsolidation",
    "Pa",
    POSITIVE,
    "p_c at the start: largest pressure at yield.",
)
.absent(0.0, "or ocr");
const OCR: Parameter = Parameter::new(
    "ocr",
    "",
    at_least(1.0),
    "Overconsolidation ratio: p_c at the start over the p_c that the initial stress would yield at.",
)
.absent(0.0, "or preconsolidation");
const ELASTICITY: Parameter = Parameter::choice(
    "elasticity",
    &["constant", "pressure-dependent"],
    "\"constant\"",
    "`constant`: Hencky's, by young and poisson. `pressure-dependent`: p = p_0 exp(v/kappa), by \
     reference_pressure and shear.",
);
const YOUNG: Parameter =
    Parameter::new("young", "Pa", POSITIVE, "Young's modulus.").absent(0.0, "none");
const POISSON: Parameter =
    Parameter::new("poisson", "", inside(-1.0, 0.5), "Poisson's ratio.").absent(0.0, "0");
const REFERENCE: Parameter = Parameter::new(
    "reference_pressure",
    "Pa",
    POSITIVE,
    "p_0: pressure of a point without elastic strain, compression positive.",
)
.absent(0.0, "none");
const SHEAR: Parameter =
    Parameter::new("shear", "Pa", POSITIVE, "G: shear modulus.").absent(0.0, "none");

/// Modified Cam-clay plasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CamClay {
    /// M
    slope: f64,
    /// lambda - kappa
    plastic_slope: f64,
    /// kappa
    swelling: f64,
    /// p_c at the start, Pa; zero where `ocr` is given.
    preconsolidation: f64,
    ocr: f64,
    /// p_0, Pa; zero with constant elasticity.
    reference: f64,
    /// Pa
    shear: f64,
    /// Bulk modulus of constant elasticity, Pa.
    bulk: f64,
}

/// A return: elastic volume strain and multiplier.
#[derive(Debug, Clone, Copy)]
struct Return {
    volume: f64,
    multiplier: f64,
}

/// The two equations that are left when s = s_trial / (1 + 6 G g / M^2), and what they consist of.
struct Equations {
    residual: [f64; 2],
    /// d residual / d (volume, multiplier)
    jacobian: [[f64; 2]; 2],
    pressure: f64,
    /// dp/dv
    bulk: f64,
    /// q
    deviator: f64,
    /// 1 + 6 G g / M^2
    growth: f64,
    preconsolidation: f64,
}

/// A trial state in invariants, compression positive.
#[derive(Debug, Clone, Copy)]
struct Trial {
    volume: f64,
    deviator: f64,
    preconsolidation: f64,
}

impl CamClay {
    /// p and dp/dv.
    fn pressure(&self, volume: f64) -> (f64, f64) {
        if self.reference > 0.0 {
            let pressure = self.reference * (volume / self.swelling).exp();
            (pressure, pressure / self.swelling)
        } else {
            (self.bulk * volume, self.bulk)
        }
    }

    fn hardened(&self, trial: &Trial, volume: f64) -> f64 {
        trial.preconsolidation * ((trial.volume - volume) / self.plastic_slope).exp()
    }

    fn equations(&self, trial: &Trial, at: Return) -> Equations {
        let square = self.slope * self.slope;
        let (pressure, bulk) = self.pressure(at.volume);
        let preconsolidation = self.hardened(trial, at.volume);
        let softening = -preconsolidation / self.plastic_slope;
        let growth = 1.0 + 6.0 * self.shear * at.multiplier / square;
        let deviator = 3.0 * self.shear * trial.deviator / growth;
        let flow = 2.0 * pressure - preconsolidation;
        Equations {
            residual: [
                at.volume - trial.volume + at.multiplier * flow,
                deviator * deviator / square + pressure * (pressure - preconsolidation),
            ],
            jacobian: [
                [1.0 + at.multiplier * (2.0 * bulk - softening), flow],
                [
                    bulk * flow - pressure * softening,
                    -12.0 * self.shear * deviator * deviator / (square * square * growth),
                ],
            ],
            pressure,
            bulk,
            deviator,
            growth,
            preconsolidation,
        }
    }

    /// Newton's method from `start`; `None` if it does not come to rest on the surface.
    fn newton(&self, trial: &Trial, start: Return) -> Option<Return> {
        let mut at = start;
        let mut before = f64::INFINITY;
        for _ in 0..MOST_ITERATIONS {
            let now = self.equations(trial, at);
            let [a, b] = now.residual;
            // Both as strains: the second over the slope of the surface.
            let scale = now.preconsolidation * now.preconsolidation.max(now.pressure.abs());
            let size = (a / self.plastic_slope).abs().max((b / scale).abs());
            if !size.is_finite() {
                return None;
            }
            // To round-off: once small, until it falls no more.
            if size < 1e-9 && size >= 0.25 * before || size == 0.0 {
                return (at.multiplier >= 0.0).then_some(at);
            }
            before = size;
            let [volume, multiplier] = solve(now.jacobian, [-a, -b]);
            at = Return { volume: at.volume + volume, multiplier: at.multiplier + multiplier };
            if 1.0 + 6.0 * self.shear * at.multiplier / (self.slope * self.slope) <= 0.0 {
                return None;
            }
        }
        None
    }

    /// A start near the root for a trial state from which Newton's method goes astray. On the
    /// surface p = p_c (1 + cos t) / 2 and q = M p_c sin(t) / 2; for each t the pressure's equation
    /// grows in v, and s_trial cos t - (M p_c / 6 G) sin t cos t - (v_trial - v) sin t / M, which
    /// the flow rule sets to zero, changes its sign between t = 0 and pi.
    fn search(&self, trial: &Trial) -> Return {
        let volume_at = |angle: f64| {
            let share = 0.5 * (1.0 + angle.cos());
            let excess =
                |volume: f64| self.pressure(volume).0 - share * self.hardened(trial, volume);
            let mut reach = self.plastic_slope;
            while excess(trial.volume - reach) > 0.0 && reach < 1e3 {
                reach *= 2.0;
            }
            let mut low = trial.volume - reach;
            let mut reach = self.plastic_slope;
            while excess(trial.volume + reach) < 0.0 && reach < 1e3 {
                reach *= 2.0;
            }
            let mut high = trial.volume + reach;
            for _ in 0..MOST_HALVINGS {
                let middle = 0.5 * (low + high);
                if excess(middle) > 0.0 { high = middle } else { low = middle }
            }
            0.5 * (low + high)
        };
        let (mut low, mut high) = (0.0, std::f64::consts::PI);
        for _ in 0..MOST_HALVINGS {
            let angle: f64 = 0.5 * (low + high);
            let volume = volume_at(angle);
            let radius = self.slope * self.hardened(trial, volume) / (6.0 * self.shear);
            let value = (trial.deviator - radius * angle.sin()) * angle.cos()
                - (trial.volume - volume) * angle.sin() / self.slope;
            if value > 0.0 { low = angle } else { high = angle }
        }
        let angle = 0.5 * (low + high);
        let volume = volume_at(angle);
        let (pressure, preconsolidation) = (self.pressure(volume).0, self.hardened(trial, volume));
        let flow = 2.0 * pressure - preconsolidation;
        let deviator = 0.5 * self.slope * preconsolidation * angle.sin();
        let square = self.slope * self.slope;
        // Of the two ways to the multiplier the one that divides by more.
        let by_volume = (trial.volume - volume) / flow;
        let by_deviator =
            (3.0 * self.shear * trial.deviator / deviator - 1.0) * square / (6.0 * self.shear);
        let multiplier =
            if flow.abs() > deviator.abs() / self.slope { by_volume } else { by_deviator };
        Return { volume, multiplier: multiplier.max(0.0) }
    }

    fn elastic(&self, trial: [f64; 3], state: [f64; MOST_STATE]) -> Response {
        let (pressure, bulk) = self.pressure(-(trial[0] + trial[1] + trial[2]));
        let mean = (trial[0] + trial[1] + trial[2]) * (1.0 / 3.0);
        let two_mu = 2.0 * self.shear;
        let stress = trial.map(|e| two_mu * (e - mean) - pressure);
        Response::elastic(trial, stress, [bulk - two_mu / 3.0, two_mu], state)
    }
}

fn solve(matrix: [[f64; 2]; 2], right: [f64; 2]) -> [f64; 2] {
    let determinant = matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0];
    [
        (right[0] * matrix[1][1] - right[1] * matrix[0][1]) / determinant,
        (matrix[0][0] * right[1] - matrix[1][0] * right[0]) / determinant,
    ]
}

impl Model for CamClay {
    const NAME: &'static str = "cam-clay";
    const DOC: &'static str = "Modified Cam-clay in logarithmic strain (Borja and Tamagnini 1998), \
        with constant or pressure-dependent elasticity.";
    const PARAMETERS: &'static [Parameter] = &[
        SLOPE,
        COMPRESSION,
        SWELLING,
        PRECONSOLIDATION,
        OCR,
        ELASTICITY,
        YOUNG,
        POISSON,
        REFERENCE,
        SHEAR,
    ];
    const ALTERNATIVES: &'static [(&'static [&'static str], &'static str)] = &[(
        &["preconsolidation", "ocr"],
        "model = \"cam-clay\" needs it, or ocr where there is an initial stress",
    )];
    const STATE: &'static [StateVariable] =
        &[StateVariable { name: "preconsolidation", unit: "Pa", initial: 0.0 }];

    fn new(p: &[f64]) -> Self {
        let constant = Hencky::new(p[6], p[7]);
        let depends = p[5] == 1.0;
        CamClay {
            slope: p[0],
            plastic_slope: p[1] - p[2],
            swelling: p[2],
            preconsolidation: p[3],
            ocr: p[4],
            reference: if depends { p[8] } else { 0.0 },
            shear: if depends { p[9] } else { constant.mu },
            bulk: if depends { 0.0 } else { constant.bulk_modulus() },
        }
    }

    fn check(p: &[f64]) -> Result<(), Misfit> {
        let misfit = |key, why: String| Err(Misfit { key, why });
        if p[2] >= p[1] {
            let why = format!("{} is not below compression = {}: expected less", p[2], p[1]);
            return misfit("swelling", why);
        }
        let (constant, depends) =
            ([("young", p[6])], [("reference_pressure", p[8]), ("shear", p[9])]);
        let (word, needed, others) = match p[5] {
            0.0 => ("constant", &constant[..], &depends[..]),
            _ => ("pressure-dependent", &depends[..], &constant[..]),
        };
        for &(key, value) in needed {
            if value <= 0.0 {
                let why = format!("missing a number > 0 (Pa): elasticity = \"{word}\" needs it");
                return misfit(key, why);
            }
        }
        for &(key, value) in others {
            if value > 0.0 {
                return misfit(key, format!("elasticity = \"{word}\" does not read it"));
            }
        }
        Ok(())
    }

    /// Not finite where `ocr` finds no compression to be a multiple of.
    fn initial_state(&self, elastic_strain: [f64; 3]) -> [f64; MOST_STATE] {
        let mut state = [0.0; MOST_STATE];
        state[0] = if self.ocr > 0.0 {
            let stress = self.elastic(elastic_strain, state).stress;
            let pressure = -(stress[0] + stress[1] + stress[2]) / 3.0;
            let square: f64 = stress.iter().map(|s| (s + pressure) * (s + pressure)).sum();
            let yields_at = pressure + 1.5 * square / (self.slope * self.slope * pressure);
            if pressure > 0.0 { self.ocr * yields_at } else { f64::NAN }
        } else {
            self.preconsolidation
        };
        state
    }

    #[inline(never)]
    fn respond(&self, strain: [f64; 3], state: &[f64]) -> Response {
        let preconsolidation = state.first().copied().unwrap_or(self.preconsolidation);
        let mean = (strain[0] + strain[1] + strain[2]) * (1.0 / 3.0);
        let parts = strain.map(|e| e - mean);
        let norm = parts.iter().map(|e| e * e).sum::<f64>().sqrt();
        let share = (2.0_f64 / 3.0).sqrt();
        let trial = Trial { volume: -3.0 * mean, deviator: share * norm, preconsolidation };
        let start = Return { volume: trial.volume, multiplier: 0.0 };
        let excess = self.equations(&trial, start).residual[1];
        let mut after = [0.0; MOST_STATE];
        after[0] = preconsolidation;
        if excess.is_nan() || excess <= YIELD_TOLERANCE * preconsolidation * preconsolidation {
            return self.elastic(strain, after);
        }
        let Some(found) =
            self.newton(&trial, start).or_else(|| self.newton(&trial, self.search(&trial)))
        else {
            // No stress: the step is refused as one whose iterates go astray.
            return self.elastic([f64::NAN; 3], after);
        };
        let e = self.equations(&trial, found);
        after[0] = e.preconsolidation;
        // How the root moves with the trial strains.
        let growth_of_pc = e.preconsolidation / self.plastic_slope;
        let square = self.slope * self.slope;
        let with_volume =
            solve(e.jacobian, [1.0 + found.multiplier * growth_of_pc, e.pressure * growth_of_pc]);
        let with_deviator =
            solve(e.jacobian, [0.0, -6.0 * self.shear * e.deviator / (square * e.growth)]);
        let fall = 6.0 * self.shear * e.deviator / (square * e.growth);
        let (d11, d12) = (e.bulk * with_volume[0], e.bulk * with_deviator[0]);
        let d21 = -fall * with_volume[1];
        let d22 = 3.0 * self.shear / e.growth - fall * with_deviator[1];
        let kept = 2.0 * self.shear / e.growth;
        let direction = parts.map(|part| if norm > 0.0 { part / norm } else { 0.0 });
        let mut tangent = [[0.0; 3]; 3];
        for a in 0..3 {
            for b in 0..3 {
                let identity = if a == b { 1.0 } else { 0.0 };
                let (x, y) = (direction[a], direction[b]);
                tangent[a][b] = d11 - share * (d12 * y + d21 * x)
                    + 2.0 / 3.0 * d22 * x * y
                    + kept * (identity - 1.0 / 3.0 - x * y);
            }
        }
        let stress = parts.map(|part| kept * part - e.pressure);
        let elastic_strain = parts.map(|part| part / e.growth - found.volume / 3.0);
        Response::returned(strain, (stress, elastic_strain), (tangent, [kept; 3]), after)
    }

    fn elastic_strain(&self, stress: [f64; 3]) -> [f64; 3] {
        let pressure = -(stress[0] + stress[1] + stress[2]) / 3.0;
        let volume = if self.reference > 0.0 {
            self.swelling * (pressure / self.reference).ln()
        } else {
            pressure / self.bulk
        };
        stress.map(|s| (s + pressure) / (2.0 * self.shear) - volume / 3.0)
    }

    /// With pressure-dependent elasticity over that of the unstrained point.
    fn energy(&self, elastic_strain: [f64; 3]) -> f64 {
        let volume = -(elastic_strain[0] + elastic_strain[1] + elastic_strain[2]);
        let square: f64 = elastic_strain.iter().map(|e| (e + volume / 3.0).powi(2)).sum();
        let of_volume = if self.reference > 0.0 {
            self.reference * self.swelling * (volume / self.swelling).exp_m1()
        } else {
            0.5 * self.bulk * volume * volume
        };
        of_volume + self.shear * square
    }

    fn wave_modulus(&self, elastic_strain: impl FnOnce() -> [f64; 3]) -> f64 {
        let [a, b, c] = elastic_strain();
        self.pressure(-(a + b + c)).1 + 4.0 / 3.0 * self.shear
    }

    fn stiffness(&self) -> f64 {
        let bulk = self.pressure(0.0).1;
        9.0 * bulk * self.shear / (3.0 * bulk + self.shear)
    }

    fn symmetric(&self) -> bool {
        false
    }
}
