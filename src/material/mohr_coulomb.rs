//! f = (1 + sin phi) tau_1 - (1 - sin phi) tau_3 - 2 c cos phi = 0 in Kirchhoff stress, ordered
//! tau_1 >= tau_2 >= tau_3, with the potential of the same form in psi, and tau_1 <= t: closed-form
//! return to a plane, an edge or a corner (Clausen, Damkilde, Andersen 2007, Comput. Struct. 85).
//!
//! All planes are linear in the stress, so that with the active ones N, their flow directions G and
//! the elastic moduli D the return is tau = tau_trial - D G (N D G)^-1 (N tau_trial - k), and its
//! tangent D - D G (N D G)^-1 N D. The order of the plane's result names the edge; an edge's result
//! beyond the apex p = c cot phi names the apex. Three planes hold a stress fixed: no tangent.

use super::parameter::{Absence, POISSON, POSITIVE, Parameter, Range, YOUNG, at_least};
use super::{Hencky, MOST_STATE, Misfit, Model, Response};

/// A trial state counts as plastic when it lies outside a plane by more than this share of the
/// stresses that the plane compares; see the same constant of [`super::VonMises`].
const YIELD_TOLERANCE: f64 = 1e-10;

/// Young's modulus of a model that divides by it.
pub(super) const STIFF: Parameter = Parameter { range: POSITIVE, doc: "Young's modulus.", ..YOUNG };

/// Degrees of an angle of friction or dilation.
const ANGLE: Range = Range { high_included: false, ..super::parameter::between(0.0, 90.0) };

pub(super) const FRICTION: Parameter =
    Parameter::new("friction", "degrees", ANGLE, "Angle of friction phi.");
pub(super) const DILATION: Parameter =
    Parameter::new("dilation", "degrees", ANGLE, "Angle of dilation psi, at most the friction.")
        .absent(0.0, "0");
pub(super) const COHESION: Parameter =
    Parameter::new("cohesion", "Pa", at_least(0.0), "Cohesion c.");
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
}

/// A plane N tau = k with its flow direction.
#[derive(Debug, Clone, Copy)]
struct Plane {
    normal: [f64; 3],
    flow: [f64; 3],
    bound: f64,
}

/// A returned stress in the order of the sorted strains.
struct Returned {
    stress: [f64; 3],
    tangent: [[f64; 3]; 3],
    /// Smallest multiplier over the largest, and excess over the planes left out: how little the
    /// result is what the active planes were chosen for. Zero where all holds.
    misfit: f64,
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
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
    fn onto<const K: usize>(&self, trial: [f64; 3], planes: [Plane; K]) -> Returned {
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
        Returned { stress, tangent, misfit: backward }
    }

    /// The stress of ordered trial stresses outside the surface.
    fn returned(&self, trial: [f64; 3]) -> Returned {
        let sheared = self.sheared(trial);
        if sheared.stress[0] <= self.tension * (1.0 + YIELD_TOLERANCE) {
            return sheared;
        }
        // Beyond the cut-off: of the sets of planes with it, the one that all conditions hold for.
        let tension = [0, 1, 2].map(|axis| self.tension_plane(axis));
        let shear = self.shear_plane(0, 2);
        let t = self.tension;
        let below = ((1.0 + self.sine) * t - self.strength) / (1.0 - self.sine);
        let fixed = |stress: [f64; 3]| Returned { stress, tangent: [[0.0; 3]; 3], misfit: 0.0 };
        let mut edge = self.onto(trial, [tension[0], tension[1]]);
        edge.stress[0] = t;
        edge.stress[1] = t;
        let candidates =
            [self.onto(trial, [tension[0]]), edge, self.onto(trial, [shear, tension[0]])];
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
        let nearest = corners.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        fixed(nearest.unwrap_or([t; 3]))
    }

    /// The return without cut-off.
    fn sheared(&self, trial: [f64; 3]) -> Returned {
        let main = self.shear_plane(0, 2);
        if dot(main.normal, trial) <= main.bound {
            return Returned { stress: trial, tangent: self.moduli(), misfit: 0.0 };
        }
        let plane = self.onto(trial, [main]);
        let [a, b, c] = plane.stress;
        if a >= b && b >= c {
            return plane;
        }
        let mut edge = if a < b {
            self.onto(trial, [main, self.shear_plane(1, 2)])
        } else {
            self.onto(trial, [main, self.shear_plane(0, 1)])
        };
        // The two that merge are equal to the last bit.
        let pair = if a < b { [0, 1] } else { [1, 2] };
        let mean = 0.5 * (edge.stress[pair[0]] + edge.stress[pair[1]]);
        pair.iter().for_each(|&axis| edge.stress[axis] = mean);
        if edge.stress[0] > self.apex {
            return Returned { stress: [self.apex; 3], tangent: [[0.0; 3]; 3], misfit: 0.0 };
        }
        edge
    }

    fn is_elastic(&self, [a, _, c]: [f64; 3]) -> bool {
        let (pull, push) = ((1.0 + self.sine) * a, (1.0 - self.sine) * c);
        let slack = YIELD_TOLERANCE * (pull.abs() + push.abs() + self.strength);
        pull - push - self.strength <= slack && a <= self.tension + slack
    }

    /// [`Model::respond`] of the perfectly plastic law.
    #[inline(never)]
    fn respond_perfectly(&self, trial: [f64; 3]) -> Response {
        let elastic = self.elasticity.stress(trial);
        // A stress that is not a number has no order; it goes through as the elastic one.
        let mut order = [0, 1, 2];
        order.sort_unstable_by(|&a, &b| trial[b].total_cmp(&trial[a]));
        let sorted = order.map(|axis| elastic[axis]);
        if elastic.iter().any(|s| !s.is_finite()) || self.is_elastic(sorted) {
            return self.elasticity.respond_with(trial, [0.0; MOST_STATE]);
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
        let flow = [0, 1, 2].map(|a| trial[a] - elastic_strain[a]);
        Response {
            stress,
            elastic_strain,
            tangent,
            shear,
            state: [0.0; MOST_STATE],
            plastic_increment: dot(flow, flow).sqrt(),
            dissipation: dot(stress, flow),
        }
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
    const DOC: &'static str = "Hencky elasticity with perfect Mohr-Coulomb plasticity, non-associated \
        where dilation differs from friction, and an optional tension cut-off (associated).";
    const PARAMETERS: &'static [Parameter] =
        &[STIFF, POISSON, FRICTION, DILATION, COHESION, TENSION];

    fn new(p: &[f64]) -> Self {
        Self::with(Hencky::new(p[0], p[1]), p[2], p[3], p[4], p[5])
    }

    fn check(p: &[f64]) -> Result<(), Misfit> {
        check_cone(p[2], p[3], p[4])?;
        let apex = p[4] / p[2].to_radians().tan();
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

    #[inline]
    fn respond(&self, trial: [f64; 3], _: &[f64]) -> Response {
        self.respond_perfectly(trial)
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
        self.sine == self.dilation
    }
}

/// Angles (degrees) and cohesion (Pa) of a cone or pyramid that can be one.
pub(super) fn check_cone(friction: f64, dilation: f64, cohesion: f64) -> Result<(), Misfit> {
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
