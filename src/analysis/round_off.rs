//! The round-off of a step's equations, degree of freedom by degree of freedom.
//!
//! A residual is the difference of forces that were added up from many terms. Rounding leaves in it
//! a few times machine epsilon of the *sizes* of the terms, however small their sum: below that no
//! iterate is better than another. Each term of the equations knows its sizes
//! (`Term::add_share_sizes`, `Term::add_sizes`); all have the unit of a force, and no scale is given
//! from outside.

/// Roundings that an entry of the residual may have met, in units of the size of its terms: the
/// chain from displacements to stress has about ten, the sum over points and the share of the
/// linear solver as many again.
const ROUNDINGS: f64 = 32.0;

/// Whether a residual is nothing but the round-off of terms of this size.
#[inline]
pub fn explains(size: f64, residual: f64) -> bool {
    residual.abs() <= ROUNDINGS * f64::EPSILON * size
}
