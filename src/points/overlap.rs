//! Do two bodies lie in one place? Their mass would count twice there.
//!
//! A place is shared if both shapes hold it with some margin: bodies that touch, along a face or in
//! a cell, do not overlap.

use crate::deck::model::{Body, BodySource, Deck};
use crate::deck::{Presence, Shape, Side};
use crate::error::{Error, Result};
use crate::grid::Grid;

use super::Points;

/// Margin around a place that counts as shared, and how far out in its domain a point looks, as
/// shares of the domain's half length.
const MARGIN: f64 = 1e-3;
const REACH: f64 = 0.95;

/// An error that names two bodies and a place, found among this rank's points.
pub fn check<const D: usize>(deck: &Deck, grid: &Grid<D>, points: &Points<D>) -> Result<()> {
    let bodies = &deck.bodies;
    if bodies.len() < 2 {
        return Ok(());
    }
    for (index, body) in bodies.iter().enumerate() {
        for (earlier, other) in bodies[..index].iter().enumerate() {
            if !allowed(body, other) && same_source(grid, body, other)? {
                return Err(overlap(deck, earlier, index, "both have the same points".into()));
            }
        }
    }
    let regions: Vec<Option<Region<'_>>> = bodies.iter().map(Region::of).collect();
    for p in 0..points.len() {
        let own = points.body[p] as usize;
        let (x, half) = (&points.position[p], &points.half_length[p]);
        let margin = padded(&half.map(|length| MARGIN * length));
        for (other, region) in regions.iter().enumerate() {
            let Some(region) = region else { continue };
            if other == own || allowed(&bodies[own], &bodies[other]) || region.misses(x, half) {
                continue;
            }
            let place = sample_points(x, half).find(|place| {
                let at = padded(place);
                let held = regions[own]
                    .as_ref()
                    .map_or(place == x, |own| own.shape.side(at, margin) == Side::Inside);
                held && region.shape.side(at, margin) == Side::Inside
            });
            if let Some(place) = place {
                let (first, second) = (own.min(other), own.max(other));
                return Err(overlap(deck, first, second, format!("both hold {place:?} m")));
            }
        }
    }
    Ok(())
}

fn allowed(one: &Body, other: &Body) -> bool {
    one.may_overlap || other.may_overlap || !meet(one.presence, other.presence)
}

/// Whether there is a stage that holds both.
fn meet(one: Presence, other: Presence) -> bool {
    let before = |a: Presence, b: Presence| {
        a.until.is_some_and(|until| b.from.is_some_and(|from| until < from))
    };
    !before(one, other) && !before(other, one)
}

fn overlap(deck: &Deck, first: usize, second: usize, how: String) -> Error {
    let (a, b) = (&deck.bodies[first].name, &deck.bodies[second].name);
    let message = format!(
        "bodies \"{a}\" and \"{b}\" overlap: {how}, where their mass would count twice; cut one \
         out of the other (shape = {{ difference = [...] }}), move it, or say overlap = \"allow\""
    );
    Error::Input(deck.origins.message(&format!("body.{second}.shape"), &message))
}

/// Bodies of one file, or of the same cells of a mesh.
fn same_source<const D: usize>(grid: &Grid<D>, one: &Body, other: &Body) -> Result<bool> {
    match (&one.source, &other.source, grid) {
        (BodySource::File(a), BodySource::File(b), _) => Ok(a.path == b.path
            && (a.of_body == b.of_body || a.of_body.is_none() || b.of_body.is_none())),
        (BodySource::MeshCells { tag: a, .. }, BodySource::MeshCells { tag: b, .. }, grid) => {
            let (Some(a), Some(b), Grid::Mesh(mesh)) = (a, b, grid) else { return Ok(true) };
            let cells = mesh.tagged_cells(a)?;
            Ok(mesh.tagged_cells(b)?.iter().any(|cell| cells.contains(cell)))
        }
        _ => Ok(false),
    }
}

/// The shape of a body with its bounds, m.
struct Region<'a> {
    shape: &'a Shape,
    bounds: Option<(Vec<f64>, Vec<f64>)>,
}

impl<'a> Region<'a> {
    fn of(body: &'a Body) -> Option<Self> {
        match &body.source {
            BodySource::Shape { shape, .. } => Some(Region { shape, bounds: shape.bounds() }),
            BodySource::File(_) | BodySource::MeshCells { .. } => None,
        }
    }

    /// Whether the bounds lie wholly beside a domain.
    fn misses<const D: usize>(&self, x: &[f64; D], half: &[f64; D]) -> bool {
        let Some((low, high)) = &self.bounds else { return false };
        (0..D).any(|a| x[a] + half[a] <= low[a] || high[a] <= x[a] - half[a])
    }
}

/// The middle of a domain and places near its corners.
fn sample_points<const D: usize>(x: &[f64; D], half: &[f64; D]) -> impl Iterator<Item = [f64; D]> {
    let (x, half) = (*x, *half);
    let corner = move |k: usize| -> [f64; D] {
        std::array::from_fn(|a| {
            let sign = if k >> a & 1 == 0 { -REACH } else { REACH };
            x[a] + sign * half[a]
        })
    };
    std::iter::once(x).chain((0..1 << D).map(corner))
}

fn padded<const D: usize>(x: &[f64; D]) -> [f64; 3] {
    std::array::from_fn(|axis| if axis < D { x[axis] } else { 0.0 })
}
