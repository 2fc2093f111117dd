//! A_ijkl = s H_jm H_ln (dtau_im/dL_kn - tau_in delta_mk) with L = d(dF) dF^-1 and H = dy/dx:
//! Lagrangian (A.1) for `updated`, (A.3) for `previous`, one formula for the three frames.
//!
//! In the principal axes of the trial b the fourth-order tensor is sparse (a, b not summed):
//! dtau_aa = c_ab L_bb and, for a != b, dtau_ab = r_ab (b_b L_ab + b_a L_ba) with
//! r_ab = (tau_a - tau_b) / (b_a - b_b). The stress term joins the same places:
//! M_aabb = c_ab - tau_a delta_ab, M_abab = r_ab b_b, M_abba = r_ab b_a - tau_a.

use super::update::Update;
use crate::material::Response;
use crate::tensor::dense::{Square, dot};
use crate::tensor::spectral::logarithm_slope;

/// Stress T and tangent A; `back` is H, `scale` s = V0 / V_frame.
#[inline(always)]
pub(crate) fn pull_back<const D: usize>(
    update: &Update,
    back: &Square<D>,
    scale: f64,
) -> (Square<D>, [[Square<D>; D]; D]) {
    let stress = &update.response.stress;
    // Axes on the current state's side, and carried back to the frame.
    let here: Square<D> = std::array::from_fn(|a| std::array::from_fn(|i| update.trial.axes[a][i]));
    let there: Square<D> =
        std::array::from_fn(|a| std::array::from_fn(|j| dot(&back[j], &here[a])));

    let mut frame_stress = [[0.0; D]; D];
    for a in 0..D {
        for i in 0..D {
            let force = scale * stress[a] * here[a][i];
            for j in 0..D {
                frame_stress[i][j] += force * there[a][j];
            }
        }
    }

    // M_abcd n_c x (H n_d), for each pair (a, b).
    let mut half = [[[[0.0; D]; D]; D]; D];
    for a in 0..D {
        for c in 0..D {
            let own = if a == c { stress[a] } else { 0.0 };
            let modulus = scale * (update.response.tangent[a][c] - own);
            add(&mut half[a][a], modulus, &here[c], &there[c]);
        }
        for b in 0..D {
            if a != b {
                let rate = scale * shear_rate(update, a, b);
                let values = &update.trial.values;
                add(&mut half[a][b], rate * (1.0 + values[b]), &here[a], &there[b]);
                let cross = rate * (1.0 + values[a]) - scale * stress[a];
                add(&mut half[a][b], cross, &here[b], &there[a]);
            }
        }
    }

    let mut tangent = [[[[0.0; D]; D]; D]; D];
    for j in 0..D {
        for a in 0..D {
            // The second index first: sum_b (H n_b)_j half_ab.
            let mut partial = [[0.0; D]; D];
            for b in 0..D {
                accumulate(&mut partial, there[b][j], &half[a][b]);
            }
            for i in 0..D {
                accumulate(&mut tangent[i][j], here[a][i], &partial);
            }
        }
    }
    (frame_stress, tangent)
}

/// What the stress does in a uniform expansion of the first n directions, and what their mean stress does
/// in any strain; Pa per volume of the frame.
#[derive(Debug, Clone, Copy)]
pub struct Expansion<const D: usize> {
    /// R_ij = s H_jm dtau_im for L = 1: sum_c c_ac n_a x (H n_a)
    pub rate: Square<D>,
    /// R_zz, with one factor dy/dx of the hoop
    pub hoop_rate: f64,
    /// l_kl = s H_ln dpi/dL_kn: sum_a c_ab n_b x (H n_b), pi = sum_a tau_a
    pub onto: Square<D>,
    /// l_zz, with one factor dy/dx of the hoop
    pub hoop_onto: f64,
    /// kappa: s dpi for L = 1
    pub own: f64,
    /// s pi
    pub trace: f64,
}

/// [`Expansion`] in the principal axes.
pub(crate) struct Sums {
    /// sum_c c_ac
    rate: [f64; 3],
    /// sum_a c_ab
    onto: [f64; 3],
    /// Of either over the directions
    own: f64,
    /// Of the stresses
    trace: f64,
}

/// Of the first `directions` axes, 3 with the hoop.
#[inline(always)]
pub(crate) fn sums(response: &Response, directions: usize) -> Sums {
    let moduli = &response.tangent;
    let mut sums = Sums { rate: [0.0; 3], onto: [0.0; 3], own: 0.0, trace: 0.0 };
    for a in 0..directions {
        for b in 0..directions {
            sums.rate[a] += moduli[a][b];
            sums.onto[b] += moduli[a][b];
        }
        sums.own += sums.rate[a];
        sums.trace += response.stress[a];
    }
    sums
}

impl Sums {
    /// Takes the mean stress of n directions out of `response`, which then has tau - pi/n and, with
    /// P = 1 - 1/n, P c P. What is left is the mean's: (sum_c c_ac - kappa/n) / n, as much of the columns,
    /// kappa/n^2 and pi/n.
    #[inline(always)]
    pub fn take_from(self, response: &mut Response, directions: usize) -> Sums {
        let share = 1.0 / directions as f64;
        let mean = share * self.own;
        let lessen = |sums: [f64; 3]| sums.map(|sum| share * (sum - mean));
        let (rate, onto) = (lessen(self.rate), lessen(self.onto));
        let (own, trace) = (share * mean, share * self.trace);
        for a in 0..directions {
            response.stress[a] -= trace;
            for b in 0..directions {
                response.tangent[a][b] -= rate[a] + onto[b] + own;
            }
        }
        Sums { rate, onto, own, trace }
    }

    /// Along the axes of the grid; `back` is H, the hoop's behind (zero without), `scale` s.
    #[inline(always)]
    pub fn expansion<const D: usize>(
        &self,
        update: &Update,
        back: (&Square<D>, f64),
        scale: f64,
    ) -> Expansion<D> {
        let (mut rate, mut onto) = ([[0.0; D]; D], [[0.0; D]; D]);
        for a in 0..D {
            let here: [f64; D] = std::array::from_fn(|i| update.trial.axes[a][i]);
            let there: [f64; D] = std::array::from_fn(|j| dot(&back.0[j], &here));
            add(&mut rate, scale * self.rate[a], &here, &there);
            add(&mut onto, scale * self.onto[a], &here, &there);
        }
        let hoop = scale * back.1;
        Expansion {
            rate,
            hoop_rate: hoop * self.rate[2],
            onto,
            hoop_onto: hoop * self.onto[2],
            own: scale * self.own,
            trace: scale * self.trace,
        }
    }
}

/// s_h H_jm dtau_im for L_zz = 1, and s_h H_ln dtau_zz for L_kn, `scale` s_h with the dy/dx of the
/// hoop: A_ijzz and A_zzkl of a ring.
#[inline]
pub(crate) fn coupling<const D: usize>(
    update: &Update,
    back: &Square<D>,
    scale: f64,
) -> (Square<D>, Square<D>) {
    let (mut from, mut onto) = ([[0.0; D]; D], [[0.0; D]; D]);
    for a in 0..D {
        let here: [f64; D] = std::array::from_fn(|i| update.trial.axes[a][i]);
        let there: [f64; D] = std::array::from_fn(|j| dot(&back[j], &here));
        add(&mut from, scale * update.response.tangent[a][2], &here, &there);
        add(&mut onto, scale * update.response.tangent[2][a], &here, &there);
    }
    (from, onto)
}

/// r_ab = (tau_a - tau_b) / (b_a - b_b), exact also where the values coincide.
#[inline]
fn shear_rate(update: &Update, a: usize, b: usize) -> f64 {
    let (values, logs) = (&update.trial.values, &update.logarithms);
    0.5 * update.response.shear[pair(a, b)]
        * logarithm_slope(values[a], values[b], logs[a], logs[b])
}

/// Place of the pair in the order 01, 12, 20 of [`Response::shear`](crate::material::Response).
#[inline]
fn pair(a: usize, b: usize) -> usize {
    if a + b == 2 { 2 } else { a.min(b) }
}

#[inline(always)]
fn add<const D: usize>(sum: &mut Square<D>, factor: f64, n: &[f64; D], m: &[f64; D]) {
    for k in 0..D {
        for l in 0..D {
            sum[k][l] += factor * n[k] * m[l];
        }
    }
}

#[inline(always)]
fn accumulate<const D: usize>(sum: &mut Square<D>, factor: f64, term: &Square<D>) {
    for k in 0..D {
        for l in 0..D {
            sum[k][l] += factor * term[k][l];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::pair;

    #[test]
    fn pairs_follow_the_material() {
        for (place, (a, b)) in [(0, 1), (1, 2), (2, 0)].into_iter().enumerate() {
            assert_eq!((pair(a, b), pair(b, a)), (place, place));
        }
    }
}
