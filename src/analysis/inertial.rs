//! M~ a' + (1 + α) f' - α f = 0 with f = f_int + K_G u - f_ext and a' by [`super::newmark`]: what
//! inertia adds to an implicit step, by Newmark's method (α = 0) or that of Hilber, Hughes and
//! Taylor, with the stabilised mass (Ghost §3.3).
//!
//! Velocities come from the points by Ghost eq. 10 and return as increments, by the deck's FLIP
//! share. The acceleration a of a step's start is that of the forces there, M~ a = f_ext - f_int:
//! one that came back from the points would have passed the grid twice, which a lumped mass and the
//! Ghost mass smooth, and energy is lost at each step. Newmark's method is then of one step, in
//! positions and velocities alone. With α < 0 the acceleration does come from the points: it holds
//! the force of the step before, by which that method damps.
//!
//! A boundary's reaction is the mean (1 - γ) r + γ r' of what it supplies at both ends of the step:
//! Σ m v' - Σ m v = dt (Σ reactions + Σ mean loads) to round-off, as M~ (v' - v) is made of just these.

use crate::deck::model::Damping;
use crate::error::Result;
use crate::mass::grid_mass::{GridMass, Inverse};
use crate::mass::solver::MassSolver;
use crate::output::restart::run_state::RunState;
use crate::output::tables::history::HistoryRow;
use crate::petsc::log::Phase;
use crate::points::Points;
use crate::points::Snapshot;
use crate::record::context::Run;
use crate::record::ledger::{Entry, Ledger, StepSums};
use crate::record::step::Moment;
use crate::system::conditions::{Conditions, StepSpan};
use crate::system::model::Model;
use crate::system::step_points::StepPoints;
use crate::system::step_system::Discretisation;
use crate::system::terms::Term;
use crate::system::terms::inertia::Inertia;
use crate::transfer::mapping;
use crate::transfer::refusal::Halt;
use crate::transfer::update::PointEnergies;

use super::damping;
use super::external::{Loads, add};
use super::newmark::{Newmark, PointRates, Rates};
use super::time_steps::ledger_at_start;

/// What an implicit dynamic run keeps from step to step.
pub(super) struct Dynamics<const D: usize> {
    ledger: Ledger,
    /// u K_G u / 2 of all steps, J.
    ghost_energy: f64,
    pub before: Snapshot<D>,
    pub solver: MassSolver,
}

impl<const D: usize> Dynamics<D> {
    /// Before the first step. Collective.
    pub fn new(run: &Run<D>) -> Self {
        let (ledger, _) = ledger_at_start(run);
        let (before, solver) = (Snapshot::default(), MassSolver::default());
        Dynamics { ledger, ghost_energy: 0.0, before, solver }
    }

    /// Bodies have come and gone with this much energy, J.
    pub fn take_in(&mut self, energy: f64) {
        self.ledger.take_in(energy);
    }

    pub fn save(&self, state: &mut RunState) {
        self.ledger.save(state);
        state.set("ghost_energy", self.ghost_energy);
    }

    pub fn restore(&mut self, state: &RunState) -> Result<()> {
        self.ledger.restore(state)?;
        self.ghost_energy = state.number("ghost_energy")?;
        Ok(())
    }

    /// Books a step into its row; `ghost_work`: its u K_G u / 2 over all ranks, J. Error: energy has
    /// come from nowhere. Collective.
    pub fn book(
        &mut self,
        run: &mut Run<D>,
        sums: StepSums,
        ghost_work: f64,
        row: &mut HistoryRow,
    ) -> std::result::Result<(), Halt> {
        let entry = Entry::unite(run.world, &run.points, sums);
        if let Err(gain) = self.ledger.book(&entry, row) {
            // The row shows what happened.
            row.wall_seconds = run.clock.elapsed();
            run.recorder.step(run.world, &run.points, row, true, Moment::End)?;
            let remedy =
                "smaller steps, or analysis.hht_alpha = -0.1, damp what they excite".to_string();
            return Err(Halt::Unstable { gain, remedy });
        }
        self.ghost_energy += ghost_work;
        row.energy_ghost += self.ghost_energy;
        Ok(())
    }
}

/// The inertia of one step.
pub(super) struct InertialStep {
    newmark: Newmark,
    mass: GridMass,
    start: Rates,
    /// Σ m S^T v of the owned degrees of freedom, N s.
    momentum: Vec<f64>,
    /// Damping, and its decelerations at the step's start.
    damping: Option<(Damping, Slowing)>,
    /// f_ext - f_int at the start, of the owned degrees of freedom first, N.
    balance_start: Vec<f64>,
}

/// d of local and of mass-proportional damping at the step's start, local nodes. The former acts on to
/// the end of the step, the latter follows the velocity.
struct Slowing {
    local: Vec<f64>,
    mass: Vec<f64>,
}

impl InertialStep {
    /// Mass and nodal rates at the step's start. Collective.
    pub fn begin<const D: usize>(
        run: &mut Run<D>,
        mesh: &Discretisation<D>,
        conditions: &Conditions,
        left_out: &[bool],
        loads: &Loads<D>,
        (span, solver): (StepSpan, &mut MassSolver),
    ) -> Result<Self> {
        let Run { world, model, points, clock, .. } = run;
        let newmark = Newmark::new(&model.deck.analysis, span.time_end - span.time_start);
        let numbering = &mesh.numbering;
        let step = mesh.step_points(points, &model.materials);
        let kind = model.deck.method.mass;
        let mass = clock.time(Phase::Assemble, || GridMass::assemble(world, mesh, step, kind))?;
        let (share_at_start, balance_start) = clock.time(Phase::Assemble, || {
            let mut share =
                mapping::force(step, &loads.points_start, &Default::default(), numbering.len());
            add(share.as_flattened_mut(), 1.0, &loads.nodes_start);
            let mut balance = share.as_flattened().to_vec();
            numbering.halo.reverse_add(world, &mut balance, D)?;
            Ok((share, balance))
        })?;
        let carried = newmark.alpha != 0.0 && span.time_start > 0.0;
        let (mut start, momentum) = clock.time(Phase::Solve, || {
            let held = held_or_left_out::<D>(conditions, left_out);
            let inverse = mass.inverse(world, &model.grid, mesh, &held, solver)?;
            let sums = match carried {
                false => share_at_start,
                true => mapping::momentum(step, &points.acceleration, conditions.fixed.len() / D),
            };
            rates_at_start(inverse, step, points, conditions, sums, newmark.dt)
        })?;
        let damping = match model.deck.analysis.damping {
            None => None,
            Some(damping) => {
                let one = |damping: Damping| {
                    let (fixed, Rates { velocity, acceleration }) = (&conditions.fixed, &start);
                    damping::deceleration(world, mesh, damping, fixed, velocity, acceleration)
                };
                let local = one(Damping { mass: 0.0, ..damping })?;
                let mass = one(Damping { local: 0.0, ..damping })?;
                if !carried {
                    // What the forces give is slowed; what comes from the points has been.
                    add(&mut start.acceleration, -1.0, &local);
                    add(&mut start.acceleration, -1.0, &mass);
                }
                Some((damping, Slowing { local, mass }))
            }
        };
        Ok(InertialStep { newmark, mass, start, momentum, damping, balance_start })
    }

    /// The right-hand side of the step's equations, N, of the owned degrees of freedom; and the term
    /// that moves with the increments.
    pub fn equations<const D: usize>(
        &self,
        mesh: &Discretisation<D>,
        loads: &Loads<D>,
    ) -> (Vec<f64>, Vec<Box<dyn Term<D>>>) {
        let newmark = &self.newmark;
        let (mut owed, mut stiffness) = (newmark.predictor(&self.start), newmark.stiffness());
        if let Some((damping, slowing)) = &self.damping {
            add(&mut owed, -1.0, &slowing.local);
            let still = vec![0.0; owed.len()];
            add(&mut owed, -damping.mass, &newmark.rates(&self.start, &still).velocity);
            stiffness += damping.mass * newmark.viscosity();
        }
        let mut driving = self.mass.multiply(mesh, &owed);
        let share = 1.0 + newmark.alpha;
        for (dof, force) in driving.iter_mut().enumerate() {
            *force += share * loads.external_end[dof] - newmark.alpha * self.balance_start[dof];
        }
        let matrix = self.mass.scaled(mesh, stiffness);
        (driving, vec![Box::new(Inertia { share, matrix })])
    }

    /// Shares of the forces at both ends of the step in those that act over it.
    pub fn shares(&self) -> [f64; 2] {
        match self.newmark.alpha {
            0.0 => {
                let end = self.newmark.mean(&[0.0], &[1.0])[0];
                [1.0 - end, end]
            }
            alpha => [-alpha, 1.0 + alpha],
        }
    }

    /// What the boundaries supply in the mean of the step, and at both of its ends; `at_end`: what
    /// the forces at the end lack, N.
    pub fn supplied<const D: usize>(
        &self,
        model: &Model<D>,
        mesh: &Discretisation<D>,
        at_end: Vec<f64>,
    ) -> (Vec<f64>, [Vec<f64>; 2]) {
        let (newmark, mass, start) = (&self.newmark, &self.mass, &self.start);
        let at_start = match newmark.alpha {
            0.0 => difference(mass.multiply(mesh, &start.acceleration), &self.balance_start),
            _ => at_end.clone(),
        };
        let mut supplied = newmark.mean(&at_start, &at_end);
        let flip = model.deck.method.flip;
        if flip < 1.0 {
            // Points that take the nodes' velocity lose what held nodes had of theirs.
            let taken = difference(mass.multiply(mesh, &start.velocity), &self.momentum);
            let share = (1.0 - flip) / newmark.dt;
            supplied.iter_mut().zip(taken).for_each(|(force, taken)| *force += share * taken);
        }
        (supplied, [at_start, at_end])
    }

    /// What forces at the start count for in the mean of the step.
    pub fn share_of_start(&self) -> f64 {
        let newmark = &self.newmark;
        if newmark.alpha == 0.0 { newmark.mean(&[1.0], &[0.0])[0] } else { 0.0 }
    }

    /// Nodal rates at the end of a step with the nodal increments `displacement`.
    pub fn rates_at_end(&self, displacement: &[f64]) -> Rates {
        self.newmark.rates(&self.start, displacement)
    }

    /// Those of the points.
    pub fn rates_of_points<const D: usize>(
        &self,
        model: &Model<D>,
        step: StepPoints<'_, D>,
        end: &Rates,
    ) -> PointRates<D> {
        PointRates::new(step, step.points, &self.start, end, model.deck.method.flip)
    }

    /// This rank's sums of the step.
    pub fn sums<const D: usize>(
        &self,
        mesh: &Discretisation<D>,
        conditions: &Conditions,
        (end, displacement): (&Rates, &[f64]),
        energies: PointEnergies,
        work: f64,
    ) -> StepSums {
        let ghost = self.mass.ghost_energy(mesh, &end.velocity);
        let driven = self.mass.driven_energy(mesh, &conditions.increment, self.newmark.dt);
        let damped = self.damping.as_ref().map_or(0.0, |(damping, slowing)| {
            let at_end: Vec<f64> = end.velocity.iter().map(|v| damping.mass * v).collect();
            let mut mean = self.newmark.mean(&slowing.mass, &at_end);
            add(&mut mean, 1.0, &slowing.local);
            for (d, fixed) in mean.iter_mut().zip(&conditions.fixed) {
                *d = if *fixed { 0.0 } else { *d };
            }
            damping::dissipated(&self.mass, mesh, &mean, displacement.iter().copied())
        });
        StepSums { energies, ghost, work, driven, overgrown: 0, damped }
    }
}

/// Components that are held, and those of nodes left out: the mass does not decide their rates.
fn held_or_left_out<const D: usize>(conditions: &Conditions, left_out: &[bool]) -> Vec<bool> {
    let mut held = conditions.fixed.clone();
    for (local, _) in left_out.iter().enumerate().filter(|(_, out)| **out) {
        held[local * D..(local + 1) * D].fill(true);
    }
    held
}

/// Nodal velocity from the points' (Ghost eq. 10) and acceleration from `sums`, the shares of local
/// nodes in what the mass times it is, N; beside them the nodes' momentum, Σ m S^T v. Collective.
fn rates_at_start<const D: usize>(
    mut inverse: Inverse<'_, D>,
    step: StepPoints<'_, D>,
    points: &Points<D>,
    conditions: &Conditions,
    sums: Vec<[f64; D]>,
    dt: f64,
) -> Result<(Rates, Vec<f64>)> {
    let nodes = conditions.fixed.len() / D;
    let held_velocity: Vec<f64> = conditions.increment.iter().map(|u| u / dt).collect();
    let momentum = inverse.summed(mapping::momentum(step, &points.velocity, nodes))?;
    let velocity = inverse.solve_to_ghosts(&momentum, &held_velocity, None)?;
    let acceleration = inverse.solve(sums, &vec![0.0; nodes * D])?;
    Ok((Rates { velocity, acceleration }, momentum.into_flattened()))
}

/// a - b over the shorter of both.
fn difference(a: Vec<f64>, b: &[f64]) -> Vec<f64> {
    a.into_iter().zip(b).map(|(a, b)| a - b).collect()
}
