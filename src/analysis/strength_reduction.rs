//! Strength reduction (Griffiths, Lane 1999): c and tan(phi) are divided by a factor until no
//! equilibrium is found.
//!
//! ```text
//! the deck's steps with the strength as it is: a quasi-static analysis
//! while the bracket of the factor is wider than its tolerance:
//!     a larger factor, or the middle of the bracket: one step from the last equilibrium
//!     equilibrium: the bracket's lower end; none, or a jump of the displacement: its upper end
//! ```

use crate::deck::Scope;
use crate::error::{Error, Result};
use crate::output::restart::run_state::RunState;
use crate::points::Points;
use crate::record::context::Run;
use crate::record::step::{Moment, Solved};
use crate::system::conditions::StepSpan;
use crate::transfer::refusal::{Cause, Halt, Refusal};

use super::implicit::Implicit;
use super::time_loop::{Analysis, Answer, Labels, Next};

/// Growth of the factor while there is no upper end.
const GROWTH: f64 = 1.25;
/// A trial that moves a node this many times as far, per change of ln(factor), as the least so far is
/// a collapse that comes to rest in a new shape.
const JUMP: f64 = 100.0;
/// No collapse is looked for beyond.
const LARGEST: f64 = 100.0;

/// What is known of the factor.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bracket {
    /// The largest with an equilibrium.
    lower: f64,
    /// The smallest without one.
    upper: Option<f64>,
    tolerance: f64,
}

impl Bracket {
    /// The next factor to be tried; `None` at the end.
    fn trial(&self) -> Option<f64> {
        match self.upper {
            None => (self.lower < LARGEST).then_some(GROWTH * self.lower),
            Some(upper) if upper - self.lower <= self.tolerance * self.lower => None,
            Some(upper) => Some(0.5 * (self.lower + upper)),
        }
    }

    /// Its middle, where it has one.
    fn middle(&self) -> Option<f64> {
        self.upper.map(|upper| 0.5 * (self.lower + upper))
    }
}

/// The analysis between its steps.
pub struct StrengthReduction<const D: usize> {
    implicit: Implicit<D>,
    bracket: Bracket,
    /// Trials that found an equilibrium.
    accepted: usize,
    /// Least displacement per change of ln(factor) of a trial, m.
    mobility: f64,
    /// What the strength of the model is divided by at present.
    applied: f64,
    /// Points before a trial.
    before: Option<Points<D>>,
    /// The end of the steps.
    end: StepSpan,
}

impl<const D: usize> StrengthReduction<D> {
    /// Before the first step. Collective.
    pub fn new(run: &Run<D>) -> Self {
        let deck = &run.model.deck;
        let time = deck.stages.len() as f64;
        StrengthReduction {
            implicit: Implicit::new(run),
            bracket: Bracket {
                lower: 1.0,
                upper: None,
                tolerance: deck.analysis.strength_tolerance,
            },
            accepted: 0,
            mobility: f64::INFINITY,
            applied: 1.0,
            before: None,
            end: StepSpan {
                stage: deck.stages.len() - 1,
                factor_start: 1.0,
                factor_end: 1.0,
                time_start: time,
                time_end: time,
            },
        }
    }

    /// The factor, once the search has an upper end.
    pub fn factor(&self) -> Option<f64> {
        self.bracket.middle()
    }

    /// The factor to be tried, once the deck's own steps are done.
    fn trial(&self) -> Option<f64> {
        self.bracket.trial().filter(|_| self.implicit.next().is_none())
    }

    /// Divides the strength by `factor`, from what it is divided by now.
    fn apply(&mut self, run: &mut Run<D>, factor: f64) {
        let Run { model, points, .. } = run;
        let (deck, ratio) = (&model.deck, factor / self.applied);
        let given = |body: usize| &deck.materials[deck.bodies[body].material];
        for (body, material) in model.materials.iter_mut().enumerate() {
            let mut values = given(body).values(&Scope::default());
            given(body).weaken(&mut values, factor);
            *material = (given(body).model.make)(&values);
        }
        for p in 0..points.len() {
            let body = points.body[p];
            if given(body as usize).varies() {
                given(body as usize).weaken(points.parameters.of_mut(p, body), ratio);
            }
        }
        self.applied = factor;
    }

    /// One step to an equilibrium with the strength over `factor`. Collective.
    fn attempt(
        &mut self,
        run: &mut Run<D>,
        next: Next,
        factor: f64,
    ) -> std::result::Result<Solved<D>, Halt> {
        self.apply(run, factor);
        self.before = Some(run.points.clone());
        let none = |why: &str| {
            let what = format!("no equilibrium with the strength over {factor:.4} ({why})");
            Halt::from(Refusal { cause: Cause::NotConverged, what })
        };
        let mut solved = self.implicit.step(run, next).map_err(|halt| match halt {
            Halt::Refused(refusal) => none(&refusal.what),
            Halt::Failed(Error::Run(what)) => none(&what),
            other => other,
        })?;
        let largest = solved.displacement.iter().fold(0.0f64, |most, u| most.max(u.abs()));
        let largest = run.world.max(largest);
        let mobility = largest / (factor / self.bracket.lower).ln();
        if largest > run.model.grid.cell_size() || mobility > JUMP * self.mobility {
            return Err(none(&format!("displacement jumps: a node moves by {largest:.3e} m")));
        }
        self.mobility = self.mobility.min(mobility);
        run.recorder.log.say(&format!(
            "strength over {factor:.4}: equilibrium, nodes move by at most {largest:.3e} m"
        ));
        solved.row.strength_factor = factor;
        Ok(solved)
    }
}

impl<const D: usize> Analysis<D> for StrengthReduction<D> {
    fn labels(&self) -> Labels {
        Labels { steps: None, ..self.implicit.labels() }
    }

    fn restore(&mut self, state: &RunState) -> Result<()> {
        self.implicit.restore(state)?;
        self.bracket.lower = state.number("strength.lower")?;
        let upper = state.number("strength.upper")?;
        self.bracket.upper = upper.is_finite().then_some(upper);
        self.mobility = state.number("strength.mobility")?;
        self.accepted = state.count("strength.accepted")? as usize;
        Ok(())
    }

    fn state(&self) -> RunState {
        let mut state = self.implicit.state();
        state.set("strength.lower", self.bracket.lower);
        state.set("strength.upper", self.bracket.upper.unwrap_or(f64::INFINITY));
        state.set("strength.mobility", self.mobility);
        state.set_count("strength.accepted", self.accepted as u64);
        state
    }

    fn next(&self) -> Option<Next> {
        self.implicit.next().or_else(|| {
            self.bracket.trial()?;
            Some(Next { span: self.end, number: self.completed() + 1 })
        })
    }

    fn step(&mut self, run: &mut Run<D>, next: Next) -> std::result::Result<Solved<D>, Halt> {
        if let Some(factor) = self.trial() {
            return self.attempt(run, next, factor);
        }
        let mut solved = self.implicit.step(run, next)?;
        solved.row.strength_factor = 1.0;
        Ok(solved)
    }

    fn undo(&mut self, points: &mut Points<D>) -> bool {
        match self.before.take() {
            Some(before) => {
                *points = before;
                true
            }
            None => self.implicit.undo(points),
        }
    }

    fn refuse(&mut self) -> Answer {
        match self.trial() {
            Some(factor) => {
                self.bracket.upper = Some(factor);
                Answer::Smaller
            }
            None => self.implicit.refuse(),
        }
    }

    fn accept(&mut self, run: &Run<D>, next: Next) -> Moment {
        self.before = None;
        if let Some(factor) = self.trial() {
            self.bracket.lower = factor;
            self.accepted += 1;
            return if self.bracket.trial().is_none() { Moment::End } else { Moment::Step };
        }
        match self.implicit.accept(run, next) {
            Moment::End => Moment::Step,
            moment => moment,
        }
    }

    fn completed(&self) -> usize {
        self.implicit.completed() + self.accepted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bracket_closes_around_the_factor() {
        let mut bracket = Bracket { lower: 1.0, upper: None, tolerance: 0.01 };
        let mut trials = 0;
        while let Some(factor) = bracket.trial() {
            trials += 1;
            match factor < 1.4 {
                true => bracket.lower = factor,
                false => bracket.upper = Some(factor),
            }
        }
        let found = bracket.middle().expect("an upper end");
        assert!((found - 1.4).abs() < 0.01 * 1.4 && trials < 10, "{found} after {trials}");
        let mut endless = Bracket { lower: 1.0, upper: None, tolerance: 0.01 };
        while let Some(factor) = endless.trial() {
            endless.lower = factor;
        }
        assert_eq!(endless.middle(), None);
    }
}
