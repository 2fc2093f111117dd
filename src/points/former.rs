//! The values of an array that a step overwrites. A step that fails gets them back
//! ([`super::Snapshot`]).
//!
//! Nothing is copied ahead. Where an array gets new values, the old array is set aside, and the new
//! values go into the array that was set aside a step before. To copy the whole state would take a
//! quarter of the bytes that an explicit step moves, and two cores hardly copy faster than one.

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
    /// A new step begins: what is set aside is no longer wanted.
    pub(super) fn forget(&mut self) {
        self.wanted = false;
    }

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

    pub(super) fn give_back(&mut self, now: &mut Vec<T>) {
        if std::mem::take(&mut self.wanted) {
            std::mem::swap(&mut self.values, now);
        }
    }
}
