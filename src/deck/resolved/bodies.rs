//! Materials, bodies and their shapes.

use crate::deck::model::{BodySource, Deck, InitialStress, Material, Seeding};
use crate::deck::schema::AXES;
use crate::deck::shape::{Form, Shape};
use crate::deck::solid::Solid;

use super::problem::presence;
use super::toml_text::{array, counts, expression, expressions, inline, number, quote, vector};
use super::writer::Writer;

pub(super) fn materials_and_bodies(w: &mut Writer<'_>, deck: &Deck) {
    for material in &deck.materials {
        w.table(&format!("[material.{}]", quote(&material.name)));
        material_keys(w, material);
    }
    for body in &deck.bodies {
        w.table("[[body]]");
        w.line("body", "name", quote(&body.name));
        w.line("body", "material", quote(&deck.materials[body.material].name));
        w.line("body", "density", number(body.density));
        let seeding = match &body.source {
            BodySource::Shape { shape: region, seeding } => {
                w.line("body", "shape", shape(region));
                Some(seeding)
            }
            BodySource::File(file) => {
                let mut pairs = vec![("points", quote(&file.path.display().to_string()))];
                pairs.extend(file.of_body.map(|number| ("of_body", number.to_string())));
                if file.names.any() {
                    let names = file.names.pairs().into_iter();
                    let names: Vec<_> = names.map(|(key, name)| (key, quote(name))).collect();
                    pairs.push(("names", inline(&names)));
                }
                w.line("body", "shape", inline(&pairs));
                None
            }
            BodySource::MeshCells { tag, seeding } => {
                let tag = quote(tag.as_deref().unwrap_or("all"));
                w.line("body", "shape", inline(&[("cells", tag)]));
                Some(seeding)
            }
        };
        match seeding {
            Some(Seeding::PerCell(per_axis)) => {
                w.line("body", "points_per_cell", counts(per_axis));
            }
            Some(Seeding::Lattice { spacing, offset }) => {
                let pairs = [("spacing", number(*spacing)), ("offset", vector(offset))];
                w.line("body", "lattice", inline(&pairs));
            }
            Some(Seeding::Gauss(points)) => w.line("body", "gauss", points.to_string()),
            None => {}
        }
        w.line("body", "velocity", expressions(&body.velocity));
        w.line("body", "overlap", quote(if body.may_overlap { "allow" } else { "refuse" }));
        w.optional("body", "initial_stress", body.initial_stress.as_ref().map(initial_stress));
        presence(w, "body", body.presence, None);
    }
}

/// Model and parameters, those of inner tables together.
fn material_keys(w: &mut Writer, material: &Material) {
    w.line("material", "model", quote(material.model.name));
    let mut tables: Vec<(&str, Vec<(&str, String)>)> = Vec::new();
    for (parameter, value) in material.model.parameters.iter().zip(&material.parameters) {
        let Some(value) = value else { continue };
        let text = match (value.as_constant(), parameter.words) {
            (Some(place), words) if !words.is_empty() => quote(words[place as usize]),
            (Some(value), _) => number(value),
            (None, _) => quote(value.text()),
        };
        match parameter.split() {
            (None, key) => w.line("material", key, text),
            (Some(table), key) => match tables.iter_mut().find(|(known, _)| *known == table) {
                Some((_, pairs)) => pairs.push((key, text)),
                None => tables.push((table, vec![(key, text)])),
            },
        }
    }
    for (table, pairs) in tables {
        w.line("material", table, inline(&pairs));
    }
}

fn initial_stress(stress: &InitialStress) -> String {
    match stress {
        InitialStress::Components(all) => {
            let names = ["xx", "yy", "zz", "xy", "yz", "xz"].into_iter().zip(all.iter());
            let given = names.filter(|(_, value)| value.as_constant() != Some(0.0));
            let mut pairs: Vec<_> = given.map(|(name, value)| (name, expression(value))).collect();
            if pairs.is_empty() {
                pairs.push(("xx", number(0.0)));
            }
            inline(&pairs)
        }
        InitialStress::K0(k0) => {
            let mut pairs = vec![
                ("unit_weight", expression(&k0.unit_weight)),
                ("surface", expression(&k0.surface)),
                ("k0", expression(&k0.k0)),
            ];
            pairs.extend(k0.surcharge.as_ref().map(|value| ("surcharge", expression(value))));
            pairs.push(("axis", quote(AXES[k0.axis])));
            inline(&pairs)
        }
    }
}

/// What the lengths of an STL file were multiplied by.
pub(super) fn solid_scale(solid: &Solid) -> Option<(&'static str, String)> {
    (solid.scale != 1.0).then(|| ("scale", number(solid.scale)))
}

fn shape(region: &Shape) -> String {
    let set = |parts: &[Shape]| array(parts.iter().map(shape));
    let mut pairs = vec![match &region.form {
        Form::Box { min, max } => ("box", inline(&[("min", vector(min)), ("max", vector(max))])),
        Form::Ball { centre, radius } => {
            ("disc", inline(&[("centre", vector(centre)), ("radius", number(*radius))]))
        }
        Form::Ellipsoid { centre, semi_axes } => {
            ("ellipse", inline(&[("centre", vector(centre)), ("semi_axes", vector(semi_axes))]))
        }
        Form::Capsule { from, to, radius } => (
            "capsule",
            inline(&[("from", vector(from)), ("to", vector(to)), ("radius", number(*radius))]),
        ),
        Form::Polygon { vertices } => {
            ("polygon", inline(&[("vertices", array(vertices.iter().map(|v| vector(v))))]))
        }
        Form::Solid(solid) => {
            let path = quote(&solid.path.display().to_string());
            match solid.bottom {
                None => ("stl", path),
                Some(bottom) => ("terrain", inline(&[("file", path), ("bottom", number(bottom))])),
            }
        }
        Form::Where(condition) => ("where", quote(condition.text())),
        Form::Union(parts) => ("union", set(parts)),
        Form::Intersection(parts) => ("intersection", set(parts)),
        Form::Difference(parts) => ("difference", set(parts)),
    }];
    if let Form::Solid(solid) = &region.form {
        pairs.extend(solid_scale(solid));
    }
    if let Some(turn) = &region.placement.rotate {
        let mut rotate = vec![("degrees", number(turn.degrees)), ("about", vector(&turn.about))];
        if turn.about.len() == 3 {
            rotate.push(("axis", vector(&turn.axis)));
        }
        pairs.push(("rotate", inline(&rotate)));
    }
    if !region.placement.translate.is_empty() {
        pairs.push(("translate", vector(&region.placement.translate)));
    }
    inline(&pairs)
}
