//! X~ <- X~ + du or R (X~ - c) + c: where the mesh goes between steps (Rotation §2 (viii)).
//!
//! | deck value | nodes |
//! |---|---|
//! | none | stay |
//! | `rotate_with = "TAG"` | turn rigidly, all of them, with the tag's prescribed rotation |
//! | `follow = ["x"]` | take the computed displacement along the named axes only |
//! | `follow = "material"` | take the computed displacement wholly |
//!
//! A cell may not turn over. One that follows the material wholly may fold at a corner as long
//! as its 2-point Gauss rule stays sound: that is what its material points, seeded there, see,
//! and how finite elements survive distortion beyond their worth.
//!
//! A node that no material touches has no computed displacement and stays where it is.

use crate::deck::model::MeshMotion;
use crate::error::{Error, Result};

use super::check::{first_inverted, first_inverted_at};
use super::mesh::Mesh;
use super::quadrature::gauss_rule;

impl<const D: usize> Mesh<D> {
    /// Moves the mesh at the end of a step. `displacement(node)` is the node's total of the
    /// step, m, or `None` where nothing was computed; `rotation` is centre (m) and angle of the
    /// step (rad, counter-clockwise about z), needed with `rotate_with` only.
    ///
    /// Error: a cell would turn over; it is named with its place, and the mesh is unchanged.
    pub fn advance(
        &mut self,
        motion: &MeshMotion,
        displacement: impl Fn(usize) -> Option<[f64; D]>,
        rotation: Option<([f64; D], f64)>,
    ) -> Result<()> {
        let moved: Vec<[f64; D]> = match motion {
            MeshMotion::Fixed => return Ok(()),
            MeshMotion::RotateWith(tag) => {
                let Some((centre, angle)) = rotation else {
                    return Err(Error::Input(format!(
                        "{}: the mesh is to rotate with \"{tag}\", but no boundary of that tag \
                         has a rotation",
                        self.name
                    )));
                };
                let (sine, cosine) = angle.sin_cos();
                let turn = |x: &[f64; D]| {
                    let mut out = *x;
                    let (dx, dy) = (x[0] - centre[0], x[1] - centre[1]);
                    out[0] = centre[0] + cosine * dx - sine * dy;
                    out[1] = centre[1] + sine * dx + cosine * dy;
                    out
                };
                self.positions.iter().map(turn).collect()
            }
            MeshMotion::Follow(axes) => self.follow(displacement, |axis| axes.contains(&axis)),
            MeshMotion::Material => self.follow(displacement, |_| true),
        };
        let element = self.element;
        let fold = first_inverted(element, &moved, &self.cells);
        let fault = if *motion == MeshMotion::Material {
            let gauss: Vec<[f64; D]> = gauss_rule(element, 2).iter().map(|(xi, _)| *xi).collect();
            fold.and_then(|_| first_inverted_at(element, &moved, &self.cells, &gauss))
        } else {
            fold
        };
        if let Some((cell, place)) = fault {
            let nodes = self.nodes_of(cell);
            let node = nodes[place % nodes.len()] as usize;
            return Err(Error::Run(format!(
                "{}: moving the mesh turns over cell {cell} (nodes {nodes:?}) at node {node}, \
                 which goes from {:?} to {:?}; use smaller steps or another motion of the mesh",
                self.name, self.positions[node], moved[node]
            )));
        }
        self.folded = fold.is_some();
        self.positions = moved;
        self.refresh();
        Ok(())
    }

    fn follow(
        &self,
        displacement: impl Fn(usize) -> Option<[f64; D]>,
        moves: impl Fn(usize) -> bool,
    ) -> Vec<[f64; D]> {
        let mut moved = self.positions.clone();
        for (node, x) in moved.iter_mut().enumerate() {
            if let Some(u) = displacement(node) {
                for axis in (0..D).filter(|&axis| moves(axis)) {
                    x[axis] += u[axis];
                }
            }
        }
        moved
    }

    /// Puts the nodes where a checkpoint says. Error: wrong number of nodes, or a cell turned
    /// over.
    pub fn set_positions(&mut self, positions: Vec<[f64; D]>) -> Result<()> {
        if positions.len() != self.positions.len() {
            return Err(Error::File(format!(
                "{}: stored positions are for {} nodes, the mesh has {}",
                self.name,
                positions.len(),
                self.positions.len()
            )));
        }
        let gauss: Vec<[f64; D]> = gauss_rule(self.element, 2).iter().map(|(xi, _)| *xi).collect();
        let fold = first_inverted(self.element, &positions, &self.cells);
        let fault = first_inverted_at(self.element, &positions, &self.cells, &gauss);
        if let Some((cell, _)) = fault {
            return Err(Error::File(format!(
                "{}: stored node positions turn over cell {cell}",
                self.name
            )));
        }
        self.folded = fold.is_some();
        self.positions = positions;
        self.refresh();
        Ok(())
    }
}
