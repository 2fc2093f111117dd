//! What contacts tell of a step, and their sums over a run.

use crate::contact::facets::Facets;
use crate::contact::pose::Pose;
use crate::contact::surface::length;
use crate::error::Result;
use crate::output::restart::run_state::RunState;
use crate::output::series::rigid_file::RigidFrame;
use crate::output::tables::history::{ContactState, HistoryRow, Reaction};
use crate::parallel::World;
use crate::system::model::Model;
use crate::system::terms::contact::Finished;

/// The surfaces of the rigid bodies in these poses; of half spaces what crosses the grid.
pub fn surfaces<const D: usize>(model: &Model<D>, poses: &[Pose<D>]) -> RigidFrame<D> {
    let (low, high) = model.grid.bounds();
    let middle: [f64; D] = std::array::from_fn(|a| 0.5 * (low[a] + high[a]));
    let reach: [f64; D] = std::array::from_fn(|a| 0.5 * (high[a] - low[a]));
    let mut all = Facets::default();
    let mut body = Vec::new();
    for (index, (rigid, pose)) in model.contacts.rigids.iter().zip(poses).enumerate() {
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
    /// Mean slip of each contact, m.
    slip: Vec<f64>,
}

impl ContactTotals {
    /// Of so many contacts.
    pub fn new(contacts: usize) -> Self {
        ContactTotals { dissipation: 0.0, slip: vec![0.0; contacts] }
    }

    pub fn save(&self, state: &mut RunState) {
        if self.slip.is_empty() {
            return;
        }
        state.set("contact.dissipation", self.dissipation);
        for (k, slip) in self.slip.iter().enumerate() {
            state.set(&format!("contact.slip.{k}"), *slip);
        }
    }

    pub fn restore(&mut self, state: &RunState) -> Result<()> {
        if self.slip.is_empty() {
            return Ok(());
        }
        self.dissipation = state.number("contact.dissipation")?;
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
        (row.energy_contact, row.dissipation_friction) = (sums[0], self.dissipation);
        let states = pairs.chunks_exact(2).zip(&mut self.slip).zip(depths);
        row.contacts = states
            .map(|((sums, slip), gap_max)| {
                if sums[0] > 0.0 {
                    *slip += sums[1] / sums[0];
                }
                ContactState { area: sums[0], slip: *slip, gap_max }
            })
            .collect();
    }
}
