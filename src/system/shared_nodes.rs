//! Nodes that bodies in different velocity fields share, and how the bodies meet there: the plane between
//! the points that reach the node, the gap between their domains along its normal, and the node's share
//! of the surface, |Σ_p V_p ∇S_p · n| = |∮ S n dA|, the smaller one of both bodies.
//!
//! What reaches a node ends somewhere, and a plane between two such ends would tilt where one lies beyond
//! the other. So the points of one body that reach it are held against those of the other within half a
//! cell more, and the other way round; the nearer pair counts.

use rustc_hash::{FxHashMap, FxHashSet};

use super::model::Model;
use super::step_system::Discretisation;
use crate::contact::corner::DomainCorners;
use crate::contact::nodal::Meeting;
use crate::contact::separator::separate;
use crate::contact::surface::length;
use crate::error::Result;
use crate::grid::{Grid, Lattice};
use crate::parallel::{World, exchange};
use crate::points::Points;
use crate::tensor::dense::dot;

/// How far from a node, along an axis in cells, points are seen that do not reach it.
const BEYOND: f64 = 1.75;

/// Distances of two pairs, over themselves, that are alike.
const ALIKE: f64 = 1e-6;

/// A node of the grid that several fields reach.
#[derive(Debug)]
pub struct SharedNode<const D: usize> {
    /// Fields that move as one, as no contact keeps them apart here, with their owned local nodes.
    pub classes: Vec<Vec<(usize, usize)>>,
    /// Where two bodies in contact meet: index into
    /// [`Contacts::body_pairs`](crate::contact::Contacts::body_pairs), and the classes of its bodies.
    pub meetings: Vec<(usize, [usize; 2], Meeting<D>)>,
}

/// A point as a node sees it.
struct Seen<const D: usize> {
    node: usize,
    body: usize,
    id: u64,
    /// It has weight there.
    reaches: bool,
    x: [f64; D],
    /// Edges of its domain, m.
    edges: [[f64; D]; D],
    /// V ∇S, m2.
    surface: [f64; D],
}

impl<const D: usize> Seen<D> {
    const HEAD: usize = 4;
    const WORDS: usize = Self::HEAD + 2 * D + D * D;

    fn write(&self, words: &mut Vec<f64>) {
        let reaches = f64::from(u8::from(self.reaches));
        words.extend([self.node as f64, self.body as f64, self.id as f64, reaches]);
        words.extend(self.x);
        words.extend(self.edges.as_flattened());
        words.extend(self.surface);
    }

    fn read(words: &[f64]) -> Self {
        let (x, rest) = words[Self::HEAD..].split_at(D);
        let (edges, surface) = rest.split_at(D * D);
        Seen {
            node: words[0] as usize,
            body: words[1] as usize,
            id: words[2] as u64,
            reaches: words[3] > 0.0,
            x: std::array::from_fn(|a| x[a]),
            edges: std::array::from_fn(|k| std::array::from_fn(|a| edges[k * D + a])),
            surface: std::array::from_fn(|a| surface[a]),
        }
    }

    /// How far its domain reaches along a direction, m.
    fn reach(&self, n: &[f64; D]) -> f64 {
        0.5 * self.edges.iter().map(|edge| dot(edge, n).abs()).sum::<f64>()
    }
}

/// The shared nodes owned here, ascending by node of the grid; `mass`: of local nodes, kg, true at owned
/// ones; pairs of bodies meet that are in contact in `stage`. Collective.
pub fn find<const D: usize>(
    world: &World,
    model: &Model<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    (mass, stage): (&[f64], usize),
) -> Result<Vec<SharedNode<D>>> {
    let (contacts, numbering) = (&model.contacts, &mesh.numbering);
    let fields = &contacts.fields;
    let pairs: Vec<(usize, [usize; 2])> = contacts
        .body_pairs
        .iter()
        .enumerate()
        .filter(|(_, pair)| pair.presence.is_in(stage))
        .map(|(index, pair)| (index, pair.bodies.map(|body| fields.of_body(body))))
        .collect();
    let mut places = numbering.nodes[..numbering.owned].to_vec();
    places.sort_unstable();
    let mut shared: Vec<(usize, SharedNode<D>)> = Vec::new();
    let mut marks = vec![0.0; numbering.len()];
    let mut watched = FxHashSet::default();
    for same in places.chunk_by(|a, b| a == b).filter(|same| same.len() > 1) {
        let local = |field: usize| numbering.local(fields.at(field, same[0]));
        let found: Vec<(usize, usize)> = (0..fields.count())
            .filter_map(|field| local(field).map(|local| (field, local)))
            .filter(|&(_, local)| mass[local] > 0.0)
            .collect();
        if found.len() < 2 {
            continue;
        }
        let of_field =
            |field: usize| found.iter().find(|(own, _)| *own == field).map(|(_, local)| *local);
        for (_, both) in &pairs {
            if let [Some(one), Some(two)] = both.map(of_field) {
                (marks[one], marks[two]) = (1.0, 1.0);
                watched.insert(same[0]);
            }
        }
        let classes = classes(&found, &pairs);
        shared.push((same[0], SharedNode { classes, meetings: Vec::new() }));
    }
    let seen = gather(world, model, mesh, points, marks, &watched)?;
    let mut of_node: FxHashMap<usize, &[Seen<D>]> = FxHashMap::default();
    for same in seen.chunk_by(|a, b| a.node == b.node) {
        of_node.insert(same[0].node, same);
    }
    let size = model.grid.cell_size();
    for (node, shared) in &mut shared {
        let Some(seen) = of_node.get(node) else { continue };
        for &(index, both) in &pairs {
            let class = |field: usize| {
                shared.classes.iter().position(|class| class.iter().any(|(own, _)| *own == field))
            };
            let [Some(one), Some(two)] = both.map(class) else { continue };
            if one == two {
                continue;
            }
            let sides = contacts.body_pairs[index]
                .bodies
                .map(|body| seen.iter().filter(|one| one.body == body).collect::<Vec<&Seen<D>>>());
            if let Some(meeting) = meeting(&sides, size) {
                shared.meetings.push((index, [one, two], meeting));
            }
        }
    }
    Ok(shared.into_iter().map(|(_, shared)| shared).collect())
}

/// Fields (with their local nodes) that no pair in contact keeps apart move as one, and so does what
/// both move with.
fn classes(found: &[(usize, usize)], pairs: &[(usize, [usize; 2])]) -> Vec<Vec<(usize, usize)>> {
    let apart =
        |a: usize, b: usize| pairs.iter().any(|(_, both)| *both == [a, b] || *both == [b, a]);
    let mut classes: Vec<Vec<(usize, usize)>> = Vec::new();
    for &one in found {
        let (with, others): (Vec<_>, Vec<_>) =
            classes.into_iter().partition(|class| class.iter().any(|other| !apart(one.0, other.0)));
        classes = others;
        let mut joined: Vec<(usize, usize)> = with.into_iter().flatten().collect();
        joined.push(one);
        joined.sort_unstable();
        classes.push(joined);
    }
    classes.sort_unstable();
    classes
}

/// Gives the nodes of each class their mean of `nodal` (local values, true at owned nodes) by mass.
pub fn join<const D: usize>(classes: &[Vec<usize>], mass: &[f64], nodal: &mut [f64]) {
    for class in classes {
        let whole: f64 = class.iter().map(|&node| mass[node]).sum();
        for i in 0..D {
            let sum: f64 = class.iter().map(|&node| mass[node] * nodal[node * D + i]).sum();
            class.iter().for_each(|&node| nodal[node * D + i] = sum / whole);
        }
    }
}

/// The local nodes of each class of more than one field.
pub fn joined<const D: usize>(shared: &[SharedNode<D>]) -> Vec<Vec<usize>> {
    let all = shared.iter().flat_map(|shared| &shared.classes);
    let several = all.filter(|class| class.len() > 1);
    several.map(|class| class.iter().map(|(_, node)| *node).collect()).collect()
}

/// How two bodies meet at a node that sees these points of them; `size`: of a cell, m.
fn meeting<const D: usize>(sides: &[Vec<&Seen<D>>; 2], size: f64) -> Option<Meeting<D>> {
    let all = sides.each_ref().map(|side| side.iter().map(|one| one.x).collect::<Vec<_>>());
    let near = sides.each_ref().map(|side| {
        side.iter().filter(|one| one.reaches).map(|one| one.x).collect::<Vec<[f64; D]>>()
    });
    let apart = |a: &[[f64; D]], b: &[[f64; D]]| {
        let n = separate(a, b, size)?;
        let low = b.iter().map(|x| dot(x, &n)).fold(f64::INFINITY, f64::min);
        let high = a.iter().map(|x| dot(x, &n)).fold(f64::NEG_INFINITY, f64::max);
        Some((low - high, n))
    };
    let normal = match (apart(&near[0], &all[1]), apart(&all[0], &near[1])) {
        // Of two that are equally near up to round-off the mean: neither body is the first.
        (Some(one), Some(two)) => match (one.0 - two.0) / one.0.max(two.0) {
            more if more > ALIKE => two.1,
            more if more < -ALIKE => one.1,
            _ => {
                let sum: [f64; D] = std::array::from_fn(|i| one.1[i] + two.1[i]);
                let size = length(&sum);
                sum.map(|n| n / size)
            }
        },
        // In an inner corner no plane has one body on either side.
        _ => apart(&near[0], &near[1]).map(|(_, n)| n).or_else(|| between_means(&near))?,
    };
    let reaching = |k: usize| sides[k].iter().filter(|one| one.reaches);
    let top = |one: &&Seen<D>| dot(&one.x, &normal) + one.reach(&normal);
    let bottom = |one: &&Seen<D>| dot(&one.x, &normal) - one.reach(&normal);
    let highest = reaching(0).map(top).fold(f64::NEG_INFINITY, f64::max);
    let lowest = reaching(1).map(bottom).fold(f64::INFINITY, f64::min);
    let surface = |k: usize| reaching(k).map(|one| dot(&one.surface, &normal)).sum::<f64>();
    let area = surface(0).min(-surface(1)).max(0.0);
    Some(Meeting { normal, gap: lowest - highest, area })
}

/// Direction from the mean of one cloud to that of the other.
fn between_means<const D: usize>(clouds: &[Vec<[f64; D]>; 2]) -> Option<[f64; D]> {
    let mean = |cloud: &Vec<[f64; D]>| -> [f64; D] {
        std::array::from_fn(|i| cloud.iter().map(|x| x[i]).sum::<f64>() / cloud.len() as f64)
    };
    let [from, to] = [mean(&clouds[0]), mean(&clouds[1])];
    let way: [f64; D] = std::array::from_fn(|i| to[i] - from[i]);
    let size = length(&way);
    (size > 0.0).then(|| way.map(|v| v / size))
}

/// The points of bodies in contact at and around the `watched` nodes owned here, of all ranks, ascending
/// by node, body and id. `marks`: 1 at those owned local nodes. Collective.
fn gather<const D: usize>(
    world: &World,
    model: &Model<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    mut marks: Vec<f64>,
    watched: &FxHashSet<usize>,
) -> Result<Vec<Seen<D>>> {
    let (grid, partition, contacts) = (&model.grid, &model.partition, &model.contacts);
    let (groups, influences, numbering) = (&mesh.groups, &mesh.influences, &mesh.numbering);
    numbering.halo.forward(world, &mut marks, 1)?;
    let nodes_of = |group: usize| {
        &mesh.group_nodes[groups.node_offsets[group]..groups.node_offsets[group + 1]]
    };
    // Nodes of points that reach a watched one: their own points may be seen from it.
    let mut around = vec![0.0; numbering.len()];
    for group in 0..groups.len() {
        if nodes_of(group).iter().any(|&node| marks[node as usize] > 0.0) {
            nodes_of(group).iter().for_each(|&node| around[node as usize] = 1.0);
        }
    }
    numbering.halo.reverse_add(world, &mut around, 1)?;
    numbering.halo.forward(world, &mut around, 1)?;
    let (here, mut far) = (world.rank(), Vec::new());
    let mut seen: Vec<Seen<D>> = Vec::new();
    let mut outgoing: FxHashMap<usize, Vec<f64>> = FxHashMap::default();
    for group in 0..groups.len() {
        let nodes = nodes_of(group);
        if !nodes.iter().any(|&node| around[node as usize] > 0.0) {
            continue;
        }
        for &p in groups.points(group) {
            let corners = DomainCorners::of(model.deck.method.basis, contacts.rings, points, p);
            let volume = points.volume(p);
            let mut report = |node: usize, reaches: bool, surface: [f64; D]| {
                let one = Seen {
                    node,
                    body: points.body[p] as usize,
                    id: points.id[p],
                    reaches,
                    x: points.position[p],
                    edges: corners.edges,
                    surface,
                };
                match partition.owner_of_node(grid, node) {
                    owner if owner == here => seen.push(one),
                    owner => one.write(outgoing.entry(owner).or_default()),
                }
            };
            far.clear();
            if let Grid::Lattice(lattice) = grid {
                nodes_within(lattice, &points.position[p], BEYOND, &mut far);
            }
            for (&local, entry) in nodes.iter().zip(influences.row(p)) {
                let local = local as usize;
                if marks[local] == 0.0 || influences.weights[entry] <= 0.0 {
                    continue;
                }
                let mut surface = influences.gradients[entry].map(|g| volume * g);
                // The surface of a ring, without its cuts across the turn.
                surface[0] += volume * influences.hoop.get(entry).copied().unwrap_or(0.0);
                let node = numbering.nodes[local];
                far.retain(|other| *other != node);
                report(node, true, surface);
            }
            far.iter().for_each(|&node| report(node, false, [0.0; D]));
        }
    }
    for (_, words) in exchange(world, outgoing.into_iter().collect())? {
        seen.extend(words.chunks_exact(Seen::<D>::WORDS).map(Seen::read));
    }
    seen.retain(|one| watched.contains(&one.node));
    seen.sort_unstable_by_key(|one| (one.node, one.body, one.id));
    Ok(seen)
}

/// Appends the nodes no further than `cells` from a place along any axis.
fn nodes_within<const D: usize>(
    lattice: &Lattice<D>,
    x: &[f64; D],
    cells: f64,
    nodes: &mut Vec<usize>,
) {
    let range: [(usize, usize); D] = std::array::from_fn(|a| {
        let at = lattice.scaled(a, x[a]);
        let last = lattice.cells[a] as f64;
        let bound = |v: f64| v.clamp(0.0, last) as usize;
        (bound((at - cells).ceil()), bound((at + cells).floor()))
    });
    let mut index = range.map(|(low, _)| low);
    loop {
        nodes.push(lattice.node_at(index));
        let Some(axis) = (0..D).find(|&a| index[a] < range[a].1) else { return };
        index[axis] += 1;
        (0..axis).for_each(|a| index[a] = range[a].0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_without_a_contact_between_them_move_as_one() {
        let found = [(0, 10), (1, 11), (2, 12)];
        assert_eq!(classes(&found, &[]), [vec![(0, 10), (1, 11), (2, 12)]]);
        // 1 and 2 are in contact; 0 holds on to both where it is.
        let pair = [(0, [1, 2])];
        assert_eq!(classes(&found[1..], &pair), [vec![(1, 11)], vec![(2, 12)]]);
        assert_eq!(classes(&found, &pair).len(), 1);
        let all = [(0, [1, 2]), (1, [0, 2]), (2, [1, 0])];
        assert_eq!(classes(&found, &all).len(), 3);
        let two = [(0, [1, 2]), (1, [0, 2])];
        assert_eq!(classes(&found, &two), [vec![(0, 10), (1, 11)], vec![(2, 12)]]);
    }

    #[test]
    fn joined_nodes_take_their_mean_by_mass() {
        let mut nodal = [1.0, 2.0, 9.0, 9.0, 4.0, 8.0];
        join::<2>(&[vec![0, 2]], &[1.0, 5.0, 2.0], &mut nodal);
        assert_eq!(nodal, [3.0, 6.0, 9.0, 9.0, 3.0, 6.0]);
    }

    #[test]
    fn nodes_near_a_place_are_those_of_the_lattice() {
        let lattice = Lattice { origin: [0.0, 0.0], spacing: [0.5, 0.5], cells: [4, 4] };
        let mut nodes = Vec::new();
        nodes_within(&lattice, &[0.1, 1.05], 1.75, &mut nodes);
        let mut expected: Vec<usize> = (0..2)
            .flat_map(|i| (1..4).map(move |j| (i, j)))
            .map(|(i, j)| lattice.node_at([i, j]))
            .collect();
        nodes.sort_unstable();
        expected.sort_unstable();
        assert_eq!(nodes, expected);
    }
}
