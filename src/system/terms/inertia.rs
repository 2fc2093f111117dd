//! Inertia that moves with the increments u: share f(u) + M~ u / (β dt²), f of the terms before it
//! (Newmark and HHT over Ghost §3.3). It is the last term of a step.

use crate::system::in_place::InPlace;
use crate::system::pattern::Pattern;
use crate::system::scatter::{BlockMatrix, BlockRows, add_scalar_row};

use super::scalar::{add_row_product, add_sizes};
use super::term::{At, Term};

#[derive(Debug)]
pub struct Inertia {
    /// 1 + alpha of the HHT method, 1 for Newmark's.
    pub share: f64,
    /// M~ / (beta dt^2) in its owners' rows, kg/s2.
    pub matrix: BlockMatrix<1>,
}

impl<const D: usize> Term<D> for Inertia {
    fn add_force(&self, at: At<'_>, force: &mut [f64]) {
        force.iter_mut().for_each(|value| *value *= self.share);
        for row in 0..force.len() / D {
            add_row_product::<D>(&self.matrix, at.pattern, at.displacement, row, force);
        }
    }

    fn add_tangent(&self, pattern: &Pattern, owned: usize, rows: &mut InPlace<'_, D>) {
        for row in 0..owned {
            let blocks = pattern.offsets[row + 1] - pattern.offsets[row];
            let values = rows.values(rows.start(pattern, row), D * D * blocks);
            values.iter_mut().for_each(|value| *value *= self.share);
            add_scalar_row(&self.matrix, pattern, row, rows);
        }
    }

    fn add_sizes(&self, pattern: &Pattern, moved: &[f64], size: &mut [f64]) {
        size.iter_mut().for_each(|value| *value *= self.share);
        add_sizes(&self.matrix, pattern, moved, size);
    }
}
