//! `[grid]`: lattice or mesh, which sets the dimension of the problem.

use std::path::Path;

use crate::basis::Domain;
use crate::deck::model::{
    Basis, BodySource, Boundary, Deck, Element, Grid, LatticeGrid, Locking, MeshGrid, MeshMotion,
    MeshSource, Method, Place, Seeding,
    stations::{self, Station},
};
use crate::deck::problems::{Got, figure};
use crate::deck::reader::Table;
use crate::deck::schema::{ANY, AXES, POSITIVE};
use crate::deck::tree::Value;

/// Node numbers travel as 64-bit floats too, which hold whole numbers up to here.
const MOST_NODES: usize = 1 << 53;

/// The grid and the dimension of the problem.
pub fn grid(table: &Table<'_>, directory: &Path) -> Got<(Grid, usize)> {
    if table.choice_of("type", &["lattice", "mesh"])? == 0 {
        let why = "only for type = \"mesh\"";
        let refused = table.refuse(&["file", "dimension", "generate", "motion"], why);
        let (lattice, dimension) = lattice(table)?;
        refused?;
        Ok((Grid::Lattice(lattice), dimension))
    } else {
        let why = "only for type = \"lattice\"";
        let refused = table.refuse(&["origin", "size", "cells", "h"], why);
        let (source, dimension) = source(table, directory)?;
        let motion = table.table_if("motion", |motion| motion_of(&motion, dimension));
        refused?;
        let motion = motion?.unwrap_or(MeshMotion::Fixed);
        Ok((Grid::Mesh(MeshGrid { source, motion }), dimension))
    }
}

/// Two or three, from the lengths of the arrays given.
fn dimension_of(table: &Table<'_>, keys: &[&'static str]) -> Got<usize> {
    let lengths: Vec<(&str, usize)> =
        keys.iter().filter_map(|key| Some((*key, table.length(key)?))).collect();
    let Some((first, dimension)) = lengths.first().copied() else { return Ok(2) };
    if !(2..=3).contains(&dimension) {
        let message = format!("expected 2 (plane strain) or 3 values, found {dimension}");
        return Err(table.problem(first, message));
    }
    if let Some((key, other)) = lengths.iter().find(|(_, length)| *length != dimension) {
        let message = format!("expected {dimension} values, as many as {first} has, found {other}");
        return Err(table.problem(key, message));
    }
    Ok(dimension)
}

fn lattice(table: &Table<'_>) -> Got<(LatticeGrid, usize)> {
    let extent = table.one_of(&["size", "cells"])?;
    let dimension = dimension_of(table, &[extent, "origin", "h"])?;
    let origin = table.vector_if("origin", dimension);
    let h = table.number_or_vector_if("h", dimension);
    let cells = table.counts_if("cells", dimension);
    let size = table.vector_if("size", dimension);
    let spacing = h?.ok_or_else(|| table.missing("h", "type = \"lattice\" needs it"))?;
    let cells = match (cells?, size?) {
        (Some(cells), _) => cells,
        (None, Some(size)) => (0..dimension)
            .map(|axis| whole_cells(table, axis, size[axis], spacing[axis]))
            .collect::<Got<_>>()?,
        (None, None) => return Err(table.missing("size", "or give cells")),
    };
    let nodes = cells.iter().try_fold(1usize, |all, n| all.checked_mul(n.checked_add(1)?));
    if nodes.is_none_or(|nodes| nodes > MOST_NODES) {
        let message = format!("{cells:?} cells are more than can be numbered");
        return Err(table.problem(extent, message));
    }
    let origin = origin?.unwrap_or_else(|| vec![0.0; dimension]);
    Ok((LatticeGrid { origin, spacing, cells }, dimension))
}

fn whole_cells(table: &Table<'_>, axis: usize, size: f64, h: f64) -> Got<usize> {
    let cells = size / h;
    let whole = cells.round();
    if whole >= 1.0 && (cells - whole).abs() <= 1e-9 * whole && whole < 1e15 {
        return Ok(whole as usize);
    }
    let (fewer, more) = (cells.floor().max(1.0), cells.ceil().max(1.0));
    let near = if fewer == more {
        length_of(fewer, h)
    } else {
        format!("{} or {}", length_of(fewer, h), length_of(more, h))
    };
    let count = if (1e-5..1e15).contains(&cells) { format!("{cells:.6}") } else { figure(cells) };
    if whole >= 1e15 {
        let (size, h) = (figure(size), figure(h));
        let message = format!(
            "{size} m along {} with h = {h} m is {count} cells, more than can be numbered",
            AXES[axis]
        );
        return Err(table.problem("size", message));
    }
    Err(table.problem(
        "size",
        format!(
            "expected whole cells, found {} m along {} with h = {} m, which is {count} cells; nearest: {near} m",
            figure(size),
            AXES[axis],
            figure(h)
        ),
    ))
}

/// `cells` spacings of `h` as a user would write them: 6 of 0.3 are 1.8, not 1.7999999999999998.
fn length_of(cells: f64, h: f64) -> String {
    let length = cells * h;
    figure(format!("{length:.12e}").parse().unwrap_or(length))
}

fn source(table: &Table<'_>, directory: &Path) -> Got<(MeshSource, usize)> {
    if table.one_of(&["file", "generate"])? == "file" {
        let dimension = table.count_if("dimension")?.unwrap_or(2);
        return Ok((MeshSource::File(directory.join(table.text("file")?)), dimension));
    }
    let refused = table.refuse(&["dimension"], "only with file; a generated mesh knows its own");
    let made = table.table("generate", |table| match table.one_of(&["annulus", "box"])? {
        "annulus" => Ok((table.table("annulus", |annulus| annulus_of(&annulus))?, 2)),
        _ => table.table("box", |table| box_of(&table)),
    });
    refused?;
    made
}

fn annulus_of(table: &Table<'_>) -> Got<MeshSource> {
    let inner = match table.node("inner") {
        None => Err(table.missing("inner", "")),
        Some(node) => match &node.value {
            Value::Array(items) if items.len() == 2 => table
                .number_from("inner", &items[0], POSITIVE)
                .and_then(|a| Ok([a, table.number_from("inner", &items[1], POSITIVE)?])),
            Value::Array(_) => Err(table.wrong("inner", node)),
            _ => table.number_from("inner", node, POSITIVE).map(|radius| [radius; 2]),
        },
    };
    let outer = table.number("outer");
    let radial = table.count("radial");
    let around = table.count("around");
    let element = table.choice_of("element", &["quad4", "tri3"]);
    let grading = table.number("grading");
    let (inner, outer) = (inner?, outer?);
    let widest = inner[0].max(inner[1]);
    if widest >= outer {
        let message = format!(
            "expected a hole smaller than outer = {} m, found {} m",
            figure(outer),
            figure(widest)
        );
        return Err(table.problem("inner", message));
    }
    let element = if element? == 0 { Element::Quad4 } else { Element::Tri3 };
    Ok(MeshSource::Annulus {
        inner,
        outer,
        radial: radial?,
        around: around?,
        element,
        grading: grading?,
    })
}

fn box_of(table: &Table<'_>) -> Got<(MeshSource, usize)> {
    let graded = table.given("spacing");
    let dimension =
        dimension_of(table, if graded { &["spacing"] } else { &["min", "max", "cells"] })?;
    let (min, max, cells, stations) = if graded {
        table.refuse(&["min", "max", "cells"], "only without spacing, which tells them")?;
        let axes = stations_of(table, dimension)?;
        let end = |last: bool| {
            axes.iter().map(|axis| axis[if last { axis.len() - 1 } else { 0 }][0]).collect()
        };
        let cells = axes.iter().map(|axis| stations::count_cells(axis)).collect();
        (end(false), end(true), cells, axes)
    } else {
        let (min, max) = super::shapes::corners(table, dimension, false)?;
        let cells = table.counts_if("cells", dimension)?;
        (min, max, cells.ok_or_else(|| table.missing("cells", ""))?, Vec::new())
    };
    let allowed = if dimension == 2 {
        [Element::Quad4, Element::Tri3]
    } else {
        [Element::Hex8, Element::Tet4]
    };
    let element = if table.given("element") {
        allowed[table.choice_of("element", &allowed.map(Element::name))?]
    } else {
        allowed[0]
    };
    Ok((MeshSource::Box { min, max, cells, stations, element }, dimension))
}

/// For each axis at least two pairs of a place and the spacing there; places ascend.
fn stations_of(table: &Table<'_>, dimension: usize) -> Got<Vec<Vec<Station>>> {
    let node = table.node("spacing").ok_or_else(|| table.missing("spacing", ""))?;
    let Value::Array(axes) = &node.value else { return Err(table.wrong("spacing", node)) };
    let mut made = Vec::with_capacity(dimension);
    for axis in axes {
        let Value::Array(pairs) = &axis.value else { return Err(table.wrong("spacing", axis)) };
        let mut stations: Vec<Station> = Vec::with_capacity(pairs.len());
        for pair in pairs {
            match &pair.value {
                Value::Array(items) if items.len() == 2 => stations.push([
                    table.number_from("spacing", &items[0], ANY)?,
                    table.number_from("spacing", &items[1], POSITIVE)?,
                ]),
                _ => return Err(table.wrong("spacing", pair)),
            }
        }
        if stations.len() < 2 || stations.windows(2).any(|two| !(two[1][0] > two[0][0])) {
            return Err(table.problem(
                "spacing",
                "expected two or more pairs [place, spacing] for each axis, places ascending",
            ));
        }
        made.push(stations);
    }
    Ok(made)
}

fn motion_of(table: &Table<'_>, dimension: usize) -> Got<MeshMotion> {
    if table.one_of(&["rotate_with", "follow"])? == "rotate_with" {
        return Ok(MeshMotion::RotateWith(table.text("rotate_with")?));
    }
    match table.node("follow").map(|node| (&node.value, node)) {
        Some((Value::String(word), _)) if word == "material" => Ok(MeshMotion::Material),
        Some((Value::String(word), node)) => {
            Err(table.unknown_word("follow", word, &["material"], &node.origin))
        }
        Some((Value::Array(items), _)) if !items.is_empty() => {
            let axes = table.choices("follow", &AXES[..dimension])?;
            Ok(MeshMotion::Follow(axes))
        }
        Some((_, node)) => Err(table.wrong("follow", node)),
        None => Err(table.missing("follow", "")),
    }
}

/// GIMP domains are boxes that are cut by the planes of a lattice.
pub fn check_basis(table: &Table<'_>, grid: &Grid, method: &Method) -> Got<()> {
    if matches!(grid, Grid::Mesh(_)) && method.basis.domain() == Domain::Box {
        return Err(table.problem_with_help(
            "type",
            "method.basis = \"gimp\" needs type = \"lattice\"",
            match method.affine {
                Some(_) => {
                    "on a mesh basis = \"mpm\" with mass = \"consistent\" and velocity_update = \
                     \"flip\" keeps the angular momentum"
                }
                None => "on a mesh use basis = \"mpm\", \"cpdi1\" or \"cpdi2\"",
            },
        ));
    }
    let corners = method.basis.domain().has_corners();
    if matches!(grid, Grid::Mesh(_)) && corners && method.locking == Locking::FBar {
        return Err(table.problem_with_help(
            "type",
            format!(
                "method.locking = \"f-bar\" with basis = \"{}\" needs type = \"lattice\": its means over \
                 cells are those of boxes",
                method.basis.name()
            ),
            "on a mesh use basis = \"mpm\", or locking = \"none\"",
        ));
    }
    Ok(())
}

/// A mesh can only turn with a tag whose rotation is prescribed.
pub fn check_motion(table: &Table<'_>, grid: &Grid, boundaries: &[Boundary]) -> Got<()> {
    let Grid::Mesh(MeshGrid { motion: MeshMotion::RotateWith(tag), .. }) = grid else {
        return Ok(());
    };
    let turns = |boundary: &&Boundary| {
        boundary.rotation.is_some() && boundary.place == Place::Tag(tag.clone())
    };
    if boundaries.iter().find(turns).is_some() {
        return Ok(());
    }
    table.table("motion", |motion| {
        Err(motion.problem(
            "rotate_with",
            format!("no [[boundary]] with where = {{ tag = \"{tag}\" }} prescribes a rotation"),
        ))
    })
}

/// `method.control = "fem"`: finite elements are Gauss points that stay at their places in a mesh
/// which follows the material, with the standard basis.
pub fn make_finite_elements(table: &Table<'_>, deck: &mut Deck) -> Got<()> {
    if table.table_or_default("method", |method| method.choice_of("control", &["off", "fem"]))? == 0
    {
        return Ok(());
    }
    let Grid::Mesh(mesh) = &mut deck.grid else {
        return table.table("method", |method| {
            let message = "control = \"fem\" needs grid.type = \"mesh\"";
            Err(method.problem("control", message))
        });
    };
    mesh.motion = MeshMotion::Material;
    deck.method.basis = Basis::Mpm;
    for body in &mut deck.bodies {
        if let BodySource::Shape { seeding, .. } | BodySource::MeshCells { seeding, .. } =
            &mut body.source
            && let Seeding::PerCell(counts) = seeding
        {
            *seeding = Seeding::Gauss(counts.iter().copied().max().unwrap_or(2).min(8));
        }
    }
    Ok(())
}
