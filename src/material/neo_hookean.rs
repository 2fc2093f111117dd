//! W = mu/2 (l1^2 + l2^2 + l3^2 - 3) - mu ln J + lambda/2 (ln J)^2 in the principal stretches l_a,
//! the compressible neo-Hookean solid (Bonet, Wood 2008, eq. 6.27):
//! tau_a = d W / d ln l_a = mu (l_a^2 - 1) + lambda ln J.

use super::mohr_coulomb::STIFF;
use super::parameter::{POISSON, Parameter};
use super::{Hencky, MOST_STATE, Misfit, Model, Response};

/// Largest number of Newton steps from stress to strain.
const MOST_ITERATIONS: usize = 100;

/// Compressible neo-Hookean elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHookean {
    /// First Lamé parameter at small strain, Pa.
    lambda: f64,
    /// Shear modulus at small strain, Pa.
    mu: f64,
    /// Young's modulus at small strain, Pa.
    young: f64,
}

impl NeoHookean {
    fn stress(&self, strain: [f64; 3]) -> [f64; 3] {
        let volumetric = self.lambda * (strain[0] + strain[1] + strain[2]);
        strain.map(|e| self.mu * (2.0 * e).exp_m1() + volumetric)
    }
}

/// (exp(2 a) - exp(2 b)) / (a - b), exact where a and b coincide.
fn divided(a: f64, b: f64) -> f64 {
    let apart = a - b;
    let ratio = if apart.abs() < 1e-4 { 1.0 + apart * apart / 6.0 } else { apart.sinh() / apart };
    2.0 * (a + b).exp() * ratio
}

impl Model for NeoHookean {
    const NAME: &'static str = "neo-hookean";
    const DOC: &'static str = "Compressible neo-Hookean elasticity, mu/2 (tr b - 3) - mu ln J + \
        lambda/2 (ln J)^2 per initial volume (Bonet and Wood 2008, eq. 6.27).";
    const PARAMETERS: &'static [Parameter] = &[STIFF, POISSON];

    /// Below zero a stress does not say its strain.
    fn check(p: &[f64]) -> Result<(), Misfit> {
        if p[1] < 0.0 {
            let why = format!("expected a number >= 0 with this model, found {}", p[1]);
            return Err(Misfit { key: "poisson", why });
        }
        Ok(())
    }

    fn new(p: &[f64]) -> Self {
        let Hencky { lambda, mu, young } = Hencky::new(p[0], p[1]);
        NeoHookean { lambda, mu, young }
    }

    #[inline(never)]
    fn respond(&self, trial: [f64; 3], _: &[f64]) -> Response {
        let mut tangent = [[self.lambda; 3]; 3];
        for (a, row) in tangent.iter_mut().enumerate() {
            row[a] += 2.0 * self.mu * (2.0 * trial[a]).exp();
        }
        Response {
            stress: self.stress(trial),
            elastic_strain: trial,
            tangent,
            shear: [(0, 1), (1, 2), (2, 0)].map(|(a, b)| self.mu * divided(trial[a], trial[b])),
            state: [0.0; MOST_STATE],
            plastic_increment: 0.0,
            dissipation: 0.0,
        }
    }

    /// With ln J = t the strains are ln(1 + (tau_a - lambda t) / mu) / 2, and their sum is t: one
    /// equation, convex and growing in t, whose root lies below (mu + least tau) / lambda.
    fn elastic_strain(&self, stress: [f64; 3]) -> [f64; 3] {
        let strains = |t: f64| stress.map(|s| 0.5 * ((s - self.lambda * t) / self.mu).ln_1p());
        let least = stress.iter().fold(f64::INFINITY, |least: f64, &s| least.min(s));
        let (mut low, mut high) = (f64::NEG_INFINITY, (self.mu + least) / self.lambda);
        let mut t = if high > 0.0 { 0.0 } else { high - 1.0 };
        for _ in 0..MOST_ITERATIONS {
            let excess = t - strains(t).iter().sum::<f64>();
            let slope: f64 =
                stress.iter().map(|s| self.lambda / (self.mu + s - self.lambda * t)).sum();
            if excess > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let next = t - excess / (1.0 + 0.5 * slope);
            let next = if next >= high { 0.5 * (t + high) } else { next.max(low) };
            if next == t || (next - t).abs() <= 1e-17 {
                break;
            }
            t = next;
        }
        strains(t)
    }

    fn energy(&self, elastic_strain: [f64; 3]) -> f64 {
        let volume = elastic_strain[0] + elastic_strain[1] + elastic_strain[2];
        let stretch: f64 = elastic_strain.iter().map(|e| (2.0 * e).exp_m1()).sum();
        self.mu * (0.5 * stretch - volume) + 0.5 * self.lambda * volume * volume
    }

    /// Along the axis a it is d tau_a / d ln l_a - tau_a: the tangent of the Cauchy stress at a
    /// point with J = 1, times J.
    fn wave_modulus(&self, elastic_strain: impl FnOnce() -> [f64; 3]) -> f64 {
        let strain = elastic_strain();
        let stress = self.stress(strain);
        let along = |a: usize| 2.0 * self.mu * (2.0 * strain[a]).exp() + self.lambda - stress[a];
        along(0).max(along(1)).max(along(2))
    }

    fn stiffness(&self) -> f64 {
        self.young
    }

    fn symmetric(&self) -> bool {
        true
    }
}
