//! `trait Term`: a contribution to a step's equations f(u) = f_ext.

use crate::system::in_place::InPlace;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockMatrix;
use crate::tensor::Square;

pub use crate::system::border::Part;

/// An iterate.
#[derive(Clone, Copy)]
pub struct At<'a> {
    /// Sparsity of the equations.
    pub pattern: &'a Pattern,
    /// Nodal increments of the local degrees of freedom, m.
    pub displacement: &'a [f64],
}

/// An addition to a matrix: two local nodes and the block that couples them, N/m.
pub type Correction<const D: usize> = (u32, u32, Square<D>);

/// Health of an evaluation on this rank.
#[derive(Debug, Clone, Copy, Default)]
pub struct Health {
    /// Point index with det dF <= 0, if any.
    pub inverted: Option<usize>,
    /// Point index with a stress that is not finite, if any.
    pub not_finite: Option<usize>,
}

impl Health {
    /// Whether all stresses are finite.
    pub fn is_sound(&self) -> bool {
        self.not_finite.is_none()
    }

    /// The first fault of each kind in either.
    pub fn and(self, other: Health) -> Health {
        Health {
            inverted: self.inverted.or(other.inverted),
            not_finite: self.not_finite.or(other.not_finite),
        }
    }
}

/// A contribution to the equations. It adds what it has: as shares at local nodes, which are summed
/// over ranks afterwards, or to owned rows, when the shares of all ranks are there. Terms are asked
/// in their order, once for each part or all rows: no call is made per point.
pub trait Term<const D: usize> {
    /// Whether its tangent equals its transposed.
    fn symmetric(&self) -> bool {
        true
    }

    /// Whether plastic flow that is not associated may make its tangent unsymmetric: multigrid then looks for
    /// the nodes that flow.
    fn flows_unassociated(&self) -> bool {
        false
    }

    /// This rank's shares: `force` of the local degrees of freedom, N, and the tangent, N/m, where
    /// there are `rows`.
    fn add_shares(
        &self,
        _part: Part,
        _at: At<'_>,
        _force: &mut [f64],
        _rows: Option<&mut InPlace<'_, D>>,
    ) -> Health {
        Health::default()
    }

    /// `force` of the owned degrees of freedom, N.
    fn add_force(&self, _at: At<'_>, _force: &mut [f64]) {}

    /// The tangent in the first `owned` rows, N/m.
    fn add_tangent(&self, _pattern: &Pattern, _owned: usize, _rows: &mut InPlace<'_, D>) {}

    /// J of a constant tangent J ⊗ 1 that owned rows may begin with when they are first met, and
    /// which of them it reaches. One term of a step has it: [`Self::add_tangent`] then adds nothing.
    fn first_in_rows(&self) -> Option<(&BlockMatrix<1>, &[bool])> {
        None
    }

    /// Adds the stiffness by which penalties hold local nodes, this rank's share, N/m: multigrid smooths
    /// them together where it exceeds the material's.
    fn add_penalties(&self, _at: At<'_>, _stiffness: &mut [f64]) {}

    /// Appends what makes the symmetric part of an unsymmetric tangent definite, by local nodes, N/m:
    /// multigrid's levels are made of the sum.
    fn correct_surrogate(&self, _at: At<'_>, _corrections: &mut Vec<Correction<D>>) {}

    /// Energy of the increments that the points do not hold, this rank's share, J.
    fn energy(&self, _at: At<'_>) -> f64 {
        0.0
    }

    /// Σ |f|^2 of forces that come from outside though they depend on the iterate, this rank's share,
    /// N^2: they count among the actions that a residual is compared with.
    fn squared_actions(&self, _at: At<'_>) -> f64 {
        0.0
    }

    /// Sizes of what [`Self::add_shares`] sums, at local nodes, N: the floor of round-off.
    fn add_share_sizes(&self, _at: At<'_>, _size: &mut [f64]) {}

    /// Sizes of what [`Self::add_force`] sums, at owned nodes, N; `moved`: |u| of local nodes, m.
    fn add_sizes(&self, _pattern: &Pattern, _moved: &[f64], _size: &mut [f64]) {}
}
