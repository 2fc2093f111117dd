//! a' = u/(β dt²) - v/(β dt) - (1/(2β) - 1) a, v' = v + dt ((1 - γ) a + γ a'): Newmark's family, and
//! with α the dissipative one of Hilber, Hughes and Taylor.

use crate::deck::model::Analysis;
use crate::points::Points;
use crate::system::step_points::StepPoints;

use crate::transfer::mapping;

/// The method's numbers for a step of `dt`.
#[derive(Debug, Clone, Copy)]
pub struct Newmark {
    beta: f64,
    gamma: f64,
    /// In [-1/3, 0].
    pub alpha: f64,
    /// s.
    pub dt: f64,
}

/// Nodal velocity and acceleration, local nodes.
pub struct Rates {
    pub velocity: Vec<f64>,
    pub acceleration: Vec<f64>,
}

impl Newmark {
    pub fn new(analysis: &Analysis, dt: f64) -> Self {
        let (beta, gamma) = (analysis.newmark_beta, analysis.newmark_gamma);
        Newmark { beta, gamma, alpha: analysis.hht_alpha, dt }
    }

    /// Share of u in the acceleration at the end, 1/s².
    pub fn stiffness(&self) -> f64 {
        1.0 / (self.beta * self.dt.powi(2))
    }

    /// Share of u in the velocity at the end, 1/s.
    pub fn viscosity(&self) -> f64 {
        self.gamma / (self.beta * self.dt)
    }

    /// Mean over the step of what acts on the velocity, from its values at both ends.
    pub fn mean(&self, start: &[f64], end: &[f64]) -> Vec<f64> {
        let ends = start.iter().zip(end);
        ends.map(|(start, end)| (1.0 - self.gamma) * start + self.gamma * end).collect()
    }

    /// What the acceleration at the end owes to the start, with its sign reversed.
    pub fn predictor(&self, start: &Rates) -> Vec<f64> {
        let rates = start.velocity.iter().zip(&start.acceleration);
        rates.map(|(v, a)| self.owed(*v, *a)).collect()
    }

    /// The rates at the end of a step with the nodal increments `displacement`.
    pub fn rates(&self, start: &Rates, displacement: &[f64]) -> Rates {
        let before = start.velocity.iter().zip(&start.acceleration);
        let (velocity, acceleration) =
            before.zip(displacement).map(|((v, a), u)| self.end(*u, *v, *a)).unzip();
        Rates { velocity, acceleration }
    }

    /// Velocity and acceleration at the end for the increment `u`.
    fn end(&self, u: f64, v: f64, a: f64) -> (f64, f64) {
        let Newmark { beta, gamma, dt, .. } = *self;
        let end = u / (beta * dt * dt) - self.owed(v, a);
        (v + dt * ((1.0 - gamma) * a + gamma * end), end)
    }

    fn owed(&self, v: f64, a: f64) -> f64 {
        v / (self.beta * self.dt) + (0.5 / self.beta - 1.0) * a
    }
}

/// Velocity and acceleration of the points at the end of the step, by the nodes': the velocity
/// gains the nodes' change by the share `flip` and is the nodes' own by the rest.
pub struct PointRates<const D: usize> {
    pub velocity: Vec<[f64; D]>,
    pub acceleration: Vec<[f64; D]>,
}

impl<const D: usize> PointRates<D> {
    pub fn new(
        step: StepPoints<'_, D>,
        points: &Points<D>,
        start: &Rates,
        end: &Rates,
        flip: f64,
    ) -> Self {
        let change: Vec<f64> =
            end.velocity.iter().zip(&start.velocity).map(|(new, old)| new - old).collect();
        let carried = mapping::at_points(step, &end.velocity);
        let gained = mapping::at_points(step, &change);
        let mut velocity = points.velocity.clone();
        for ((v, gain), grid) in velocity.iter_mut().zip(&gained).zip(&carried) {
            for i in 0..D {
                v[i] = flip * (v[i] + gain[i]) + (1.0 - flip) * grid[i];
            }
        }
        PointRates { velocity, acceleration: mapping::at_points(step, &end.acceleration) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_average_acceleration_is_exact_for_a_constant_one() {
        let newmark = Newmark { beta: 0.25, gamma: 0.5, alpha: 0.0, dt: 0.3 };
        let (v, a) = (2.0, -1.5);
        let (velocity, end) = newmark.end(v * 0.3 + 0.5 * a * 0.09, v, a);
        assert!((end - a).abs() < 1e-13 && (velocity - (v + 0.3 * a)).abs() < 1e-13);
    }
}
