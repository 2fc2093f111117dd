//! Shapes of bodies: primitives, unions and differences.

/// A region of space; `x` slices have the problem's dimension.
#[derive(Debug, Clone)]
pub struct Shape {}

impl Shape {
    /// True inside or on the boundary.
    pub fn contains(&self, _x: &[f64]) -> bool {
        todo!()
    }
    /// Smallest axis-aligned box around it; `None` if unbounded (`where` alone).
    pub fn bounds(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        todo!()
    }
}
