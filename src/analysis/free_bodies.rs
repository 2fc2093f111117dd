//! Rigid bodies that move freely, between the steps of dynamic analyses.

use crate::contact::free::FreeBody;
use crate::contact::pose::Pose;
use crate::deck::{Presence, When};
use crate::error::Result;
use crate::loads::{Moment, total_gravity};
use crate::output::restart::run_state::RunState;
use crate::output::tables::history::FreeState;
use crate::system::conditions::StepSpan;
use crate::system::model::Model;

/// All of a deck, one place per rigid body; `None`: held or driven.
pub(crate) struct FreeBodies<const D: usize>(pub Vec<Option<FreeBody<D>>>);

impl<const D: usize> FreeBodies<D> {
    /// As the deck has them.
    pub fn new(model: &Model<D>) -> Self {
        FreeBodies(model.contacts.rigids.iter().map(|rigid| rigid.free.clone()).collect())
    }

    pub fn is_empty(&self) -> bool {
        self.0.iter().all(Option::is_none)
    }

    pub fn save(&self, state: &mut RunState) {
        for (index, body) in self.0.iter().enumerate() {
            let words = body.iter().flat_map(FreeBody::words).enumerate();
            words.for_each(|(k, word)| state.set(&format!("rigid.{index}.{k}"), word));
        }
    }

    pub fn restore(&mut self, state: &RunState) -> Result<()> {
        for (index, body) in self.0.iter_mut().enumerate() {
            let Some(body) = body else { continue };
            let count = body.words().len();
            let words = (0..count).map(|k| state.number(&format!("rigid.{index}.{k}")));
            body.set_words(&words.collect::<Result<Vec<f64>>>()?);
        }
        Ok(())
    }

    /// Those that move in a stage, with their index.
    pub fn moving<'a>(
        &'a self,
        model: &'a Model<D>,
        stage: usize,
    ) -> impl Iterator<Item = (usize, &'a FreeBody<D>)> {
        let there = move |index: usize| model.contacts.rigids[index].presence.is_in(stage);
        let all = self.0.iter().enumerate().filter(move |(index, _)| there(*index));
        all.filter_map(|(index, body)| body.as_ref().map(|body| (index, body)))
    }

    /// Of all rigid bodies at a step's end.
    pub fn poses(&self, model: &Model<D>, span: StepSpan) -> Vec<Pose<D>> {
        let driven = model.contacts.poses(span.end()).into_iter();
        driven.zip(&self.0).map(|(pose, body)| body.as_ref().map_or(pose, |b| b.pose)).collect()
    }

    /// For the history.
    pub fn states(&self) -> Vec<FreeState> {
        let in_space = |v: [f64; D]| {
            let mut all = [0.0; 3];
            all[..D].copy_from_slice(&v);
            all
        };
        let states = self.0.iter().flatten().map(|body| FreeState {
            centre: in_space(body.centre()),
            velocity: in_space(body.velocity),
            spin: body.spin(),
            energy: body.kinetic_energy(),
        });
        states.collect()
    }
}

/// The deck's gravity at a body's centre, m/s2.
pub(crate) fn gravity<const D: usize>(
    model: &Model<D>,
    body: &FreeBody<D>,
    when: When,
) -> [f64; D] {
    let at = Moment::new(model.deck.analysis.kind, Presence::default(), when);
    total_gravity(&model.deck.loads, at, &body.pose.centre)
}
