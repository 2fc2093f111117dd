//! Which points are far from a rigid surface. A signed distance changes by no more than the way: no point nearer to a
//! place than its gap less a reach is within that reach of the surface. Points come cell by cell, so that the
//! place of one tells for most of the next ones, and the further off they are, for the more of them.

use crate::contact::pose::Pose;
use crate::contact::surface::{Surface, length};

/// Cells from the box around a surface beyond which the distance from the box is taken: it is no more than
/// the gap, and costs less.
const FAR: f64 = 8.0;

/// A surface and the last place of which the gap was found.
pub(super) struct Far<'a, const D: usize> {
    surface: &'a dyn Surface<D>,
    poses: Vec<Pose<D>>,
    /// m
    far: f64,
    place: [f64; D],
    /// The least over the poses, or less, m.
    gap: f64,
}

impl<'a, const D: usize> Far<'a, D> {
    /// `cell`: size of the grid's cells, m.
    pub fn new(surface: &'a dyn Surface<D>, poses: Vec<Pose<D>>, cell: f64) -> Self {
        Far { surface, poses, far: FAR * cell, place: [0.0; D], gap: f64::NEG_INFINITY }
    }

    /// Whether the gap at `x` is surely larger than `reach`, m.
    #[inline]
    pub fn beyond(&mut self, x: &[f64; D], reach: f64) -> bool {
        let slack = self.gap - reach;
        let squared: f64 = (0..D).map(|a| (x[a] - self.place[a]) * (x[a] - self.place[a])).sum();
        if slack > 0.0 && squared < slack * slack {
            return true;
        }
        (self.place, self.gap) = (*x, self.gap_at(x));
        self.gap > reach
    }

    fn gap_at(&self, x: &[f64; D]) -> f64 {
        let (low, high) = self.surface.bounds();
        let at = |pose: &Pose<D>| {
            let place = pose.to_body(x);
            let beside: [f64; D] =
                std::array::from_fn(|a| (low[a] - place[a]).max(place[a] - high[a]).max(0.0));
            let beside = length(&beside);
            if beside > self.far { beside } else { self.surface.near(&place).gap }
        };
        self.poses.iter().map(at).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ball::Ball;

    /// What is said holds for the surface itself, in whatever order the places come, and is said of all that are far.
    #[test]
    fn only_what_is_far_is_said_to_be() {
        let ball = Ball { centre: [0.3, -0.2], radius: 0.7 };
        let poses = [[0.0; 2], [0.5, 0.1]].map(|shift| {
            let mut pose = Pose::at_start([0.0; 2]);
            pose.shift = shift;
            pose
        });
        let mut far = Far::new(&ball, poses.to_vec(), 0.1);
        let mut counts = [0, 0];
        for k in 0..4000u32 {
            // Runs of eight places that are near each other.
            let of = |step: f64, k: u32| 8.0 * (step * f64::from(k)).fract() - 4.0;
            let along = |step: f64, own: f64| of(step, k / 8) + 0.02 * of(own, k);
            let x = [along(0.618_033_988, 0.37), along(0.754_877_666, 0.91)];
            let reach = 0.1 + (0.569 * f64::from(k)).fract() / 2.0;
            let truly = poses.iter().all(|pose| pose.near(&ball, &x).gap > reach);
            assert!(far.beyond(&x, reach) == truly, "{x:?} {reach}");
            counts[usize::from(truly)] += 1;
        }
        assert!(counts[0] > 100 && counts[1] > 1000, "{counts:?}");
    }
}
