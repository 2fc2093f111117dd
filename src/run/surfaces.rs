//! Surfaces of a deck at the start: their elements, and the points that carry them.

use std::f64::consts::TAU;

use crate::contact::Contacts;
use crate::deck::Deck;
use crate::deck::model::{AnalysisType, BodySource, BodySurface, Held, Symmetry};
use crate::deck::shape::Shape;
use crate::error::{Error, Result};
use crate::parallel::World;
use crate::points::Points;
use crate::surface::of_shape::{self, Part};
use crate::surface::sheet::Sheet;
use crate::surface::{Element, Surface, carriers};
use crate::system::supports::Support;

/// A part of a body's own surface; `key`: where the deck asks for it. Collective. Error: nothing of the
/// surface belongs to the part.
pub fn of_body<const D: usize>(
    world: &World,
    deck: &Deck,
    points: &Points<D>,
    wanted: &BodySurface,
    key: &str,
) -> Result<Surface<D>> {
    let body = &deck.bodies[wanted.body];
    let wrong = |why: &str| Error::Input(deck.origins.message(key, why));
    let Some(shape) = shape_of(deck, wanted.body) else {
        return Err(wrong(&format!("body \"{}\" is not given as a shape", body.name)));
    };
    let symmetry = deck.analysis.symmetry;
    let spacing = carriers::spacing(world, points, wanted.body, symmetry);
    let part = Part { side: wanted.side, within: wanted.within.as_ref() };
    let elements = turned(of_shape::elements::<D>(shape, part, spacing), symmetry);
    if elements.is_empty() {
        return Err(wrong(&format!(
            "no part of the surface of body \"{}\" is there: side and where leave nothing of it",
            body.name
        )));
    }
    let what = format!("body \"{}\"", body.name);
    let carried = carriers::carried(world, points, wanted.body, &elements, spacing, &what);
    carried.map(Surface::new).map_err(|error| wrong(&error.to_string()))
}

/// Surfaces of the bodies that touch others in implicit runs, one per body; empty without any.
/// Collective.
pub fn facing<const D: usize>(
    world: &World,
    deck: &Deck,
    points: &Points<D>,
    contacts: &Contacts<D>,
) -> Result<Vec<Option<Surface<D>>>> {
    if contacts.body_pairs.is_empty() || deck.analysis.kind == AnalysisType::Explicit {
        return Ok(Vec::new());
    }
    let of_body = |body: usize| {
        let pair = contacts.body_pairs.iter().find(|pair| pair.bodies.contains(&body));
        let wanted = BodySurface { body, side: None, within: None };
        let Some(pair) = pair else { return Ok(None) };
        let key = format!("contact.{}.between", pair.index);
        if shape_of(deck, body).is_some_and(Shape::has_condition) {
            let name = &deck.bodies[body].name;
            let why = format!(
                "the shape of body \"{name}\" has a condition (where), of which no surface is known, \
                 and in implicit runs surfaces touch: describe it by boxes, discs, polygons, ..."
            );
            return Err(Error::Input(deck.origins.message(&key, &why)));
        }
        of_body(world, deck, points, &wanted, &key).map(Some)
    };
    (0..deck.bodies.len()).map(of_body).collect()
}

/// The supports of a deck; `cell`: size of the grid's cells, m. Collective.
pub fn supports<const D: usize>(
    world: &World,
    deck: &Deck,
    points: &Points<D>,
    cell: f64,
) -> Result<Vec<Support<D>>> {
    let mut supports = Vec::new();
    for (index, boundary) in deck.boundaries.iter().enumerate() {
        let Some(wanted) = boundary.support() else { continue };
        let key = format!("boundary.{index}.surface");
        let (surface, within) = match &wanted.surface {
            Held::Surface(part) => (of_body(world, deck, points, part, &key)?, None),
            Held::Sheet(corners) => {
                let sheet = Sheet::new(corners);
                let surface = on_sheet(world, deck, points, &sheet, wanted.slip, &key)?;
                (surface, wanted.slip.then_some(sheet))
            }
        };
        supports.extend(Support::new((index, boundary), surface, within, (cell, &deck.stages)));
    }
    Ok(supports)
}

/// What lies on a line or plane, of all bodies; with `slip` what may slide onto it, too. Collective.
fn on_sheet<const D: usize>(
    world: &World,
    deck: &Deck,
    points: &Points<D>,
    sheet: &Sheet<D>,
    slip: bool,
    key: &str,
) -> Result<Surface<D>> {
    let mut all = Vec::new();
    for body in 0..deck.bodies.len() {
        let Some(shape) = shape_of(deck, body) else { continue };
        let symmetry = deck.analysis.symmetry;
        let spacing = carriers::spacing(world, points, body, symmetry);
        let elements = turned(sheet.elements(shape, spacing, slip), symmetry);
        let what = format!("body \"{}\"", deck.bodies[body].name);
        let carried = carriers::carried(world, points, body, &elements, spacing, &what);
        let carried =
            carried.map_err(|error| Error::Input(deck.origins.message(key, &error.to_string())))?;
        all.extend(carried);
    }
    if !all.iter().any(|(_, own)| sheet.holds(&own.element.place)) {
        let why = "no material of a body given as a shape lies there at the start: what comes later is \
                   not held by it";
        return Err(Error::Input(deck.origins.message(key, why)));
    }
    Ok(Surface::new(all))
}

/// With axisymmetry the areas are those of the whole turn; what lies on the axis has none.
fn turned<const D: usize>(mut elements: Vec<Element<D>>, symmetry: Symmetry) -> Vec<Element<D>> {
    if symmetry == Symmetry::Axisymmetric {
        let furthest = elements.iter().map(|e| e.place[0]).fold(0.0, f64::max);
        elements.retain(|e| e.place[0] > 1e-12 * furthest);
        for Element { place, area } in &mut elements {
            area.iter_mut().for_each(|a| *a *= TAU * place[0]);
        }
    }
    elements
}

fn shape_of(deck: &Deck, body: usize) -> Option<&Shape> {
    match &deck.bodies[body].source {
        BodySource::Shape { shape, .. } => Some(shape),
        _ => None,
    }
}
