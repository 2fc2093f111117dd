//! The communicator with typed reductions. Every method but `rank` and `size` is collective.

use std::cell::Cell;

use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;

use super::traffic::reducing;
use crate::error::{Error, Result};

/// All ranks of a run.
pub struct World {
    comm: SimpleCommunicator,
    /// Sparse exchanges so far: consecutive ones use different tags.
    exchanges: Cell<i32>,
}

impl World {
    /// The ranks of a communicator.
    pub fn new(comm: SimpleCommunicator) -> Self {
        World { comm, exchanges: Cell::new(0) }
    }

    /// For MPI's own calls.
    pub fn comm(&self) -> &SimpleCommunicator {
        &self.comm
    }

    /// This rank's number.
    pub fn rank(&self) -> usize {
        self.comm.rank() as usize
    }

    /// Number of ranks.
    pub fn size(&self) -> usize {
        self.comm.size() as usize
    }

    /// Whether this is rank 0.
    pub fn is_root(&self) -> bool {
        self.comm.rank() == 0
    }

    /// A tag for the next sparse exchange; the same on all ranks, as exchanges are collective.
    pub(crate) fn next_tag(&self) -> i32 {
        let count = self.exchanges.get();
        self.exchanges.set((count + 1) % 1000);
        100 + count
    }

    fn reduce(&self, value: f64, operation: SystemOperation) -> f64 {
        let mut result = 0.0;
        reducing(|| self.comm.all_reduce_into(&value, &mut result, operation));
        result
    }

    /// Sum over all ranks. Collective.
    pub fn sum(&self, value: f64) -> f64 {
        self.reduce(value, SystemOperation::sum())
    }

    /// NaN on any rank gives NaN.
    pub fn max(&self, value: f64) -> f64 {
        if self.any(value.is_nan()) { f64::NAN } else { self.reduce(value, SystemOperation::max()) }
    }

    /// Least value of all ranks. Collective.
    pub fn min(&self, value: f64) -> f64 {
        if self.any(value.is_nan()) { f64::NAN } else { self.reduce(value, SystemOperation::min()) }
    }

    /// Least value of all ranks. Collective.
    pub fn min_u64(&self, value: u64) -> u64 {
        // MPICH 4.0 compares unsigned numbers as signed ones, so that u64::MAX would be its least.
        const TOP: u64 = 1 << 63;
        let (shifted, mut result) = ((value ^ TOP) as i64, 0i64);
        reducing(|| self.comm.all_reduce_into(&shifted, &mut result, SystemOperation::min()));
        result as u64 ^ TOP
    }

    /// Sum over all ranks. Collective.
    pub fn sum_usize(&self, value: usize) -> usize {
        let mut result = 0u64;
        reducing(|| {
            self.comm.all_reduce_into(&(value as u64), &mut result, SystemOperation::sum())
        });
        result as usize
    }

    /// Element by element; slices of equal length on all ranks.
    pub fn sum_slice(&self, values: &[f64]) -> Vec<f64> {
        let mut result = vec![0.0; values.len()];
        reducing(|| self.comm.all_reduce_into(values, &mut result[..], SystemOperation::sum()));
        result
    }

    /// The largest, element by element; slices of equal length without NaN.
    pub fn max_slice(&self, values: &[f64]) -> Vec<f64> {
        let mut result = vec![0.0; values.len()];
        reducing(|| self.comm.all_reduce_into(values, &mut result[..], SystemOperation::max()));
        result
    }

    /// Sum over the lower ranks; 0 on the first.
    pub fn exclusive_sum(&self, value: usize) -> usize {
        let mut result = 0u64;
        reducing(|| {
            self.comm.exclusive_scan_into(&(value as u64), &mut result, SystemOperation::sum())
        });
        if self.is_root() { 0 } else { result as usize }
    }

    /// The values of all ranks, in their order.
    pub fn gather(&self, value: u64) -> Vec<u64> {
        let mut all = vec![0; self.size()];
        reducing(|| self.comm.all_gather_into(&value, &mut all[..]));
        all
    }

    /// True on all ranks if true on any.
    pub fn any(&self, value: bool) -> bool {
        let mut result = 0i32;
        reducing(|| {
            self.comm.all_reduce_into(&i32::from(value), &mut result, SystemOperation::max())
        });
        result != 0
    }

    /// Returns when all ranks have come here. Collective.
    pub fn barrier(&self) {
        reducing(|| self.comm.barrier());
    }

    /// The bytes of `root`, on all ranks.
    pub fn broadcast_bytes(&self, root: usize, bytes: &mut Vec<u8>) {
        let mut length = bytes.len() as u64;
        let process = self.comm.process_at_rank(root as i32);
        reducing(|| process.broadcast_into(&mut length));
        bytes.resize(length as usize, 0);
        if length == 0 {
            // MPI does not take the pointer of an empty list.
            return;
        }
        reducing(|| process.broadcast_into(&mut bytes[..]));
    }

    /// The message with the lowest number, on all ranks.
    pub fn lowest_message(&self, own: Option<(u64, String)>) -> Option<String> {
        let lowest = self.min_u64(own.as_ref().map_or(u64::MAX, |(number, _)| *number));
        self.first_message(own.filter(|(number, _)| *number == lowest).map(|(_, text)| text))
    }

    /// The message of the lowest rank that has one, on all ranks.
    pub fn first_message(&self, message: Option<String>) -> Option<String> {
        let speaker = self.min_u64(match message {
            Some(_) => self.rank() as u64,
            None => u64::MAX,
        });
        if speaker == u64::MAX {
            return None;
        }
        let mut bytes = message.unwrap_or_default().into_bytes();
        self.broadcast_bytes(speaker as usize, &mut bytes);
        Some(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// Fails on all ranks with the message of the lowest rank that has one.
    pub fn refuse(&self, kind: fn(String) -> Error, message: Option<String>) -> Result<()> {
        self.first_message(message).map_or(Ok(()), |message| Err(kind(message)))
    }

    /// Fails on all ranks with the message of the lowest number: bad input.
    pub fn refuse_lowest(&self, own: Option<(u64, String)>) -> Result<()> {
        self.lowest_message(own).map_or(Ok(()), |message| Err(Error::Input(message)))
    }

    /// Fails on all ranks, with the error of the lowest failing rank, if it failed on any: call
    /// it before the next collective operation so that nobody waits for a rank that is gone.
    pub fn fail_together<T>(&self, outcome: Result<T>) -> Result<T> {
        reducing(|| crate::petsc::agree(&self.comm, outcome))
    }
}
