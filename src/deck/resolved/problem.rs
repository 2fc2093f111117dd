//! Analysis, method, stages, grid, and element tests.

use crate::deck::model::{Deck, ElementTest, Grid, MeshMotion, MeshSource};
use crate::deck::stage::Presence;

use super::toml_text::{array, axes, counts, inline, number, quote, vector};
use super::writer::Writer;

pub(super) fn analysis(w: &mut Writer<'_>, deck: &Deck) {
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

pub(super) fn stages(w: &mut Writer<'_>, deck: &Deck) {
    for stage in deck.stages.iter().filter(|_| deck.is_staged()) {
        w.table("[[stage]]");
        w.line("stage", "name", quote(&stage.name));
        w.optional("stage", "steps", stage.steps.map(|steps| steps.to_string()));
        w.optional("stage", "duration", stage.duration.map(number));
        w.line("stage", "reset_displacement", stage.reset_displacement.to_string());
    }
}

/// Where it is not that of a deck without stages.
pub(super) fn presence(
    w: &mut Writer<'_>,
    section: &str,
    presence: Presence,
    usual: Option<usize>,
) {
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

pub(super) fn element_test(w: &mut Writer<'_>, deck: &Deck, test: &ElementTest) {
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

pub(super) fn grid(w: &mut Writer<'_>, deck: &Deck) {
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
        MeshSource::Box { min, max, cells, stations, element } => {
            let mut keys = if stations.is_empty() {
                vec![("min", vector(min)), ("max", vector(max)), ("cells", counts(cells))]
            } else {
                let axis = |axis: &Vec<[f64; 2]>| array(axis.iter().map(|pair| vector(pair)));
                vec![("spacing", array(stations.iter().map(axis)))]
            };
            keys.push(("element", quote(element.name())));
            let made = inline(&keys);
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
