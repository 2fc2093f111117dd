//! `body.shape`: forms and where they are put.

use std::path::Path;
use std::sync::Arc;

use crate::deck::expression::Expression;
use crate::deck::problems::{Got, figure};
use crate::deck::reader::Table;
use crate::deck::schema;
use crate::deck::shape::{Form, Placement, Shape, Turn};
use crate::deck::solid::terrain::Heights;
use crate::deck::solid::{Solid, stl};
use crate::deck::tree::Value;
use crate::input_file;

/// Keys of the forms; the sources `points` and `cells` are a body's own.
pub const FORMS: [&str; 13] = [
    "box",
    "disc",
    "ball",
    "ellipse",
    "ellipsoid",
    "capsule",
    "polygon",
    "stl",
    "terrain",
    "where",
    "union",
    "intersection",
    "difference",
];

/// Sets of sets deeper than this are refused.
const DEEPEST: usize = 32;

/// `directory`: where relative paths start.
pub fn shape(table: &Table<'_>, directory: &Path, dimension: usize, depth: usize) -> Got<Shape> {
    if depth > DEEPEST {
        return Err(table.problem("", format!("shapes are nested more than {DEEPEST} deep")));
    }
    if depth > 0 {
        table.refuse(&["points", "cells", "of_body", "names"], "only directly in a body")?;
    }
    let name = table.one_of(&FORMS)?;
    if name != "stl" {
        table.refuse(&["scale"], "only beside stl")?;
    }
    let form = form(table, name, directory, dimension, depth);
    let placement = placement(table, dimension);
    Ok(Shape { form: form?, placement: placement? })
}

fn form(
    table: &Table<'_>,
    name: &'static str,
    directory: &Path,
    dimension: usize,
    depth: usize,
) -> Got<Form> {
    match name {
        "box" => table.table(name, |t| {
            let (min, max) = corners(&t, dimension, false)?;
            Ok(Form::Box { min, max })
        }),
        "disc" | "ball" => table.table(name, |t| {
            let (centre, radius) = (t.vector("centre", dimension), t.number("radius"));
            Ok(Form::Ball { centre: centre?, radius: radius? })
        }),
        "ellipse" | "ellipsoid" => table.table(name, |t| {
            let (centre, axes) = (t.vector("centre", dimension), t.vector("semi_axes", dimension));
            Ok(Form::Ellipsoid { centre: centre?, semi_axes: axes? })
        }),
        "capsule" => table.table(name, |t| {
            let (from, to) = (t.vector("from", dimension), t.vector("to", dimension));
            let radius = t.number("radius");
            Ok(Form::Capsule { from: from?, to: to?, radius: radius? })
        }),
        "polygon" => polygon(table, dimension),
        "stl" | "terrain" if dimension == 2 => {
            Err(table.problem(name, "bounds a body in 3D; the grid is 2D"))
        }
        "stl" => of_stl(table, directory).map(Form::Solid),
        "terrain" => table.table(name, |t| {
            let (file, bottom) = (t.text("file"), t.number("bottom"));
            let (path, bottom) = (directory.join(file?), bottom?);
            let made = content(&path, input_file::DATA)
                .and_then(|bytes| String::from_utf8(bytes).map_err(|_| "is not text".into()))
                .and_then(|text| Heights::read(&text))
                .and_then(|heights| heights.above(bottom))
                .and_then(|triangles| Solid::new(&path, Some(bottom), triangles));
            solid(&t, "file", &path, made).map(Form::Solid)
        }),
        "where" => condition(table, dimension).map(Form::Where),
        _ => {
            let parts = shapes(table, name, directory, dimension, depth)?;
            Ok(match name {
                "union" => Form::Union(parts),
                "intersection" => Form::Intersection(parts),
                _ => Form::Difference(parts),
            })
        }
    }
}

/// The solid of the file that key `stl` names.
pub fn of_stl(table: &Table<'_>, directory: &Path) -> Got<Arc<Solid>> {
    let (path, scale) = (directory.join(table.text("stl")?), table.number_if("scale")?);
    let made = content(&path, input_file::DATA).and_then(|bytes| stl::read(&bytes));
    let made = match (made, scale) {
        (Ok(triangles), Some(scale)) => {
            let scaled = Solid::scaled(&path, &triangles, scale);
            if scaled.is_err() && Solid::scaled(&path, &triangles, 1.0).is_ok() {
                let why = format!(
                    "{scale:e} makes the surface of {} too small or too large for its areas and \
                     volume to be computed: expected what turns the file's lengths into m, as \
                     0.001 for mm",
                    path.display()
                );
                return Err(table.problem("scale", why));
            }
            scaled
        }
        (made, _) => made.and_then(|triangles| Solid::scaled(&path, &triangles, 1.0)),
    };
    solid(table, "stl", &path, made)
}

fn content(path: &Path, most: u64) -> Result<Vec<u8>, String> {
    input_file::read(path, most).map_err(|reason| format!("cannot be read: {reason}"))
}

/// A solid of a file, or what is wrong with that.
fn solid(
    table: &Table<'_>,
    key: &str,
    path: &Path,
    made: Result<Solid, String>,
) -> Got<Arc<Solid>> {
    match made {
        Ok(solid) => Ok(Arc::new(solid)),
        Err(why) => Err(table.problem(key, format!("{}: {why}", path.display()))),
    }
}

/// `min` and `max`; equal only if `flat` is allowed.
pub fn corners(table: &Table<'_>, dimension: usize, flat: bool) -> Got<(Vec<f64>, Vec<f64>)> {
    let (min, max) = (table.vector("min", dimension), table.vector("max", dimension));
    let (min, max) = (min?, max?);
    for axis in 0..dimension {
        if max[axis] < min[axis] || (max[axis] == min[axis] && !flat) {
            let relation = if flat { "at least" } else { "more than" };
            return Err(table.problem(
                "max",
                format!(
                    "expected {relation} min = {} along {}, found {}",
                    figure(min[axis]),
                    schema::AXES[axis],
                    figure(max[axis])
                ),
            ));
        }
    }
    Ok((min, max))
}

fn polygon(table: &Table<'_>, dimension: usize) -> Got<Form> {
    if dimension != 2 {
        return Err(table.problem("polygon", "polygons are 2D; the grid is 3D"));
    }
    table.table("polygon", |t| {
        let vertices = t.points("vertices", 2)?;
        if vertices.len() < 3 {
            let message = format!("expected 3 or more corners, found {}", vertices.len());
            return Err(t.problem("vertices", message));
        }
        Ok(Form::Polygon { vertices: vertices.iter().map(|v| [v[0], v[1]]).collect() })
    })
}

fn shapes(
    table: &Table<'_>,
    name: &'static str,
    directory: &Path,
    dimension: usize,
    depth: usize,
) -> Got<Vec<Shape>> {
    let Some(node) = table.node(name) else { return Err(table.missing(name, "")) };
    let Value::Array(items) = &node.value else { return Err(table.wrong(name, node)) };
    let least = if name == "difference" { 2 } else { 1 };
    if items.len() < least {
        let message = format!("expected {least} or more shapes, found {}", items.len());
        return Err(table.problem(name, message));
    }
    let all: Vec<Got<Shape>> = items
        .iter()
        .enumerate()
        .map(|(index, item)| {
            let path = format!("{}.{index}", table.full(name));
            let part = Table::open(table.problems(), schema::section("shape"), &path, item)?;
            shape(&part, directory, dimension, depth + 1)
        })
        .collect();
    all.into_iter().collect()
}

/// A condition on the place.
pub fn condition(table: &Table<'_>, dimension: usize) -> Got<Expression> {
    let variables = if dimension == 2 { "x y X Y" } else { "x y z X Y Z" };
    let condition = table.formula("where", variables)?;
    if condition.as_constant().is_some() {
        let what = "expected a condition on x and y, such as \"x*x + y < 1\", found a constant";
        return Err(table.problem("where", what));
    }
    Ok(condition)
}

fn placement(table: &Table<'_>, dimension: usize) -> Got<Placement> {
    let translate = table.vector_if("translate", dimension);
    let rotate = table.table_if("rotate", |t| {
        let degrees = t.number("degrees");
        let about = t.vector_if("about", dimension);
        if dimension == 2 {
            t.refuse(&["axis"], "only in 3D")?;
        }
        let axis = t.vector_if("axis", 3)?.map_or([0.0, 0.0, 1.0], |a| [a[0], a[1], a[2]]);
        if axis == [0.0; 3] {
            return Err(t.problem("axis", "expected a direction, found zeros"));
        }
        let about = about?.unwrap_or_else(|| vec![0.0; dimension]);
        Ok(Turn { degrees: degrees?, about, axis })
    });
    Ok(Placement { translate: translate?.unwrap_or_default(), rotate: rotate? })
}
