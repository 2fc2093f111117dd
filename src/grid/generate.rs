//! Meshes that need no file: boxes, and rings with a circular or elliptic hole.

use std::collections::BTreeMap;

use crate::deck::model::{MeshSource, stations};
use crate::error::{Error, Result};

use super::check::Draft;
use super::lattice::CELL_CORNERS;
use super::mesh::Mesh;
use super::quadrature::kuhn_simplices;
use super::{Lattice, gmsh};
use crate::deck::model::Element;

/// Boundary tags of a box, lower and upper end of each axis.
const SIDES: [[&str; 2]; 3] = [["left", "right"], ["bottom", "top"], ["back", "front"]];

impl<const D: usize> Mesh<D> {
    /// Reads or generates the mesh a deck asks for.
    pub fn build(source: &MeshSource) -> Result<Self> {
        match source {
            MeshSource::File(path) => gmsh::read(path),
            MeshSource::Box { min, max, cells, stations, element } => {
                let wrong = || input("generated box", "min, max and cells need one entry per axis");
                let min = <[f64; D]>::try_from(min.as_slice()).map_err(|_| wrong())?;
                let max = <[f64; D]>::try_from(max.as_slice()).map_err(|_| wrong())?;
                let cells = <[usize; D]>::try_from(cells.as_slice()).map_err(|_| wrong())?;
                let mut mesh = box_draft(min, max, cells, *element)?;
                for (axis, stations) in stations.iter().enumerate() {
                    let lines = stations::lines(stations);
                    let spacing = (max[axis] - min[axis]) / cells[axis] as f64;
                    for place in &mut mesh.positions {
                        let line = ((place[axis] - min[axis]) / spacing).round() as usize;
                        place[axis] = lines[line];
                    }
                }
                mesh.finish()
            }
            &MeshSource::Annulus { inner, outer, radial, around, element, grading } => {
                annulus(inner, outer, [radial, around], element, grading)
            }
        }
    }
}

fn input(what: &str, message: &str) -> Error {
    Error::Input(format!("{what}: {message}"))
}

/// Equal boxes, or each of them cut into two triangles or six tetrahedra along the diagonal
/// from its low to its high corner. Nodes and boxes run x fastest. Tags: left, right, bottom,
/// top, back, front.
pub fn box_mesh<const D: usize>(
    min: [f64; D],
    max: [f64; D],
    counts: [usize; D],
    element: Element,
) -> Result<Mesh<D>> {
    box_draft(min, max, counts, element)?.finish()
}

fn box_draft<const D: usize>(
    min: [f64; D],
    max: [f64; D],
    counts: [usize; D],
    element: Element,
) -> Result<Draft<D>> {
    const NAME: &str = "generated box";
    if element.dimension() != D {
        return Err(input(NAME, &format!("element does not fit a {D}-dimensional box")));
    }
    if counts.contains(&0) || !(0..D).all(|a| max[a] > min[a]) {
        return Err(input(NAME, "cells must be at least 1 and max above min on every axis"));
    }
    let spacing = std::array::from_fn(|a| (max[a] - min[a]) / counts[a] as f64);
    let lattice = Lattice { origin: min, spacing, cells: counts };
    check_size(NAME, lattice.node_count())?;
    let mut node_sets: BTreeMap<String, Vec<u32>> = BTreeMap::new();
    let mut positions = Vec::with_capacity(lattice.node_count());
    for node in 0..lattice.node_count() {
        let index = lattice.node_index(node);
        for a in 0..D {
            for (end, side) in [0, counts[a]].into_iter().zip(SIDES[a]) {
                if index[a] == end {
                    node_sets.entry(side.to_string()).or_default().push(node as u32);
                }
            }
        }
        // The upper ends are exactly `max`, free of the rounding of origin + n * spacing.
        positions.push(std::array::from_fn(|a| {
            if index[a] == counts[a] { max[a] } else { min[a] + spacing[a] * index[a] as f64 }
        }));
    }
    let mut cells = Vec::new();
    for cell in 0..lattice.cell_count() {
        let low = lattice.cell_index(cell);
        if element.is_simplex() {
            for simplex in kuhn_simplices(low) {
                cells.extend(simplex[..=D].iter().map(|&v| lattice.node_at(v) as u32));
            }
        } else {
            let corners = CELL_CORNERS.iter().take(1 << D);
            let node = |c: &[usize; 3]| lattice.node_at(std::array::from_fn(|a| low[a] + c[a]));
            cells.extend(corners.map(|c| node(c) as u32));
        }
    }
    Ok(Draft { positions, cells, node_sets, ..Draft::new(NAME.into(), element) })
}

/// A disc of radius `outer` (m) with an elliptic hole of semi-axes `inner` (m) along x and y,
/// both about the origin: `counts` cells along the radius and around. Node 0 is at angle 0 on
/// the hole; nodes run counter-clockwise, ring after ring. Triangles halve the quadrilaterals.
/// `grading` g >= 1: at the ends of the hole's long axis (x for a circle) the spacing around is
/// g times finer than at the ends of the short one, and along the radius it is g times finer
/// at the hole than at the rim. Tags: inner, outer.
pub fn annulus<const D: usize>(
    inner: [f64; 2],
    outer: f64,
    [radial, around]: [usize; 2],
    element: Element,
    grading: f64,
) -> Result<Mesh<D>> {
    const NAME: &str = "generated annulus";
    if D != 2 || element.dimension() != 2 {
        return Err(input(NAME, "needs two dimensions and element tri3 or quad4"));
    }
    if !(inner[0] > 0.0 && inner[1] > 0.0 && inner[0].max(inner[1]) < outer && outer.is_finite()) {
        return Err(input(NAME, "inner radii must be above 0 and below outer"));
    }
    if radial == 0 || around < 3 {
        return Err(input(NAME, "radial must be at least 1 and around at least 3"));
    }
    if !(grading >= 1.0 && grading.is_finite()) {
        return Err(input(NAME, "grading must be 1 (uniform) or more"));
    }
    check_size(NAME, (radial + 1).saturating_mul(around))?;
    // dtheta/dt = 1 - k cos 2t runs from 1 - k at the long axis to 1 + k at the short one.
    let k = (grading - 1.0) / (grading + 1.0);
    let along_x = if inner[0] >= inner[1] { 1.0 } else { -1.0 };
    let mut positions = Vec::with_capacity((radial + 1) * around);
    for ring in 0..=radial {
        let s = ring as f64 / radial as f64;
        for spoke in 0..around {
            let t = std::f64::consts::TAU * spoke as f64 / around as f64;
            let theta = t - along_x * 0.5 * k * (2.0 * t).sin();
            let direction = [theta.cos(), theta.sin()];
            // 1 at the ends of the long axis, 0 at those of the short one.
            let end = if along_x > 0.0 { direction[0] } else { direction[1] }.powi(2);
            let depth = s * (1.0 - k * end * (1.0 - s));
            positions.push(std::array::from_fn(|a| {
                ((1.0 - depth) * inner[a] + depth * outer) * direction[a]
            }));
        }
    }
    let mut cells = Vec::new();
    for ring in 0..radial {
        for spoke in 0..around {
            let next = (spoke + 1) % around;
            let node = |ring: usize, spoke: usize| (ring * around + spoke) as u32;
            let [a, b, c, d] =
                [node(ring, spoke), node(ring + 1, spoke), node(ring + 1, next), node(ring, next)];
            match element {
                Element::Tri3 => cells.extend([a, b, c, a, c, d]),
                _ => cells.extend([a, b, c, d]),
            }
        }
    }
    let ring = |ring: usize| (0..around).map(|s| (ring * around + s) as u32).collect();
    let node_sets = [("inner".to_string(), ring(0)), ("outer".to_string(), ring(radial))].into();
    Draft { positions, cells, node_sets, ..Draft::new(NAME.into(), element) }.finish()
}

/// Nodes and cells are 32-bit numbers, with room for six simplices per node.
fn check_size(name: &str, nodes: usize) -> Result<()> {
    if nodes > u32::MAX as usize / 8 {
        return Err(input(name, &format!("{nodes} nodes are too many for one mesh")));
    }
    Ok(())
}
