//! Deck bodies to material points. Each rank makes an equal share of the candidates, whatever
//! the partition will be; identities depend on the deck alone, so that a run looks the same on
//! any number of ranks.

use std::ops::Range;

use crate::deck::model::{Body, BodySource, Deck, Seeding};
use crate::deck::{Scope, Shape};
use crate::error::{Error, Result};
use crate::grid::{Grid, Lattice};

use super::Points;

/// Which share of the candidates to make.
#[derive(Debug, Clone, Copy)]
pub struct Share {
    pub rank: usize,
    pub ranks: usize,
}

impl Share {
    /// This rank's part of `0..count`.
    pub fn of(&self, count: usize) -> Range<usize> {
        count * self.rank / self.ranks..count * (self.rank + 1) / self.ranks
    }
}

/// Makes this rank's share of all bodies' points, unstrained, with their initial velocity.
pub fn seed<const D: usize>(deck: &Deck, grid: &Grid<D>, share: Share) -> Result<Points<D>> {
    let mut points = Points::default();
    let mut first_id = 0u64;
    for (index, body) in deck.bodies.iter().enumerate() {
        let made = points.len();
        let candidates = match &body.source {
            BodySource::Shape { shape, seeding } => match (seeding, grid) {
                (Seeding::PerCell(counts), Grid::Lattice(lattice)) => {
                    per_cell(&mut points, index, body, shape, counts, lattice, share, first_id)
                }
                (Seeding::Lattice { spacing, offset }, _) => {
                    on_lattice(&mut points, index, body, shape, *spacing, offset, share, first_id)?
                }
                (Seeding::Gauss(order), Grid::Lattice(lattice)) => {
                    let counts = vec![*order; D];
                    per_cell(&mut points, index, body, shape, &counts, lattice, share, first_id)
                }
            },
            BodySource::File(path) => {
                super::file::read_points(&mut points, index, body, path, share, first_id)?
            }
            BodySource::MeshCells { .. } => {
                return Err(Error::Input(format!(
                    "body \"{}\" takes the cells of a mesh, but the grid is a lattice; give it \
                     a shape with points_per_cell",
                    body.name
                )));
            }
        };
        first_id += candidates;
        set_velocity(&mut points, made, body);
    }
    Ok(points)
}

/// Equal sub-cells of every lattice cell, kept where their centre is inside. Returns the number
/// of candidates.
#[allow(clippy::too_many_arguments)]
fn per_cell<const D: usize>(
    points: &mut Points<D>,
    index: usize,
    body: &Body,
    shape: &Shape,
    counts: &[usize],
    lattice: &Lattice<D>,
    share: Share,
    first_id: u64,
) -> u64 {
    let (low, size) = cell_window(lattice, shape.bounds());
    let cells: usize = size.iter().product();
    let per_cell: usize = counts.iter().product();
    let half: [f64; D] = std::array::from_fn(|a| 0.5 * lattice.spacing[a] / counts[a] as f64);
    let volume = half.iter().map(|l| 2.0 * l).product();
    for candidate in share.of(cells) {
        let cell: [usize; D] = split(candidate, &size);
        for sub in 0..per_cell {
            let part: [usize; D] = split(sub, counts);
            let x: [f64; D] = std::array::from_fn(|a| {
                lattice.origin[a]
                    + lattice.spacing[a]
                        * ((low[a] + cell[a]) as f64 + (part[a] as f64 + 0.5) / counts[a] as f64)
            });
            if shape.contains(&x) {
                let id = first_id + (candidate * per_cell + sub) as u64;
                points.push_unstrained(id, index as u32, x, volume, body.density, half);
                mark_outermost(points, shape, &x, &half);
            }
        }
    }
    (cells * per_cell) as u64
}

/// Points at offset + (i, j, k) spacing in the shape's own frame, kept where they are inside.
#[allow(clippy::too_many_arguments)]
fn on_lattice<const D: usize>(
    points: &mut Points<D>,
    index: usize,
    body: &Body,
    shape: &Shape,
    spacing: f64,
    offset: &[f64],
    share: Share,
    first_id: u64,
) -> Result<u64> {
    let Some((min, max)) = shape.local_bounds() else {
        return Err(Error::Input(format!(
            "body \"{}\" is unbounded and seeded by a lattice of spacing {spacing}; intersect it \
             with a box, or use points_per_cell",
            body.name
        )));
    };
    let low: [i64; D] =
        std::array::from_fn(|a| ((min[a] - offset[a]) / spacing).floor() as i64 - 1);
    let size: Vec<usize> = (0..D)
        .map(|a| (((max[a] - offset[a]) / spacing).ceil() as i64 + 2 - low[a]) as usize)
        .collect();
    let candidates = size.iter().product();
    let half = [0.5 * spacing; D];
    for candidate in share.of(candidates) {
        let at: [usize; D] = split(candidate, &size);
        let local: [f64; D] =
            std::array::from_fn(|a| offset[a] + (low[a] + at[a] as i64) as f64 * spacing);
        if shape.contains_local(&local) {
            let global = shape.to_global(&local);
            let x = std::array::from_fn(|a| global[a]);
            let id = first_id + candidate as u64;
            points.push_unstrained(id, index as u32, x, spacing.powi(D as i32), body.density, half);
            mark_outermost(points, shape, &x, &half);
        }
    }
    Ok(candidates as u64)
}

/// A point is outermost if a neighbour of its seeding would lie outside the shape.
fn mark_outermost<const D: usize>(
    points: &mut Points<D>,
    shape: &Shape,
    x: &[f64; D],
    half: &[f64; D],
) {
    let outermost = (0..D).any(|axis| {
        [-2.0, 2.0].iter().any(|step| {
            let mut neighbour = *x;
            neighbour[axis] += step * half[axis];
            !shape.contains(&neighbour)
        })
    });
    *points.outermost.last_mut().expect("a point was just pushed") = f64::from(u8::from(outermost));
}

fn set_velocity<const D: usize>(points: &mut Points<D>, from: usize, body: &Body) {
    if body.velocity.is_empty() {
        return;
    }
    for p in from..points.len() {
        let mut scope = Scope::default();
        scope.initial[..D].copy_from_slice(&points.position[p]);
        scope.current = scope.initial;
        for (v, expression) in points.velocity[p].iter_mut().zip(&body.velocity) {
            *v = expression.value(&scope);
        }
    }
}

/// Lowest cell and cells per axis of the part of the lattice that the bounds cover.
fn cell_window<const D: usize>(
    lattice: &Lattice<D>,
    bounds: Option<(Vec<f64>, Vec<f64>)>,
) -> ([usize; D], Vec<usize>) {
    let Some((min, max)) = bounds else { return ([0; D], lattice.cells.to_vec()) };
    let clamp = |axis: usize, t: f64| (t.max(0.0) as usize).min(lattice.cells[axis]);
    let low: [usize; D] =
        std::array::from_fn(|a| clamp(a, lattice.scaled(a, min[a]).floor() - 1.0));
    let size = (0..D)
        .map(|a| clamp(a, lattice.scaled(a, max[a]).ceil() + 1.0).saturating_sub(low[a]))
        .collect();
    (low, size)
}

/// Index of `flat` in an array of these counts, first axis fastest.
fn split<const D: usize>(mut flat: usize, counts: &[usize]) -> [usize; D] {
    std::array::from_fn(|axis| {
        let i = flat % counts[axis];
        flat /= counts[axis];
        i
    })
}
