//! f = (1 + sin phi) tau_1 - (1 - sin phi) tau_3 - 2 c cos phi = 0 in Kirchhoff stress, ordered
//! tau_1 >= tau_2 >= tau_3, with the potential of the same form in psi, and tau_1 <= t: closed-form
//! return to a plane, an edge or a corner (Clausen, Damkilde, Andersen 2007, Comput. Struct. 85).
//!
//! All planes are linear in the stress, so that with the active ones N, their flow directions G and
//! the elastic moduli D the return is tau = tau_trial - D G (N D G)^-1 (N tau_trial - k), and its
//! tangent D - D G (N D G)^-1 N D. The order of the plane's result names the edge; an edge's result
//! beyond the apex p = c cot phi names the apex. Three planes hold a stress fixed: no tangent.
//!
//! With `softening` cohesion and angles fall with the plastic strain, with `hardening` the cohesion grows:
//! [`super::softening`]. At a fixed
//! trial stress the return then changes with the planes, at the rate
//! tau' = -D G' l - D G l', l' = (N D G)^-1 (N' tau - k' - N D G' l), l the multipliers.

use super::model::{dot, elastic_by, perfect_or_changing};
use super::parameter::{Absence, POISSON, POSITIVE, Parameter, Range, YOUNG, at_least};
use super::softening::{self, Change, check_hardening};
use super::{Hencky, MOST_STATE, Misfit, Model, Response, StateVariable};

/// A trial state counts as plastic when it lies outside a plane by more than this share of the
/// stresses that the plane compares; see the same constant of [`super::VonMises`].
const YIELD_TOLERANCE: f64 = 1e-10;

/// Young's modulus of a model that divides by it.
pub(super) const STIFF: Parameter = Parameter { range: POSITIVE, doc: "Young's modulus.", ..YOUNG };

/// Degrees of an angle of friction or dilation.
const ANGLE: Range = Range { high_included: false, ..super::parameter::between(0.0, 90.0) };

const FRICTION: Parameter = Parameter::new("friction", "degrees", ANGLE, "Angle of friction phi.");
const DILATION: Parameter =
    Parameter::new("dilation", "degrees", ANGLE, "Angle of dilation psi, at most the friction.")
        .absent(0.0, "0");
const COHESION: Parameter = Parameter::new("cohesion", "Pa", at_least(0.0), "Cohesion c.");
const TENSION: Parameter = Parameter {
    absence: Absence::Means(f64::INFINITY, "no cut-off"),
    ..Parameter::new(
        "tension",
        "Pa",
        at_least(0.0),
        "Largest principal stress, below the apex c cot phi.",
    )
};

/// Mohr-Coulomb plasticity with tension cut-off on Hencky elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MohrCoulomb {
    /// Below yield.
    pub elasticity: Hencky,
    /// sin phi
    sine: f64,
    /// sin psi
    dilation: f64,
    /// 2 c cos phi, Pa
    strength: f64,
    /// c cot phi, Pa: the pressure of the apex; infinite without friction.
    apex: f64,
    /// Pa
    tension: f64,
    /// Angles in rad, cohesion in Pa; `None`: the strength stays.
    change: Option<Change>,
}

/// Rates, with κ, of the fields of [`MohrCoulomb`] of these names.
#[derive(Debug, Clone, Copy, Default)]
struct Rates {
    sine: f64,
    dilation: f64,
    strength: f64,
    apex: f64,
}

/// A plane N tau = k with its flow direction.
#[derive(Debug, Clone, Copy)]
struct Plane {
    normal: [f64; 3],
    flow: [f64; 3],
    bound: f64,
}

/// What holds a returned stress.
#[derive(Debug, Clone, Copy)]
enum Active {
    Nothing,
    /// By major and minor axis, or the axis of a cut-off.
    Planes([Option<(usize, usize)>; 2]),
    Apex,
    /// A corner of the cut-off, with this many of its planes.
    Corner(usize),
}

/// A returned stress in the order of the sorted strains.
struct Returned {
    stress: [f64; 3],
    tangent: [[f64; 3]; 3],
    /// Smallest multiplier over the largest, and excess over the planes left out: how little the
    /// result is what the active planes were chosen for. Zero where all holds.
    misfit: f64,
    active: Active,
}

impl MohrCoulomb {
    /// Angles in degrees, stresses in Pa; `tension` may be infinite.
    pub fn with(
        elasticity: Hencky,
        friction: f64,
        dilation: f64,
        cohesion: f64,
        tension: f64,
    ) -> Self {
        let (phi, psi) = (friction.to_radians(), dilation.to_radians());
        let apex = if friction > 0.0 { cohesion / phi.tan() } else { f64::INFINITY };
        MohrCoulomb {
            elasticity,
            sine: phi.sin(),
            dilation: psi.sin(),
            strength: 2.0 * cohesion * phi.cos(),
            apex,
            tension,
            change: None,
        }
    }

    /// The plane of the principal stresses `major` and `minor`.
    fn shear_plane(&self, major: usize, minor: usize) -> Plane {
        let (mut normal, mut flow) = ([0.0; 3], [0.0; 3]);
        normal[major] = 1.0 + self.sine;
        normal[minor] = self.sine - 1.0;
        flow[major] = 1.0 + self.dilation;
        flow[minor] = self.dilation - 1.0;
        Plane { normal, flow, bound: self.strength }
    }

    /// A shear plane by its two axes, a cut-off by its axis twice.
    fn plane(&self, (major, minor): (usize, usize)) -> Plane {
        match major == minor {
            true => self.tension_plane(major),
            false => self.shear_plane(major, minor),
        }
    }

    fn tension_plane(&self, axis: usize) -> Plane {
        let mut normal = [0.0; 3];
        normal[axis] = 1.0;
        Plane { normal, flow: normal, bound: self.tension }
    }

    fn moduli(&self) -> [[f64; 3]; 3] {
        let mut moduli = [[self.elasticity.lambda; 3]; 3];
        for (a, row) in moduli.iter_mut().enumerate() {
            row[a] += 2.0 * self.elasticity.mu;
        }
        moduli
    }

    /// By how much a stress lies outside all planes and out of order, as a share of its size.
    fn excess(&self, stress: [f64; 3]) -> f64 {
        let [a, b, c] = stress;
        let scale = a.abs() + b.abs() + c.abs() + self.strength;
        let shear = (1.0 + self.sine) * a - (1.0 - self.sine) * c - self.strength;
        let most = shear.max(a - self.tension).max(b - a).max(c - b).max(0.0);
        if scale > 0.0 { most / scale } else { 0.0 }
    }

    /// The return to one or two planes.
    fn onto<const K: usize>(&self, trial: [f64; 3], axes: [(usize, usize); K]) -> Returned {
        let planes = axes.map(|axes| self.plane(axes));
        let moduli = self.moduli();
        let times = |v: [f64; 3]| moduli.map(|row| dot(row, v));
        let flows = planes.map(|plane| times(plane.flow));
        let normals = planes.map(|plane| times(plane.normal));
        let excess = planes.map(|plane| dot(plane.normal, trial) - plane.bound);
        let product = planes.map(|plane| flows.map(|flow| dot(plane.normal, flow)));
        let inverse = inverse(product);
        let multipliers: [f64; K] =
            std::array::from_fn(|i| (0..K).map(|j| inverse[i][j] * excess[j]).sum());
        let mut stress = trial;
        let mut tangent = moduli;
        for i in 0..K {
            for a in 0..3 {
                stress[a] -= multipliers[i] * flows[i][a];
                for j in 0..K {
                    for b in 0..3 {
                        tangent[a][b] -= flows[i][a] * inverse[i][j] * normals[j][b];
                    }
                }
            }
        }
        let largest = multipliers.iter().fold(0.0, |most: f64, m| most.max(m.abs()));
        let least = multipliers.iter().fold(0.0, |least: f64, &m| least.min(m));
        let backward = if largest > 0.0 { -least / largest } else { 0.0 };
        let active = Active::Planes(std::array::from_fn(|k| axes.get(k).copied()));
        Returned { stress, tangent, misfit: backward, active }
    }

    /// The stress of ordered trial stresses outside the surface.
    fn returned(&self, trial: [f64; 3]) -> Returned {
        let sheared = self.sheared(trial);
        if sheared.stress[0] <= self.tension * (1.0 + YIELD_TOLERANCE) {
            return sheared;
        }
        // Beyond the cut-off: of the sets of planes with it, the one that all conditions hold for.
        let t = self.tension;
        let below = self.below_cut_off();
        let mut edge = self.onto(trial, [(0, 0), (1, 1)]);
        edge.stress[0] = t;
        edge.stress[1] = t;
        let candidates = [self.onto(trial, [(0, 0)]), edge, self.onto(trial, [(0, 2), (0, 0)])];
        for candidate in candidates {
            if candidate.misfit + self.excess(candidate.stress) <= 1e-12 {
                return candidate;
            }
        }
        // Corners: the one nearest to the trial stress in the norm of the elastic energy.
        let corners = [[t; 3], [t, t, below], [t, below, below]];
        let distance = |stress: &[f64; 3]| {
            let strain = self.elasticity.strain([0, 1, 2].map(|a| trial[a] - stress[a]));
            self.elasticity.energy(strain)
        };
        let nearest =
            (0..3).min_by(|&a, &b| distance(&corners[a]).total_cmp(&distance(&corners[b])));
        let corner = nearest.unwrap_or(0);
        let (stress, active) = (corners[corner], Active::Corner(3 - corner));
        Returned { stress, tangent: [[0.0; 3]; 3], misfit: 0.0, active }
    }

    /// The smallest principal stress that the cut-off allows beside the largest, Pa.
    fn below_cut_off(&self) -> f64 {
        ((1.0 + self.sine) * self.tension - self.strength) / (1.0 - self.sine)
    }

    /// The return without cut-off.
    fn sheared(&self, trial: [f64; 3]) -> Returned {
        let main = self.shear_plane(0, 2);
        if dot(main.normal, trial) <= main.bound {
            let (stress, tangent) = (trial, self.moduli());
            return Returned { stress, tangent, misfit: 0.0, active: Active::Nothing };
        }
        let plane = self.onto(trial, [(0, 2)]);
        let [a, b, c] = plane.stress;
        if a >= b && b >= c {
            return plane;
        }
        let mut edge = if a < b {
            self.onto(trial, [(0, 2), (1, 2)])
        } else {
            self.onto(trial, [(0, 2), (0, 1)])
        };
        // The two that merge are equal to the last bit.
        let pair = if a < b { [0, 1] } else { [1, 2] };
        let mean = 0.5 * (edge.stress[pair[0]] + edge.stress[pair[1]]);
        pair.iter().for_each(|&axis| edge.stress[axis] = mean);
        if edge.stress[0] > self.apex {
            let (stress, active) = ([self.apex; 3], Active::Apex);
            return Returned { stress, tangent: [[0.0; 3]; 3], misfit: 0.0, active };
        }
        edge
    }

    /// The rate of a returned stress while planes change at these rates and the trial stress stays.
    fn stress_rate(&self, trial: [f64; 3], returned: &Returned, rates: Rates) -> [f64; 3] {
        match returned.active {
            Active::Nothing => [0.0; 3],
            Active::Apex => [rates.apex; 3],
            Active::Corner(planes) => {
                let below = (rates.sine * (self.tension + self.below_cut_off()) - rates.strength)
                    / (1.0 - self.sine);
                std::array::from_fn(|axis| if axis < planes { 0.0 } else { below })
            }
            Active::Planes([Some(one), None]) => self.rate_on(trial, [one], rates),
            Active::Planes([Some(one), Some(other)]) => self.rate_on(trial, [one, other], rates),
            Active::Planes([None, _]) => [0.0; 3],
        }
    }

    fn rate_on<const K: usize>(
        &self,
        trial: [f64; 3],
        axes: [(usize, usize); K],
        rates: Rates,
    ) -> [f64; 3] {
        let moduli = self.moduli();
        let times = |v: [f64; 3]| moduli.map(|row| dot(row, v));
        let planes = axes.map(|axes| self.plane(axes));
        let flows = planes.map(|plane| times(plane.flow));
        let inverse = inverse(planes.map(|plane| flows.map(|flow| dot(plane.normal, flow))));
        let solve = |sides: [f64; K]| -> [f64; K] {
            std::array::from_fn(|i| (0..K).map(|j| inverse[i][j] * sides[j]).sum())
        };
        let multipliers = solve(planes.map(|plane| dot(plane.normal, trial) - plane.bound));
        // sin enters both entries of a shear plane in the same way.
        let along = |(major, minor): (usize, usize), rate: f64| {
            let mut change = [0.0; 3];
            if major != minor {
                change[major] = rate;
                change[minor] = rate;
            }
            change
        };
        let flow_rates = axes.map(|axes| times(along(axes, rates.dilation)));
        let stress: [f64; 3] = std::array::from_fn(|a| {
            trial[a] - (0..K).map(|i| multipliers[i] * flows[i][a]).sum::<f64>()
        });
        let sides: [f64; K] = std::array::from_fn(|i| {
            let bound = if axes[i].0 == axes[i].1 { 0.0 } else { rates.strength };
            let turned = (0..K).map(|j| multipliers[j] * dot(planes[i].normal, flow_rates[j]));
            dot(along(axes[i], rates.sine), stress) - bound - turned.sum::<f64>()
        });
        let changes = solve(sides);
        std::array::from_fn(|a| {
            -(0..K)
                .map(|i| multipliers[i] * flow_rates[i][a] + changes[i] * flows[i][a])
                .sum::<f64>()
        })
    }

    /// The perfect surface of κ, and its rates.
    fn surface(&self, change: &Change, kappa: f64) -> (MohrCoulomb, Rates) {
        let [[phi, phi_rate], [psi, psi_rate], [cohesion, cohesion_rate]] = change.at(kappa);
        let surface = MohrCoulomb {
            sine: phi.sin(),
            dilation: psi.sin(),
            strength: 2.0 * cohesion * phi.cos(),
            apex: if phi > 0.0 { cohesion / phi.tan() } else { f64::INFINITY },
            change: None,
            ..*self
        };
        let apex = match phi > 0.0 {
            true => cohesion_rate / phi.tan() - cohesion * phi_rate / phi.sin().powi(2),
            false => 0.0,
        };
        let strength = 2.0 * (cohesion_rate * phi.cos() - cohesion * phi.sin() * phi_rate);
        let (sine, dilation) = (phi.cos() * phi_rate, psi.cos() * psi_rate);
        (surface, Rates { sine, dilation, strength, apex })
    }

    /// The law whose strength changes: [`Change::new`], angles in degrees.
    pub(super) fn changing(self, strain: f64, hardening: f64, values: [[f64; 2]; 3]) -> Self {
        let [friction, dilation, cohesion] = values;
        let [friction, dilation] = [friction, dilation].map(|angle| angle.map(f64::to_radians));
        MohrCoulomb {
            change: Change::new(strain, hardening, [friction, dilation, cohesion]),
            ..self
        }
    }

    /// [`Model::respond`] from κ on.
    #[inline(never)]
    fn respond_changing(&self, change: &Change, trial: [f64; 3], kappa: f64) -> Response {
        softening::respond(&self.elasticity, trial, (kappa, change), |kappa| {
            let (surface, rates) = self.surface(change, kappa);
            surface.respond_with_rate(trial, Some(rates))
        })
    }

    fn is_elastic(&self, [a, _, c]: [f64; 3]) -> bool {
        let (pull, push) = ((1.0 + self.sine) * a, (1.0 - self.sine) * c);
        let slack = YIELD_TOLERANCE * (pull.abs() + push.abs() + self.strength);
        pull - push - self.strength <= slack && a <= self.tension + slack
    }

    /// [`Model::respond`] of the perfectly plastic law.
    #[inline(never)]
    fn respond_perfectly(&self, trial: [f64; 3]) -> Response {
        self.respond_with_rate(trial, None).0
    }

    /// The response, and the rate of its stress where the planes change at `rates`.
    #[inline(always)]
    fn respond_with_rate(&self, trial: [f64; 3], rates: Option<Rates>) -> (Response, [f64; 3]) {
        let elastic = self.elasticity.stress(trial);
        // A stress that is not a number has no order; it goes through as the elastic one.
        let mut order = [0, 1, 2];
        order.sort_unstable_by(|&a, &b| trial[b].total_cmp(&trial[a]));
        let sorted = order.map(|axis| elastic[axis]);
        if elastic.iter().any(|s| !s.is_finite()) || self.is_elastic(sorted) {
            return (self.elasticity.respond_with(trial, [0.0; MOST_STATE]), [0.0; 3]);
        }
        let returned = self.returned(sorted);
        let (mut stress, mut tangent) = ([0.0; 3], [[0.0; 3]; 3]);
        for i in 0..3 {
            stress[order[i]] = returned.stress[i];
            for j in 0..3 {
                tangent[order[i]][order[j]] = returned.tangent[i][j];
            }
        }
        let two_mu = 2.0 * self.elasticity.mu;
        let shear = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| {
            let apart = trial[a] - trial[b];
            // Where strains coincide the limit: the difference of stresses is linear in theirs.
            let slope = match apart {
                0.0 => tangent[a][a] - tangent[a][b],
                _ => (stress[a] - stress[b]) / apart,
            };
            // Flow brings principal stresses nearer to each other and never past.
            slope.clamp(0.0, two_mu)
        });
        let elastic_strain = self.elasticity.strain(stress);
        let mut rate = [0.0; 3];
        if let Some(rates) = rates {
            let sorted = self.stress_rate(sorted, &returned, rates);
            for (axis, value) in order.into_iter().zip(sorted) {
                rate[axis] = value;
            }
        }
        let (found, slopes) = ((stress, elastic_strain), (tangent, shear));
        (Response::returned(trial, found, slopes, [0.0; MOST_STATE]), rate)
    }
}

/// Of a matrix of one or two rows.
fn inverse<const K: usize>(matrix: [[f64; K]; K]) -> [[f64; K]; K] {
    let mut out = [[0.0; K]; K];
    if K == 1 {
        out[0][0] = 1.0 / matrix[0][0];
    } else {
        let determinant = matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0];
        out[0][0] = matrix[1][1] / determinant;
        out[1][1] = matrix[0][0] / determinant;
        out[0][1] = -matrix[0][1] / determinant;
        out[1][0] = -matrix[1][0] / determinant;
    }
    out
}

impl Model for MohrCoulomb {
    const NAME: &'static str = "mohr-coulomb";
    const DOC: &'static str = "Hencky elasticity with Mohr-Coulomb plasticity, perfect, softening or \
        hardening, non-associated where dilation differs from friction, and an optional tension cut-off \
        (associated).";
    const PARAMETERS: &'static [Parameter] = &of_cone(TENSION);

    fn new(p: &[f64]) -> Self {
        let law = Self::with(Hencky::new(p[0], p[1]), p[2], p[3], p[4], p[5]);
        law.changing(p[6], p[11], ends_of_cone(p))
    }

    fn check(p: &[f64]) -> Result<(), Misfit> {
        let [friction, _, cohesion] = check_parameters(p)?;
        let apex = (p[4] / p[2].to_radians().tan()).min(cohesion / friction.to_radians().tan());
        if p[5].is_finite() && p[2] > 0.0 && p[5] > apex {
            let why = format!(
                "{} Pa lies beyond the apex c cot phi = {apex} Pa, which bounds tension already: \
                 expected at most that, or leave it out",
                p[5]
            );
            return Err(Misfit { key: "tension", why });
        }
        Ok(())
    }

    perfect_or_changing!();
    elastic_by!(elasticity);

    fn symmetric(&self) -> bool {
        self.sine == self.dilation && self.change.is_none()
    }
}

/// Parameters of a cone or pyramid with one of its own.
pub(super) const fn of_cone(own: Parameter) -> [Parameter; 12] {
    [
        STIFF,
        POISSON,
        FRICTION,
        DILATION,
        COHESION,
        own,
        softening::STRAIN,
        softening::COHESION,
        softening::FRICTION,
        softening::DILATION,
        softening::LENGTH,
        softening::HARDENING,
    ]
}

/// Peak and residual values among them: of friction, dilation and cohesion.
pub(super) fn ends_of_cone(p: &[f64]) -> [[f64; 2]; 3] {
    [[p[2], p[8]], [p[3], p[9]], [p[4], p[7]]]
}

/// Whether they fit each other; the residual angles and cohesion.
pub(super) fn check_parameters(p: &[f64]) -> Result<[f64; 3], Misfit> {
    check_cone(p[2], p[3], p[4])?;
    check_hardening(p[6], p[11])?;
    check_residual(p[6], ends_of_cone(p))
}

/// Angles (degrees) and cohesion (Pa) of a cone or pyramid that can be one.
fn check_cone(friction: f64, dilation: f64, cohesion: f64) -> Result<(), Misfit> {
    if friction == 0.0 && cohesion == 0.0 {
        let why = "friction and cohesion are both zero: the material has no strength; expected \
                   cohesion > 0 Pa or friction > 0 degrees";
        return Err(Misfit { key: "cohesion", why: why.into() });
    }
    if dilation > friction {
        let why = format!(
            "{dilation} degrees exceeds friction = {friction} degrees: shearing would give energy; \
             expected dilation <= friction"
        );
        return Err(Misfit { key: "dilation", why });
    }
    Ok(())
}

/// The residual angles (degrees) and cohesion (Pa) of peak and residual values, where the strength
/// falls; the peak ones elsewhere.
pub(super) fn check_residual(strain: f64, values: [[f64; 2]; 3]) -> Result<[f64; 3], Misfit> {
    let keys = ["softening.friction", "softening.dilation", "softening.cohesion"];
    let ends = values.map(|[peak, end]| if end.is_nan() { peak } else { end });
    if strain.is_finite() {
        for ((key, [peak, _]), end) in keys.into_iter().zip(values).zip(ends) {
            if end > peak {
                let why =
                    format!("{end} is more than the peak value {peak}: expected at most that");
                return Err(Misfit { key, why });
            }
        }
        let [friction, dilation, cohesion] = ends;
        check_cone(friction, dilation, cohesion).map_err(|misfit| {
            let key = keys.into_iter().find(|key| key.ends_with(misfit.key)).unwrap_or(keys[2]);
            Misfit { key, why: format!("of the residual values: {}", misfit.why) }
        })?;
    }
    Ok(ends)
}
