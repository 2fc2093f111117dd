//! Contact in explicit steps: the forces of a step's start, and rigid bodies that move freely under them.

use crate::contact::free::FreeBody;
use crate::contact::pose::Pose;
use crate::deck::model::Load;
use crate::deck::{Presence, Scope};
use crate::error::Result;
use crate::loads::Moment;
use crate::output::restart::run_state::RunState;
use crate::output::tables::history::{FreeState, HistoryRow};
use crate::parallel::World;
use crate::points::Points;
use crate::record::contact::{ContactTotals, Met};
use crate::system::conditions::StepSpan;
use crate::system::model::Model;
use crate::system::step_system::Discretisation;
use crate::system::terms::contact::ContactTerm;
use crate::system::terms::touching::Finished;

/// What contact keeps from step to step of an explicit run.
pub(crate) struct ContactSteps<const D: usize> {
    totals: ContactTotals,
    /// One per rigid body; `None`: held or driven.
    free: Vec<Option<FreeBody<D>>>,
}

/// Contact in a step.
pub(crate) struct Pushing<const D: usize> {
    pub term: ContactTerm<D>,
    /// On the owned degrees of freedom, N.
    pub force: Vec<f64>,
}

impl<const D: usize> ContactSteps<D> {
    pub fn new(model: &Model<D>) -> Self {
        let contacts = &model.contacts;
        ContactSteps {
            totals: ContactTotals::new(model.deck.contacts.len()),
            free: contacts.rigids.iter().map(|rigid| rigid.free.clone()).collect(),
        }
    }

    pub fn save(&self, state: &mut RunState) {
        self.totals.save(state);
        for (index, body) in self.free.iter().enumerate() {
            let words = body.iter().flat_map(FreeBody::words).enumerate();
            words.for_each(|(k, word)| state.set(&format!("rigid.{index}.{k}"), word));
        }
    }

    pub fn restore(&mut self, state: &RunState) -> Result<()> {
        self.totals.restore(state)?;
        for (index, body) in self.free.iter_mut().enumerate() {
            let Some(body) = body else { continue };
            let count = body.words().len();
            let words = (0..count).map(|k| state.number(&format!("rigid.{index}.{k}")));
            body.set_words(&words.collect::<Result<Vec<f64>>>()?);
        }
        Ok(())
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
        let Some(mut term) = ContactTerm::new(model, mesh, points, span, &self.free) else {
            return Ok(None);
        };
        let numbering = &mesh.numbering;
        let mut force = vec![0.0; numbering.len() * D];
        term.add_force_at_start(&mut force);
        numbering.halo.reverse_add(world, &mut force, D)?;
        force.truncate(numbering.owned * D);
        if self.free.iter().any(Option::is_some) {
            let exerted = term.exerted_at_start();
            let shares = exerted.iter().flat_map(|all| all.force.into_iter().chain(all.torque));
            let sums = world.sum_slice(&shares.collect::<Vec<f64>>());
            let dt = span.time_end - span.time_start;
            for (rigid, (body, sums)) in self.free.iter_mut().zip(sums.chunks_exact(6)).enumerate()
            {
                let Some(body) = body else { continue };
                if !model.contacts.rigids[rigid].presence.is_in(span.stage) {
                    continue;
                }
                let pushed = std::array::from_fn(|a| -sums[a]);
                let torque = std::array::from_fn(|a| -sums[3 + a]);
                body.advance(&pushed, &torque, &gravity(model, body, span), dt);
                term.set_end(rigid, body.pose);
            }
        }
        Ok(Some(Pushing { term, force }))
    }

    /// Of the rigid bodies at a step's end.
    pub fn poses(&self, model: &Model<D>, span: StepSpan) -> Vec<Pose<D>> {
        let driven = model.contacts.poses(span.end()).into_iter();
        driven.zip(&self.free).map(|(pose, body)| body.as_ref().map_or(pose, |b| b.pose)).collect()
    }

    /// Books what pairs of bodies have exchanged in a step into its row. Collective.
    pub fn book_bodies(&mut self, world: &World, met: &[Met], row: &mut HistoryRow) {
        self.totals.book_bodies(world, met, row);
    }

    /// Books what a step leaves into its row. Collective.
    pub fn book(&mut self, world: &World, finished: &Finished<D>, row: &mut HistoryRow) {
        self.totals.book(world, finished, row);
        let in_space = |v: [f64; D]| {
            let mut all = [0.0; 3];
            all[..D].copy_from_slice(&v);
            all
        };
        let states = self.free.iter().flatten().map(|body| FreeState {
            centre: in_space(body.centre()),
            velocity: in_space(body.velocity),
            spin: body.spin(),
            energy: body.kinetic_energy(),
        });
        row.free = states.collect();
    }
}

/// The deck's gravity at a body's centre, m/s2.
fn gravity<const D: usize>(model: &Model<D>, body: &FreeBody<D>, span: StepSpan) -> [f64; D] {
    let at = Moment::new(model.deck.analysis.kind, Presence::default(), span.start());
    let mut scope = Scope { load_factor: at.load_factor, time: at.time, ..Scope::default() };
    scope.initial[..D].copy_from_slice(&body.pose.centre);
    let mut sum = [0.0; D];
    for load in &model.deck.loads {
        if let Load::Gravity(all) = load {
            for (sum, value) in sum.iter_mut().zip(all) {
                *sum += at.factor_of(value) * value.value(&scope);
            }
        }
    }
    sum
}
