//! Corners near the rigid surfaces before a step: how deep they lie, and which touch.

use super::corner::DomainCorners;
use super::{Contacts, Near, Pair};
use crate::deck::model::Basis;
use crate::deck::{Presence, When};
use crate::points::Points;

/// A corner at the start of the run.
#[derive(Debug, Clone, Copy)]
pub struct Corner<const D: usize> {
    /// Index into [`Contacts::pairs`].
    pub pair: usize,
    pub point: usize,
    /// m
    pub place: [f64; D],
    pub near: Near<D>,
}

/// Corners no further than `margin` (m) from the surface of a contact of theirs that `counts`, where
/// the rigid bodies are at that moment.
pub fn corners_within<const D: usize>(
    contacts: &Contacts<D>,
    basis: Basis,
    points: &Points<D>,
    margin: f64,
    (when, counts): (When, impl Fn(&Presence) -> bool),
) -> Vec<Corner<D>> {
    let poses = contacts.poses(when);
    let mut found = Vec::new();
    let there = |(_, of): &(usize, &Pair)| counts(&of.presence);
    for (pair, of) in contacts.pairs.iter().enumerate().filter(there) {
        let (surface, pose) = (&*contacts.rigids[of.rigid].surface, &poses[of.rigid]);
        for point in (0..points.len()).filter(|&p| points.body[p] as usize == of.body) {
            let x = &points.position[point];
            let corners = DomainCorners::of(basis, contacts.rings, points, point);
            if pose.near(surface, x).gap > margin + corners.reach(x) {
                continue;
            }
            for place in corners.positions.into_iter().take(corners.count) {
                let near = pose.near(surface, &place);
                if near.gap <= margin {
                    found.push(Corner { pair, point, place, near });
                }
            }
        }
    }
    found
}
