//! The deck with every default, as TOML that reads back to the same deck.

use super::expression::Expression;
use super::model::{
    BodySource, BodySurface, Boundary, Deck, ElementTest, Every, Friction, Grid, Held,
    InitialStress, Load, Material, MeshMotion, MeshSource, Place, RigidMotion, RigidShape, Seeding,
    Spot, Support,
};
use super::schema::{self, AXES, SIDES};
use super::shape::{Form, Shape};
use super::stage::Presence;
use super::unread::is_read;

/// TOML of `deck` with all defaults. Relative paths have become absolute ones.
pub fn resolved(deck: &Deck) -> String {
    let mut w = Writer { deck, text: String::new() };
    w.line("", "title", quote(&deck.title));
    // A key of the top level stands before the first table.
    if deck.ghost.is_none() {
        w.line("", "ghost", quote("off"));
    }
    analysis(&mut w, deck);
    if deck.element_test.is_none() {
        stages(&mut w, deck);
        grid(&mut w, deck);
    }
    materials_and_bodies(&mut w, deck);
    if let Some(test) = &deck.element_test {
        element_test(&mut w, deck, test);
        return w.text;
    }
    conditions(&mut w, deck);
    contact(&mut w, deck);
    results(&mut w, deck);
    w.text
}

struct Writer<'a> {
    deck: &'a Deck,
    text: String,
}

impl Writer<'_> {
    fn table(&mut self, header: &str) {
        self.text.push_str(&format!("\n{header}\n"));
    }

    /// One key of a section of the schema, with its unit, if the deck's choices read it.
    fn line(&mut self, section: &str, key: &str, value: String) {
        let known = schema::section(section).key(key);
        if known.is_some_and(|known| !is_read(self.deck, known)) {
            return;
        }
        let unit = known.map_or("", |known| known.unit);
        let unit = if unit.is_empty() { String::new() } else { format!("  # {unit}") };
        self.text.push_str(&format!("{key} = {value}{unit}\n"));
    }

    fn optional(&mut self, section: &str, key: &str, value: Option<String>) {
        if let Some(value) = value {
            self.line(section, key, value);
        }
    }
}

fn quote(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c.is_control() => out.push_str(&format!("\\u{:04x}", c as u32)),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

fn number(value: f64) -> String {
    format!("{value:?}")
}

fn array(items: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", items.into_iter().collect::<Vec<_>>().join(", "))
}

fn inline(pairs: &[(&str, String)]) -> String {
    let pairs: Vec<String> = pairs.iter().map(|(key, value)| format!("{key} = {value}")).collect();
    format!("{{ {} }}", pairs.join(", "))
}

fn vector(values: &[f64]) -> String {
    array(values.iter().copied().map(number))
}

fn counts(values: &[usize]) -> String {
    array(values.iter().map(usize::to_string))
}

fn axes(axes: &[usize]) -> String {
    array(axes.iter().map(|axis| quote(AXES[*axis])))
}

/// A number if it was given as one.
fn expression(expression: &Expression) -> String {
    match expression.as_constant() {
        Some(value) if value.to_string() == expression.text() => number(value),
        _ => quote(expression.text()),
    }
}

fn expressions(all: &[Expression]) -> String {
    array(all.iter().map(expression))
}

fn analysis(w: &mut Writer<'_>, deck: &Deck) {
    let a = &deck.analysis;
    w.table("[analysis]");
    w.line("analysis", "type", quote(a.kind.name()));
    w.line("analysis", "symmetry", quote(a.symmetry.name()));
    if !deck.is_staged() {
        w.optional("analysis", "steps", a.steps.map(|steps| steps.to_string()));
        w.optional("analysis", "duration", a.duration.map(number));
    }
    w.optional("analysis", "cfl", a.cfl.map(number));
    w.line("analysis", "tolerance", number(a.tolerance));
    w.line("analysis", "max_iterations", a.max_iterations.to_string());
    w.line("analysis", "on_failure", quote(a.on_failure.name()));
    w.line("analysis", "smallest_step", number(a.smallest_step));
    w.line("analysis", "inverted_iterates", quote(a.inverted_iterates.name()));
    w.line("analysis", "tangent", quote(a.tangent.name()));
    w.line("analysis", "newmark_beta", number(a.newmark_beta));
    w.line("analysis", "newmark_gamma", number(a.newmark_gamma));
    w.line("analysis", "hht_alpha", number(a.hht_alpha));
    w.line("analysis", "strength_tolerance", number(a.strength_tolerance));
    let damping = a
        .damping
        .map(|damping| inline(&[("local", number(damping.local)), ("mass", number(damping.mass))]));
    w.optional("analysis", "damping", damping);

    if deck.element_test.is_some() {
        return;
    }
    let m = &deck.method;
    w.table("[method]");
    w.line("method", "basis", quote(m.basis.name()));
    w.line("method", "domain_update", quote(m.domain_update.name()));
    w.line("method", "gimp_edge", quote(m.gimp_edge.name()));
    w.line("method", "point_volume", quote(m.point_volume.name()));
    w.line("method", "locking", quote(m.locking.name()));
    // What `control = "fem"` stands for is written out in grid.motion and body.gauss.
    w.line("method", "control", quote("off"));
    w.line("method", "frame", quote(m.frame.name()));
    w.line("method", "mass", quote(m.mass.name()));
    w.line("method", "stress_update", quote(m.stress_update.name()));
    w.line("method", "position_update", quote(m.position_update.name()));
    let velocity = match (m.xpic, m.affine, m.flip) {
        (Some(_), ..) => quote("xpic"),
        (None, Some(affine), _) => quote(affine.name()),
        (None, None, 1.0) => quote("flip"),
        (None, None, 0.0) => quote("pic"),
        (None, None, share) => number(share),
    };
    w.line("method", "velocity_update", velocity);
    w.optional("method", "xpic_order", m.xpic.map(|order| order.to_string()));
    w.line("method", "drop_below", number(m.drop_below));

    if let Some(g) = &deck.ghost {
        w.table("[ghost]");
        w.optional("ghost", "stiffness", g.stiffness.map(number));
        w.optional("ghost", "stiffness_factor", g.stiffness_factor.map(number));
        w.optional("ghost", "mass", g.mass.map(number));
        w.optional("ghost", "mass_factor", g.mass_factor.map(number));
        w.line("ghost", "scaling", quote(g.scaling.name()));
    }
    if let Some(motion) = &deck.conditioning_displacement {
        w.table("[conditioning]");
        w.line("conditioning", "displacement", vector(motion));
    }
}

fn stages(w: &mut Writer<'_>, deck: &Deck) {
    for stage in deck.stages.iter().filter(|_| deck.is_staged()) {
        w.table("[[stage]]");
        w.line("stage", "name", quote(&stage.name));
        w.optional("stage", "steps", stage.steps.map(|steps| steps.to_string()));
        w.optional("stage", "duration", stage.duration.map(number));
        w.line("stage", "reset_displacement", stage.reset_displacement.to_string());
    }
}

/// Where it is not that of a deck without stages.
fn presence(w: &mut Writer<'_>, section: &str, presence: Presence, usual: Option<usize>) {
    let stages = &w.deck.stages;
    let name = |at: usize| quote(stages.get(at).map_or("later", |stage| &stage.name));
    let from = match presence.from {
        from if from == usual => None,
        None => Some(quote("initial")),
        // The only stage of a deck without any has no name.
        Some(at) => w.deck.is_staged().then(|| name(at)),
    };
    let until = presence.until.map(name);
    w.optional(section, "from", from);
    w.optional(section, "until", until);
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
        InitialStress::K0(k0) => inline(&[
            ("unit_weight", expression(&k0.unit_weight)),
            ("surface", expression(&k0.surface)),
            ("k0", expression(&k0.k0)),
            ("surcharge", expression(&k0.surcharge)),
            ("axis", quote(AXES[k0.axis])),
        ]),
    }
}

fn element_test(w: &mut Writer<'_>, deck: &Deck, test: &ElementTest) {
    w.table("[element_test]");
    w.line("element_test", "material", quote(&deck.materials[test.material].name));
    w.line("element_test", "path", quote(test.path.name()));
    w.line("element_test", "confining", number(test.confining));
    if test.history.is_empty() {
        w.line("element_test", "strain", number(test.strain));
    } else {
        let legs = test.history.iter().map(|strain| vector(strain));
        w.line("element_test", "history", array(legs));
    }
    w.line("element_test", "steps", test.steps.to_string());
}

fn grid(w: &mut Writer<'_>, deck: &Deck) {
    w.table("[grid]");
    let mesh = match &deck.grid {
        Grid::Lattice(lattice) => {
            w.line("grid", "type", quote("lattice"));
            w.line("grid", "origin", vector(&lattice.origin));
            w.line("grid", "cells", counts(&lattice.cells));
            w.line("grid", "h", vector(&lattice.spacing));
            return;
        }
        Grid::Mesh(mesh) => mesh,
    };
    w.line("grid", "type", quote("mesh"));
    match &mesh.source {
        MeshSource::File(path) => {
            w.line("grid", "file", quote(&path.display().to_string()));
            w.line("grid", "dimension", deck.dimension.to_string());
        }
        MeshSource::Annulus { inner, outer, radial, around, element, grading } => {
            let annulus = inline(&[
                ("inner", vector(inner)),
                ("outer", number(*outer)),
                ("radial", radial.to_string()),
                ("around", around.to_string()),
                ("element", quote(element.name())),
                ("grading", number(*grading)),
            ]);
            w.line("grid", "generate", inline(&[("annulus", annulus)]));
        }
        MeshSource::Box { min, max, cells, element } => {
            let made = inline(&[
                ("min", vector(min)),
                ("max", vector(max)),
                ("cells", counts(cells)),
                ("element", quote(element.name())),
            ]);
            w.line("grid", "generate", inline(&[("box", made)]));
        }
    }
    let motion = match &mesh.motion {
        MeshMotion::Fixed => None,
        MeshMotion::RotateWith(tag) => Some(("rotate_with", quote(tag))),
        MeshMotion::Follow(along) => Some(("follow", axes(along))),
        MeshMotion::Material => Some(("follow", quote("material"))),
    };
    w.optional("grid", "motion", motion.map(|motion| inline(&[motion])));
}

fn materials_and_bodies(w: &mut Writer<'_>, deck: &Deck) {
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
            BodySource::File(path) => {
                let path = quote(&path.display().to_string());
                w.line("body", "shape", inline(&[("points", path)]));
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

fn conditions(w: &mut Writer<'_>, deck: &Deck) {
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

fn contact(w: &mut Writer<'_>, deck: &Deck) {
    for rigid in &deck.rigids {
        w.table("[[rigid]]");
        w.line("rigid", "name", quote(&rigid.name));
        w.line("rigid", "shape", inline(&[rigid_shape(&rigid.shape)]));
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
    }
    for contact in &deck.contacts {
        w.table("[[contact]]");
        w.line("contact", "name", quote(&contact.name));
        let names = [&deck.rigids[contact.rigid].name, &deck.bodies[contact.body].name];
        w.line("contact", "between", array(names.map(|name| quote(name))));
        let friction = match contact.friction {
            Friction::Coulomb(coefficient) => number(coefficient),
            Friction::Rough => quote("rough"),
        };
        w.line("contact", "friction", friction);
        w.line("contact", "adhesion", number(contact.adhesion));
        w.optional("contact", "max_shear", contact.max_shear.map(number));
        w.line("contact", "penalty", number(contact.penalty));
    }
}

fn rigid_shape(shape: &RigidShape) -> (&'static str, String) {
    match shape {
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
    }
}

fn results(w: &mut Writer<'_>, deck: &Deck) {
    for verify in &deck.verify {
        w.table("[[verify]]");
        w.line("verify", "name", quote(&verify.name));
        w.line("verify", "field", quote(&verify.field));
        let exact = match verify.exact.as_slice() {
            [one] => expression(one),
            all => expressions(all),
        };
        w.line("verify", "exact", exact);
        w.line("verify", "norm", quote(verify.norm.name()));
        w.line("verify", "scale", number(verify.scale));
    }
    for probe in &deck.probes {
        w.table("[[probe]]");
        w.line("probe", "name", quote(&probe.name));
        let body = |body: &usize| quote(&deck.bodies[*body].name);
        match &probe.spot {
            Spot::Near { place, body: of } => {
                w.line("probe", "near", vector(place));
                w.optional("probe", "body", of.as_ref().map(body));
            }
            Spot::Id(id) => w.line("probe", "id", id.to_string()),
            Spot::Mean(of) => w.line("probe", "body", body(of)),
        }
        w.line("probe", "fields", array(probe.fields.iter().map(|field| quote(field))));
    }
    w.table("[output]");
    let interval = |every: Every| match every {
        Every::Steps(steps) => steps.to_string(),
        Every::Seconds(seconds) => inline(&[("seconds", number(seconds))]),
    };
    w.line("output", "every", interval(deck.output.every));
    w.line("output", "history", interval(deck.output.history));
    w.line("output", "log", interval(deck.output.log));
    w.line("output", "fields", array(deck.output.fields.iter().map(|field| quote(field))));
    let formats = deck.output.formats.iter().map(|format| quote(format.name()));
    w.line("output", "format", array(formats));
    w.line("output", "report", deck.output.report.to_string());
    if let Some(checkpoint) = &deck.output.checkpoint {
        let mut pairs = Vec::new();
        pairs.extend(checkpoint.every.map(|steps| ("every", steps.to_string())));
        pairs.extend(checkpoint.minutes.map(|minutes| ("minutes", number(minutes))));
        pairs.push(("keep", checkpoint.keep.to_string()));
        w.line("output", "checkpoint", inline(&pairs));
    }
    w.table("[parallel]");
    w.optional("parallel", "brick", deck.parallel.brick.map(|cells| cells.to_string()));
    w.line("parallel", "initial", quote(deck.parallel.initial.name()));
    w.line("parallel", "cost", quote(deck.parallel.cost.name()));
    w.line("parallel", "rebalance_above", number(deck.parallel.rebalance_above));
    if !deck.petsc.is_empty() {
        w.table("[petsc]");
        for (name, value) in &deck.petsc {
            let value = if value.is_empty() { "true".to_string() } else { quote(value) };
            w.text.push_str(&format!("{} = {value}\n", quote(name)));
        }
    }
}
