//! d(s, t) and R(s, t): how the deck drives a rigid body.

use super::pose::{Pose, rotation};
use crate::deck::expression::{Expression, Scope};
use crate::deck::model::RigidMotion;

/// Pieces of the time so far over which a velocity that changes is integrated, each by Gauss' rule
/// with three points.
const PIECES: usize = 64;
/// Nodes and weights of that rule on [0, 1].
const GAUSS: [(f64, f64); 3] = [
    (0.112_701_665_379_258_3, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];

/// A moment of the analysis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct When {
    /// s
    pub load_factor: f64,
    /// t, s
    pub time: f64,
    /// t when the body came, s.
    pub since: f64,
}

/// How a rigid body is driven; without any key it is held.
#[derive(Debug, Clone)]
pub struct Motion(pub RigidMotion);

impl Motion {
    /// c, m.
    pub fn centre<const D: usize>(&self) -> [f64; D] {
        let centre = self.0.rotation.as_ref().map(|rotation| &rotation.centre);
        std::array::from_fn(|a| centre.map_or(0.0, |centre| centre[a]))
    }

    /// Where the body is. Totals that hold neither s nor t grow with s.
    pub fn pose<const D: usize>(&self, when: When) -> Pose<D> {
        let scope = Scope { load_factor: when.load_factor, time: when.time, ..Scope::default() };
        let total = |value: &Expression| {
            let ramp = if value.depends_on_time() { 1.0 } else { when.load_factor };
            ramp * value.value(&scope)
        };
        let mut pose = Pose::at_start(self.centre());
        for (shift, value) in pose.shift.iter_mut().zip(&self.0.displacement) {
            *shift = total(value);
        }
        for (shift, value) in pose.shift.iter_mut().zip(&self.0.velocity) {
            *shift += travelled(value, when);
        }
        if let Some(turning) = &self.0.rotation {
            pose.turn = rotation(&turning.axis, total(&turning.degrees));
        }
        pose
    }
}

/// ∫ v dt since the body came, m.
fn travelled(velocity: &Expression, when: When) -> f64 {
    let time = when.time - when.since;
    if let Some(constant) = velocity.as_constant() {
        return constant * time;
    }
    let piece = time / PIECES as f64;
    let at = |share: f64| {
        velocity.value(&Scope { time: when.since + share * piece, ..Scope::default() })
    };
    (0..PIECES)
        .flat_map(|k| GAUSS.iter().map(move |(x, weight)| (k as f64 + x, weight)))
        .map(|(share, weight)| weight * piece * at(share))
        .sum()
}
