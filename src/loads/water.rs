//! f_p = -V ∇u: the lift of still pore water of the pressure u = γ (level - height), zero above.
//!
//! In ∫ (σ' - u 1) ∇S dV = weight + ∮ -u n S dA over what the water around the bodies presses, the
//! divergence theorem takes the surface out: ∫ σ' ∇S dV = weight - ∫ S ∇u dV, with the effective
//! stress σ'. The gradient is γ upwards in the wetted share of a point's domain, whose volume is that
//! of the step's start.

use super::{Load, Moment};
use crate::deck::model::Water;
use crate::error::Result;
use crate::material::Material;
use crate::points::Points;

impl<const D: usize> Load<D> for Water {
    fn add_to_points(
        &self,
        points: &Points<D>,
        _materials: &[Material],
        at: Moment,
        forces: &mut [[f64; D]],
    ) -> Result<()> {
        let (axis, weight) = (self.axis, at.ramp * at.share * self.unit_weight);
        for (p, force) in forces.iter_mut().enumerate() {
            let (x, half) = (points.position[p][axis], points.half_length[p][axis]);
            let wet = ((self.level - (x - half)) / (2.0 * half)).clamp(0.0, 1.0);
            force[axis] += weight * wet * points.volume(p);
        }
        Ok(())
    }
}
