//! Boundaries, water and loads.

use crate::deck::model::{BodySurface, Boundary, Deck, Held, Load, Place, Support};
use crate::deck::schema::{AXES, SIDES};

use super::problem::presence;
use super::writer::{Writer, array, axes, expression, expressions, inline, number, quote, vector};

pub(super) fn conditions(w: &mut Writer<'_>, deck: &Deck) {
    for boundary in &deck.boundaries {
        w.table("[[boundary]]");
        w.line("boundary", "name", quote(&boundary.name));
        let place = match &boundary.place {
            Place::Surface(support) => {
                supported(w, deck, boundary, support);
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
        if matches!(load, Load::Water(_)) {
            continue;
        }
        w.table("[[load]]");
        match load {
            Load::Point { body, nearest, force } => {
                let point = inline(&[
                    ("body", quote(&deck.bodies[*body].name)),
                    ("nearest", array(nearest.iter().map(|x| vector(x)))),
                    ("force", expressions(force)),
                ]);
                w.line("load", "point", point);
            }
            Load::Gravity(gravity) => w.line("load", "gravity", expressions(gravity)),
            Load::BodyForce(force) => w.line("load", "body_force", expressions(force)),
            Load::Traction { surface, value } => {
                let mut pairs = body_surface(deck, surface);
                pairs.push(("value", expressions(value)));
                w.line("load", "traction", inline(&pairs));
            }
            Load::SurfacePressure { surface, value } => {
                let surface = inline(&body_surface(deck, surface));
                let pairs = [("value", expression(value)), ("surface", surface)];
                w.line("load", "pressure", inline(&pairs));
            }
            Load::Pressure { value, zone } => {
                let mut pairs = vec![("value", expression(value))];
                if let Some(zone) = zone {
                    let limits = [("min", vector(&zone.min)), ("max", vector(&zone.max))];
                    let mut place = vec![("box", inline(&limits))];
                    place.extend(zone.fade.map(|fade| ("fade", number(fade))));
                    pairs.push(("where", inline(&place)));
                }
                w.line("load", "pressure", inline(&pairs));
            }
            Load::Manufactured(field) => w.line("load", "manufactured", expressions(field)),
            // Has a table of its own.
            Load::Water(_) => {}
        }
        presence(w, "load", when, Some(0));
    }
}

/// What holds a surface.
fn supported(w: &mut Writer<'_>, deck: &Deck, boundary: &Boundary, support: &Support) {
    let surface = match &support.surface {
        Held::Surface(surface) => body_surface(deck, surface),
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

fn body_surface(deck: &Deck, surface: &BodySurface) -> Vec<(&'static str, String)> {
    let mut pairs = vec![("body", quote(&deck.bodies[surface.body].name))];
    if let Some((axis, upper)) = surface.side {
        pairs.push(("side", quote(SIDES[2 * axis + usize::from(upper)])));
    }
    pairs.extend(surface.within.as_ref().map(|within| ("where", quote(within.text()))));
    pairs
}
