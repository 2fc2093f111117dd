//! Sparse exchange: each rank knows whom it writes to, nobody knows whom it hears from. The
//! non-blocking consensus of Hoefler, Siebert and Lumsdaine: synchronous sends, probes, and a
//! barrier entered when the own sends are matched; its cost does not grow with the rank count.

use bytemuck::Pod;
use mpi::request::{Request, StaticScope};
use mpi::traits::*;

use crate::error::{Error, Result};

use super::World;

/// Sends each list to its rank and returns what arrived, in ascending order of the source.
/// Empty lists are not sent; a list for oneself passes by. Collective.
pub fn exchange<T: Pod>(
    world: &World,
    outgoing: Vec<(usize, Vec<T>)>,
) -> Result<Vec<(usize, Vec<T>)>> {
    // Two consecutive exchanges must not mix: ranks may leave the first at different times, and
    // a message of the second can overtake the barrier of the first on a slow rank.
    let tag = world.next_tag();
    let comm = world.comm();
    let mut incoming: Vec<(usize, Vec<T>)> = Vec::new();
    let mut remote: Vec<(usize, Vec<T>)> = Vec::new();
    for (rank, list) in outgoing {
        if list.is_empty() {
            continue;
        }
        if std::mem::size_of_val(&list[..]) > i32::MAX as usize {
            return Err(Error::Environment(format!(
                "one message of {} bytes is more than MPI can count; use more ranks",
                std::mem::size_of_val(&list[..])
            )));
        }
        if rank == world.rank() {
            incoming.push((rank, list));
        } else {
            remote.push((rank, list));
        }
    }
    if world.size() > 1 {
        mpi::request::scope(|scope| {
            let mut sends: Vec<_> = remote
                .iter()
                .map(|(rank, list)| {
                    let bytes: &[u8] = bytemuck::cast_slice(list);
                    comm.process_at_rank(*rank as i32)
                        .immediate_synchronous_send_with_tag(scope, bytes, tag)
                })
                .collect();
            let mut barrier: Option<Request<'static, (), StaticScope>> = None;
            loop {
                while let Some((message, status)) =
                    comm.any_process().immediate_matched_probe_with_tag(tag)
                {
                    let (bytes, _): (Vec<u8>, _) = (message, status).matched_receive_vec();
                    let source = status.source_rank() as usize;
                    let mut list = vec![T::zeroed(); bytes.len() / size_of::<T>()];
                    bytemuck::cast_slice_mut(&mut list).copy_from_slice(&bytes);
                    incoming.push((source, list));
                }
                match barrier.take() {
                    Some(request) => match request.test() {
                        Ok(_) => break,
                        Err(request) => barrier = Some(request),
                    },
                    None => {
                        sends =
                            sends.into_iter().filter_map(|request| request.test().err()).collect();
                        if sends.is_empty() {
                            barrier = Some(comm.immediate_barrier());
                        }
                    }
                }
            }
        });
    }
    incoming.sort_by_key(|(source, _)| *source);
    Ok(incoming)
}
