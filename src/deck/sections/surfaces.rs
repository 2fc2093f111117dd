//! Surfaces of bodies, and what lies on a line or plane: where supports and tractions act.

use super::conditions::of_body;
use super::shapes;
use crate::deck::model::{Body, BodySource, BodySurface, Held};
use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::schema::SIDES;

/// Keys of [`body_surface`].
const OF_BODY: [&str; 3] = ["body", "side", "where"];

/// What `boundary.surface` holds.
pub fn held(
    table: &Table<'_>,
    dimension: usize,
    names: &[String],
    read: Option<&[Body]>,
) -> Got<Held> {
    let (key, other, count, in_words) = match dimension {
        2 => ("line", "plane", 2, "two ends"),
        _ => ("plane", "line", 3, "three corners"),
    };
    table.refuse(&[other], &format!("the problem is {dimension}D: expected {key}"))?;
    if !table.given(key) {
        return Ok(Held::Surface(body_surface(table, dimension, names, read)?));
    }
    table.refuse(&OF_BODY, &format!("{key} is given; leave one of them out"))?;
    let corners = table.points(key, dimension)?;
    if corners.len() != count {
        let what = format!("expected {in_words}, found {}", corners.len());
        return Err(table.problem(key, what));
    }
    if area(&corners) == 0.0 {
        return Err(table.problem(key, "has no extent: its places coincide or lie on one line"));
    }
    Ok(Held::Sheet(corners))
}

/// Length of a line, area of a parallelogram.
fn area(corners: &[Vec<f64>]) -> f64 {
    let side = |k: usize| -> [f64; 3] {
        std::array::from_fn(|a| {
            let at = |k: usize| corners[k].get(a).copied().unwrap_or(0.0);
            at(k) - at(0)
        })
    };
    let u = side(1);
    let v = if corners.len() == 3 { side(2) } else { [0.0, 0.0, 1.0] };
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    cross.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// A part of a body's own surface; `read`: the bodies as read, if that succeeded.
pub fn body_surface(
    table: &Table<'_>,
    dimension: usize,
    names: &[String],
    read: Option<&[Body]>,
) -> Got<BodySurface> {
    let body = of_body(table, names);
    let side = match table.given("side") {
        true => table.choice_of("side", &SIDES[..2 * dimension]).map(Some),
        false => Ok(None),
    };
    let within = match table.given("where") {
        true => shapes::condition(table, dimension).map(Some),
        false => Ok(None),
    };
    let (body, side, within) = (body?, side?, within?);
    let side = side.map(|side| (side / 2, side % 2 == 1));
    // Faults of the bodies themselves are reported already.
    let Some(read) = read else { return Ok(BodySurface { body, side, within }) };
    let key = if table.given("body") { "body" } else { "" };
    let name = &names[body];
    match &read[body].source {
        BodySource::Shape { shape, .. } if shape.has_condition() => {
            let what = format!(
                "the shape of body \"{name}\" has a condition (where), of which no surface is known"
            );
            let help = "give the shape by box, disc, ellipse, capsule, polygon, and sets of them";
            Err(table.problem_with_help(key, what, help))
        }
        BodySource::Shape { .. } => Ok(BodySurface { body, side, within }),
        _ => {
            let what = format!("body \"{name}\" is not given as a shape, which has a surface");
            let help =
                "use pressure without surface, which needs none, or give the body as a shape";
            Err(table.problem_with_help(key, what, help))
        }
    }
}
