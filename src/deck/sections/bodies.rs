//! `[[body]]`.

use std::path::Path;

use super::{initial_stress, shapes, stages};
use crate::basis::Domain;
use crate::deck::expression::Expression;
use crate::deck::model::{
    Analysis, Basis, Body, BodySource, Grid, LatticeGrid, MeshMotion, MeshSource, Method,
    PointNames, PointsFile, Seeding,
};
use crate::deck::problems::{Got, figure};
use crate::deck::reader::Table;
use crate::deck::schema::AXES;
use crate::deck::slips;
use crate::deck::stage::Presence;
use crate::deck::tree::Value;

/// What bodies and conditions are judged against; parts that could not be read are absent.
pub struct EarlierSections<'a> {
    pub dimension: usize,
    pub directory: &'a Path,
    pub grid: &'a Grid,
    pub analysis: Option<&'a Analysis>,
    pub method: Option<&'a Method>,
    /// Names of the stages.
    pub stages: &'a [String],
}

/// Largest modulus and density: sums over bodies of any size stay finite.
const LARGEST: f64 = 1e100;

/// Reports a value whose squares and sums would not be finite.
pub(super) fn finite_sums(table: &Table<'_>, key: &str, value: f64) -> Got<f64> {
    if value <= LARGEST {
        return Ok(value);
    }
    let what = format!(
        "expected at most {LARGEST:e}, so that energies and sums stay finite, found {}",
        figure(value)
    );
    Err(table.problem_with_help(key, what, "choose units in which the numbers are smaller"))
}

/// Names of the materials as written, whether or not they are right.
fn material_names(root: &Table<'_>) -> Vec<String> {
    match root.node("material").map(|node| &node.value) {
        Some(Value::Table(entries)) => entries.iter().map(|entry| entry.key.clone()).collect(),
        _ => Vec::new(),
    }
}

pub fn bodies(root: &Table<'_>, earlier: &EarlierSections<'_>) -> Got<Vec<Body>> {
    let (materials, names) = (material_names(root), root.names_of("body"));
    let bodies = root.tables("body", |index, table| {
        if names[..index].contains(&names[index]) {
            table.problem("name", format!("another body is called \"{}\"", names[index]));
        }
        table.text_if("name")?;
        let material = table.choice_of_names("material", &materials);
        let density = density(&table, earlier);
        let velocity = table.expressions_if("velocity", earlier.dimension);
        let overlap = table.choice_of("overlap", &["refuse", "allow"]);
        let source = table.table("shape", |shape| source(&table, &shape, earlier));
        let stress =
            table.table_if("initial_stress", |t| initial_stress::read(&t, earlier.dimension));
        let presence = stages::presence(&table, earlier.stages, Presence::BEFORE);
        let rest = || vec![Expression::constant(0.0); earlier.dimension];
        Ok(Body {
            name: names[index].clone(),
            material: material?,
            density: density?,
            source: source?,
            velocity: velocity?.unwrap_or_else(rest),
            may_overlap: overlap? == 1,
            initial_stress: stress?,
            presence: presence?,
        })
    })?;
    if bodies.is_empty() {
        return Err(root.missing("body", "expected a [[body]]"));
    }
    Ok(bodies)
}

fn density(table: &Table<'_>, earlier: &EarlierSections<'_>) -> Got<f64> {
    let density = finite_sums(table, "density", table.number_if("density")?.unwrap_or(0.0))?;
    if let Some(kind) = earlier.analysis.map(|analysis| analysis.kind)
        && !kind.is_static()
        && density <= 0.0
    {
        let message = format!("expected > 0 kg/m3: analysis.type = \"{}\" needs mass", kind.name());
        return Err(table.problem("density", message));
    }
    Ok(density)
}

/// Names of columns and arrays.
fn point_names(table: &Table<'_>) -> Got<PointNames> {
    let name = |key: &str| table.text_if(key);
    Ok(PointNames {
        axes: [name("x")?, name("y")?, name("z")?],
        rates: [name("vx")?, name("vy")?, name("vz")?],
        volume: name("volume")?,
        velocity: name("velocity")?,
        body: name("body")?,
    })
}

fn source(body: &Table<'_>, shape: &Table<'_>, earlier: &EarlierSections<'_>) -> Got<BodySource> {
    let seeds = ["points_per_cell", "lattice", "gauss"];
    let placed = ["rotate", "translate"];
    if shape.given("points") {
        shape.refuse(&shapes::FORMS, "points come from a file; leave one of them out")?;
        shape.refuse(&["cells"], "points come from a file; leave one of them out")?;
        shape.refuse(&placed, "points of a file stay where they are")?;
        body.refuse(&seeds, "points come from a file: leave this key out")?;
        let path = shape.text("points").map(|name| earlier.directory.join(name));
        let of_body = shape.count_if("of_body");
        let names = shape.table_if("names", |names| point_names(&names));
        let (path, of_body, names) = (path?, of_body?, names?.unwrap_or_default());
        let file = PointsFile { path, of_body, names };
        let vtk = matches!(&file.ending()[..], "vtu" | "vtp" | "vtk");
        for (key, _) in file.names.pairs() {
            if vtk && key.len() <= 2 {
                let why = "a VTK file has its places and velocities in arrays; leave it out";
                return Err(shape.problem("names", format!("{key}: {why}")));
            }
            if !vtk && key == "velocity" {
                let why = "velocity: a table has a column for each component: vx, vy, vz";
                return Err(shape.problem("names", why));
            }
        }
        return Ok(BodySource::File(file));
    }
    shape.refuse(&["of_body", "names"], "only beside points")?;
    if shape.given("cells") {
        shape.refuse(&shapes::FORMS, "cells of the mesh are given; leave one of them out")?;
        shape.refuse(&placed, "cells of the mesh stay where they are")?;
        body.refuse(&["lattice"], "cells of the mesh are filled with points_per_cell or gauss")?;
        if matches!(earlier.grid, Grid::Lattice(_)) {
            return Err(shape.problem("cells", "only for grid.type = \"mesh\""));
        }
        let tag = shape.text("cells")?;
        let tag = (tag != "all").then_some(tag);
        return Ok(BodySource::MeshCells { tag, seeding: seeding(body, earlier)? });
    }
    let form = shapes::shape(shape, earlier.directory, earlier.dimension, 0);
    let seeding = seeding(body, earlier);
    let form = form?;
    if let (Some((low, high)), Some((min, max))) = (form.bounds(), grid_bounds(earlier.grid)) {
        for axis in 0..earlier.dimension {
            if high[axis] < min[axis] || low[axis] > max[axis] {
                let message = format!(
                    "the body lies outside the grid: {} from {} to {} m, the grid from {} to {} m",
                    AXES[axis],
                    figure(low[axis]),
                    figure(high[axis]),
                    figure(min[axis]),
                    figure(max[axis])
                );
                let help = slips::of_length(longest(&low, &high), longest(&min, &max));
                return Err(shape.problem_with_help("", message, help));
            }
        }
    }
    Ok(BodySource::Shape { shape: form, seeding: seeding? })
}

/// The longest side of a box.
fn longest(low: &[f64], high: &[f64]) -> f64 {
    low.iter().zip(high).map(|(low, high)| high - low).fold(0.0, f64::max)
}

/// Lower and upper corner, where the deck gives them.
fn grid_bounds(grid: &Grid) -> Option<(Vec<f64>, Vec<f64>)> {
    match grid {
        Grid::Lattice(LatticeGrid { origin, spacing, cells }) => {
            let ends = (0..origin.len()).map(|a| origin[a] + spacing[a] * cells[a] as f64);
            Some((origin.clone(), ends.collect()))
        }
        Grid::Mesh(mesh) => match &mesh.source {
            MeshSource::File(_) => None,
            MeshSource::Annulus { outer, .. } => Some((vec![-outer; 2], vec![*outer; 2])),
            MeshSource::Box { min, max, .. } => Some((min.clone(), max.clone())),
        },
    }
}

fn seeding(table: &Table<'_>, earlier: &EarlierSections<'_>) -> Got<Seeding> {
    let dimension = earlier.dimension;
    let given: Vec<&'static str> = ["points_per_cell", "lattice", "gauss"]
        .into_iter()
        .filter(|key| table.given(key))
        .collect();
    if given.is_empty() {
        return Ok(Seeding::PerCell(vec![2; dimension]));
    }
    match table.one_of(&["points_per_cell", "lattice", "gauss"])? {
        "points_per_cell" => {
            let counts = table.counts_if("points_per_cell", dimension)?;
            Ok(Seeding::PerCell(counts.unwrap_or_else(|| vec![2; dimension])))
        }
        "lattice" => {
            let (spacing, offset) = table.table("lattice", |lattice| {
                let spacing = lattice.number("spacing");
                let offset = lattice.vector_if("offset", dimension);
                let (spacing, offset) = (spacing?, offset?);
                domain_fits(&lattice, spacing, earlier)?;
                Ok((spacing, offset.unwrap_or_else(|| vec![0.0; dimension])))
            })?;
            Ok(Seeding::Lattice { spacing, offset })
        }
        _ => {
            let count = table.count("gauss")?;
            let follows = matches!(earlier.grid, Grid::Mesh(m) if m.motion == MeshMotion::Material);
            if !follows || earlier.method.is_some_and(|method| method.basis != Basis::Mpm) {
                return Err(table.problem(
                    "gauss",
                    "Gauss points are finite elements: they need grid.motion = { follow = \"material\" } and method.basis = \"mpm\"",
                ));
            }
            Ok(Seeding::Gauss(count))
        }
    }
}

/// A GIMP domain (as wide as the spacing of its lattice) may not be wider than a cell.
fn domain_fits(lattice: &Table<'_>, spacing: f64, earlier: &EarlierSections<'_>) -> Got<()> {
    let (Grid::Lattice(grid), Some(method)) = (earlier.grid, earlier.method) else { return Ok(()) };
    let smallest = grid.spacing.iter().copied().fold(f64::INFINITY, f64::min);
    if method.basis.domain() == Domain::Box && spacing > smallest * (1.0 + 1e-12) {
        return Err(lattice.problem(
            "spacing",
            format!(
                "expected at most the cell size {} m: with basis = \"gimp\" a domain may not be larger than a cell, found {} m",
                figure(smallest),
                figure(spacing)
            ),
        ));
    }
    Ok(())
}
