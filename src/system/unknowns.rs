//! What the unknowns of a node are: components of a displacement, or other fields.

use crate::deck::schema::AXES;

/// `N` unknowns per node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unknowns<const N: usize> {
    /// For messages.
    pub names: [&'static str; N],
    /// They are the components of a displacement in a space of `N` dimensions: rigid motions are smooth, and
    /// boundaries may rotate nodes. Other fields are smooth where each of them is constant.
    pub displacements: bool,
}

impl<const N: usize> Unknowns<N> {
    /// Components along x, y, z.
    pub fn displacements() -> Self {
        Unknowns { names: std::array::from_fn(|i| AXES[i]), displacements: true }
    }

    /// Fields of these names.
    pub fn fields(names: [&'static str; N]) -> Self {
        Unknowns { names, displacements: false }
    }
}
