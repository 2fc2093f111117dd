//! The model with the parameters that hold at a point.

use super::{Material, Response};
use crate::points::Points;

/// The material at point `p`; one of `materials` belongs to each body.
#[inline(always)]
pub fn local<'a, const D: usize>(
    materials: &'a [Material],
    points: &'a Points<D>,
    p: usize,
) -> LocalMaterial<'a> {
    let body = points.body[p];
    let parameters = points.parameters.of(p, body);
    LocalMaterial { material: &materials[body as usize], parameters }
}

/// The material at a point.
#[derive(Debug, Clone, Copy)]
pub struct LocalMaterial<'a> {
    /// The body's.
    pub material: &'a Material,
    /// The point's own parameters; empty where the body's hold.
    pub parameters: &'a [f64],
}

impl<'a> LocalMaterial<'a> {
    /// A material without parameters that vary.
    pub fn uniform(material: &'a Material) -> Self {
        LocalMaterial { material, parameters: &[] }
    }

    /// Whether both are one body's material without parameters of their own.
    #[inline(always)]
    pub fn shares_parameters(&self, other: &LocalMaterial<'_>) -> bool {
        std::ptr::eq(self.material, other.material)
            && self.parameters.is_empty()
            && other.parameters.is_empty()
    }

    /// See [`Model::respond`](super::model::Model::respond).
    #[inline(always)]
    pub fn respond(&self, trial: [f64; 3], state: &[f64]) -> Response {
        if self.parameters.is_empty() {
            self.material.respond(trial, state)
        } else {
            self.respond_by_own(trial, state)
        }
    }

    #[inline(never)]
    fn respond_by_own(&self, trial: [f64; 3], state: &[f64]) -> Response {
        self.model().respond(trial, state)
    }

    /// See [`Model::energy`](super::model::Model::energy).
    #[inline(always)]
    pub fn energy(&self, elastic_strain: [f64; 3]) -> f64 {
        if self.parameters.is_empty() {
            self.material.energy(elastic_strain)
        } else {
            self.energy_by_own(elastic_strain)
        }
    }

    #[inline(never)]
    fn energy_by_own(&self, elastic_strain: [f64; 3]) -> f64 {
        self.model().energy(elastic_strain)
    }

    /// The model with the parameters that hold at the point.
    pub fn model(&self) -> Material {
        if self.parameters.is_empty() {
            *self.material
        } else {
            self.material.with(self.parameters)
        }
    }
}
