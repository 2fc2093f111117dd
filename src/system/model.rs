//! The deck made computable: grid, partition, materials, penalties and loads of a run.

use std::sync::Arc;

use crate::contact::Contacts;
use crate::contact::contacts::corners_of;
use crate::deck::model::Tangent;
use crate::deck::{Deck, When};
use crate::error::Result;
use crate::ghost::stencil::Penalty;
use crate::grid::Grid;
use crate::loads::{self, Load, Manufactured};
use crate::material::Material;
use crate::parallel::balance::Balance;
use crate::parallel::{Partition, World};
use crate::points::Points;
use crate::surface::Surface;

use super::holds;
use super::supports::Support;

/// What stays the same while points move: the deck made computable.
pub struct Model<const D: usize> {
    /// What the user asked for.
    pub deck: Deck,
    /// The background grid as it is in this step.
    pub grid: Grid<D>,
    /// Who owns what.
    pub partition: Partition<D>,
    /// One per body.
    pub materials: Vec<Material>,
    /// One per body.
    pub penalties: Vec<Penalty>,
    /// Mean stiffness scale of each body, Pa: what Ghost stiffness and penalties are factors of.
    pub stiffness: Vec<f64>,
    /// Whether the tangents of all materials, loads and contacts are symmetric in every state.
    pub symmetric: bool,
    /// Whether the tangents of all materials alone are.
    pub associated: bool,
    /// In the order of the deck.
    pub loads: Vec<Box<dyn Load<D>>>,
    /// Surfaces that are held off the grid's nodes.
    pub supports: Vec<Support<D>>,
    /// Surfaces of the bodies that touch others in implicit runs, one per body; empty without any.
    pub facing: Vec<Option<Surface<D>>>,
    /// Rigid bodies and what touches them.
    pub contacts: Arc<Contacts<D>>,
    /// The field of a `manufactured` load with its derivatives.
    pub manufactured: Option<Manufactured>,
    /// What is known of the ranks' loads.
    pub balance: Balance,
    /// Points of bodies that come with a later stage.
    pub waiting: Points<D>,
}

impl<const D: usize> Model<D> {
    /// Whether every body has Ghost stiffness.
    pub fn stabilised(&self) -> bool {
        self.penalties.iter().all(|penalty| penalty.stiffness > 0.0)
    }

    /// Whether anything acts on a body's own surface.
    pub fn acts_on_surfaces(&self) -> bool {
        !self.supports.is_empty() || self.loads.iter().any(|load| load.on_surface().is_some())
    }

    /// Names of the words of contacts, and of supports of later stages, that the points of each body carry.
    pub fn slip_names(&self) -> Vec<Vec<String>> {
        let carried: Vec<usize> =
            (0..self.deck.bodies.len()).map(|body| self.most_carried(body)).collect();
        let mut names = self.contacts.slip_names(&self.deck, &carried);
        for (body, names) in names.iter_mut().enumerate() {
            names.extend(holds::names(self, body));
        }
        names
    }

    /// First word of the elastic slip of an element that a point of a body carries, in contact with another
    /// body.
    pub fn slip_slot(&self, pair: usize, body: usize, element: usize) -> usize {
        let corners = corners_of(self.deck.method.basis, D);
        let counts = (corners, self.most_carried(body));
        self.contacts.slot_of_element((pair, body, element), counts)
    }

    /// How many elements that face other bodies a point of a body carries at most.
    fn most_carried(&self, body: usize) -> usize {
        let surface = self.facing.get(body).and_then(|surface| surface.as_ref());
        surface.map_or(0, |surface| surface.most_carried())
    }

    /// Whether the tangent of the equations equals its transposed: all of its parts say so, and the
    /// deck does not ask for the general path.
    pub fn symmetric(&self) -> bool {
        let deck = &self.deck;
        deck.analysis.tangent == Tangent::Auto && self.symmetric
    }

    /// Force of the deck's loads on each point, N. Collective. Error: one is not finite.
    pub fn point_forces(
        &self,
        world: &World,
        points: &Points<D>,
        when: When,
    ) -> Result<Vec<[f64; D]>> {
        let made = loads::on_points(points, &self.materials, &self.loads, &self.deck, when);
        world.fail_together(made)
    }
}
