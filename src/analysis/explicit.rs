//! Explicit dynamics over all time steps (Ghost §2.3): what a run checks, records and leaves.

use crate::basis::Domain;
use crate::deck::model::{DomainUpdate, Mass};
use crate::error::Result;
use crate::mass::solver::MassSolver;
use crate::output::restart::run_state::RunState;
use crate::points::Points;
use crate::points::Snapshot;
use crate::record::context::Run;
use crate::record::ledger::{Entry, Ledger};
use crate::record::step::{Moment, Solved};
use crate::system::model::Model;
use crate::transfer::affine;
use crate::transfer::refusal::{Cause, Halt};

use super::explicit_contact::ContactSteps;
use super::explicit_step::advance;
use super::time_loop::{Analysis, Answer, Labels, Next};
use super::time_steps::{TimeSteps, ledger_at_start, stability_limit};

/// The explicit analysis between its steps.
pub struct Explicit<const D: usize> {
    steps: TimeSteps,
    /// Stability limit of full cells, s.
    limit: f64,
    ledger: Ledger,
    before: Snapshot<D>,
    solver: MassSolver,
    contact: ContactSteps<D>,
}

impl<const D: usize> Explicit<D> {
    /// Before the first step. Collective.
    pub fn new(run: &mut Run<D>) -> Result<Self> {
        if run.recorder.resumed().is_none() {
            let Model { deck, grid, .. } = &run.model;
            let begun = affine::begin(&deck.method, grid, &mut run.points);
            run.world.fail_together(begun)?;
        }
        let (ledger, limit) = ledger_at_start(run);
        let steps = TimeSteps::new(&run.model.deck);
        let (before, solver) = (Snapshot::default(), MassSolver::default());
        let contact = ContactSteps::new(&run.model);
        Ok(Explicit { steps, limit, ledger, before, solver, contact })
    }
}

impl<const D: usize> Analysis<D> for Explicit<D> {
    fn labels(&self) -> Labels {
        Labels { newton: false, time: true, steps: None }
    }

    fn restore(&mut self, state: &RunState) -> Result<()> {
        self.steps.restore(state)?;
        self.contact.restore(state)?;
        self.ledger.restore(state)
    }

    fn state(&self) -> RunState {
        let mut state = RunState::new();
        self.steps.save(&mut state);
        self.contact.save(&mut state);
        self.ledger.save(&mut state);
        state
    }

    fn next(&self) -> Option<Next> {
        let number = self.steps.number();
        self.steps.next(self.limit).map(|span| Next { span, number })
    }

    fn step(&mut self, run: &mut Run<D>, next: Next) -> std::result::Result<Solved<D>, Halt> {
        let Explicit { before, solver, contact, .. } = self;
        let (mut solved, sums) = advance(run, before, solver, contact, next.span)?;
        let entry = Entry::unite(run.world, &run.points, sums);
        let row = &mut solved.row;
        row.step = next.number;
        if let Err(gain) = self.ledger.book(&entry, row) {
            // The row shows what happened.
            row.wall_seconds = run.clock.elapsed();
            run.recorder.step(run.world, &run.points, row, false, Moment::End)?;
            let (limit, _) = stability_limit(run.world, &run.model, &run.points);
            let remedy = format!(
                "the time step {:.3e} s is too large (stability limit of full cells {limit:.3e} \
                 s){}",
                row.dt,
                unstabilised(&run.model)
            );
            return Err(Halt::Unstable { gain, remedy });
        }
        if entry.overgrown > 0.0 {
            run.recorder.log.warn_of_step(
                next.number,
                "GIMP domains had grown to more than twice what their points are stretched by, and \
                 were put back to the stretch: method.domain_update = \"corners\" follows nodes that \
                 hardly hold mass; \"stretch\" or a consistent mass does not",
                &format!("({} domains)", entry.overgrown),
            );
        }
        if let Some(share) = self.ledger.gain(&entry) {
            let detail = format!("({:.1} %)", 100.0 * share);
            run.recorder.log.warn_of_step(next.number, &gaining(&run.model), &detail);
        }
        run.recorder.linear.add(row.linear_iterations);
        Ok(solved)
    }

    fn undo(&mut self, points: &mut Points<D>) -> bool {
        self.before.restore(points);
        true
    }

    fn refuse(&mut self) -> Answer {
        Answer::Uncut
    }

    fn hint(&self, model: &Model<D>, halt: &Halt) -> &'static str {
        match halt {
            Halt::Refused(refusal) if refusal.cause == Cause::Inverted => unstabilised(model),
            _ => "",
        }
    }

    fn energy_came(&mut self, energy: f64) {
        self.ledger.take_in(energy);
    }

    fn accept(&mut self, run: &Run<D>, next: Next) -> Moment {
        self.steps.accept(next.span);
        if self.steps.follows_limit() {
            self.limit = stability_limit(run.world, &run.model, &run.points).0;
        }
        if self.steps.next(self.limit).is_none() { Moment::End } else { Moment::Step }
    }

    fn completed(&self) -> usize {
        self.steps.number() - 1
    }
}

/// Where energy that no work brought in may come from.
fn gaining<const D: usize>(model: &Model<D>) -> String {
    let method = &model.deck.method;
    let cause = match (method.mass, method.basis.domain(), method.domain_update) {
        (Mass::Lumped, Domain::Box, DomainUpdate::Corners) => {
            "GIMP domains that follow nodes of little mass (domain_update = \"stretch\" does not)"
        }
        // Measured: docs/evidence/exactness.md, under "Not kept".
        (Mass::Consistent, Domain::Box, update) if update != DomainUpdate::None => {
            "the time step, which with the consistent mass must be smaller where GIMP domains are \
             stretched over more than a cell (half the step, domain_update = \"none\" or mass = \
             \"lumped\" helps; a FLIP share below 1 does not)"
        }
        (Mass::Consistent, ..) => {
            "points that cross cells under large deformation with the FLIP share of velocity_update \
             (a number below 1 damps it), or the time step"
        }
        _ => "points that cross cells (a basis with domains is smoother), or the time step",
    };
    format!(
        "the energy has grown by more than 5 % of what was there or brought in, without work done \
         on the bodies; likely: {cause}"
    )
}

/// What makes a consistent mass without Ghost share unstable is not the time step.
fn unstabilised<const D: usize>(model: &Model<D>) -> &'static str {
    let none = model.penalties.iter().all(|penalty| penalty.mass == 0.0);
    if none && model.deck.method.mass == Mass::Consistent {
        "; the consistent mass is not stabilised: [ghost] mass_factor = 0.25 bounds its condition"
    } else {
        ""
    }
}
