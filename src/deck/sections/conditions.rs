//! `[[boundary]]` and `[[load]]`.

use super::bodies::{self, World};
use super::shapes;
use crate::deck::model::{Body, Boundary, Grid, Load, MeshGrid, MeshSource, Place, Rotation};
use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::schema::{AXES, SIDES};

pub fn boundaries(root: &Table<'_>, world: &World<'_>, bodies: &[String]) -> Got<Vec<Boundary>> {
    let mut names: Vec<String> = Vec::new();
    root.tables("boundary", |index, table| {
        let name = table.text_if("name")?.unwrap_or_else(|| format!("boundary-{}", index + 1));
        if names.contains(&name) {
            return Err(table.problem("name", format!("another boundary is called \"{name}\"")));
        }
        names.push(name.clone());
        let axes = &AXES[..world.dimension];
        let place = table.table("where", |t| place(&t, world, bodies));
        let fix = table.choices("fix", axes);
        let displacement = table.table_if("displacement", |t| {
            t.refuse(&AXES[world.dimension..], "the problem is 2D")?;
            let mut components = Vec::new();
            for (axis, name) in axes.iter().enumerate() {
                if let Some(value) = t.expression_if(name)? {
                    components.push((axis, value));
                }
            }
            Ok(components)
        });
        let rotation = table.table_if("rotation", |t| {
            let (centre, degrees) = (t.vector_if("centre", world.dimension), t.number("degrees"));
            let centre = centre?.unwrap_or_else(|| vec![0.0; world.dimension]);
            Ok(Rotation { centre, degrees: degrees? })
        });
        let (place, fix) = (place?, fix?);
        let (displacement, rotation) = (displacement?.unwrap_or_default(), rotation?);
        if fix.is_empty() && displacement.is_empty() && rotation.is_none() {
            let message = "prescribes nothing: expected fix, displacement or rotation";
            return Err(table.problem("", message));
        }
        if let Some((axis, _)) = displacement.iter().find(|(axis, _)| fix.contains(axis)) {
            let message = format!("{} is held by fix and displaced too", AXES[*axis]);
            return Err(table.problem("displacement", message));
        }
        let plane = |axis: &usize| *axis < 2;
        if rotation.is_some()
            && (fix.iter().any(plane) || displacement.iter().any(|(axis, _)| plane(axis)))
        {
            return Err(table.problem("rotation", "x and y are prescribed already"));
        }
        Ok(Boundary { name, place, fix, displacement, rotation })
    })
}

fn place(table: &Table<'_>, world: &World<'_>, bodies: &[String]) -> Got<Place> {
    let mesh = matches!(world.grid, Grid::Mesh(_));
    match table.one_of(&["side", "box", "tag", "cells_of"])? {
        "side" if mesh => Err(table.problem_with_help(
            "side",
            "a mesh has no sides",
            "use where = { tag = \"...\" } or where = { box = { ... } }",
        )),
        "side" => {
            let side = table.choice_of("side", &SIDES[..2 * world.dimension])?;
            Ok(Place::Side { axis: side / 2, upper: side % 2 == 1 })
        }
        "box" => table.table("box", |t| {
            let (min, max) = shapes::corners(&t, world.dimension, true)?;
            Ok(Place::Box { min, max })
        }),
        "tag" if !mesh => Err(table.problem_with_help(
            "tag",
            "a lattice has no tags",
            "use where = { side = \"left\" } or where = { box = { ... } }",
        )),
        "tag" => {
            let tag = table.text("tag")?;
            let known: &[&str] = match world.grid {
                Grid::Mesh(MeshGrid { source: MeshSource::Annulus { .. }, .. }) => {
                    &["inner", "outer"]
                }
                Grid::Mesh(MeshGrid { source: MeshSource::Box { .. }, .. }) => {
                    &SIDES[..2 * world.dimension]
                }
                _ => return Ok(Place::Tag(tag)),
            };
            if known.contains(&tag.as_str()) {
                return Ok(Place::Tag(tag));
            }
            Err(table.unknown_word("tag", &tag, known, table.origin("tag")))
        }
        _ => Ok(Place::CellsOf { body: body(table, "cells_of", bodies)? }),
    }
}

/// Index of the body named by a key.
fn body(table: &Table<'_>, key: &'static str, bodies: &[String]) -> Got<usize> {
    let name = table.text(key)?;
    let known: Vec<&str> = bodies.iter().map(String::as_str).collect();
    known
        .iter()
        .position(|body| *body == name)
        .ok_or_else(|| table.unknown_word(key, &name, &known, table.origin(key)))
}

/// `read`: the bodies as read, if that succeeded; `names`: as written.
pub fn loads(
    root: &Table<'_>,
    world: &World<'_>,
    names: &[String],
    read: Option<&[Body]>,
) -> Got<Vec<Load>> {
    let dimension = world.dimension;
    root.tables("load", |_, table| {
        let key = table.one_of(&["point", "gravity", "body_force", "manufactured"])?;
        match key {
            "point" => table.table("point", |t| {
                let body = match (t.given("body"), names) {
                    (false, [_]) => Ok(0),
                    (false, _) => Err(t.missing("body", "the deck has several bodies")),
                    (true, _) => body(&t, "body", names),
                };
                let (nearest, force) =
                    (t.points("nearest", dimension), t.vector("force", dimension));
                let nearest = nearest?;
                if nearest.is_empty() {
                    return Err(t.problem("nearest", "expected one or more positions, found none"));
                }
                Ok(Load::Point { body: body?, nearest, force: force? })
            }),
            "gravity" => {
                let gravity = table.vector("gravity", dimension)?;
                let weightless = read.is_some_and(|all| all.iter().all(|b| b.density == 0.0));
                if weightless && gravity.iter().any(|g| *g != 0.0) {
                    return Err(
                        table.problem("gravity", "acts on nothing: every body has density 0")
                    );
                }
                if let (Some(all), Some(light)) = (read, bodies::without_density(root))
                    && gravity.iter().any(|g| *g != 0.0)
                {
                    let name = &all[light].name;
                    let what = format!("body \"{name}\" has no density, and others have one");
                    let help = "give it a density; density = 0.0 says that it is to be weightless";
                    return Err(table.problem_with_help("gravity", what, help));
                }
                Ok(Load::Gravity(gravity))
            }
            _ => {
                let all = table.expressions_if(key, dimension)?;
                let all = all.ok_or_else(|| table.missing(key, ""))?;
                Ok(if key == "body_force" { Load::BodyForce(all) } else { Load::Manufactured(all) })
            }
        }
    })
}
