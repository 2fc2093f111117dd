//! m dv/dt = m g + F, dL/dt = T: a rigid body that moves freely, in steps that know the forces of their
//! start or their mean.
//!
//! The angular momentum about the centre of mass is kept in space; the spin is ω = R I^-1 R^T L, and R
//! turns by ω dt in a step, so that a body without forces keeps both momenta to round-off.

use nalgebra::Matrix3;

use super::pose::{Pose, rotation};
use super::solid::Solid;
use super::surface::length;
use crate::deck::model::FreeRigid;
use crate::tensor::dense::multiply;

/// A rigid body with mass.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeBody<const D: usize> {
    /// kg (kg/m in 2D)
    pub mass: f64,
    /// I^-1 about the centre of mass, as the deck turns the body, 1/(kg m2).
    inertia_inverse: Matrix3<f64>,
    pub pose: Pose<D>,
    /// m/s
    pub velocity: [f64; D],
    /// L about the centre of mass, kg m2/s; in 2D along z.
    pub angular_momentum: [f64; 3],
}

impl<const D: usize> FreeBody<D> {
    /// At the start of a run.
    pub fn new(solid: &Solid<D>, deck: &FreeRigid) -> Self {
        let inertia = Matrix3::from_fn(|i, j| deck.density * solid.inertia[i][j]);
        FreeBody {
            mass: deck.density * solid.volume,
            inertia_inverse: inertia.try_inverse().unwrap_or_else(Matrix3::zeros),
            pose: Pose::at_start(solid.centroid),
            velocity: std::array::from_fn(|a| deck.velocity[a]),
            angular_momentum: [0.0; 3],
        }
    }

    /// The centre of mass, m.
    pub fn centre(&self) -> [f64; D] {
        std::array::from_fn(|a| self.pose.centre[a] + self.pose.shift[a])
    }

    /// ω, 1/s.
    pub fn spin(&self) -> [f64; 3] {
        let turn = Matrix3::from_fn(|i, j| match (i < D, j < D) {
            (true, true) => self.pose.turn[i][j],
            _ => f64::from(u8::from(i == j)),
        });
        let momentum = nalgebra::Vector3::from(self.angular_momentum);
        let spin = turn * self.inertia_inverse * turn.transpose() * momentum;
        [spin[0], spin[1], spin[2]]
    }

    /// m v^2 / 2 + ω L / 2, J.
    pub fn kinetic_energy(&self) -> f64 {
        let moving: f64 = self.velocity.iter().map(|v| v * v).sum();
        let turning: f64 = self.spin().iter().zip(self.angular_momentum).map(|(w, l)| w * l).sum();
        0.5 * (self.mass * moving + turning)
    }

    /// Where it is after a step of `dt` under a force, N, and a torque about its centre, N m, of the
    /// step's start.
    pub fn advance(&mut self, force: &[f64; D], torque: &[f64; 3], gravity: &[f64; D], dt: f64) {
        for a in 0..D {
            self.velocity[a] += dt * (gravity[a] + force[a] / self.mass);
            self.pose.shift[a] += dt * self.velocity[a];
        }
        for (l, t) in self.angular_momentum.iter_mut().zip(torque) {
            *l += dt * t;
        }
        let spin = self.spin();
        let angle = dt * length(&spin);
        if angle > 0.0 {
            let step = rotation::<D>(&spin, angle.to_degrees());
            self.pose.turn = multiply(&step, &self.pose.turn);
            self.straighten();
        }
    }

    /// The same under the mean force and torque of the step: the velocity changes by them, and the body
    /// moves and turns by the means of velocity and spin at both ends, which keeps the energy that the
    /// mean force gives.
    pub fn advance_by_mean(
        &mut self,
        force: &[f64; D],
        torque: &[f64; 3],
        gravity: &[f64; D],
        dt: f64,
    ) {
        /// The spin at the end depends on where the body has turned to by then.
        const TURNS: usize = 30;
        for a in 0..D {
            let before = self.velocity[a];
            self.velocity[a] += dt * (gravity[a] + force[a] / self.mass);
            self.pose.shift[a] += 0.5 * dt * (before + self.velocity[a]);
        }
        let (start, turn) = (self.spin(), self.pose.turn);
        for (l, t) in self.angular_momentum.iter_mut().zip(torque) {
            *l += dt * t;
        }
        for _ in 0..if D == 2 { 1 } else { TURNS } {
            let end = self.spin();
            let mean: [f64; 3] = std::array::from_fn(|k| 0.5 * (start[k] + end[k]));
            let angle = dt * length(&mean);
            let former = self.pose.turn;
            self.pose.turn = turn;
            if angle > 0.0 {
                let step = rotation::<D>(&mean, angle.to_degrees());
                self.pose.turn = multiply(&step, &turn);
                self.straighten();
            }
            if self.pose.turn == former {
                break;
            }
        }
    }

    /// sqrt(tr I / (m n)), n the number of axes that it turns about, m.
    pub fn radius_of_gyration(&self) -> f64 {
        let inertia = self.inertia_inverse.try_inverse().unwrap_or_else(Matrix3::zeros);
        let mean = if D == 2 { inertia[(2, 2)] } else { inertia.trace() / 3.0 };
        (mean / self.mass).sqrt()
    }

    /// Takes the round-off of many turns out of R: its columns are of length one and at right angles.
    fn straighten(&mut self) {
        let turn = &mut self.pose.turn;
        for i in 0..D {
            for k in 0..i {
                let along: f64 = (0..D).map(|j| turn[i][j] * turn[k][j]).sum();
                for j in 0..D {
                    turn[i][j] -= along * turn[k][j];
                }
            }
            let size = length(&turn[i]);
            turn[i].iter_mut().for_each(|v| *v /= size);
        }
    }

    /// All that changes, in a fixed order.
    pub fn words(&self) -> Vec<f64> {
        let Pose { shift, turn, .. } = &self.pose;
        let moving = shift.iter().chain(turn.as_flattened()).chain(&self.velocity);
        moving.chain(&self.angular_momentum).copied().collect()
    }

    /// Takes [`Self::words`] of another moment.
    pub fn set_words(&mut self, words: &[f64]) {
        let Pose { shift, turn, .. } = &mut self.pose;
        let moving = shift.iter_mut().chain(turn.as_flattened_mut()).chain(&mut self.velocity);
        let all = moving.chain(&mut self.angular_momentum);
        all.zip(words).for_each(|(value, word)| *value = *word);
    }

    /// Velocity of the material at `x`, m/s.
    pub fn velocity_at(&self, x: &[f64; D]) -> [f64; D] {
        let (w, centre) = (self.spin(), self.centre());
        let mut arm = [0.0; 3];
        for a in 0..D {
            arm[a] = x[a] - centre[a];
        }
        let turning = [
            w[1] * arm[2] - w[2] * arm[1],
            w[2] * arm[0] - w[0] * arm[2],
            w[0] * arm[1] - w[1] * arm[0],
        ];
        std::array::from_fn(|a| self.velocity[a] + turning[a])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::cuboid::Cuboid;
    use crate::contact::surface::Surface;
    use crate::tensor::dense::apply;

    /// A box that spins about an axis that is none of its own keeps its energy and L to the order of
    /// the step, and a place of it moves as its velocity says.
    #[test]
    fn a_free_box_keeps_its_momenta() {
        let solid =
            Cuboid { min: [0.0, 0.0, 0.0], max: [1.0, 0.6, 0.3] }.solid().expect("a volume");
        let deck = FreeRigid { density: 2.0, velocity: vec![1.0, 0.0, -0.5] };
        let mut body = FreeBody::new(&solid, &deck);
        body.angular_momentum = [0.05, 0.06, 0.08];
        let energy = body.kinetic_energy();
        let momentum = body.angular_momentum;
        for _ in 0..2000 {
            body.advance(&[0.0; 3], &[0.0; 3], &[0.0; 3], 5e-4);
        }
        assert_eq!(body.angular_momentum, momentum);
        assert!((body.kinetic_energy() / energy - 1.0).abs() < 2e-3);
        let turned = multiply(&body.pose.turn, &crate::tensor::dense::transpose(&body.pose.turn));
        for i in 0..3 {
            for j in 0..3 {
                let unit = if i == j { 1.0 } else { 0.0 };
                assert!((turned[i][j] - unit).abs() < 1e-14);
            }
        }
        let place = [0.9, 0.1, 0.2];
        let before = body.pose.to_space(&place);
        let velocity = body.velocity_at(&before);
        body.advance(&[0.0; 3], &[0.0; 3], &[0.0; 3], 1e-6);
        let after = body.pose.to_space(&place);
        for a in 0..3 {
            assert!(((after[a] - before[a]) / 1e-6 - velocity[a]).abs() < 1e-4);
        }
        let words = body.words();
        let mut other = FreeBody::new(&solid, &deck);
        other.set_words(&words);
        assert_eq!(other, body);
    }

    /// The mean rule keeps the energy of a body that spins freely to the square of the step, and the
    /// kinetic energy grows by the work of the mean force to round-off.
    #[test]
    fn the_mean_of_a_step_keeps_energy() {
        let solid =
            Cuboid { min: [0.0, 0.0, 0.0], max: [1.0, 0.6, 0.3] }.solid().expect("a volume");
        let deck = FreeRigid { density: 2.0, velocity: vec![1.0, 0.0, -0.5] };
        let begun = FreeBody::new(&solid, &deck);
        let drift = |steps: usize| {
            let mut body = begun.clone();
            body.angular_momentum = [0.05, 0.06, 0.08];
            let energy = body.kinetic_energy();
            for _ in 0..steps {
                body.advance_by_mean(&[0.0; 3], &[0.0; 3], &[0.0; 3], 1.0 / steps as f64);
            }
            (body.kinetic_energy() / energy - 1.0).abs()
        };
        let (coarse, fine) = (drift(50), drift(100));
        assert!(fine < 1e-4 && fine < 0.3 * coarse + 1e-14, "{coarse:e} {fine:e}");
        let mut body = begun.clone();
        let (before, from) = (body.kinetic_energy(), body.centre());
        body.advance_by_mean(&[0.3, -0.2, 0.1], &[0.0; 3], &[0.0; 3], 0.1);
        let way: Vec<f64> = body.centre().iter().zip(from).map(|(x, y)| x - y).collect();
        let work = 0.3 * way[0] - 0.2 * way[1] + 0.1 * way[2];
        assert!((body.kinetic_energy() - before - work).abs() < 1e-15);
        // Of a cuboid (a2 + b2) / 12 about each axis.
        let expected = ((1.0 + 0.36 + 0.09) / 18.0f64).sqrt();
        assert!((body.radius_of_gyration() - expected).abs() < 1e-14);
    }

    #[test]
    fn apply_turns_in_the_plane_counter_clockwise() {
        let quarter = rotation::<2>(&[0.0, 0.0, 2.0], 90.0);
        let turned = apply(&quarter, &[1.0, 0.0]);
        assert!(turned[0].abs() < 1e-15 && (turned[1] - 1.0).abs() < 1e-15);
    }
}
