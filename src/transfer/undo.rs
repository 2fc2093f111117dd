//! What a step overwrites, to go back to where it fails.
//!
//! Nothing is copied ahead: where an array gets new values, the old one is set aside and the new
//! values go into the one set aside a step before. A copy of the whole state was a quarter of the
//! bytes of an explicit step, and the part of it that a second core sped up least.

use nalgebra::Matrix3;

use crate::points::Points;

/// The arrays of [`Points`] that this step has overwritten so far.
#[derive(Default)]
pub struct Snapshot<const D: usize> {
    pub position: Former<[f64; D]>,
    pub velocity: Former<[f64; D]>,
    pub acceleration: Former<[f64; D]>,
    pub deformation_gradient: Former<Matrix3<f64>>,
    pub elastic_excess: Former<Matrix3<f64>>,
    pub kirchhoff_stress: Former<Matrix3<f64>>,
    pub plastic_strain: Former<f64>,
    pub dissipation: Former<f64>,
    pub half_length: Former<[f64; D]>,
    pub corners: Former<[[f64; D]; 8]>,
    /// State variables, row by row.
    pub state: Former<f64>,
}

impl<const D: usize> Snapshot<D> {
    /// A new step begins: what the arrays hold is no longer wanted.
    pub fn begin(&mut self) {
        self.position.wanted = false;
        self.velocity.wanted = false;
        self.acceleration.wanted = false;
        self.deformation_gradient.wanted = false;
        self.elastic_excess.wanted = false;
        self.kirchhoff_stress.wanted = false;
        self.plastic_strain.wanted = false;
        self.dissipation.wanted = false;
        self.half_length.wanted = false;
        self.corners.wanted = false;
        self.state.wanted = false;
    }

    /// The points as they were when the step began; they have not been reordered since.
    pub fn restore(&mut self, points: &mut Points<D>) {
        self.position.give_back(&mut points.position);
        self.velocity.give_back(&mut points.velocity);
        self.acceleration.give_back(&mut points.acceleration);
        self.deformation_gradient.give_back(&mut points.deformation_gradient);
        self.elastic_excess.give_back(&mut points.elastic_excess);
        self.kirchhoff_stress.give_back(&mut points.kirchhoff_stress);
        self.plastic_strain.give_back(&mut points.plastic_strain);
        self.dissipation.give_back(&mut points.dissipation);
        self.half_length.give_back(&mut points.half_length);
        self.corners.give_back(&mut points.corners);
        self.state.give_back(&mut points.state.values);
    }
}

/// The values of one array before the step overwrote it.
pub struct Former<T> {
    values: Vec<T>,
    /// `values` are those of this step's start.
    wanted: bool,
}

impl<T> Default for Former<T> {
    fn default() -> Self {
        Former { values: Vec::new(), wanted: false }
    }
}

impl<T: Copy> Former<T> {
    /// Sets `now` aside. An array of the same length takes its place, with values of no meaning.
    pub fn set_aside(&mut self, now: &mut Vec<T>) {
        assert!(!self.wanted, "an array is overwritten once a step");
        if self.values.capacity() < now.capacity() {
            self.values = Vec::with_capacity(now.capacity());
        }
        if let Some(&any) = now.first() {
            self.values.resize(now.len(), any);
        } else {
            self.values.clear();
        }
        std::mem::swap(&mut self.values, now);
        self.wanted = true;
    }

    /// Sets `now` aside and puts `next` in its place.
    pub fn replace(&mut self, now: &mut Vec<T>, next: Vec<T>) {
        assert!(!self.wanted, "an array is overwritten once a step");
        self.values = std::mem::replace(now, next);
        self.wanted = true;
    }

    /// Copies `now`, for updates that overwrite it in parts.
    pub fn copy(&mut self, now: &[T]) {
        assert!(!self.wanted, "an array is overwritten once a step");
        self.values.clear();
        self.values.extend_from_slice(now);
        self.wanted = true;
    }

    /// The values before the step.
    pub fn values(&self) -> &[T] {
        debug_assert!(self.wanted, "these values are of another step");
        &self.values
    }

    fn give_back(&mut self, now: &mut Vec<T>) {
        if std::mem::take(&mut self.wanted) {
            std::mem::swap(&mut self.values, now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::model::Basis;

    #[test]
    fn what_a_step_overwrote_comes_back() {
        let mut points = Points::<2>::of_basis(Basis::Gimp);
        for k in 0..3 {
            points.push_unstrained(k, 0, [k as f64, 0.5], 1.0, 2.0, [0.5; 2]);
        }
        let mut before = Snapshot::default();
        // The second step has more points, the third fewer.
        for count in [3, 4, 2] {
            points.truncate(count);
            while points.len() < count {
                points.push_unstrained(7, 0, [9.0, 0.5], 1.0, 2.0, [0.5; 2]);
            }
            before.begin();
            let (position, velocity) = (points.position.clone(), points.velocity.clone());
            before.position.set_aside(&mut points.position);
            for (new, old) in points.position.iter_mut().zip(before.position.values()) {
                *new = old.map(|x| x + 1.0);
            }
            assert_eq!(points.position[1], position[1].map(|x| x + 1.0));
            before.velocity.replace(&mut points.velocity, vec![[4.0; 2]; count]);
            before.restore(&mut points);
            assert_eq!((&points.position, &points.velocity), (&position, &velocity));
            // A step that fails before it overwrites anything leaves the points alone.
            before.begin();
            before.restore(&mut points);
            assert_eq!((&points.position, &points.velocity), (&position, &velocity));
        }
    }
}
