//! Sparse exchange: each rank knows to whom it sends, and no rank knows from whom it will receive. It
//! is the non-blocking consensus of Hoefler, Siebert and Lumsdaine: synchronous sends, probes, and a
//! barrier that a rank enters when all of its sends are matched. The cost does not grow with the number
//! of ranks.

use bytemuck::Pod;
use mpi::point_to_point::{Message, Status};
use mpi::request::{Request, StaticScope};
use mpi::traits::*;

use crate::error::{Error, Result};

use super::{World, traffic};

/// Longer lists travel in several messages: MPI counts bytes in 32 bits.
const LARGEST_MESSAGE: usize = 1 << 30;
/// Of single lists; the halo uses 17, the sparse exchanges 100 and above.
const LIST_TAG: i32 = 18;

/// Sends each list to its rank and returns what arrived, in ascending order of the source.
/// Empty lists are not sent; a list for oneself passes by; of several lists for one rank the
/// receiver sees one, joined in order. Collective. Error, on all ranks: a rank that does not
/// exist.
pub fn exchange<T: Pod>(
    world: &World,
    outgoing: Vec<(usize, Vec<T>)>,
) -> Result<Vec<(usize, Vec<T>)>> {
    exchange_in_messages(world, outgoing, LARGEST_MESSAGE)
}

/// [`exchange`] with messages of at most `largest` bytes (at least one value each).
pub fn exchange_in_messages<T: Pod>(
    world: &World,
    outgoing: Vec<(usize, Vec<T>)>,
    largest: usize,
) -> Result<Vec<(usize, Vec<T>)>> {
    let mut incoming: Vec<(usize, Vec<T>)> = Vec::new();
    let mut remote: Vec<(usize, Vec<T>)> = Vec::new();
    let mut wrong = Ok(());
    for (rank, list) in outgoing {
        if rank >= world.size() {
            let size = world.size();
            wrong = Err(Error::Environment(format!("a message to rank {rank} of {size}")));
        } else if rank == world.rank() {
            append(&mut incoming, rank, list);
        } else if !list.is_empty() {
            remote.push((rank, list));
        }
    }
    world.fail_together(wrong)?;
    if world.size() > 1 {
        let per_message = (largest / size_of::<T>()).max(1);
        traffic::time_waiting(|| swap(world, &remote, per_message, &mut incoming));
    }
    incoming.retain(|(_, list)| !list.is_empty());
    incoming.sort_by_key(|(source, _)| *source);
    Ok(incoming)
}

/// Sends lists to ranks that wait for them in [`receive_list`]; empty lists are sent too.
pub fn send_lists<T: Pod>(world: &World, lists: &[(usize, Vec<T>)]) {
    let comm = world.comm();
    let send = || {
        mpi::request::multiple_scope(lists.len(), |scope, requests| {
            for (rank, list) in lists {
                let bytes: &[u8] = bytemuck::cast_slice(list);
                traffic::count_message(bytes.len());
                let process = comm.process_at_rank(*rank as i32);
                requests.add(process.immediate_send_with_tag(scope, bytes, LIST_TAG));
            }
            let mut done = Vec::with_capacity(lists.len());
            requests.wait_all(&mut done);
        })
    };
    if !lists.is_empty() {
        traffic::time_waiting(send);
    }
}

/// Waits for a list of unknown length from one rank.
pub fn receive_list<T: Pod>(world: &World, rank: usize) -> Vec<T> {
    let process = world.comm().process_at_rank(rank as i32);
    traffic::time_waiting(|| {
        let (message, status) = process.matched_probe_with_tag(LIST_TAG);
        receive(message, status)
    })
}

/// Takes a message that was found by a probe, straight to where it stays.
fn receive<T: Pod>(message: Message, status: Status) -> Vec<T> {
    let bytes = status.count(u8::equivalent_datatype()) as usize;
    let mut list = vec![T::zeroed(); bytes / size_of::<T>()];
    message.matched_receive_into(bytemuck::cast_slice_mut::<T, u8>(&mut list));
    list
}

/// Adds to the list of `source`. Messages of one source arrive in the order they were sent.
fn append<T: Pod>(incoming: &mut Vec<(usize, Vec<T>)>, source: usize, values: Vec<T>) {
    match incoming.iter_mut().find(|(rank, _)| *rank == source) {
        Some((_, list)) => list.extend_from_slice(&values),
        None => incoming.push((source, values)),
    }
}

fn swap<T: Pod>(
    world: &World,
    remote: &[(usize, Vec<T>)],
    per_message: usize,
    incoming: &mut Vec<(usize, Vec<T>)>,
) {
    // Two consecutive exchanges must not mix: ranks may leave the first at different times, and
    // a message of the second can overtake the barrier of the first on a slow rank.
    let tag = world.next_tag();
    let comm = world.comm();
    mpi::request::scope(|scope| {
        let mut sends: Vec<_> = remote
            .iter()
            .flat_map(|(rank, list)| list.chunks(per_message).map(|piece| (*rank, piece)))
            .map(|(rank, piece)| {
                let bytes: &[u8] = bytemuck::cast_slice(piece);
                traffic::count_message(bytes.len());
                comm.process_at_rank(rank as i32)
                    .immediate_synchronous_send_with_tag(scope, bytes, tag)
            })
            .collect();
        let mut barrier: Option<Request<'static, (), StaticScope>> = None;
        loop {
            while let Some((message, status)) =
                comm.any_process().immediate_matched_probe_with_tag(tag)
            {
                append(incoming, status.source_rank() as usize, receive(message, status));
            }
            match barrier.take() {
                Some(request) => match request.test() {
                    Ok(_) => break,
                    Err(request) => barrier = Some(request),
                },
                None => {
                    sends = sends.into_iter().filter_map(|request| request.test().err()).collect();
                    if sends.is_empty() {
                        barrier = Some(comm.immediate_barrier());
                    }
                }
            }
        }
    });
}
