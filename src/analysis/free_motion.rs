//! Free rigid bodies in an implicit step. An outer quasi-Newton iteration around the step's own solve brings their
//! motion and the forces of contact into balance. Its unknowns are the generalised forces of all bodies (force, and
//! torque over the radius of gyration), one per degree of freedom.
//!
//! With f the mean force over a step, a body goes from v to v + dt (f/m + g) and on by dt times the mean
//! of both velocities; the step is solved with its surface there and exerts Φ(f). r(f) = Φ(f) - f is
//! brought to zero by Broyden's method (1965), which converges superlinearly; its matrix begins as
//! -(1 + θ dt²/(2 m) K), K the stiffness of the corners that touch after the first solve and θ the share
//! of the end in the mean force. The momentum that a body gains is that of Φ, whatever r is left: bodies
//! together keep theirs to round-off.

use nalgebra::{DMatrix, DVector};

use crate::contact::free::FreeBody;
use crate::parallel::World;
use crate::system::conditions::StepSpan;
use crate::system::model::Model;
use crate::system::terms::contact::ContactTerm;

use super::free_bodies::{FreeBodies, gravity};

/// r, of the forces, up to which the iteration over the forces has converged.
const CONVERGED: f64 = 1e-6;
/// Solves of a step.
const ROUNDS: usize = 40;

/// A body in the step.
struct Moving<const D: usize> {
    rigid: usize,
    /// At the step's start.
    body: FreeBody<D>,
    /// Mean over the step, m/s2.
    gravity: [f64; D],
    /// Radius of gyration, m: what torques are divided by.
    radius: f64,
}

/// The search for the forces of one step.
pub(super) struct FreeMotion<const D: usize> {
    moving: Vec<Moving<D>>,
    dt: f64,
    /// Share of the step's end in the mean forces.
    share: f64,
    /// f, N.
    force: DVector<f64>,
    /// Φ of the last solve, N.
    found: DVector<f64>,
    /// dr/df, once a solve is done.
    matrix: Option<DMatrix<f64>>,
    /// f and r of the solve before.
    before: Option<(DVector<f64>, DVector<f64>)>,
    rounds: usize,
}

/// Components of a torque in D dimensions.
const fn turns<const D: usize>() -> usize {
    if D == 2 { 1 } else { 3 }
}

impl<const D: usize> FreeMotion<D> {
    const WORDS: usize = D + turns::<D>();

    /// Begins with the forces of the step's start. `None` where no body moves freely. Collective.
    pub fn begin(
        world: &World,
        model: &Model<D>,
        free: &FreeBodies<D>,
        contact: &ContactTerm<D>,
        (span, share): (StepSpan, f64),
    ) -> Option<Self> {
        let mean = |body: &FreeBody<D>| -> [f64; D] {
            let [start, end] = [span.start(), span.end()].map(|when| gravity(model, body, when));
            std::array::from_fn(|a| 0.5 * (start[a] + end[a]))
        };
        let moving: Vec<Moving<D>> = free
            .moving(model, span.stage)
            .map(|(rigid, body)| Moving {
                rigid,
                gravity: mean(body),
                radius: body.radius_of_gyration(),
                body: body.clone(),
            })
            .collect();
        if moving.is_empty() {
            return None;
        }
        let mut motion = FreeMotion {
            dt: span.time_end - span.time_start,
            share,
            force: DVector::zeros(moving.len() * Self::WORDS),
            found: DVector::zeros(0),
            matrix: None,
            before: None,
            rounds: 0,
            moving,
        };
        motion.force = motion.felt(world, &contact.exerted_at_start());
        Some(motion)
    }

    /// Generalised forces on the bodies, N, of what this rank's corners exert on the others. Collective.
    fn felt(
        &self,
        world: &World,
        exerted: &[crate::system::terms::touching::Exerted],
    ) -> DVector<f64> {
        let mut shares = Vec::with_capacity(self.force.len());
        for Moving { rigid, radius, .. } in &self.moving {
            let all = &exerted[*rigid];
            shares.extend(all.force[..D].iter().map(|f| -f));
            shares.extend(all.torque[3 - turns::<D>()..].iter().map(|t| -t / radius));
        }
        DVector::from_vec(world.sum_slice(&shares))
    }

    /// A body at the step's end under the generalised forces `all`.
    fn at_end(&self, index: usize, all: &DVector<f64>) -> FreeBody<D> {
        let Moving { body, gravity, radius, .. } = &self.moving[index];
        let own = &all.as_slice()[index * Self::WORDS..][..Self::WORDS];
        let force = std::array::from_fn(|a| own[a]);
        let mut torque = [0.0; 3];
        for (t, f) in torque[3 - turns::<D>()..].iter_mut().zip(&own[D..]) {
            *t = radius * f;
        }
        let mut body = body.clone();
        body.advance_by_mean(&force, &torque, gravity, self.dt);
        body
    }

    /// Puts the bodies where the present forces take them.
    pub fn place(&self, contact: &mut ContactTerm<D>) {
        for (index, moving) in self.moving.iter().enumerate() {
            contact.set_end(moving.rigid, self.at_end(index, &self.force).pose);
        }
    }

    /// After a solve with the nodal increments `displacement`, `shares` of the forces at both ends in
    /// those of the step: whether the forces have converged; if not, the next ones are set. Error: they do not
    /// converge. Collective.
    pub fn correct(
        &mut self,
        world: &World,
        contact: &ContactTerm<D>,
        displacement: &[f64],
        shares: [f64; 2],
    ) -> Result<bool, String> {
        self.rounds += 1;
        self.found = self.felt(world, &contact.finish(displacement, shares).rigids);
        let rest = &self.found - &self.force;
        let weight: f64 = self
            .moving
            .iter()
            .map(|one| one.body.mass * one.gravity.iter().map(|g| g * g).sum::<f64>().sqrt())
            .sum();
        let size = self.found.norm().max(self.force.norm()).max(weight);
        if rest.norm() <= CONVERGED * size {
            return Ok(true);
        }
        if self.rounds == ROUNDS {
            return Err(format!(
                "the motion of free rigid bodies and the forces of their contacts did not settle in \
                 {ROUNDS} solves: {:.1e} of the forces are left",
                rest.norm() / size
            ));
        }
        let matrix = match (self.matrix.take(), &self.before) {
            (Some(mut matrix), Some((force, former))) => {
                let step = &self.force - force;
                let missed = &rest - former - &matrix * &step;
                matrix += missed * step.transpose() / step.norm_squared();
                matrix
            }
            _ => self.first_matrix(world, contact, displacement),
        };
        let step = matrix.clone().lu().solve(&-&rest);
        let step = step.filter(|step| step.iter().all(|s| s.is_finite()));
        // Where the matrix has no inverse, half of what is left.
        let step = step.unwrap_or_else(|| 0.5 * &rest);
        self.before = Some((self.force.clone(), rest));
        self.force += step;
        self.matrix = Some(matrix);
        Ok(false)
    }

    /// -(1 + θ dt²/(2 m) K).
    fn first_matrix(
        &self,
        world: &World,
        contact: &ContactTerm<D>,
        displacement: &[f64],
    ) -> DMatrix<f64> {
        let (count, words) = (self.force.len(), Self::WORDS);
        let mut sums = vec![0.0; self.moving.len() * words * words];
        contact.each_stiffness(displacement, |rigid, x, stiffness| {
            let Some(index) = self.moving.iter().position(|one| one.rigid == rigid) else { return };
            let one = &self.moving[index];
            let (centre, radius) = (one.body.centre(), one.radius);
            // Way of the surface at x per word: translations, and rotations times the radius.
            let ways: Vec<[f64; D]> = (0..words)
                .map(|word| {
                    let mut spin = [0.0; 3];
                    if word < D {
                        return std::array::from_fn(|a| f64::from(u8::from(a == word)));
                    }
                    spin[3 - turns::<D>() + word - D] = 1.0 / radius;
                    let mut arm = [0.0; 3];
                    (0..D).for_each(|a| arm[a] = x[a] - centre[a]);
                    let way = [
                        spin[1] * arm[2] - spin[2] * arm[1],
                        spin[2] * arm[0] - spin[0] * arm[2],
                        spin[0] * arm[1] - spin[1] * arm[0],
                    ];
                    std::array::from_fn(|a| way[a])
                })
                .collect();
            for (i, of_i) in ways.iter().enumerate() {
                for (j, of_j) in ways.iter().enumerate() {
                    let pushed: f64 = (0..D)
                        .map(|a| of_i[a] * (0..D).map(|b| stiffness[a][b] * of_j[b]).sum::<f64>())
                        .sum();
                    sums[(index * words + i) * words + j] += pushed;
                }
            }
        });
        let sums = world.sum_slice(&sums);
        let mut matrix = -DMatrix::<f64>::identity(count, count);
        for (index, one) in self.moving.iter().enumerate() {
            let soft = 0.5 * self.share * self.dt * self.dt / one.body.mass;
            for i in 0..words {
                for j in 0..words {
                    matrix[(index * words + i, index * words + j)] -=
                        soft * sums[(index * words + i) * words + j];
                }
            }
        }
        matrix
    }

    /// The bodies at the step's end: where the last solve had them, with the momentum of its forces.
    pub fn finish(&self, free: &mut FreeBodies<D>) {
        for (index, moving) in self.moving.iter().enumerate() {
            let mut end = self.at_end(index, &self.found);
            end.pose = self.at_end(index, &self.force).pose;
            free.0[moving.rigid] = Some(end);
        }
    }
}
