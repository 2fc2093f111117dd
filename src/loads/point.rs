//! f_p = share f(s, t) (Lagrangian eq. 29): a total force held by a few points.
//!
//! Points hold a constant force themselves (`points.point_force`, moved and stored with them). A
//! function of s or t is held here, with the identities of the points that carry it.

use super::{Load, Moment};
use crate::deck::expression::Expression;
use crate::error::Result;
use crate::material::Material;
use crate::points::Points;

/// Identities of the points that carry a load, each with its share of it; a point may come several
/// times. The same on all ranks; empty for loads that no single points carry.
pub type Carriers = Vec<(u64, f64)>;

/// Total force of s and t, N, and who carries it: ascending, each once.
pub struct PointForce {
    force: Vec<Expression>,
    carriers: Carriers,
}

impl PointForce {
    /// `carriers`: empty where the points hold the force themselves.
    pub fn new(force: &[Expression], carriers: &Carriers) -> Self {
        let mut carriers = carriers.clone();
        carriers.sort_by_key(|(id, _)| *id);
        carriers.dedup_by(|(next, more), (id, share)| {
            let again = next == id;
            if again {
                *share += *more;
            }
            again
        });
        PointForce { force: force.to_vec(), carriers }
    }
}

impl<const D: usize> Load<D> for PointForce {
    fn add_to_points(
        &self,
        points: &Points<D>,
        _materials: &[Material],
        at: Moment,
        forces: &mut [[f64; D]],
    ) -> Result<()> {
        if self.carriers.is_empty() {
            return Ok(());
        }
        let total: [f64; D] = at.values(&self.force, &at.scope());
        for (force, id) in forces.iter_mut().zip(&points.id) {
            if let Ok(place) = self.carriers.binary_search_by_key(id, |(id, _)| *id) {
                for (f, total) in force.iter_mut().zip(total) {
                    *f += total * self.carriers[place].1;
                }
            }
        }
        Ok(())
    }
}
