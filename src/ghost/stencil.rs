//! J_G = (h^3/3) ∫ [[dN/dn]]^T [[dN/dn]] dΓ over one face (Ghost eq. 23, 28), scalar: the same
//! for each displacement component.

use crate::deck::model::{Ghost, GhostScaling, Symmetry};
use crate::error::Result;
use crate::grid::Grid;

use super::BoundaryFace;

/// The face matrix of one boundary face and its weights in stiffness and mass.
#[derive(Debug, Clone)]
pub struct FaceStencil {
    /// Nodes of both cells, global, ascending.
    pub nodes: Vec<usize>,
    /// J_G of eq. 23 with the literal scale, row-major, `nodes.len()` squared.
    pub matrix: Vec<f64>,
    /// gamma_K times the scaling; K_G = stiffness * J_G. Zero: no stiffness share.
    pub stiffness: f64,
    /// gamma_M times the scaling; M_G = mass * J_G.
    pub mass: f64,
}

/// gamma_K (Pa) and gamma_M (kg/m3) of one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Penalty {
    pub stiffness: f64,
    pub mass: f64,
}

impl Penalty {
    /// Absolute values of the deck win over factors of the body's Young's modulus and density.
    pub fn of_body(ghost: &Ghost, young: f64, density: f64) -> Self {
        let choose = |absolute: Option<f64>, factor: Option<f64>, scale: f64| {
            absolute.or(factor.map(|factor| factor * scale)).unwrap_or(0.0)
        };
        Penalty {
            stiffness: choose(ghost.stiffness, ghost.stiffness_factor, young),
            mass: choose(ghost.mass, ghost.mass_factor, density),
        }
    }
}

/// Integrates the faces. A face shared by several bodies takes the largest penalty among them.
pub fn face_stencils<const D: usize>(
    grid: &Grid<D>,
    faces: &[BoundaryFace],
    (scaling, symmetry): (GhostScaling, Symmetry),
    penalties: &[Penalty],
) -> Result<Vec<FaceStencil>> {
    faces
        .iter()
        .map(|face| {
            let mut jump = grid.face_jump(face.pair)?;
            if symmetry == Symmetry::Axisymmetric {
                jump.make_ring();
            }
            let count = jump.nodes.len();
            let h = jump.size;
            let mut matrix = vec![0.0; count * count];
            for (weight, normal) in &jump.points {
                let factor = weight * h.powi(3) / 3.0;
                for a in 0..count {
                    for b in 0..count {
                        matrix[a * count + b] += factor * normal[a] * normal[b];
                    }
                }
            }
            let (mut stiffness, mut mass) = (0.0, 0.0);
            for (body, penalty) in penalties.iter().enumerate() {
                if face.bodies >> body & 1 == 1 {
                    stiffness = f64::max(stiffness, penalty.stiffness);
                    mass = f64::max(mass, penalty.mass);
                }
            }
            let (stiffness_scale, mass_scale) = match scaling {
                GhostScaling::Literal => (1.0, 1.0),
                GhostScaling::Published => (h * h / 4.0, h * h / 4.0),
                GhostScaling::ScaleFree => (1.0 / (h * h), 1.0),
            };
            Ok(FaceStencil {
                nodes: jump.nodes,
                matrix,
                stiffness: stiffness * stiffness_scale,
                mass: mass * mass_scale,
            })
        })
        .collect()
}
