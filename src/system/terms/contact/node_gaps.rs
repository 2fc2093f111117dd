//! Gaps of the nodes from a rigid surface. A signed distance changes by no more than the way: the gap of a
//! point is at least that of a node less the distance between them. So most points are known to be far from the
//! surface by the gap of one of their nodes, and nodes are fewer than points.

use crate::contact::pose::Pose;
use crate::contact::surface::Surface;
use crate::grid::Grid;
use crate::system::numbering::Numbering;

/// Cells from the box around a surface beyond which the distance from the box is taken: it is no more than
/// the gap, and costs less.
const FAR: f64 = 8.0;

/// Of the local nodes.
pub(super) struct NodeGaps<const D: usize> {
    /// m
    places: Vec<[f64; D]>,
    /// The least over the poses, or less, m.
    gaps: Vec<f64>,
}

impl<const D: usize> NodeGaps<D> {
    pub fn new(
        grid: &Grid<D>,
        numbering: &Numbering,
        surface: &dyn Surface<D>,
        poses: impl Iterator<Item = Pose<D>> + Clone,
    ) -> Self {
        let places: Vec<[f64; D]> =
            numbering.nodes.iter().map(|&node| grid.node_position(node)).collect();
        let ((low, high), far) = (surface.bounds(), FAR * grid.cell_size());
        let gap = |x: &[f64; D]| {
            let place = |pose: Pose<D>| {
                let place = pose.to_body(x);
                let beside = |a: usize| (low[a] - place[a]).max(place[a] - high[a]).max(0.0);
                let squared: f64 = (0..D).map(|a| beside(a) * beside(a)).sum();
                if squared > far * far { squared.sqrt() } else { surface.near(&place).gap }
            };
            poses.clone().map(place).fold(f64::INFINITY, f64::min)
        };
        let gaps = places.iter().map(gap).collect();
        NodeGaps { places, gaps }
    }

    /// Whether the gap at `x` is surely larger than `reach` (m), as a local node tells it.
    pub fn beyond(&self, node: u32, x: &[f64; D], reach: f64) -> bool {
        let slack = self.gaps[node as usize] - reach;
        let place = &self.places[node as usize];
        let squared: f64 = (0..D).map(|a| (x[a] - place[a]) * (x[a] - place[a])).sum();
        slack > 0.0 && squared < slack * slack
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ball::Ball;

    /// What a node says holds for the surface itself, and it says so of most places that are far.
    #[test]
    fn a_node_tells_only_what_holds() {
        let ball = Ball { centre: [0.3, -0.2], radius: 0.7 };
        let node = |i: u32| [f64::from(i % 9) - 4.0, f64::from(i / 9) - 4.0];
        let places: Vec<[f64; 2]> = (0..81).map(node).collect();
        let gaps = places.iter().map(|x| ball.near(x).gap).collect();
        let (nodes, mut known, mut far) = (NodeGaps { places, gaps }, 0, 0);
        for k in 0..4000 {
            let of = |step: f64| 8.0 * (step * f64::from(k)).fract() - 4.0;
            let (x, reach) = ([of(0.618_033_988), of(0.754_877_666)], 0.1 + of(0.569).abs() / 8.0);
            let first = ((x[1] + 4.0) as u32) * 9 + (x[0] + 4.0) as u32;
            let truly = ball.near(&x).gap > reach;
            let said = nodes.beyond(first, &x, reach);
            assert!(truly || !said, "{x:?} {reach}");
            known += usize::from(said);
            far += usize::from(truly);
        }
        assert!(known * 2 > far && known < far, "{known} of {far}");
    }
}
