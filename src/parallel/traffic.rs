//! Bytes and messages that this rank sends, and the time it waits for others: counted where messages
//! are made, so that a scaling study needs no profiler. The linear solvers keep their own counts
//! (`-log_view`).

use std::cell::Cell;
use std::ops::Sub;
use std::time::Instant;

/// Counts since the start of this process.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Traffic {
    /// Point-to-point messages sent.
    pub messages: u64,
    /// Bytes in them.
    pub bytes: u64,
    /// Reductions, scans, barriers and broadcasts.
    pub reductions: u64,
    /// Seconds in communication, nearly all of them spent waiting for others.
    pub waited: f64,
}

impl Sub for Traffic {
    type Output = Traffic;

    fn sub(self, earlier: Traffic) -> Traffic {
        Traffic {
            messages: self.messages - earlier.messages,
            bytes: self.bytes - earlier.bytes,
            reductions: self.reductions - earlier.reductions,
            waited: self.waited - earlier.waited,
        }
    }
}

thread_local! {
    // MPI is used by one thread only.
    static SO_FAR: Cell<Traffic> = const {
        Cell::new(Traffic { messages: 0, bytes: 0, reductions: 0, waited: 0.0 })
    };
}

/// Counts so far.
pub fn so_far() -> Traffic {
    SO_FAR.get()
}

pub(crate) fn count_message(bytes: usize) {
    let mut traffic = SO_FAR.get();
    traffic.messages += 1;
    traffic.bytes += bytes as u64;
    SO_FAR.set(traffic);
}

/// Runs a collective operation that is one reduction or its like.
pub(crate) fn reducing<T>(act: impl FnOnce() -> T) -> T {
    let outcome = time_waiting(act);
    let mut traffic = SO_FAR.get();
    traffic.reductions += 1;
    SO_FAR.set(traffic);
    outcome
}

/// Runs a piece of communication on the clock.
pub(crate) fn time_waiting<T>(act: impl FnOnce() -> T) -> T {
    let begin = Instant::now();
    let outcome = act();
    let mut traffic = SO_FAR.get();
    traffic.waited += begin.elapsed().as_secs_f64();
    SO_FAR.set(traffic);
    outcome
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_add_up_between_two_looks() {
        let before = so_far();
        count_message(24);
        count_message(0);
        assert_eq!(reducing(|| 7), 7);
        let seen = so_far() - before;
        assert_eq!((seen.messages, seen.bytes, seen.reductions), (2, 24, 1));
        assert!(seen.waited >= 0.0);
    }
}
