//! The force of bodies and boundaries that go with a stage is released over that stage.
//!
//! In quasi-static steps the bodies were in balance before. The force g = f_int - f_ext that is out
//! of balance at the start of a step is therefore the force of all that has gone. At the end of the
//! step g (1 - s') / (1 - s) acts: over the stage the force falls in full to nothing, whatever the
//! steps, and nothing has to be remembered between steps.
//!
//! In dynamics the points of a body that goes act with the share 1 - s of their stress: s f_int of
//! these points pushes against it.

use crate::error::Result;
use crate::parallel::World;
use crate::points::Points;
use crate::system::conditions::StepSpan;
use crate::system::model::Model;
use crate::system::scatter::BlockMatrix;
use crate::system::step_system::Discretisation;
use crate::system::terms::stress;
use crate::transfer::mapping::{self, Deformation};

/// Whether a quasi-static stage releases what held the bodies.
pub(super) fn releases<const D: usize>(model: &Model<D>, stage: usize) -> bool {
    let deck = &model.deck;
    deck.analysis.kind.is_static()
        && (deck.bodies.iter().any(|body| body.presence.fades_in(stage))
            || deck.boundaries.iter().any(|boundary| boundary.presence.fades_in(stage)))
}

/// g of the owned degrees of freedom at the step's start, N, and its share at the end. `external`:
/// f_ext at the start. Collective.
pub(super) fn released<const D: usize>(
    world: &World,
    model: &Model<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    external: &[f64],
    span: StepSpan,
) -> Result<(Vec<f64>, f64)> {
    let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);
    let size = numbering.len() * D;
    let (still, mut force) = (vec![0.0; size], vec![0.0; size]);
    let step = mesh.step_points(points, &model.materials);
    let frame = model.deck.method.frame;
    let none = None::<&mut BlockMatrix<D>>;
    stress::assemble(step, frame, numbering, pattern, &still, &mut force, none);
    numbering.halo.reverse_add(world, &mut force, D)?;
    force.truncate(numbering.owned * D);
    for (force, external) in force.iter_mut().zip(external) {
        *force -= external;
    }
    // Trials of a strength reduction begin where all is released.
    let left = 1.0 - span.factor_start;
    Ok((force, if left > 0.0 { (1.0 - span.factor_end) / left } else { 0.0 }))
}

/// In dynamics: the share at s of the internal force of points whose bodies go in this stage, this
/// rank's part of it at the local nodes, N; empty where none goes.
pub(super) fn counter_force<const D: usize>(
    model: &Model<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    (stage, factor): (usize, f64),
) -> Vec<f64> {
    let fades: Vec<bool> =
        model.deck.bodies.iter().map(|body| body.presence.fades_in(stage)).collect();
    if !fades.contains(&true) {
        return Vec::new();
    }
    let mut forces = vec![[0.0; D]; mesh.numbering.len()];
    let (step, still) = (mesh.step_points(points, &model.materials), Deformation::default());
    for p in (0..points.len()).filter(|&p| fades[points.body[p] as usize]) {
        mapping::add_force(step, p..p + 1, &[], &still, &mut forces);
    }
    // `add_force` adds what the stress exerts on the nodes, -f_int.
    forces.into_flattened().into_iter().map(|force| -factor * force).collect()
}

/// Sums of all ranks at the owned degrees of freedom; nothing for nothing. Collective.
pub(super) fn owned<const D: usize>(
    world: &World,
    mesh: &Discretisation<D>,
    mut shares: Vec<f64>,
) -> Result<Vec<f64>> {
    if !shares.is_empty() {
        mesh.numbering.halo.reverse_add(world, &mut shares, D)?;
        shares.truncate(mesh.numbering.owned * D);
    }
    Ok(shares)
}
