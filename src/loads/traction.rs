//! t(X, s, t) A: a dead traction per initial area on a body's surface (formulations.md B.6 (b)). It
//! acts at the surface's elements ([`crate::surface`]): `system/terms/surface.rs` hands it to the nodes.

use super::{Load, Moment, OnSurface};
use crate::deck::expression::Expression;
use crate::error::Result;
use crate::material::Material;
use crate::points::Points;
use crate::surface::Surface;

/// A traction and the surface that it acts on.
pub struct Traction<const D: usize> {
    /// Where it acts.
    pub surface: Surface<D>,
    /// Pa, one expression of X, Y, Z, s, t per axis.
    pub value: Vec<Expression>,
}

impl<const D: usize> Load<D> for Traction<D> {
    /// It acts on nodes, not on points.
    fn add_to_points(
        &self,
        _points: &Points<D>,
        _materials: &[Material],
        _at: Moment,
        _forces: &mut [[f64; D]],
    ) -> Result<()> {
        Ok(())
    }

    fn on_surface(&self) -> Option<OnSurface<'_, D>> {
        Some(OnSurface::Traction { surface: &self.surface, value: &self.value })
    }
}
