//! f_p = t(X, s, t) A_p: a dead traction per initial area on a side of a body (formulations.md
//! B.6 (b)), carried by the body's outermost layer of points there.
//!
//! The areas A_p = A V_p / Σ V are shares of the side's area A by the initial volumes of the layer's
//! points, so that a uniform traction sums to t A exactly. The force acts at the points, half a
//! domain below the surface: its moment is off by as much, and the stress in the outermost cells is
//! that of a body force there.

use super::{Load, Moment, scope_of};
use crate::deck::expression::Expression;
use crate::deck::model::BodySide;
use crate::error::Result;
use crate::material::Material;
use crate::points::Points;

/// A point belongs to the layer if its domain ends at the side, to this share of its half length.
const SLACK: f64 = 1e-6;

/// A traction and the side that it acts on.
pub struct Traction {
    side: BodySide,
    /// Pa, one expression of X, Y, Z, s, t per axis.
    value: Vec<Expression>,
    /// A / Σ V, 1/m.
    area_per_volume: f64,
}

/// Whether point `p` is in the outermost layer at a side of its body. It depends on the start alone.
pub fn carries<const D: usize>(side: &BodySide, points: &Points<D>, p: usize) -> bool {
    let (x, half) = (points.position_initial[p][side.axis], points.half_length_initial[p]);
    let beyond = if side.upper { x - side.at } else { side.at - x };
    points.body[p] as usize == side.body && beyond + (1.0 + SLACK) * half[side.axis] >= 0.0
}

impl Traction {
    /// `volume`: initial volume of the points that carry it, over all ranks, m3.
    pub fn new(side: &BodySide, value: &[Expression], volume: f64) -> Self {
        let area_per_volume = side.area / volume;
        Traction { side: side.clone(), value: value.to_vec(), area_per_volume }
    }
}

impl<const D: usize> Load<D> for Traction {
    fn add_to_points(
        &self,
        points: &Points<D>,
        _materials: &[Material],
        at: Moment,
        forces: &mut [[f64; D]],
    ) -> Result<()> {
        for (p, force) in forces.iter_mut().enumerate() {
            if !carries(&self.side, points, p) {
                continue;
            }
            let scope = scope_of(points, p, at.load_factor, at.time);
            let traction: [f64; D] = at.values(&self.value, &scope);
            for (f, t) in force.iter_mut().zip(traction) {
                *f += t * self.area_per_volume * points.volume_initial[p];
            }
        }
        Ok(())
    }
}
