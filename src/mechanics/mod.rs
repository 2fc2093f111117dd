//! Finite-strain kinematics, stress and tangent in three frames.
//!
//! | deck value | equilibrium over | stress | gradients | volume | source |
//! |---|---|---|---|---|---|
//! | `previous` | last converged state | P~ (eq. 18) | d/dX~ | V_n | Lagrangian §5, A.2 |
//! | `updated` | current state | Cauchy | d/dx | V | Lagrangian §3, A.1 |
//! | `total` | initial state | P | d/dX (eq. 12) | V_0 | Lagrangian §4 |
//!
//! | file | idea |
//! |---|---|
//! | `mod.rs` | what the assembly sees |
//! | `update.rs` | trial strain, material, new elastic strain: in principal axes |
//! | `dilation.rs` | F-bar: the change of volume of cells |
//! | `ring.rs` | what the hoop direction adds with axisymmetry |
//! | `tangent.rs` | from principal moduli to A_ijkl of a frame |

pub(crate) mod dilation;
pub(crate) mod ring;
mod tangent;
mod update;

#[cfg(test)]
mod paper_tests;
#[cfg(test)]
mod tests;

pub use dilation::Dilation;
pub use ring::{Hoop, ring_contribution, shared_ring_contribution};
pub use tangent::Expansion;
pub use update::BATCH;

use nalgebra::Matrix3;

use crate::deck::model::Frame;
use crate::material::{LocalMaterial, MOST_STATE};
use crate::tensor::dense::{self, Square};

/// One point's contribution to equilibrium, in the chosen frame y:
/// f_ai = T_ij (dS_a/dy_j) V and K_aibk = (dS_a/dy_j) A_ijkl (dS_b/dy_l) V,
/// where dS/dy_j = dS/dX~_i G_ij.
#[derive(Debug, Clone, Copy)]
pub struct Contribution<const D: usize> {
    /// T, Pa: P~, sigma or P.
    pub stress: [[f64; D]; D],
    /// A_ijkl, Pa.
    pub tangent: [[[[f64; D]; D]; D]; D],
    /// G: identity, dF^-1 or F_n.
    pub gradient_map: [[f64; D]; D],
    /// Volume consistent with the frame, m3.
    pub volume: f64,
}

/// What the constitutive update leaves at the point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StressState {
    /// tau, Pa.
    pub kirchhoff_stress: Matrix3<f64>,
    /// b_e - 1
    pub elastic_excess: Matrix3<f64>,
    /// Norm of the step's plastic logarithmic strain.
    pub plastic_increment: f64,
    /// Of the step, J per m3 of initial volume.
    pub dissipation: f64,
    /// Stored energy per unit of initial volume, J/m3.
    pub stored_energy: f64,
    /// The material's state variables.
    pub state: [f64; MOST_STATE],
}

/// dF - 1 of a step.
#[derive(Debug, Clone, Copy)]
pub struct Increment<'a, const D: usize> {
    /// Its rows and columns along the grid's axes: d(du)/dX~ (Lagrangian eq. 7).
    pub block: &'a Square<D>,
    /// For D = 2 dF_zz - 1: u_r / r with axisymmetry, zero in plane strain.
    pub hoop: f64,
}

impl<'a, const D: usize> From<&'a Square<D>> for Increment<'a, D> {
    #[inline(always)]
    fn from(block: &'a Square<D>) -> Self {
        Increment { block, hoop: 0.0 }
    }
}

/// Inputs at a point that stay fixed during a step.
#[derive(Debug, Clone, Copy)]
pub struct StepStart<'a> {
    /// Of the point's body, with its parameters at the point.
    pub material: LocalMaterial<'a>,
    /// The material's state variables at the start of the step
    pub state: &'a [f64],
    /// F_n
    pub deformation_gradient: &'a Matrix3<f64>,
    /// b_e - 1 at the start of the step
    pub elastic_excess: &'a Matrix3<f64>,
    /// V0, m3
    pub volume_initial: f64,
}

/// Stress only (explicit steps, last evaluation) for the increment dF - 1. det dF < 0 is taken as it comes; a singular
/// or not finite dF gives stresses that are not finite.
#[inline]
pub fn stress<'a, const D: usize>(
    start: &StepStart,
    increment: impl Into<Increment<'a, D>>,
) -> StressState {
    update::update(start, increment.into()).state(&start.material)
}

/// [`stress`] of at most [`BATCH`] points at once, the same to the last bit: `start` gives the
/// state of each before the step, `out` takes the one after it. `hoops`: dF_zz - 1 with axisymmetry,
/// else empty.
pub fn stresses<'a, const D: usize>(
    start: impl Fn(usize) -> StepStart<'a>,
    increments: &[[[f64; D]; D]],
    hoops: &[f64],
    out: &mut [StressState],
) {
    update::states(start, increments, hoops, out);
}

/// Stress and tangent in `frame` for the increment dF - 1 = d(du)/dX~ (Lagrangian eq. 7).
/// Plane strain for D = 2: dF_zz = 1. Limits as in [`stress`].
#[inline(always)]
pub fn contribution<const D: usize>(
    frame: Frame,
    start: &StepStart,
    increment: &[[f64; D]; D],
) -> (Contribution<D>, StressState) {
    let update = update::update(start, increment.into());
    let placement = Placement::new(frame, start, &dense::plus_unit(increment), 1.0);
    (placement.contribution(&update), update.state(&start.material))
}

/// [`contribution`] with F-bar: `common` is det dF_0 - 1. The stress, its part of the tangent and the
/// state are those of dF_bar; [`Dilation`] is what the force and the tangent have beside.
#[inline]
pub fn averaged_contribution<const D: usize>(
    frame: Frame,
    start: &StepStart,
    increment: &[[f64; D]; D],
    common: f64,
) -> (Contribution<D>, Dilation<D>, StressState) {
    let update = update::update(start, (&dilation::within(increment, common)).into());
    let placement = Placement::new(frame, start, &dense::plus_unit(increment), 1.0);
    let contribution = placement.contribution(&update);
    let sums = tangent::sums(&update.response, D);
    let moduli = sums.expansion(&update, (&placement.back, 0.0), placement.scale);
    let dilation = Dilation::new(moduli, 1.0 / D as f64, increment.into());
    (contribution, dilation, update.state(&start.material))
}

/// [`contribution`] with F-bar, split for the assembly ([`dilation`]): what the point's own gradients
/// carry, s and A', and as an [`Expansion`] what its cells' do, Q, q, kappa/n^2 and pi/n. `common` is
/// det dF_0 - 1.
#[inline(always)]
pub fn shared_contribution<const D: usize>(
    frame: Frame,
    start: &StepStart,
    increment: &[[f64; D]; D],
    common: f64,
) -> (Contribution<D>, Expansion<D>, StressState) {
    let mut update = update::update(start, (&dilation::within(increment, common)).into());
    let state = update.state(&start.material);
    let placement = Placement::new(frame, start, &dense::plus_unit(increment), 1.0);
    let sums = tangent::sums(&update.response, D).take_from(&mut update.response, D);
    let share = sums.expansion(&update, (&placement.back, 0.0), placement.scale);
    (placement.contribution(&update), share, state)
}

/// dF_zz - 1 = Σ_a H_a u_ar of a ring ([`crate::basis::radial`]).
#[inline]
pub fn hoop_increment<const D: usize>(
    rows: &[f64],
    displacement: impl Fn(usize) -> [f64; D],
) -> f64 {
    rows.iter().enumerate().map(|(a, row)| row * displacement(a)[0]).sum()
}

/// dF - 1 = Σ_a u_a ⊗ dS_a/dX~ (Lagrangian eq. 7): without the unit, in which small gradients
/// would lose their digits.
#[inline]
pub fn displacement_gradient<const D: usize>(
    gradients: &[[f64; D]],
    displacement: impl Fn(usize) -> [f64; D],
) -> [[f64; D]; D] {
    let mut increment = [[0.0; D]; D];
    for (a, gradient) in gradients.iter().enumerate() {
        let u = displacement(a);
        for i in 0..D {
            for j in 0..D {
                increment[i][j] += u[i] * gradient[j];
            }
        }
    }
    increment
}

/// How a frame y lies to the current state x: T_ij = scale tau_im (dy/dx)_jm.
struct Placement<const D: usize> {
    /// dy/dx
    back: Square<D>,
    /// V0 / V_frame
    scale: f64,
    gradient_map: Square<D>,
    volume: f64,
}

impl<const D: usize> Placement<D> {
    /// Of the increment dF; `out_of_plane` is dF_zz for D = 2.
    #[inline]
    fn new(frame: Frame, start: &StepStart, increment: &Square<D>, out_of_plane: f64) -> Self {
        let start_gradient = dense::block::<D>(start.deformation_gradient);
        let start_zz = if D == 2 { start.deformation_gradient[(2, 2)] } else { 1.0 };
        let (inverse, det) = dense::inverse(increment);
        let start_det = dense::determinant(&start_gradient) * start_zz;
        let (back, gradient_map, ratio) = match frame {
            Frame::Previous => (inverse, dense::identity(), start_det),
            Frame::Updated => (dense::identity(), inverse, det * out_of_plane * start_det),
            Frame::Total => {
                let (start_inverse, _) = dense::inverse(&start_gradient);
                (dense::multiply(&start_inverse, &inverse), start_gradient, 1.0)
            }
        };
        let volume = ratio * start.volume_initial;
        Placement { back, scale: 1.0 / ratio, gradient_map, volume }
    }

    #[inline(always)]
    fn contribution(&self, update: &update::Update) -> Contribution<D> {
        let (stress, tangent) = tangent::pull_back(update, &self.back, self.scale);
        let (gradient_map, volume) = (self.gradient_map, self.volume);
        Contribution { stress, tangent, gradient_map, volume }
    }
}
