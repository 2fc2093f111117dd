//! V, the centroid and ∫ (|r|^2 1 - r r) dV of what a surface encloses, r from the centroid.

use super::surface::length;

/// A solid of density one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid<const D: usize> {
    /// m3 (m2 in 2D)
    pub volume: f64,
    /// m
    pub centroid: [f64; D],
    /// m5 (m4 in 2D, where only the turn about z counts).
    pub inertia: [[f64; 3]; 3],
}

/// An inertia tensor with one value about `axis` and another across it.
pub fn about_axis<const D: usize>(axis: &[f64; D], about: f64, across: f64) -> [[f64; 3]; 3] {
    let size = length(axis);
    let mut a = [0.0; 3];
    for (a, v) in a.iter_mut().zip(axis) {
        *a = if size > 0.0 { v / size } else { 0.0 };
    }
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let unit = if i == j { across } else { 0.0 };
            unit + (about - across) * a[i] * a[j]
        })
    })
}
