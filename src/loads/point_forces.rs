//! f_ext = S b + S f_p over the points (Lagrangian eq. 24, 25, 29): gravity on the constant
//! mass, body forces per initial volume, point forces held by the points.

use crate::basis::Influences;
use crate::deck::Scope;
use crate::deck::model::{AnalysisType, Load};
use crate::error::{Error, Result};
use crate::material::{Material, local};
use crate::points::Points;

use super::manufactured::Manufactured;
use crate::system::numbering::Numbering;

/// Force on each point, N, at load factor `s` and time `t`. In quasi-static runs loads grow with
/// the load factor unless an expression holds `s` or `t` itself.
pub fn point_forces<const D: usize>(
    points: &Points<D>,
    materials: &[Material],
    loads: &[Load],
    manufactured: Option<&Manufactured>,
    kind: AnalysisType,
    load_factor: f64,
    time: f64,
) -> Result<Vec<[f64; D]>> {
    let ramp = if kind == AnalysisType::QuasiStatic { load_factor } else { 1.0 };
    let mut forces: Vec<[f64; D]> =
        points.point_force.iter().map(|force| force.map(|f| f * ramp)).collect();
    for load in loads {
        match load {
            Load::Point { .. } => {}
            Load::Gravity(gravity) => {
                for (force, mass) in forces.iter_mut().zip(&points.mass) {
                    for (f, g) in force.iter_mut().zip(gravity) {
                        *f += ramp * g * mass;
                    }
                }
            }
            Load::BodyForce(expressions) => {
                for (p, force) in forces.iter_mut().enumerate() {
                    let scope = scope_of(points, p, load_factor, time);
                    for (f, expression) in force.iter_mut().zip(expressions) {
                        let own = if expression.depends_on_time() { 1.0 } else { ramp };
                        *f += own * expression.value(&scope) * points.volume_initial[p];
                    }
                }
            }
            Load::Manufactured(_) => {
                let Some(manufactured) = manufactured else { continue };
                for (p, force) in forces.iter_mut().enumerate() {
                    let scope = scope_of(points, p, load_factor, time);
                    let material = local(materials, points, p);
                    let made: [f64; D] = manufactured.force(material, &scope)?;
                    for (f, b) in force.iter_mut().zip(made) {
                        *f += b * points.volume_initial[p];
                    }
                }
            }
        }
    }
    match forces.iter().position(|force| force.iter().any(|f| !f.is_finite())) {
        None => Ok(forces),
        Some(p) => Err(Error::Input(format!(
            "the load on point {} at {:?} is not finite ({:?} N at s = {load_factor}): check the \
             expressions of [[load]]",
            points.id[p], points.position[p], forces[p]
        ))),
    }
}

/// Variables of an expression at a point.
pub fn scope_of<const D: usize>(
    points: &Points<D>,
    p: usize,
    load_factor: f64,
    time: f64,
) -> Scope {
    let mut scope = Scope { load_factor, time, ..Scope::default() };
    scope.initial[..D].copy_from_slice(&points.position_initial[p]);
    scope.current[..D].copy_from_slice(&points.position[p]);
    scope
}

/// Maps point forces to the local nodes; ghost shares are not yet sent to their owners.
pub fn map_forces<const D: usize>(
    numbering: &Numbering,
    influences: &Influences<D>,
    forces: &[[f64; D]],
) -> Vec<f64> {
    let mut nodal = vec![0.0; numbering.len() * D];
    for (p, force) in forces.iter().enumerate() {
        if force.iter().all(|&f| f == 0.0) {
            continue;
        }
        for entry in influences.offsets[p]..influences.offsets[p + 1] {
            let local = numbering.index[influences.nodes[entry]] as usize;
            for (axis, f) in force.iter().enumerate() {
                nodal[local * D + axis] += influences.weights[entry] * f;
            }
        }
    }
    nodal
}
