//! eps_e,t = 1/2 ln(dF b_e,n dF^T): the trial elastic strain (Lagrangian §2) and what the
//! material makes of it, in principal axes.

use nalgebra::Matrix3;

use super::{StepStart, StressState};
use crate::material::{Material, Response};
use crate::tensor::Spectrum;
use crate::tensor::dense::{self, Square};

/// The constitutive update of one point, all in the principal axes of the trial strain.
pub(crate) struct Update {
    /// Trial b_e: principal values b_a and axes; for D = 2 the last axis is z.
    pub trial: Spectrum,
    /// ln b_a
    pub logarithms: [f64; 3],
    pub response: Response,
}

/// Points of a batch of [`states`].
pub const BATCH: usize = 16;

/// Principal values and axes of dF b_e,n dF^T.
#[inline(always)]
fn trial<const D: usize>(before: &Matrix3<f64>, increment: &Square<D>) -> Spectrum {
    let half = dense::multiply(increment, &dense::block::<D>(before));
    let row = |i: usize, j: usize| dense::dot(&half[i], &increment[j]);
    if D == 2 {
        Spectrum::plane(row(0, 0), row(1, 1), row(0, 1), before[(2, 2)])
    } else {
        Spectrum::space([row(0, 0), row(1, 1), row(2, 2)], [row(1, 2), row(0, 2), row(0, 1)])
    }
}

#[inline(always)]
pub(crate) fn update<const D: usize>(start: &StepStart, increment: &Square<D>) -> Update {
    let trial = trial(start.elastic_left_cauchy_green, increment);
    let logarithms = trial.values.map(f64::ln);
    let response = start.material.respond(logarithms.map(|e| 0.5 * e));
    Update { trial, logarithms, response }
}

impl Update {
    #[inline(always)]
    pub(crate) fn state(&self, material: &Material) -> StressState {
        let response = &self.response;
        StressState {
            kirchhoff_stress: self.trial.compose(response.stress),
            elastic_left_cauchy_green: self.trial.compose(elastic_values(&self.trial, response)),
            plastic_increment: response.plastic_increment,
            dissipation: response.dissipation,
            stored_energy: material.elasticity().energy(response.elastic_strain),
        }
    }
}

/// Principal values of the new b_e. Without plastic flow they are the trial ones: no detour
/// through ln and exp, no drift.
#[inline(always)]
fn elastic_values(trial: &Spectrum, response: &Response) -> [f64; 3] {
    if response.plastic_increment == 0.0 {
        trial.values
    } else {
        response.elastic_strain.map(|e| (2.0 * e).exp())
    }
}

/// [`Update::state`] of up to [`BATCH`] points at once, the same to the last bit. The formulas run
/// in stages over all of them: roots, quotients and logarithms of one point wait for each other,
/// those of several points do not.
#[inline(always)]
pub(crate) fn states<'a, const D: usize>(
    start: impl Fn(usize) -> StepStart<'a>,
    increments: &[Square<D>],
    out: &mut [StressState],
) {
    const UNIT: Spectrum = Spectrum { values: [1.0; 3], axes: [[0.0; 3]; 3] };
    let mut trials = [UNIT; BATCH];
    let trials = &mut trials[..increments.len()];
    let (mut stresses, mut values) = ([[0.0; 3]; BATCH], [[0.0; 3]; BATCH]);
    for (k, (trial_of, increment)) in trials.iter_mut().zip(increments).enumerate() {
        *trial_of = trial(start(k).elastic_left_cauchy_green, increment);
    }
    for (strain, trial) in values.iter_mut().zip(&*trials) {
        *strain = trial.values.map(f64::ln);
    }
    for (k, (state, trial)) in out.iter_mut().zip(&*trials).enumerate() {
        let material = start(k).material;
        let response = material.respond(values[k].map(|e| 0.5 * e));
        stresses[k] = response.stress;
        values[k] = elastic_values(trial, &response);
        state.plastic_increment = response.plastic_increment;
        state.dissipation = response.dissipation;
        state.stored_energy = material.elasticity().energy(response.elastic_strain);
    }
    for (k, (state, trial)) in out.iter_mut().zip(&*trials).enumerate() {
        state.kirchhoff_stress = trial.compose(stresses[k]);
        state.elastic_left_cauchy_green = trial.compose(values[k]);
    }
}
