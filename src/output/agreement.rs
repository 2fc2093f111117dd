//! One rank acts, all ranks get its outcome.
//!
//! File work fails on one rank while the others would wait in the next collective call. Every
//! such step therefore ends in one of the first two functions.

use mpi::collective::{CommunicatorCollectives, SystemOperation};
use mpi::topology::{Communicator, SimpleCommunicator};

use crate::error::Result;
pub use crate::petsc::agree as all_agree;

/// Runs `act` on rank 0; every rank returns its outcome.
pub fn on_root(comm: &SimpleCommunicator, act: impl FnOnce() -> Result<()>) -> Result<()> {
    all_agree(comm, if comm.rank() == 0 { act() } else { Ok(()) })
}

/// This rank's first row, and the number of rows of all ranks, where each has `rows`. Collective.
pub fn place(comm: &SimpleCommunicator, rows: usize) -> (usize, usize) {
    let (mut before, mut total) = (0_u64, 0_u64);
    comm.exclusive_scan_into(&(rows as u64), &mut before, SystemOperation::sum());
    // MPI leaves the result of rank 0 undefined.
    if comm.rank() == 0 {
        before = 0;
    }
    comm.all_reduce_into(&(rows as u64), &mut total, SystemOperation::sum());
    (before as usize, total as usize)
}
