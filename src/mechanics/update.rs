//! eps_e,t = 1/2 ln(dF b_e,n dF^T): the trial elastic strain (Lagrangian §2) and what the
//! material makes of it, in principal axes.

use super::{StepStart, StressState};
use crate::material::{Material, Response};
use crate::tensor::Spectrum;
use crate::tensor::dense::{self, Square};

/// The constitutive update of one point, all in the principal axes of the trial strain.
pub(super) struct Update {
    /// Trial b_e: principal values b_a and axes; for D = 2 the last axis is z.
    pub trial: Spectrum,
    /// ln b_a
    pub logarithms: [f64; 3],
    pub response: Response,
}

#[inline(always)]
pub(super) fn update<const D: usize>(start: &StepStart, increment: &Square<D>) -> Update {
    let before = start.elastic_left_cauchy_green;
    let half = dense::multiply(increment, &dense::block::<D>(before));
    let row = |i: usize, j: usize| dense::dot(&half[i], &increment[j]);
    let trial = if D == 2 {
        Spectrum::plane(row(0, 0), row(1, 1), row(0, 1), before[(2, 2)])
    } else {
        Spectrum::space([row(0, 0), row(1, 1), row(2, 2)], [row(1, 2), row(0, 2), row(0, 1)])
    };
    let logarithms = trial.values.map(f64::ln);
    let response = start.material.respond(logarithms.map(|e| 0.5 * e));
    Update { trial, logarithms, response }
}

impl Update {
    #[inline(always)]
    pub(super) fn state(&self, material: &Material) -> StressState {
        let response = &self.response;
        // Without plastic flow b_e is the trial one: no detour through ln and exp, no drift.
        let elastic = if response.plastic_increment == 0.0 {
            self.trial.values
        } else {
            response.elastic_strain.map(|e| (2.0 * e).exp())
        };
        StressState {
            kirchhoff_stress: self.trial.compose(response.stress),
            elastic_left_cauchy_green: self.trial.compose(elastic),
            plastic_increment: response.plastic_increment,
            dissipation: response.dissipation,
            stored_energy: material.elasticity().energy(response.elastic_strain),
        }
    }
}
