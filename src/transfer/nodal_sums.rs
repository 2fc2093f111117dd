//! Σ_p over the points of all ranks at the nodes, and nodal values back at the points: what
//! travels between ranks does so while the points that have nothing to do with it are worked on.

use std::ops::Range;

use crate::parallel::World;

use crate::system::step_system::Discretisation;

/// Sums at the owned nodes. `add` adds the shares of some points to arrays of local nodes. Points
/// that touch nodes of other ranks come first, so that the order is the same on a repeat.
/// Collective over neighbours.
pub fn over_points<const D: usize, const B: usize, const N: usize>(
    world: &World,
    mesh: &Discretisation<D>,
    add: impl Fn(Range<usize>, [&mut [[f64; B]]; N]),
) -> [Vec<[f64; B]>; N] {
    let (border, numbering) = (&mesh.border, &mesh.numbering);
    let mut sums: [Vec<[f64; B]>; N] = std::array::from_fn(|_| vec![[0.0; B]; numbering.len()]);
    for part in &border.reaching {
        add(part.clone(), sums.each_mut().map(|sum| &mut sum[..]));
    }
    let fields = sums.each_mut().map(|sum| sum.as_flattened_mut());
    numbering.halo.reverse_add_while(world, fields, B, |mut fields| {
        for part in &border.inner {
            add(part.clone(), fields.each_mut().map(|field| field.as_chunks_mut().0));
        }
    });
    sums
}

/// Brings `fields`, `D` values per node, from the owned nodes to the ghosts, and calls `read` for
/// runs of points as soon as all their nodes have values. Collective over neighbours.
pub fn to_points<const D: usize, const N: usize>(
    world: &World,
    mesh: &Discretisation<D>,
    mut fields: [&mut [f64]; N],
    mut read: impl FnMut(Range<usize>, [&[f64]; N]),
) {
    let (border, numbering) = (&mesh.border, &mesh.numbering);
    let lent = fields.each_mut().map(|field| &mut **field);
    numbering.halo.forward_while(world, lent, D, |fields| {
        border.inner.iter().for_each(|part| read(part.clone(), fields));
    });
    let fields = fields.map(|field| &*field);
    border.reaching.iter().for_each(|part| read(part.clone(), fields));
}
