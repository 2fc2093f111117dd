//! External forces at the nodes that follow the motion within a step: pressures by virtual stress, and
//! what acts on surfaces.

use crate::deck::When;
use crate::error::Result;
use crate::parallel::World;
use crate::points::Points;
use crate::system::in_place::InPlace;
use crate::system::model::Model;
use crate::system::pattern::Pattern;

use crate::system::step_system::Discretisation;

use super::pressure::PressureTerm;
use super::surface::SurfaceTerm;
use super::term::{At, Part};
use crate::system::step_points::StepPoints;

/// Forces that follow an iterate of `N` unknowns per node. No call is made per point.
pub trait Follow<const N: usize> {
    /// Adds this rank's shares of the force at an iterate, N, and the tangent of its negative where
    /// there are `rows`.
    fn add_shares(
        &self,
        part: Part,
        at: At<'_>,
        force: &mut [f64],
        rows: Option<&mut InPlace<'_, N>>,
    );

    /// Adds the stiffness by which supports hold local nodes, this rank's share, N/m.
    fn add_penalties(&self, stiffness: &mut [f64]);
}

/// What a deck has of these forces, at one moment of a step.
pub struct Following<'a, const D: usize> {
    step: StepPoints<'a, D>,
    pressure: Option<PressureTerm<'a>>,
    surface: Option<SurfaceTerm<'a, D>>,
}

impl<'a, const D: usize> Following<'a, D> {
    /// `None` where the deck has none.
    pub fn new(
        model: &'a Model<D>,
        mesh: &'a Discretisation<D>,
        points: &'a Points<D>,
        when: When,
    ) -> Option<Self> {
        let step = mesh.step_points(points, &model.materials);
        let pressure = PressureTerm::new(model, when);
        let surface = SurfaceTerm::new(model, step, &mesh.carriers, when);
        let any = pressure.is_some() || surface.is_some();
        any.then_some(Following { step, pressure, surface })
    }

    /// This rank's share of the force at `nodes` local nodes at the step's start, N.
    pub fn at_start(&self, pattern: &Pattern, nodes: usize) -> Vec<f64> {
        let mut force = match &self.pressure {
            Some(pressure) => pressure.at_start(self.step, pattern, nodes),
            None => vec![0.0; nodes * D],
        };
        if let Some(surface) = &self.surface {
            let on_surface = surface.at_start(self.step, pattern, nodes);
            force.iter_mut().zip(on_surface).for_each(|(sum, f)| *sum += f);
        }
        force
    }

    /// [`Self::at_start`] of all ranks at the owned nodes. Collective.
    pub fn owned_at_start(&self, world: &World, mesh: &Discretisation<D>) -> Result<Vec<f64>> {
        let numbering = &mesh.numbering;
        let mut force = self.at_start(&mesh.pattern, numbering.len());
        numbering.halo.reverse_add(world, &mut force, D)?;
        force.truncate(numbering.owned * D);
        Ok(force)
    }
}

impl<const D: usize> Follow<D> for Following<'_, D> {
    fn add_shares(
        &self,
        part: Part,
        at: At<'_>,
        force: &mut [f64],
        mut rows: Option<&mut InPlace<'_, D>>,
    ) {
        if let Some(pressure) = &self.pressure {
            pressure.add_shares(self.step, part, at, force, rows.as_deref_mut());
        }
        if let Some(surface) = &self.surface {
            surface.add_shares(self.step, part, at, force, rows);
        }
    }

    fn add_penalties(&self, stiffness: &mut [f64]) {
        if let Some(surface) = &self.surface {
            surface.add_penalties(self.step, stiffness);
        }
    }
}
