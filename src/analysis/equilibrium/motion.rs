//! The terms of a step whose unknowns are displacements.

use crate::deck::model::Frame;
use crate::error::Result;
use crate::system::terms::Term;
use crate::system::terms::declaration::{self, Context};
use crate::system::terms::ghost::Ghost;
use crate::system::terms::stress::Stress;

/// Stress and Ghost stiffness, the terms that tables of the deck switch on, and the `further` terms of the step after
/// them. `frame`: the configuration that stresses and gradients refer to; `symmetric`: the tangent of the stress
/// equals its transposed. Collective.
pub fn terms<'a, const D: usize>(
    of: Context<'a, D>,
    (frame, symmetric): (Frame, bool),
    mut further: Vec<Box<dyn Term<D> + 'a>>,
) -> Result<Vec<Box<dyn Term<D> + 'a>>> {
    let stress = Stress { step: of.step, frame, symmetric, associated: of.model.associated };
    let mut terms: Vec<Box<dyn Term<D> + 'a>> = vec![Box::new(stress)];
    if let Some(ghost) = Ghost::new(of.world, of.mesh)? {
        terms.push(Box::new(ghost));
    }
    terms.extend(declaration::of_deck(of)?);
    terms.append(&mut further);
    Ok(terms)
}
