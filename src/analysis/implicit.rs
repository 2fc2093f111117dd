//! f_int(u) + K_G u (+ inertia) = f_ext, step by step: quasi-static analysis (Lagrangian §6.3-6.5,
//! Ghost §2.4), and with inertia ([`super::inertial`]) implicit dynamics. A step:
//! locate, map, number, {assemble, solve}*, update.

use crate::deck::model::AnalysisType;
use crate::error::Result;
use crate::output::restart::run_state::RunState;
use crate::output::tables::history::HistoryRow;
use crate::petsc::log::Phase;
use crate::points::Points;
use crate::record::contact::ContactTotals;
use crate::record::context::Run;
use crate::record::reactions::{at_held, reactions, supports, supports_at_start, with_supports};
use crate::record::step::{Moment, Solved, grid_side};
use crate::system::conditions::{Conditions, StepSpan};
use crate::system::numbering::Numbering;
use crate::system::step_system::{Coupling, Discretisation};
use crate::system::terms::Term;
use crate::system::terms::contact::ContactTerm;
use crate::system::terms::declaration::{self, Context};
use crate::system::terms::facing::FacingTerm;
use crate::system::terms::following::Following;
use crate::system::terms::surface::Borne;
use crate::system::terms::touching;
use crate::system::unknowns::Unknowns;
use crate::transfer::refusal::{Cause, Halt, Refusal};
use crate::transfer::update;

use super::equilibrium::{StepEquations, motion};
use super::external::{Loads, add};
use super::free_bodies::FreeBodies;
use super::free_motion::FreeMotion;
use super::inertial::{Dynamics, InertialStep};
use super::load_steps::Stepping;
use super::newton::{self, Carried};
use super::solver::Trials;
use super::time_loop::{Analysis, Answer, Labels, Next};

/// Both implicit analyses between their steps.
pub struct Implicit<const D: usize> {
    stepping: Stepping,
    trials: Trials,
    /// Of the quasi-static analysis.
    totals: Totals,
    contact: ContactTotals,
    free: FreeBodies<D>,
    /// `None` without inertia.
    dynamics: Option<Dynamics<D>>,
}

impl<const D: usize> Implicit<D> {
    /// Before the first step. Collective.
    pub fn new(run: &Run<D>) -> Self {
        let analysis = &run.model.deck.analysis;
        let dynamic = analysis.kind == AnalysisType::ImplicitDynamic;
        let (policy, smallest) = (analysis.on_failure, analysis.smallest_step);
        Implicit {
            stepping: Stepping::new(&run.model.deck.stages, dynamic, policy, smallest),
            trials: Trials::default(),
            totals: Totals::default(),
            contact: ContactTotals::new(run.model.deck.contacts.len()),
            free: FreeBodies::new(&run.model),
            dynamics: dynamic.then(|| Dynamics::new(run)),
        }
    }
}

impl<const D: usize> Analysis<D> for Implicit<D> {
    fn labels(&self) -> Labels {
        Labels { newton: true, time: self.dynamics.is_some(), steps: Some(self.stepping.steps()) }
    }

    fn restore(&mut self, state: &RunState) -> Result<()> {
        self.stepping.restore(state)?;
        self.trials.restore(state);
        self.contact.restore(state)?;
        self.free.restore(state)?;
        match &mut self.dynamics {
            Some(dynamics) => dynamics.restore(state),
            None => self.totals.restore(state),
        }
    }

    fn state(&self) -> RunState {
        let mut state = RunState::new();
        self.stepping.save(&mut state);
        self.trials.save(&mut state);
        self.contact.save(&mut state);
        self.free.save(&mut state);
        match &self.dynamics {
            Some(dynamics) => dynamics.save(&mut state),
            None => self.totals.save(&mut state),
        }
        state
    }

    fn next(&self) -> Option<Next> {
        let number = self.stepping.step_number();
        self.stepping.next_span().map(|span| Next { span, number })
    }

    fn step(&mut self, run: &mut Run<D>, next: Next) -> std::result::Result<Solved<D>, Halt> {
        let Next { span, number } = next;
        if let Some(dynamics) = &mut self.dynamics {
            dynamics.before.begin();
        }
        let Run { world, model, points, clock, .. } = &mut *run;
        let (mesh, conditions) = clock.time(Phase::Locate, || {
            Discretisation::with_conditions(world, model, points, Coupling::Matrix, span)
        })?;
        let (mut loads, left_out) = clock.time(Phase::Assemble, || {
            let mut loads = Loads::of_step(world, model, points, &mesh, span)?;
            loads.release(world, model, points, (&mesh, &conditions), span)?;
            Ok((loads, mesh.nodes_left_out(world, model.deck.method.drop_below)))
        })?;
        let free = &self.free;
        let mut contact = clock
            .time(Phase::Assemble, || Ok(ContactTerm::new(model, &mesh, points, span, &free.0)))?;
        if let (Some(contact), Some(_)) = (&contact, &self.dynamics) {
            loads.nodes_start.resize(mesh.numbering.len() * D, 0.0);
            contact.add_force_at_start(&mut loads.nodes_start);
        }
        let facing = FacingTerm::new(model, &mesh, points);
        if let (Some(facing), Some(_)) = (&facing, &self.dynamics) {
            loads.nodes_start.resize(mesh.numbering.len() * D, 0.0);
            facing.add_force_at_start(&mut loads.nodes_start);
        }
        let inertial = match &mut self.dynamics {
            Some(dynamics) => {
                let by = (span, &mut dynamics.solver);
                Some(InertialStep::begin(run, &mesh, &conditions, &left_out, &loads, by)?)
            }
            None => None,
        };
        let (conditions, left_out) = (&conditions, &left_out[..]);
        let share = 1.0 + run.model.deck.analysis.hht_alpha;
        let shares = inertial.as_ref().map_or([0.0, 1.0], |inertial| inertial.shares());
        let mut moving = contact.as_ref().and_then(|contact| {
            FreeMotion::begin(run.world, &run.model, &self.free, contact, (span, shares[1]))
        });
        let (mut evaluations, mut linear_iterations) = (0, 0);
        // Once, or until free rigid bodies are where the forces of their contacts take them.
        let (mut driving, solved) = loop {
            if let (Some(moving), Some(contact)) = (&moving, &mut contact) {
                moving.place(contact);
            }
            let Run { world, model, points, recorder, clock } = &mut *run;
            let (model, points) = (&*model, &*points);
            let (driving, inertia) = clock.time(Phase::Assemble, || {
                Ok(match &inertial {
                    Some(inertial) => inertial.equations(&mesh, &loads),
                    None => (loads.external_end.clone(), Vec::new()),
                })
            })?;
            let mut terms: Vec<Box<dyn Term<D> + '_>> = Vec::new();
            if let Some(contact) = &contact {
                terms.push(Box::new(contact));
            }
            if let Some(facing) = &facing {
                terms.push(Box::new(facing));
            }
            // Inertia scales what stands before it.
            for term in inertia {
                terms.push(term);
            }
            let system = clock.time(Phase::Assemble, || {
                let of = Context::new(world, model, (&mesh, points), span);
                let kind = (model.deck.method.frame, model.symmetric());
                let following = Following::new(model, &mesh, points, span.end());
                let equations = StepEquations {
                    unknowns: Unknowns::displacements(),
                    conditions,
                    left_out,
                    external_owned: driving.clone(),
                    terms: motion::terms(of, kind, terms)?,
                    following: following.map(|loads| (Box::new(loads) as _, share)),
                };
                newton::System::new(world, model, &mesh, equations)
            })?;
            let attempt = system.solve(world, points, &mut self.trials)?;
            let solved = attempt.report(world, recorder, clock, number)?;
            evaluations += solved.evaluations;
            linear_iterations += solved.linear_iterations;
            let (Some(moving), Some(contact)) = (&mut moving, &contact) else {
                break (driving, solved);
            };
            match moving.correct(run.world, contact, &solved.displacement, shares) {
                Ok(true) => break (driving, solved),
                Ok(false) => {}
                Err(what) => return Err(Refusal { cause: Cause::NotConverged, what }.into()),
            }
        };
        add(&mut loads.external_end, 1.0, &solved.following);
        add(&mut driving, share, &solved.following);
        let displacement = solved.displacement;

        let borne = supports_in_step(run, &mesh, span, &displacement, inertial.as_ref());
        let Run { world, model, points, clock, .. } = &mut *run;
        let of = Context::new(world, model, (&mesh, points), span);
        add(&mut loads.external_end, 1.0, &declaration::exerted(of, Some(&displacement))?);
        if let Some(contact) = &contact
            && let Some(what) = world.first_message(contact.too_deep(points, &displacement))
        {
            return Err(Refusal { cause: Cause::Penetration, what }.into());
        }
        if let Some(facing) = &facing
            && let Some(what) = world.first_message(facing.too_deep(points, &displacement))
        {
            return Err(Refusal { cause: Cause::Penetration, what }.into());
        }
        let carry = || Ok(newton::carried(world, model, &mesh, points, &displacement, span));
        let Carried { made, moved_grid } = clock.time(Phase::Update, carry)??;

        // What the boundaries supply, in the mean and at both ends of the step.
        let out_of_balance: Vec<f64> =
            solved.internal.iter().zip(&driving).map(|(force, driving)| force - driving).collect();
        let (supplied, ends) = match &inertial {
            Some(inertial) => inertial.supplied(model, &mesh, out_of_balance),
            None => (out_of_balance, [solved.internal_start, solved.internal]),
        };
        let touching = contact.map(|contact| contact.finish(&displacement, shares));
        let (met, of_bodies) = facing.map_or_else(Default::default, |facing| {
            facing.finish(model, points, &displacement, shares)
        });
        let external = [&loads.external_start[..], &loads.external_end];
        let mut work = work_of_step::<D>(
            conditions,
            &mesh.numbering,
            &displacement,
            external,
            [&ends[0], &ends[1]],
        );
        work += touching.as_ref().map_or(0.0, |touching| touching.work);
        let rates = inertial.as_ref().map(|inertial| inertial.rates_at_end(&displacement));
        let mut before = self.dynamics.as_mut().map(|dynamics| &mut dynamics.before);
        let energies = clock.time(Phase::Update, || {
            let of_points = inertial.as_ref().zip(rates.as_ref()).map(|(inertial, rates)| {
                inertial.rates_of_points(model, mesh.step_points(points, &model.materials), rates)
            });
            let (numbering, kept) = (&mesh.numbering, before.as_deref_mut());
            let updated = update::apply(model, numbering, &displacement, &made, points, kept);
            world.fail_together(updated)?;
            let (done, kept) = (touching.as_ref(), before.as_deref_mut());
            touching::keep(&model.contacts, done, of_bodies, points, kept);
            if let (Some(rates), Some(before)) = (of_points, before) {
                before.velocity.replace(&mut points.velocity, rates.velocity);
                before.acceleration.replace(&mut points.acceleration, rates.acceleration);
            }
            Ok(update::energies(points, &model.materials))
        })?;

        let reaction = at_held(conditions, &supplied);
        let mut row = HistoryRow {
            step: number,
            stage: span.stage,
            load_factor: span.factor_end,
            newton_iterations: evaluations,
            residual: solved.residual,
            linear_iterations,
            reactions: with_supports(
                world,
                &borne,
                reactions(
                    world,
                    &model.grid,
                    &mesh,
                    points,
                    &model.deck.boundaries,
                    conditions,
                    &supplied,
                ),
            ),
            ..grid_side(world, &mesh, points)
        };
        if let Some(touching) = &touching {
            self.contact.book(world, touching, &mut row);
        }
        self.contact.book_bodies(world, &met, &mut row);
        match (&mut self.dynamics, &inertial, &rates) {
            (Some(dynamics), Some(inertial), Some(rates)) => {
                let sums = inertial.sums(&mesh, conditions, (rates, &displacement), energies, work);
                row.time = span.time_end;
                row.dt = span.time_end - span.time_start;
                dynamics.book(run, sums, solved.ghost_energy, &mut row)?;
            }
            _ => {
                let sums = world.sum_slice(&[energies.strain, energies.plastic, work]);
                (row.energy_strain, row.energy_plastic) = (sums[0], sums[1]);
                (row.work_external, row.energy_ghost) = (sums[2], solved.ghost_energy);
                self.totals.add(&mut row);
            }
        }
        row.cuts = self.stepping.cuts;
        if let Some(moving) = &moving {
            moving.finish(&mut self.free);
        }
        row.free = self.free.states();
        let poses = self.free.poses(&run.model, span);
        Ok(Solved { row, mesh, displacement, reaction, moved_grid, poses })
    }

    fn undo(&mut self, points: &mut Points<D>) -> bool {
        let Some(dynamics) = &mut self.dynamics else { return false };
        dynamics.before.restore(points);
        true
    }

    fn refuse(&mut self) -> Answer {
        if self.stepping.refuse() { Answer::Smaller } else { Answer::Smallest }
    }

    fn energy_came(&mut self, energy: f64) {
        if let Some(dynamics) = &mut self.dynamics {
            dynamics.take_in(energy);
        }
    }

    fn accept(&mut self, _run: &Run<D>, _next: Next) -> Moment {
        self.stepping.accept()
    }

    fn completed(&self) -> usize {
        self.stepping.completed()
    }
}

/// What the supports bear: at the end of the step, in dynamics in its mean, as the other reactions.
fn supports_in_step<const D: usize>(
    run: &Run<D>,
    mesh: &Discretisation<D>,
    span: StepSpan,
    displacement: &[f64],
    inertial: Option<&InertialStep>,
) -> Vec<Borne> {
    let Run { model, points, .. } = run;
    let end = supports(model, mesh, points, span.end(), displacement);
    match inertial.map(InertialStep::share_of_start) {
        Some(share) if share > 0.0 => {
            let start = supports_at_start(model, mesh, points, span);
            end.iter().zip(&start).map(|(end, start)| end.mixed(start, share)).collect()
        }
        _ => end,
    }
}

/// Sums of a quasi-static run so far.
#[derive(Default)]
struct Totals {
    work: f64,
    ghost: f64,
}

impl Totals {
    /// Adds a step's work and Ghost energy; its row then has those of the run.
    fn add(&mut self, row: &mut HistoryRow) {
        self.work += row.work_external;
        self.ghost += row.energy_ghost;
        (row.work_external, row.energy_ghost) = (self.work, self.ghost);
    }

    fn save(&self, state: &mut RunState) {
        state.set("totals.work", self.work);
        state.set("totals.ghost", self.ghost);
    }

    fn restore(&mut self, state: &RunState) -> Result<()> {
        self.work = state.number("totals.work")?;
        self.ghost = state.number("totals.ghost")?;
        Ok(())
    }
}

/// Work of loads and moved boundaries over the step, by the trapezoidal rule, this rank's share.
fn work_of_step<const D: usize>(
    conditions: &Conditions,
    numbering: &Numbering,
    displacement: &[f64],
    external: [&[f64]; 2],
    internal: [&[f64]; 2],
) -> f64 {
    (0..numbering.owned * D)
        .map(|dof| {
            // On a held component the boundary supplies what the loads do not.
            let side = if conditions.fixed[dof] { internal } else { external };
            0.5 * (side[0][dof] + side[1][dof]) * displacement[dof]
        })
        .sum()
}
