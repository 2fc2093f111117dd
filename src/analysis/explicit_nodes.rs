//! v = M~^-1 Σ m S^T v_p and a = M~^-1 (f_ext - f_int) at the nodes of an explicit step (Ghost §2.3,
//! eq. 6 and 10), and the nodal increments that move and deform the points.

use std::time::Instant;

use crate::deck::model::StressUpdate;
use crate::error::Result;
use crate::parallel::World;
use crate::petsc::log::Phase;
use crate::points::Points;
use crate::system::conditions::Conditions;
use crate::system::step_points::StepPoints;
use crate::tensor::Square;

use crate::mass::grid_mass::{GridMass, Inverse, require_mass};
use crate::mass::light_nodes::LightNodes;
use crate::mass::solver::MassSolver;
use crate::points::Snapshot;
use crate::record::clock::Clock;
use crate::system::model::Model;
use crate::system::shared_nodes;
use crate::system::step_system::Discretisation;
use crate::transfer::affine::{self, Affine};
use crate::transfer::mapping::{self, Deformation, Pushed};
use crate::transfer::nodal_sums::{over_points, to_points};
use crate::transfer::refusal::Halt;
use crate::transfer::soundness;
use crate::transfer::transport::Carrier;
use crate::transfer::update::{self, PointEnergies};

/// A step's equations at the nodes.
pub(crate) struct Nodes<'a, const D: usize> {
    world: &'a World,
    model: &'a Model<D>,
    mesh: &'a Discretisation<D>,
    conditions: &'a Conditions,
    mass: &'a GridMass,
    light: Option<LightNodes>,
    pub inverse: Inverse<'a, D>,
    /// Of the points, N; empty without loads.
    external: &'a [[f64; D]],
    /// Force at the step's start of what follows the motion, of declared terms and of contact, N: of the owned degrees
    /// of freedom, empty for none.
    pub pressed: &'a [f64],
    /// Local nodes of fields that move as one ([`shared_nodes::joined`]).
    pub joined: Vec<Vec<usize>>,
    dt: f64,
    /// Held components move with their boundary's mean velocity over the step.
    held_velocity: Vec<f64>,
    at_rest: Vec<f64>,
    /// What the points take from held velocities by their PIC share, N s: of the owned degrees of
    /// freedom, zero where nothing holds. Empty with flip.
    pub taken: Vec<f64>,
    /// Wall seconds of the solves so far.
    pub seconds: f64,
}

/// Nodal force with the shares of all ranks, N, and acceleration, m/s2; at ghosts without meaning.
pub(crate) struct Forces<const D: usize> {
    pub pushed: Vec<[f64; D]>,
    pub acceleration: Vec<f64>,
}

/// Nodal increments, m.
pub(crate) struct Motion {
    /// They move the points.
    pub moved: Vec<f64>,
    /// With musl, they deform them; else the step's own increments do.
    pub again: Option<Vec<f64>>,
}

impl<'a, const D: usize> Nodes<'a, D> {
    /// Collective.
    pub fn new(
        world: &'a World,
        model: &'a Model<D>,
        mesh: &'a Discretisation<D>,
        conditions: &'a Conditions,
        (mass, light, solver): (&'a GridMass, Option<LightNodes>, &'a mut MassSolver),
        external: &'a [[f64; D]],
        dt: f64,
    ) -> Result<Self> {
        let mut seconds = 0.0;
        let inverse = timed(&mut seconds, || {
            mass.inverse(world, &model.grid, mesh, &conditions.fixed, solver)
        })?;
        let held_velocity = conditions.increment.iter().map(|u| u / dt).collect();
        let at_rest = vec![0.0; mesh.numbering.len() * D];
        Ok(Nodes {
            world,
            model,
            mesh,
            conditions,
            mass,
            light,
            inverse,
            external,
            pressed: &[],
            joined: Vec::new(),
            dt,
            held_velocity,
            at_rest,
            taken: Vec::new(),
            seconds,
        })
    }

    /// v of Ghost eq. 10, sharpened if the deck says so, and the forces where the stress is
    /// updated last: one pass over the points and one iteration then give both. Without forces v
    /// has values at ghosts. Collective.
    pub fn velocity_and_forces(
        &mut self,
        points: &Points<D>,
        clock: &mut Clock,
    ) -> Result<(Vec<f64>, Option<Forces<D>>)> {
        let step = self.mesh.step_points(points, &self.model.materials);
        let (deck, halo) = (&self.model.deck, &self.mesh.numbering.halo);
        let slopes = match deck.method.affine {
            Some(kind) => affine::slopes(kind, &self.model.grid, step),
            None => Vec::new(),
        };
        let (momentum, mut velocity, forces) = if deck.method.stress_update == StressUpdate::Usf {
            let momentum =
                clock.time(Phase::Assemble, || self.momentum(step, &points.velocity, &slopes))?;
            let velocity = self.solve(step, &momentum, None)?;
            (momentum, velocity, None)
        } else {
            let [mut momentum, mut pushed] = clock.time(Phase::Assemble, || {
                Ok(over_points(self.world, self.mesh, |part, [momenta, forces]| {
                    let also = part.clone();
                    mapping::add_momentum_and_force(step, part, self.external, momenta, forces);
                    affine::add_momentum(&self.model.grid, step, also, &slopes, momenta);
                }))
            })?;
            self.hand_on(step, &mut momentum)?;
            self.press(&mut pushed);
            self.hand_on(step, &mut pushed)?;
            self.require_mass(&pushed)?;
            let prescribed: [&[f64]; 2] = [&self.held_velocity, &self.at_rest];
            let [mut velocity, mut acceleration] = timed(&mut self.seconds, || {
                self.inverse.solve_two([&momentum, &pushed], prescribed)
            })?;
            self.join(&mut velocity);
            self.join(&mut acceleration);
            self.carry(step, &mut velocity)?;
            self.carry(step, &mut acceleration)?;
            (momentum, velocity, Some(Forces { pushed, acceleration }))
        };
        let takes = deck.method.flip < 1.0 && !deck.boundaries.is_empty();
        // A single solve has brought it to the ghosts already.
        if forces.is_some() && (takes || deck.method.xpic.is_some()) {
            halo.forward(self.world, &mut velocity, D)?;
        }
        if takes {
            self.taken = vec![0.0; self.mesh.numbering.owned * D];
            self.take(1.0 - deck.method.flip, &velocity, &momentum);
        }
        if let Some(order) = deck.method.xpic {
            velocity = self.sharpen(step, velocity, order)?;
        }
        Ok((velocity, forces))
    }

    /// Adds `share` times M~ v - P, P = `momentum`, where boundaries hold: as much more than P
    /// comes back to points that take the velocity v of the nodes. Elsewhere v = M~^-1 P.
    fn take(&mut self, share: f64, velocity: &[f64], momentum: &[[f64; D]]) {
        let carried = self.mass.multiply(self.mesh, velocity);
        let fixed = &self.conditions.fixed;
        let sums = momentum.as_flattened();
        for (dof, taken) in self.taken.iter_mut().enumerate().filter(|&(dof, _)| fixed[dof]) {
            *taken += share * (carried[dof] - sums[dof]);
        }
    }

    /// The forces after the points have taken the step's `deformation`. Collective.
    pub fn forces(
        &mut self,
        points: &Points<D>,
        deformation: &Deformation<D>,
        clock: &mut Clock,
    ) -> Result<Forces<D>> {
        let step = self.mesh.step_points(points, &self.model.materials);
        let [mut pushed] = clock.time(Phase::Assemble, || {
            Ok(over_points(self.world, self.mesh, |part, [forces]| {
                mapping::add_force(step, part, self.external, deformation, forces);
            }))
        })?;
        self.press(&mut pushed);
        self.hand_on(step, &mut pushed)?;
        self.require_mass(&pushed)?;
        let mut acceleration =
            timed(&mut self.seconds, || self.inverse.solve_summed(&pushed, &self.at_rest, None))?;
        self.join(&mut acceleration);
        self.carry(step, &mut acceleration)?;
        Ok(Forces { pushed, acceleration })
    }

    /// Brings v' and a to the ghosts, and both to the points. Collective.
    pub fn push(
        &self,
        step: StepPoints<'_, D>,
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) -> Pushed<D> {
        let (flip, dt) = (self.model.deck.method.flip, self.dt);
        let mut pushed = Pushed::zeros(step.points.len());
        to_points(self.world, self.mesh, [velocity, acceleration], |part, nodal| {
            pushed.push(step, part, nodal, flip, dt);
        });
        pushed
    }

    /// L and the spread of the points from v', which has values at ghosts; none without an affine
    /// transfer.
    pub fn gather(&self, step: StepPoints<'_, D>, velocity: &[f64]) -> Option<Affine<D>> {
        let kind = self.model.deck.method.affine?;
        Some(Affine::gather(kind, &self.model.grid, step, velocity))
    }

    /// Updates the stress first, with the nodal `velocity` at the step's start: dF of the points,
    /// and what they hold and lose then. Collective.
    pub fn deform_first(
        &mut self,
        carrier: Carrier,
        velocity: &[f64],
        points: &mut Points<D>,
        before: &mut Snapshot<D>,
    ) -> std::result::Result<(Deformation<D>, PointEnergies), Halt> {
        let step = self.mesh.step_points(points, &self.model.materials);
        let flip = self.model.deck.method.flip;
        let mut deforming = if carrier == Carrier::RemappedBack && flip < 1.0 {
            let shared = blend(flip, &points.velocity, &mapping::at_points(step, velocity));
            self.solve(step, &self.momentum(step, &shared, &[])?, None)?
        } else {
            velocity.to_vec()
        };
        deforming.iter_mut().for_each(|v| *v *= self.dt);
        let mut deformation = mapping::displacement_gradients(step, &deforming);
        let rows = &mut deformation.common;
        let common = mapping::common_changes(step, &deforming, Some(rows));
        let averaged = update::averaged(&common, &deformation);
        soundness::require_sound_deformation(self.world, points, &deformation, &averaged)?;
        let straining = update::straining(&deformation, &averaged);
        update::stretch(&deformation, points, Some(before));
        let energies = update::respond(&self.model.materials, straining, points, Some(before));
        Ok((deformation, energies))
    }

    /// dt w with w of [`crate::transfer::transport`], and with musl dt times the velocity of the updated
    /// points, `slopes` their L with an affine transfer. Collective.
    pub fn motion(
        &mut self,
        carrier: Carrier,
        step: StepPoints<'_, D>,
        new_velocity: &[[f64; D]],
        slopes: &[Square<D>],
        velocity: &[f64],
        acceleration: &[f64],
    ) -> Result<Motion> {
        let dt = self.dt;
        let musl = self.model.deck.method.stress_update == StressUpdate::Musl;
        let mut moving = velocity.to_vec();
        let mut again = None;
        if carrier.needs_solve() || musl {
            let solved =
                self.solve(step, &self.momentum(step, new_velocity, slopes)?, Some(velocity))?;
            if carrier.needs_solve() {
                moving.clone_from(&solved);
            }
            again = musl.then_some(solved);
        }
        if matches!(carrier, Carrier::Start | Carrier::RemappedBack) {
            for (w, a) in moving.iter_mut().zip(acceleration) {
                *w -= dt * a;
            }
        }
        let over_step = |mut rates: Vec<f64>| {
            rates.iter_mut().for_each(|v| *v *= dt);
            rates
        };
        Ok(Motion { moved: over_step(moving), again: again.map(over_step) })
    }

    /// Σ_p m S^T v at the owned nodes, with the affine share of `slopes` if there are any.
    /// Collective.
    fn momentum(
        &self,
        step: StepPoints<'_, D>,
        velocity: &[[f64; D]],
        slopes: &[Square<D>],
    ) -> Result<Vec<[f64; D]>> {
        let [mut momentum] = over_points(self.world, self.mesh, |part, [momenta]| {
            mapping::add_momentum(step, part.clone(), velocity, momenta);
            affine::add_momentum(&self.model.grid, step, part, slopes, momenta);
        });
        self.hand_on(step, &mut momentum)?;
        Ok(momentum)
    }

    /// Adds what acts on the nodes themselves.
    fn press(&self, sums: &mut [[f64; D]]) {
        let sums = sums.as_flattened_mut();
        sums.iter_mut().zip(self.pressed).for_each(|(sum, f)| *sum += f);
    }

    /// Hands on what acts at light nodes. Collective.
    fn hand_on(&self, step: StepPoints<'_, D>, sums: &mut [[f64; D]]) -> Result<()> {
        match &self.light {
            Some(light) => light.hand_on(self.world, self.mesh, step, sums, &self.conditions.fixed),
            None => Ok(()),
        }
    }

    /// Fields that move as one take their mean by mass, at owned nodes.
    fn join(&self, nodal: &mut [f64]) {
        if let GridMass::Lumped(mass) = self.mass {
            shared_nodes::join::<D>(&self.joined, mass, nodal);
        }
    }

    /// The same with the values at the ghosts. Collective.
    fn join_to_ghosts(&self, nodal: &mut [f64]) -> Result<()> {
        if self.mesh.numbering.fields.is_single() {
            return Ok(());
        }
        self.join(nodal);
        self.mesh.numbering.halo.forward(self.world, nodal, D)
    }

    /// Lets light nodes move along with the others. Collective.
    pub fn carry(&self, step: StepPoints<'_, D>, nodal: &mut [f64]) -> Result<()> {
        match &self.light {
            Some(light) => light.carry(self.world, self.mesh, step, nodal, &self.conditions.fixed),
            None => Ok(()),
        }
    }

    /// M~^-1 of sums at the owned nodes, with the boundaries' velocity, at all local nodes; from a
    /// `guess` near it if there is one. Collective.
    fn solve(
        &mut self,
        step: StepPoints<'_, D>,
        sums: &[[f64; D]],
        guess: Option<&[f64]>,
    ) -> Result<Vec<f64>> {
        let mut solved = timed(&mut self.seconds, || {
            self.inverse.solve_to_ghosts(sums, &self.held_velocity, guess)
        })?;
        self.join_to_ghosts(&mut solved)?;
        self.carry(step, &mut solved)?;
        Ok(solved)
    }

    /// What is pushed must have mass. Collective.
    fn require_mass(&self, pushed: &[[f64; D]]) -> Result<()> {
        let (grid, held) = (&self.model.grid, &self.conditions.fixed);
        require_mass(self.world, grid, self.mesh, self.mass, held, pushed)
    }

    /// Σ_l (1 - S+ S)^l v for l below the order: the series of XPIC(m) for the inverse of the
    /// consistent mass, with S+ v_p = M^-1 Σ m S^T v_p by the lumped mass. What boundaries hold is
    /// in the first term alone: S+ gives it back as it is. Local values in, owned ones and ghosts;
    /// so returned. Collective.
    fn sharpen(
        &mut self,
        step: StepPoints<'_, D>,
        velocity: Vec<f64>,
        order: usize,
    ) -> Result<Vec<f64>> {
        let mut sum = velocity.clone();
        let mut term = velocity;
        for _ in 1..order {
            let back = mapping::at_points(step, &term);
            let momentum = self.momentum(step, &back, &[])?;
            if !self.taken.is_empty() {
                // The next term is this one less what is mapped back, so that its momentum over all
                // nodes is what the held ones keep of it.
                self.take(-1.0, &term, &momentum);
            }
            let mut mapped =
                timed(&mut self.seconds, || self.inverse.solve_to_ghosts(&momentum, &term, None))?;
            self.join_to_ghosts(&mut mapped)?;
            self.carry(step, &mut mapped)?;
            for ((t, m), s) in term.iter_mut().zip(&mapped).zip(&mut sum) {
                *t -= m;
                *s += *t;
            }
        }
        Ok(sum)
    }
}

/// Does `work` and adds its wall seconds to `seconds`.
fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> Result<T>) -> Result<T> {
    let begin = Instant::now();
    let outcome = work();
    *seconds += begin.elapsed().as_secs_f64();
    outcome
}

/// share a + (1 - share) b at each point.
fn blend<const D: usize>(share: f64, a: &[[f64; D]], b: &[[f64; D]]) -> Vec<[f64; D]> {
    a.iter()
        .zip(b)
        .map(|(a, b)| std::array::from_fn(|i| share * a[i] + (1.0 - share) * b[i]))
        .collect()
}
