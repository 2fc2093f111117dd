//! Time steps of explicit runs: equal ones, or a fraction of the stability limit
//! dt = 2 / sqrt(lambda_max) of K x = lambda M x (Ghost §3.5).
//!
//! On a full grid lambda_max has closed forms: 12 D c^2 / h^2 with the consistent mass and
//! 4 c^2 / h^2 with the lumped one, c the speed of pressure waves. Cut cells of a stabilised
//! body come close to that (Ghost Figure 7); those of an unstabilised one do not matter, since
//! the method starts each step from the points. A point may also not cross a cell in one step.
//! The penalty of a contact adds to the stiffness of the outermost cells, a declared term to that of its points.
//! `type = "conditioning"` gives the limit of the true eigenvalues for any position.

use crate::deck::model::Mass;
use crate::deck::{Deck, Stage};
use crate::error::Result;
use crate::material::local;
use crate::output::restart::run_state::RunState;
use crate::parallel::World;
use crate::points::Points;
use crate::record::context::Run;
use crate::record::ledger::{Entry, Ledger, StepSums};
use crate::surface::norm;
use crate::system::conditions::StepSpan;
use crate::system::model::Model;
use crate::system::supports::Support;
use crate::system::terms::Declared;
use crate::transfer::update;

/// Where a run stands in time.
#[derive(Debug, Clone)]
pub struct TimeSteps {
    stages: Vec<Stage>,
    cfl: f64,
    done: usize,
    time: f64,
}

impl TimeSteps {
    pub fn new(deck: &Deck) -> Self {
        TimeSteps {
            stages: deck.stages.clone(),
            cfl: deck.analysis.cfl.unwrap_or(1.0),
            done: 0,
            time: 0.0,
        }
    }

    /// Writes the position into a checkpoint.
    pub fn save(&self, state: &mut RunState) {
        state.set_count("time_steps.done", self.done as u64);
        state.set("time_steps.time", self.time);
    }

    /// Takes the position out of a checkpoint.
    pub fn restore(&mut self, state: &RunState) -> Result<()> {
        self.done = state.count("time_steps.done")? as usize;
        self.time = state.number("time_steps.time")?;
        Ok(())
    }

    /// True where the steps follow the stability limit.
    pub fn follows_limit(&self) -> bool {
        self.stages.iter().any(|stage| stage.steps.is_none())
    }

    /// Number of the next step, from 1.
    pub fn number(&self) -> usize {
        self.done + 1
    }

    /// The next step; `limit` is read where the steps follow it. `None` at the end.
    pub fn next(&self, limit: f64) -> Option<StepSpan> {
        let (mut first, mut begin) = (0, 0.0);
        for (index, stage) in self.stages.iter().enumerate() {
            let duration = stage.duration.unwrap_or(1.0);
            // Within the stage.
            let (start, end) = match stage.steps {
                Some(steps) if self.done < first + steps => {
                    let at = |step: usize| duration * (step as f64 / steps as f64);
                    (at(self.done - first), at(self.done - first + 1))
                }
                None if begin + duration - self.time > 1e-12 * (begin + duration) => {
                    let start = (self.time - begin).max(0.0);
                    let left = duration - start;
                    // Equal steps to the end, as long as the limit stays what it is.
                    let count = (left / (self.cfl * limit)).ceil().max(1.0);
                    (start, if count == 1.0 { duration } else { start + left / count })
                }
                _ => {
                    first += stage.steps.unwrap_or(0);
                    begin += duration;
                    continue;
                }
            };
            return Some(StepSpan {
                stage: index,
                factor_start: start / duration,
                factor_end: end / duration,
                time_start: begin + start,
                time_end: begin + end,
            });
        }
        None
    }

    /// Moves on behind `span`.
    pub fn accept(&mut self, span: StepSpan) {
        self.done += 1;
        self.time = span.time_end;
    }
}

/// The ledger of a dynamic run before its first step, and the stability limit there, s. Collective.
pub(super) fn ledger_at_start<const D: usize>(run: &Run<D>) -> (Ledger, f64) {
    let Run { world, model, points, .. } = run;
    let (limit, wave_energy) = stability_limit(world, model, points);
    let energies = update::energies(points, &model.materials);
    let start = StepSums { energies, ..StepSums::default() };
    (Ledger::new(&Entry::unite(world, points, start), wave_energy), limit)
}

/// The stability limit, s, and Σ m c^2, J. Collective.
pub fn stability_limit<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
) -> (f64, f64) {
    let h = model.grid.cell_size();
    let factor = match model.deck.method.mass {
        Mass::Consistent => (3.0 * D as f64).sqrt(),
        Mass::Lumped => 1.0,
    };
    let (mut rate, mut wave_energy) = (0.0f64, 0.0);
    let springs: Vec<f64> =
        (0..model.deck.bodies.len()).map(|body| model.contacts.stiffest(body) * h / 2.0).collect();
    for p in 0..points.len() {
        let modulus =
            local(&model.materials, points, p).model().wave_modulus(|| points.elastic_strain(p));
        let wave = modulus * points.volume(p) / points.mass[p];
        let speed = points.velocity[p].iter().map(|v| v * v).sum::<f64>().sqrt();
        // A penalty holds a layer of half a cell: w^2 = 2 e / (rho h), beside 4 c^2 / h^2.
        let spring = match springs[points.body[p] as usize] {
            0.0 => 0.0,
            stiffness => stiffness * points.volume(p) / points.mass[p],
        };
        let stiffest = |term: &Declared| {
            term.stiffness(points, p).into_iter().fold(0.0, f64::max) / points.mass[p]
        };
        let squared: f64 = model.deck.terms.iter().map(stiffest).sum();
        let held = 0.25 * h * h * (held_frequency(model, points, p) + squared) + spring;
        rate = rate.max((wave.abs() + held).sqrt() * factor + speed);
        wave_energy += points.mass[p] * wave.abs();
    }
    (h / world.max(rate), world.sum(wave_energy))
}

/// Square of the highest frequency, 1/s2, that the penalties on surfaces give the mass of a point that
/// carries their elements: Σ β A Σ_a w_a^2 / (m S_a). The sum over the nodes a is about one where w equals
/// S, and larger where the surface lies beyond the point.
fn held_frequency<const D: usize>(model: &Model<D>, points: &Points<D>, p: usize) -> f64 {
    /// An estimate for surfaces half a spacing beyond their points; a column on a support ran at cfl = 0.9.
    const BEYOND: f64 = 2.0;
    let of_support = |support: &Support<D>| {
        let own = support.surface.carried_by(points.id[p]);
        let area: f64 = own.iter().map(|own| norm(&own.element.area)).sum();
        support.penalty * model.stiffness[points.body[p] as usize] * area
    };
    BEYOND * model.supports.iter().map(of_support).sum::<f64>() / points.mass[p]
}
