//! Deck bodies to material points. Each rank makes an equal share of the candidates, whatever
//! the partition will be; identities depend on the deck alone, so that a run looks the same on
//! any number of ranks.

use crate::deck::model::{Body, BodySource, Deck, Seeding, Symmetry};
use crate::deck::{Scope, Shape};
use crate::error::{Error, Result};
use crate::grid::{Grid, Lattice};

use super::Points;
use super::seed_cells::CellSeeding;
use super::share::{Share, split};
use super::sub_cells::SubCells;

/// Makes this rank's share of all bodies' points, unstrained, with their initial velocity. Beside
/// them the identity of each body's first candidate, the same on every rank.
pub fn seed<const D: usize>(
    deck: &Deck,
    grid: &Grid<D>,
    share: Share,
) -> Result<(Points<D>, Vec<u64>)> {
    let mut points = Points::of_method(&deck.method);
    points.water = deck.water();
    points.counts_anew = deck.stages.iter().any(|stage| stage.reset_displacement);
    let (mut first_id, mut first_ids) = (0u64, Vec::with_capacity(deck.bodies.len()));
    for (index, body) in deck.bodies.iter().enumerate() {
        let made = points.len();
        first_ids.push(first_id);
        let candidates = match (&body.source, grid) {
            (BodySource::File(path), _) => {
                super::file::read_points(&mut points, deck, index, grid, path, share, first_id)?
            }
            (BodySource::Shape { shape, seeding: Seeding::Lattice { spacing, offset } }, _) => {
                let seeded = Seeded { index, body, shape, share, first_id };
                seeded.on_lattice(&mut points, *spacing, offset)?
            }
            (BodySource::Shape { shape, seeding }, Grid::Lattice(lattice)) => {
                let counts = match seeding {
                    Seeding::PerCell(counts) => counts.clone(),
                    Seeding::Gauss(order) => vec![*order; D],
                    Seeding::Lattice { .. } => unreachable!("matched above"),
                };
                let counts = std::array::from_fn(|a| counts[a]);
                let cells = SubCells::new(lattice, counts, shape, deck.method.basis);
                within_lattice(body, shape, &cells, counts, lattice, share)?;
                let seeded = Seeded { index, body, shape, share, first_id };
                seeded.per_cell(&mut points, &cells, counts, lattice)
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
        // A file's volumes are those of the whole turn.
        if deck.analysis.symmetry == Symmetry::Axisymmetric
            && !matches!(body.source, BodySource::File(_))
        {
            points.make_rings(made);
        }
        // A file may have velocities of its own.
        if !matches!(body.source, BodySource::File(_)) || moves(body) {
            set_velocity(&mut points, made, body);
        }
    }
    Ok((points, first_ids))
}

/// Makes any points of the bodies that are seeded cell by cell on a mesh.
pub struct CellByCell<'a, const D: usize> {
    symmetry: Symmetry,
    bodies: Vec<Option<CellSeeding<'a, D>>>,
    first_ids: Vec<u64>,
}

impl<'a, const D: usize> CellByCell<'a, D> {
    /// `first_ids`: see [`seed`].
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
        Ok(CellByCell { symmetry: deck.analysis.symmetry, bodies, first_ids })
    }

    /// Bodies of the deck.
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
            if self.symmetry == Symmetry::Axisymmetric {
                points.make_rings(made);
            }
            set_velocity(points, made, cells.body);
        }
    }
}

/// An error where the body reaches beyond the lattice (as far again on each side): part of it
/// would be missing. A shape without bounds ends at the lattice.
fn within_lattice<const D: usize>(
    body: &Body,
    shape: &Shape,
    sub_cells: &SubCells<'_, D>,
    counts: [usize; D],
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
            if let Some(x) = sub_cells.inside(&sub_cell(cell, sub, counts)) {
                let end: [f64; D] = std::array::from_fn(|a| lattice.end(a));
                let longest = |side: &dyn Fn(usize) -> f64| (0..D).map(side).fold(0.0, f64::max);
                let slip = crate::deck::of_length(
                    longest(&|a| max[a] - min[a]),
                    longest(&|a| end[a] - lattice.origin[a]),
                );
                let slip = if slip.is_empty() { slip } else { format!(";\n    {slip}") };
                return Err(Error::Input(format!(
                    "body \"{}\" reaches outside the grid: its shape holds {x:?}, the grid goes \
                     from {:?} to {end:?}; enlarge the grid, or move or cut the body{slip}",
                    body.name, lattice.origin
                )));
            }
        }
    }
    Ok(())
}

/// Index among all sub-cells of the `sub`th of a cell.
fn sub_cell<const D: usize>(cell: [isize; D], sub: usize, counts: [usize; D]) -> [isize; D] {
    let part: [usize; D] = split(sub, &counts);
    std::array::from_fn(|a| cell[a] * counts[a] as isize + part[a] as isize)
}

/// Places of a lattice are numbered by values that are exact as 64-bit floats, too.
const MOST_PLACES: f64 = (1_u64 << 53) as f64;

/// A body whose shape is filled with points.
struct Seeded<'a> {
    /// Among the deck's bodies.
    index: usize,
    body: &'a Body,
    shape: &'a Shape,
    share: Share,
    /// Identity of its first candidate.
    first_id: u64,
}

impl Seeded<'_> {
    /// A point for each sub-cell that the shape covers ([`SubCells`]). Returns the number of
    /// candidates.
    fn per_cell<const D: usize>(
        &self,
        points: &mut Points<D>,
        sub_cells: &SubCells<'_, D>,
        counts: [usize; D],
        lattice: &Lattice<D>,
    ) -> u64 {
        let &Seeded { index, body, shape, share, first_id } = self;
        let (low, size) = cell_window(lattice, shape.bounds());
        let cells: usize = size.iter().product();
        let at = |place: &[f64; D]| -> [f64; D] {
            std::array::from_fn(|a| {
                lattice.origin[a] + lattice.spacing[a] * (low[a] as f64 + place[a])
            })
        };
        let per_cell: usize = counts.iter().product();
        share.of_box(size, |place| shape.contains(&at(place))).for_each(|candidate, cell| {
            let cell = std::array::from_fn(|a| (low[a] + cell[a]) as isize);
            for sub in 0..per_cell {
                if let Some(made) = sub_cells.point(&sub_cell(cell, sub, counts)) {
                    let id = first_id + (candidate * per_cell + sub) as u64;
                    let (x, half) = (made.position, made.half_length);
                    points.push_unstrained(id, index as u32, x, made.volume, body.density, half);
                    *points.outermost.last_mut().expect("a point was just pushed") =
                        f64::from(u8::from(made.outermost));
                }
            }
        });
        (cells * per_cell) as u64
    }

    /// Points at offset + (i, j, k) spacing in the shape's frame, kept where they are inside.
    fn on_lattice<const D: usize>(
        &self,
        points: &mut Points<D>,
        spacing: f64,
        offset: &[f64],
    ) -> Result<u64> {
        let &Seeded { index, body, shape, share, first_id } = self;
        let Some((min, max)) = shape.local_bounds() else {
            return Err(Error::Input(format!(
                "body \"{}\" is unbounded and seeded by a lattice of spacing {spacing}; intersect it \
             with a box, or use points_per_cell",
                body.name
            )));
        };
        let place = |x: f64, axis: usize| (x - offset[axis]) / spacing;
        let places: f64 = (0..D).map(|a| place(max[a], a) - place(min[a], a) + 4.0).product();
        let far = (0..D).map(|a| place(min[a], a).abs().max(place(max[a], a).abs()));
        if !(far.fold(places, f64::max) < MOST_PLACES) {
            return Err(Error::Input(format!(
                "body \"{}\": a lattice of spacing {spacing} over its shape, from {min:?} to {max:?}, \
             has more places than can be numbered; make the shape smaller or the spacing larger",
                body.name
            )));
        }
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

/// Whether the deck gives the body a velocity.
fn moves(body: &Body) -> bool {
    body.velocity.iter().any(|component| component.as_constant() != Some(0.0))
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
        if points.affine {
            points.velocity_gradient[p] = mean_gradient(body, &scope, &points.half_length[p]);
        }
    }
}

/// Mean of ∂v_i/∂x_j over the inner half of a point's domain, 1/s: exact for a velocity of second
/// degree, and bounded for one that jumps from domain to domain.
fn mean_gradient<const D: usize>(body: &Body, at: &Scope, half: &[f64; D]) -> [[f64; D]; D] {
    let mut gradient = [[0.0; D]; D];
    for j in 0..D {
        let side = |sign: f64, i: usize| {
            let mut scope = *at;
            scope.initial[j] += 0.5 * sign * half[j];
            scope.current = scope.initial;
            (scope.initial[j], body.velocity[i].value(&scope))
        };
        for (i, row) in gradient.iter_mut().enumerate() {
            let ((low, before), (high, after)) = (side(-1.0, i), side(1.0, i));
            row[j] = (after - before) / (high - low);
        }
    }
    gradient
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
