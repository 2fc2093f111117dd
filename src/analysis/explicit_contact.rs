//! Contact in explicit steps: the forces of a step's start, and rigid bodies that move freely under them.

use crate::contact::pose::Pose;
use crate::error::Result;
use crate::output::restart::run_state::RunState;
use crate::output::tables::history::HistoryRow;
use crate::parallel::World;
use crate::points::Points;
use crate::record::contact::ContactTotals;
use crate::system::conditions::StepSpan;
use crate::system::model::Model;
use crate::system::step_system::Discretisation;
use crate::system::terms::contact::ContactTerm;
use crate::system::terms::touching::Finished;
use crate::system::terms::touching::Met;

use super::free_bodies::{FreeBodies, gravity};

/// What contact keeps from step to step of an explicit run.
pub(crate) struct ContactSteps<const D: usize> {
    totals: ContactTotals,
    free: FreeBodies<D>,
}

/// Contact in a step.
pub(crate) struct Pushing<const D: usize> {
    pub term: ContactTerm<D>,
    /// On the owned degrees of freedom, N.
    pub force: Vec<f64>,
}

impl<const D: usize> ContactSteps<D> {
    pub fn new(model: &Model<D>) -> Self {
        ContactSteps {
            totals: ContactTotals::new(model.deck.contacts.len()),
            free: FreeBodies::new(model),
        }
    }

    pub fn save(&self, state: &mut RunState) {
        self.totals.save(state);
        self.free.save(state);
    }

    pub fn restore(&mut self, state: &RunState) -> Result<()> {
        self.totals.restore(state)?;
        self.free.restore(state)
    }

    /// The forces at the step's start; free rigid bodies move on to its end. `None` without contact.
    /// Collective.
    pub fn begin(
        &mut self,
        world: &World,
        model: &Model<D>,
        mesh: &Discretisation<D>,
        points: &Points<D>,
        span: StepSpan,
    ) -> Result<Option<Pushing<D>>> {
        let Some(mut term) = ContactTerm::new(model, mesh, points, span, &self.free.0) else {
            return Ok(None);
        };
        let numbering = &mesh.numbering;
        let mut force = vec![0.0; numbering.len() * D];
        term.add_force_at_start(&mut force);
        numbering.halo.reverse_add(world, &mut force, D)?;
        force.truncate(numbering.owned * D);
        if !self.free.is_empty() {
            let exerted = term.exerted_at_start();
            let shares = exerted.iter().flat_map(|all| all.force.into_iter().chain(all.torque));
            let sums = world.sum_slice(&shares.collect::<Vec<f64>>());
            let dt = span.time_end - span.time_start;
            for (rigid, (body, sums)) in
                self.free.0.iter_mut().zip(sums.chunks_exact(6)).enumerate()
            {
                let Some(body) = body else { continue };
                if !model.contacts.rigids[rigid].presence.is_in(span.stage) {
                    continue;
                }
                let pushed = std::array::from_fn(|a| -sums[a]);
                let torque = std::array::from_fn(|a| -sums[3 + a]);
                body.advance(&pushed, &torque, &gravity(model, body, span.start()), dt);
                term.set_end(rigid, body.pose);
            }
        }
        Ok(Some(Pushing { term, force }))
    }

    /// Of the rigid bodies at a step's end.
    pub fn poses(&self, model: &Model<D>, span: StepSpan) -> Vec<Pose<D>> {
        self.free.poses(model, span)
    }

    /// Books what pairs of bodies have exchanged in a step into its row. Collective.
    pub fn book_bodies(&mut self, world: &World, met: &[Met], row: &mut HistoryRow) {
        self.totals.book_bodies(world, met, row);
    }

    /// Books what a step leaves into its row. Collective.
    pub fn book(&mut self, world: &World, finished: &Finished<D>, row: &mut HistoryRow) {
        self.totals.book(world, finished, row);
        row.free = self.free.states();
    }
}
