//! Boundaries, water, loads and declared terms.

use crate::deck::model::{Boundary, Deck, Held, Place, Support};
use crate::deck::schema::{self, AXES, Kind, SIDES};

use super::problem::presence;
use super::toml_text::{array, axes, body_surface, expression, inline, number, quote, vector};
use super::writer::Writer;

pub(super) fn conditions(w: &mut Writer<'_>, deck: &Deck) {
    for boundary in &deck.boundaries {
        w.table("[[boundary]]");
        w.line("boundary", "name", quote(&boundary.name));
        let place = match &boundary.place {
            Place::Surface(support) => {
                supported(w, deck, boundary, support);
                presence(w, "boundary", boundary.presence, Some(0));
                continue;
            }
            Place::Side { axis, upper } => ("side", quote(SIDES[2 * axis + usize::from(*upper)])),
            Place::Box { min, max } => {
                ("box", inline(&[("min", vector(min)), ("max", vector(max))]))
            }
            Place::Tag(tag) => ("tag", quote(tag)),
            Place::CellsOf { body } => ("cells_of", quote(&deck.bodies[*body].name)),
        };
        w.line("boundary", "where", inline(&[place]));
        w.line("boundary", "fix", axes(&boundary.fix));
        displaced(w, boundary);
        if let Some(rotation) = &boundary.rotation {
            let pairs =
                [("centre", vector(&rotation.centre)), ("degrees", number(rotation.degrees))];
            w.line("boundary", "rotation", inline(&pairs));
        }
        presence(w, "boundary", boundary.presence, Some(0));
    }
    if let Some(water) = deck.water() {
        w.table("[water]");
        w.line("water", "level", number(water.level));
        w.line("water", "unit_weight", number(water.unit_weight));
        w.line("water", "axis", quote(AXES[water.axis]));
    }
    for (load, &when) in deck.loads.iter().zip(&deck.load_presence) {
        // Water has a table of its own.
        let Some((key, value)) = load.written(&deck.bodies) else { continue };
        w.table("[[load]]");
        w.line("load", key, value);
        presence(w, "load", when, Some(0));
    }
    for term in &deck.terms {
        let key = term.key();
        let section = match key.kind {
            Kind::Table(section) | Kind::Tables(section) => section,
            _ => key.name,
        };
        w.table(schema::section(section).header);
        for (key, value) in term.written(&deck.bodies) {
            w.line(section, key, value);
        }
    }
}

/// What holds a surface.
fn supported(w: &mut Writer<'_>, deck: &Deck, boundary: &Boundary, support: &Support) {
    let surface = match &support.surface {
        Held::Surface(surface) => body_surface(&deck.bodies, surface),
        Held::Sheet(corners) => {
            let key = if corners.len() == 2 { "line" } else { "plane" };
            vec![(key, array(corners.iter().map(|x| vector(x))))]
        }
    };
    w.line("boundary", "surface", inline(&surface));
    if !boundary.fix.is_empty() {
        w.line("boundary", "fix", axes(&boundary.fix));
    }
    displaced(w, boundary);
    w.line("boundary", "slip", support.slip.to_string());
    w.line("boundary", "penalty", number(support.penalty));
    w.line("boundary", "method", quote(support.method.name()));
}

fn displaced(w: &mut Writer<'_>, boundary: &Boundary) {
    if boundary.displacement.is_empty() {
        return;
    }
    let pairs: Vec<(&str, String)> =
        boundary.displacement.iter().map(|(axis, e)| (AXES[*axis], expression(e))).collect();
    w.line("boundary", "displacement", inline(&pairs));
}
