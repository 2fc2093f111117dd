//! Do the conditions hold every body against rigid motion? Found before anything is solved or
//! written: a quasi-static system that a rigid motion solves is singular.

use nalgebra::DMatrix;

use crate::assembly::conditions::{Conditions, StepSpan};
use crate::assembly::numbering::Touched;
use crate::assembly::{Numbering, Populated};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::parallel::World;
use crate::points::Points;

use super::discretise::Model;

/// Share of the largest eigenvalue below which a motion counts as free. The rows are exact but
/// for rounding; a held line of a thousandth of the body's length leaves 1e-6.
const FREE: f64 = 1e-12;

/// An error that names the body and the motion. Bodies that share nodes hold each other. Every
/// held component of a node is a row of the rigid motions' values there; the motions that all
/// rows annihilate are free. The cells and nodes are those of [`super::discretise::active`].
/// Collective.
pub fn require<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    (populated, nodes): &(Populated, Touched),
    first: StepSpan,
) -> Result<()> {
    let (deck, grid) = (&model.deck, &model.grid);
    let numbering = Numbering::build(world, nodes.owned.clone(), &nodes.foreign)?;
    let conditions = Conditions::evaluate(
        world,
        grid,
        deck.method.basis,
        &numbering,
        points,
        &deck.boundaries,
        first,
    )?;
    let bodies = deck.bodies.len();
    let touched = touched_nodes(world, grid, populated, &numbering, bodies)?;
    let groups = sharing(world, &touched, bodies);
    let (middle, length) = extent(world, points);
    let motions = D + D * (D - 1) / 2;
    for (lead, _) in groups.iter().enumerate().filter(|(body, group)| body == *group) {
        let mut gram = vec![0.0; motions * motions];
        for (local, bodies) in touched.iter().enumerate() {
            if !bodies.iter().zip(&groups).any(|(&on, &group)| on && group == lead) {
                continue;
            }
            let x = grid.node_position(numbering.nodes[local]);
            let x: [f64; D] = std::array::from_fn(|a| (x[a] - middle[a]) / length);
            for component in (0..D).filter(|c| conditions.fixed[local * D + c]) {
                let row = motions_at(&x, component);
                for (i, a) in row.iter().enumerate() {
                    for (j, b) in row.iter().enumerate() {
                        gram[i * motions + j] += a * b;
                    }
                }
            }
        }
        let gram = DMatrix::from_vec(motions, motions, world.sum_slice(&gram));
        let spectrum = gram.symmetric_eigen();
        let largest = spectrum.eigenvalues.max();
        let free = (0..motions).find(|&k| spectrum.eigenvalues[k] <= FREE * largest.max(1e-300));
        if let Some(free) = free {
            let motion = name(spectrum.eigenvectors.column(free).iter().copied(), D);
            return Err(Error::Input(format!(
                "body \"{}\" can {motion} freely: no boundary holds the nodes around it against \
                 this, so that the quasi-static system is singular; check the places and \
                 components of [[boundary]]",
                deck.bodies[lead].name
            )));
        }
    }
    Ok(())
}

/// Bodies at each owned node.
fn touched_nodes<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    populated: &Populated,
    numbering: &Numbering,
    bodies: usize,
) -> Result<Vec<Vec<bool>>> {
    let mut flags = vec![0.0; numbering.len() * bodies];
    let mut nodes = Vec::new();
    for &(cell, inside) in &populated.owned {
        nodes.clear();
        grid.cell_nodes(cell, &mut nodes);
        for local in nodes.iter().filter_map(|&node| numbering.local(node)) {
            for body in (0..bodies).filter(|body| inside >> body & 1 == 1) {
                flags[local * bodies + body] = 1.0;
            }
        }
    }
    numbering.halo.reverse_add(world, &mut flags, bodies)?;
    let owned = flags.chunks_exact(bodies).take(numbering.owned);
    Ok(owned.map(|flags| flags.iter().map(|&flag| flag > 0.0).collect()).collect())
}

/// The first body of the group that each body belongs to.
fn sharing(world: &World, touched: &[Vec<bool>], bodies: usize) -> Vec<usize> {
    let mut shared = vec![0.0; bodies * bodies];
    for at in touched {
        for a in (0..bodies).filter(|&a| at[a]) {
            for b in (0..bodies).filter(|&b| at[b]) {
                shared[a * bodies + b] = 1.0;
            }
        }
    }
    let shared = world.sum_slice(&shared);
    let mut group: Vec<usize> = (0..bodies).collect();
    // As many rounds as the longest chain of neighbours can need.
    for _ in 0..bodies {
        for a in 0..bodies {
            for b in 0..bodies {
                if shared[a * bodies + b] > 0.0 {
                    let first = group[a].min(group[b]);
                    (group[a], group[b]) = (first, first);
                }
            }
        }
    }
    group
}

/// Middle and largest extent of all points.
fn extent<const D: usize>(world: &World, points: &Points<D>) -> ([f64; D], f64) {
    let end = |axis: usize, sign: f64| {
        let own = points.position.iter().map(|x| sign * x[axis]).fold(f64::MIN, f64::max);
        sign * world.max(own)
    };
    let high: [f64; D] = std::array::from_fn(|a| end(a, 1.0));
    let low: [f64; D] = std::array::from_fn(|a| end(a, -1.0));
    let length = (0..D).map(|a| high[a] - low[a]).fold(0.0, f64::max);
    let middle = std::array::from_fn(|a| 0.5 * (high[a] + low[a]));
    (middle, if length > 0.0 { length } else { 1.0 })
}

/// Component `c` of every rigid motion at `x`: translations, then turns in the planes of axes
/// (0, 1), (1, 2), (2, 0).
fn motions_at<const D: usize>(x: &[f64; D], component: usize) -> Vec<f64> {
    let mut row = vec![0.0; D];
    row[component] = 1.0;
    for turn in 0..D * (D - 1) / 2 {
        let (a, b) = (turn, (turn + 1) % D);
        row.push(match component {
            c if c == a => -x[b],
            c if c == b => x[a],
            _ => 0.0,
        });
    }
    row
}

/// The motion in words.
fn name(motion: impl Iterator<Item = f64>, dimension: usize) -> String {
    let size: Vec<f64> = motion.map(f64::abs).collect();
    let largest = (0..size.len()).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
    const AXES: [&str; 3] = ["x", "y", "z"];
    if largest < dimension {
        format!("move along {}", AXES[largest])
    } else if dimension == 2 {
        "turn".into()
    } else {
        format!("turn about {}", AXES[(largest - dimension + 2) % 3])
    }
}
