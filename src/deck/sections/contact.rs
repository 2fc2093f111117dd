//! `[[rigid]]` and `[[contact]]`.

use std::path::Path;

use super::{shapes, stages};
use crate::deck::model::{
    Analysis, AnalysisType, Boundary, Contact, FreeRigid, Friction, Mass, Method, Partner, Rigid,
    RigidMotion, RigidRotation, RigidShape,
};
use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::stage::Presence;
use crate::deck::tree::Value;

const FORMS: [&str; 8] = ["half_space", "disc", "ball", "box", "capsule", "polygon", "stl", "cone"];

/// The stages that `from` and `until` may name.
pub struct InStages<'a> {
    pub names: &'a [String],
    pub kind: Option<AnalysisType>,
}

impl InStages<'_> {
    /// What goes releases its forces over its last stage, where forces are in balance.
    fn presence(&self, table: &Table<'_>) -> Got<Presence> {
        let fades = self.kind.is_some_and(AnalysisType::is_static);
        let presence =
            stages::presence(table, self.names, Presence { fades, ..Presence::default() })?;
        if presence.from.is_none() {
            let what = "comes with a stage: leave from out, and it is there from the first one on";
            return Err(table.problem("from", what));
        }
        Ok(presence)
    }
}

/// `directory`: where relative paths start; `boundaries`: as read, if that succeeded; their names are
/// taken.
pub fn rigids(
    root: &Table<'_>,
    directory: &Path,
    dimension: usize,
    boundaries: Option<&[Boundary]>,
    stages: &InStages<'_>,
) -> Got<Vec<Rigid>> {
    let mut names: Vec<String> =
        boundaries.unwrap_or_default().iter().map(|boundary| boundary.name.clone()).collect();
    root.tables("rigid", |_, table| {
        let name = table.text("name")?;
        let name = table.unique(name, &mut names, "boundary or rigid body")?;
        let shape = table.table("shape", |t| shape(&t, directory, dimension));
        let motion = table.table_if("motion", |t| motion(&t, dimension));
        let (density, velocity) =
            (table.number_if("density"), table.vector_if("velocity", dimension));
        let presence = stages.presence(&table);
        let (shape, motion, density, velocity) = (shape?, motion?, density?, velocity?);
        let presence = presence?;
        if density.is_some() && motion.is_some() {
            let message = "a rigid body is driven by motion or moves freely with its density";
            return Err(table.problem("density", message));
        }
        if density.is_none() && velocity.is_some() {
            let message = "has no effect without a density, with which the body moves freely";
            let help = "a driven body has motion = { velocity = [...] }";
            return Err(table.problem_with_help("velocity", message, help));
        }
        if density.is_some() && matches!(shape, RigidShape::HalfSpace { .. }) {
            return Err(table.problem("density", "a half space has no end, and so no mass"));
        }
        if density.is_some() && matches!(shape, RigidShape::Solid(_)) {
            let message = "no mass is known of an STL file: a rigid body of one is held or driven";
            return Err(table.problem("density", message));
        }
        let free = density.map(|density| FreeRigid {
            density,
            velocity: velocity.unwrap_or_else(|| vec![0.0; dimension]),
        });
        Ok(Rigid { name, shape, motion: motion.unwrap_or_default(), free, presence })
    })
}

fn shape(table: &Table<'_>, directory: &Path, dimension: usize) -> Got<RigidShape> {
    let form = table.one_of(&FORMS)?;
    if form != "stl" {
        table.refuse(&["scale"], "only beside stl")?;
    }
    match form {
        "stl" if dimension != 3 => Err(table.problem("stl", "bounds a body in 3D; the grid is 2D")),
        "stl" => shapes::of_stl(table, directory).map(RigidShape::Solid),
        "polygon" if dimension != 2 => {
            Err(table.problem("polygon", "polygons are 2D; the grid is 3D"))
        }
        "cone" if dimension != 3 => Err(table.problem_with_help(
            "cone",
            "cones are 3D; the grid is 2D",
            "use polygon = [[x, y], ...] with the corners of its profile",
        )),
        "polygon" => {
            let corners = table.points("polygon", 2)?;
            let corners: Vec<[f64; 2]> = corners.iter().map(|x| [x[0], x[1]]).collect();
            if corners.len() < 3 {
                let message = format!("expected 3 or more corners, found {}", corners.len());
                return Err(table.problem("polygon", message));
            }
            Ok(RigidShape::Polygon { corners })
        }
        _ => table.table(form, |t| match form {
            "half_space" => {
                let (point, normal) =
                    (t.vector("point", dimension), direction(&t, "normal", dimension));
                Ok(RigidShape::HalfSpace { point: point?, normal: normal? })
            }
            "box" => {
                let (min, max) = shapes::corners(&t, dimension, false)?;
                Ok(RigidShape::Box { min, max })
            }
            "capsule" => {
                let (from, to) = (t.vector("from", dimension), t.vector("to", dimension));
                let radius = t.number("radius");
                Ok(RigidShape::Capsule { from: from?, to: to?, radius: radius? })
            }
            "cone" => {
                let tip = t.vector("tip", 3);
                let axis = if t.given("axis") {
                    direction(&t, "axis", 3)
                } else {
                    Ok(vec![0.0, 0.0, 1.0])
                };
                let (angle, radius) = (t.number("angle"), t.number("radius"));
                let (shaft, tip, axis) = (t.number("shaft")?, tip?, axis?);
                let triple = |v: Vec<f64>| [v[0], v[1], v[2]];
                let (tip, axis) = (triple(tip), triple(axis));
                Ok(RigidShape::Cone { tip, axis, angle: angle?, radius: radius?, shaft })
            }
            _ => {
                let (centre, radius) = (t.vector("centre", dimension), t.number("radius"));
                Ok(RigidShape::Ball { centre: centre?, radius: radius? })
            }
        }),
    }
}

/// A vector that is not zero.
fn direction(table: &Table<'_>, name: &str, dimension: usize) -> Got<Vec<f64>> {
    let vector = table.vector(name, dimension)?;
    if vector.iter().all(|v| *v == 0.0) {
        return Err(table.problem(name, "expected a direction, found zeros"));
    }
    Ok(vector)
}

fn motion(table: &Table<'_>, dimension: usize) -> Got<RigidMotion> {
    let displacement = table.expressions_if("displacement", dimension);
    let velocity = table.expressions_if("velocity", dimension);
    let rotation = table.table_if("rotation", |t| {
        let (centre, degrees) = (t.vector_if("centre", dimension), t.expression_if("degrees")?);
        if dimension == 2 {
            t.refuse(&["axis"], "only in 3D")?;
        }
        let axis = if t.given("axis") { direction(&t, "axis", 3)? } else { vec![0.0, 0.0, 1.0] };
        let centre = centre?.unwrap_or_else(|| vec![0.0; dimension]);
        let degrees = degrees.ok_or_else(|| t.missing("degrees", ""))?;
        Ok(RigidRotation { centre, axis: [axis[0], axis[1], axis[2]], degrees })
    });
    Ok(RigidMotion {
        displacement: displacement?.unwrap_or_default(),
        velocity: velocity?.unwrap_or_default(),
        rotation: rotation?,
    })
}

/// `rigids`, `analysis`, `method`: as read, if that succeeded; `bodies`: names as written.
pub fn contacts(
    root: &Table<'_>,
    rigids: Option<&[Rigid]>,
    bodies: &[String],
    (analysis, method): (Option<&Analysis>, Option<&Method>),
    stages: &InStages<'_>,
) -> Got<Vec<Contact>> {
    let mut names: Vec<String> = Vec::new();
    root.tables("contact", |_, table| {
        let pair = between(&table, rigids, bodies);
        let friction = friction(&table);
        let (adhesion, most) = (table.number("adhesion"), table.number_if("max_shear"));
        let (penalty, presence) = (table.number("penalty"), stages.presence(&table));
        let (partner, body, joined) = pair?;
        if matches!(partner, Partner::Body(_)) {
            of_two_bodies(&table, analysis, method)?;
        }
        let name = table.text_if("name")?.unwrap_or(joined);
        let name = table.unique(name, &mut names, "contact")?;
        let (friction, adhesion, max_shear, presence) = (friction?, adhesion?, most?, presence?);
        if let (Partner::Rigid(rigid), Some(rigids)) = (partner, rigids)
            && rigids[rigid].presence.together(&presence).is_none()
        {
            let name = &rigids[rigid].name;
            let what = format!("is never there together with the rigid body \"{name}\"");
            let help = "see from and until of both";
            return Err(table.problem_with_help("between", what, help));
        }
        if friction == Friction::Rough && adhesion > 0.0 {
            let message = "has no effect with friction = \"rough\", which lets nothing slip";
            return Err(table.problem("adhesion", message));
        }
        if friction == Friction::Coulomb(0.0) && adhesion == 0.0 && max_shear.is_some() {
            let message = "has no effect on a smooth surface: friction and adhesion are zero";
            return Err(table.problem("max_shear", message));
        }
        let penalty = penalty?;
        Ok(Contact { name, partner, body, friction, adhesion, max_shear, penalty, presence })
    })
}

/// Two bodies touch in velocity fields of their own, which explicit steps with a lumped mass know.
fn of_two_bodies(
    table: &Table<'_>,
    analysis: Option<&Analysis>,
    method: Option<&Method>,
) -> Got<()> {
    if analysis.is_some_and(|analysis| analysis.kind != AnalysisType::Explicit) {
        if let Some(name) = ["from", "until"].into_iter().find(|name| table.given(name)) {
            let what = "two bodies that touch in an implicit run do so in all of its stages";
            return Err(table.problem(name, what));
        }
        return Ok(());
    }
    if analysis.is_some() && method.is_some_and(|method| method.mass != Mass::Lumped) {
        let what = "contact of two bodies takes a lumped mass: impulses at a node would move its \
                    neighbours with a consistent one";
        return Err(table.problem_with_help("between", what, "set method.mass = \"lumped\""));
    }
    if table.given("penalty") {
        let what =
            "has no effect between two bodies, which impulses at the nodes keep apart exactly";
        return Err(table.problem("penalty", what));
    }
    Ok(())
}

/// What the body touches, the body's index, and both names in one.
fn between(
    table: &Table<'_>,
    rigids: Option<&[Rigid]>,
    bodies: &[String],
) -> Got<(Partner, usize, String)> {
    let Some(node) = table.node("between") else { return Err(table.missing("between", "")) };
    let names = match &node.value {
        Value::Array(items) => items
            .iter()
            .map(|item| match &item.value {
                Value::String(name) => Some(name.as_str()),
                _ => None,
            })
            .collect::<Option<Vec<&str>>>(),
        _ => None,
    };
    let Some([first, second]) = names.as_deref() else { return Err(table.wrong("between", node)) };
    let rigid_names: Vec<&str> = match rigids {
        Some(rigids) => rigids.iter().map(|rigid| rigid.name.as_str()).collect(),
        // Their own faults are reported already.
        None => vec![first, second],
    };
    let rigid = |name: &str| rigid_names.iter().position(|known| *known == name);
    let body = |name: &str| bodies.iter().position(|known| known == name);
    for name in [first, second] {
        if rigid(name).is_none() && body(name).is_none() {
            let known: Vec<&str> =
                rigid_names.iter().copied().chain(bodies.iter().map(String::as_str)).collect();
            return Err(table.unknown_word("between", name, &known, &node.origin));
        }
    }
    match (rigid(first), body(second), rigid(second), body(first)) {
        (Some(r), Some(b), ..) | (_, _, Some(r), Some(b)) => {
            Ok((Partner::Rigid(r), b, format!("{first}-{second}")))
        }
        (Some(_), _, Some(_), _) => Err(table.problem(
            "between",
            format!("\"{first}\" and \"{second}\" are both rigid: only a body yields"),
        )),
        (_, Some(two), _, Some(one)) if one != two => {
            Ok((Partner::Body(two), one, format!("{first}-{second}")))
        }
        _ => {
            let what =
                format!("a body does not touch itself: expected another name than \"{first}\"");
            Err(table.problem("between", what))
        }
    }
}

fn friction(table: &Table<'_>) -> Got<Friction> {
    let Some(node) = table.node("friction") else { return Ok(Friction::Coulomb(0.0)) };
    match (&node.value, node.number()) {
        (Value::String(word), _) if word == "rough" => Ok(Friction::Rough),
        (_, Some(value)) if value.is_finite() && value >= 0.0 => Ok(Friction::Coulomb(value)),
        _ => Err(table.wrong("friction", node)),
    }
}
