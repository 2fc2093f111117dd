//! Rigid bodies and contacts.

use crate::deck::model::{AnalysisType, Deck, Friction, Partner, RigidMotion, RigidShape};

use super::bodies::solid_scale;
use super::problem::presence;
use super::toml_text::{array, expression, expressions, inline, number, quote, vector};
use super::writer::Writer;

pub(super) fn contact(w: &mut Writer<'_>, deck: &Deck) {
    for rigid in &deck.rigids {
        w.table("[[rigid]]");
        w.line("rigid", "name", quote(&rigid.name));
        w.line("rigid", "shape", inline(&rigid_shape(&rigid.shape)));
        let RigidMotion { displacement, velocity, rotation } = &rigid.motion;
        let mut pairs = Vec::new();
        for (key, all) in [("displacement", displacement), ("velocity", velocity)] {
            if !all.is_empty() {
                pairs.push((key, expressions(all)));
            }
        }
        if let Some(rotation) = rotation {
            let mut turn = vec![
                ("centre", vector(&rotation.centre)),
                ("degrees", expression(&rotation.degrees)),
            ];
            if deck.dimension == 3 {
                turn.push(("axis", vector(&rotation.axis)));
            }
            pairs.push(("rotation", inline(&turn)));
        }
        if !pairs.is_empty() {
            w.line("rigid", "motion", inline(&pairs));
        }
        if let Some(free) = &rigid.free {
            w.line("rigid", "density", number(free.density));
            w.line("rigid", "velocity", vector(&free.velocity));
        }
        presence(w, "rigid", rigid.presence, Some(0));
    }
    for contact in &deck.contacts {
        w.table("[[contact]]");
        w.line("contact", "name", quote(&contact.name));
        let body = &deck.bodies[contact.body].name;
        let names = match contact.partner {
            Partner::Rigid(rigid) => [&deck.rigids[rigid].name, body],
            Partner::Body(other) => [body, &deck.bodies[other].name],
        };
        w.line("contact", "between", array(names.map(|name| quote(name))));
        let friction = match contact.friction {
            Friction::Coulomb(coefficient) => number(coefficient),
            Friction::Rough => quote("rough"),
        };
        w.line("contact", "friction", friction);
        w.line("contact", "adhesion", number(contact.adhesion));
        w.optional("contact", "max_shear", contact.max_shear.map(number));
        let implicit = deck.analysis.kind != AnalysisType::Explicit;
        if implicit || matches!(contact.partner, Partner::Rigid(_)) {
            w.line("contact", "penalty", number(contact.penalty));
        }
        presence(w, "contact", contact.presence, Some(0));
    }
}

fn rigid_shape(shape: &RigidShape) -> Vec<(&'static str, String)> {
    let form = match shape {
        RigidShape::HalfSpace { point, normal } => {
            ("half_space", inline(&[("point", vector(point)), ("normal", vector(normal))]))
        }
        RigidShape::Ball { centre, radius } => {
            ("disc", inline(&[("centre", vector(centre)), ("radius", number(*radius))]))
        }
        RigidShape::Box { min, max } => {
            ("box", inline(&[("min", vector(min)), ("max", vector(max))]))
        }
        RigidShape::Capsule { from, to, radius } => (
            "capsule",
            inline(&[("from", vector(from)), ("to", vector(to)), ("radius", number(*radius))]),
        ),
        RigidShape::Solid(solid) => ("stl", quote(&solid.path.display().to_string())),
        RigidShape::Polygon { corners } => ("polygon", array(corners.iter().map(|x| vector(x)))),
        RigidShape::Cone { tip, axis, angle, radius, shaft } => (
            "cone",
            inline(&[
                ("tip", vector(tip)),
                ("axis", vector(axis)),
                ("angle", number(*angle)),
                ("radius", number(*radius)),
                ("shaft", number(*shaft)),
            ]),
        ),
    };
    let mut pairs = vec![form];
    if let RigidShape::Solid(solid) = shape {
        pairs.extend(solid_scale(solid));
    }
    pairs
}
