//! Contact in the history: its columns of a step, and their sums over a run.

use crate::contact::facets::Facets;
use crate::contact::pose::Pose;
use crate::contact::surface::length;
use crate::error::Result;
use crate::output::restart::run_state::RunState;
use crate::output::series::rigid_file::RigidFrame;
use crate::output::tables::history::{ContactState, HistoryRow, Reaction};
use crate::parallel::World;
use crate::system::model::Model;
use crate::system::terms::touching::{Finished, Met};

/// The surfaces of the rigid bodies that are there in a stage, in these poses; of half spaces what
/// crosses the grid.
pub fn surfaces<const D: usize>(
    model: &Model<D>,
    poses: &[Pose<D>],
    stage: usize,
) -> RigidFrame<D> {
    let (low, high) = model.grid.bounds();
    let middle: [f64; D] = std::array::from_fn(|a| 0.5 * (low[a] + high[a]));
    let reach: [f64; D] = std::array::from_fn(|a| 0.5 * (high[a] - low[a]));
    let mut all = Facets::default();
    let mut body = Vec::new();
    for (index, (rigid, pose)) in model.contacts.rigids.iter().zip(poses).enumerate() {
        if !rigid.presence.is_in(stage) {
            continue;
        }
        let mut own = rigid.surface.facets(&pose.to_body(&middle), length(&reach));
        own.corners.iter_mut().for_each(|corner| *corner = pose.to_space(corner));
        body.extend(own.facets.iter().map(|_| index as i64));
        all.add(own);
    }
    RigidFrame { corners: all.corners, facets: all.facets, body }
}

/// Sums of a run so far.
#[derive(Debug, Default)]
pub struct ContactTotals {
    /// J
    dissipation: f64,
    /// Lost by bodies that meet, J.
    impact: f64,
    /// Mean slip of each contact, m.
    slip: Vec<f64>,
}

impl ContactTotals {
    /// Of so many contacts.
    pub fn new(contacts: usize) -> Self {
        ContactTotals { slip: vec![0.0; contacts], ..ContactTotals::default() }
    }

    pub fn save(&self, state: &mut RunState) {
        if self.slip.is_empty() {
            return;
        }
        state.set("contact.dissipation", self.dissipation);
        state.set("contact.impact", self.impact);
        for (k, slip) in self.slip.iter().enumerate() {
            state.set(&format!("contact.slip.{k}"), *slip);
        }
    }

    pub fn restore(&mut self, state: &RunState) -> Result<()> {
        if self.slip.is_empty() {
            return Ok(());
        }
        self.dissipation = state.number("contact.dissipation")?;
        // Not known to the first checkpoints with contact.
        self.impact = state.number("contact.impact").unwrap_or(0.0);
        for (k, slip) in self.slip.iter_mut().enumerate() {
            *slip = state.number(&format!("contact.slip.{k}"))?;
        }
        Ok(())
    }

    /// Adds up a step's shares of all ranks and books them into its row. Collective.
    pub fn book<const D: usize>(
        &mut self,
        world: &World,
        finished: &Finished<D>,
        row: &mut HistoryRow,
    ) {
        let mut shares = vec![finished.energy, finished.dissipation];
        for rigid in &finished.rigids {
            shares.extend(rigid.force);
            shares.extend([rigid.sum_abs, rigid.torque[2]]);
        }
        shares.extend(finished.pairs.iter().flat_map(|pair| [pair.area, pair.slid]));
        let sums = world.sum_slice(&shares);
        let depths: Vec<f64> = finished.pairs.iter().map(|pair| pair.depth).collect();
        let depths = world.max_slice(&depths);
        let (rigids, pairs) = sums[2..].split_at(5 * finished.rigids.len());
        let exerted = rigids.chunks_exact(5).map(|sums| Reaction {
            force: [sums[0], sums[1], sums[2]],
            sum_abs: sums[3],
            torque: sums[4],
            held: 0.0,
        });
        row.rigids = exerted.collect();
        self.dissipation += sums[1];
        row.energy_contact = sums[0];
        let states = finished.pairs.iter().zip(pairs.chunks_exact(2)).zip(depths);
        for ((pair, sums), gap_max) in states {
            self.book_state(pair.index, [sums[0], sums[1], gap_max], [0.0; 3], row);
        }
    }

    /// The same of pairs of bodies. Collective.
    pub fn book_bodies(&mut self, world: &World, met: &[Met], row: &mut HistoryRow) {
        let of_one = |one: &Met| {
            let [x, y, z] = one.force;
            [x, y, z, one.area, one.slid, one.friction, one.impact, one.energy]
        };
        let sums = world.sum_slice(&met.iter().flat_map(of_one).collect::<Vec<f64>>());
        let depths = world.max_slice(&met.iter().map(|one| one.depth).collect::<Vec<f64>>());
        for ((one, sums), gap_max) in met.iter().zip(sums.chunks_exact(8)).zip(depths) {
            self.dissipation += sums[5];
            self.impact += sums[6];
            row.energy_contact += sums[7];
            let force = [sums[0], sums[1], sums[2]];
            self.book_state(one.index, [sums[3], sums[4], gap_max], force, row);
        }
    }

    fn book_state(
        &mut self,
        index: usize,
        [area, slid, gap_max]: [f64; 3],
        force: [f64; 3],
        row: &mut HistoryRow,
    ) {
        row.contacts.resize(self.slip.len(), ContactState::default());
        if area > 0.0 {
            self.slip[index] += slid / area;
        }
        row.contacts[index] = ContactState { area, slip: self.slip[index], gap_max, force };
        (row.dissipation_friction, row.dissipation_impact) = (self.dissipation, self.impact);
    }
}
