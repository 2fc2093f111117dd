//! x = c + d + R (X - c): where a rigid body is, X its places in the deck.

use super::surface::{Near, Surface};
use crate::tensor::Square;
use crate::tensor::dense::{apply, identity, multiply, multiply_transposed, transpose};

/// A rigid motion from the places of the deck.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose<const D: usize> {
    /// c, m: what the body turns about, at the start.
    pub centre: [f64; D],
    /// d, m
    pub shift: [f64; D],
    /// R
    pub turn: Square<D>,
}

impl<const D: usize> Pose<D> {
    /// As in the deck.
    pub fn at_start(centre: [f64; D]) -> Self {
        Pose { centre, shift: [0.0; D], turn: identity() }
    }

    /// x of X, m.
    pub fn to_space(self, place: &[f64; D]) -> [f64; D] {
        let arm = std::array::from_fn(|i| place[i] - self.centre[i]);
        let turned = apply(&self.turn, &arm);
        std::array::from_fn(|i| self.centre[i] + self.shift[i] + turned[i])
    }

    /// X of x, m.
    pub fn to_body(self, x: &[f64; D]) -> [f64; D] {
        let arm = std::array::from_fn(|i| x[i] - self.centre[i] - self.shift[i]);
        let turned = self.vector_to_body(&arm);
        std::array::from_fn(|i| self.centre[i] + turned[i])
    }

    /// R v
    pub fn vector_to_space(&self, v: &[f64; D]) -> [f64; D] {
        apply(&self.turn, v)
    }

    /// R^T v
    pub fn vector_to_body(&self, v: &[f64; D]) -> [f64; D] {
        apply(&transpose(&self.turn), v)
    }

    /// What the surface says of the place x.
    pub fn near(&self, surface: &dyn Surface<D>, x: &[f64; D]) -> Near<D> {
        let near = surface.near(&self.to_body(x));
        let curvature = multiply_transposed(&multiply(&self.turn, &near.curvature), &self.turn);
        Near { gap: near.gap, normal: self.vector_to_space(&near.normal), curvature }
    }
}

/// R of a rotation by `degrees` about `axis` (of any length; in 2D about z): Rodrigues' formula.
pub fn rotation<const D: usize>(axis: &[f64; 3], degrees: f64) -> Square<D> {
    let size = super::surface::length(axis);
    let k = axis.map(|a| a / size);
    let (sin, cos) = degrees.to_radians().sin_cos();
    let cross = [[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let unit = if i == j { 1.0 } else { 0.0 };
            cos * unit + sin * cross[i][j] + (1.0 - cos) * k[i] * k[j]
        })
    })
}
