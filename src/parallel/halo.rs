//! Fixed exchange of nodal values between owners and the ranks that hold copies (ghosts).
//!
//! The `..._while` forms do other work between sending and receiving. Messages have buffers of
//! their own and end before these functions return, whatever comes of the work.

use mpi::traits::*;

use crate::error::{Error, Result};

use super::{World, exchange, traffic};

/// Who sends which values to whom. Local arrays hold the owned values first, then the ghosts in
/// the order they were asked for (grouped by owner).
#[derive(Debug, Clone, Default)]
pub struct HaloPlan {
    owned: usize,
    /// (rank, local indices of owned values that it copies), ascending ranks.
    copies: Vec<(usize, Vec<u32>)>,
    /// (rank, range of ghosts it owns), ascending ranks.
    ghosts: Vec<(usize, std::ops::Range<usize>)>,
}

impl HaloPlan {
    /// Plans for `ghosts`, pairs (owner, key) in ascending order; `local_of` finds an owned key.
    /// Collective.
    pub fn build(
        world: &World,
        owned: usize,
        ghosts: &[(usize, usize)],
        local_of: impl Fn(usize) -> Option<usize>,
    ) -> Result<Self> {
        let mut plan = HaloPlan { owned, ..HaloPlan::default() };
        let mut requests: Vec<(usize, Vec<u64>)> = Vec::new();
        for (g, &(owner, key)) in ghosts.iter().enumerate() {
            if requests.last().is_none_or(|(rank, _)| *rank != owner) {
                requests.push((owner, Vec::new()));
                plan.ghosts.push((owner, owned + g..owned + g));
            }
            requests.last_mut().expect("pushed above").1.push(key as u64);
            plan.ghosts.last_mut().expect("pushed above").1.end = owned + g + 1;
        }
        let mut missing = None;
        for (rank, keys) in exchange(world, requests)? {
            let mut locals = Vec::with_capacity(keys.len());
            for key in keys {
                match local_of(key as usize) {
                    Some(local) => locals.push(local as u32),
                    None => missing = Some(key),
                }
            }
            plan.copies.push((rank, locals));
        }
        world.fail_together(match missing {
            None => Ok(plan),
            Some(key) => Err(Error::Run(format!(
                "rank {} was asked for the value of node {key}, which it does not hold",
                world.rank()
            ))),
        })
    }

    /// Overwrites the ghosts with their owners' values; `block` values per entry. Collective
    /// over neighbours.
    pub fn forward(&self, world: &World, values: &mut [f64], block: usize) -> Result<()> {
        self.forward_among(world, values, block, |_| true, |_| true)
    }

    /// [`Self::forward`] where only the owners `from` and the holders of copies `to` take part;
    /// those on the other side must say the same.
    pub fn forward_among(
        &self,
        world: &World,
        values: &mut [f64],
        block: usize,
        from: impl Fn(usize) -> bool,
        to: impl Fn(usize) -> bool,
    ) -> Result<()> {
        let (owned, ghosts) = values.split_at_mut(self.owned * block);
        let packed: Vec<(usize, Vec<f64>)> = self
            .copies
            .iter()
            .filter(|(rank, _)| to(*rank))
            .map(|(rank, locals)| (*rank, gather(owned, locals, block)))
            .collect();
        let mut slots = Vec::with_capacity(self.ghosts.len());
        let mut rest = ghosts;
        for (rank, range) in &self.ghosts {
            let (slot, tail) = rest.split_at_mut(range.len() * block);
            if from(*rank) {
                slots.push((*rank, slot));
            }
            rest = tail;
        }
        exchange_known(world, &packed, slots, || ());
        Ok(())
    }

    /// Adds the ghosts' values to their owners, neighbour by neighbour in ascending order of
    /// rank, so that sums repeat bit by bit. The ghosts keep their values.
    pub fn reverse_add(&self, world: &World, values: &mut [f64], block: usize) -> Result<()> {
        self.reverse_add_among(world, values, block, |_| true, |_| true)
    }

    /// [`Self::reverse_add`] where only the holders of copies `from` and the owners `to` take
    /// part; those on the other side must say the same.
    pub fn reverse_add_among(
        &self,
        world: &World,
        values: &mut [f64],
        block: usize,
        from: impl Fn(usize) -> bool,
        to: impl Fn(usize) -> bool,
    ) -> Result<()> {
        let packed: Vec<(usize, Vec<f64>)> = self
            .ghosts
            .iter()
            .filter(|(rank, _)| to(*rank))
            .map(|(rank, range)| (*rank, values[range.start * block..range.end * block].to_vec()))
            .collect();
        let mut received: Vec<(usize, &[u32], Vec<f64>)> = self
            .copies
            .iter()
            .filter(|(rank, _)| from(*rank))
            .map(|(rank, locals)| (*rank, &locals[..], vec![0.0; locals.len() * block]))
            .collect();
        let slots = received.iter_mut().map(|(rank, _, buffer)| (*rank, &mut buffer[..])).collect();
        exchange_known(world, &packed, slots, || ());
        for (_, locals, buffer) in &received {
            add(values, locals, buffer, block);
        }
        Ok(())
    }

    /// [`Self::forward`] of several arrays in one message, while `work` reads their owned values.
    /// Collective over neighbours.
    pub fn forward_while<R, const N: usize>(
        &self,
        world: &World,
        mut fields: [&mut [f64]; N],
        block: usize,
        work: impl FnOnce([&[f64]; N]) -> R,
    ) -> R {
        let packed: Vec<(usize, Vec<f64>)> = self
            .copies
            .iter()
            .map(|(rank, locals)| {
                (*rank, fields.iter().flat_map(|field| gather(field, locals, block)).collect())
            })
            .collect();
        let mut received: Vec<Vec<f64>> =
            self.ghosts.iter().map(|(_, range)| vec![0.0; range.len() * block * N]).collect();
        let slots =
            self.ghosts.iter().zip(&mut received).map(|((rank, _), slot)| (*rank, &mut slot[..]));
        let done = exchange_known(world, &packed, slots.collect(), || {
            work(fields.each_ref().map(|f| &**f))
        });
        for ((_, range), buffer) in self.ghosts.iter().zip(&received) {
            for (field, part) in fields.iter_mut().zip(buffer.chunks_exact(range.len() * block)) {
                field[range.start * block..range.end * block].copy_from_slice(part);
            }
        }
        done
    }

    /// [`Self::reverse_add`] of several arrays in one message, while `work` changes their values
    /// at owned nodes; those at ghosts are on their way already. Collective over neighbours.
    pub fn reverse_add_while<R, const N: usize>(
        &self,
        world: &World,
        mut fields: [&mut [f64]; N],
        block: usize,
        work: impl FnOnce([&mut [f64]; N]) -> R,
    ) -> R {
        let packed: Vec<(usize, Vec<f64>)> = self
            .ghosts
            .iter()
            .map(|(rank, range)| {
                let range = range.start * block..range.end * block;
                (
                    *rank,
                    fields.iter().flat_map(|field| field[range.clone()].iter().copied()).collect(),
                )
            })
            .collect();
        let mut received: Vec<Vec<f64>> =
            self.copies.iter().map(|(_, locals)| vec![0.0; locals.len() * block * N]).collect();
        let slots =
            self.copies.iter().zip(&mut received).map(|((rank, _), slot)| (*rank, &mut slot[..]));
        let done = exchange_known(world, &packed, slots.collect(), || {
            work(fields.each_mut().map(|f| &mut **f))
        });
        for ((_, locals), buffer) in self.copies.iter().zip(&received) {
            for (field, part) in fields.iter_mut().zip(buffer.chunks_exact(locals.len() * block)) {
                add(field, locals, part, block);
            }
        }
        done
    }

    /// Ranks that hold copies, with the local indices of the owned values they copy; ascending.
    pub fn copies(&self) -> impl Iterator<Item = (usize, &[u32])> {
        self.copies.iter().map(|(rank, locals)| (*rank, &locals[..]))
    }

    /// Ranks that own ghosts, with the local indices of these; ascending.
    pub fn ghosts(&self) -> impl Iterator<Item = (usize, std::ops::Range<usize>)> {
        self.ghosts.iter().cloned()
    }

    /// Neighbour ranks this one sends owned values to.
    pub fn neighbours(&self) -> usize {
        self.copies.len()
    }
}

fn gather(values: &[f64], locals: &[u32], block: usize) -> Vec<f64> {
    let mut packed = Vec::with_capacity(locals.len() * block);
    for &local in locals {
        let start = local as usize * block;
        packed.extend_from_slice(&values[start..start + block]);
    }
    packed
}

/// Adds blocks to the local values they belong to.
fn add(values: &mut [f64], locals: &[u32], blocks: &[f64], block: usize) {
    for (&local, block_values) in locals.iter().zip(blocks.chunks_exact(block)) {
        let start = local as usize * block;
        for (value, add) in values[start..start + block].iter_mut().zip(block_values) {
            *value += add;
        }
    }
}

/// Known messages both ways, every send with its receive, and `work` while they travel.
pub fn exchange_known<R>(
    world: &World,
    sends: &[(usize, Vec<f64>)],
    receives: Vec<(usize, &mut [f64])>,
    work: impl FnOnce() -> R,
) -> R {
    const TAG: i32 = 17;
    let comm = world.comm();
    let count = sends.len() + receives.len();
    if count == 0 {
        return work();
    }
    sends.iter().for_each(|(_, values)| traffic::count_message(size_of_val(&values[..])));
    mpi::request::multiple_scope(count, |scope, requests| {
        traffic::time_waiting(|| {
            for (rank, buffer) in receives {
                let process = comm.process_at_rank(rank as i32);
                requests.add(process.immediate_receive_into_with_tag(scope, buffer, TAG));
            }
            for (rank, values) in sends {
                let process = comm.process_at_rank(*rank as i32);
                requests.add(process.immediate_send_with_tag(scope, &values[..], TAG));
            }
        });
        let done = work();
        traffic::time_waiting(|| requests.wait_all(&mut Vec::with_capacity(count)));
        done
    })
}
