//! What a step overwrites in an array, to go back to where it fails ([`super::Snapshot`]).
//!
//! Nothing is copied ahead: where an array gets new values, the old one is set aside and the new
//! values go into the one set aside a step before. A copy of the whole state was a quarter of the
//! bytes of an explicit step, and the part of it that a second core sped up least.

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
