//! The mesh between steps (Rotation §2 (viii)): every rank moves its copy alike.

use crate::deck::Deck;
use crate::deck::model::{self, MeshMotion, Place};
use crate::error::Error;
use crate::grid::Grid;
use crate::parallel::World;
use crate::system::conditions::StepSpan;
use crate::system::numbering::Numbering;

use super::refusal::{Cause, Halt, Refusal};

/// The grid after the step, or `None` where it does not move. Refused where a cell would turn over.
/// `displacement` holds the local nodes' increments. Collective.
pub fn moved<const D: usize>(
    world: &World,
    deck: &Deck,
    grid: &Grid<D>,
    numbering: &Numbering,
    displacement: &[f64],
    span: StepSpan,
) -> std::result::Result<Option<Grid<D>>, Halt> {
    let (Grid::Mesh(mesh), model::Grid::Mesh(settings)) = (grid, &deck.grid) else {
        return Ok(None);
    };
    let motion = &settings.motion;
    if *motion == MeshMotion::Fixed {
        return Ok(None);
    }
    let rotation = match motion {
        MeshMotion::RotateWith(tag) => rotation_of(deck, tag, span),
        _ => None,
    };
    let nodal = match motion {
        MeshMotion::RotateWith(_) => Vec::new(),
        _ => everywhere::<D>(world, mesh.node_count(), numbering, displacement),
    };
    let mut mesh = mesh.clone();
    let outcome = mesh.advance(
        motion,
        |node| nodal.get(node * D..(node + 1) * D).map(|u| std::array::from_fn(|a| u[a])),
        rotation,
    );
    match outcome {
        Ok(()) => Ok(Some(Grid::Mesh(mesh))),
        Err(Error::Run(what)) => Err(Refusal { cause: Cause::Cell, what }.into()),
        Err(error) => Err(error.into()),
    }
}

/// Centre and angle (rad) of the step's share of the rotation of the boundary with this tag.
fn rotation_of<const D: usize>(deck: &Deck, tag: &str, span: StepSpan) -> Option<([f64; D], f64)> {
    deck.boundaries.iter().find_map(|boundary| {
        let rotation = boundary.rotation.as_ref()?;
        let tagged = matches!(&boundary.place, Place::Tag(own) if own == tag);
        (tagged && boundary.presence.holds_in(span.stage)).then(|| {
            let span = span.seen_by(boundary.presence);
            let share = span.factor_end - span.factor_start;
            let centre = std::array::from_fn(|a| rotation.centre.get(a).copied().unwrap_or(0.0));
            (centre, rotation.degrees.to_radians() * share)
        })
    })
}

/// Owned increments of all ranks at all nodes of the replicated mesh; zero where inactive.
fn everywhere<const D: usize>(
    world: &World,
    nodes: usize,
    numbering: &Numbering,
    displacement: &[f64],
) -> Vec<f64> {
    let mut all = vec![0.0; nodes * D];
    for (local, &node) in numbering.nodes[..numbering.owned].iter().enumerate() {
        all[node * D..(node + 1) * D].copy_from_slice(&displacement[local * D..(local + 1) * D]);
    }
    world.sum_slice(&all)
}
