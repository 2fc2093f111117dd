//! What holds pieces of the material beside boundary conditions at nodes: supports of surfaces, rigid bodies and other
//! bodies that they touch, and declared terms. Each gives rows of the rigid motions ([`super::rigid_motions`]).

use crate::basis;
use crate::contact::start::corners_within;
use crate::deck::{Presence, When};
use crate::error::Result;
use crate::points::Points;
use crate::system::carried;
use crate::system::conditions::StepSpan;
use crate::system::model::Model;
use crate::system::numbering::Numbering;
use crate::system::supports::Support;
use crate::system::terms::contact::TOUCH;

use super::rigid_motions::{Extent, Restraints};

/// The pieces of the material around the points.
#[derive(Clone, Copy)]
pub struct Pieces<'a, const D: usize> {
    pub model: &'a Model<D>,
    pub points: &'a Points<D>,
    pub numbering: &'a Numbering,
    /// Of each local node.
    pub labels: &'a [u64],
    pub extent: &'a Extent<D>,
}

impl<const D: usize> Pieces<'_, D> {
    /// The piece that a point belongs to; `None` if this rank has none of its nodes.
    fn piece_of(&self, p: usize) -> Result<Option<u64>> {
        let (mut cells, mut nodes) = (Vec::new(), Vec::new());
        let (grid, basis) = (&self.model.grid, self.model.deck.method.basis);
        basis::populated_cells(grid, basis, self.points, p, None, &mut cells)?;
        cells.iter().for_each(|&cell| grid.cell_nodes(cell, &mut nodes));
        Ok(nodes.iter().find_map(|&node| self.numbering.local(node).map(|n| self.labels[n])))
    }

    /// Each direction in which an element of a surface is held, for the piece that its carrier belongs to.
    pub fn by_supports(&self, stage: usize, held: &mut Restraints<D>) -> Result<()> {
        let Pieces { model, points, .. } = self;
        for p in carried::carriers(model, points) {
            let Some(piece) = self.piece_of(p)? else { continue };
            let holds = |support: &&Support<D>| {
                model.deck.boundaries[support.boundary].presence.holds_in(stage)
            };
            for support in model.supports.iter().filter(holds) {
                for own in support.surface.carried_by(points.id[p]) {
                    let place = own.element.place;
                    if support.within.as_ref().is_some_and(|sheet| !sheet.holds(&place)) {
                        continue;
                    }
                    held.enter(piece);
                    for direction in support.projection(&own.element) {
                        held.add(piece, &self.extent.along(&place, &direction));
                    }
                }
            }
        }
        Ok(())
    }

    /// Corners that touch a rigid surface are held along its normal or, with friction, along all axes.
    pub fn by_rigid_bodies(&self, span: StepSpan, held: &mut Restraints<D>) {
        let Pieces { model, points, numbering, labels, extent } = self;
        let (contacts, basis) = (&model.contacts, model.deck.method.basis);
        let (cell, stage) = (model.grid.cell_size(), span.stage);
        // The points are where they are at the start of the run, and so is what they touch from then on.
        // What comes with a later stage finds them somewhere near.
        let stays = |presence: &Presence| presence.holds_in(stage) && presence.from <= Some(0);
        let comes = |presence: &Presence| presence.holds_in(stage) && presence.from > Some(0);
        let mut touching =
            corners_within(contacts, basis, points, TOUCH * cell, (When::default(), stays));
        touching.extend(corners_within(contacts, basis, points, cell, (span.start(), comes)));
        for corner in touching {
            let centre = &points.position[corner.point];
            let near = model.grid.values_towards(&corner.place, centre, 0.0, None);
            let node = near.and_then(|near| {
                near.nodes.iter().take(near.count).find_map(|&node| numbering.local(node))
            });
            let Some(node) = node else { continue };
            let along = contacts.pairs[corner.pair].law.symmetric();
            let along = along.then_some(&corner.near.normal);
            add_contact(extent, held, labels[node], &corner.place, along);
        }
    }

    /// Touching bodies hold each other along the normal or, with friction, along all axes.
    pub fn by_bodies(&self, touches: &[Touch<D>], held: &mut Restraints<D>) {
        for touch in touches {
            let Some(node) = self.numbering.local(touch.node) else { continue };
            let along = (!touch.rubs).then_some(&touch.normal);
            add_contact(self.extent, held, self.labels[node], &touch.place, along);
        }
    }

    /// Points that declared terms hold.
    pub fn by_terms(&self, held: &mut Restraints<D>) -> Result<()> {
        let Pieces { model, points, extent, .. } = self;
        for term in &model.deck.terms {
            for p in 0..points.len() {
                let stiffness = term.stiffness(points, p);
                if stiffness == [0.0; D] {
                    continue;
                }
                let Some(piece) = self.piece_of(p)? else { continue };
                for axis in (0..D).filter(|&axis| stiffness[axis] > 0.0) {
                    held.add(piece, &extent.component(&points.position[p], axis));
                }
            }
        }
        Ok(())
    }
}

/// Where another body holds a piece of the material.
pub struct Touch<const D: usize> {
    /// A node of the grid that moves the piece there.
    pub node: usize,
    /// m
    pub place: [f64; D],
    pub normal: [f64; D],
    /// Along the surface, too.
    pub rubs: bool,
}

/// Holds a place along a direction, or along all axes.
fn add_contact<const D: usize>(
    extent: &Extent<D>,
    held: &mut Restraints<D>,
    piece: u64,
    place: &[f64; D],
    along: Option<&[f64; D]>,
) {
    held.enter(piece);
    match along {
        Some(normal) => held.add(piece, &extent.along(place, normal)),
        None => (0..D).for_each(|axis| held.add(piece, &extent.component(place, axis))),
    }
}
