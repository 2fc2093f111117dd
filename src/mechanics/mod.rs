//! Finite-strain kinematics, stress and tangent in three frames.
//!
//! | deck value | equilibrium over | stress | gradients | volume | source |
//! |---|---|---|---|---|---|
//! | `previous` | last converged state | P~ (eq. 18) | d/dX~ | V_n | Lagrangian §5, A.2 |
//! | `updated` | current state | Cauchy | d/dx | V | Lagrangian §3, A.1 |
//! | `total` | initial state | P | d/dX (eq. 12) | V_0 | Lagrangian §4 |

use nalgebra::Matrix3;

use crate::deck::model::Frame;
use crate::material::Material;

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
#[derive(Debug, Clone, Copy)]
pub struct StressState {
    pub kirchhoff_stress: Matrix3<f64>,
    pub elastic_left_cauchy_green: Matrix3<f64>,
    pub plastic_increment: f64,
    pub dissipation: f64,
    /// Stored energy per unit of initial volume, J/m3.
    pub stored_energy: f64,
}

/// Inputs at a point that stay fixed during a step.
#[derive(Debug, Clone, Copy)]
pub struct StepStart<'a> {
    pub material: &'a Material,
    /// F_n
    pub deformation_gradient: &'a Matrix3<f64>,
    /// b_e at the start of the step
    pub elastic_left_cauchy_green: &'a Matrix3<f64>,
    /// V0, m3
    pub volume_initial: f64,
}

/// Stress only (explicit steps, last evaluation).
pub fn stress<const D: usize>(_start: &StepStart, _increment: &[[f64; D]; D]) -> StressState {
    todo!()
}

/// Stress and tangent in `frame` for the increment dF = 1 + d(du)/dX~ (Lagrangian eq. 7).
pub fn contribution<const D: usize>(
    _frame: Frame,
    _start: &StepStart,
    _increment: &[[f64; D]; D],
) -> (Contribution<D>, StressState) {
    todo!()
}
