//! Numbers of points from 0 on, without gaps. A seeding numbers its candidates, and only those inside the shape
//! become points; here the points are numbered anew. Their order stays, so that a search for the smallest number
//! of several points finds the same point.
//!
//! The range of the numbers is cut into as many parts as there are ranks. Each rank receives the numbers in one
//! part and sends back their new ones. No rank holds them all.

use super::{World, exchange};
use crate::error::Result;
use crate::points::Points;

/// Replaces the points' identities by 0, 1, 2, ... in their order. No two identities may be equal. The new ones
/// do not depend on which rank has which point. Collective.
pub fn close_gaps<const D: usize>(world: &World, points: &mut Points<D>) -> Result<()> {
    let ranks = world.size() as u128;
    let own_end = points.id.iter().map(|id| id + 1).max().unwrap_or(0);
    let end = u64::MAX - world.min_u64(u64::MAX - own_end);
    let part_of = |id: u64| (u128::from(id) * ranks / u128::from(end.max(1))) as usize;
    let mut asked: Vec<Vec<usize>> = vec![Vec::new(); world.size()];
    for (p, &id) in points.id.iter().enumerate() {
        asked[part_of(id)].push(p);
    }
    let ids = |list: &Vec<usize>| list.iter().map(|&p| points.id[p]).collect::<Vec<u64>>();
    let questions = asked.iter().map(&ids).enumerate().collect();
    let heard = exchange(world, questions)?;

    // (number, place among the questions)
    let all = heard.iter().flat_map(|(_, list)| list.iter().copied());
    let mut order: Vec<(u64, usize)> = all.enumerate().map(|(at, id)| (id, at)).collect();
    order.sort_unstable();
    let first = world.exclusive_sum(order.len()) as u64;
    let mut answers = vec![0; order.len()];
    for (number, (_, at)) in (first..).zip(order) {
        answers[at] = number;
    }
    let mut rest = &answers[..];
    let mut replies = Vec::with_capacity(heard.len());
    for (rank, list) in &heard {
        let (own, others) = rest.split_at(list.len());
        replies.push((*rank, own.to_vec()));
        rest = others;
    }
    for (rank, numbers) in exchange(world, replies)? {
        for (&p, number) in asked[rank].iter().zip(numbers) {
            points.id[p] = number;
        }
    }
    points.counted = true;
    Ok(())
}
