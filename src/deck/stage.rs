//! Stages: what is there when, and how s runs.
//!
//! s runs from 0 to 1 in each stage. What comes with a stage ramps with it and keeps its full value
//! from then on; what goes with a stage falls to nothing over it.

/// `[[stage]]`; a deck without one has a single stage of `analysis.steps`.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Empty for that of a deck without stages.
    pub name: String,
    /// `None` only with `cfl`.
    pub steps: Option<usize>,
    /// s; dynamics only.
    pub duration: Option<f64>,
    /// Displacements count from the start of this stage.
    pub reset_displacement: bool,
}

/// t as a stage begins, s; without time the stages before count as one second each.
pub fn begin_of(stages: &[Stage], stage: usize) -> f64 {
    stages.iter().take(stage).map(|stage| stage.duration.unwrap_or(1.0)).sum()
}

/// A moment of the analysis: the stage (from zero), s in it, and the time over all stages, s.
/// Without time the stages before count as one second each.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct When {
    /// From zero.
    pub stage: usize,
    /// s of the stage.
    pub factor: f64,
    /// Over all stages, s.
    pub time: f64,
}

/// When a body, a load or a boundary is there: stages by their index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Presence {
    /// The first stage; `None`: it has been there before the first one, in full.
    pub from: Option<usize>,
    /// The last stage; `None`: it stays.
    pub until: Option<usize>,
    /// It falls to nothing over its last stage. Else it is there in full to that stage's end.
    pub fades: bool,
}

impl Default for Presence {
    /// What a deck without stages has: there from the first stage on.
    fn default() -> Self {
        Presence { from: Some(0), until: None, fades: true }
    }
}

impl Presence {
    /// There before the first stage.
    pub const BEFORE: Presence = Presence { from: None, until: None, fades: true };

    /// Whether it is there in a stage.
    pub fn is_in(&self, stage: usize) -> bool {
        self.from.is_none_or(|from| from <= stage) && self.until.is_none_or(|until| stage <= until)
    }

    /// Where this and another are there together; `None`: never.
    pub fn together(&self, other: &Presence) -> Option<Presence> {
        let from = self.from.max(other.from);
        let until = [self.until, other.until].into_iter().flatten().min();
        let ever = until.is_none_or(|until| from.is_none_or(|from| from <= until));
        ever.then_some(Presence { from, until, fades: self.fades })
    }

    /// There, and not on the way out.
    pub fn holds_in(&self, stage: usize) -> bool {
        self.is_in(stage) && !(self.fades && self.until == Some(stage))
    }

    /// Whether it comes with this stage.
    pub fn comes_in(&self, stage: usize) -> bool {
        self.from == Some(stage)
    }

    /// Whether it falls to nothing over this stage.
    pub fn fades_in(&self, stage: usize) -> bool {
        self.fades && self.until == Some(stage)
    }

    /// s of its own formulas and ramps: that of the stage it comes with, 1 in later ones.
    pub fn factor(&self, when: When) -> f64 {
        if self.comes_in(when.stage) { when.factor } else { 1.0 }
    }

    /// The share of it that is left: 1, falling to 0 over its last stage, 0 where it is not there.
    pub fn share(&self, when: When) -> f64 {
        if !self.is_in(when.stage) {
            0.0
        } else if self.fades_in(when.stage) {
            1.0 - when.factor
        } else {
            1.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_ramps_stays_and_fades() {
        let presence = Presence { from: Some(1), until: Some(3), fades: true };
        let at = |stage, factor| {
            let when = When { stage, factor, time: 0.0 };
            presence.factor(when) * presence.share(when)
        };
        let found =
            [at(0, 0.5), at(1, 0.25), at(1, 1.0), at(2, 0.0), at(3, 0.25), at(3, 1.0), at(4, 0.5)];
        assert_eq!(found, [0.0, 0.25, 1.0, 1.0, 0.75, 0.0, 0.0]);
        assert!(presence.holds_in(2) && presence.is_in(3) && !presence.holds_in(3));
        let whole = Presence { fades: false, ..presence };
        assert!(whole.holds_in(3) && whole.share(When { stage: 3, factor: 0.9, time: 0.0 }) == 1.0);
        let later = Presence { from: Some(2), ..Presence::default() };
        assert_eq!(presence.together(&later), Some(Presence { from: Some(2), ..presence }));
        assert_eq!(presence.together(&Presence { from: Some(4), ..later }), None);
        assert_eq!(Presence::BEFORE.factor(When::default()), 1.0);
        assert_eq!(Presence::default().factor(When::default()), 0.0);
    }
}
