//! f_ext of an implicit step at both of its ends (Lagrangian eq. 29).

use crate::error::Result;
use crate::parallel::World;
use crate::points::Points;
use crate::system::conditions::{Conditions, StepSpan};
use crate::system::model::Model;
use crate::system::step_system::Discretisation;
use crate::system::terms::declaration::{self, Context};
use crate::system::terms::following::Following;
use crate::transfer::mapping;

use super::release::{counter_force, owned, released, releases};

/// External forces of a step, N.
pub(super) struct Loads<const D: usize> {
    /// On the points at the start.
    pub points_start: Vec<[f64; D]>,
    /// This rank's share of what acts on nodes at the start (forces that follow the motion, those of declared
    /// terms, later contact), at the local nodes; empty without any.
    pub nodes_start: Vec<f64>,
    /// Of the owned degrees of freedom, here and below, with those that follow the motion and those of declared
    /// terms.
    pub external_start: Vec<f64>,
    /// Both of these are added once the step is solved.
    pub external_end: Vec<f64>,
}

impl<const D: usize> Loads<D> {
    /// Collective.
    pub fn of_step(
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        mesh: &Discretisation<D>,
        span: StepSpan,
    ) -> Result<Self> {
        let points_start = model.point_forces(world, points, span.start())?;
        let points_end = model.point_forces(world, points, span.end())?;
        let mut external_start = owned_forces(world, mesh, (points, &points_start))?;
        let mut nodes_start = Vec::new();
        if let Some(following) = Following::new(model, mesh, points, span.start()) {
            nodes_start = following.at_start(&mesh.pattern, mesh.numbering.len());
            let mut owned = nodes_start.clone();
            mesh.numbering.halo.reverse_add(world, &mut owned, D)?;
            add(&mut external_start, 1.0, &owned);
        }
        let of = Context::new(world, model, (mesh, points), span);
        let exerted = declaration::exerted(of, None)?;
        if !exerted.is_empty() {
            nodes_start.resize(mesh.numbering.len() * D, 0.0);
            add(&mut nodes_start, 1.0, &exerted);
            add(&mut external_start, 1.0, &exerted);
        }
        Ok(Loads {
            external_start,
            nodes_start,
            external_end: owned_forces(world, mesh, (points, &points_end))?,
            points_start,
        })
    }
}

impl<const D: usize> Loads<D> {
    /// Adds what a stage has not yet released ([`super::release`]). Collective.
    pub fn release(
        &mut self,
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        (mesh, conditions): (&Discretisation<D>, &Conditions),
        span: StepSpan,
    ) -> Result<()> {
        if releases(model, span.stage) {
            let start = &self.external_start;
            let (mut force, share) = released(world, model, mesh, points, start, span)?;
            // What a boundary holds is not out of balance.
            force
                .iter_mut()
                .zip(&conditions.fixed)
                .filter(|(_, held)| **held)
                .for_each(|(f, _)| *f = 0.0);
            add(&mut self.external_start, 1.0, &force);
            add(&mut self.external_end, share, &force);
        } else if !model.deck.analysis.kind.is_static() {
            let at = |factor: f64| counter_force(model, mesh, points, (span.stage, factor));
            let shares = at(span.factor_start);
            self.nodes_start.resize(self.nodes_start.len().max(shares.len()), 0.0);
            add(&mut self.nodes_start, 1.0, &shares);
            add(&mut self.external_start, 1.0, &owned(world, mesh, shares)?);
            add(&mut self.external_end, 1.0, &owned(world, mesh, at(span.factor_end))?);
        }
        Ok(())
    }
}

/// a += share b over the shorter of both.
pub(super) fn add(a: &mut [f64], share: f64, b: &[f64]) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += share * b);
}

/// Nodal external force of the owned degrees of freedom. Collective.
fn owned_forces<const D: usize>(
    world: &World,
    mesh: &Discretisation<D>,
    forces: (&Points<D>, &[[f64; D]]),
) -> Result<Vec<f64>> {
    let numbering = &mesh.numbering;
    let mut nodal = mapping::forces_at_nodes(numbering, &mesh.influences, forces);
    numbering.halo.reverse_add(world, &mut nodal, D)?;
    nodal.truncate(numbering.owned * D);
    Ok(nodal)
}
