//! -p(x, s, t) J F^-T A: a pressure on a body's own surface, whose area and normal follow the
//! deformation. It acts at the surface's elements ([`crate::surface`]), unlike the virtual stress of
//! [`super::pressure`].

use super::pressure::Pressure;
use super::{Load, OnSurface};
use crate::surface::Surface;

/// A pressure and the surface that it acts on.
pub struct SurfacePressure<const D: usize> {
    /// Where it acts.
    pub surface: Surface<D>,
    /// p, Pa.
    pub pressure: Pressure,
}

impl<const D: usize> Load<D> for SurfacePressure<D> {
    fn on_surface(&self) -> Option<OnSurface<'_, D>> {
        Some(OnSurface::Pressure { surface: &self.surface, pressure: &self.pressure })
    }

    /// A pressure on a part of a surface, or one that is not uniform, has no potential.
    fn symmetric(&self) -> bool {
        false
    }
}
