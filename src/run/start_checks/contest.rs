//! Nodes that one boundary holds and another moves.

use crate::deck::model::Deck;
use crate::deck::schema::AXES;
use crate::grid::Grid;
use crate::parallel::World;
use crate::system::conditions::Conditions;
use crate::system::numbering::Numbering;

/// What the boundaries prescribe in the first step, one after another.
pub struct Contest {
    /// Per owned degree of freedom: the first boundary that holds it, and the first that moves it.
    holder: Vec<Option<u32>>,
    mover: Vec<Option<u32>>,
}

impl Contest {
    /// `owned`: nodes of this rank times the dimension.
    pub fn new(owned: usize) -> Self {
        Contest { holder: vec![None; owned], mover: vec![None; owned] }
    }

    /// Takes what boundary `index` of the deck prescribes when it is alone.
    pub fn enter(&mut self, index: usize, alone: &Conditions) {
        for dof in (0..self.holder.len()).filter(|&dof| alone.fixed[dof]) {
            let moves = alone.increment[dof] != 0.0;
            let first = if moves { &mut self.mover[dof] } else { &mut self.holder[dof] };
            first.get_or_insert(index as u32);
        }
    }

    /// Names the contested node that comes first in the grid, and counts the others. Collective.
    pub fn warning<const D: usize>(
        &self,
        world: &World,
        deck: &Deck,
        grid: &Grid<D>,
        numbering: &Numbering,
    ) -> Option<String> {
        let both = |dof: &usize| self.holder[*dof].is_some() && self.mover[*dof].is_some();
        let contested: Vec<usize> = (0..self.holder.len()).filter(both).collect();
        let count = world.sum_usize(contested.len());
        let first = contested.into_iter().min_by_key(|dof| (numbering.nodes[dof / D], dof % D));
        let message = first.and_then(|dof| {
            let (holder, mover) = (self.holder[dof]?, self.mover[dof]?);
            let name = |index: u32| &deck.boundaries[index as usize].name;
            let node = numbering.nodes[dof / D];
            let text = format!(
                "boundary \"{}\" holds {} of the node at {:?} m and boundary \"{}\" moves it; it \
                 moves ({count} such components in all; a smaller where.box leaves nodes out)",
                name(holder),
                AXES[dof % D],
                grid.node_position(node),
                name(mover)
            );
            Some(((node * D + dof % D) as u64, text))
        });
        world.lowest_message(message)
    }
}
