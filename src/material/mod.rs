//! Material models in logarithmic strain, principal axes.
//!
//! The multiplicative split with the exponential map lets small-strain algorithms act on the
//! principal values of the trial elastic logarithmic strain (Lagrangian §2). A model turns them
//! into Kirchhoff stress, elastic strain and the consistent tangent; the axes do not change.
//!
//! | deck value | type | file | source |
//! |---|---|---|---|
//! | `hencky` | [`Hencky`] | `hencky.rs` | Lagrangian §2 |
//! | `von-mises` | [`VonMises`] | `von_mises.rs` | Lagrangian eq. 43 |

pub mod hencky;
pub mod von_mises;

#[cfg(test)]
mod tests;

pub use hencky::Hencky;
pub use von_mises::VonMises;

use crate::deck::model::MaterialModel;

/// What a model returns for one point, all in the principal axes of the trial strain.
#[derive(Debug, Clone, Copy)]
pub struct Response {
    /// Principal Kirchhoff stresses, Pa.
    pub stress: [f64; 3],
    /// Principal elastic logarithmic strains after the return.
    pub elastic_strain: [f64; 3],
    /// d stress_a / d trial_strain_b, Pa.
    pub tangent: [[f64; 3]; 3],
    /// (stress_a - stress_b) / (trial_strain_a - trial_strain_b) for the pairs 01, 12, 20, Pa,
    /// in the form that stays exact where the strains coincide.
    pub shear: [f64; 3],
    /// Norm of the plastic logarithmic strain increment.
    pub plastic_increment: f64,
    /// Plastic work of the increment per unit of initial volume, J/m3.
    pub dissipation: f64,
}

/// A material, dispatched once per point batch.
#[derive(Debug, Clone, Copy)]
pub enum Material {
    Hencky(Hencky),
    VonMises(VonMises),
}

impl Material {
    pub fn from_deck(model: &MaterialModel) -> Self {
        match *model {
            MaterialModel::Hencky { young, poisson } => {
                Material::Hencky(Hencky::new(young, poisson))
            }
            MaterialModel::VonMises { young, poisson, yield_stress } => {
                Material::VonMises(VonMises::new(Hencky::new(young, poisson), yield_stress))
            }
        }
    }

    /// Stress, strain and tangent for principal trial strains.
    #[inline(always)]
    pub fn respond(&self, trial: [f64; 3]) -> Response {
        match self {
            Material::Hencky(model) => model.respond(trial),
            Material::VonMises(model) => model.respond(trial),
        }
    }

    /// Whether the consistent tangent is symmetric: the flow is associated.
    pub fn symmetric(&self) -> bool {
        match self {
            Material::Hencky(_) | Material::VonMises(_) => true,
        }
    }

    /// The elastic part, for energies and wave speeds.
    pub fn elasticity(&self) -> &Hencky {
        match self {
            Material::Hencky(model) => model,
            Material::VonMises(model) => &model.elasticity,
        }
    }
}
