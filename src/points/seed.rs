//! Deck bodies to material points. Each rank makes an equal share of the candidates, whatever
//! the partition will be; identities depend on the deck alone, so that a run looks the same on
//! any number of ranks.

use std::ops::Range;

use crate::deck::model::{Basis, Body, BodySource, Deck, Seeding};
use crate::deck::{Scope, Shape};
use crate::error::{Error, Result};
use crate::grid::quadrature::SubCell;
use crate::grid::{Grid, Lattice, Mesh};

use super::{Points, rectangle_corners};

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

    /// This rank's part of a box of `size` candidates: about as many inside the shape as on any
    /// other rank, and in slices across the longest axis, as parts of the body will mostly be, so
    /// that few points have to change rank. `inside` tells of a place in units of candidates.
    fn of_box<const D: usize>(
        &self,
        size: [usize; D],
        inside: impl Fn(&[f64; D]) -> bool,
    ) -> Slice<D> {
        let count: usize = size.iter().product();
        let axis = (0..D).max_by_key(|&a| size[a]).unwrap_or(0);
        if self.ranks == 1 || count == 0 {
            return Slice { size, axis, range: 0..count };
        }
        // Points in the slices before each of these, by a coarse sample: on all ranks the same.
        let mut before = vec![0.0];
        let across = SAMPLES_ACROSS.pow(D as u32 - 1);
        for slice in 0..SLICES {
            let found = (0..across).filter(|&sample| {
                let mut rest = sample;
                inside(&std::array::from_fn(|a| {
                    let at = if a == axis {
                        (slice as f64 + 0.5) / SLICES as f64
                    } else {
                        let place = rest % SAMPLES_ACROSS;
                        rest /= SAMPLES_ACROSS;
                        (place as f64 + 0.5) / SAMPLES_ACROSS as f64
                    };
                    at * size[a] as f64
                }))
            });
            // A body too thin for the samples is somewhere, too.
            before.push(before[slice] + found.count() as f64 + 1e-3);
        }
        let start = |rank: usize| {
            let goal = before[SLICES] * rank as f64 / self.ranks as f64;
            let slice = before.partition_point(|&sum| sum <= goal).clamp(1, SLICES) - 1;
            let part = (goal - before[slice]) / (before[slice + 1] - before[slice]);
            let place = ((slice as f64 + part) / SLICES as f64 * count as f64) as usize;
            if rank == self.ranks { count } else { place.min(count) }
        };
        Slice { size, axis, range: start(self.rank)..start(self.rank + 1) }
    }
}

/// Slices of a sample of a shape, and samples along each axis of one of them.
const SLICES: usize = 64;
const SAMPLES_ACROSS: usize = 16;

/// Candidates that follow each other where those along `axis` differ slowest.
struct Slice<const D: usize> {
    size: [usize; D],
    axis: usize,
    range: Range<usize>,
}

impl<const D: usize> Slice<D> {
    /// Calls `visit` with number and index of each, in ascending order of the number, which counts
    /// with the first axis fastest.
    fn for_each(&self, mut visit: impl FnMut(usize, [usize; D])) {
        let Slice { size, axis, range } = self;
        let layer: usize = size.iter().product::<usize>() / size[*axis].max(1);
        if range.is_empty() {
            return;
        }
        let first = range.start / layer;
        let mut within = *size;
        within[*axis] = (range.end - 1) / layer + 1 - first;
        for k in 0..within.iter().product() {
            let mut at: [usize; D] = split(k, &within);
            at[*axis] += first;
            let number = (0..D).rev().fold(0, |flat, a| flat * size[a] + at[a]);
            let others = (0..D).rev().filter(|a| a != axis);
            let place = others.fold(at[*axis], |flat, a| flat * size[a] + at[a]);
            if range.contains(&place) {
                visit(number, at);
            }
        }
    }
}

/// Makes this rank's share of all bodies' points, unstrained, with their initial velocity. Beside
/// them the identity of each body's first candidate, the same on every rank.
pub fn seed<const D: usize>(
    deck: &Deck,
    grid: &Grid<D>,
    share: Share,
) -> Result<(Points<D>, Vec<u64>)> {
    let mut points = Points::of_basis(deck.method.basis);
    let (mut first_id, mut first_ids) = (0u64, Vec::with_capacity(deck.bodies.len()));
    for (index, body) in deck.bodies.iter().enumerate() {
        let made = points.len();
        first_ids.push(first_id);
        let candidates = match (&body.source, grid) {
            (BodySource::File(path), _) => {
                super::file::read_points(&mut points, index, body, path, share, first_id)?
            }
            (BodySource::Shape { shape, seeding: Seeding::Lattice { spacing, offset } }, _) => {
                on_lattice(&mut points, index, body, shape, *spacing, offset, share, first_id)?
            }
            (BodySource::Shape { shape, seeding }, Grid::Lattice(lattice)) => {
                let counts = match seeding {
                    Seeding::PerCell(counts) => counts.clone(),
                    Seeding::Gauss(order) => vec![*order; D],
                    Seeding::Lattice { .. } => unreachable!("matched above"),
                };
                within_lattice(body, shape, &counts, lattice, share)?;
                per_cell(&mut points, index, body, shape, &counts, lattice, share, first_id)
            }
            (BodySource::Shape { seeding, .. }, Grid::Mesh(mesh))
            | (BodySource::MeshCells { seeding, .. }, Grid::Mesh(mesh)) => {
                let cells = CellSeeding::new(deck, mesh, index, seeding)?;
                cells.run(&mut points, share, |_| true, first_id);
                cells.candidates()
            }
            (BodySource::MeshCells { .. }, Grid::Lattice(_)) => {
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
    Ok((points, first_ids))
}

/// Makes any points of the bodies that are seeded cell by cell on a mesh.
pub struct CellByCell<'a, const D: usize> {
    bodies: Vec<Option<CellSeeding<'a, D>>>,
    first_ids: Vec<u64>,
}

impl<'a, const D: usize> CellByCell<'a, D> {
    /// `first_ids` as [`seed`] tells.
    pub fn new(deck: &'a Deck, grid: &'a Grid<D>, first_ids: Vec<u64>) -> Result<Self> {
        let of = |(index, body): (usize, &'a Body)| match (&body.source, grid) {
            (BodySource::Shape { seeding: Seeding::Lattice { .. }, .. }, _)
            | (BodySource::File(_), _)
            | (_, Grid::Lattice(_)) => Ok(None),
            (BodySource::Shape { seeding, .. }, Grid::Mesh(mesh))
            | (BodySource::MeshCells { seeding, .. }, Grid::Mesh(mesh)) => {
                CellSeeding::new(deck, mesh, index, seeding).map(Some)
            }
        };
        let bodies = deck.bodies.iter().enumerate().map(of).collect::<Result<_>>()?;
        Ok(CellByCell { bodies, first_ids })
    }

    pub fn bodies(&self) -> usize {
        self.bodies.len()
    }

    /// Whether it makes the points of a body.
    pub fn makes(&self, body: usize) -> bool {
        self.bodies[body].is_some()
    }

    /// Appends the points of a body that [`seed`] makes for `share` in the cells that are
    /// `wanted`, in its order.
    pub fn append(
        &self,
        points: &mut Points<D>,
        body: usize,
        share: Share,
        wanted: impl Fn(usize) -> bool,
    ) {
        if let Some(cells) = &self.bodies[body] {
            let made = points.len();
            cells.run(points, share, wanted, self.first_ids[body]);
            set_velocity(points, made, cells.body);
        }
    }
}

/// An error where the seeding, carried on beyond the lattice (as far again on each side), would
/// put a point: part of the body would be missing. A shape without bounds ends at the lattice.
fn within_lattice<const D: usize>(
    body: &Body,
    shape: &Shape,
    counts: &[usize],
    lattice: &Lattice<D>,
    share: Share,
) -> Result<()> {
    let Some((min, max)) = shape.bounds() else { return Ok(()) };
    let cells: [isize; D] = lattice.cells.map(|n| n as isize);
    let low: [isize; D] =
        std::array::from_fn(|a| (lattice.scaled(a, min[a]).floor() as isize).max(-cells[a]));
    let high: [isize; D] =
        std::array::from_fn(|a| (lattice.scaled(a, max[a]).ceil() as isize).min(2 * cells[a]));
    if (0..D).all(|a| low[a] >= 0 && high[a] <= cells[a]) {
        return Ok(());
    }
    let size: Vec<usize> = (0..D).map(|a| (high[a] - low[a]).max(0) as usize).collect();
    let per_cell: usize = counts.iter().product();
    for candidate in share.of(size.iter().product()) {
        let at: [usize; D] = split(candidate, &size);
        let cell: [isize; D] = std::array::from_fn(|a| low[a] + at[a] as isize);
        if (0..D).all(|a| (0..cells[a]).contains(&cell[a])) {
            continue;
        }
        for sub in 0..per_cell {
            let part: [usize; D] = split(sub, counts);
            let x: [f64; D] = std::array::from_fn(|a| {
                let along = cell[a] as f64 + (part[a] as f64 + 0.5) / counts[a] as f64;
                lattice.origin[a] + lattice.spacing[a] * along
            });
            if shape.contains(&x) {
                let end: [f64; D] = std::array::from_fn(|a| {
                    lattice.origin[a] + lattice.spacing[a] * cells[a] as f64
                });
                return Err(Error::Input(format!(
                    "body \"{}\" reaches outside the grid: its shape holds {x:?}, the grid goes \
                     from {:?} to {end:?}; enlarge the grid, or move or cut the body",
                    body.name, lattice.origin
                )));
            }
        }
    }
    Ok(())
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
    let at = |place: &[f64; D]| -> [f64; D] {
        std::array::from_fn(|a| lattice.origin[a] + lattice.spacing[a] * (low[a] as f64 + place[a]))
    };
    let per_cell: usize = counts.iter().product();
    let half: [f64; D] = std::array::from_fn(|a| 0.5 * lattice.spacing[a] / counts[a] as f64);
    let volume = half.iter().map(|l| 2.0 * l).product();
    share.of_box(size, |place| shape.contains(&at(place))).for_each(|candidate, cell| {
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
                mark_outermost(points, |neighbour| shape.contains(neighbour), &x, &half);
            }
        }
    });
    (cells * per_cell) as u64
}

/// Sub-cells or Gauss points of mesh cells. A mesh body has no outermost layer: its boundary is
/// the mesh's own.
struct CellSeeding<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    index: usize,
    body: &'a Body,
    seeding: &'a Seeding,
    /// Where in these cells; everywhere without a shape.
    shape: Option<&'a Shape>,
    cells: Vec<usize>,
    at_centroid: bool,
}

impl<'a, const D: usize> CellSeeding<'a, D> {
    fn new(
        deck: &'a Deck,
        mesh: &'a Mesh<D>,
        index: usize,
        seeding: &'a Seeding,
    ) -> Result<CellSeeding<'a, D>> {
        let body = &deck.bodies[index];
        let (shape, tag) = match &body.source {
            BodySource::Shape { shape, .. } => (Some(shape), None),
            BodySource::MeshCells { tag, .. } => (None, tag.as_deref()),
            BodySource::File(_) => unreachable!("a file tells where its points are"),
        };
        let cells = match tag {
            Some(tag) => mesh.tagged_cells(tag)?,
            None => (0..mesh.cell_count()).collect(),
        };
        // The position of a CPDI2 point is the centroid of its domain; others sit where their
        // sub-cell's centre maps to.
        let at_centroid = deck.method.basis == Basis::Cpdi2;
        Ok(CellSeeding { mesh, index, body, seeding, shape, cells, at_centroid })
    }

    /// Room for the candidates of a cell: no element makes more than six times n^D sub-cells.
    fn per_cell(&self) -> usize {
        let n = match self.seeding {
            Seeding::PerCell(counts) => counts.iter().copied().max().unwrap_or(1),
            Seeding::Gauss(order) => *order,
            Seeding::Lattice { .. } => unreachable!("a lattice of points is seeded by its shape"),
        };
        6 * n.pow(D as u32)
    }

    fn candidates(&self) -> u64 {
        (self.cells.len() * self.per_cell()) as u64
    }

    /// Makes the points that are inside, in the cells of the share that are wanted.
    fn run(
        &self,
        points: &mut Points<D>,
        share: Share,
        wanted: impl Fn(usize) -> bool,
        first_id: u64,
    ) {
        let per_cell = self.per_cell();
        let candidates =
            || share.of(self.cells.len()).filter(|&candidate| wanted(self.cells[candidate]));
        let mut made = Vec::new();
        if let (None, Some(first)) = (self.shape, candidates().next()) {
            // All cells make as many.
            self.split(self.cells[first], &mut made);
            points.reserve(candidates().count() * made.len());
        }
        for candidate in candidates() {
            made.clear();
            self.split(self.cells[candidate], &mut made);
            for (sub, part) in made.iter().enumerate() {
                let x = if self.at_centroid { part.centroid } else { part.position };
                if self.shape.is_some_and(|shape| !shape.contains(&x)) {
                    continue;
                }
                let half = [0.5 * part.volume.powf(1.0 / D as f64); D];
                let (id, density) =
                    (first_id + (candidate * per_cell + sub) as u64, self.body.density);
                points.push_unstrained(id, self.index as u32, x, part.volume, density, half);
                if let Some(corners) = points.corners.last_mut() {
                    *corners = part.corners;
                }
            }
        }
    }

    fn split(&self, cell: usize, out: &mut Vec<SubCell<D>>) {
        match self.seeding {
            Seeding::PerCell(counts) => {
                self.mesh.sub_cells(cell, std::array::from_fn(|a| counts[a]), out);
            }
            Seeding::Gauss(order) => {
                let mut gauss = Vec::new();
                self.mesh.gauss_points(cell, *order, &mut gauss);
                out.extend(gauss.into_iter().map(|(position, volume)| {
                    let half = [0.5 * volume.powf(1.0 / D as f64); D];
                    let corners = rectangle_corners(position, half);
                    SubCell { position, centroid: position, volume, corners }
                }));
            }
            Seeding::Lattice { .. } => {}
        }
    }
}

/// Points at offset + (i, j, k) spacing in the shape's frame, kept where they are inside.
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
    let size: [usize; D] = std::array::from_fn(|a| {
        (((max[a] - offset[a]) / spacing).ceil() as i64 + 2 - low[a]) as usize
    });
    let candidates: usize = size.iter().product();
    let half = [0.5 * spacing; D];
    let volume = spacing.powi(D as i32);
    let inside = |place: &[f64; D]| {
        let local: [f64; D] =
            std::array::from_fn(|a| offset[a] + (low[a] as f64 + place[a]) * spacing);
        shape.contains_local(&local)
    };
    share.of_box(size, inside).for_each(|candidate, at| {
        let local: [f64; D] =
            std::array::from_fn(|a| offset[a] + (low[a] + at[a] as i64) as f64 * spacing);
        if shape.contains_local(&local) {
            let placed = shape.to_global(&local);
            let x = std::array::from_fn(|a| placed[a]);
            let id = first_id + candidate as u64;
            points.push_unstrained(id, index as u32, x, volume, body.density, half);
            mark_outermost(points, |neighbour| shape.contains_local(neighbour), &local, &half);
        }
    });
    Ok(candidates as u64)
}

/// A point is outermost if a neighbour of its seeding would lie outside the shape.
fn mark_outermost<const D: usize>(
    points: &mut Points<D>,
    contains: impl Fn(&[f64]) -> bool,
    x: &[f64; D],
    half: &[f64; D],
) {
    let outermost = (0..D).any(|axis| {
        [-2.0, 2.0].iter().any(|step| {
            let mut neighbour = *x;
            neighbour[axis] += step * half[axis];
            !contains(&neighbour)
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
) -> ([usize; D], [usize; D]) {
    let Some((min, max)) = bounds else { return ([0; D], lattice.cells) };
    let clamp = |axis: usize, t: f64| (t.max(0.0) as usize).min(lattice.cells[axis]);
    let low: [usize; D] =
        std::array::from_fn(|a| clamp(a, lattice.scaled(a, min[a]).floor() - 1.0));
    let size = std::array::from_fn(|a| {
        clamp(a, lattice.scaled(a, max[a]).ceil() + 1.0).saturating_sub(low[a])
    });
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_are_about_equal_and_leave_nothing_out() {
        // A quarter of an ellipse in a window with room to spare.
        let inside = |x: &[f64; 2]| (x[0] / 80.0).powi(2) + (x[1] / 40.0).powi(2) <= 1.0;
        let size = [90, 45];
        for ranks in [1, 2, 7, 500] {
            let (mut met, mut kept) = (vec![0; 90 * 45], Vec::new());
            for rank in 0..ranks {
                let (mut last, mut own) = (None, 0);
                Share { rank, ranks }.of_box(size, inside).for_each(|number, at| {
                    assert_eq!(number, at[0] + 90 * at[1]);
                    assert!(last < Some(number));
                    last = Some(number);
                    met[number] += 1;
                    own += usize::from(inside(&at.map(|i| i as f64 + 0.5)));
                });
                kept.push(own);
            }
            assert!(met.iter().all(|&times| times == 1), "{ranks} ranks");
            let mean = kept.iter().sum::<usize>() as f64 / ranks as f64;
            let largest = kept.iter().copied().fold(0, usize::max) as f64;
            // Half a layer more or less, where a rank has less than one.
            assert!(largest < 1.1 * mean + 10.0, "{ranks} ranks: {largest}, mean {mean}");
        }
        let empty = Share { rank: 1, ranks: 3 }.of_box([0, 4, 5], |_| true);
        empty.for_each(|_, _| panic!("there is nothing"));
    }
}
