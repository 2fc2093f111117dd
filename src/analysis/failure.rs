//! A step that ends a run: what is known of it, and the words for it.

use std::fmt;

use crate::transfer::refusal::Halt;

/// The step that could not be finished.
#[derive(Debug)]
pub struct Failure {
    /// Nominal step, from one.
    pub step: usize,
    /// All steps of the run; `None` where the loop has no such number.
    pub steps: Option<usize>,
    /// Time at its end, s; `None` in analyses without time.
    pub time: Option<f64>,
    pub why: Halt,
    /// A point whose state is not a number.
    pub point: Option<String>,
    /// What the method itself may have to do with it.
    pub hint: &'static str,
    /// The last nominal step that is finished.
    pub completed: usize,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Failure { step, why, hint, completed, .. } = self;
        write!(f, "step {step}")?;
        match (self.steps, self.time) {
            (Some(steps), Some(time)) => write!(f, " of {steps} (t = {time:.6e} s)")?,
            (Some(steps), None) => write!(f, " of {steps}")?,
            (None, Some(time)) => write!(f, " (to t = {time:.6e} s)")?,
            (None, None) => {}
        }
        if self.steps.is_some() && matches!(why, Halt::Refused(_)) {
            write!(f, " could not be solved")?;
        }
        match why {
            Halt::Refused(refusal) => write!(f, ": {}", refusal.what)?,
            Halt::Unstable { gain, remedy } => write!(f, ": {gain}; {remedy}")?,
            Halt::Failed(error) => write!(f, ": {error}")?,
        }
        if let Some(point) = &self.point {
            write!(f, ": {point}")?;
        }
        write!(f, "{hint}")?;
        match self.steps {
            Some(_) => write!(f, "; the last finished step is {completed}"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::transfer::refusal::{Cause, Refusal};

    fn failure(steps: Option<usize>, time: Option<f64>, why: Halt) -> Failure {
        Failure { step: 3, steps, time, why, point: None, hint: "", completed: 2 }
    }

    #[test]
    fn a_failure_names_step_time_and_reason() {
        let refused =
            || Refusal { cause: Cause::Inverted, what: "point 7 is turned inside out".into() };
        let text = failure(Some(9), None, refused().into()).to_string();
        assert_eq!(
            text,
            "step 3 of 9 could not be solved: point 7 is turned inside out; the last finished step \
             is 2"
        );
        let explicit = Failure { hint: "; a hint", ..failure(None, Some(0.5), refused().into()) };
        let text = explicit.to_string();
        assert_eq!(text, "step 3 (to t = 5.000000e-1 s): point 7 is turned inside out; a hint");
        let of_deck = failure(Some(9), Some(0.5), Error::Input("no value".into()).into());
        let text = of_deck.to_string();
        assert_eq!(text, "step 3 of 9 (t = 5.000000e-1 s): no value; the last finished step is 2");
    }
}
