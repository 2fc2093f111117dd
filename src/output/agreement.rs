//! One rank acts, all ranks get its outcome.
//!
//! File work fails on one rank while the others would wait in the next collective call. Every
//! such step therefore ends in one of the first two functions.

use mpi::collective::{CommunicatorCollectives, SystemOperation};
use mpi::topology::{Communicator, SimpleCommunicator};
use mpi::traits::Root;

use crate::error::{Error, Result};

/// Runs `act` on rank 0; every rank returns its outcome.
pub fn on_root(comm: &SimpleCommunicator, act: impl FnOnce() -> Result<()>) -> Result<()> {
    let outcome = if comm.rank() == 0 { act() } else { Ok(()) };
    share(comm, 0, outcome)
}

/// Fails on every rank, with the error of the lowest failing rank, if any rank failed.
pub fn all_agree(comm: &SimpleCommunicator, outcome: Result<()>) -> Result<()> {
    let mine = if outcome.is_err() { comm.rank() } else { i32::MAX };
    let mut lowest = i32::MAX;
    comm.all_reduce_into(&mine, &mut lowest, SystemOperation::min());
    if lowest == i32::MAX { Ok(()) } else { share(comm, lowest, outcome) }
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

fn share(comm: &SimpleCommunicator, from: i32, outcome: Result<()>) -> Result<()> {
    let root = comm.process_at_rank(from);
    let (kind, text) = match &outcome {
        Ok(()) => (0, ""),
        Err(error) => (error.exit_code(), text_of(error)),
    };
    let mut head = [kind as u64, text.len() as u64];
    root.broadcast_into(&mut head[..]);
    if head[0] == 0 {
        return Ok(());
    }
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(head[1] as usize, 0);
    root.broadcast_into(&mut bytes[..]);
    let text = String::from_utf8_lossy(&bytes).into_owned();
    Err(match head[0] {
        1 => Error::Run(text),
        2 => Error::Input(text),
        3 => Error::File(text),
        _ => Error::Environment(text),
    })
}

fn text_of(error: &Error) -> &str {
    match error {
        Error::Run(text) | Error::Input(text) | Error::File(text) | Error::Environment(text) => {
            text
        }
    }
}
