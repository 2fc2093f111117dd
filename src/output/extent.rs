//! Numbers of the summary that need all ranks: where each body is, and the memory used.

use mpi::collective::{CommunicatorCollectives, SystemOperation};
use mpi::topology::SimpleCommunicator;

use super::summary::{BodySummary, PeakMemory};
use crate::basis::Domain;
use crate::deck::model::{Basis, Symmetry};
use crate::points::Points;

/// Position, extent, mass and volume of bodies 0..`bodies`. The extent is x_p -/+ l_p, with
/// l_p = V_p^(1/D)/2 of the current volume (of a ring: A^(1/2)/2 of its section) for `mpm`, which carries no domain. A body that no
/// rank has a point of has empty vectors.
pub fn body_summaries<const D: usize>(
    points: &Points<D>,
    bodies: usize,
    (basis, symmetry): (Basis, Symmetry),
    comm: &SimpleCommunicator,
) -> Vec<BodySummary> {
    // Per body: minus the lower bounds and the upper bounds, so that one maximum serves all.
    let mut bounds = vec![f64::NEG_INFINITY; bodies * 4 * D];
    let mut sums = vec![0.0; bodies * 2];
    for p in 0..points.len() {
        let body = points.body[p] as usize;
        let volume = points.volume(p);
        let side = match symmetry {
            Symmetry::PlaneStrain => volume.powf(1.0 / D as f64) / 2.0,
            Symmetry::Axisymmetric => points.section(p).sqrt() / 2.0,
        };
        let bound = &mut bounds[body * 4 * D..][..4 * D];
        for axis in 0..D {
            let x = points.position[p][axis];
            let half =
                if basis.domain() == Domain::None { side } else { points.half_length[p][axis] };
            let here = [-x, x, half - x, half + x];
            for (slot, value) in here.into_iter().enumerate() {
                bound[slot * D + axis] = bound[slot * D + axis].max(value);
            }
        }
        sums[body * 2] += points.mass[p];
        sums[body * 2 + 1] += volume;
    }
    let mut all_bounds = bounds.clone();
    let mut all_sums = sums.clone();
    comm.all_reduce_into(&bounds[..], &mut all_bounds[..], SystemOperation::max());
    comm.all_reduce_into(&sums[..], &mut all_sums[..], SystemOperation::sum());

    (0..bodies)
        .map(|body| {
            let bound = &all_bounds[body * 4 * D..][..4 * D];
            let vector = |slot: usize, sign: f64| {
                let part = &bound[slot * D..][..D];
                let known = part.iter().all(|value| value.is_finite());
                if known { part.iter().map(|value| sign * value).collect() } else { Vec::new() }
            };
            BodySummary {
                min: vector(0, -1.0),
                max: vector(1, 1.0),
                extent_min: vector(2, -1.0),
                extent_max: vector(3, 1.0),
                mass: all_sums[body * 2],
                volume: all_sums[body * 2 + 1],
            }
        })
        .collect()
}

/// Peak resident memory over the ranks; zero where the system does not say.
pub fn peak_memory(comm: &SimpleCommunicator) -> PeakMemory {
    let mine = std::fs::read_to_string("/proc/self/status")
        .ok()
        .and_then(|status| peak_of_status(&status))
        .unwrap_or(0);
    let mut peak = PeakMemory::default();
    comm.all_reduce_into(&mine, &mut peak.max, SystemOperation::max());
    comm.all_reduce_into(&mine, &mut peak.sum, SystemOperation::sum());
    peak
}

/// Bytes of the line `VmHWM:   1234 kB`.
fn peak_of_status(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kilobytes| kilobytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_peak() {
        assert_eq!(peak_of_status("Name:\tx\nVmHWM:\t    2048 kB\nVmRSS: 1 kB\n"), Some(2 << 20));
        assert_eq!(peak_of_status("Name:\tx\n"), None);
    }
}
