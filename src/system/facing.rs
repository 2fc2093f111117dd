//! Elements of the surfaces of two bodies that face each other, for contact in implicit steps.
//!
//! Either surface is taken once: each of its elements, at x_s with the area A, meets the nearest element
//! of the other body, at y with the outward normal n, and bears half of its area, so that both passes
//! together count the surface once. With the weights w of the nodes of its own carrier and v of those of
//! the other one, at the foot x_s - g n of x_s without friction and at x_s with it,
//!
//! g = n·(x_s - y) + n·(Σ w_a u_a - Σ v_b u_b)
//!
//! is its gap after the nodal increments u. Both rows of weights reproduce linear fields and the force
//! acts along n through x_s and its foot, or with friction at one place: momentum and angular momentum are
//! kept to round-off, and bodies that turn together do not slip on each other. n is that of the step's
//! start; the next step finds it anew.

use rustc_hash::FxHashMap;
use std::f64::consts::TAU;

use super::carried::{area_of, grid_weights, place_of};
use super::model::Model;
use crate::basis::Domain;
use crate::basis::Influences;
use crate::contact::law::Friction;
use crate::error::Result;
use crate::grid::Grid;
use crate::parallel::{World, exchange};
use crate::points::Points;
use crate::surface::norm;
use crate::tensor::dense::dot;

/// Cells of gap within which two elements may come to touch in a step.
const REACH: f64 = 2.0;
/// Cells of overlap beyond which elements are taken for opposite sides of a thin body.
pub const DEEPEST: f64 = 0.5;
/// Two elements face each other where the cosine between one's normal and the other's opposite is larger. The
/// side of a block that rocks on the ground does not face the ground.
const FACING: f64 = 0.1;
/// Sizes of an element beside its centre up to which it is met.
const BESIDE: f64 = 0.75;

/// An element and the place of another body that it faces.
#[derive(Debug, Clone)]
pub struct Couple<const D: usize> {
    /// Index into [`crate::contact::Contacts::body_pairs`].
    pub pair: usize,
    /// The element lies on the second of the pair's bodies.
    pub of_second: bool,
    /// The point that carries it.
    pub point: usize,
    /// Number of the element among those that this point carries.
    pub element: usize,
    /// Nodes of the fields of both carriers; in the pattern they are local ones.
    pub nodes: Vec<usize>,
    /// w, and -v, of these.
    pub weights: Vec<f64>,
    /// Outward from the other body.
    pub normal: [f64; D],
    /// g at the step's start, m.
    pub gap: f64,
    /// Half of the element's, m2 (m in 2D).
    pub area: f64,
    /// x_s at the step's start, m.
    pub place: [f64; D],
}

/// An element of this rank or of another one.
struct Face<const D: usize> {
    body: usize,
    /// Identity of its carrier, and its number among those that this one carries.
    id: (u64, usize),
    /// On this rank, if it is its own.
    point: usize,
    place: [f64; D],
    area: [f64; D],
    /// Its size over that of a section, where points are rings: 2 pi r.
    around: f64,
    /// Of its carrier.
    centre: [f64; D],
    nodes: Vec<usize>,
    weights: Vec<f64>,
    gradients: Vec<[f64; D]>,
}

/// Elements of this rank's points that may touch another body in the step, in the order of the pairs,
/// the points and the elements. Collective.
pub fn find<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    influences: &Influences<D>,
) -> Result<Vec<Couple<D>>> {
    if model.facing.is_empty() {
        return Ok(Vec::new());
    }
    let reach = REACH * model.grid.cell_size();
    let own = own_faces(world, model, points, influences, reach);
    let others = faces_of_others(world, &own, reach)?;
    let bin_of =
        |x: &[f64; D]| -> [i64; D] { std::array::from_fn(|a| (x[a] / reach).floor() as i64) };
    let mut bins: FxHashMap<[i64; D], Vec<&Face<D>>> = FxHashMap::default();
    for face in own.iter().chain(&others) {
        bins.entry(bin_of(&face.place)).or_default().push(face);
    }
    let grid_weights = model.deck.method.basis.domain() == Domain::Box && !model.contacts.rings;
    let mut found = Vec::new();
    for (pair, of) in model.contacts.body_pairs.iter().enumerate() {
        for face in &own {
            let Some(side) = of.bodies.iter().position(|&body| body == face.body) else { continue };
            let other = of.bodies[1 - side];
            let centre = bin_of(&face.place);
            let beside = (0..3usize.pow(D as u32)).filter_map(|k| {
                let mut rest = k as i64;
                bins.get(&std::array::from_fn(|a| {
                    let shift = rest % 3 - 1;
                    rest /= 3;
                    centre[a] + shift
                }))
            });
            let distance = |to: &Face<D>| -> f64 {
                face.place.iter().zip(&to.place).map(|(x, y)| (x - y) * (x - y)).sum()
            };
            let opposite = |to: &&Face<D>| {
                let sizes = norm(&to.area) * norm(&face.area);
                to.body == other && dot(&to.area, &face.area) < -FACING * sizes
            };
            let nearest =
                beside.flatten().copied().filter(opposite).min_by(|a, b| {
                    distance(a).total_cmp(&distance(b)).then_with(|| a.id.cmp(&b.id))
                });
            let grid = grid_weights.then_some(&model.grid);
            let fields = |body: usize, node: usize| model.contacts.fields.node(body, node);
            found.extend(nearest.and_then(|to| {
                let sizes = (reach, model.grid.cell_size());
                let rubs = of.friction != Friction::Smooth;
                let mut couple = meet(face, to, sizes, (grid, rubs), &fields)?;
                (couple.pair, couple.of_second) = (pair, side == 1);
                Some(couple)
            }));
        }
    }
    Ok(found)
}

/// `None`: the other element lies too far away, or beside.
fn meet<const D: usize>(
    face: &Face<D>,
    to: &Face<D>,
    (reach, cell): (f64, f64),
    (grid, rubs): (Option<&Grid<D>>, bool),
    fields: &dyn Fn(usize, usize) -> usize,
) -> Option<Couple<D>> {
    let size = norm(&to.area);
    let normal = to.area.map(|a| a / size);
    let between: [f64; D] = std::array::from_fn(|i| face.place[i] - to.place[i]);
    let gap = dot(&normal, &between);
    let beside: [f64; D] = std::array::from_fn(|i| between[i] - gap * normal[i]);
    let extent = (size / to.around).powf(1.0 / (D - 1) as f64);
    if !(-DEEPEST * cell..=reach).contains(&gap) || norm(&beside) > BESIDE * extent {
        return None;
    }
    let mut nodes: Vec<usize> = face.nodes.iter().map(|&node| fields(face.body, node)).collect();
    nodes.extend(to.nodes.iter().map(|&node| fields(to.body, node)));
    let mut weights = face.weights_at(&face.place, grid);
    let foot = std::array::from_fn(|i| face.place[i] - gap * normal[i]);
    let met = if rubs { face.place } else { foot };
    weights.extend(to.weights_at(&met, grid).into_iter().map(|weight| -weight));
    Some(Couple {
        pair: 0,
        of_second: false,
        point: face.point,
        element: face.id.1,
        nodes,
        weights,
        normal,
        gap,
        area: 0.5 * norm(&face.area),
        place: face.place,
    })
}

impl<const D: usize> Face<D> {
    /// What the nodes of the carrier move a place beside it by: S + ∇S·(x - x_p), or the functions N(x)
    /// of a `grid` whose nodes there are among them ([`super::terms::surface`]).
    fn weights_at(&self, x: &[f64; D], grid: Option<&Grid<D>>) -> Vec<f64> {
        grid.and_then(|grid| grid_weights(grid, x, &self.nodes)).unwrap_or_else(|| {
            let offset: [f64; D] = std::array::from_fn(|i| x[i] - self.centre[i]);
            let of_node = |(s, g): (&f64, &[f64; D])| s + dot(g, &offset);
            self.weights.iter().zip(&self.gradients).map(of_node).collect()
        })
    }
}

/// Surface elements that this rank's points carry, if they lie within `reach` of a body that their own body may
/// touch. Collective.
fn own_faces<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    influences: &Influences<D>,
    reach: f64,
) -> Vec<Face<D>> {
    let bodies = model.facing.len();
    let rings = model.contacts.rings;
    let carried = |p: usize| {
        let surface = model.facing[points.body[p] as usize].as_ref();
        surface.map_or(&[][..], |surface| surface.carried_by(points.id[p]))
    };
    // Of each body the negative lower and the upper corner of all of its elements.
    let mut ends = vec![f64::NEG_INFINITY; bodies * 2 * D];
    for p in 0..points.len() {
        for own in carried(p) {
            extend(&mut ends, points.body[p] as usize, &place_of(points, p, own));
        }
    }
    let ends = world.max_slice(&ends);
    let near_other = |body: usize, x: &[f64; D]| {
        let pairs = model.contacts.body_pairs.iter();
        let others = pairs.filter_map(|pair| {
            let side = pair.bodies.iter().position(|&own| own == body)?;
            Some(pair.bodies[1 - side])
        });
        others.into_iter().any(|other| within(&ends, other, x, reach))
    };
    let mut faces = Vec::new();
    for p in 0..points.len() {
        let body = points.body[p] as usize;
        for (number, own) in carried(p).iter().enumerate() {
            let place = place_of(points, p, own);
            if !near_other(body, &place) {
                continue;
            }
            let row = influences.row(p);
            let area = area_of(points, p, own, &place, rings);
            let (mut weights, mut around) = (influences.weights[row.clone()].to_vec(), 1.0);
            if rings {
                // The place of a ring follows the mean that is not weighted by the radius.
                around = TAU * place[0];
                weights.copy_from_slice(&influences.hoop[row.clone()]);
                let whole: f64 = weights.iter().sum();
                weights.iter_mut().for_each(|weight| *weight /= whole);
            }
            faces.push(Face {
                body,
                id: (points.id[p], number),
                point: p,
                place,
                area,
                around,
                centre: points.position[p],
                nodes: influences.nodes[row.clone()].to_vec(),
                weights,
                gradients: influences.gradients[row].to_vec(),
            });
        }
    }
    faces
}

/// Widens the box number `k` of `ends` (negative lower corner, upper corner) to `x`.
fn extend<const D: usize>(ends: &mut [f64], k: usize, x: &[f64; D]) {
    let (low, high) = ends[k * 2 * D..(k + 1) * 2 * D].split_at_mut(D);
    for a in 0..D {
        (low[a], high[a]) = (low[a].max(-x[a]), high[a].max(x[a]));
    }
}

/// Whether `x` is no further than `margin` from the box number `k`.
fn within<const D: usize>(ends: &[f64], k: usize, x: &[f64; D], margin: f64) -> bool {
    let (low, high) = ends[k * 2 * D..(k + 1) * 2 * D].split_at(D);
    (0..D).all(|a| x[a] >= -low[a] - margin && x[a] <= high[a] + margin)
}

/// The faces of other ranks near those of this one. Collective.
fn faces_of_others<const D: usize>(
    world: &World,
    own: &[Face<D>],
    reach: f64,
) -> Result<Vec<Face<D>>> {
    if world.size() == 1 {
        return Ok(Vec::new());
    }
    let mut ends = vec![f64::NEG_INFINITY; world.size() * 2 * D];
    own.iter().for_each(|face| extend(&mut ends, world.rank(), &face.place));
    let ends = world.max_slice(&ends);
    let mut outgoing = Vec::new();
    for rank in (0..world.size()).filter(|&rank| rank != world.rank()) {
        let mut words = Vec::new();
        let near = own.iter().filter(|face| within(&ends, rank, &face.place, reach));
        near.for_each(|face| face.write(&mut words));
        if !words.is_empty() {
            outgoing.push((rank, words));
        }
    }
    let mut faces = Vec::new();
    for (_, words) in exchange(world, outgoing)? {
        let mut words = words.into_iter();
        while let Some(body) = words.next() {
            faces.extend(Face::read(body as usize, &mut words));
        }
    }
    Ok(faces)
}

impl<const D: usize> Face<D> {
    fn write(&self, words: &mut Vec<u64>) {
        let count = self.nodes.len() as u64;
        words.extend([self.body as u64, self.id.0, self.id.1 as u64, count]);
        words.extend(self.nodes.iter().map(|&node| node as u64));
        let places = self.place.iter().chain(&self.area).chain(&self.centre);
        let numbers = places.chain([&self.around]).chain(&self.weights);
        let numbers = numbers.chain(self.gradients.iter().flatten());
        words.extend(numbers.map(|number| number.to_bits()));
    }

    /// What [`Self::write`] wrote behind the body.
    fn read(body: usize, words: &mut impl Iterator<Item = u64>) -> Option<Self> {
        let id = (words.next()?, words.next()? as usize);
        let count = words.next()? as usize;
        let nodes: Vec<usize> = words.by_ref().take(count).map(|node| node as usize).collect();
        let mut numbers = words.map(f64::from_bits);
        let mut vector = || -> Option<[f64; D]> {
            let mut values = [0.0; D];
            for value in &mut values {
                *value = numbers.next()?;
            }
            Some(values)
        };
        let (place, area, centre) = (vector()?, vector()?, vector()?);
        let around = numbers.next()?;
        let weights = numbers.by_ref().take(count).collect();
        let flat: Vec<f64> = numbers.by_ref().take(count * D).collect();
        let gradients = flat.chunks_exact(D).map(|g| std::array::from_fn(|a| g[a])).collect();
        Some(Face {
            body,
            id,
            point: usize::MAX,
            place,
            area,
            around,
            centre,
            nodes,
            weights,
            gradients,
        })
    }
}
