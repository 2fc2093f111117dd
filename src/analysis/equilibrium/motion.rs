//! The terms of a step whose unknowns are displacements.

use crate::deck::model::Frame;
use crate::error::Result;
use crate::parallel::World;
use crate::system::step_system::Discretisation;
use crate::system::terms::Term;
use crate::system::terms::ghost::Ghost;
use crate::system::terms::stress::{StepPoints, Stress};

/// Stress and Ghost stiffness, and the `further` terms of the step after them. `frame`: the configuration that
/// stresses and gradients refer to; `symmetric`: the tangent of the stress equals its transposed. Collective.
pub fn terms<'a, const D: usize>(
    world: &World,
    mesh: &'a Discretisation<D>,
    step: StepPoints<'a, D>,
    (frame, symmetric): (Frame, bool),
    mut further: Vec<Box<dyn Term<D> + 'a>>,
) -> Result<Vec<Box<dyn Term<D> + 'a>>> {
    // A new term is a line here.
    let mut terms: Vec<Box<dyn Term<D> + 'a>> = vec![Box::new(Stress { step, frame, symmetric })];
    if let Some(ghost) = Ghost::new(world, mesh)? {
        terms.push(Box::new(ghost));
    }
    terms.append(&mut further);
    Ok(terms)
}
