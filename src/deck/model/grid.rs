//! `[grid]`.

use crate::deck::choices::choices;
use std::path::PathBuf;

use super::stations::Station;

#[derive(Debug, Clone, PartialEq)]
pub enum Grid {
    Lattice(LatticeGrid),
    Mesh(MeshGrid),
}

#[derive(Debug, Clone, PartialEq)]
pub struct LatticeGrid {
    /// m
    pub origin: Vec<f64>,
    /// m, one per axis
    pub spacing: Vec<f64>,
    /// cells per axis
    pub cells: Vec<usize>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct MeshGrid {
    pub source: MeshSource,
    pub motion: MeshMotion,
}

#[derive(Debug, Clone, PartialEq)]
pub enum MeshSource {
    /// Gmsh file, absolute or relative to the deck's folder (already joined).
    File(PathBuf),
    /// Circular (inner = [r, r]) or elliptic hole in a disc of radius `outer`, m.
    /// `grading` >= 1 refines around the ends of the long axis (1: uniform).
    Annulus {
        inner: [f64; 2],
        outer: f64,
        radial: usize,
        around: usize,
        element: Element,
        grading: f64,
    },
    Box {
        min: Vec<f64>,
        max: Vec<f64>,
        cells: Vec<usize>,
        /// Origins and distances of the grid lines of each axis; empty: equal cells.
        stations: Vec<Vec<Station>>,
        element: Element,
    },
}

#[derive(Debug, Clone, PartialEq)]
pub enum MeshMotion {
    Fixed,
    /// Rigid rotation with the named boundary tag's prescribed rotation.
    RotateWith(String),
    /// Nodes follow the computed displacement along these axes (0, 1, 2) only.
    Follow(Vec<usize>),
    /// Nodes follow the material wholly: updated-Lagrangian FEM with `gauss` seeding.
    Material,
}

choices! {
    Element {
        Quad4 = "quad4",
        Tri3 = "tri3",
        Hex8 = "hex8",
        Tet4 = "tet4",
    }
}
