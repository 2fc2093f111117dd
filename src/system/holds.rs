//! Where the elements of a surface were when a support of a later stage came: words of the points that carry them,
//! behind those of contacts ([`crate::points::Points`]' `slip`).

use crate::deck::model::{Held, Symmetry};
use crate::points::Points;
use crate::surface::{Carried, Element};

use super::carried::{area_of, place_of};
use super::model::Model;
use super::supports::Support;

/// Names of the words of a body's points: of each support of a later stage that holds it, of each element that a
/// point may carry, place (m) and area vector (m2).
pub fn names<const D: usize>(model: &Model<D>, body: usize) -> impl Iterator<Item = String> {
    let later = model
        .supports
        .iter()
        .filter(move |support| support.comes.is_some() && body_of(model, support) == Some(body));
    later.flat_map(|support| {
        let words = 2 * D * support.surface.most_carried();
        (0..words).map(|word| name(support, word))
    })
}

fn name<const D: usize>(support: &Support<D>, word: usize) -> String {
    format!("support.{}.{word}", support.boundary)
}

/// The body of whose surface a support holds a part.
fn body_of<const D: usize>(model: &Model<D>, support: &Support<D>) -> Option<usize> {
    match &model.deck.boundaries[support.boundary].support()?.surface {
        Held::Surface(part) => Some(part.body),
        Held::Sheet(_) => None,
    }
}

/// First word of a support in the rows of its points; `None` for one that is there from the start.
pub fn first_word<const D: usize>(
    model: &Model<D>,
    points: &Points<D>,
    support: &Support<D>,
) -> Option<usize> {
    support.comes?;
    let first = name(support, 0);
    points.slip.names().get(body_of(model, support)?)?.iter().position(|name| *name == first)
}

/// Where the `element`th element of a point is held; `first` of [`first_word`].
pub fn held<const D: usize>(
    points: &Points<D>,
    p: usize,
    own: &Carried<D>,
    (first, element): (Option<usize>, usize),
) -> Element<D> {
    let Some(first) = first else { return own.element };
    let words = &points.slip.of(p, points.body[p])[first + 2 * D * element..];
    Element {
        place: std::array::from_fn(|i| words[i]),
        area: std::array::from_fn(|i| words[D + i]),
    }
}

/// As `stage` begins: what its supports hold stays where it is now.
pub fn take<const D: usize>(model: &Model<D>, points: &mut Points<D>, stage: usize) {
    let rings = model.deck.analysis.symmetry == Symmetry::Axisymmetric;
    for support in &model.supports {
        let Some(first) = first_word(model, points, support) else { continue };
        if support.comes.is_none_or(|(comes, _)| comes != stage) {
            continue;
        }
        for p in 0..points.len() {
            for (element, own) in support.surface.carried_by(points.id[p]).iter().enumerate() {
                let place = place_of(points, p, own);
                let area = area_of(points, p, own, &place, rings);
                let body = points.body[p];
                let words = &mut points.slip.of_mut(p, body)[first + 2 * D * element..];
                words[..D].copy_from_slice(&place);
                words[D..2 * D].copy_from_slice(&area);
            }
        }
    }
}
