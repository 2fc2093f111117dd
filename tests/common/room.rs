//! How many ranks of tests run at a time.

use std::sync::{Condvar, Mutex};

static BUSY: Mutex<usize> = Mutex::new(0);
static FREED: Condvar = Condvar::new();

/// Ranks that run at a time, over all tests of this executable: four more than twice the cores, as most
/// jobs are so short that their time is the waiting of `mpirun` for its ranks to come and go, and a
/// single core would wait for most of its time.
fn ranks_at_a_time() -> usize {
    2 * std::thread::available_parallelism().map_or(1, usize::from) + 4
}

/// Room for the ranks of one job, given back when dropped.
pub struct Room(usize);

impl Room {
    /// Waits until `ranks` more may run; a job of more ranks than run at a time runs alone.
    pub fn take(ranks: usize) -> Self {
        let all = ranks_at_a_time();
        let wanted = ranks.min(all);
        let mut busy = BUSY.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        while *busy + wanted > all {
            busy = FREED.wait(busy).unwrap_or_else(|poisoned| poisoned.into_inner());
        }
        *busy += wanted;
        Room(wanted)
    }
}

impl Drop for Room {
    fn drop(&mut self) {
        *BUSY.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) -= self.0;
        FREED.notify_all();
    }
}
