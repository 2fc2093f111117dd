//! Nodes that bodies in different velocity fields share, and how the bodies meet there: the plane between
//! the points that reach the node, the gap between their domains along its normal, and the node's share
//! of the surface, |Σ_p V_p ∇S_p · n| = |∮ S n dA|, the smaller one of both bodies.

use rustc_hash::FxHashMap;

use super::model::Model;
use super::step_system::Discretisation;
use crate::contact::corner::DomainCorners;
use crate::contact::nodal::Meeting;
use crate::contact::separator::separate;
use crate::contact::surface::length;
use crate::error::Result;
use crate::parallel::{World, exchange};
use crate::points::Points;
use crate::tensor::dense::dot;

/// A node of the grid that several fields reach.
#[derive(Debug)]
pub struct SharedNode<const D: usize> {
    /// (field, owned local node), ascending.
    pub fields: Vec<(usize, usize)>,
    /// Where two bodies in contact meet: index into
    /// [`Contacts::body_pairs`](crate::contact::Contacts::body_pairs).
    pub meetings: Vec<(usize, Meeting<D>)>,
}

/// A point as a node sees it.
struct Seen<const D: usize> {
    node: usize,
    body: usize,
    id: u64,
    x: [f64; D],
    /// Edges of its domain, m.
    edges: [[f64; D]; D],
    /// V ∇S, m2.
    surface: [f64; D],
}

impl<const D: usize> Seen<D> {
    const HEAD: usize = 3;
    const WORDS: usize = Self::HEAD + 2 * D + D * D;

    fn write(&self, words: &mut Vec<f64>) {
        words.extend([self.node as f64, self.body as f64, self.id as f64]);
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
/// ones. Collective.
pub fn find<const D: usize>(
    world: &World,
    model: &Model<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    mass: &[f64],
) -> Result<Vec<SharedNode<D>>> {
    let (contacts, numbering) = (&model.contacts, &mesh.numbering);
    let fields = &contacts.fields;
    let mut places = numbering.nodes[..numbering.owned].to_vec();
    places.sort_unstable();
    let mut shared: Vec<(usize, SharedNode<D>)> = Vec::new();
    let mut marks = vec![0.0; numbering.len()];
    for same in places.chunk_by(|a, b| a == b).filter(|same| same.len() > 1) {
        let local = |field: usize| numbering.local(fields.at(field, same[0]));
        let found: Vec<(usize, usize)> = (0..fields.count())
            .filter_map(|field| local(field).map(|local| (field, local)))
            .filter(|&(_, local)| mass[local] > 0.0)
            .collect();
        if found.len() < 2 {
            continue;
        }
        let of_body = |body: usize| {
            let field = fields.of_body(body);
            found.iter().find(|(own, _)| *own == field).map(|(_, local)| *local)
        };
        for pair in &contacts.body_pairs {
            if let [Some(one), Some(two)] = pair.bodies.map(of_body) {
                (marks[one], marks[two]) = (1.0, 1.0);
            }
        }
        shared.push((same[0], SharedNode { fields: found, meetings: Vec::new() }));
    }
    numbering.halo.forward(world, &mut marks, 1)?;
    let seen = gather(world, model, mesh, points, &marks)?;
    let mut of_node: FxHashMap<usize, &[Seen<D>]> = FxHashMap::default();
    for same in seen.chunk_by(|a, b| a.node == b.node) {
        of_node.insert(same[0].node, same);
    }
    let size = model.grid.cell_size();
    for (node, shared) in &mut shared {
        let Some(seen) = of_node.get(node) else { continue };
        for (index, pair) in contacts.body_pairs.iter().enumerate() {
            let sides = pair
                .bodies
                .map(|body| seen.iter().filter(|one| one.body == body).collect::<Vec<&Seen<D>>>());
            if let Some(meeting) = meeting(&sides, size) {
                shared.meetings.push((index, meeting));
            }
        }
    }
    Ok(shared.into_iter().map(|(_, shared)| shared).collect())
}

/// How two bodies meet at a node that sees these points of them; `size`: of a cell, m.
fn meeting<const D: usize>(sides: &[Vec<&Seen<D>>; 2], size: f64) -> Option<Meeting<D>> {
    let clouds = [0, 1].map(|k| sides[k].iter().map(|one| one.x).collect::<Vec<_>>());
    // In an inner corner no plane has one body on either side.
    let normal = separate(&clouds[0], &clouds[1], size).or_else(|| between_means(&clouds))?;
    let top = |one: &&Seen<D>| dot(&one.x, &normal) + one.reach(&normal);
    let bottom = |one: &&Seen<D>| dot(&one.x, &normal) - one.reach(&normal);
    let highest = sides[0].iter().map(top).fold(f64::NEG_INFINITY, f64::max);
    let lowest = sides[1].iter().map(bottom).fold(f64::INFINITY, f64::min);
    let surface =
        |side: &[&Seen<D>]| side.iter().map(|one| dot(&one.surface, &normal)).sum::<f64>();
    let area = surface(&sides[0]).min(-surface(&sides[1])).max(0.0);
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

/// The points of bodies in contact that reach marked nodes owned here, of all ranks, ascending by node,
/// body and id. Collective.
fn gather<const D: usize>(
    world: &World,
    model: &Model<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    marks: &[f64],
) -> Result<Vec<Seen<D>>> {
    let (grid, partition, contacts) = (&model.grid, &model.partition, &model.contacts);
    let (groups, influences) = (&mesh.groups, &mesh.influences);
    let mut seen: Vec<Seen<D>> = Vec::new();
    let mut outgoing: FxHashMap<usize, Vec<f64>> = FxHashMap::default();
    for group in 0..groups.len() {
        let nodes = &mesh.group_nodes[groups.node_offsets[group]..groups.node_offsets[group + 1]];
        if !nodes.iter().any(|&node| marks[node as usize] > 0.0) {
            continue;
        }
        for &p in groups.points(group) {
            let corners = DomainCorners::of(model.deck.method.basis, contacts.rings, points, p);
            let volume = points.volume(p);
            for (&local, entry) in nodes.iter().zip(influences.row(p)) {
                let local = local as usize;
                if marks[local] == 0.0 || influences.weights[entry] <= 0.0 {
                    continue;
                }
                let mut surface = influences.gradients[entry].map(|g| volume * g);
                // The surface of a ring, without its cuts across the turn.
                surface[0] += volume * influences.hoop.get(entry).copied().unwrap_or(0.0);
                let one = Seen {
                    node: mesh.numbering.nodes[local],
                    body: points.body[p] as usize,
                    id: points.id[p],
                    x: points.position[p],
                    edges: corners.edges,
                    surface,
                };
                if local < mesh.numbering.owned {
                    seen.push(one);
                } else {
                    let owner = partition.owner_of_node(grid, one.node);
                    one.write(outgoing.entry(owner).or_default());
                }
            }
        }
    }
    for (_, words) in exchange(world, outgoing.into_iter().collect())? {
        seen.extend(words.chunks_exact(Seen::<D>::WORDS).map(Seen::read));
    }
    seen.sort_unstable_by_key(|one| (one.node, one.body, one.id));
    Ok(seen)
}
