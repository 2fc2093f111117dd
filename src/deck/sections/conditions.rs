//! `[[boundary]]` and `[[load]]`.

use super::bodies::EarlierSections;
use super::{shapes, stages, surfaces};
use crate::deck::model::{
    AnalysisType, Body, Boundary, Grid, Held, Load, MeshGrid, MeshSource, Place, Rotation, Support,
    SupportMethod, Water,
};
use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::schema::{AXES, SIDES};
use crate::deck::stage::Presence;
use crate::loads::Around;

/// Penalty factors where the deck says nothing.
const PENALTY: f64 = 100.0;
const PENALTY_OF_NITSCHE: f64 = 10.0;

/// `bodies`: as written; `read`: as read, if that succeeded.
pub fn boundaries(
    root: &Table<'_>,
    earlier: &EarlierSections<'_>,
    bodies: &[String],
    read: Option<&[Body]>,
) -> Got<Vec<Boundary>> {
    let mut names: Vec<String> = Vec::new();
    root.tables("boundary", |index, table| {
        let name = table.text_if("name")?.unwrap_or_else(|| format!("boundary-{}", index + 1));
        let name = table.unique(name, &mut names, "boundary")?;
        let axes = &AXES[..earlier.dimension];
        let place = match table.one_of(&["where", "surface"])? {
            "where" => table.table("where", |t| place(&t, earlier, bodies)),
            _ => support(&table, earlier, bodies, read).map(Place::Surface),
        };
        let fix = table.choices("fix", axes);
        let displacement = table.table_if("displacement", |t| {
            t.refuse(&AXES[earlier.dimension..], "the problem is 2D")?;
            let mut components = Vec::new();
            for (axis, name) in axes.iter().enumerate() {
                if let Some(value) = t.expression_if(name)? {
                    components.push((axis, value));
                }
            }
            Ok(components)
        });
        let rotation = table.table_if("rotation", |t| {
            let (centre, degrees) = (t.vector_if("centre", earlier.dimension), t.number("degrees"));
            let centre = centre?.unwrap_or_else(|| vec![0.0; earlier.dimension]);
            Ok(Rotation { centre, degrees: degrees? })
        });
        let kind = earlier.analysis.map(|analysis| analysis.kind);
        let fades = kind.is_some_and(AnalysisType::is_static);
        let presence = Presence { fades, ..Presence::default() };
        let presence = stages::presence(&table, earlier.stages, presence);
        let (place, fix, presence) = (place?, fix?, presence?);
        let (displacement, rotation) = (displacement?.unwrap_or_default(), rotation?);
        if let Place::Surface(support) = &place {
            table.refuse(&["rotation"], "not known of a surface; use displacement = { ... }")?;
            if support.slip {
                table.refuse(&["fix"], "slip holds the normal component already")?;
            }
            let later = presence.from.is_some_and(|from| from > 0);
            if later && matches!(support.surface, Held::Sheet(_)) {
                let what = "what lies on a line or plane is found at the start of the run";
                let help = "hold the surface of a body: surface = { body = ..., side = ... }";
                return Err(table.problem_with_help("from", what, help));
            }
            return checked(
                &table,
                Boundary { name, place, fix, displacement, rotation, presence },
            );
        }
        table
            .refuse(&["slip", "penalty", "method"], "only with surface; nodes are held exactly")?;
        if fix.is_empty() && displacement.is_empty() && rotation.is_none() {
            let message = "prescribes nothing: expected fix, displacement or rotation";
            return Err(table.problem("", message));
        }
        let plane = |axis: &usize| *axis < 2;
        if rotation.is_some()
            && (fix.iter().any(plane) || displacement.iter().any(|(axis, _)| plane(axis)))
        {
            return Err(table.problem("rotation", "x and y are prescribed already"));
        }
        checked(&table, Boundary { name, place, fix, displacement, rotation, presence })
    })
}

/// A boundary whose components are prescribed once.
fn checked(table: &Table<'_>, boundary: Boundary) -> Got<Boundary> {
    let twice = boundary.displacement.iter().find(|(axis, _)| boundary.fix.contains(axis));
    match twice {
        Some((axis, _)) => {
            let message = format!("{} is held by fix and displaced too", AXES[*axis]);
            Err(table.problem("displacement", message))
        }
        None => Ok(boundary),
    }
}

fn support(
    table: &Table<'_>,
    earlier: &EarlierSections<'_>,
    bodies: &[String],
    read: Option<&[Body]>,
) -> Got<Support> {
    let surface = table.table("surface", |t| surfaces::held(&t, earlier.dimension, bodies, read));
    let (slip, penalty) = (table.flag_if("slip"), table.number_if("penalty"));
    let method = table.choice_if("method")?.unwrap_or(SupportMethod::Penalty);
    let usual = match method {
        SupportMethod::Penalty => PENALTY,
        SupportMethod::Nitsche => PENALTY_OF_NITSCHE,
    };
    Ok(Support {
        surface: surface?,
        slip: slip?.unwrap_or(false),
        penalty: penalty?.unwrap_or(usual),
        method,
    })
}

fn place(table: &Table<'_>, earlier: &EarlierSections<'_>, bodies: &[String]) -> Got<Place> {
    let mesh = matches!(earlier.grid, Grid::Mesh(_));
    match table.one_of(&["side", "box", "tag", "cells_of"])? {
        "side" if mesh => Err(table.problem_with_help(
            "side",
            "a mesh has no sides",
            "use where = { tag = \"...\" } or where = { box = { ... } }",
        )),
        "side" => {
            let side = table.choice_of("side", &SIDES[..2 * earlier.dimension])?;
            Ok(Place::Side { axis: side / 2, upper: side % 2 == 1 })
        }
        "box" => table.table("box", |t| {
            let (min, max) = shapes::corners(&t, earlier.dimension, true)?;
            Ok(Place::Box { min, max })
        }),
        "tag" if !mesh => Err(table.problem_with_help(
            "tag",
            "a lattice has no tags",
            "use where = { side = \"left\" } or where = { box = { ... } }",
        )),
        "tag" => {
            let tag = table.text("tag")?;
            let known: &[&str] = match earlier.grid {
                Grid::Mesh(MeshGrid { source: MeshSource::Annulus { .. }, .. }) => {
                    &["inner", "outer"]
                }
                Grid::Mesh(MeshGrid { source: MeshSource::Box { .. }, .. }) => {
                    &SIDES[..2 * earlier.dimension]
                }
                _ => return Ok(Place::Tag(tag)),
            };
            if known.contains(&tag.as_str()) {
                return Ok(Place::Tag(tag));
            }
            Err(table.unknown_word("tag", &tag, known, table.origin("tag")))
        }
        _ => Ok(Place::CellsOf { body: table.choice_of_names("cells_of", bodies)? }),
    }
}

/// The body that key `body` names, or the only one.
pub fn of_body(table: &Table<'_>, names: &[String]) -> Got<usize> {
    match (table.given("body"), names) {
        (false, [_]) => Ok(0),
        (false, _) => Err(table.missing("body", "the deck has several bodies")),
        (true, _) => table.choice_of_names("body", names),
    }
}

/// The loads and when they act. `read`: the bodies as read, if that succeeded; `names`: as written.
pub fn loads(
    root: &Table<'_>,
    earlier: &EarlierSections<'_>,
    names: &[String],
    read: Option<&[Body]>,
) -> Got<(Vec<Load>, Vec<Presence>)> {
    let around = Around { root, dimension: earlier.dimension, names, bodies: read };
    let stressed = read.is_some_and(|all| all.iter().any(|body| body.initial_stress.is_some()));
    let all = root.tables("load", |_, table| {
        let load = Load::read(&table, &around)?;
        // Weight that the initial stress balances has acted before.
        let balanced = stressed && matches!(load, Load::Gravity(_)) && !load.depends_on_time();
        let default = if balanced { Presence::BEFORE } else { Presence::default() };
        // Functions of s or t are taken as they are.
        let once = load.depends_on_time() && table.given("from") && same(&table, "from", "until");
        let presence =
            stages::presence(&table, earlier.stages, Presence { fades: !once, ..default })?;
        Ok((load, presence))
    })?;
    Ok(all.into_iter().unzip())
}

/// `[water]`, and when it acts.
pub fn water(
    root: &Table<'_>,
    dimension: usize,
    read: Option<&[Body]>,
) -> Got<Option<(Load, Presence)>> {
    root.table_if("water", |table| {
        let (level, unit_weight) = (table.number("level"), table.number("unit_weight"));
        let axis = match table.given("axis") {
            true => table.choice_of("axis", &AXES[..dimension]),
            false => Ok(dimension - 1),
        };
        let stressed = read.is_some_and(|all| all.iter().any(|body| body.initial_stress.is_some()));
        let presence = if stressed { Presence::BEFORE } else { Presence::default() };
        let water = Water { level: level?, unit_weight: unit_weight?, axis: axis? };
        Ok((Load::Water(water), presence))
    })
}

/// Whether two keys have the same text.
fn same(table: &Table<'_>, one: &str, other: &str) -> bool {
    let text = |key: &str| table.text_if(key).ok().flatten();
    text(one).is_some() && text(one) == text(other)
}
