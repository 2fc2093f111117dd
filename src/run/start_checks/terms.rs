//! Declared terms that have no value at a point, or act on none.

use crate::error::{Error, Result};
use crate::parallel::World;
use crate::points::Points;
use crate::system::model::Model;

use super::faulty::{of_first_point, place};

/// Error: a declared term whose stiffness is not finite or negative at a point, or zero at all of them, with its key
/// and its line. Points of bodies that come with a later stage count. Collective.
pub fn check<const D: usize>(world: &World, model: &Model<D>, points: &Points<D>) -> Result<()> {
    let deck = &model.deck;
    let mut earlier: Vec<&str> = Vec::new();
    for term in &deck.terms {
        let name = term.key().name;
        let index = earlier.iter().filter(|other| **other == name).count();
        earlier.push(name);
        let key = format!("{name}.{index}");
        let mut acts = false;
        for of in [points, &model.waiting] {
            let fault = |p: usize| {
                let wrong = |k: &f64| !k.is_finite() || *k < 0.0;
                term.stiffness(of, p).into_iter().find(wrong)
            };
            let message = of_first_point(world, of, fault, |p, k| {
                let what = format!("its stiffness is {k} N/m at {}", place(of, p));
                deck.origins.message(&key, &format!("{what}: expected a value of zero or more"))
            });
            if let Some(message) = message {
                return Err(Error::Input(message));
            }
            acts |= (0..of.len()).any(|p| term.stiffness(of, p) != [0.0; D]);
        }
        if !world.any(acts) {
            let why = "acts on no point: its stiffness is zero at all of them";
            return Err(Error::Input(deck.origins.message(&key, why)));
        }
    }
    Ok(())
}
