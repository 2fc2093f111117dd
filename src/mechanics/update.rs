//! eps_e,t = 1/2 ln(dF b_e,n dF^T): the trial elastic strain (Lagrangian §2) and the material's
//! response to it, in principal axes.
//!
//! dF and b_e come and go without their units, as dF - 1 and b_e - 1: strains of 1e-7 in 1 + strain
//! would keep nine digits only, and stiff bodies under small loads none that equilibrium needs.

use nalgebra::Matrix3;

use super::{Increment, StepStart, StressState};
use crate::material::{LocalMaterial, Response};
use crate::tensor::Spectrum;
use crate::tensor::dense::{self, Square};
use crate::tensor::spectral::ln_1p;

/// The constitutive update of one point, all in the principal axes of the trial strain.
pub(crate) struct Update {
    /// Trial b_e - 1: principal values b_a - 1 and axes; for D = 2 the last axis is z.
    pub trial: Spectrum,
    /// ln b_a
    pub logarithms: [f64; 3],
    pub response: Response,
}

/// Points of a batch of [`states`].
pub const BATCH: usize = 16;

/// Principal values and axes of dF b dF^T - 1 from e = b - 1 (`before`) and h = dF - 1
/// (`increment`): with a = dF b - 1 = h + e + h e it is a + h^T + a h^T.
#[inline(always)]
fn trial<const D: usize>(before: &Matrix3<f64>, increment: Increment<'_, D>) -> Spectrum {
    let Increment { block: increment, hoop } = increment;
    let mut half = dense::multiply(increment, &dense::block::<D>(before));
    for (i, row) in half.iter_mut().enumerate() {
        for (j, value) in row.iter_mut().enumerate() {
            *value += increment[i][j] + before[(i, j)];
        }
    }
    let row =
        |i: usize, j: usize| half[i][j] + increment[j][i] + dense::dot(&half[i], &increment[j]);
    if D == 2 {
        let zz = before[(2, 2)];
        Spectrum::plane(row(0, 0), row(1, 1), row(0, 1), zz + hoop * (2.0 + hoop) * (1.0 + zz))
    } else {
        Spectrum::space([row(0, 0), row(1, 1), row(2, 2)], [row(1, 2), row(0, 2), row(0, 1)])
    }
}

#[inline(always)]
pub(crate) fn update<const D: usize>(start: &StepStart, increment: Increment<'_, D>) -> Update {
    let trial = trial(start.elastic_excess, increment);
    let logarithms = trial.values.map(ln_1p);
    let response = start.material.respond(logarithms.map(|e| 0.5 * e), start.state);
    Update { trial, logarithms, response }
}

impl Update {
    #[inline(always)]
    pub(crate) fn state(&self, material: &LocalMaterial<'_>) -> StressState {
        let response = &self.response;
        StressState {
            kirchhoff_stress: self.trial.compose(response.stress),
            elastic_excess: self.trial.compose(elastic_values(&self.trial, response)),
            plastic_increment: response.plastic_increment,
            dissipation: response.dissipation,
            stored_energy: material.energy(response.elastic_strain),
            state: response.state,
        }
    }
}

/// Principal values of the new b_e - 1. Without plastic flow they are the trial ones: no detour
/// through ln and exp, no drift.
#[inline(always)]
fn elastic_values(trial: &Spectrum, response: &Response) -> [f64; 3] {
    if response.plastic_increment == 0.0 {
        trial.values
    } else {
        response.elastic_strain.map(|e| (2.0 * e).exp_m1())
    }
}

/// [`Update::state`] of up to [`BATCH`] points at once, the same to the last bit. The formulas run
/// in stages over all of them: roots, quotients and logarithms of one point wait for each other,
/// those of several points do not.
#[inline(always)]
pub(crate) fn states<'a, const D: usize>(
    start: impl Fn(usize) -> StepStart<'a>,
    increments: &[Square<D>],
    hoops: &[f64],
    out: &mut [StressState],
) {
    const NONE: Spectrum = Spectrum { values: [0.0; 3], axes: [[0.0; 3]; 3] };
    let Some(last) = increments.len().checked_sub(1) else { return };
    // Gathered once; what lies beyond the last point is not read.
    let starts: [StepStart; BATCH] = std::array::from_fn(|k| start(k.min(last)));
    let starts = &starts[..increments.len()];
    let mut trials = [NONE; BATCH];
    let trials = &mut trials[..increments.len()];
    let (mut stresses, mut values) = ([[0.0; 3]; BATCH], [[0.0; 3]; BATCH]);
    for (k, (trial_of, block)) in trials.iter_mut().zip(increments).enumerate() {
        let hoop = hoops.get(k).copied().unwrap_or(0.0);
        *trial_of = trial(starts[k].elastic_excess, Increment { block, hoop });
    }
    for (strain, trial) in values.iter_mut().zip(&*trials) {
        *strain = trial.values.map(ln_1p);
    }
    let strains = values;
    let mut take = |k: usize, response: Response, energy: f64| {
        stresses[k] = response.stress;
        values[k] = elastic_values(&trials[k], &response);
        let state = &mut out[k];
        state.plastic_increment = response.plastic_increment;
        state.dissipation = response.dissipation;
        state.stored_energy = energy;
        state.state = response.state;
    };
    let strain = |k: usize| strains[k].map(|e| 0.5 * e);
    let first = starts[0].material;
    if starts.iter().all(|start| start.material.shares_parameters(&first)) {
        // The model is chosen once for all of them.
        first.material.respond_each(starts.len(), strain, |k| starts[k].state, take);
    } else {
        for (k, start) in starts.iter().enumerate() {
            let response = start.material.respond(strain(k), start.state);
            take(k, response, start.material.energy(response.elastic_strain));
        }
    }
    for (k, (state, trial)) in out.iter_mut().zip(&*trials).enumerate() {
        state.kirchhoff_stress = trial.compose(stresses[k]);
        state.elastic_excess = trial.compose(values[k]);
    }
}
