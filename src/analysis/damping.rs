//! a - d with d = α |a| sign(v) + c v at each component of each node: local non-viscous damping
//! (Cundall 1987), which takes a share of the force out of balance, and mass-proportional damping.
//!
//! With the consistent mass the force of local damping is M~ d, of the same accelerations.

use crate::deck::model::Damping;
use crate::error::Result;
use crate::mass::grid_mass::GridMass;
use crate::parallel::World;
use crate::system::step_system::Discretisation;

/// d at one component.
fn slowing(damping: Damping, v: f64, a: f64) -> f64 {
    let against = if v == 0.0 { 0.0 } else { v.signum() };
    damping.local * a.abs() * against + damping.mass * v
}

/// d of the owned degrees of freedom, zero where a boundary holds, with copies at the ghosts.
/// Collective.
pub(super) fn deceleration<const D: usize>(
    world: &World,
    mesh: &Discretisation<D>,
    damping: Damping,
    fixed: &[bool],
    velocity: &[f64],
    acceleration: &[f64],
) -> Result<Vec<f64>> {
    let numbering = &mesh.numbering;
    let mut all = vec![0.0; numbering.len() * D];
    for dof in (0..numbering.owned * D).filter(|&dof| !fixed[dof]) {
        all[dof] = slowing(damping, velocity[dof], acceleration[dof]);
    }
    numbering.halo.forward(world, &mut all, D)?;
    Ok(all)
}

/// Work of the force M~ d over the increments `moved`, this rank's share, J.
pub(super) fn dissipated<const D: usize>(
    mass: &GridMass,
    mesh: &Discretisation<D>,
    deceleration: &[f64],
    moved: impl Iterator<Item = f64>,
) -> f64 {
    mass.multiply(mesh, deceleration).iter().zip(moved).map(|(force, u)| force * u).sum()
}
